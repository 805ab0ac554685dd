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
        for (bandwidth, most) in [("20 kHz", 0.3), ("50 kHz", 0.15), ("200 kHz", 0.15), ("1 MHz", 0.15)] {
            let text = format!(
                "motor = \"paper-5k5\"\ndetector.method = \"{method}\"\ndetector.bandwidth = \"{bandwidth}\"\n[sensors]\nbandwidth = \"{bandwidth}\"\nbandwidth_mismatch = \"3 %\""
            );
            let document = Document::parse(Path::new("scenario"), &text).expect("TOML");
            let motor = built_in("paper-5k5").expect("built in");
            let nominal = document.scenario_of(&motor).unwrap_or_else(|error| panic!("{error}"));
            for share in [0.8, 1.2] {
                let mut scenario = nominal.clone();
                scenario.sensors.bandwidth = scenario.sensors.bandwidth.map(|corner| corner * share);
                let s = summary(&scenario, 25);
                assert_eq!((s.found, s.wrong_poles), (25, 0), "{method} {bandwidth}: {s:?}");
                assert!(s.rms_deg.value < most, "{method} {bandwidth}: {s:?}");
            }
        }
    }
}
