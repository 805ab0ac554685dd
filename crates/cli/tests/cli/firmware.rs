//! Detectors from C libraries on the command line: docs/firmware.md as it is printed, and libraries that misbehave.

use std::fs;
use std::os::unix::process::ExitStatusExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{folder, mistake, names, standstill};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Builds a library in a folder from a source of this repository.
fn build(folder: &Path, source: &str, library: &str) {
    let output = Command::new("cc")
        .args(["-O2", "-shared", "-fPIC", "-I"])
        .arg(root().join("crates/foreign/include"))
        .args(["-o", library])
        .arg(root().join(source))
        .arg("-lm")
        .current_dir(folder)
        .output()
        .expect("a C compiler");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The probe's scenario, asking for something.
fn probe(folder: &Path, what: &str) {
    build(folder, "crates/scenario/tests/foreign/probe.c", "probe.so");
    let text = format!("motor = \"light-vehicle\"\ntrials = 60\n[detector.config]\nwhat = \"{what}\"\n");
    fs::write(folder.join("s.toml"), text).expect("written");
}

#[test]
fn golden_the_commands_of_the_page_run_as_they_are_printed() {
    let page = fs::read_to_string(root().join("docs/firmware.md")).expect("the page");
    let folder = folder();
    let bin = Path::new(env!("CARGO_BIN_EXE_standstill")).parent().expect("a folder");
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").expect("a path"));
    let blocks: Vec<&str> =
        page.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(blocks.len() >= 3);
    for block in blocks {
        let output = Command::new("sh")
            .args(["-e", "-c", block])
            .current_dir(folder.path())
            .env("PATH", &path)
            .env("STANDSTILL", root())
            .output()
            .expect("a shell");
        assert!(output.status.success(), "{block}{}", String::from_utf8_lossy(&output.stderr));
    }
    let made = names(folder.path());
    for name in ["first", "fewer-turns", "voltages", "trial-7", "beside"] {
        assert!(made.iter().any(|made| made == name), "{name} of {made:?}");
    }
    let comparison = fs::read_to_string(folder.path().join("beside/comparison.csv")).expect("written");
    assert!(comparison.contains("\nrotating,") && comparison.contains("\nbipolar,"), "{comparison}");
    let summary = fs::read_to_string(folder.path().join("first/summary.json")).expect("written");
    assert!(summary.contains("rotating.so") && summary.contains("CRC-32"), "{summary}");
    let report = fs::read_to_string(folder.path().join("voltages/report/report.html")).expect("written");
    assert!(report.contains("rotating"));
}

#[test]
fn law_a_crash_says_which_library_and_which_trial_it_was() {
    let folder = folder();
    probe(folder.path(), "crash");
    let output = standstill(&["run", "s.toml", "--detector", "./probe.so", "--out", "out"], folder.path());
    assert_eq!(output.status.signal(), Some(11), "{output:?}");
    let said = String::from_utf8(output.stderr).expect("text");
    let line = said.lines().find(|line| line.contains("crashed")).expect("a line");
    assert!(line.contains("probe.so in trial ") && line.contains("SIGSEGV"), "{line}");
    // That trial alone crashes too: it is the one.
    let trial = line.split("in trial ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a number");
    let trace = ["trace", "s.toml", "--detector", "./probe.so", "--trial", trial, "--out", "trace"];
    assert_eq!(standstill(&trace, folder.path()).status.signal(), Some(11));
    assert!(!folder.path().join("out/trials.csv").exists());
    probe(folder.path(), "exit");
    let output = standstill(&["run", "s.toml", "--detector", "./probe.so", "--out", "ended"], folder.path());
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stderr).expect("text");
    assert!(said.contains("probe.so in trial ") && said.contains("called exit()"), "{said}");
}

#[test]
fn law_another_build_of_the_library_is_another_run() {
    let folder = folder();
    probe(folder.path(), "found");
    let common = ["run", "s.toml", "--detector", "./probe.so", "--out", "out", "--shard", "1/2"];
    let output = standstill(&common, folder.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    build(folder.path(), "examples/c/rotating.c", "probe.so");
    let message = mistake(&[&common[..], &["--resume"]].concat(), folder.path());
    assert!(message.contains("the file probe.so is of"), "{message}");
}

#[test]
fn law_commands_for_methods_alone_say_so() {
    let folder = folder();
    probe(folder.path(), "found");
    for command in ["check", "reproduce"] {
        let message = mistake(&[command, "s.toml", "--detector", "./probe.so"], folder.path());
        assert!(message.contains("set by --detector: `detector.library`"), "{message}");
    }
    let message = mistake(&["run", "s.toml", "--detector", "./none.so", "--out", "out"], folder.path());
    assert!(message.contains("none.so") && message.contains("cannot be read"), "{message}");
    assert!(!folder.path().join("out").exists(), "nothing is written");
    let both = ["run", "s.toml", "--detector", "./probe.so", "-s", "detector.method=bipolar", "--out", "out"];
    let message = mistake(&both, folder.path());
    assert!(message.contains("`detector.method`"), "{message}");
}

#[test]
fn law_isolated_a_library_that_misbehaves_costs_that_trial_alone() {
    let folder = folder();
    for (what, reason) in [
        ("crash", "the library crashed: SIGSEGV"),
        ("exit", "the library called exit()"),
        ("hang", "a call took longer than detector.call_timeout"),
    ] {
        probe(folder.path(), what);
        let run = |out: &str, threads: &str| {
            let timeout = "detector.call_timeout=200 ms";
            let output = standstill(
                &[
                    "run",
                    "s.toml",
                    "--detector",
                    "./probe.so",
                    "--isolate",
                    "-s",
                    timeout,
                    "--threads",
                    threads,
                    "--out",
                    out,
                ],
                folder.path(),
            );
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            fs::read_to_string(folder.path().join(out).join("trials.csv")).expect("written")
        };
        let trials = run(&format!("{what}-1"), "1");
        assert_eq!(trials.lines().count(), 61);
        let lost = trials.lines().filter(|line| line.contains(reason)).count();
        // An eighth of the seeds.
        assert!((1..25).contains(&lost), "{what}: {lost}");
        assert_eq!(trials.lines().filter(|line| line.contains(",found,")).count(), 60 - lost);
        assert_eq!(run(&format!("{what}-2"), "2"), trials, "{what}: on any number of threads");
    }
    // What does not misbehave is the same with and without.
    probe(folder.path(), "found");
    let trials = |more: &[&str], out: &str| {
        let arguments = [&["run", "s.toml", "--detector", "./probe.so", "--out", out], more].concat();
        assert!(standstill(&arguments, folder.path()).status.success());
        fs::read(folder.path().join(out).join("trials.csv")).expect("written")
    };
    assert_eq!(trials(&[], "plain"), trials(&["--isolate"], "apart"));
    let message = mistake(&["run", "s.toml", "--isolate", "-s", "detector.config={}"], folder.path());
    assert!(message.contains("--isolate") && message.contains("`detector.library`"), "{message}");
}
