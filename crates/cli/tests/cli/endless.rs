//! What has no end, where a result of an earlier run is looked for: it is refused, not read or waited for.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::folder;
use super::terminal::said;

/// Longest time that a refusal may take, on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// Runs a command that must be refused; what it says.
fn refused(arguments: &[&str], at: &Path) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_standstill"));
    let command = command.args(arguments).current_dir(at).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("it starts");
    let begin = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if begin.elapsed() > PATIENCE {
            let _ = child.kill();
            panic!("{arguments:?} waits for what has no end");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let output = child.wait_with_output().expect("ended");
    let message = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    message
}

#[test]
fn regress_pipes_and_devices_in_place_of_earlier_results_are_refused() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), "trials = 12\n").expect("written");
    said(&["run", "s.toml", "--out", "o"], at);
    let odds = ["odds", "s.toml", "--event", "|e| > 1 deg", "--effort", "quick", "--out", "q"];
    said(&odds, at);
    for new in ["j", "n", "h"] {
        fs::create_dir(at.join(new)).expect("made");
    }
    let resumed = [&["run", "s.toml", "--resume", "--out"][..], &odds[..6]];
    let run = |more: &[&'static str]| [resumed[0], more].concat();
    let noted = [resumed[1], &["--resume", "--out", "n"]].concat();
    let shard = ["run", "s.toml", "--shard", "1/2", "--resume", "--out", "h"];
    // What is replaced, and who would read it.
    let cases: [(&str, &[&[&str]]); 7] = [
        // Journals that a run would go on with, or put together.
        (
            "j/run.journal",
            &[&run(&["j"]), &run(&["j", "--rows", "none"]), &["report", "j"], &["status", "j"]],
        ),
        ("n/odds.journal", &[&noted]),
        ("h/shard-1-of-2.journal", &[&shard, &["merge", "h", "--out", "whole"]]),
        ("o/summary.json", &[&["report", "o"], &["run", "s.toml", "--out", "o"], &["explain", "o"]]),
        ("o/trials.csv", &[&["report", "o"], &["explain", "o"]]),
        ("q/odds.json", &[&odds]),
        ("m.fmu", &[&["fmu", "s.toml", "--out", "m.fmu"]]),
    ];
    let pipe = |path: &Path| {
        assert!(Command::new("mkfifo").arg(path).status().expect("mkfifo(1)").success());
    };
    let device = |path: &Path| std::os::unix::fs::symlink("/dev/zero", path).expect("linked");
    for (file, readers) in cases {
        let path = at.join(file);
        let kept = fs::read(&path).ok();
        for endless in [&pipe as &dyn Fn(&Path), &device] {
            let _ = fs::remove_file(&path);
            endless(&path);
            for arguments in readers {
                let message = refused(arguments, at);
                assert!(message.contains(file), "{arguments:?}: {message}");
            }
        }
        fs::remove_file(&path).expect("removed");
        if let Some(kept) = kept {
            fs::write(&path, kept).expect("as it was");
        }
    }
}
