//! Answers that are sectors: in the files of a run, in sweeps beside angles, in odds and budgets; and answers that are axes.

use std::fs;
use std::path::Path;

use super::campaigns::succeed;
use super::changed::write_with_its_digest;
use super::{folder, standstill};
use serde_json::Value;

const FAN: &str = include_str!("../../../../examples/scenarios/six-pulse-fan.toml");

/// Writes the fan of the examples as s.toml, with these lines at its end.
fn fan(path: &Path, more: &str) {
    fs::write(path.join("s.toml"), format!("{FAN}{more}")).expect("writable");
}

/// Cells of a column of a CSV file.
fn column(path: &Path, name: &str) -> Option<Vec<String>> {
    let mut reader = csv::Reader::from_path(path).expect("a table");
    let place = reader.headers().expect("a header").iter().position(|found| found == name)?;
    Some(reader.records().map(|row| row.expect("a row")[place].to_owned()).collect())
}

/// Writes a CSV file of trials again without a column, as earlier versions wrote it.
fn without(path: &Path, name: &str) -> String {
    let mut reader = csv::Reader::from_path(path).expect("a table");
    let header = reader.headers().expect("a header").clone();
    let place = header.iter().position(|found| found == name).expect("the column");
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in std::iter::once(header).chain(reader.records().map(|row| row.expect("a row"))) {
        writer
            .write_record(row.iter().enumerate().filter(|(k, _)| *k != place).map(|(_, cell)| cell))
            .expect("written");
    }
    String::from_utf8(writer.into_inner().expect("whole")).expect("UTF-8")
}

#[test]
fn law_a_sector_has_its_half_width_in_files_of_trials_and_old_files_are_read() {
    let folder = folder();
    let path = folder.path();
    fan(path, "sector = \"60 deg\"\n");
    succeed(&["run", "s.toml", "--trials", "80", "--out", "new"], path);
    let table = path.join("new/trials.csv");
    let half = column(&table, "half_sector_deg").expect("the column");
    let outcome = column(&table, "outcome").expect("the column");
    assert!(
        half.len() == 80
            && half
                .iter()
                .zip(&outcome)
                .all(|(half, outcome)| { half == if outcome == "failed" { "" } else { "30.0" } }),
        "{half:?} {outcome:?}"
    );
    let report = succeed(&["report", "new"], path);
    assert!(report.contains("beyond the sector"), "{report}");
    // Without the column the width is that of the summary, and the report the same.
    write_with_its_digest(&path.join("new"), &without(&table, "half_sector_deg"));
    assert_eq!(column(&table, "half_sector_deg"), None);
    assert_eq!(succeed(&["report", "new", "--force"], path), report);
    // Angles have no such column.
    succeed(&["run", "s.toml", "--trials", "20", "-s", "detector.sector=0deg", "--out", "angles"], path);
    assert_eq!(column(&path.join("angles/trials.csv"), "half_sector_deg"), None);
}

#[test]
fn regress_a_sweep_of_sectors_and_angles_says_how_it_ranks_them() {
    let folder = folder();
    let path = folder.path();
    fan(
        path,
        "[axes]\n\"detector.sector\" = [\"0 deg\", \"60 deg\"]\n\"sensors.timer\" = [\"0.08 us\", \"1 us\"]\n",
    );
    let said = succeed(&["run", "s.toml", "--trials", "60", "--out", "sweep"], path);
    assert!(said.contains("rms and p95 of sectors: what is beyond them"), "{said}");
    let half = column(&path.join("sweep/trials.csv"), "half_sector_deg").expect("the column");
    let sector = column(&path.join("sweep/trials.csv"), "detector.sector").expect("the axis");
    assert!(half.iter().zip(&sector).all(|(half, sector)| half.is_empty() || sector != "0.0"));
    assert!(half.iter().any(|half| half == "30.0"));
    let report = succeed(&["report", "sweep"], path);
    assert!(
        report.contains(
            "Points are ranked by the share of starts answered rightly, then by that off by more than 2°"
        ),
        "{report}"
    );
    assert!(report.contains("angles before sectors"), "{report}");
}

#[test]
fn regress_odds_of_an_error_say_that_it_counts_from_the_border_of_a_sector() {
    let folder = folder();
    let path = folder.path();
    fan(path, "sector = \"60 deg\"\n");
    let said = |extra: &[&str]| {
        let mut words = vec!["odds", "s.toml", "--event", "|e| > 1 deg", "--effort", "quick"];
        words.extend(extra);
        succeed(&words, path)
    };
    let sectors = said(&["--out", "sectors"]);
    assert!(sectors.contains("beyond the sector named by more than 1°"), "{sectors}");
    let angles = said(&["-s", "detector.sector=0deg", "--out", "angles"]);
    assert!(angles.contains("whose axis is off by more than 1°") && !angles.contains("border"), "{angles}");
}

#[test]
fn regress_a_budget_lists_no_key_of_current_sensors_where_no_current_is_read() {
    let folder = folder();
    let path = folder.path();
    let text = "motor = \"paper-5k5\"\nerrors = \"default\"\n[detector]\nmethod = \"open-terminal\"\n[sensors]\narrangement = \"none\"\nterminals = true\n";
    fs::write(path.join("s.toml"), text).expect("writable");
    let said = succeed(&["budget", "s.toml", "--pairs", "100", "--out", "budget"], path);
    for key in ["sensors.gain_error", "sensors.offset", "sensors.noise", "sensors.bits"] {
        assert!(!said.contains(key), "{key} in\n{said}");
    }
    for key in ["sensors.terminal_gain_error", "sensors.terminal_noise", "sensors.terminal_bits"] {
        assert!(said.contains(key), "{key} not in\n{said}");
    }
}

/// A motor without a magnet has no poles: every command takes its axis for the answer.
#[test]
fn law_every_command_counts_an_axis_as_the_answer_of_a_motor_without_poles() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), "motor = \"reluctance-6k7\"\ndetector.method = \"bipolar\"\n")
        .expect("written");
    let list = "trials = 100\nodds = \"off\"\n[[requirement]]\nid = \"A\"\ntext = \"The angle is good.\"\nlimit = \"P(|e| > 3 deg) <= 10 %\"\n";
    fs::write(at.join("list.toml"), list).expect("written");
    let asked = |arguments: &[&str]| {
        let output = standstill(arguments, at);
        let text = String::from_utf8(output.stdout).expect("text");
        assert_eq!(
            output.status.code(),
            Some(0),
            "{arguments:?}: {text} {}",
            String::from_utf8_lossy(&output.stderr)
        );
        text
    };
    let json = |arguments: &[&str]| serde_json::from_str::<Value>(&asked(arguments)).expect("JSON");
    let run = json(&["run", "s.toml", "--trials", "40", "--json", "--out", "r"]);
    let summary = &run["summary"];
    for (name, count) in [("found", 40), ("undetermined", 0), ("failed", 0), ("wrong_poles", 0)] {
        assert_eq!(summary[name], count, "{name}: {summary}");
    }
    let report = asked(&["report", "r"]);
    assert!(
        report.contains("0 % without an axis") && report.contains("a motor without a magnet has none"),
        "{report}"
    );
    let trace = asked(&["trace", "s.toml", "--angle", "200", "--out", "t"]);
    assert!(trace.contains("found the axis ") && trace.contains(", error "), "{trace}");
    let compared = json(&["compare", "s.toml", "--method", "bipolar", "--trials", "20", "--json"]);
    assert_eq!(compared[0]["right"], 1.0, "{compared}");
    asked(&["faults", "s.toml", "--trials", "20", "--out", "f"]);
    let table = fs::read_to_string(at.join("f/faults.csv")).expect("a table");
    let own = table.lines().find(|line| line.contains("as it is")).expect("as it is");
    assert!(!own.contains("answer alike"), "{own}");
    let qualified = asked(&["qualify", "s.toml", "list.toml", "--no-witness", "--out", "q"]);
    assert!(qualified.contains("passed"), "{qualified}");
}
