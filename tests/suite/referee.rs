//! The engine's steps against those of the referee, which share nothing with them but the equations; and a run in any lane of
//! any width against the same run alone.

use standstill_detect::{Method, MethodName, Settings};
use standstill_interface::{Command, Detector, Reading, Step};
use standstill_plant::{Motor, built_in, built_in_names};
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::{
    Case, NoProbe, Play, RotorState, Run, SensorSettings, Sensors, Tolerance, Trace, Width, referee, run,
    run_side_by_side, run_side_by_side_in,
};

use crate::bench::{Script, paper_motor};

/// Keeps each command of a detector.
struct Recorder<D> {
    detector: D,
    commands: Vec<Command<f64>>,
}

impl<D: Detector<f64>> Detector<f64> for Recorder<D> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        let step = self.detector.step(readings);
        if let Step::Drive(command) = &step {
            self.commands.push(*command);
        }
        step
    }
}

fn scenario(motor: Motor, method: MethodName, errors: ErrorSet, rotor: RotorState) -> Scenario<Method<f64>> {
    Scenario::of_method(method, motor, errors, rotor, 1)
}

/// The commands that a trial's detector gives, and the trial without errors of its sensors.
fn commands(scenario: &Scenario<Method<f64>>, trial: u64) -> (Vec<Command<f64>>, Case<'_>) {
    let mut case = scenario.case(trial);
    let detector = scenario.detector.detector().expect("settings");
    let mut recorder = Recorder { detector, commands: Vec::new() };
    run(&case, &mut recorder, false, &mut NoProbe);
    let jitter = case.sensors.settings.jitter;
    case.sensors = Sensors::nominal(SensorSettings { jitter, ..SensorSettings::IDEAL });
    (recorder.commands, case)
}

/// The largest difference of a sampled current between the two engines at the same commands, as a share of the rated one.
fn difference(scenario: &Scenario<Method<f64>>, trial: u64) -> (f64, usize) {
    let (commands, case) = commands(scenario, trial);
    let (mut reference, mut ours) = (Script::new(commands.clone()), Script::new(commands));
    let (new, mut strict) = (run(&case, &mut ours, false, &mut NoProbe), case);
    strict.tolerance = Tolerance { flux: 1e-13 };
    let old: Run<f64> = referee(&strict, &mut reference, false, &mut NoProbe);
    assert_eq!(old.duration, new.duration);
    assert_eq!(reference.readings.len(), ours.readings.len());
    let pairs = reference.readings.iter().zip(&ours.readings);
    let currents = pairs.flat_map(|(a, b)| (0..3).map(|k| (a.current.0[k] - b.current.0[k]).abs()));
    let worst = currents.fold(0.0, f64::max);
    (worst / scenario.motor.rated_current, ours.readings.len())
}

/// Methods that command pulses, vectors and PWM.
const METHODS: [MethodName; 5] = [
    MethodName::LineInductance,
    MethodName::LineInductanceFast,
    MethodName::Bipolar,
    MethodName::MaximumLikelihood,
    MethodName::HfiRotating,
];

/// A millionth of an ampere at the paper's motor, and the same share of rated current elsewhere.
const BOUND: f64 = 1e-6 / 8.0;

#[test]
fn cross_replayed_commands_give_the_referees_currents_on_locked_rotors() {
    let mut samples = 0;
    for name in built_in_names() {
        let motor = built_in(name).expect("built in");
        for method in METHODS {
            for errors in [ErrorSet::Default, ErrorSet::Harsh] {
                let scenario = scenario(motor.clone(), method, errors, RotorState::Locked);
                if scenario.check().is_err() || method == MethodName::HfiRotating && name != "paper-5k5" {
                    continue;
                }
                for trial in 0..3 {
                    let (worst, count) = difference(&scenario, trial);
                    assert!(worst < BOUND, "{name}, {method}, {errors:?}, trial {trial}: {worst:e} of rated");
                    samples += count;
                }
            }
        }
    }
    assert!(samples > 5000, "{samples}");
}

#[test]
fn cross_replayed_commands_give_the_referees_currents_on_rotors_that_move() {
    let play = Play { below: 2e-3, above: 1e-3 };
    for name in ["paper-5k5", "pm-reluctance", "slot-harmonics"] {
        for rotor in [RotorState::Free, RotorState::Braked(play)] {
            for method in METHODS {
                let scenario = scenario(built_in(name).expect("built in"), method, ErrorSet::Harsh, rotor);
                if scenario.check().is_err() || method == MethodName::HfiRotating && name != "paper-5k5" {
                    continue;
                }
                let trials = if method == MethodName::HfiRotating { 1 } else { 3 };
                for trial in 0..trials {
                    let (worst, _) = difference(&scenario, trial);
                    assert!(worst < BOUND, "{name}, {method}, {rotor:?}, trial {trial}: {worst:e} of rated");
                }
            }
        }
    }
}

/// Runs cases side by side, in the order of their numbers.
fn side_by_side(cases: Vec<(Case<'_>, impl Detector<f64>)>) -> Vec<Run<f64>> {
    let mut runs = vec![None; cases.len()];
    run_side_by_side(cases, |number, run| {
        assert!(runs[number].replace(run).is_none(), "case {number} ends once");
    });
    runs.into_iter().map(|run| run.expect("every case ends")).collect()
}

#[test]
fn law_a_run_does_not_depend_on_its_neighbours() {
    for rotor in [RotorState::Locked, RotorState::Free] {
        for method in METHODS {
            let scenario = scenario(paper_motor(), method, ErrorSet::Harsh, rotor);
            let detector = || scenario.detector.detector().expect("settings");
            let trials = if method == MethodName::HfiRotating { 9 } else { 30 };
            let together = side_by_side((0..trials).map(|k| (scenario.case(k), detector())).collect());
            for (k, together) in (0..).zip(&together) {
                let alone: Run<f64> = run(&scenario.case(k), &mut detector(), false, &mut NoProbe);
                assert_eq!(format!("{alone:?}"), format!("{together:?}"), "{method}, {rotor:?}, trial {k}");
            }
            let angles = |run: &Run<f64>| run.found().map(f64::to_bits);
            assert!(together.windows(2).any(|pair| angles(&pair[0]) != angles(&pair[1])), "trials differ");
        }
    }
}

#[test]
fn law_bits_do_not_depend_on_the_width_of_registers() {
    for rotor in [RotorState::Locked, RotorState::Free] {
        let scenario = scenario(paper_motor(), MethodName::LineInductanceFast, ErrorSet::Default, rotor);
        let cases = || (0..40).map(|k| (scenario.case(k), scenario.detector.detector().expect("settings")));
        let runs = |width: Width| {
            let mut runs = vec![None; 40];
            run_side_by_side_in(width, cases(), |number, run: Run<f64>| runs[number] = Some(run));
            format!("{runs:?}")
        };
        let one = runs(Width::One);
        assert!(!one.contains("None, None"), "every case ends");
        for width in [Width::Avx2, Width::Avx512] {
            assert!(runs(width) == one, "{width:?}, {rotor:?}");
        }
    }
}

/// What runs give, to the last bit: FNV-1a over how each ended and what it cost.
fn digest(width: Width) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let play = Play { below: 2e-3, above: 1e-3 };
    for (name, method, errors, rotor) in [
        ("paper-5k5", MethodName::LineInductance, ErrorSet::Default, RotorState::Locked),
        ("paper-5k5", MethodName::LineInductanceFast, ErrorSet::Harsh, RotorState::Free),
        ("pm-reluctance", MethodName::Bipolar, ErrorSet::Default, RotorState::Locked),
        ("slot-harmonics", MethodName::LineInductanceFast, ErrorSet::Harsh, RotorState::Braked(play)),
        ("gearless-hoist", MethodName::MaximumLikelihood, ErrorSet::Default, RotorState::Locked),
    ] {
        let scenario = scenario(built_in(name).expect("built in"), method, errors, rotor);
        let detector = || scenario.detector.detector().expect("settings");
        let mut runs = vec![None; 12];
        let cases = (0..12).map(|k| (scenario.case(k), detector()));
        run_side_by_side_in(width, cases, |number, run: Run<f64>| runs[number] = Some(run));
        for run in runs {
            let run = run.expect("every case ends");
            let found = run.found().map_or(0, f64::to_bits);
            let work = run.work;
            for number in [found, run.peak_current.to_bits(), run.moved.to_bits(), work.steps, work.events] {
                for byte in number.to_le_bytes() {
                    hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
                }
            }
        }
    }
    hash
}

/// What the runs of [`digest`] gave when their results were last meant to change. On any processor it is the same.
const GOLDEN: &str = "0x336ed552f47bca15";

#[test]
fn golden_runs_are_the_same_in_registers_of_each_width() {
    let widths = [Width::One, Width::Avx2, Width::Avx512].into_iter();
    let found: Vec<(Width, String)> = widths
        .filter(|width| *width <= Width::widest())
        .map(|width| (width, format!("{:#018x}", digest(width))))
        .collect();
    assert!(found.iter().all(|(_, found)| found == GOLDEN), "{GOLDEN} expected: {found:?}");
}

#[test]
fn law_each_machine_may_have_numbers_of_its_own() {
    // Motors of other resistances and saturation on links of other voltages, in one bank.
    let scenarios: Vec<_> = (0..20_u8)
        .map(|k| {
            let share = 1.0 + 0.01 * f64::from(k);
            let mut motor = paper_motor();
            motor.resistance *= share;
            motor.magnetics = motor.magnetics.with_magnet(1.0 - 0.005 * f64::from(k)).expect("convex");
            let mut scenario =
                scenario(motor, MethodName::LineInductanceFast, ErrorSet::Default, RotorState::Locked);
            scenario.drive.link.voltage *= share;
            scenario
        })
        .collect();
    let detector = |s: &Scenario<Method<f64>>| s.detector.detector().expect("settings");
    let together = side_by_side(scenarios.iter().map(|s| (s.case(3), detector(s))).collect());
    for (scenario, together) in scenarios.iter().zip(&together) {
        let alone: Run<f64> = run(&scenario.case(3), &mut detector(scenario), false, &mut NoProbe);
        assert_eq!(format!("{alone:?}"), format!("{together:?}"));
        assert!(difference(scenario, 3).0 < BOUND);
    }
}

#[test]
fn law_watching_and_accounts_change_no_bit_and_close() {
    for rotor in [RotorState::Locked, RotorState::Free] {
        let scenario = scenario(paper_motor(), MethodName::LineInductance, ErrorSet::Default, rotor);
        for trial in 0..4 {
            let run = |ledger: bool, resolution: Option<f64>| -> Run<f64> {
                let mut detector = scenario.detector.detector().expect("settings");
                let case = scenario.case(trial);
                match resolution {
                    Some(resolution) => {
                        let mut trace = Trace::new(resolution);
                        let run = run(&case, &mut detector, ledger, &mut trace);
                        assert!(trace.snapshots.len() > 1000 && trace.events.len() > 100);
                        assert!(trace.snapshots.windows(2).all(|pair| pair[0].time <= pair[1].time + 1e-12));
                        run
                    }
                    None => run(&case, &mut detector, ledger, &mut NoProbe),
                }
            };
            let (plain, watched) = (run(false, None), run(true, Some(1e-5)));
            let ledger = watched.ledger.expect("asked for");
            let scale = ledger.copper_loss + ledger.device_loss;
            assert!(scale > 1e-2, "{ledger:?}");
            assert!((ledger.imbalance() / scale).abs() < 1e-6, "{rotor:?}: {ledger:?}");
            assert!((ledger.mechanical_imbalance() / scale).abs() < 1e-6, "{rotor:?}: {ledger:?}");
            assert_eq!(format!("{:?}", Run { ledger: None, ..watched }), format!("{plain:?}"));
        }
    }
}
