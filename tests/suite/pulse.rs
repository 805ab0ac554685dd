//! Single lines: closed forms, and another program's currents.

use standstill_detect::Decay;
use standstill_interface::{Command, Nanos, Phase, Sampling, Stage};
use standstill_inverter::{Bridge, Conduction, Devices, Inverter, OpenLeg};
use standstill_sim::{Event, NoProbe, Tolerance, Trace, run};

use crate::bench::{Script, exact_case, ideal_inverter, reference_motor};

const ANGLE: f64 = 43.2;

#[test]
fn analytic_line_pulse_from_rest() {
    // i = U/2R (1 − exp(−2R t/L_AB)): the third leg carries no current during the pulse.
    let motor = reference_motor();
    let line = motor.winding.line_inductances(ANGLE.to_radians())[Phase::A];
    assert!((line - 32.8474e-3).abs() < 1e-7, "{line}");
    let exact = 275.0 * (1.0 - (-2.0 * 80e-6 / line).exp());
    assert!((exact - 1.336_270).abs() < 1e-6, "{exact}");

    let pulse = Nanos::from_micros(80);
    let command = Command::hold(Stage::line(Phase::A, Phase::B, pulse), Sampling::once(pulse));
    for open_leg in [OpenLeg::Diodes, OpenLeg::Open] {
        let mut script = Script::new(vec![command]);
        let case = exact_case(&motor, ideal_inverter(open_leg), ANGLE);
        run(&case, &mut script, false, &mut NoProbe);
        let [a, b, c] = script.readings[0].current.0;
        assert!((a / exact - 1.0).abs() < 1e-9, "{a} against {exact}");
        assert!((a + b).abs() < 1e-12 && c.abs() < 1e-12);
    }
}

/// The reference circuit's devices: 10 mΩ each, and diodes of about 7 mV (see the netlists).
fn reference_inverter() -> Inverter {
    let devices =
        Devices { switch_drop: 0.0, switch_resistance: 10e-3, diode_drop: 7.2e-3, diode_resistance: 10e-3 };
    Inverter { bridge: Bridge { devices, open_leg: OpenLeg::Diodes }, ..ideal_inverter(OpenLeg::Diodes) }
}

/// Three pulses of 80 µs on line a-b, 2.4 ms apart.
fn pulses(decay: Decay) -> Vec<Command<f64>> {
    let (pulse, rest) = (Nanos::from_micros(80), Nanos::from_micros(2320));
    let after = match decay {
        Decay::Slow => Stage::freewheel(Phase::A, Phase::B, rest),
        Decay::Fast => Stage::off(rest),
    };
    let sampling = Sampling { first: Nanos::ZERO, interval: Nanos::from_micros(20), count: 120 };
    vec![Command::sequence(Stage::line(Phase::A, Phase::B, pulse), after, sampling); 3]
}

/// Largest difference to ngspice's currents in A over 361 points of 20 µs, and the largest current of phase c.
fn against_ngspice(decay: Decay, csv: &str, inverter: Inverter) -> (f64, f64) {
    let mut motor = reference_motor();
    motor.winding.leakage = 1e-6;
    let motor = motor.linearised();
    let mut script = Script::new(pulses(decay));
    run(&exact_case(&motor, inverter, ANGLE), &mut script, false, &mut NoProbe);
    let mut golden = csv::Reader::from_reader(csv.as_bytes());
    let rows: Vec<[f64; 4]> = golden.deserialize().map(|row| row.expect("golden row")).collect();
    assert!(rows.len() >= script.readings.len() && script.readings.len() == 360);
    let mut worst: f64 = 0.0;
    let mut third: f64 = 0.0;
    for (reading, [_, a, b, c]) in script.readings.iter().zip(rows) {
        for (ours, theirs) in reading.current.0.into_iter().zip([a, b, c]) {
            worst = worst.max((ours - theirs).abs());
        }
        third = third.max(reading.current[Phase::C].abs());
    }
    (worst, third)
}

#[test]
fn cross_three_pulses_with_low_side_freewheel_against_ngspice() {
    let golden = include_str!("../cross/line_pulse_slow.csv");
    let (worst, third) = against_ngspice(Decay::Slow, golden, reference_inverter());
    // A tenth of a per mille of the 3.5 A.
    assert!(worst < 3.5e-4, "{worst} A");
    assert!(third > 0.03, "the idle leg's diode must conduct: {third} A");
    // The same with a truly open leg must differ, or the diode was never simulated.
    let (open, none) = against_ngspice(Decay::Slow, golden, ideal_inverter(OpenLeg::Open));
    assert!(open > 30.0 * worst && none < 1e-9, "{open} A, {none} A");
}

#[test]
fn cross_gates_off_against_ngspice() {
    let golden = include_str!("../cross/line_pulse_fast.csv");
    let (worst, _) = against_ngspice(Decay::Fast, golden, reference_inverter());
    assert!(worst < 3.5e-4, "{worst} A");
}

#[test]
fn cross_peaks_of_an_earlier_ngspice_run() {
    // Near-ideal devices of another netlist of the same circuit: peaks in A.
    let expected = [1.336_48, 2.488_85, 3.484_52];
    let motor = reference_motor();
    let mut script = Script::new(pulses(Decay::Slow));
    run(&exact_case(&motor, reference_inverter(), ANGLE), &mut script, false, &mut NoProbe);
    for (pulse, expected) in expected.into_iter().enumerate() {
        let peak = script.readings[120 * pulse + 4].current[Phase::A];
        assert!((peak / expected - 1.0).abs() < 1e-3, "{peak} against {expected}");
    }
}

#[test]
fn analytic_gates_off_returns_the_current_to_zero() {
    let motor = reference_motor();
    let mut trace = Trace::new(2e-8);
    let case = exact_case(&motor, ideal_inverter(OpenLeg::Diodes), ANGLE);
    run(&case, &mut Script::new(pulses(Decay::Fast)[..1].to_vec()), false, &mut trace);
    let blocked = trace.events.iter().find_map(|(time, event)| {
        (*time > 80e-6 && matches!(event, Event::Conduction(Phase::A, Conduction::Blocked))).then_some(*time)
    });
    let zero = blocked.expect("phase a must block") * 1e6;
    // Closed form: (i + U/2R) exp(−2R t/L) = level + U/2R, with the level 0.
    let line = motor.winding.line_inductances(ANGLE.to_radians())[Phase::A];
    let peak = 275.0 * (1.0 - (-2.0 * 80e-6 / line).exp());
    let time_to = |level: f64| 80.0 + ((peak + 275.0) / (level + 275.0)).ln() * line / 2.0 * 1e6;
    assert!((zero - time_to(0.0)).abs() < 1e-4, "{zero} µs against {} µs", time_to(0.0));
    // An ngspice run of the same circuit was noted with 159.0 µs. That is where the current falls below 10 mA, a
    // usual threshold; with devices this close to ideal the zero itself cannot come before 159.6 µs.
    let below = trace.snapshots.iter().find(|s| s.time > 80e-6 && s.current[0] < 10e-3);
    let below = below.expect("the current decays").time * 1e6;
    assert!((below - 159.0).abs() < 0.1 && (time_to(10e-3) - 159.0).abs() < 0.1, "{below} µs");
}

#[test]
fn law_a_tighter_tolerance_changes_less_than_the_sensors_could_ever_see() {
    // Noise of the default sensors: 10 mA. The numerical error must be a hundred times below.
    let motor = crate::bench::paper_motor();
    let pulse = Nanos::from_micros(80);
    let period = Nanos::from_micros(2400);
    let command = Command::sequence(
        Stage::line(Phase::A, Phase::B, pulse),
        Stage::freewheel(Phase::A, Phase::B, period - pulse),
        Sampling::twice(pulse, period),
    );
    let currents = |tolerance: f64| {
        let mut case = exact_case(&motor, ideal_inverter(OpenLeg::Diodes), 200.0);
        case.tolerance = Tolerance { flux: tolerance };
        let mut script = Script::new(vec![command; 3]);
        run(&case, &mut script, false, &mut NoProbe);
        script.readings.iter().map(|reading| reading.current[Phase::A]).collect::<Vec<_>>()
    };
    let (usual, tight) = (currents(Tolerance::default().flux), currents(1e-14));
    for (a, b) in usual.iter().zip(&tight) {
        assert!((a - b).abs() < 1e-5, "{a} {b}");
    }
}
