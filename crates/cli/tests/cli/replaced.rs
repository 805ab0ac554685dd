//! Results of another run, trace, comparison or fit stay unless `--force` says that they may go.

use std::fs;
use std::path::Path;

use super::answers::SCENARIO;
use super::nameplates::sheet;
use super::{folder, mistake, names, standstill};

/// All files of a folder with their bytes.
fn kept(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let read = |name: String| (name.clone(), fs::read(folder.join(&name)).expect("a file"));
    names(folder).into_iter().map(read).collect()
}

const COMPARE: &[&str] =
    &["compare", "--method", "bipolar", "--rotor", "locked", "--errors", "none", "--no-limit", "--trials"];

/// promise: answers-stay
#[test]
fn law_no_command_replaces_the_results_of_another_question_without_leave() {
    stay_without_leave(&[
        ([COMPARE, &["4"], &["5"]], "c"),
        ([&["trace", "s.toml", "--trial"], &["1"], &["2"]], "t"),
        ([&["magnetics"], &["paper-5k5"], &["surface-magnet"]], "m"),
        ([&["reproduce", "--trials"], &["20"], &["30"]], "p"),
        ([&["explain", "r", "--trial"], &["1"], &["2"]], "e"),
    ]);
}

#[test]
#[ignore = "a trace of several settings; one of one setting runs by default: scripts/test-all.sh long"]
fn law_no_trace_of_several_settings_replaces_another_without_leave() {
    let [first, other] = ["detector.pulse=[60 us, 80 us]", "detector.pulse=[60 us, 90 us]"];
    stay_without_leave(&[([&["trace", "s.toml", "-s"], &[first], &[other]], "l")]);
}

/// Commands with a first question, with another one, and the folder of both.
fn stay_without_leave(cases: &[([&[&str]; 3], &str)]) {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let ran = standstill(&["run", "s.toml", "--trials", "200", "--out", "r"], path);
    assert!(ran.status.success());
    for &([command, first, other], out) in cases {
        let ask = |what: &[&str], more: &[&str]| {
            let all = [command, what, &["--out", out], more].concat();
            let output = standstill(&all, path);
            assert!(output.status.success(), "{all:?}: {}", String::from_utf8_lossy(&output.stderr));
        };
        ask(first, &[]);
        let before = kept(&path.join(out));
        // The same may be asked again.
        ask(first, &[]);
        assert_eq!(kept(&path.join(out)), before, "{command:?}");
        let message = mistake(&[command, other, &["--out", out]].concat(), path);
        assert!(
            message.contains("found the results of another run") && message.contains("--force"),
            "{message}"
        );
        assert_eq!(kept(&path.join(out)), before, "{command:?}: nothing was touched");
        ask(other, &["--force"]);
        assert_ne!(kept(&path.join(out)), before, "{command:?}");
    }
    // Files of which nobody knows what they are stay too: those of a run, say.
    let before = kept(&path.join("r"));
    let message = mistake(&["reproduce", "--trials", "20", "--out", "r"], path);
    assert!(message.contains("nothing says that they are of `standstill reproduce`"), "{message}");
    assert_eq!(kept(&path.join("r")), before);
}

#[test]
fn regress_what_another_command_put_there_is_not_a_reproductions_own() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let reproduce = ["reproduce", "--trials", "20", "--out", "p"];
    assert!(standstill(&reproduce, path).status.success());
    let run = standstill(&["run", "s.toml", "--trials", "50", "--out", "p", "--force"], path);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let before = kept(&path.join("p"));
    let message = mistake(&reproduce, path);
    assert!(message.contains("written by something else since"), "{message}");
    assert_eq!(kept(&path.join("p")), before);
}

#[test]
fn regress_a_report_shows_no_data_sheet_that_its_run_did_not_read() {
    let folder = folder();
    let path = folder.path();
    let sheet = |l_d: &str| sheet(["3", "0.9 Ω", l_d, "12 mH", "0.3 Wb", "8 A", "550 V", "6 %"]);
    fs::write(path.join("m.toml"), sheet("9.2 mH")).expect("written");
    assert!(standstill(&["run", "m.toml", "--trials", "50", "--out", "r"], path).status.success());
    let page = || {
        let output = standstill(&["report", "r"], path);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        fs::read_to_string(path.join("r/report/report.html")).expect("a page")
    };
    assert!(page().contains("Data sheet") && !page().contains("files have changed since"));
    fs::write(path.join("m.toml"), sheet("9.3 mH")).expect("written");
    assert!(!page().contains("Data sheet") && page().contains("files have changed since: m.toml was"));
}

#[test]
fn regress_a_report_replaces_no_page_of_another_run_without_leave() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let run = |out: &str, more: &[&str]| {
        let all = [&["run", "s.toml", "--out", out], more].concat();
        let output = standstill(&all, path);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("text")
    };
    for (out, seed) in [("a", "1"), ("b", "2"), ("c", "3")] {
        run(out, &["--trials", "50", "--seed", seed]);
    }
    for (first, other) in
        [(&["report", "a"][..], &["report", "b"][..]), (&["report", "a", "b"], &["report", "a", "c"])]
    {
        let out = first.len().to_string();
        let ask = |what: &[&str], more: &[&str]| standstill(&[what, &["--out", &out], more].concat(), path);
        for _ in 0..2 {
            assert!(ask(first, &[]).status.success());
        }
        let before = kept(&path.join(&out));
        let message = mistake(&[other, &["--out", &out]].concat(), path);
        assert!(
            message.contains("found the results of another run") && message.contains("--force"),
            "{message}"
        );
        assert_eq!(kept(&path.join(&out)), before);
        assert!(ask(other, &["--force"]).status.success());
        assert_ne!(kept(&path.join(&out)), before);
    }
    // A page beside its own run is that run's, whatever becomes of it, and the pages that are older are named.
    assert!(standstill(&["report", "a"], path).status.success());
    assert!(standstill(&["report", "a", "b"], path).status.success());
    assert!(standstill(&["explain", "a", "--trial", "1"], path).status.success());
    let said = run("a", &["--trials", "80", "--seed", "1", "--resume"]);
    for page in ["report/report.html", "report/comparison.html", "explain/trial-1/explain.html"] {
        assert!(said.contains(&format!("{page}, which is older")), "{page} in {said}");
        assert!(
            fs::read_to_string(path.join("a").join(page))
                .expect("a page")
                .contains("older than the data beside it")
        );
    }
    assert!(standstill(&["report", "a"], path).status.success());
    assert!(standstill(&["report", "a", "b"], path).status.success());
    for page in ["report/report.html", "report/comparison.html"] {
        assert!(
            !fs::read_to_string(path.join("a").join(page)).expect("a page").contains("older than the data")
        );
    }
}

#[test]
fn law_scenarios_and_commands_have_default_folders_of_their_own_and_name_the_next_command() {
    let folder = folder();
    let path = folder.path();
    for name in ["a.toml", "two words.toml"] {
        fs::write(path.join(name), "trials = 4\n[detector]\nmethod = \"bipolar\"\n").expect("written");
    }
    let said = |arguments: &[&str]| {
        let output = standstill(arguments, path);
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("text")
    };
    assert!(said(&["run", "a.toml"]).ends_with("\n  standstill report standstill-out/a-run\n"));
    assert!(
        said(&["run", "two words.toml"]).ends_with("\n  standstill report 'standstill-out/two words-run'\n")
    );
    said(&["report", "standstill-out/a-run"]);
    said(&["sweep", "a.toml", "--vary", "sensors.noise=1 mA,2 mA"]);
    said(&["magnetics", "paper-5k5"]);
    said(&["magnetics", "outrunner"]);
    for shard in ["1/2", "2/2"] {
        said(&["run", "a.toml", "--shard", shard, "--out", "parts"]);
    }
    said(&["merge", "parts"]);
    let comparison =
        ["--method", "bipolar", "--rotor", "locked", "--errors", "none", "--no-limit", "--trials", "2"];
    said(&[&["compare", "a.toml"][..], &comparison].concat());
    said(&[&["compare"][..], &comparison].concat());
    let expected = [
        "a-compare",
        "a-run",
        "a-sweep",
        "compare",
        "outrunner-magnetics",
        "paper-5k5-magnetics",
        "parts-merge",
        "two words-run",
    ];
    assert_eq!(names(&path.join("standstill-out")), expected);
    assert!(path.join("standstill-out/a-run/report/report.html").exists());
}

#[test]
fn law_another_run_or_question_gets_a_default_folder_of_its_own() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), "motor = \"outrunner\"\n[detector]\nmethod = \"bipolar\"\n")
        .expect("written");
    let said = |arguments: &[&str]| {
        let output = standstill(arguments, path);
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        (String::from_utf8(output.stdout).expect("text"), String::from_utf8(output.stderr).expect("text"))
    };
    let rows = |name: &str| {
        fs::read_to_string(path.join("standstill-out").join(name).join("trials.csv")).expect("rows")
    };
    said(&["run", "s.toml", "--trials", "4"]);
    let first = rows("s-run");
    for _ in 0..2 {
        // The same run again finds its own folder.
        let (next, moved) = said(&["run", "s.toml", "--trials", "5"]);
        assert!(moved.contains("going on in standstill-out/s-run-2"), "{moved}");
        assert!(next.ends_with("standstill report standstill-out/s-run-2\n"), "{next}");
    }
    said(&["run", "s.toml", "--trials", "5", "-s", "errors=harsh"]);
    assert_eq!(rows("s-run"), first);
    assert_eq!(rows("s-run-2").lines().count(), rows("s-run-3").lines().count());
    let moved = |limit: &str| {
        let asked = [
            "require",
            "s.toml",
            "--key",
            "sensors.noise",
            "--between",
            "2 mA:50 mA",
            "--most",
            "400",
            "--limit",
            limit,
        ];
        String::from_utf8(standstill(&asked, path).stderr).expect("text")
    };
    assert!(!moved("rms <= 5 deg").contains("going on"));
    assert!(moved("rms <= 6 deg").contains("going on in standstill-out/s-require-2"));
    // A folder that was named, or a run that is to go on, is not exchanged.
    for more in [&["--out", "standstill-out/s-run"][..], &["--resume"]] {
        let message =
            mistake(&[&["run", "s.toml", "--trials", "6", "-s", "errors=field"][..], more].concat(), path);
        assert!(message.contains("s-run") && !message.contains("going on"), "{message}");
    }
    assert_eq!(rows("s-run"), first);
}
