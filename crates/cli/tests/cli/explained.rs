//! `standstill explain`.

use std::fs;

use super::answers::{SCENARIO, answer, number};
use super::guides::words;
use super::{folder, mistake, names, standstill};

#[test]
fn law_a_trial_is_explained_as_it_was_and_by_what_it_drew() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    assert!(standstill(&["run", "s.toml", "--trials", "300", "--out", "r"], path).status.success());
    let trials = fs::read_to_string(path.join("r/trials.csv")).expect("trials.csv");
    let axis_error = |line: &str| line.split(',').nth(9).and_then(|cell| cell.parse::<f64>().ok());
    let worst = trials.lines().skip(1).filter_map(axis_error).map(f64::abs).fold(0.0, f64::max);
    let told = answer(&["explain", "r", "--json", "--out", "e"], 0, path);
    let trial = &told["trials"][0];
    let error = number(&trial["ended"], "axis_error_deg");
    assert!((error.abs() - worst).abs() < 1e-9, "{error} and {worst}");
    let causes = trial["causes"].as_array().expect("a list");
    let cause = |name: &str| causes.iter().find(|cause| cause["error"] == name).expect(name);
    for name in ["gain of a", "gain of b", "gain of c", "noise of all current samples"] {
        assert!(cause(name)["without"]["outcome"] == "found", "{name}");
    }
    // An error in the tail is one of several that add up: without the first it is smaller.
    let without = number(&causes[0]["without"], "axis_error_deg");
    assert!(without.abs() < error.abs(), "{without}");
    // Without all of them the method's own error is left, which is below 0.7° at each angle.
    assert!(number(&trial["without_all"], "axis_error_deg").abs() < 0.7);
    assert!(
        cause("gain of a")["drawn_deviations"]
            .as_f64()
            .is_some_and(|drawn| drawn != 0.0 && drawn.abs() < 5.0)
    );
    let made = names(&path.join("e"));
    assert!(
        ["explain.csv", "explain.html", "explain.json"].iter().all(|name| made.contains(&(*name).to_owned()))
    );
    assert_eq!(made.iter().filter(|name| name.starts_with("trial_0_")).count(), 2);
    // What cannot be is said.
    assert!(mistake(&["explain", "r", "--wrong-poles"], path).contains("no wrong pole"));
    assert!(mistake(&["explain", "r", "--unanswered"], path).contains("no trial without an answer"));
    assert!(mistake(&["explain", "r", "--trial", "300"], path).contains("from 0 to 299"));
    let early = ["run", "s.toml", "--trials", "400", "--stop-at", "rms=20%", "--out", "early"];
    assert!(standstill(&early, path).status.success());
    assert!(
        mistake(&["explain", "early", "--trial", "399"], path)
            .contains("ended early (stop_at), with trial 99")
    );
    let summary = fs::read_to_string(path.join("r/summary.json")).expect("summary.json");
    // Of another version, which kept no digest of the summary.
    let (before, _) = summary.split_once(",\n  \"digest\": ").expect("its digest");
    let foreign = format!("{before}\n}}").replace("\"numerics\": ", "\"numerics\": 9");
    fs::write(path.join("r/summary.json"), foreign).expect("written");
    let output = standstill(&["explain", "r", "--trial", "1"], path);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && said.contains("cannot be repeated"), "{said}");
}

#[test]
fn regress_other_trials_have_a_folder_of_their_own_and_whole_numbers_of_parquet_files_are_read() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let run = ["run", "s.toml", "--trials", "100", "--format", "parquet", "--out", "p"];
    assert!(standstill(&run, path).status.success());
    for (trials, name) in [
        (&["--trial", "3"][..], "trial-3"),
        (&["--trial", "4"][..], "trial-4"),
        (&["--worst", "2"][..], "worst-2"),
    ] {
        let output = standstill(&[&["explain", "p"][..], trials].concat(), path);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let there = names(&path.join("p/explain").join(name));
        assert!(there.contains(&"explain.csv".to_owned()), "{there:?}");
        // The table has the errors with the largest effects, and says how many it leaves out.
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let rows =
            fs::read_to_string(path.join("p/explain").join(name).join("explain.csv")).expect("a table");
        let trials = if name == "worst-2" { 2 } else { 1 };
        let further = (rows.lines().count() - 1) / trials - 12;
        assert!(text.contains(&format!("{further} further errors")), "{text}");
    }
}

#[test]
fn regress_trials_without_an_axis_are_told_by_their_numbers_and_points_as_they_are_counted() {
    let folder = folder();
    let path = folder.path();
    // With a pulse of 5 µs no start finds an axis, with one of 80 µs all do.
    let axes = format!("{SCENARIO}[axes]\n\"detector.pulse\" = [\"80 us\", \"5 us\"]\n");
    fs::write(path.join("s.toml"), axes).expect("written");
    assert!(standstill(&["sweep", "s.toml", "--trials", "20", "--out", "r"], path).status.success());
    let told = answer(&["explain", "r", "--worst", "3", "--json"], 0, path);
    let lost = told["without_axis"].as_u64().expect("a count");
    assert!(lost > 3 && lost <= 20, "{told}");
    let places: Vec<_> =
        (0..3).map(|k| (told["trials"][k]["point"].as_u64(), told["trials"][k]["trial"].as_u64())).collect();
    assert!(places.iter().all(|(point, _)| *point == Some(1)) && places.is_sorted(), "{places:?}");
    let text = standstill(&["explain", "r", "--worst", "3"], path);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("at point 1 (of 0 to 1): detector.pulse = 5 us"), "{text}");
    assert!(text.contains(&format!("{lost} trials found no axis")), "{text}");
}

/// Questions refuse a scenario with axes: what goes on from a trial of a sweep is asked at that trial's point, and the command runs.
#[test]
fn regress_what_goes_on_from_a_trial_of_a_sweep_is_asked_at_its_point() {
    let folder = folder();
    let path = folder.path();
    let axes = |axis: &str| {
        let text = format!("detector.method = \"line-inductance-fast\"\n[axes]\n{axis}\n");
        fs::write(path.join("s.toml"), text).expect("written");
    };
    for (axis, point, expected) in [
        ("\"sensors.noise\" = [\"10 mA\", \"60 mA\"]", "-s axes={} -s 'sensors.noise=60 mA'", "require"),
        ("\"detector.pulse\" = [\"80 us\", \"5 us\"]", "-s axes={} -s 'detector.pulse=5 us'", "trace"),
    ] {
        axes(axis);
        let run = ["sweep", "s.toml", "--trials", "20", "--force", "--out", "r"];
        assert!(standstill(&run, path).status.success());
        let text = String::from_utf8(standstill(&["explain", "r", "--force"], path).stdout).expect("text");
        let command = text.lines().find_map(|line| line.strip_prefix("    standstill ")).expect("a command");
        assert!(command.starts_with(&format!("{expected} s.toml")), "{text}");
        assert!(command.replace("'axes={}'", "axes={}").contains(point), "{command}");
        let mut given = words(command);
        if expected == "require" {
            given.extend(["--most", "100"].map(str::to_owned));
        }
        let given: Vec<&str> = given.iter().map(String::as_str).collect();
        let output = standstill(&given, path);
        let heard = String::from_utf8_lossy(&output.stderr);
        assert!(matches!(output.status.code(), Some(0 | 1)), "{command}: {heard}");
    }
}

/// Of wrong poles `run`, `report` and `explain` say what to look at next, and a start that draws no error that turns it says so.
#[test]
fn regress_a_wrong_pole_is_followed_to_its_reason() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let wrong = ["-s", "detector.method=bipolar", "-s", "detector.signature=inverted"];
    let run = [&["run", "s.toml", "--trials", "20", "--out", "r"][..], &wrong].concat();
    let text = |arguments: &[&str]| {
        let said = String::from_utf8(standstill(arguments, path).stdout).expect("text");
        said.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let said = text(&run);
    assert!(
        said.contains("20 of 20 starts name the wrong pole. Why: standstill explain r --wrong-poles"),
        "{said}"
    );
    let said = text(&["report", "r"]);
    assert!(
        said.contains("More starts do not mend what is not met. Why: `standstill explain r --wrong-poles`"),
        "{said}"
    );
    assert!(!said.contains("starts show all of it"), "{said}");
    let said = text(&["explain", "r", "--wrong-poles", "--worst", "1"]);
    let next = "no error of drive and sensors makes it; settings with which starts end otherwise";
    assert!(
        said.contains(next) && said.contains("standstill check ") && !said.contains("scenario.toml"),
        "{said}"
    );
}

/// What turned the rotor is no error that a trial draws; it is said with its speed.
#[test]
fn regress_a_rotor_that_turns_is_named_where_a_trial_is_explained() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let turning = [
        "-s",
        "detector.method=bipolar",
        "-s",
        "detector.checks=false",
        "-s",
        "rotor.state=driven",
        "-s",
        "rotor.speed=40 rpm",
    ];
    let run = [&["run", "s.toml", "--trials", "20", "--out", "r"][..], &turning].concat();
    assert!(standstill(&run, path).status.success());
    let output = standstill(&["explain", "r"], path);
    let said = String::from_utf8_lossy(&output.stdout).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(said.contains("electrical meanwhile: it turned at 40 rpm from the start"), "{said}");
    assert!(said.contains("standstill require s.toml -s") && said.contains("--key rotor.speed"), "{said}");
}
