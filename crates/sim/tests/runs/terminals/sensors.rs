//! Sensors that follow what rings: a filter answers to it exactly, however long the steps are and wherever in them it is sampled.

use super::*;
use standstill_sim::{Broken, Fault, PickUp, TerminalSensor, VoltageSensor};

/// Sensors of 200 kHz, one phase 0.5 µs after the other, with pick-up.
const FIELD: SensorSettings = SensorSettings {
    bandwidth: Some(200e3),
    skew: Nanos(500),
    pick_up: Some(PickUp { amplitude: 0.2, decay: 0.5e-6, frequency: 5e6 }),
    ..SensorSettings::IDEAL
};

fn readings(case: &Case<'_>, commands: &[Command<f64>]) -> (u64, Vec<Reading<f64>>) {
    let (run, readings) = play(case, commands);
    assert!(!matches!(run.ended, Ended::Error(_)), "{:?}", run.ended);
    (run.work.steps, readings)
}

/// Samples are read off the steps that pass them. Where a filter follows the link's voltage, steps end at samples.
#[test]
fn law_a_sample_within_a_step_is_that_of_a_step_that_ends_there() {
    let (linear, paper) = (linear(13e-3, 1.0), built_in("paper-5k5").expect("built in"));
    for (motor, capacitance, damped) in
        [(&linear, 0.3e-9, false), (&paper, 0.3e-9, true), (&paper, 1e-9, true), (&paper, 0.0, false)]
    {
        let mut case = case(motor, inverter(USUAL, OpenLeg::Diodes, capacitance, LINK));
        if damped {
            case.inverter.bridge.terminal_resistance = 1.6e3;
        }
        let pulse = Command::sequence(stage([High, Low, Off], 80), stage([Off; 3], 320), Sampling::NONE);
        let commands = [sampled(pulse, 200), sampled(hold([Duty(0.6), Duty(0.4), Duty(0.5)], 500), 300)];
        case.sensors = Sensors::nominal(FIELD);
        let (few, within) = readings(&case, &commands);
        let dc_link = VoltageSensor { bandwidth: Some(1e6), ..FIELD.dc_link };
        case.sensors = Sensors::nominal(SensorSettings { dc_link, ..FIELD });
        let (many, at_ends) = readings(&case, &commands);
        assert!(2 * few < many && within.len() == 500, "{few} {many} steps, {} readings", within.len());
        for (a, b) in within.iter().zip(&at_ends) {
            assert_eq!(a.at, b.at);
            for k in 0..3 {
                let off = (a.current.0[k] - b.current.0[k]).abs();
                assert!(off < 1e-6, "{} {capacitance} F, {:?}, phase {k}: {off:e} A", motor.name, a.at);
            }
        }
    }
}

/// Dividers with filters show the same, with and without a load of the terminals. The terminals swing, conduct and rest; one wire is open.
#[test]
fn law_dividers_within_a_step_are_those_of_a_step_that_ends_there() {
    let paper = built_in("paper-5k5").expect("built in");
    for (resistance, open) in [(None, false), (Some(1e6), false), (Some(3e5), false), (None, true)] {
        let terminal = TerminalSensor { bandwidth: Some(100e3), resistance, ..TerminalSensor::IDEAL };
        let field = SensorSettings { terminal: Some(terminal), ..FIELD };
        let mut case = case(&paper, inverter(USUAL, OpenLeg::Diodes, 0.3e-9, LINK));
        case.inverter.bridge.terminal_resistance = 1.6e3;
        case.inverter.link = DcLink { ripple: 0.01, ripple_frequency: 300.0, ..case.inverter.link };
        if open {
            let faults = [Fault::lasting(Broken::Wire(1))];
            assert!(faults.into_iter().all(|fault| case.faults.push(fault)));
        }
        // A flux that is off by a step's tolerance rings by a thousandth of a volt.
        case.tolerance.flux *= 0.01;
        let pulse = Command::sequence(stage([High, Low, Off], 80), stage([Off; 3], 3200), Sampling::NONE);
        let commands = [sampled(pulse, 164), sampled(hold([Duty(0.6), Duty(0.4), Duty(0.5)], 500), 300)];
        case.sensors = Sensors::nominal(field);
        let (few, within) = readings(&case, &commands);
        let dc_link = VoltageSensor { bandwidth: Some(1e6), ..field.dc_link };
        case.sensors = Sensors::nominal(SensorSettings { dc_link, ..field });
        let (many, at_ends) = readings(&case, &commands);
        assert!(few < many && within.len() == 464, "{few} {many} steps, {} readings", within.len());
        for (a, b) in within.iter().zip(&at_ends) {
            for k in 0..3 {
                let off = (a.terminal.0[k] - b.terminal.0[k]).abs();
                // A cubic through an eighth of a ripple's period: 1 % · (π/4)⁴/384.
                assert!(off < 1e-5 * LINK, "{resistance:?} Ω, {open}, {:?}, terminal {k}: {off:e} V", a.at);
            }
        }
    }
}

/// Steps follow filters between their ends only where a sample shows them: samples that are rare are those of a run with many.
#[test]
fn law_rare_samples_are_those_of_a_run_with_many() {
    let motor = built_in("paper-5k5").expect("built in");
    let mut case = case(&motor, inverter(USUAL, OpenLeg::Diodes, 0.3e-9, LINK));
    case.inverter.bridge.terminal_resistance = 1.6e3;
    let pulse = || Command::sequence(stage([High, Low, Off], 80), stage([Off; 3], 320), Sampling::NONE);
    case.sensors = Sensors::nominal(FIELD);
    // Time constants of 0.8 µs: 20 µs between two samples, and 2 µs.
    let (few, rare) = readings(&case, &[sampled(pulse(), 20)]);
    let dc_link = VoltageSensor { bandwidth: Some(1e6), ..FIELD.dc_link };
    case.sensors = Sensors::nominal(SensorSettings { dc_link, ..FIELD });
    let (many, dense) = readings(&case, &[sampled(pulse(), 200)]);
    assert!(few < many && rare.len() == 20, "{few} {many} steps");
    for (a, b) in rare.iter().zip(dense.iter().skip(9).step_by(10)) {
        assert_eq!(a.at, b.at);
        for k in 0..3 {
            let off = (a.current.0[k] - b.current.0[k]).abs();
            assert!(off < 2e-6, "{:?}, phase {k}: {off:e} A", a.at);
        }
    }
}

/// A current that carries a terminal from one bound to the other does so in one step: it is known when it will have.
#[test]
fn law_a_sweep_of_a_terminal_is_one_step() {
    let motor = linear(13e-3, 1.0);
    let mut case = case(&motor, inverter(USUAL, OpenLeg::Diodes, 0.3e-9, LINK));
    let pulse =
        |micros| Command::sequence(stage([High, Low, Low], micros), stage([Off; 3], 1), Sampling::NONE);
    let work = |case: &Case<'_>, micros| play(case, &[pulse(micros)]).0.work;
    // With 2 A after 50 µs three legs are carried in some 80 ns, b and c together.
    let with = work(&case, 50);
    case.inverter.bridge.terminal_capacitance = 0.0;
    let without = work(&case, 50);
    assert!(with.derivatives <= without.derivatives + 3, "{with:?} {without:?}");
}
