//! What a C detector keeps from one trial to the next, what it does to the program, and what it is linked to.

use std::fs;
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::Command;

use crate::firmware::{PROBE, build_with, probe, root, soon};
use crate::{folder, mistake, standstill};

const STATES: &str = "crates/scenario/tests/foreign/states";

/// Kinds of state that firmware keeps and forgets to clear, in C and in C++: see the libraries.
const KINDS: [&str; 2] = [
    "global,local,heap-at-load,heap-at-call,grown,table,rounding,exceptions,numbers,token,errno,locale,at-exit",
    "vector,string,map,static,template,caught,stream",
];

/// The library of `states.c` or `states.cpp` and a scenario for it.
fn states(at: &Path, extension: &str) {
    let compiler = if extension == "c" { "cc" } else { "c++" };
    let output = Command::new(compiler)
        .args(["-O1", "-shared", "-fPIC", "-I"])
        .arg(root().join("crates/foreign/include"))
        .args(["-o", "states.so"])
        .arg(root().join(format!("{STATES}.{extension}")))
        .arg("-lm")
        .current_dir(at)
        .output()
        .expect("a compiler");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = "motor = \"light-vehicle\"\ntrials = 12\ndetector.library = \"states.so\"\n";
    fs::write(at.join("s.toml"), text).expect("written");
}

/// promise: libraries-set-back
#[test]
fn law_all_state_of_a_library_is_the_same_on_any_number_of_threads_and_isolated() {
    for (extension, kinds) in ["c", "cpp"].into_iter().zip(KINDS) {
        let folder = folder();
        states(folder.path(), extension);
        let axis = format!("detector.config.what={kinds}");
        let run = |out: &str, more: &[&str]| {
            let common = ["sweep", "s.toml", "--vary", &axis, "--out", out];
            let output = standstill(&[&common[..], more].concat(), folder.path());
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            fs::read_to_string(folder.path().join(out).join("trials.csv")).expect("written")
        };
        let one = run("one", &["--threads", "1"]);
        assert_eq!(one.lines().count(), 1 + 12 * kinds.split(',').count());
        // A tenth of a radian: the first trial of its kind, each time.
        let first = |line: &str| line.split(',').any(|cell| cell.starts_with("5.7295"));
        assert!(one.lines().skip(1).all(first), "{one}");
        assert_eq!(run("two", &["--threads", "2"]), one);
        assert_eq!(run("four", &["--threads", "4"]), one);
        assert_eq!(run("apart", &["--isolate"]), one);
    }
}

#[test]
fn law_what_ends_the_program_names_library_and_trial() {
    let folder = folder();
    let at = folder.path();
    states(at, "cpp");
    let run = ["run", "s.toml"];
    for (what, when) in [("throw-later", " in trial "), ("throw", "while a first detector of it was tried,")]
    {
        let what = format!("detector.config.what={what}");
        let output = standstill(&[&run[..], &["-s", &what]].concat(), at);
        assert_eq!(output.status.signal(), Some(6), "{output:?}");
        let said = String::from_utf8_lossy(&output.stderr);
        let line = said.lines().find(|line| line.contains("states.so")).expect("a line");
        assert!(line.contains(when) && line.contains("exception"), "{line}");
    }
    let later = ["-s", "detector.config.what=throw-later", "--isolate", "--out", "out"];
    assert!(standstill(&[&run[..], &later].concat(), at).status.success());
    let trials = fs::read_to_string(at.join("out/trials.csv")).expect("written");
    assert_eq!(trials.matches("exception").count(), 12, "{trials}");
    probe(at, "abort");
    let output = standstill(&["run", "s.toml", "--detector", "./probe.so", "--out", "aborted"], at);
    assert_eq!(output.status.signal(), Some(6));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("probe.so in trial ") && said.contains("SIGABRT, such as abort()"), "{said}");
}

#[test]
fn law_what_a_library_prints_is_not_among_the_answers() {
    let folder = folder();
    probe(folder.path(), "prints");
    for more in [&[][..], &["--isolate"]] {
        let run = ["run", "s.toml", "--detector", "./probe.so", "--json", "--out", "out", "--force"];
        let output = standstill(&[&run[..], more].concat(), folder.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON alone");
        assert_eq!(json["summary"]["found"], 60);
        if more.is_empty() {
            assert!(String::from_utf8_lossy(&output.stderr).contains("by the library"));
        }
    }
}

#[test]
fn law_the_log_of_a_library_spoils_no_answer() {
    let folder = folder();
    probe(folder.path(), "logs");
    let run = ["run", "s.toml", "--detector", "./probe.so", "--json", "--out", "out"];
    let output = standstill(&run, folder.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON alone");
    assert_eq!(json["summary"]["found"], 60);
    let said = String::from_utf8(output.stderr).expect("text");
    // Sixty trials of four lines: the first hundred, and a word about the others.
    let lines: Vec<&str> = said.lines().filter(|line| line.contains("probe.so in trial ")).collect();
    assert_eq!(lines.len(), 100, "{said}");
    assert!(lines.iter().any(|line| line.ends_with(", call 2: { \"first\"")), "{said}");
    assert!(lines.iter().any(|line| line.ends_with(", call 5: another")), "{said}");
    assert_eq!(said.matches("further lines of the log are left out").count(), 1, "{said}");
    // A trace has them as events, and the channels in a table of their own.
    let trace = ["trace", "s.toml", "--detector", "./probe.so", "--trial", "3", "--out", "trace"];
    let output = standstill(&trace, folder.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(!String::from_utf8_lossy(&output.stderr).contains("call 2"), "{output:?}");
    let events = fs::read_to_string(folder.path().join("trace/events.csv")).expect("events");
    // Quoted as CSV has it.
    let first = events.lines().find(|line| line.contains(",log,")).expect("a line of the log");
    assert!(first.contains("\"{ \"\"first\"\"\""), "{first}");
    assert_eq!(events.lines().filter(|line| line.contains(",log,")).count(), 4);
    let channels = fs::read_to_string(folder.path().join("trace/channels.csv")).expect("channels");
    let rows: Vec<&str> = channels.lines().collect();
    assert!(rows[0].starts_with("t_s,calls,last_A") && rows.len() == 5, "{channels}");
    assert!(rows[1].starts_with("0.00001,1.0,") && rows[4].contains(",4.0,"), "{channels}");
}

/// promise: hanging-library-ends
#[test]
fn law_an_interrupt_ends_a_run_whose_library_hangs_and_says_what_to_do() {
    let folder = folder();
    probe(folder.path(), "hang");
    let run = Command::new(env!("CARGO_BIN_EXE_standstill"))
        .args(["run", "s.toml", "--detector", "./probe.so", "--threads", "2", "--out", "out"])
        .current_dir(folder.path())
        .stderr(std::process::Stdio::piped())
        .stdout(std::process::Stdio::null())
        .spawn()
        .expect("starts");
    let folder_of_run = folder.path().join("out");
    soon("trials begin", || folder_of_run.exists());
    std::thread::sleep(std::time::Duration::from_millis(300));
    let status = Command::new("kill").args(["-TERM", &run.id().to_string()]).status().expect("kill");
    assert!(status.success());
    let output = run.wait_with_output().expect("ends");
    assert_eq!(output.status.code(), Some(130), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr).replace('\n', " ");
    assert!(said.contains("probe.so in trial ") && said.contains("has not returned from a call"), "{said}");
    assert!(said.contains("--isolate"), "{said}");
}

/// Another file at a path, as a compiler puts it there.
fn replaced(from: &Path, at: &Path) {
    let new = at.with_extension("new");
    fs::copy(from, &new).expect("copied");
    fs::rename(new, at).expect("renamed");
}

#[test]
fn law_another_build_of_a_library_behind_the_library_is_another_run() {
    let folder = folder();
    let at = folder.path();
    probe(at, "linked");
    for (name, number) in [("libother.so", 1), ("changed.so", 2)] {
        let number = format!("-DOTHER={number}");
        build_with(at, PROBE, name, &["-DNO_ENTRY", &number, "-Wl,-soname,libother.so"]);
    }
    let here = format!("-L{}", at.display());
    let options = ["-DLINKED", &here, "-Wl,--no-as-needed", "-lother", "-Wl,-rpath,$ORIGIN"];
    build_with(at, PROBE, "probe.so", &options);
    let common = ["run", "s.toml", "--detector", "./probe.so", "--out", "out", "--shard", "1/2"];
    let output = standstill(&common, at);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    replaced(&at.join("changed.so"), &at.join("libother.so"));
    for isolate in [&[][..], &["--isolate"]] {
        let message = mistake(&[&common[..], &["--resume"], isolate].concat(), at);
        assert!(message.contains("libother.so is of"), "{message}");
    }
}
