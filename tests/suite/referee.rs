//! The engine's steps against those of the referee, which share nothing with them but the equations; and a run in any lane of
//! any width against the same run alone.

use std::io::{Write as _, stderr};
use std::path::Path;

use standstill_detect::{Method, MethodName, Settings};
use standstill_interface::{Command, Detector, Nanos};
use standstill_plant::{Motor, built_in, built_in_names};
use standstill_scenario::{Document, ErrorSet, Plan, Scenario};
use standstill_sim::{
    Case, NoProbe, Play, RotorState, Run, SensorSettings, Sensors, Tape, Tolerance, Trace, Width, referee,
    run, run_side_by_side, run_side_by_side_in,
};

use crate::bench::{Script, paper_motor};
use crate::random_detections::look::Recorder;

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

/// The commands of the first `most` of a detection.
fn beginning(mut commands: Vec<Command<f64>>, most: Nanos) -> Vec<Command<f64>> {
    let mut time = Nanos::ZERO;
    let within = commands.iter().take_while(|command| {
        time = time + command.duration();
        time <= most
    });
    let count = within.count().max(1);
    commands.truncate(count);
    commands
}

/// The largest difference of a sampled current between the two engines at the same commands, the first `most` of them, as a
/// share of the rated one; and the number of samples.
fn difference(scenario: &Scenario<Method<f64>>, trial: u64, most: Nanos) -> (f64, usize) {
    let (commands, case) = commands(scenario, trial);
    let commands = beginning(commands, most);
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

/// A millionth of an ampere at the paper's motor, and the same share of rated current elsewhere.
const BOUND: f64 = 1e-6 / 8.0;

/// Returns how many trials the referee repeats, and how much of each: two trials with a poor drive, in which more can differ, and one with a good drive.
/// Of methods that take thousands of PWM periods it repeats 20 ms of one trial, and injection as a whole on one motor whose rotor can move, with a poor drive.
fn repeated(method: MethodName, motor: &str, errors: ErrorSet, rotor: RotorState) -> (u64, Nanos) {
    let whole = motor == "paper-5k5" && errors == ErrorSet::Harsh && rotor == RotorState::Free;
    match method {
        MethodName::HfiRotating if whole => (1, Nanos(u64::MAX)),
        MethodName::HfiRotating | MethodName::HfiPulsating | MethodName::DcAlignment => {
            (1, Nanos::from_micros(20_000))
        }
        _ => (if errors == ErrorSet::Harsh { 2 } else { 1 }, Nanos(u64::MAX)),
    }
}

/// Every method on every motor with good and poor drives. All of them can work: what could not would be told with its reason.
fn compared(rotor: RotorState) {
    let (mut samples, mut motors, mut left_out) = (0, 0, Vec::new());
    for name in built_in_names() {
        motors += 1;
        let motor = built_in(name).expect("built in");
        for method in MethodName::ALL {
            for errors in [ErrorSet::Default, ErrorSet::Harsh] {
                let scenario = scenario(motor.clone(), method, errors, rotor);
                if let Err(refused) = scenario.check() {
                    left_out.push(format!("{name}, {method}, {errors:?}: {refused}"));
                    continue;
                }
                let (trials, most) = repeated(method, name, errors, rotor);
                for trial in 0..trials {
                    let (worst, count) = difference(&scenario, trial, most);
                    let of = format!("{name}, {method}, {errors:?}, {rotor:?}, trial {trial}");
                    assert!(worst < BOUND, "{of}: {worst:e} of rated");
                    assert!(count > 0 || method == MethodName::DcAlignment, "{of} reads something");
                    samples += count;
                }
            }
        }
    }
    println!("{rotor:?}: {samples} samples");
    assert!(left_out.is_empty(), "{left_out:#?}");
    assert!(motors >= 8 && samples > 100_000, "{rotor:?}: {samples} samples on {motors} motors");
}

/// promise: second-integrator
#[test]
fn cross_replayed_commands_give_the_referees_currents_on_locked_rotors() {
    compared(RotorState::Locked);
}

/// promise: second-integrator
#[test]
fn cross_replayed_commands_give_the_referees_currents_on_free_rotors() {
    compared(RotorState::Free);
}

/// promise: second-integrator
#[test]
fn cross_replayed_commands_give_the_referees_currents_within_a_brakes_play() {
    compared(RotorState::Braked(Play { below: 2e-3, above: 1e-3 }));
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
    // Methods that command pulses, vectors and PWM.
    let methods = [
        MethodName::LineInductance,
        MethodName::LineInductanceFast,
        MethodName::Bipolar,
        MethodName::MaximumLikelihood,
        MethodName::HfiRotating,
    ];
    for rotor in [RotorState::Locked, RotorState::Free] {
        for method in methods {
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

/// promise: bits-processors
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
        for width in Width::available().filter(|width| *width != Width::One) {
            assert!(runs(width) == one, "{width:?}, {rotor:?}");
        }
    }
}

/// FNV-1a over how runs ended and what they cost.
struct Digest(u64);

impl Digest {
    const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// With the first trials of these scenarios side by side, trial k of the k-th.
    fn with(&mut self, width: Width, scenarios: &[Scenario<Method<f64>>]) {
        let mut runs = vec![None; scenarios.len()];
        let cases = (0..)
            .zip(scenarios)
            .map(|(k, scenario)| (scenario.case(k), scenario.detector.detector().expect("settings")));
        run_side_by_side_in(width, cases, |number, run: Run<f64>| runs[number] = Some(run));
        for run in runs {
            let run = run.expect("every case ends");
            let found = run.found().map_or(0, f64::to_bits);
            let work = run.work;
            for number in [found, run.peak_current.to_bits(), run.moved.to_bits(), work.steps, work.events] {
                for byte in number.to_le_bytes() {
                    self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
                }
            }
        }
    }
}

/// What runs give, to the last bit.
fn digest(width: Width) -> u64 {
    let mut digest = Digest::new();
    let play = Play { below: 2e-3, above: 1e-3 };
    for (name, method, errors, rotor) in [
        ("paper-5k5", MethodName::LineInductance, ErrorSet::Default, RotorState::Locked),
        ("paper-5k5", MethodName::LineInductanceFast, ErrorSet::Harsh, RotorState::Free),
        ("pm-reluctance", MethodName::Bipolar, ErrorSet::Default, RotorState::Locked),
        ("slot-harmonics", MethodName::LineInductanceFast, ErrorSet::Harsh, RotorState::Braked(play)),
        ("gearless-hoist", MethodName::MaximumLikelihood, ErrorSet::Default, RotorState::Locked),
    ] {
        let scenario = scenario(built_in(name).expect("built in"), method, errors, rotor);
        digest.with(width, &vec![scenario; 12]);
    }
    digest.0
}

/// What the runs of [`digest`] gave when their results were last meant to change. On any processor it is the same.
const GOLDEN: &str = "0x336ed552f47bca15";

/// Further runs: a scenario, how many of its trials, and what they gave, as above.
const SCENARIOS: [(&str, u64, &str); 5] = [
    ("motor = \"paper-5k5\"\ndetector.method = \"hfi-rotating\"", 3, "0x3d199e694b04b859"),
    (
        "motor = \"slot-harmonics\"\ndetector.method = \"hfi-pulsating\"\nrotor.state = \"free\"",
        3,
        "0xf0ce40af68e98781",
    ),
    (
        "[motor]\nname = \"mapped\"\nrating = { current = \"8.8 A\", dc_link = \"550 V\" }\n\
         winding = { pole_pairs = 2, resistance = \"0.63 Ω\" }\nmap.file = \"examples/maps/both_sides.csv\"\n\
         rotor = { inertia = \"0.015 kg m²\", stiction = \"0.2 N m\", coulomb = \"0.2 N m\", viscous = \"0 N m s\" }",
        12,
        "0x16db191e8a2b9de7",
    ),
    (
        "motor = \"paper-5k5\"\nrotor.magnet_temperature = \"60 °C\"\n[tolerances]\n\
         \"motor.winding.resistance\" = { normal = \"5 %\" }\n\"rotor.magnet_temperature\" = { uniform = \"30 °C\" }\n\
         \"inverter.dead_time\" = { uniform = \"0.2 us\", mean = \"2 us\" }",
        12,
        "0x668487e1b85833a5",
    ),
    (
        "[motor]\nbase = \"surface-magnet\"\nhysteresis = { coercive_current = \"0.1 A\", depth = \"3 %\", cells = 3 }\n\
         [rotor]\nmemory = \"former\"\nstate = \"free\"",
        12,
        "0x48ff2659fb6688cc",
    ),
];

/// The scenarios of a text's first trials, with what each draws.
fn drawn(text: &str, trials: u64) -> Vec<Scenario<Method<f64>>> {
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/s.toml"));
    let plan = Plan::new(Document::parse(file, text).expect("TOML")).expect("a plan");
    let told = plan.scenario(0).expect("valid");
    let tape = |trial| Tape::new(told.seed, trial);
    (0..trials).map(|trial| plan.scenario_taped(0, &told, &tape(trial)).expect("valid")).collect()
}

/// promise: bits-processors
#[test]
fn golden_runs_are_the_same_in_registers_of_each_width() {
    let widths: Vec<Width> = Width::available().collect();
    let lacking: Vec<Width> = Width::ALL.into_iter().filter(|width| !widths.contains(width)).collect();
    // Not by `println!`, which is shown of tests that fail alone: who reads that this passed shall see of what.
    let _ = writeln!(stderr(), "golden runs in {widths:?}; this processor does not have {lacking:?}");
    let found: Vec<(Width, String)> =
        widths.iter().map(|width| (*width, format!("{:#018x}", digest(*width)))).collect();
    assert!(found.iter().all(|(_, found)| found == GOLDEN), "{GOLDEN} expected: {found:?}");
    let mut others = Vec::new();
    for (text, trials, golden) in SCENARIOS {
        let scenarios = drawn(text, trials);
        for width in &widths {
            let mut digest = Digest::new();
            digest.with(*width, &scenarios);
            let found = format!("{:#018x}", digest.0);
            if found != golden {
                others.push(format!("{found} in {width:?}, {golden} expected:\n{text}"));
            }
        }
    }
    assert!(others.is_empty(), "{}", others.join("\n"));
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
        assert!(difference(scenario, 3, Nanos(u64::MAX)).0 < BOUND);
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
