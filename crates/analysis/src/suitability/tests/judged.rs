//! What a check judges: all angles, and saturation up to the estimate.

use standstill_plant::fall_of_surface_magnets;

use super::*;
use crate::suitability::condition::upper_ends;

#[test]
fn law_an_angle_of_the_scenario_changes_no_verdict_and_is_named() {
    let (document, suited) = &*SUITED;
    let mut fixed = document.clone();
    fixed.set("rotor.angle", "30 deg", Origin::CommandLine).expect("a key");
    let of_fixed = found(&fixed);
    assert_eq!(of_fixed.left_angle.as_deref(), Some("30 deg"));
    assert_eq!(suited.left_angle, None);
    // As text, for some numbers are not known: NaN equals none.
    let of_any = Suitability { left_angle: None, ..of_fixed.clone() };
    assert_eq!(format!("{of_any:?}"), format!("{suited:?}"));
    let further = of_fixed.document(&fixed).expect("keys").expect("recommended");
    assert_eq!(further.get("rotor.angle"), None);
}

#[test]
fn law_the_first_range_of_saturation_contains_the_estimate() {
    let motor = |l_q: f64| {
        let mut document = sheet("", &[]);
        document.set("motor.nameplate.L_q", &format!("{l_q} uH"), Origin::CommandLine).expect("a key");
        document.motor().expect("a motor")
    };
    for (l_q, is_above) in [(16.5, false), (18.0, true), (20.0, true)] {
        let motor = motor(l_q);
        let (estimate, ends) = (fall_of_surface_magnets(&motor).expect("salient"), upper_ends(&motor));
        assert!(estimate <= ends[0] && ends[0] <= (1.1 * estimate).max(0.15), "{l_q}: {estimate} {ends:?}");
        assert_eq!((estimate > 0.15, ends.len()), (is_above, 4 + usize::from(is_above)), "{l_q}: {estimate}");
    }
    // The estimate is that of surface magnets: with magnets inside there is none.
    assert_eq!(upper_ends(&motor(24.0)).len(), 4);
}

/// The estimate of this motor is 25 %. Pulses that keep rated current up to 15 % drew 64 A there.
#[test]
fn regress_settings_keep_rated_current_where_the_estimate_lies() {
    let document = sheet("", &[BIPOLAR]);
    let found = found(&document);
    let Some(Condition::Saturation { most, .. }) = found.condition else { panic!("{found:?}") };
    let estimate = fall_of_surface_magnets(&document.motor().expect("a motor")).expect("salient");
    assert!(estimate > 0.2 && most >= estimate, "{estimate} {most}");
    let (there, motor) = condition::saturating(&document, estimate).expect("a key");
    let (demands, work) = (Demands::default(), unbounded());
    let bench = Bench::new(&there, &motor, &demands, &work);
    let setting = found.recommended().expect("suited").setting.clone();
    let scenario = bench.scenario(&setting, Rotor::Locked).unwrap_or_else(|error| panic!("{error}"));
    let starts = crate::suitability::starts::Starts::of(&scenario, Rotor::Locked, 200, &work);
    let peak = starts.unwrap_or_else(|_| panic!("runs")).summary.peak_current_a;
    assert!(peak <= 60.0, "{peak}");
}

/// With 6,000 A allowed, pulses of 1.6 kA were judged, which the converter clips: three methods that suit were called unsuited.
#[test]
fn regress_no_more_current_is_tried_than_the_sensors_read() {
    let bench_of = |keys: &[(&str, &str)], current: f64| {
        let (document, work) = (sheet("saturation = \"5 %\"", keys), unbounded());
        let motor = document.motor().expect("a motor");
        let demands = Demands { current_a: Some(current), ..Demands::default() };
        let bench = Bench::new(&document, &motor, &demands, &work);
        (bench.most_current, bench.read_up_to)
    };
    // The converters of 8 A motors read 20 A.
    let range = 60.0 * 20.0 / 8.0;
    assert_eq!(bench_of(&[], 70.0), (70.0, None));
    let (most, read) = bench_of(&[], 6000.0);
    assert!((most / (0.98 * range) - 1.0).abs() < 1e-9 && read == Some(most / 0.98), "{most} {read:?}");
    assert_eq!(bench_of(&[("sensors.range", "50 A")], 60.0), (49.0, Some(50.0)));
    // Captured times have no range.
    assert_eq!(bench_of(&[("sensors.timer", "100 ns")], 6000.0), (6000.0, None));
    let document = sheet("saturation = \"5 %\"", &[BIPOLAR]);
    let demands = Demands { current_a: Some(6000.0), ..Demands::default() };
    let found = Suitability::of(&document, &demands, Effort::Quick, |_| {}).expect("judged");
    assert_eq!((found.suited(), found.read_up_to_a), (Suited::Yes, read), "{found:?}");
}

#[test]
fn law_without_angles_nothing_else_binds() {
    let margins =
        Margins { error: 0.0, movement: 2.0, current: 1.5, time: 3.0, pole: Some(0.0), answers: 0.0 };
    assert_eq!(margins.binding().0, Demand::Answers);
    assert_eq!(Margins { answers: 1.0, ..margins }.binding().0, Demand::Error);
}
