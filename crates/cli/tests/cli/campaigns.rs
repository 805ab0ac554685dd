//! Scenario files: what a run leaves behind, whatever happens to it.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use super::{folder, mistake, names, standstill};

/// Two axes, a tolerance and few trials of a method that is quick to simulate.
pub(super) const SWEEP: &str = r#"
trials = 250
[detector]
method = "bipolar"
[axes]
"sensors.noise" = { from = "1 mA", to = "40 mA", points = 2 }
"errors" = ["default", "harsh"]
[tolerances]
"motor.winding.resistance" = { normal = "5 %", truncated = 3 }
"#;

pub(super) fn scenario(folder: &Path, text: &str) {
    fs::write(folder.join("s.toml"), text).expect("written");
}

pub(super) fn succeed(arguments: &[&str], folder: &Path) -> String {
    let output = standstill(arguments, folder);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {message}");
    assert!(super::quiet(&output), "quiet in a pipe: {message}");
    String::from_utf8(output.stdout).expect("text")
}

/// All files of a folder.
pub(super) fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let read = |name: String| (name.clone(), fs::read(folder.join(name)).expect("readable"));
    names(folder).into_iter().map(read).collect()
}

fn start(arguments: &[&str], folder: &Path) -> Child {
    Command::new(env!("CARGO_BIN_EXE_standstill"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts")
}

/// promise: resumed-bytes
#[test]
fn law_a_run_killed_at_twenty_random_moments_ends_with_the_same_bytes() {
    let folder = folder();
    let path = folder.path();
    scenario(path, SWEEP);
    for format in ["csv", "parquet"] {
        let whole = format!("whole-{format}");
        succeed(&["run", "s.toml", "--threads", "1", "--format", format, "--out", &whole], path);
        let expected = files(&path.join(&whole));
        let out = format!("killed-{format}");
        let arguments = ["run", "s.toml", "--format", format, "--resume", "--out", &out];
        let (mut kills, mut ends) = (0, 0);
        // The moments need not repeat, so a seed of the clock is as good as any; they are told if a comparison fails.
        let mut random = u64::from(std::process::id());
        let mut moments = Vec::new();
        while kills < 10 {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let moment = random >> 57;
            moments.push(moment);
            let mut child = start(&arguments, path);
            std::thread::sleep(Duration::from_millis(moment));
            child.kill().expect("SIGKILL");
            if child.wait().expect("ended").success() {
                assert_eq!(files(&path.join(&out)), expected, "killed after {moments:?} ms");
                fs::remove_dir_all(path.join(&out)).expect("removed");
                ends += 1;
            } else {
                kills += 1;
            }
        }
        succeed(&arguments, path);
        let mut found = files(&path.join(&out));
        // What a killed process leaves of files in the making, the next one removes that makes some.
        found.retain(|name, _| !name.starts_with('.'));
        assert_eq!(found, expected, "killed after {moments:?} ms, {ends} ends between");
        assert!(succeed(&arguments, path).contains("nothing to do"));
    }
}

/// promise: shards-are-the-run
#[test]
fn law_shards_merge_to_the_bytes_of_the_whole() {
    let folder = folder();
    let path = folder.path();
    scenario(path, SWEEP);
    for (more, name) in [(&[][..], "all"), (&["--stop-at", "rms=8%"][..], "early")] {
        let whole = format!("{name}-whole");
        succeed(&[&["run", "s.toml", "--out", &whole], more].concat(), path);
        let out = |k: u32| format!("{name}-{k}");
        for k in [3, 1, 2] {
            let shard = format!("{k}/3");
            let text =
                succeed(&[&["run", "s.toml", "--shard", &shard, "--out", &out(k)], more].concat(), path);
            assert!(text.contains("standstill merge"), "{text}");
        }
        let merged = format!("{name}-merged");
        let message = mistake(&["merge", &out(1), &out(3), "--out", &merged], path);
        assert!(message.contains("missing: shard 2/3"), "{message}");
        assert!(!path.join(&merged).exists());
        let parts = [out(2), out(3), out(1)];
        let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
        succeed(&[&["merge", "--out", &merged], &parts[..]].concat(), path);
        assert_eq!(files(&path.join(&merged)), files(&path.join(&whole)), "{name}");
    }
    let rows = |name: &str| {
        let text = fs::read_to_string(path.join(name).join("trials.csv")).expect("readable");
        text.lines().count() - 1
    };
    assert_eq!(rows("all-whole"), 1000);
    assert!((400..1000).contains(&rows("early-whole")), "{}", rows("early-whole"));
}

#[test]
fn law_a_run_writes_the_axes_before_the_columns_of_reproduce_and_what_it_was() {
    let folder = folder();
    let path = folder.path();
    scenario(path, SWEEP);
    let json = succeed(&["run", "s.toml", "--trials", "5", "--json", "--out", "o"], path);
    assert_eq!(json, fs::read_to_string(path.join("o/summary.json")).expect("readable"));
    let summary: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(summary["run"]["trials"], 5);
    assert_eq!(summary["points"][2]["values"]["sensors.noise"], 0.04);
    assert_eq!(summary["points"][2]["values"]["errors"], "default");
    assert_eq!(summary["points"][2]["summary"]["trials"], 5);
    let mut trials = csv::Reader::from_path(path.join("o/trials.csv")).expect("CSV");
    let header = trials.headers().expect("a header").clone();
    assert_eq!(&header[0], "sensors.noise");
    assert_eq!(&header[1], "errors");
    assert_eq!(&header[2], "trial");
    assert_eq!(header.len(), 2 + 13 + 2 + 1);
    let rows: Vec<csv::StringRecord> = trials.records().map(|row| row.expect("a row")).collect();
    assert_eq!(rows.len(), 20);
    assert_eq!((&rows[5][0], &rows[5][1], &rows[5][2]), ("0.001", "harsh", "0"));
    let run: serde_json::Value = serde_json::from_str(&rows[0][17]).expect("JSON");
    assert_eq!((run["seed"].as_str(), run["version"].as_str()), (Some("1"), Some(env!("CARGO_PKG_VERSION"))));
    assert!(run["scenario"].as_str().is_some_and(|text| text.contains("bipolar")));
    // The points differ in their noise and not in their specimens: the same trials start at the same angles.
    assert_eq!(rows[3][3], rows[18][3]);
    assert_ne!(rows[3][4], rows[18][4]);
    // The other format takes the place of the first.
    succeed(&["run", "s.toml", "--trials", "5", "--format", "parquet", "--out", "o"], path);
    assert_eq!(names(&path.join("o")), ["summary.json", "trials.parquet"]);
}

/// promise: extended-bytes
#[test]
fn law_a_longer_run_goes_on_from_a_shorter_one_with_the_bytes_of_one_from_the_start() {
    goes_on(&[&["--format", "parquet"], &["--stop-at", "rms=14%", "--rows", "none"]]);
}

/// promise: extended-bytes
#[test]
#[ignore = "other forms of results: scripts/test-all.sh long"]
fn law_longer_runs_of_other_forms_go_on_from_shorter_ones() {
    goes_on(&[&[], &["--rows", "none"], &["--stop-at", "rms=14%"]]);
}

fn goes_on(forms: &[&[&str]]) {
    let folder = folder();
    let path = folder.path();
    scenario(path, SWEEP);
    // Some starts find no angle: the files do not say all of these.
    let run = |trials: &str, out: &str, more: &[&str]| {
        let arguments = ["run", "s.toml", "-s", "sensors.offset=150 mA", "--trials", trials, "--out", out];
        succeed(&[&arguments[..], more].concat(), path)
    };
    for &more in forms {
        run("300", "whole", more);
        let longer = |out: &str| run("300", out, &[more, &["--resume"]].concat());
        run("110", "short", more);
        assert!(longer("short").contains("trials that was there was extended to"), "{more:?}");
        // How often a journal was written is not what it says.
        let results = |out: &str| {
            let mut files = files(&path.join(out));
            files.remove("run.statistics");
            files
        };
        assert_eq!(results("short"), results("whole"), "{more:?}");
        assert!(longer("short").contains("nothing to do"));
        // Twice, and by way of shards, whose journals stay.
        if !more.contains(&"none") {
            for k in ["1/2", "2/2"] {
                run("40", "shards", &[more, &["--shard", k]].concat());
                run("90", "shards", &[more, &["--shard", k, "--resume"]].concat());
                run("300", "shards", &[more, &["--shard", k, "--resume"]].concat());
            }
            assert_eq!(names(&path.join("shards")), ["shard-1-of-2.journal", "shard-2-of-2.journal"]);
            let format = if more.contains(&"parquet") { "parquet" } else { "csv" };
            succeed(&["merge", "shards", "--format", format, "--out", "merged"], path);
            assert_eq!(files(&path.join("merged")), files(&path.join("whole")), "{more:?}");
        }
        for out in ["whole", "short", "shards", "merged"] {
            let _ = fs::remove_dir_all(path.join(out));
        }
    }
    // A run that is not finished: its journal is put aside until the longer one is done.
    run("300", "whole", &[]);
    let arguments = ["run", "s.toml", "-s", "sensors.offset=150 mA", "--trials", "200000", "--out", "short"];
    let mut child = start(&arguments, path);
    let size = || fs::metadata(path.join("short/run.journal")).map_or(0, |file| file.len());
    let begun = std::time::Instant::now();
    while size() < 20_000 {
        std::thread::sleep(Duration::from_millis(10));
        assert!(begun.elapsed() < Duration::from_secs(60), "no block was written");
    }
    child.kill().expect("SIGKILL");
    child.wait().expect("ended");
    let mut other = arguments;
    other[5] = "200001";
    let mut child = start(&[&other[..], &["--resume"]].concat(), path);
    let begun = std::time::Instant::now();
    // The journal that is being written has a name of its own until the earlier one is aside.
    while size() < 10_000 || !path.join("short/run.200000.earlier").is_file() {
        std::thread::sleep(Duration::from_millis(10));
        assert!(begun.elapsed() < Duration::from_secs(60), "nothing was taken over");
    }
    child.kill().expect("SIGKILL");
    child.wait().expect("ended");
    assert_eq!(names(&path.join("short")), ["run.200000.earlier", "run.journal"]);
    // A statistics-only shard of rows cannot tell which of them it has.
    run("40", "tally", &["--shard", "1/2", "--rows", "none"]);
    let arguments = ["run", "s.toml", "-s", "sensors.offset=150 mA", "--trials", "50", "--out", "tally"];
    let message =
        mistake(&[&arguments[..], &["--shard", "1/2", "--rows", "none", "--resume"]].concat(), path);
    assert!(message.contains("statistics alone of a shard cannot be extended"), "{message}");
}

#[test]
fn law_nothing_of_an_earlier_run_is_lost_or_mixed_in() {
    let folder = folder();
    let path = folder.path();
    scenario(path, SWEEP);
    succeed(&["run", "s.toml", "--trials", "40", "--shard", "1/2", "--out", "o"], path);
    let before = files(&path.join("o"));
    for (more, parts) in [
        (&[][..], &["not finished, or of a shard", "--resume"][..]),
        (&["--resume", "--seed", "2"], &["the journal of another run", "seed is 1 there and 2 here"]),
        (&["--resume", "--trials", "39"], &["the number of trials is 40 there and 39 here"]),
        (
            &["--resume", "-s", "sensors.offset=3 mA"],
            &["`sensors.offset` is not set there and 0.003 here", "--force in place of --resume"],
        ),
    ] {
        let run = ["run", "s.toml", "--trials", "40", "--shard", "1/2", "--out", "o"];
        let arguments: Vec<&str> = match more {
            ["--resume", "--trials", _] => {
                vec!["run", "s.toml", "--shard", "1/2", "--out", "o", more[0], more[1], more[2]]
            }
            _ => [&run[..], more].concat(),
        };
        let message = mistake(&arguments, path);
        for part in parts {
            assert!(message.contains(part), "{message}");
        }
        assert_eq!(files(&path.join("o")), before);
    }
    succeed(&["run", "s.toml", "--trials", "40", "--out", "done"], path);
    let message =
        mistake(&["run", "s.toml", "--trials", "40", "--seed", "2", "--resume", "--out", "done"], path);
    assert!(message.contains("the results of another run: the seed is 1 there and 2 here"), "{message}");
}

/// promise: ctrl-c-keeps
#[test]
fn law_ctrl_c_keeps_what_is_done_and_says_how_to_go_on() {
    let folder = folder();
    let path = folder.path();
    scenario(path, SWEEP);
    let child = Command::new(env!("CARGO_BIN_EXE_standstill"))
        .args(["run", "s.toml", "--trials", "100000", "--out", "a b"])
        .current_dir(path)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let journal = path.join("a b/run.journal");
    let size = || fs::metadata(&journal).map_or(0, |file| file.len());
    let begun = std::time::Instant::now();
    while size() < 20_000 {
        std::thread::sleep(Duration::from_millis(10));
        assert!(begun.elapsed() < Duration::from_secs(60), "no block was written");
    }
    let interrupt = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(interrupt.expect("kill").success());
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(130));
    let text = String::from_utf8(output.stdout).expect("text");
    assert!(text.contains("kept in a b/run.journal"), "{text}");
    assert!(text.contains("run s.toml --trials 100000 --out 'a b' --resume"), "{text}");
    assert_eq!(names(&path.join("a b")), ["run.journal"]);
}

#[test]
fn law_an_example_scenario_runs_as_it_is_and_is_never_overwritten() {
    let folder = folder();
    let path = folder.path();
    succeed(&["init"], path);
    let text = succeed(&["run", "scenario.toml", "--trials", "50"], path);
    assert!(
        text.contains("rms axis error") && text.contains("standstill report standstill-out/scenario-run"),
        "{text}"
    );
    let message = mistake(&["init"], path);
    assert!(message.contains("scenario.toml") && message.contains("already"), "{message}");
}

#[test]
fn law_a_sweep_takes_axes_from_the_command_line() {
    let folder = folder();
    let path = folder.path();
    succeed(&["init", "s.toml"], path);
    let text = succeed(
        &[
            "sweep",
            "s.toml",
            "--trials",
            "20",
            "--vary",
            "inverter.dead_time=1 us:4 us:3:log",
            "--vary",
            "detector.method=bipolar,maximum-likelihood",
            "--out",
            "o",
        ],
        path,
    );
    for part in ["6 points", "inverter.dead_time", "maximum-likelihood", "dead_time", "µs", "right %"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let arguments =
        ["sweep", "s.toml", "--trials", "3", "--vary", "sensors.noise=1 mA:9 mA:2", "--design", "sobol"];
    let many = [&arguments[..], &["--points", "64", "--out", "p"]].concat();
    let text = succeed(&many, path);
    assert!(
        text.contains("64 points, [95 % intervals]") && text.contains("The best 15 and the worst 15"),
        "{text}"
    );
    assert!(mistake(&arguments, path).contains("design.points"));
    assert!(mistake(&["sweep", "s.toml"], path).contains("has no axes"));
    let message = mistake(&["sweep", "s.toml", "--vary", "trials=1,2"], path);
    assert!(message.contains("a key of the run itself"), "{message}");
}

#[test]
fn law_a_rule_that_is_not_reached_is_said() {
    let folder = folder();
    let path = folder.path();
    succeed(&["init", "s.toml"], path);
    let run = |stop: &str| {
        succeed(&["run", "s.toml", "--trials", "150", "--stop-at", stop, "--out", "o", "--force"], path)
    };
    assert!(run("rms=1%").contains("stop_at was not reached in 150 trials"));
    assert!(!run("rms=50%").contains("not reached"));
}

/// Terminals with a capacitance on a drive of MOSFETs, a rotor that moves: 16 of these starts once ended because conduction modes kept changing
/// while a current rested in a channel.
#[test]
fn regress_no_start_of_an_outrunner_in_the_field_fails_to_be_simulated() {
    let folder = folder();
    let keys = ["detector.method=subdivision", "errors=field", "rotor.state=free"];
    let run = ["run", "outrunner", "--trials", "1500", "--seed", "78", "--json"];
    let words: Vec<&str> = run.into_iter().chain(keys.into_iter().flat_map(|key| ["-s", key])).collect();
    let found: serde_json::Value =
        serde_json::from_slice(&super::standstill(&words, folder.path()).stdout).expect("JSON");
    assert_eq!((&found["summary"]["trials"], &found["summary"]["errors"]), (&1500.into(), &0.into()));
}
