//! Comparators together with all other effects: lanes, the referee, the energy balance.

use super::*;

/// Saturation, drops, dead time, a capacitance at the terminals, a rotor that can move, errors of all kinds.
fn cases(motor: &Motor) -> Vec<Case<'_>> {
    (0..9)
        .map(|n| {
            let settings = ComparatorSettings {
                arrangement: if n < 5 { Comparators::Common } else { Comparators::PerLeg },
                timer: 1e-9,
                timer_error: 1e-3,
                offset: 0.05,
                delay: 200e-9,
                delay_spread: 20e-9,
                noise: 0.02,
                noise_bandwidth: if n % 2 == 1 { 2e6 } else { 0.0 },
                blanking: Nanos(2500),
                bits: 10,
                range: 20.0,
                trip: if n == 8 { 6.0 } else { 0.0 },
            };
            let streams = Streams::new(1, n);
            let mut case = case(motor, true, settings);
            case.inverter.bridge.terminal_capacitance = 0.3e-9;
            case.inverter.bridge.terminal_resistance = 1e3;
            if n.is_multiple_of(3) {
                case.inverter.link.ripple = 0.01;
                case.inverter.link.ripple_frequency = 300.0;
            }
            let arrangement = if n > 6 { Arrangement::LowSideShunts } else { Arrangement::ThreeInLine };
            let settings = SensorSettings { arrangement, jitter: Nanos(100), ..case.sensors.settings };
            Case {
                sensors: Sensors::draw(settings, streams),
                start_angle: n as f64 * 0.7,
                rotor: RotorState::Free,
                streams,
                ..case
            }
        })
        .collect()
}

#[test]
fn law_lanes_have_the_bits_of_runs_alone() {
    let motor = motor();
    let commands: Vec<_> = (0..18).map(|n| until(3.0 + (n % 5) as f64, vector(n % 6))).collect();
    let cases: Vec<_> = cases(&motor).into_iter().map(|case| (case, Script::new(&commands))).collect();
    same_bits_in_lanes(&cases);
    // Without capacitance and motion it is other code.
    let plain: Vec<_> = cases
        .into_iter()
        .map(|(mut case, script)| {
            case.inverter.bridge.terminal_capacitance = 0.0;
            case.rotor = RotorState::Locked;
            (case, script)
        })
        .collect();
    same_bits_in_lanes(&plain);
}

#[test]
fn law_the_referee_sees_the_same_times() {
    let motor = motor();
    for (case, number) in cases(&motor).into_iter().take(8).zip((0..6).cycle()) {
        let comparator = Comparator { tick: 1e-12, ..case.sensors.comparator };
        let case = Case { sensors: Sensors { comparator, ..case.sensors }, ..case };
        // One pulse: gates switch in whole nanoseconds, and a time beside the edge of one shifts all that follows.
        let script = Script::new([until(6.0, vector(number))]);
        let [mut own, mut other] = [script.clone(), script];
        let _ = run(&case, &mut own, false, &mut NoProbe);
        let _ = referee(&case, &mut other, false, &mut NoProbe);
        let ticks = |script: &Script| f64::from(script.readings[0].capture.expect("tripped").ticks);
        let off = ticks(&own) - ticks(&other);
        assert!(off.abs() < 300.0, "{off} ps");
    }
}

#[test]
fn law_energy_balances_where_a_comparator_ends_the_pulse() {
    let motor = motor();
    let commands: Vec<_> = (0..6).map(|n| until(6.0, vector(n))).collect();
    for case in cases(&motor).into_iter().take(5) {
        let run = run(&case, &mut Script::new(&commands), true, &mut NoProbe);
        let imbalance = run.ledger.expect("asked for").imbalance();
        assert!(imbalance < 3e-8, "{imbalance}");
    }
}
