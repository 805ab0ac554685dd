//! Libraries in processes of their own: what a crash costs, and that no process stays behind.

use super::*;

/// promise: crashes-cost-a-trial
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
            // Far above what a busy machine takes for a call.
            let timeout = "detector.call_timeout=1 s";
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

#[test]
fn law_what_crashes_before_the_first_trial_is_a_mistake_where_it_is_isolated() {
    let folder = folder();
    let at = folder.path();
    let ends = [
        ("crash", "the library crashed: SIGSEGV"),
        ("exit", "the library called exit()"),
        ("hang", "a call took longer than detector.call_timeout"),
    ];
    for (how, reason) in ends {
        for loads in [true, false] {
            probe(at, &if loads { "found".to_owned() } else { format!("create-{how}") });
            if loads {
                build_with(at, PROBE, "probe.so", &[&format!("-DAT_LOAD=\"{how}\"")]);
            }
            let timeout = ["-s", "detector.call_timeout=200 ms", "--isolate"];
            for command in [&["run", "s.toml", "--out", "out"][..], &["slurm", "s.toml", "--shards", "2"]] {
                let message = mistake(&[command, &["--detector", "./probe.so"], &timeout].concat(), at);
                assert!(message.contains("`detector.library`") && message.contains(reason), "{message}");
            }
            assert!(!at.join("out").exists(), "nothing is written");
        }
    }
    // Without it the program ends by the signal, and says when that was.
    for (what, options, when) in [
        ("create-crash", vec![], "while a first detector of it was tried, crashed: SIGSEGV"),
        ("found", vec!["-DAT_LOAD=\"crash\""], "while it was loaded, crashed: SIGSEGV"),
        ("found", vec!["-DAT_LOAD=\"exit\""], "while it was loaded, called exit()"),
    ] {
        probe(at, what);
        build_with(at, PROBE, "probe.so", &options);
        let output = standstill(&["run", "s.toml", "--detector", "./probe.so", "--out", "out"], at);
        let said = String::from_utf8(output.stderr).expect("text");
        assert!(said.contains("probe.so, ") && said.contains(when) && !said.contains("trial"), "{said}");
    }
}

#[test]
fn law_isolated_libraries_can_be_an_axis() {
    let folder = folder();
    probe(folder.path(), "found");
    build_with(folder.path(), PROBE, "other.so", &["-DCOMMANDS"]);
    let axis = ["--vary", "detector.library=./probe.so,./other.so", "-s", "detector.time_limit=1 ms"];
    let trials = |more: &[&str], out: &str| {
        let common = ["sweep", "s.toml", "--trials", "10", "--out", out];
        let output = standstill(&[&common[..], &axis, more].concat(), folder.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        fs::read_to_string(folder.path().join(out).join("trials.csv")).expect("written")
    };
    let plain = trials(&[], "plain");
    assert_eq!(plain, trials(&["--isolate"], "apart"));
    assert_eq!(plain.lines().filter(|line| line.contains(",found,")).count(), 10);
    assert_eq!(plain.lines().filter(|line| line.contains("not done within")).count(), 10);
}

/// Processes whose parent is this one, which have not ended.
fn children(of: u32) -> Vec<u32> {
    let stat = |pid: u32| {
        let text = fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        let (_, rest) = text.rsplit_once(") ")?;
        let mut words = rest.split(' ');
        (words.next()? != "Z").then_some(())?;
        words.next()?.parse::<u32>().ok()
    };
    let all = fs::read_dir("/proc")
        .expect("a list")
        .filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    all.filter(|pid| stat(*pid) == Some(of)).collect()
}

/// Whether this process runs.
fn runs(pid: u32) -> bool {
    let text = fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    text.rsplit_once(") ").is_some_and(|(_, rest)| !rest.starts_with('Z'))
}

#[test]
fn law_workers_end_with_their_parent() {
    for signal in ["-KILL", "-INT"] {
        let folder = folder();
        // An eighth of the trials hangs, for longer than this test.
        probe(folder.path(), "hang");
        let mut run = Command::new(env!("CARGO_BIN_EXE_standstill"))
            .args([
                "run",
                "s.toml",
                "--detector",
                "./probe.so",
                "--isolate",
                "--threads",
                "2",
                "--trials",
                "100000",
            ])
            .args([
                "-s",
                if signal == "-KILL" { "detector.call_timeout=900 s" } else { "detector.call_timeout=1 s" },
            ])
            .current_dir(folder.path())
            .stderr(std::process::Stdio::null())
            .stdout(std::process::Stdio::null())
            .spawn()
            .expect("starts");
        let journal = folder.path().join("standstill-out/s-run");
        soon("trials begin", || journal.exists() && children(run.id()).len() == 2);
        let workers = children(run.id());
        let status = Command::new("kill").args([signal, &run.id().to_string()]).status().expect("kill");
        assert!(status.success());
        let ended = run.wait().expect("ends");
        assert_eq!(
            (ended.code(), ended.signal()),
            if signal == "-INT" { (Some(130), None) } else { (None, Some(9)) }
        );
        soon("workers end", || workers.iter().all(|pid| !runs(*pid)));
    }
}
