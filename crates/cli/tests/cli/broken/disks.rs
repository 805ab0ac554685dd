//! Commands whose disk is full, fails, or may not be written.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use super::{Bench, CASES, Case, Random, Ready, tree};

/// Calls that fail: their kind, the error, and what the message says of it.
const FAULTS: [(&str, &str, &str); 9] = [
    // A full disk, from a write on, and for a moment.
    ("write", "28+", "No space left on device"),
    ("write", "28", "No space left on device"),
    ("write", "5", "Input/output error"),
    ("open", "13", "Permission denied"),
    ("rename", "5", "Input/output error"),
    ("unlink,rmdir", "13", "Permission denied"),
    ("sync", "5", "Input/output error"),
    ("close", "28", "No space left on device"),
    ("mkdir,truncate", "30", "Read-only file system"),
];

/// Lets a call fail. Either it does no harm, or the message names a file, the reason and what to do; returns whether it did harm.
fn failed(
    bench: &Bench,
    ready: &Ready,
    of: &str,
    (kinds, error, reason): (&str, &str, &str),
    at: u64,
) -> bool {
    let of = format!("{of}, {kinds} {at} of {} with error {error}", ready.calls(kinds));
    bench.restore(ready.before.as_ref());
    let at = at.to_string();
    let output = bench.run(&ready.words, &[("FAULT_CALLS", kinds), ("FAULT_AT", &at), ("FAULT_DO", error)]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let harmed = output.status.code() != Some(ready.code);
    if harmed {
        assert_eq!(output.status.code(), Some(2), "{of}: {said}");
        let line = said.lines().last().unwrap_or_default();
        let place = line.contains(" o/") || line.contains(" o:") || line.contains(" .:");
        assert!(line.starts_with("standstill: ") && place && line.contains(reason), "{of}: {said}");
        let next = ["another place", "--resume", "--force"];
        assert!(next.iter().any(|next| said.contains(next)), "{of} says what to do: {said}");
        let left = tree(&bench.out());
        let unfinished = left.keys().any(|name| super::unfinished(name));
        // A file that cannot be removed stays until it can be.
        assert!(!unfinished || kinds.contains("unlink"), "{of} left {:?}", left.keys());
    }
    bench.looked_at(ready, &of);
    harmed
}

/// Lets calls of each kind fail, `most` of each by chance; returns how many did harm, of how many.
fn fails(bench: &Bench, case: &Case, replaces: bool, most: u64, random: &mut Random) -> (u64, u64) {
    let (mut harmed, mut all) = (0, 0);
    let ready = bench.ready(case, replaces);
    for fault in FAULTS {
        let of = format!("{}{}", case.name, if replaces { " --force" } else { "" });
        let calls = ready.calls(fault.0);
        for _ in 0..most.min(calls) {
            let at = random.up_to(calls);
            harmed += u64::from(failed(bench, &ready, &of, fault, at));
            all += 1;
        }
    }
    (harmed, all)
}

/// promise: failing-disks
#[test]
fn law_a_disk_that_fails_is_named_and_leaves_whole_files() {
    let (bench, mut random) = (Bench::new(), Random(43));
    let mut harmed = 0;
    for name in ["run", "faults", "merge", "init"] {
        let case = CASES.iter().find(|case| case.name == name).expect("a case");
        harmed += fails(&bench, case, name == "merge", 1, &mut random).0;
    }
    assert!(harmed >= 20, "{harmed} failures were noticed");
}

/// promise: failing-disks
#[test]
#[ignore = "each command with each failure; some run by default: scripts/test-all.sh faults"]
fn law_each_command_names_a_disk_that_fails() {
    let (bench, mut random) = (Bench::new(), Random(44));
    let (mut harmed, mut all) = (0, 0);
    for case in CASES {
        for replaces in [false, true] {
            if !replaces || case.other.is_some() {
                let (some, of) = fails(&bench, case, replaces, 2, &mut random);
                (harmed, all) = (harmed + some, all + of);
            }
        }
    }
    println!("{all} calls failed, {harmed} of them with a message, the others without harm");
}

/// A file system of 256 KiB, where the user may mount one; otherwise the device that is always full.
#[test]
fn law_a_disk_that_is_really_full_is_named_and_the_run_goes_on_with_room() {
    let folder = crate::folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), "trials = 4000\n[detector]\nmethod = \"bipolar\"\n").expect("written");
    let full = at.join("full");
    fs::create_dir(&full).expect("made");
    let mounted = |options: &str| {
        let mount = Command::new("mount").args(["-t", "tmpfs", "-o", options, "none"]).arg(&full).output();
        mount.is_ok_and(|output| output.status.success())
    };
    if !mounted("size=256k") {
        // Without leave to mount.
        return;
    }
    let unmount = Unmount(&full);
    let run = ["run", "s.toml", "--out", "full/o", "--resume"];
    let message = {
        let output = crate::standstill(&run, at);
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).expect("text")
    };
    for part in ["No space left on device", "kept in full/o/run.journal", "make room there"] {
        assert!(message.contains(part), "{part}: {message}");
    }
    assert_eq!(crate::names(&full.join("o")), ["run.journal"]);
    assert!(mounted("remount,size=64m"));
    assert!(crate::standstill(&run, at).status.success());
    assert!(crate::standstill(&["run", "s.toml", "--out", "whole"], at).status.success());
    for name in ["trials.csv", "summary.json"] {
        let of = |out: &Path| fs::read(out.join(name)).expect("written");
        assert!(of(&full.join("o")) == of(&at.join("whole")), "{name}");
    }
    drop(unmount);
}

struct Unmount<'a>(&'a Path);

impl Drop for Unmount<'_> {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(self.0).status();
    }
}

/// A folder that may be read alone. Root may write everywhere, and looks at a file system that is mounted so.
#[test]
fn law_a_folder_that_may_not_be_written_is_named_before_the_first_trial() {
    let folder = crate::folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), "trials = 40\n[detector]\nmethod = \"bipolar\"\n").expect("written");
    let shut = at.join("shut");
    fs::create_dir(&shut).expect("made");
    let mut rights = fs::metadata(&shut).expect("there").permissions();
    rights.set_readonly(true);
    fs::set_permissions(&shut, rights).expect("shut");
    let opened = fs::write(shut.join("x"), "").is_ok();
    let unmount = Unmount(&shut);
    if opened {
        let mount = Command::new("mount").args(["-t", "tmpfs", "-o", "ro", "none"]).arg(&shut).output();
        if !mount.is_ok_and(|output| output.status.success()) {
            return;
        }
    }
    for words in [
        &["run", "s.toml", "--out", "shut/o"][..],
        &["run", "s.toml", "--out", "shut"],
        &["odds", "s.toml", "--event", "wrong-pole", "--out", "shut/o"],
        &["magnetics", "paper-5k5", "--out", "shut"],
        &["init", "shut/s.toml"],
        &["check", "s.toml", "--effort", "quick", "--write", "shut/c.toml"],
    ] {
        let message = crate::mistake(words, at);
        let named = message.contains("cannot write shut") && message.contains("write to another place");
        assert!(named, "{words:?}: {message}");
    }
    drop(unmount);
}

#[test]
fn law_an_answer_that_cannot_be_printed_is_no_success() {
    for words in [&["motors"][..], &["--help"], &["--version"], &["help", "odds"], &["run", "--help"]] {
        let device = fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
        let mut program = Command::new(env!("CARGO_BIN_EXE_standstill"));
        let output = program.args(words).stdout(device).output().expect("it starts");
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains("standard output: No space left on device"), "{words:?}: {said}");
    }
}

/// Begins a run into the folder `o`, of which no file may be larger than 32 KiB.
fn run_in_small_files(at: &Path) -> Output {
    fs::write(at.join("s.toml"), "trials = 4000\n[detector]\nmethod = \"bipolar\"\n").expect("written");
    let program = env!("CARGO_BIN_EXE_standstill");
    let limited = format!("ulimit -f 64 && exec '{program}' run s.toml --out o");
    Command::new("sh").args(["-c", &limited]).current_dir(at).output().expect("it starts")
}

/// A limit of the size of files (`ulimit -f`, a quota) ends a run with a message and a journal that goes on.
#[test]
fn law_a_file_that_may_not_grow_is_named_and_the_run_goes_on_without_the_limit() {
    let folder = crate::folder();
    let at = folder.path();
    let output = run_in_small_files(at);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("File too large") && said.contains("run.journal"), "{said}");
    assert!(crate::standstill(&["run", "s.toml", "--out", "o", "--resume"], at).status.success());
    assert!(crate::standstill(&["run", "s.toml", "--out", "whole"], at).status.success());
    let of = |out: &str| fs::read(at.join(out).join("trials.csv")).expect("written");
    assert!(of("o") == of("whole"));
}

/// A folder may come from somebody else: its hidden note proposes no command that this program did not write.
#[test]
fn law_a_command_of_another_program_in_a_folder_is_not_proposed() {
    let folder = crate::folder();
    let at = folder.path();
    run_in_small_files(at);
    let said = || String::from_utf8(crate::standstill(&["status", "o"], at).stdout).expect("text");
    assert!(said().contains("standstill run s.toml --out o --resume"), "{}", said());
    let note = at.join("o/.standstill-scenario.json");
    let text = fs::read_to_string(&note).expect("a note");
    fs::write(&note, text.replace("\"standstill run", "\"rm -rf important; standstill run"))
        .expect("written");
    assert!(!said().contains("rm -rf") && said().contains("--resume"), "{}", said());
}
