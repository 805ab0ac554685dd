//! `standstill faults`, and scenarios with faults.

use std::fs;

use serde_json::Value;

use super::answers::{answer, has, number};
use super::{folder, names, standstill};

const BIPOLAR: &str = "seed = 3\nrotor = { state = \"free\" }\n[detector]\nmethod = \"bipolar\"\n";

/// What a command says, which succeeds.
fn said(arguments: &[&str], folder: &std::path::Path) -> String {
    let output = standstill(arguments, folder);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// The row of a fault.
fn row<'a>(answer: &'a Value, fault: &str) -> &'a Value {
    let rows = answer["rows"].as_array().expect("rows");
    rows.iter().find(|row| row["failure_mode"] == fault).expect(fault)
}

#[test]
fn law_each_start_of_a_fault_is_counted_once_and_the_worst_can_be_seen() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), BIPOLAR).expect("written");
    let modes = ["phase-open", "terminals-swapped", "current-dead", "current-sign", "lower-switch-open"];
    let modes = modes.iter().flat_map(|mode| ["--mode", mode]);
    let asked = ["faults", "s.toml", "--trials", "60", "--json", "--out", "f"];
    let asked: Vec<&str> = asked.into_iter().chain(modes).collect();
    let found = answer(&asked, 0, path);
    assert_eq!(found["rows"].as_array().expect("rows").len(), 6);
    for row in found["rows"].as_array().expect("rows") {
        has(row, &["method", "failure_mode", "effect", "wrong_pole_at_most", "coverage", "reasons"]);
        let of = |name: &str| number(row, name);
        assert_eq!(of("right") + of("wrong_pole") + of("beyond_limit") + of("detected"), 60.0, "{row}");
        assert!(of("dangerous_and_detected") <= of("dangerous_without_checks"));
        assert!(of("wrong_pole_at_most") >= of("wrong_pole") / 60.0);
    }
    // The physics: a whole drive answers; behind an open wire, or a switch that stays open, pulses carry nothing.
    assert!(number(row(&found, "as it is"), "right") >= 58.0);
    for fault in ["phase-open", "lower-switch-open"] {
        let row = row(&found, fault);
        assert_eq!(
            (number(row, "detected"), row["detected_by"].as_str()),
            (60.0, Some("too little current"))
        );
    }
    // Exchanged wires mirror the angle: standstill cannot tell. The sensors can be told apart from a dead one.
    let swapped = row(&found, "terminals-swapped");
    assert!(number(swapped, "detected") <= 5.0 && number(swapped, "right") <= 5.0, "{swapped}");
    for fault in ["current-dead", "current-sign"] {
        let row = row(&found, fault);
        assert_eq!(number(row, "detected"), 60.0, "{row}");
    }
    assert_eq!(names(&path.join("f")), ["faults.csv", "faults.html", "faults.json"]);
    // The command that shows the worst start runs as it is printed.
    let text =
        said(&["faults", "s.toml", "--trials", "20", "--mode", "terminals-swapped", "--out", "g"], path);
    let line =
        text.lines().find(|line| line.trim().starts_with("standstill trace")).expect("a command").trim();
    let words: Vec<String> =
        line.split_whitespace().skip(1).map(|word| word.trim_matches('\'').to_owned()).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).chain(["--out", "t"]).collect();
    let trace = said(&words, path);
    assert!(trace.contains("fault"), "{trace}");
}

#[test]
fn regress_faults_that_cannot_be_are_refused() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), BIPOLAR).expect("written");
    let wrong = super::mistake(&["faults", "s.toml", "--mode", "phase-opn"], path);
    assert!(wrong.contains("phase-opn") && wrong.contains("phase-open"), "{wrong}");
    // A drive without a capacitor in its link cannot have an aged one, which is said with what it would need.
    let found =
        answer(&["faults", "s.toml", "--trials", "5", "--json", "--mode", "link-capacitor-aged"], 0, path);
    assert_eq!(found["not_studied"][0]["mode"], "link-capacitor-aged");
    assert!(found["not_studied"][0]["needed"].as_str().expect("text").contains("inverter.capacitance"));
    let wrong = super::mistake(&["run", "s.toml", "-s", "faults.0.mode=contact-resistance"], path);
    assert!(wrong.contains("faults[0].magnitude") && wrong.contains("a resistance"), "{wrong}");
}
