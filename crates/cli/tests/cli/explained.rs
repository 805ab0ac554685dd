//! `standstill explain`.

use std::fs;

use super::answers::{SCENARIO, answer, number};
use super::{folder, mistake, names, standstill};

#[test]
fn a_trial_is_explained_as_it_was_and_by_what_it_drew() {
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
    assert!(mistake(&["explain", "r", "--trial", "300"], path).contains("from 0 to 299"));
    let early = ["run", "s.toml", "--trials", "400", "--stop-at", "rms=20%", "--out", "early"];
    assert!(standstill(&early, path).status.success());
    assert!(
        mistake(&["explain", "early", "--trial", "399"], path)
            .contains("ended early (stop_at), with trial 99")
    );
    let summary = fs::read_to_string(path.join("r/summary.json")).expect("summary.json");
    let foreign = summary.replace("\"numerics\": ", "\"numerics\": 9");
    fs::write(path.join("r/summary.json"), foreign).expect("written");
    assert!(mistake(&["explain", "r", "--trial", "1"], path).contains("cannot be repeated"));
}
