//! Speeds of a rotor that turns.

use super::*;
use crate::suitability::starts::Starts;
use standstill_sim::RotorState;

/// Starts of settings with the rotor driven at this speed in rpm, with the seed of the verdict.
fn driven(document: &Document, setting: &Setting, rpm: f64) -> Starts {
    let motor = document.motor().expect("a motor");
    let (demands, work) = (Demands::default(), unbounded());
    let bench = Bench::new(document, &motor, &demands, &work);
    let mut scenario = bench.scenario(setting, Rotor::Locked).unwrap_or_else(|error| panic!("{error}"));
    (scenario.rotor, scenario.start_speed) = (RotorState::Driven, rpm);
    Starts::of(&scenario, Rotor::Driven, 32, &work).unwrap_or_else(|_| panic!("runs"))
}

/// The speed that is printed is one up to which errors are within the demand in both directions; 9 % faster they are not in at least one.
#[test]
fn law_errors_are_within_the_demand_up_to_the_speed_that_is_named() {
    let mut document = SUITED.0.clone();
    document.set("detector.checks", "false", Origin::CommandLine).expect("a key");
    let found = found(&document);
    let speeds = found.turning.expect("measured");
    let setting = &found.recommended().expect("suited").setting;
    let within = speeds.within_rpm.expect("an error that grows with the speed");
    let p95 = |rpm: f64| driven(&document, setting, rpm).summary.p95_deg.value;
    for way in [within, -within] {
        assert!(p95(way) <= 5.0, "{way}: {}", p95(way));
    }
    assert!(p95(1.0906 * within).max(p95(-1.0906 * within)) > 5.0, "{within}");
}

/// A start whose pole is undetermined starts no drive that needs the pole, so its error is not unnoticed.
#[test]
fn law_a_start_without_a_pole_is_no_wrong_answer_where_poles_are_judged() {
    let document = sheet("saturation = \"5 %\"", &[BIPOLAR, ("detector.checks", "false")]);
    let setting = &SUITED.1.recommended().expect("suited").setting;
    let named = driven(&document, setting, 0.0);
    assert!(named.summary.found > 0 && named.wrong(0.0, true) == named.summary.found, "{:?}", named.summary);
    // The magnet's induced voltage hides the pole. The axis lags by 6°.
    let open = driven(&document, setting, 140.0);
    assert_eq!((open.summary.found, open.summary.undetermined), (0, 32), "{:?}", open.summary);
    assert_eq!((open.wrong(5.0, true), open.wrong(5.0, false)), (0, 32), "{:?}", open.summary);
}
