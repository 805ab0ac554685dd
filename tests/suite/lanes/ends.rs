//! Detections that come to a bad end leave those beside them undisturbed.

use standstill_detect::{AnyDetector, Method, MethodName, Settings};
use standstill_interface::{Abc, Command, Detector, Leg, Nanos, Phase, Reading, Sampling, Stage, Step};
use standstill_plant::Motor;
use standstill_scenario::{ErrorSet, Scenario, Specimen};
use standstill_sim::{Case, Ended, NoProbe, RotorState, Run, RunError, run, run_side_by_side};

use crate::bench::{mapped, paper_motor};

/// A detector that goes wrong after some commands: it gives this one instead of its own.
#[derive(Clone)]
struct Upset {
    inner: AnyDetector<f64>,
    after: u32,
    wrong: Option<Command<f64>>,
}

impl Detector<f64> for Upset {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        match self.wrong {
            Some(wrong) if self.after == 0 => Step::Drive(wrong),
            _ => {
                self.after = self.after.saturating_sub(1);
                self.inner.step(readings)
            }
        }
    }
}

/// Runs these side by side and alone.
fn both(cases: &[(Case<'_>, Upset)]) -> Vec<(Run<f64>, Run<f64>)> {
    let mut runs = vec![None; cases.len()];
    run_side_by_side(cases.iter().cloned(), |number, run| {
        assert!(runs[number].replace(run).is_none(), "case {number} ends once");
    });
    let alone = cases.iter().map(|(case, upset)| run(case, &mut upset.clone(), false, &mut NoProbe));
    runs.into_iter().map(|run| run.expect("every case ends")).zip(alone).collect()
}

fn scenario(motor: Motor, rotor: RotorState) -> Scenario<Method<f64>> {
    Scenario::of_method(MethodName::LineInductanceFast, motor, ErrorSet::Default, rotor, 4)
}

#[test]
fn law_a_bad_end_in_one_lane_is_none_in_another() {
    let duty = Stage { legs: Abc::new(Leg::Duty(f64::NAN), Leg::Low, Leg::Low), duration: Nanos(100) };
    let wrong = [
        Some(Command::hold(Stage::off(Nanos(10)), Sampling::once(Nanos(11)))),
        Some(Command::hold(Stage::off(Nanos(u64::MAX)), Sampling::NONE)),
        Some(Command::hold(duty, Sampling::NONE)),
        None,
        None,
    ];
    for rotor in [RotorState::Locked, RotorState::Free] {
        let scenario = scenario(paper_motor(), rotor);
        let inner = scenario.detector.detector().expect("settings");
        let cases: Vec<_> = (0..41_u32)
            .map(|k| {
                let wrong = wrong[k as usize % wrong.len()];
                let mut case = scenario.case(k.into());
                if k % 7 == 3 {
                    // In the midst of a detection.
                    case.time_limit = Nanos::from_micros(u64::from(100 * k));
                }
                if k % 11 == 8 {
                    // A locked rotor has no use for it and goes on.
                    case.load_torque = f64::NAN;
                }
                if k == 23 {
                    case.start_angle = f64::NAN;
                }
                // The first ones at their first step, when the others have not begun.
                (case, Upset { inner: inner.clone(), after: k / 3, wrong })
            })
            .collect();
        let mut ends = [0; 5];
        for (number, (lane, alone)) in both(&cases).into_iter().enumerate() {
            assert_eq!(format!("{lane:?}"), format!("{alone:?}"), "case {number}, {rotor:?}");
            ends[match alone.ended {
                Ended::Outcome(_) => 0,
                Ended::Error(RunError::BadCommand) => 1,
                Ended::Error(RunError::TimeLimit(_)) => 2,
                Ended::Error(RunError::BadDuty) => 3,
                Ended::Error(RunError::NotFinite(_) | RunError::NoStep(_) | RunError::Stuck(_)) => 4,
                Ended::Error(error) => panic!("case {number}: {error}"),
            }] += 1;
        }
        let [.., not_finite] = ends;
        assert!(ends[..4].iter().all(|count| *count > 0), "{ends:?}");
        assert_eq!(not_finite > 0, rotor == RotorState::Free, "{ends:?}");
    }
}

#[test]
fn law_leaving_a_map_in_one_lane_is_none_in_another() {
    let motor = paper_motor();
    let (map, _) = mapped(&motor, 1.6 * motor.rated_current);
    // One after the other, without the currents' decay.
    let pulse = Stage::line(Phase::A, Phase::B, Nanos::from_micros(500));
    let wrong = Command::hold(pulse, Sampling::once(Nanos::from_micros(80)));
    for rotor in [RotorState::Locked, RotorState::Free] {
        let scenario = scenario(map.clone(), rotor);
        let inner = scenario.detector.detector().expect("settings");
        let leaves = |k: u32| k % 3 == 1;
        let upset = |k| Upset { inner: inner.clone(), after: k / 3, wrong: leaves(k).then_some(wrong) };
        let cases: Vec<_> = (0..30).map(|k| (scenario.case(k.into()), upset(k))).collect();
        for (k, (lane, alone)) in (0..).zip(both(&cases)) {
            assert_eq!(format!("{lane:?}"), format!("{alone:?}"), "case {k}, {rotor:?}");
            let left = matches!(alone.ended, Ended::Error(RunError::LeftMap { .. }));
            assert_eq!(left, leaves(k), "case {k}, {rotor:?}: {:?}", alone.ended);
        }
    }
}

#[test]
fn law_no_cases_and_cases_that_end_at_once() {
    let scenario = scenario(paper_motor(), RotorState::Locked);
    assert_eq!(both(&[]).len(), 0);
    let wrong = Some(Command::hold(Stage::off(Nanos::ZERO), Sampling::NONE));
    let inner = scenario.detector.detector().expect("settings");
    let upset = Upset { inner, after: 0, wrong };
    let at = |k: u8| scenario.case_at(f64::from(k), Specimen { drive: k.into(), noise: 7 });
    let cases: Vec<_> = (0..20).map(|k| (at(k), upset.clone())).collect();
    for (lane, alone) in both(&cases) {
        assert_eq!(lane, alone);
        assert_eq!(lane.ended, Ended::Error(RunError::BadCommand));
    }
}
