//! Faults and the methods that they reach.

use std::collections::HashMap;
use std::fs;

use standstill_detect::{Check, MethodName};
use standstill_scenario::FaultMode;

use super::{answer, folder, number, row, said};

/// A method that reads voltages alone does not notice current sensors: its rows say so, and count as no evidence.
#[test]
fn law_faults_of_current_sensors_do_not_reach_a_method_that_reads_no_current() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), "sensors.terminals = true\n[detector]\nmethod = \"open-terminal\"\n")
        .expect("written");
    let modes =
        ["--mode", "current-dead", "--mode", "currents-swapped", "--begins", "before", "--trials", "20"];
    let found = answer(&[&["faults", "s.toml", "--json", "--out", "f"], &modes[..]].concat(), 0, path);
    let sound = number(row(&found, "as it is"), "right");
    for mode in ["current-dead", "currents-swapped"] {
        let row = row(&found, mode);
        assert_eq!(row["effect"], "none: the method reads no current");
        assert_eq!((number(row, "right"), row["detected_by"].is_null()), (sound, sound == 20.0), "{row}");
    }
    let text = said(&[&["faults", "s.toml", "--out", "g"], &modes[..]].concat(), path);
    assert!(text.contains("none reaches a method that reads no current"), "{text}");
    let listed = "open-terminal, not read, as the method reads no current: current-dead; currents-swapped";
    assert!(text.contains(listed), "{text}");
    // The wires are its own, and the headline is of them alone.
    let more = ["faults", "s.toml", "--out", "h", "--mode", "terminals-turned"];
    let text = said(&[&more[..], &modes[..]].concat(), path);
    assert!(text.contains("Of the one fault 1 has dangerous answers"), "{text}");
    // With currents a dead sensor counts.
    let text = said(&[&["faults", "s.toml", "--method", "bipolar", "--out", "i"], &modes[..]].concat(), path);
    assert!(text.contains("Of 2 faults none") && !text.contains("not read"), "{text}");
}

/// The kept counts have each mode with both methods on each motor; no pole is wrong but where standstill cannot tell; and the numbers of
/// docs/faults.md are theirs.
#[test]
fn golden_the_page_says_what_the_kept_counts_say() {
    let page = include_str!("../../../../../docs/faults.md");
    let files = [
        include_str!("../../../../../docs/notes/faults-paper-5k5.csv"),
        include_str!("../../../../../docs/notes/faults-light-vehicle.csv"),
        include_str!("../../../../../docs/notes/faults-cross-saturation.csv"),
    ];
    let unknowable = ["terminals-swapped", "terminals-turned", "sheet-signature"];
    let (mut before, mut right, mut later) = (0, 0, 0);
    for file in files {
        let mut reader = csv::Reader::from_reader(file.as_bytes());
        let rows: Vec<HashMap<String, String>> =
            reader.deserialize().collect::<Result<_, _>>().expect("a table");
        for method in ["bipolar", "maximum-likelihood"] {
            let of = |mode: &str, begins: &str| {
                let is = |row: &&HashMap<String, String>| {
                    row["method"] == method && row["failure_mode"] == mode && row["begins"] == begins
                };
                rows.iter().find(is).unwrap_or_else(|| panic!("{method}: {mode}, {begins}"))
            };
            for mode in FaultMode::ALL {
                assert_eq!(of(mode.name(), "before")["trials"], "3000");
                if mode.may_begin() {
                    of(mode.name(), "during");
                }
            }
            for whole in ["as it is", "as it is with more parts"] {
                assert_eq!(of(whole, "")["right"], "3000", "{method}: {whole}");
            }
        }
        for row in rows.iter().filter(|row| !row["begins"].is_empty()) {
            let is_right = row["wrong_pole"] == "0";
            assert!(is_right || unknowable.contains(&row["failure_mode"].as_str()), "{row:?}");
            assert_eq!(row["errors"], "0", "{row:?}");
            let is_before = row["begins"] == "before";
            before += usize::from(is_before);
            right += usize::from(is_before && is_right);
            later += usize::from(!is_before);
        }
    }
    assert!(
        page.contains(&format!(
            "Of {before} rows with a fault before the detection {right} have no wrong pole"
        ))
    );
    assert!(page.contains(&format!("{later} rows")), "{later}");
}

/// The table of docs/faults.md names with each check the methods that have it.
#[test]
fn golden_the_page_names_the_methods_of_each_check() {
    let page = include_str!("../../../../../docs/faults.md");
    for check in Check::ALL {
        let has = |method: &MethodName| method.checks().has(check);
        let methods: Vec<String> =
            MethodName::ALL.into_iter().filter(has).map(|method| format!("`{method}`")).collect();
        let methods = if methods.len() == MethodName::ALL.len() {
            "all methods".to_owned()
        } else {
            methods.join(", ")
        };
        let row = page.lines().find(|line| line.starts_with(&format!("| `{}` |", check.name())));
        let row = row.unwrap_or_else(|| panic!("a row of {}", check.name()));
        assert!(row.ends_with(&format!("| {methods} |")), "{row}\n{methods}");
    }
}
