//! A source that limits its current: closed forms of the link's capacitor and the winding.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

use super::script::{LINK, Script, same_bits_in_lanes, stage};
use Leg::{High, Low, Off};
use standstill_interface::{Command, Leg, Nanos, Reading, Sampling};
use standstill_inverter::{Bridge, DcLink, GateTiming, Inverter, Storage};
use standstill_plant::{Motor, built_in};
use standstill_sim::{Case, NoProbe, referee, run};

const CAPACITANCE: f64 = 100e-6;
/// Between samples in s.
const APART: f64 = 50e-6;

/// A winding without resistance.
fn motor() -> Motor {
    let mut motor = built_in("paper-5k5").expect("built in").linearised();
    motor.resistance = 0.0;
    motor
}

fn case(motor: &Motor, source_resistance: f64, most: f64) -> Case<'_> {
    let storage = Some(Storage { capacitance: CAPACITANCE, source_resistance });
    let inverter = Inverter {
        bridge: Bridge::default(),
        gates: [GateTiming::default(); 3],
        link: DcLink { storage, most_current: Some(most), ..DcLink::stiff(LINK) },
        carrier_period: Nanos::from_micros(100),
    };
    // The axis of the magnet along the line a-b, so that phase c carries nothing.
    Case { start_angle: -std::f64::consts::FRAC_PI_6, ..Case::new(motor, inverter) }
}

/// A pulse on the line a-b of 500 µs with ten samples.
fn pulse() -> Command<f64> {
    let sampling =
        Sampling { first: Nanos::from_seconds(APART), interval: Nanos::from_seconds(APART), count: 10 };
    Command::hold(stage([High, Low, Off], 500), sampling)
}

fn readings(case: &Case<'_>) -> Vec<Reading<f64>> {
    let mut script = Script::new([pulse()]);
    let ledger = run(case, &mut script, true, &mut NoProbe).ledger.expect("asked for");
    let scale = 0.5 * CAPACITANCE * LINK * LINK;
    assert!(ledger.imbalance().abs() < 1e-7 * scale, "{} {ledger:?}", ledger.imbalance());
    let mut again = Script::new([pulse()]);
    referee(case, &mut again, false, &mut NoProbe);
    for (one, other) in script.readings.iter().zip(&again.readings) {
        let [a, b] = [one, other].map(|of| of.current.0[0]);
        assert!((a - b).abs() < 1e-6 * b.abs(), "{a} {b}");
        assert!((one.dc_link - other.dc_link).abs() < 2e-6 * LINK, "{one:?} {other:?}");
    }
    script.readings
}

/// Voltage and current of a capacitor that feeds a line of two phases, and is fed by a current `fed`, after a time: `C v̇ = fed − i`,
/// `L i̇ = v`.
fn resonance(line: f64, [voltage, current]: [f64; 2], fed: f64, time: f64) -> [f64; 2] {
    let (rate, impedance) = (1.0 / (line * CAPACITANCE).sqrt(), (line / CAPACITANCE).sqrt());
    let (sin, cos) = (rate * time).sin_cos();
    let more = current - fed;
    [voltage * cos - more * impedance * sin, fed + more * cos + voltage / impedance * sin]
}

/// What the bridge takes beyond the limit comes from the capacitor alone: the link falls by `(i − I) t / C` of the mean current.
#[test]
fn analytic_beyond_its_limit_the_capacitor_alone_feeds_the_bridge() {
    let motor = motor();
    let line = 2.0 * motor.winding.d_axis_inductance();
    for (resistance, most) in [(0.2, 0.0), (0.2, 1.0), (0.05, 1.0)] {
        let all = readings(&case(&motor, resistance, most));
        assert_eq!(all.len(), 10);
        let at = |reading: &Reading<f64>| [reading.dc_link, reading.current.0[0]];
        let is_limited = |pair: &&[Reading<f64>]| LINK - pair[0].dc_link >= resistance * most;
        let pairs: Vec<_> = all.windows(2).filter(is_limited).collect();
        assert!(
            pairs.len() >= 8,
            "1 A flow after 26 µs, and the capacitor follows within 20 µs more: {all:?}"
        );
        for pair in pairs {
            let [voltage, current] = resonance(line, at(&pair[0]), most, APART);
            let [found, flows] = at(&pair[1]);
            assert!(
                (found - voltage).abs() < 1e-8 * LINK,
                "{resistance} Ω, {most} A: {found} V, not {voltage}"
            );
            assert!(
                (flows - current).abs() < 1e-7 * current,
                "{resistance} Ω, {most} A: {flows} A, not {current}"
            );
            let mean = 0.5 * (at(&pair[0])[1] + current);
            let fall = (mean - most) * APART / CAPACITANCE;
            assert!((at(&pair[0])[0] - found - fall).abs() < 0.02 * fall, "{fall} V");
        }
    }
    // From the beginning, where the source gives nothing at all.
    let first = &readings(&case(&motor, 0.2, 0.0))[0];
    let [voltage, current] = resonance(line, [LINK, 0.0], 0.0, APART);
    assert!((first.dc_link - voltage).abs() < 1e-8 * LINK, "{first:?}");
    assert!((first.current.0[0] - current).abs() < 1e-7 * current, "{first:?}");
}

/// A limit that is not reached is none, and machines with one run side by side as alone.
#[test]
fn law_a_limit_beyond_the_current_changes_nothing() {
    let motor = motor();
    let limited = case(&motor, 0.2, 1e3);
    let mut without = limited.clone();
    without.inverter.link.most_current = None;
    let [limited, without] = [limited, without].map(|case| {
        let mut script = Script::new([pulse()]);
        run(&case, &mut script, false, &mut NoProbe);
        script.readings
    });
    assert_eq!(limited, without);
    let script = Script::new([pulse(), Command::hold(stage([Off; 3], 500), Sampling::NONE)]);
    let cases: Vec<_> =
        [0.5, 1.0, 2.0].map(|most| (case(&motor, 0.1, most), script.clone())).into_iter().collect();
    same_bits_in_lanes(&cases);
}
