//! `odds`, `budget` and `require`.

use std::fs;

use serde_json::Value;

use super::{folder, mistake, names, standstill};

const SCENARIO: &str = "motor = \"paper-5k5\"\ndetector.method = \"line-inductance-fast\"\n";

fn answer(arguments: &[&str], code: i32, folder: &std::path::Path) -> Value {
    let output = standstill(arguments, folder);
    assert_eq!(output.status.code(), Some(code), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty(), "quiet in a pipe");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} of {value}"))
}

#[test]
fn odds_of_what_is_not_rare_are_those_of_plain_trials_on_any_number_of_threads() {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENARIO).expect("written");
    let arguments = ["odds", "s.toml", "--event", "|e| > 1 deg", "--json"];
    let one = answer(&[&arguments[..], &["--threads", "1"]].concat(), 0, folder.path());
    assert_eq!(one, answer(&[&arguments[..], &["--threads", "3"]].concat(), 0, folder.path()));
    let (low, high) = (number(&one, "low"), number(&one, "high"));
    assert!(low < 0.24 && 0.22 < high && high - low < 0.02, "{low} to {high}");
    assert_eq!((&one["event"], &one["levels"]), (&"|e| > 1 deg".into(), &1.into()));
    assert_eq!(number(&one, "trials"), 32_000.0);
    assert_eq!(names(folder.path()), ["s.toml"], "with --json no files");
}

#[test]
fn a_budget_has_its_keys_and_writes_its_files() {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENARIO).expect("written");
    let arguments = ["budget", "s.toml", "--pairs", "200", "--json", "--out", "b"];
    let budget = answer(&arguments, 0, folder.path());
    assert!((0.6..1.1).contains(&number(&budget, "rms_deg")));
    let sources = budget["sources"].as_array().expect("a list");
    let share: f64 = sources.iter().map(|source| number(source, "share")).sum();
    assert!((share - 1.0).abs() < 1e-9, "{share}");
    for name in ["method", "sensors.noise", "sensors.gain_error", "interaction"] {
        let source = sources.iter().find(|source| source["source"] == name).expect(name);
        assert!(number(source, "share_low") <= number(source, "share_high"));
    }
    let expected = [
        "budget.csv",
        "budget.html",
        "budget.json",
        "budget.png",
        "budget.svg",
        "over_angle.png",
        "over_angle.svg",
    ];
    assert_eq!(names(&folder.path().join("b")), expected);
}

#[test]
fn a_requirement_is_an_edge_or_an_answer_with_code_1() {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENARIO).expect("written");
    let require = |limit: &str, more: &[&str], code: i32| {
        let arguments = ["require", "s.toml", "--key", "sensors.noise", "--limit", limit, "--json"];
        answer(&[&arguments[..], more].concat(), code, folder.path())
    };
    // Noise of 10 mA makes 0.84°; the gains alone 0.63°.
    let edge = require("rms <= 1 deg", &["--between", "2 mA:50 mA", "--most", "4000"], 0);
    let (low, value, high) = (number(&edge, "low"), number(&edge, "value"), number(&edge, "high"));
    assert!(0.010 < low && low <= value && value <= high && high < 0.020, "{edge}");
    assert_eq!((&edge["key"], &edge["limit"]), (&"sensors.noise".into(), &"rms <= 1 deg".into()));
    let none = require("rms <= 0.1 deg", &["--between", "5 mA:50 mA"], 1);
    assert!(none["value"].is_null() && none["answer"] == "no value meets it");
    let all = require("rms <= 60 deg", &["--between", "5 mA:20 mA"], 1);
    assert_eq!(all["answer"], "every value meets it");
}

#[test]
fn mistakes_name_what_there_is() {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENARIO).expect("written");
    let says = |arguments: &[&str], parts: &[&str]| {
        let message = mistake(arguments, folder.path());
        for part in parts {
            assert!(message.contains(part), "{part} in {message}");
        }
    };
    says(&["odds", "s.toml", "--event", "wrongpole"], &["`wrongpole`", "wrong-pole", "peak_current"]);
    says(
        &["require", "s.toml", "--key", "sensors.noise", "--limit", "rmse <= 1 deg"],
        &["`rmse <= 1 deg`", "wrong_poles", "duration"],
    );
    says(
        &["require", "s.toml", "--key", "sensors.noize", "--limit", "rms <= 1 deg"],
        &["sensors.noize", "noise", "gain_error"],
    );
    says(
        &["require", "s.toml", "--key", "rotor.state", "--limit", "rms <= 1 deg"],
        &["rotor.state", "expected a string"],
    );
    says(&["budget", "s.toml", "-s", "axes.\"sensors.noise\"=[\"1 mA\", \"2 mA\"]"], &["axes", "without"]);
    assert_eq!(names(folder.path()), ["s.toml"], "nothing half-written");
}
