//! Trials whose draws are given: the seed's own trial, what a changed draw changes, and the same distribution.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use standstill_detect::{Method, MethodName};
use standstill_plant::built_in;
use standstill_scenario::{ErrorSet, Record, Scenario};
use standstill_sim::{Play, Purpose, RotorState, Tape};

fn scenario(method: MethodName, motor: &str, errors: ErrorSet, rotor: RotorState) -> Scenario<Method<f64>> {
    let motor = built_in(motor).expect("built in");
    let rotor =
        if matches!(rotor, RotorState::Braked(_)) { RotorState::Braked(Play::of(&motor)) } else { rotor };
    Scenario::of_method(method, motor, errors, rotor, 1)
}

/// How much was drawn of each purpose.
fn lengths(tape: &mut Tape) -> Vec<(Purpose, usize)> {
    tape.strips().iter().map(|strip| (strip.purpose, strip.normals.len())).collect()
}

#[test]
fn law_a_trial_replayed_from_its_tape_is_the_same_to_the_last_bit() {
    let braked = RotorState::Braked(Play { below: 0.0, above: 0.0 });
    for (errors, rotor) in [
        (ErrorSet::Default, RotorState::Locked),
        (ErrorSet::Harsh, RotorState::Free),
        (ErrorSet::Harsh, braked),
    ] {
        for method in MethodName::ALL {
            // Seconds of PWM, and like the others.
            if method == MethodName::DcAlignment {
                continue;
            }
            let mut scenario = scenario(method, "low-inertia", errors, rotor);
            scenario.sensors.dc_link.noise = 0.5;
            for trial in [0, 11] {
                let what = format!("{method}, {errors:?}, {rotor:?}, trial {trial}");
                let seeded = scenario.trial(trial).expect("settings");
                // What a trial drew is on a tape of its seed and number.
                let mut tape = Tape::new(scenario.seed, trial);
                assert_eq!(scenario.trial_taped(&tape).expect("settings"), seeded, "{what}");
                // All of it: a tape that would grow otherwise gives the same.
                let drawn = lengths(&mut tape);
                tape.grow_from(99, 12_345);
                let replayed = scenario.trial_taped(&tape).expect("settings");
                assert_eq!((replayed.run, replayed.trial), (seeded.run, 12_345), "{what}");
                assert_eq!(lengths(&mut tape), drawn, "{what}");
                let samples =
                    |purpose| drawn.iter().find(|drawn| drawn.0 == purpose).map_or(0, |drawn| drawn.1);
                assert!(
                    samples(Purpose::CurrentNoise) > 90 && samples(Purpose::LinkNoise) > 30,
                    "{what}: {drawn:?}"
                );
                assert_eq!(samples(Purpose::CurrentNoise) / 3, samples(Purpose::LinkNoise), "{what}");
                // Other draws are another trial.
                let read = if method == MethodName::OpenTerminal {
                    Purpose::TerminalNoise
                } else {
                    Purpose::CurrentNoise
                };
                tape.normals(read).iter_mut().for_each(|normal| *normal *= -1.0);
                assert_ne!(scenario.trial_taped(&tape).expect("settings").run, seeded.run, "{what}");
            }
        }
    }
}

#[test]
fn law_tapes_side_by_side_are_those_alone() {
    let scenario =
        scenario(MethodName::LineInductanceFast, "paper-5k5", ErrorSet::Default, RotorState::Locked);
    let given = |index| {
        let mut tape = Tape::new(3, index);
        *tape.normals(Purpose::CurrentNoise) = vec![0.01 * index as f64; 60];
        tape
    };
    let together: Vec<Tape> = (0..40).map(given).collect();
    let mut records: Vec<Option<Record>> = vec![None; together.len()];
    scenario.trials_taped(&together, |number, record| records[number] = Some(record)).expect("settings");
    for (index, (tape, record)) in together.into_iter().zip(records).enumerate() {
        let alone = given(index as u64);
        assert_eq!(record, scenario.trial_taped(&alone).ok());
        assert_eq!(tape, alone);
    }
}

/// promise: common-draws
#[test]
fn law_a_draw_changes_nothing_but_what_it_is_for() {
    let scenario =
        scenario(MethodName::LineInductanceFast, "paper-5k5", ErrorSet::Default, RotorState::Locked);
    let before = Tape::new(1, 2);
    let first = scenario.trial_taped(&before).expect("settings").run;
    let after = |purpose: Purpose, number: usize| {
        let mut tape = before.clone();
        let normals = tape.normals(purpose);
        normals.resize(normals.len().max(number + 1), 0.0);
        normals[number] += 2.0;
        let run = scenario.trial_taped(&tape).expect("settings").run;
        let others = |mut tape: Tape| {
            tape.strips().iter().filter(|strip| strip.purpose != purpose).cloned().collect::<Vec<_>>()
        };
        assert_eq!(others(tape), others(before.clone()), "{purpose:?}");
        run
    };
    // Nobody reads them: a rotor without brake, a link without noise, a sensor more than there is.
    for (purpose, number) in [(Purpose::Backlash, 0), (Purpose::LinkNoise, 0), (Purpose::CurrentGain, 3)] {
        assert_eq!(after(purpose, number), first, "{purpose:?}");
    }
    let resolver = after(Purpose::Resolver, 0);
    assert!((resolver.resolver_angle - first.resolver_angle).to_degrees() - 0.4 < 1e-9);
    assert_eq!(resolver.found(), first.found());
    for purpose in [Purpose::Angle, Purpose::GateDelay, Purpose::CurrentGain, Purpose::CurrentOffset] {
        assert_ne!(after(purpose, 1).found(), first.found(), "{purpose:?}");
    }
    assert_ne!(after(Purpose::LinkError, 0).found(), first.found());
}

#[test]
fn law_given_and_seeded_trials_have_the_same_distribution() {
    const TRIALS: u64 = 3000;
    let scenario =
        scenario(MethodName::LineInductanceFast, "paper-5k5", ErrorSet::Default, RotorState::Locked);
    let axis = |record: &Record| record.axis_error_deg().expect("an axis");
    let mut seeded = Vec::new();
    scenario.trials(0..TRIALS, |record| seeded.push(axis(&record))).expect("settings");
    // Every draw by the polar equations of Box and Muller.
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut normal = || {
        let (u, v): (f64, f64) = (rng.random(), rng.random());
        (-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos()
    };
    let tapes: Vec<Tape> = (0..TRIALS)
        .map(|_| {
            let mut tape = Tape::new(2, 0);
            scenario.case_taped(&tape);
            tape.normals(Purpose::CurrentNoise).resize(132, 0.0);
            tape.normals(Purpose::Jitter).resize(44, 0.0);
            tape.strips().iter_mut().flat_map(|strip| &mut strip.normals).for_each(|draw| *draw = normal());
            tape
        })
        .collect();
    let mut given = Vec::new();
    scenario.trials_taped(&tapes, |_, record| given.push(axis(&record))).expect("settings");

    let rms = |errors: &[f64]| (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    assert!((rms(&seeded) / rms(&given) - 1.0).abs() < 0.06, "{} {}", rms(&seeded), rms(&given));
    // Smirnov's distance exceeds 1.95 in one case of a thousand.
    seeded.sort_unstable_by(f64::total_cmp);
    given.sort_unstable_by(f64::total_cmp);
    let share = |all: &[f64], x: f64| all.partition_point(|y| *y <= x) as f64 / all.len() as f64;
    let most = seeded.iter().map(|x| (share(&seeded, *x) - share(&given, *x)).abs()).fold(0.0, f64::max);
    assert!(most * (TRIALS as f64 / 2.0).sqrt() < 1.95, "{most}");
}
