//! The same seed gives the same trials, on any number of threads; another seed gives others.

use std::sync::atomic::AtomicBool;

use standstill_campaign::{Campaign, CampaignError};
use standstill_detect::{Decay, MethodName, Settings};
use standstill_plant::built_in;
use standstill_scenario::{ErrorSet, Record, Scenario};
use standstill_sim::{RotorState, Trace, run};

use crate::bench::scenario;

fn records(seed: u64, threads: usize, trials: u64) -> Vec<Record> {
    let mut scenario = scenario(ErrorSet::Default, Decay::Fast, RotorState::Free);
    scenario.seed = seed;
    let mut records = Vec::new();
    let campaign = Campaign { scenario: &scenario, trials, threads: Some(threads) };
    let done = campaign.run(&AtomicBool::new(false), |record| {
        records.push(*record);
        Ok::<(), CampaignError>(())
    });
    assert_eq!(done.expect("settings"), trials);
    records
}

/// promise: bits-threads
#[test]
fn law_records_do_not_depend_on_threads() {
    let one = records(1, 1, 700);
    assert_eq!(one, records(1, 2, 700));
    assert_eq!(one, records(1, 5, 700));
    // A shorter campaign is the beginning of a longer one.
    assert_eq!(one[..100], records(1, 2, 100)[..]);
}

#[test]
fn law_watching_changes_nothing() {
    for method in [MethodName::LineInductance, MethodName::LineInductanceFast, MethodName::HfiRotating] {
        for (errors, rotor) in [
            (ErrorSet::None, RotorState::Free),
            (ErrorSet::Default, RotorState::Locked),
            (ErrorSet::Harsh, RotorState::Free),
        ] {
            let motor = built_in("reluctance-6k7").expect("built in");
            let scenario = Scenario::of_method(method, motor, errors, rotor, 7);
            for trial in 0..if method == MethodName::HfiRotating { 1 } else { 10 } {
                let case = scenario.case(trial);
                let run = |probe: &mut Trace| {
                    run(&case, &mut scenario.detector.detector().expect("settings"), false, probe)
                };
                let (mut coarse, mut fine) = (Trace::new(f64::INFINITY), Trace::new(3e-6));
                let watched = [run(&mut coarse), run(&mut fine)];
                assert_eq!(watched, [scenario.trial(trial).expect("settings").run; 2], "{method:?} {trial}");
                let order = |trace: &Trace| trace.events.is_sorted_by(|a, b| a.0 <= b.0 + 1e-12);
                assert!(order(&coarse) && order(&fine), "{method:?} {trial}");
                assert!(coarse.events.len() > 50 && fine.snapshots.len() > coarse.snapshots.len());
            }
        }
    }
}

#[test]
fn law_trials_and_seeds_differ() {
    let (first, second) = (records(1, 2, 200), records(2, 2, 200));
    assert_ne!(first[0].run.start_angle, second[0].run.start_angle);
    for pair in first.windows(2) {
        assert_ne!(pair[0].run.start_angle, pair[1].run.start_angle);
        assert_ne!(pair[0].error_deg(), pair[1].error_deg());
    }
}

#[test]
fn law_angles_are_uniform() {
    let angles: Vec<f64> = records(1, 2, 720).iter().map(Record::start_angle_deg).collect();
    let mut counts = [0_u32; 12];
    for angle in &angles {
        // An angle in [0, 360) has a bin from 0 to 11.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let bin = (angle / 30.0) as usize;
        counts[bin] += 1;
    }
    // χ² with 11 degrees of freedom stays below 31.3 with 99.9 %.
    let chi: f64 = counts.iter().map(|n| (f64::from(*n) - 60.0).powi(2) / 60.0).sum();
    assert!(chi < 31.3, "{chi}: {counts:?}");
}
