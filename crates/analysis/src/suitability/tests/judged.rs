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
