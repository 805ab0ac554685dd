//! `check` of the library's motors of simple drives, each with the sensors that such a product has.

use super::{folder, standstill};

/// What `check` says: exit code, and the answer as JSON.
fn checked(motor: &str, sensors: &[&str]) -> (Option<i32>, serde_json::Value) {
    let folder = folder();
    let path = folder.path();
    let mut words = vec!["check", motor, "--json"];
    words.extend(sensors.iter().flat_map(|key| ["-s", *key]));
    let output = standstill(&words, path);
    let json = serde_json::from_slice(&output.stdout).expect("JSON");
    (output.status.code(), json)
}

/// Recommended method, and the lines of how to go on.
fn recommended(json: &serde_json::Value) -> (String, String) {
    let next: Vec<&str> =
        json["next"].as_array().expect("lines").iter().filter_map(|line| line.as_str()).collect();
    (json["recommended"]["method"].as_str().unwrap_or_default().to_owned(), next.join("\n"))
}

#[test]
fn golden_a_drone_s_motor_on_a_drive_that_reads_its_terminals_is_suited() {
    let sensors = ["sensors.arrangement=none", "sensors.terminals=true"];
    let (code, json) = checked("drone-u8", &sensors);
    let (method, next) = recommended(&json);
    assert_eq!(
        (code, json["verdict"].as_str(), method.as_str()),
        (Some(0), Some("suited"), "open-terminal"),
        "{json:#}"
    );
    assert!(
        next.contains("standstill run drone-u8") && next.contains("detector.method=open-terminal"),
        "{next}"
    );
}

#[test]
#[ignore = "long: two minutes of processor time; the drone's motor has the same way"]
fn golden_motors_of_fans_pumps_and_hubs_on_one_shunt_are_suited_if_they_saturate_enough() {
    for motor in ["fan-ceiling", "pump-submersible", "hub-hoverboard"] {
        let (code, json) = checked(motor, &["sensors.arrangement=dc-link-shunt"]);
        let (method, next) = recommended(&json);
        assert_eq!((code, json["verdict"].as_str()), (Some(1), Some("suited-if")), "{motor}: {json:#}");
        assert!(
            ["maximum-likelihood", "maximum-likelihood-adaptive", "bipolar"].contains(&method.as_str()),
            "{motor}: {method}"
        );
        // The saturation is to be measured first; what is recommended can be run meanwhile.
        assert!(
            next.contains("motor.nameplate.saturation=") && next.contains("standstill run "),
            "{motor}: {next}"
        );
    }
}
