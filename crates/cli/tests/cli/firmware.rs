//! Detectors from C libraries on the command line: docs/firmware.md as it is printed, and libraries that misbehave.

mod isolated;

use std::fs;
use std::os::unix::process::ExitStatusExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{folder, mistake, names, standstill};

pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Builds a library in a folder from a source of this repository.
pub fn build(folder: &Path, source: &str, library: &str) {
    build_with(folder, source, library, &[]);
}

/// The same with options.
pub fn build_with(folder: &Path, source: &str, library: &str, options: &[&str]) {
    let output = Command::new("cc")
        .args(["-O2", "-shared", "-fPIC"])
        .args(options)
        .arg("-I")
        .arg(root().join("crates/foreign/include"))
        .args(["-o", library])
        .arg(root().join(source))
        .arg("-lm")
        .current_dir(folder)
        .output()
        .expect("a C compiler");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

pub const PROBE: &str = "crates/scenario/tests/foreign/probe.c";

/// The probe's scenario, asking for something.
pub fn probe(folder: &Path, what: &str) {
    build(folder, PROBE, "probe.so");
    let text = format!("motor = \"light-vehicle\"\ntrials = 60\n[detector.config]\nwhat = \"{what}\"\n");
    fs::write(folder.join("s.toml"), text).expect("written");
}

pub fn soon(what: &str, mut holds: impl FnMut() -> bool) {
    for _ in 0..600 {
        if holds() {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    panic!("{what}");
}

#[test]
fn golden_the_commands_of_the_page_run_as_they_are_printed() {
    page_runs(false);
}

/// With the page's numbers of trials, and with the detectors as a C library, which `scripts/test-all.sh c` builds too.
#[test]
#[ignore = "builds the detectors for C and runs as many trials as printed: scripts/test-all.sh long"]
fn golden_the_whole_page_runs_as_it_is_printed() {
    page_runs(true);
}

fn page_runs(whole: bool) {
    let page = fs::read_to_string(root().join("docs/firmware.md")).expect("the page");
    let folder = folder();
    let bin = Path::new(env!("CARGO_BIN_EXE_standstill")).parent().expect("a folder");
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").expect("a path"));
    let blocks: Vec<&str> =
        page.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(blocks.len() >= 3);
    for printed in blocks {
        if !whole && printed.contains("/scripts/detectors-c.sh") {
            continue;
        }
        let few = printed.replace("00 --out", "0 --out").replace("--trials 30", "--trials 5");
        assert!(few != printed || !printed.contains("--trials"), "{printed}");
        let block = if whole { printed } else { &few };
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
    build(folder.path(), "examples/c/line_inductance.c", "probe.so");
    let message = mistake(&[&common[..], &["--resume"]].concat(), folder.path());
    assert!(message.contains("the file probe.so is of"), "{message}");
}

#[test]
fn law_shards_of_a_library_put_together_are_its_run() {
    let folder = folder();
    probe(folder.path(), "found");
    let run = |more: &[&str]| {
        let output =
            standstill(&[&["run", "s.toml", "--detector", "./probe.so"], more].concat(), folder.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    run(&["--out", "whole"]);
    run(&["--out", "parts", "--shard", "1/2"]);
    run(&["--out", "parts", "--shard", "2/2", "--isolate"]);
    assert!(standstill(&["merge", "parts", "--out", "merged"], folder.path()).status.success());
    let trials = |of: &str| fs::read(folder.path().join(of).join("trials.csv")).expect("written");
    assert_eq!(trials("merged"), trials("whole"));
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
fn law_no_copy_of_a_library_stays_behind() {
    let folder = folder();
    let copies = folder.path().join("copies");
    fs::create_dir(&copies).expect("made");
    for at_load in [true, false] {
        probe(folder.path(), "crash");
        if at_load {
            build_with(folder.path(), PROBE, "probe.so", &["-DAT_LOAD=\"crash\""]);
        }
        let output = Command::new(env!("CARGO_BIN_EXE_standstill"))
            .args(["run", "s.toml", "--detector", "./probe.so"])
            .env("TMPDIR", &copies)
            .current_dir(folder.path())
            .output()
            .expect("starts");
        assert_eq!(output.status.signal(), Some(11));
        assert_eq!(names(&copies), Vec::<String>::new());
    }
}

#[test]
fn law_what_a_library_shares_is_said_in_its_results() {
    let folder = folder();
    probe(folder.path(), "found");
    for (options, says) in [(vec![], false), (vec!["-DKEEPS"], true)] {
        build_with(folder.path(), PROBE, "probe.so", &options);
        let output = standstill(
            &["run", "s.toml", "--detector", "./probe.so", "--out", "out", "--force"],
            folder.path(),
        );
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let said = String::from_utf8(output.stdout).expect("text");
        assert_eq!(said.contains("Library: it calls ctime: "), says, "{said}");
        let summary = fs::read_to_string(folder.path().join("out/summary.json")).expect("written");
        assert_eq!(summary.contains("it calls ctime: "), says, "{summary}");
    }
}

/// promise: library-mistakes-first
#[test]
fn law_what_is_wrong_with_a_library_ends_the_command_before_anything_is_written() {
    let folder = folder();
    let at = folder.path();
    for (options, what, more, part) in [
        (&["-DNO_ENTRY"][..], "found", &[][..], "without sts_entry"),
        (
            &["-DABI=3"],
            "found",
            &[],
            "a table of ABI 3, which is newer than this program, needed one of ABI 1 or 2",
        ),
        (&["-DSIZE=40"], "found", &[], "a table of 40 bytes"),
        (&["-DMISSING"], "found", &[], "HAL_ADC_Start"),
        (&["-c"], "found", &[], "an object file"),
        (&[], "refuse", &[], "probe refused: this motor is not for me"),
        (&[], "found", &["-s", "inverter.carrier=10 kHz"], "a PWM of 12500 Hz"),
    ] {
        probe(at, what);
        build_with(at, PROBE, "probe.so", options);
        for isolate in [&[][..], &["--isolate"]] {
            let run = ["run", "s.toml", "--detector", "./probe.so", "--out", "out"];
            let message = mistake(&[&run[..], more, isolate].concat(), at);
            assert!(message.contains(part) && message.contains("`detector.library`"), "{message}");
            assert!(!at.join("out").exists(), "nothing is written");
        }
    }
    fs::write(at.join("probe.so"), "no library").expect("written");
    let message = mistake(&["run", "s.toml", "--detector", "./probe.so", "--isolate", "--out", "out"], at);
    assert!(message.contains("no library") && !at.join("out").exists(), "{message}");
}
