//! Signals that ask a command to end.

use std::fs;
use std::process::{Command, Stdio};

use super::tree;
use crate::firmware::soon;
use crate::{folder, names, standstill};

/// promise: ctrl-c-keeps
#[test]
fn law_hang_up_and_termination_keep_what_is_done_as_an_interrupt_does() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), "trials = 8000\n[detector]\nmethod = \"bipolar\"\n").expect("written");
    fs::write(at.join("l.toml"), crate::answers::SCENARIO).expect("written");
    let run: &[&str] = &["run", "s.toml", "--threads", "1"];
    let budget: &[&str] = &["budget", "l.toml", "--pairs", "400"];
    for (words, signals) in [(run, &["-HUP", "-TERM", "-INT"][..]), (budget, &["-HUP", "-TERM"])] {
        for &signal in signals {
            let out = format!("{}{signal}", words[0]);
            let words = [words, &["--out", &out]].concat();
            let journal = format!("{}.journal", words[0]);
            let child = Command::new(env!("CARGO_BIN_EXE_standstill"))
                .args(&words)
                .current_dir(at)
                .stdout(Stdio::piped())
                .stderr(Stdio::null())
                .spawn()
                .expect("it starts");
            let path = at.join(&out).join(&journal);
            soon("a journal", || fs::metadata(&path).is_ok_and(|file| file.len() > 3000));
            assert!(
                Command::new("kill")
                    .args([signal, &child.id().to_string()])
                    .status()
                    .expect("kill")
                    .success()
            );
            let output = child.wait_with_output().expect("ended");
            let said = String::from_utf8(output.stdout).expect("text");
            assert_eq!(output.status.code(), Some(130), "{words:?}: {said}");
            assert!(
                said.contains("Interrupted") && said.contains("kept in") && said.contains("--resume"),
                "{said}"
            );
            assert_eq!(names(&at.join(&out)), [journal], "{signal}");
        }
        // What was kept leads to the same bytes.
        let (begun, whole) = (format!("{}{}", words[0], signals[1]), format!("{}-whole", words[0]));
        for more in [&["--resume", "--out", &begun][..], &["--out", &whole]] {
            let output = standstill(&[words, more].concat(), at);
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        }
        let results = |out: String| {
            let mut found = tree(&at.join(out));
            // How it was typed, with another --out.
            found.remove(".standstill-scenario.json");
            found
        };
        assert!(results(begun) == results(whole), "{words:?}");
    }
}

#[test]
fn law_a_signal_to_what_writes_at_once_leaves_nothing() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), "trials = 2000\n[detector]\nmethod = \"bipolar\"\n").expect("written");
    assert!(standstill(&["run", "s.toml", "--out", "done"], at).status.success());
    let before = tree(&at.join("done"));
    for signal in ["-HUP", "-TERM"] {
        let child = Command::new(env!("CARGO_BIN_EXE_standstill"))
            .args(["report", "done"])
            .current_dir(at)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("it starts");
        soon("files in the making", || at.join("done/report").exists());
        assert!(
            Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill").success()
        );
        let output = child.wait_with_output().expect("ended");
        // It may just have ended.
        if output.status.code() == Some(130) {
            assert!(tree(&at.join("done")) == before, "{signal}");
        } else {
            assert_eq!(output.status.code(), Some(0), "{signal}");
            fs::remove_dir_all(at.join("done/report")).expect("removed");
        }
    }
}
