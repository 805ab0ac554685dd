//! Where numbers of the engine's own could matter: how small a motor may be, how long a step, when a leg wakes.

use std::path::Path;

use standstill_interface::{Command, Nanos, Phase, Reading, Sampling, Stage};
use standstill_inverter::{OpenLeg, Sag};
use standstill_numeric::Heading;
use standstill_plant::{Core, Linear, MagneticCircuit, Motor};
use standstill_scenario::{Document, Plan};
use standstill_sim::{Case, Ended, NoProbe, Run, Tolerance, run};

use crate::bench::{Script, exact_case, reference_motor, usual_inverter};

fn play(case: &Case, commands: Vec<Command<f64>>) -> (Vec<Reading<f64>>, Run<f64>) {
    let mut script = Script::new(commands);
    let run = run(case, &mut script, false, &mut NoProbe);
    (script.readings, run)
}

/// Samples a command at so many times, the last one at its end.
fn sampled(stage: Stage<f64>, count: u32) -> Command<f64> {
    let every = Nanos(stage.duration.0 / u64::from(count));
    Command::hold(stage, Sampling { first: every, interval: every, count })
}

/// Pulses across two lines, each followed by its decay and by a rest.
fn pulses() -> Vec<Command<f64>> {
    let micros = Nanos::from_micros;
    let one = |from, to| {
        [
            sampled(Stage::line(from, to, micros(80)), 4),
            sampled(Stage::freewheel(from, to, micros(150)), 3),
            sampled(Stage::off(micros(400)), 8),
        ]
    };
    [one(Phase::A, Phase::B), one(Phase::C, Phase::A)].concat()
}

/// All voltages, fluxes and currents of a linear motor by a factor.
fn scaled(motor: &Motor, factor: f64) -> Motor {
    let mut motor = motor.clone();
    let flux = motor.magnetics.rest(Heading::ZERO).d * factor;
    let core = Core::Linear(Linear::from_winding(&motor.winding, flux));
    motor.magnetics = MagneticCircuit::new(core).expect("linear");
    motor.rated_current *= factor;
    motor.magnet_flux *= factor;
    motor
}

#[test]
fn law_a_motor_of_microamperes_is_a_motor_of_amperes_made_small() {
    let large = reference_motor();
    for factor in [2.0_f64.powi(-20), 2.0_f64.powi(10)] {
        let small = scaled(&large, factor);
        let case = |motor, factor: f64| {
            let mut case = exact_case(motor, usual_inverter(OpenLeg::Diodes), 33.0);
            case.inverter.link.voltage *= factor;
            case.inverter.bridge.devices.switch_drop *= factor;
            case.inverter.bridge.devices.diode_drop *= factor;
            case.tolerance = Tolerance { flux: 1e-9 * factor };
            case
        };
        let [(a, run_a), (b, run_b)] =
            [play(&case(&large, 1.0), pulses()), play(&case(&small, factor), pulses())];
        assert_eq!((a.len(), run_a.work.events), (b.len(), run_b.work.events));
        assert!(run_a.work.events >= 2, "{}", run_a.work.events);
        for (a, b) in a.iter().zip(&b) {
            for k in 0..3 {
                let off = (a.current.0[k] * factor - b.current.0[k]).abs() / (large.rated_current * factor);
                assert!(off < 1e-9, "{factor}: {off:e} of rated current");
            }
        }
    }
}

#[test]
fn regress_legs_wake_between_two_instants_when_the_link_returns() {
    let motor = reference_motor();
    let mut case = exact_case(&motor, usual_inverter(OpenLeg::Diodes), 20.0);
    case.inverter.link.sag = Some(Sag { depth: 0.9999, start: 0.0, duration: 4e-3 });
    // The pulse begins where the link has less than the drops of two switches, and ends far behind the sag's middle.
    let last = |samples| {
        let rest = Stage::off(Nanos::from_micros(1980));
        let pulse = Stage::line(Phase::A, Phase::B, Nanos::from_micros(1000));
        let (readings, _) = play(&case, vec![Command::hold(rest, Sampling::NONE), sampled(pulse, samples)]);
        readings.last().expect("a sample").current.0[0]
    };
    let (one, many) = (last(1), last(100));
    assert!(many > 1.0, "{many} A");
    assert!((one - many).abs() < 1e-6, "{one} A with one sample, {many} A with many");
}

#[test]
fn law_no_step_is_longer_than_the_shorter_time_constant() {
    // Ideal devices: the current decays for ever and the error estimate falls with it.
    let motor = reference_motor();
    let mut case = exact_case(&motor, usual_inverter(OpenLeg::Diodes), 20.0);
    case.inverter.bridge.devices = standstill_inverter::Devices::default();
    let decay = Nanos::from_micros(200_000);
    let commands = || {
        vec![
            sampled(Stage::line(Phase::A, Phase::B, Nanos::from_micros(80)), 1),
            sampled(Stage::freewheel(Phase::A, Phase::B, decay), 1),
        ]
    };
    let (readings, run) = play(&case, commands());
    let winding = &motor.winding;
    let constant = winding.d_axis_inductance().min(winding.q_axis_inductance()) / motor.resistance;
    let least = decay.seconds() / constant;
    assert!(run.work.steps as f64 >= least, "{} steps, {least:.1} time constants", run.work.steps);
    case.tolerance = Tolerance { flux: 1e-13 };
    let (strict, _) = play(&case, commands());
    for (a, b) in readings.iter().zip(&strict) {
        assert!((0..3).all(|k| (a.current.0[k] - b.current.0[k]).abs() < 1e-6));
    }
}

/// Three gates that switch at once leave currents of rounding beside a resistance of kiloohms: what that makes of them is no reason
/// for a device to conduct, or it did and did not without end.
#[test]
fn regress_damped_terminals_do_not_chatter_where_all_edges_are_at_once() {
    let text = "detector.method = \"line-inductance-fast\"\nerrors = \"default\"\n[inverter]\n\
                terminal_capacitance = \"0.3 nF\"\ndead_time = 0\ndelay_mismatch = 0\n";
    let plan = Plan::new(Document::parse(Path::new("s.toml"), text).expect("TOML")).expect("a plan");
    let scenario = plan.scenario(0).expect("a scenario");
    for trial in 0..6 {
        let record = scenario.trial(trial).expect("settings");
        assert!(matches!(record.run.ended, Ended::Outcome(_)), "{trial}: {:?}", record.run.ended);
    }
}

/// What a terminal's current meets must be continuous where a device takes the current over: else a leg at zero current has no mode
/// that lasts. That takes a method whose idle leg floats while the two others conduct, in many positions.
#[test]
fn regress_damped_terminals_do_not_chatter_where_a_device_takes_a_current_over() {
    for (motor, method, capacitance) in
        [("pm-reluctance", "line-inductance", "1 nF"), ("paper-5k5", "subdivision", "0.3 nF")]
    {
        let text = format!(
            "motor = \"{motor}\"\ndetector.method = \"{method}\"\nerrors = \"default\"\n\
             inverter.terminal_capacitance = \"{capacitance}\"\n"
        );
        let plan = Plan::new(Document::parse(Path::new("s.toml"), &text).expect("TOML")).expect("a plan");
        let scenario = plan.scenario(0).expect("a scenario");
        for trial in 0..40 {
            let record = scenario.trial(trial).expect("settings");
            let ended = &record.run.ended;
            assert!(matches!(ended, Ended::Outcome(_)), "{motor}, {method}, {trial}: {ended:?}");
        }
    }
}
