//! Two processes with one folder, a folder that goes away, a clock that is set back, few open files.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use super::{Bench, library};
use crate::firmware::soon;

/// Longer than any test waits: an interrupt ends it.
const LONG: &str = "trials = 1000000\n[detector]\nmethod = \"bipolar\"\n";

fn started(words: &[&str], at: &Path) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_standstill"));
    command.args(words).current_dir(at).stdout(Stdio::null()).stderr(Stdio::piped());
    command.spawn().expect("it starts")
}

fn interrupt(child: &Child) -> bool {
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill").success()
}

/// promise: one-writer, no-mixed-files
#[test]
fn law_of_two_processes_with_one_folder_one_answers_and_the_other_says_so() {
    let folder = crate::folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), LONG).expect("written");
    fs::write(at.join("l.toml"), crate::answers::SCENARIO).expect("written");
    let run: &[&str] = &["run", "s.toml", "--out", "run"];
    let budget: &[&str] = &["budget", "l.toml", "--pairs", "4000", "--out", "budget"];
    for (words, other) in [(run, &["--seed", "2"][..]), (budget, &["--seed", "2"])] {
        let first = started(words, at);
        let journal = at.join(words[0]).join(format!("{}.journal", words[0]));
        soon("a journal", || fs::metadata(&journal).is_ok_and(|file| file.len() > 1000));
        for more in [&[][..], &["--resume"], &["--force"], &[other, &["--resume"]].concat()] {
            let message = crate::mistake(&[words, more].concat(), at);
            assert!(message.contains("is being written by another process"), "{words:?} {more:?}: {message}");
        }
        assert!(interrupt(&first), "{words:?}");
        let output = first.wait_with_output().expect("ended");
        assert_eq!(output.status.code(), Some(130), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
        assert!(journal.exists(), "{words:?}");
    }
    // Without a journal both answer, and the later one finds that the earlier one answered another question.
    let reproduce = |seed: &'static str| ["reproduce", "--trials", "1000", "--seed", seed, "--out", "p"];
    let both = [started(&reproduce("1"), at), started(&reproduce("2"), at)];
    let mut codes: Vec<Option<i32>> = Vec::new();
    for child in both {
        let output = child.wait_with_output().expect("ended");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() || said.contains("found the results of another run"), "{said}");
        codes.push(output.status.code());
    }
    codes.sort_unstable();
    assert_eq!(codes, [Some(0), Some(2)]);
    // All files are those of one of the two.
    let same = |seed: &&str| {
        let words = ["reproduce", "--trials", "1000", "--seed", *seed, "--out", "p"];
        crate::standstill(&words, at).status.success()
    };
    assert_eq!(["1", "2"].iter().filter(|seed| same(seed)).count(), 1);
}

/// promise: folder-gone
#[test]
fn law_a_folder_that_is_deleted_ends_the_run_and_nothing_is_promised() {
    let folder = crate::folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), LONG).expect("written");
    for rows in ["all", "none"] {
        let child = started(&["run", "s.toml", "--rows", rows, "--out", "o"], at);
        soon("a journal", || fs::metadata(at.join("o/run.journal")).is_ok_and(|file| file.len() > 100));
        fs::remove_dir_all(at.join("o")).expect("removed");
        if rows == "none" {
            // Statistics are written once in ten seconds: an interrupt writes them now.
            std::thread::sleep(Duration::from_millis(300));
            assert!(interrupt(&child));
        }
        let output = child.wait_with_output().expect("ended");
        let said = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("o/run.journal: it was removed while the run wrote it"), "{said}");
        assert!(!said.contains("is kept in") && !at.join("o").exists(), "{said}");
    }
    // Files in the making go with their folder.
    let child = started(&["reproduce", "--trials", "4000", "--out", "p"], at);
    soon("a table", || fs::read_dir(at.join("p")).is_ok_and(|mut entries| entries.next().is_some()));
    // The command makes files in it meanwhile.
    soon("removed", || fs::remove_dir_all(at.join("p")).is_ok());
    let output = child.wait_with_output().expect("ended");
    let said = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("cannot write p/") && said.contains("No such file"), "{said}");
    assert!(!at.join("p").exists(), "{said}");
}

#[test]
fn law_a_clock_that_is_set_back_changes_no_byte() {
    let bench = Bench::new();
    let at = bench.folder.path();
    for (name, words) in [
        ("run", &["run", "s.toml", "--trials", "400", "--out"][..]),
        ("budget", &["budget", "s.toml", "--pairs", "100", "--out"]),
        ("report", &["report", "done", "--out"]),
    ] {
        let [here, back] = [format!("{name}-a"), format!("{name}-b")];
        bench.well(&[words, &[&here]].concat());
        // Twice an hour back, whoever looks: at once, and at the third look.
        for looks in ["1", "3"] {
            let _ = fs::remove_dir_all(at.join(&back));
            let words = [words, &[&back]].concat();
            let output = bench.run(&words, &[("FAULT_CLOCK", looks)]);
            assert!(output.status.success(), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
            let of = |out: &str| {
                let mut files = super::tree(&at.join(out));
                // The folder's name is in the command of a page.
                files.retain(|name, _| !name.contains(".html") && !name.starts_with('.'));
                files
            };
            assert!(of(&here) == of(&back), "{name}");
        }
    }
}

#[test]
fn law_few_open_files_are_enough_or_said() {
    let bench = Bench::new();
    let mut refused = 0;
    for name in ["run", "report", "faults", "reproduce"] {
        let case = super::CASES.iter().find(|case| case.name == name).expect("a case");
        let ready = bench.ready(case, false);
        // Standard input, output, error, and how many more.
        for limit in [4, 5, 6, 16] {
            bench.restore(None);
            let words = ready.words.iter().map(|word| format!("'{word}'")).collect::<Vec<_>>().join(" ");
            let program = env!("CARGO_BIN_EXE_standstill");
            let line = format!("ulimit -n {limit}; exec {program} {words}");
            let mut shell = Command::new("sh");
            let output =
                shell.args(["-c", &line]).current_dir(bench.folder.path()).output().expect("a shell");
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(!said.contains("panicked"), "{name} with {limit}: {said}");
            if output.status.code() == Some(ready.code) {
                assert!(super::tree(&bench.out()) == ready.after, "{name} with {limit}");
                continue;
            }
            refused += 1;
            assert_eq!(output.status.code(), Some(2), "{name} with {limit}: {said}");
            assert!(said.contains("Too many open files"), "{name} with {limit}: {said}");
            bench.looked_at(&ready, &format!("{name} with {limit} open files"));
        }
    }
    assert!(refused > 0 && refused < 12, "{refused} of 16 have too few");
}

/// The library that these tests stand on does what it says: a kill, an error, a count.
#[test]
fn law_the_calls_that_are_counted_are_those_that_fail() {
    let folder = crate::folder();
    let touch = |faults: &[(&str, &str)]| {
        let mut sh = Command::new("sh");
        let line = "echo 1 > a; echo 2 > b; mv a c; rm b";
        sh.args(["-c", line]).current_dir(folder.path()).env("LD_PRELOAD", library());
        sh.envs(faults.iter().copied()).stderr(Stdio::piped()).output().expect("a shell")
    };
    let output = touch(&[("FAULT_CALLS", "write"), ("FAULT_AT", "2"), ("FAULT_DO", "28")]);
    assert!(!output.stderr.is_empty() && touch(&[]).stderr.is_empty(), "{output:?}");
    assert_eq!(fs::read_to_string(folder.path().join("c")).expect("moved"), "1\n");
    let output = touch(&[("FAULT_CALLS", "rename,unlink"), ("FAULT_AT", "1"), ("FAULT_DO", "5")]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("Input/output error"), "{output:?}");
}
