//! What detectors must hold on motors that are not like the paper's, and behind sensors that are not ideal.

use std::path::Path;

use standstill_campaign::{Campaign, Summary};
use standstill_detect::{Method, MethodName};
use standstill_plant::{DataSheet, Motor, built_in, built_in_names};
use standstill_scenario::{Document, ErrorSet, Scenario};
use standstill_sim::RotorState;

use MethodName::{Bipolar, DcAlignment, HfiRotating, MaximumLikelihood, MaximumLikelihoodAdaptive};

fn summary(scenario: &Scenario<Method<f64>>, trials: u64) -> Summary {
    Campaign { scenario, trials, threads: None }.summary().expect("settings")
}

fn on(motor: &Motor, method: MethodName, errors: ErrorSet, trials: u64) -> Summary {
    summary(&Scenario::of_method(method, motor.clone(), errors, RotorState::Locked, 1), trials)
}

/// A built-in motor with other values in its data sheet.
fn changed(name: &str, changes: &[(&str, &str)]) -> Motor {
    let text = DataSheet::built_in_text(name).expect("built in").to_owned();
    let text = changes.iter().fold(text, |text, (from, to)| {
        assert!(text.contains(from), "{name} {from}");
        text.replacen(from, to, 1)
    });
    DataSheet::parse(name, &text).and_then(|sheet| sheet.motor()).expect("a motor")
}

/// The paper's motor with a linear core and the same inductance all around.
fn round() -> Motor {
    let mut motor = built_in("paper-5k5").expect("built in");
    motor.winding.saliency = 0.0;
    motor.linearised()
}

#[test]
fn law_a_motor_without_saliency_has_no_axis_by_any_method() {
    // At 12 V dead time and drops take as much as an injection gives.
    let low = changed("gimbal", &[("\"1.6 mH\"", "\"1.4 mH\"")]).linearised();
    for (name, motor) in [("paper", round()), ("gimbal", low)] {
        for method in MethodName::ALL.into_iter().filter(|method| *method != DcAlignment) {
            for errors in [ErrorSet::Default, ErrorSet::Harsh] {
                let trials = if method == HfiRotating { 4 } else { 15 };
                let s = on(&motor, method, errors, trials);
                assert_eq!((s.found, s.undetermined, s.errors), (0, 0, 0), "{name} {method}: {s:?}");
                if name == "paper" {
                    assert!(s.reasons.keys().all(|reason| reason == "no saliency found"), "{method}: {s:?}");
                }
            }
        }
    }
}

#[test]
fn regress_delays_of_the_legs_are_no_bad_contact_in_short_pulses() {
    // Line pulses of 27 µs on 310 V raise two thirds of rated current in 1.1 mH. Legs that turn off 50 ns apart then make lines differ like
    // 0.13 Ω in one phase (standard deviation), beside its own 0.21 Ω: 41 of 100 sound motors were refused, of `harsh` drives 50.
    let sheet = "[nameplate]\npole_pairs = 5\nresistance = \"0.21 Ohm\"\nL_d = \"0.45 mH\"\nL_q = \"0.65 mH\"\nmagnet_flux = \"53 mWb\"\n\
                 rated_current = \"12.7 A\"\ndc_link = \"310 V\"\nsaturation = \"14 %\"\n";
    let motor = DataSheet::parse("t.toml", sheet).and_then(|sheet| sheet.motor()).expect("a motor");
    let of = |keys: &str| {
        let text = format!("{keys}\n[detector]\nmethod = \"bipolar\"\npulse = \"27 us\"\nrounds = 12\n");
        let document = Document::parse(Path::new("scenario"), &text).expect("TOML");
        summary(&document.scenario_of(&motor).expect("a scenario"), 200)
    };
    for errors in ["default", "harsh"] {
        let s = of(&format!("errors = \"{errors}\""));
        assert_eq!(s.failed, 0, "{errors}: {s:?}");
    }
    // Jitter of 0.1 µs leaves 1 Ω open in such a pulse. A contact of 2.5 Ω is named; a rotor that turns at 600 rpm is not called one.
    let contact = "a phase has more resistance than the others";
    let weak = of("[[faults]]\nmode = \"contact-resistance\"\nat = \"b\"\nmagnitude = \"2.5 Ohm\"");
    assert!(weak.reasons.get(contact).is_some_and(|of| of.count > 160), "{weak:?}");
    let turning = of("rotor = { state = \"free\", speed = \"600 rpm\" }");
    assert!(turning.found == 0 && !turning.reasons.contains_key(contact), "{turning:?}");
}

#[test]
fn regress_delays_of_the_legs_are_no_saliency_to_a_rotating_injection() {
    // At 12 V and 13.5 µH the injected 0.14 V are less than what the dead time takes, and legs whose delays differ make a tenth of it:
    // 24 of 100 were taken for a saliency.
    let mut motor = built_in("outrunner").expect("built in");
    motor.winding.saliency = 0.0;
    let s = on(&motor.linearised(), HfiRotating, ErrorSet::Harsh, 100);
    assert!(s.found + s.undetermined <= 1 && s.errors == 0, "{s:?}");
}

#[test]
fn law_a_saliency_of_two_per_cent_is_found_by_methods_that_compare_their_sensors() {
    for method in [Bipolar, MaximumLikelihood, MaximumLikelihoodAdaptive] {
        let s = on(&built_in("surface-magnet").expect("built in"), method, ErrorSet::Default, 40);
        assert_eq!((s.failed, s.errors, s.wrong_poles), (0, 0, 0), "{method}: {s:?}");
    }
}

#[test]
fn law_adaptive_pulses_stay_within_the_rated_current() {
    let stronger = [
        changed("reluctance-6k7", &[("value = 373", "value = 1000"), ("value = 658", "value = 2000")]),
        changed("light-vehicle", &[("\"17 %\"", "\"30 %\""), ("\"20 %\"", "\"40 %\"")]),
        changed("outrunner", &[("\"12 %\"", "\"25 %\""), ("\"5 %\"", "\"30 %\"")]),
    ];
    let built_in = built_in_names().map(|name| built_in(name).expect("built in"));
    for motor in built_in.chain(stronger) {
        for errors in [ErrorSet::Default, ErrorSet::Harsh] {
            let s = on(&motor, MaximumLikelihoodAdaptive, errors, 12);
            let most = s.peak_current_a / motor.rated_current;
            assert!(most < 1.02, "{} {}: {most}", motor.name, errors.name());
        }
    }
}

#[test]
fn law_the_pole_is_named_behind_slow_sensors_and_the_axis_is_as_good() {
    for method in [MaximumLikelihood, MaximumLikelihoodAdaptive] {
        for (kilohertz, most) in [(20, 0.3), (50, 0.15), (100, 0.15), (200, 0.15), (500, 0.15), (1000, 0.15)]
        {
            // The drive knows the nominal bandwidth; specimens are spread as in `field`.
            let text = format!(
                "motor = \"paper-5k5\"\ndetector.method = \"{method}\"\n[sensors]\nbandwidth = \"{kilohertz} kHz\"\nbandwidth_tolerance = \"20 %\"\nbandwidth_mismatch = \"3 %\""
            );
            let document = Document::parse(Path::new("scenario"), &text).expect("TOML");
            let motor = built_in("paper-5k5").expect("built in");
            let scenario = document.scenario_of(&motor).unwrap_or_else(|error| panic!("{error}"));
            let s = summary(&scenario, 100);
            assert!(s.found >= 99 && s.wrong_poles == 0, "{method} {kilohertz} kHz: {s:?}");
            assert!(s.rms_deg.value < most, "{method} {kilohertz} kHz: {s:?}");
        }
    }
}

#[test]
fn law_field_errors_cost_pulses_both_ways_no_pole_and_at_most_their_default_error_again() {
    let motor = built_in("paper-5k5").expect("built in");
    for method in [Bipolar, MaximumLikelihood, MaximumLikelihoodAdaptive] {
        let [default, field] =
            [ErrorSet::Default, ErrorSet::Field].map(|errors| on(&motor, method, errors, 100));
        assert_eq!((field.found, field.wrong_poles), (100, 0), "{method}: {field:?}");
        assert!(field.rms_deg.value < 2.0 * default.rms_deg.value, "{method}: {field:?}");
    }
}

#[test]
fn regress_what_edges_add_is_not_taken_for_too_little_current() {
    // What an edge adds is as large as the first pulses that these raise in their line of most inductance.
    for name in ["pm-reluctance", "reluctance-6k7"] {
        let motor = built_in(name).expect("built in");
        let s = on(&motor, MaximumLikelihoodAdaptive, ErrorSet::Field, 40);
        assert!(s.reasons.keys().all(|reason| !reason.starts_with("too little current")), "{name}: {s:?}");
        assert_eq!(s.wrong_poles, 0, "{name}: {s:?}");
    }
}
