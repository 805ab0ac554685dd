//! Clusters: runs that keep no rows, what is known of shards, and the script for Slurm.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use super::{folder, mistake, names, standstill};

const SWEEP: &str = r#"
trials = 300
limit = "0.5 deg"
[detector]
method = "bipolar"
[axes]
"sensors.noise" = { from = "1 mA", to = "400 mA", points = 3, log = true }
"#;

fn succeed(arguments: &[&str], folder: &Path) -> String {
    let output = standstill(arguments, folder);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// promise: statistics-add-up
#[test]
fn law_the_summary_of_a_run_without_rows_is_that_with_rows_also_killed_and_from_shards() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SWEEP).expect("written");
    // But for what the table of trials is, in all digits.
    let summary = |out: &str| {
        let text = fs::read_to_string(path.join(out).join("summary.json")).expect("there");
        text.split_once("\"tables\"").expect("digests").0.to_owned()
    };
    succeed(&["run", "s.toml", "--out", "rows"], path);
    succeed(&["run", "s.toml", "--rows", "none", "--threads", "2", "--out", "none"], path);
    assert_eq!(names(&path.join("none")), ["run.statistics", "summary.json"]);
    assert_eq!(summary("rows"), summary("none"));
    // Without axes as well, and with points that end early.
    for options in [&["--stop-at", "rms=9%"][..], &["-s", "axes={}"]] {
        let run = |rows: &str| {
            succeed(&[&["run", "s.toml", "--rows", rows, "--out", rows, "--force"], options].concat(), path)
        };
        run("all");
        run("none");
        assert_eq!(summary("all"), summary("none"), "{options:?}");
    }
    // Shards, the second of them killed again and again.
    for shard in ["1/3", "3/3"] {
        succeed(&["run", "s.toml", "--rows", "none", "--shard", shard, "--out", "shards"], path);
    }
    let second = [
        "run",
        "s.toml",
        "--rows",
        "none",
        "--shard",
        "2/3",
        "--resume",
        "--threads",
        "1",
        "--out",
        "shards",
    ];
    for wait in [5, 40, 90] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_standstill"))
            .args(second)
            .current_dir(path)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        std::thread::sleep(Duration::from_millis(wait));
        let _ = child.kill();
        child.wait().expect("ended");
    }
    succeed(&second, path);
    succeed(&["merge", "shards", "--out", "merged"], path);
    assert_eq!(names(&path.join("merged")), ["summary.json"]);
    assert_eq!(summary("rows"), summary("merged"));
    // Rows and statistics are not put together, and one does not go on as the other.
    succeed(&["run", "s.toml", "--shard", "1/2", "--rows", "none", "--out", "mixed"], path);
    succeed(&["run", "s.toml", "--shard", "2/2", "--out", "mixed"], path);
    assert!(
        mistake(&["merge", "mixed"], path).contains("it keeps rows there and statistics alone here (--rows)")
    );
    let message = mistake(&["run", "s.toml", "--shard", "1/2", "--resume", "--out", "mixed"], path);
    assert!(message.contains("it keeps statistics alone there and rows here (--rows)"), "{message}");
}

#[test]
fn law_status_tells_what_to_submit_again() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SWEEP).expect("written");
    for shard in ["2/5", "4/5"] {
        succeed(&["run", "s.toml", "--shard", shard, "--out", "shards"], path);
    }
    let output = standstill(&["status", "shards"], path);
    let text = String::from_utf8(output.stdout).expect("text");
    assert_eq!(output.status.code(), Some(1));
    assert!(text.contains("5 shards: 2 done, 3 missing") && text.contains("--array=1,3,5"), "{text}");
    // Part of one: its journal cut short.
    let journal = path.join("shards/shard-4-of-5.journal");
    let bytes = fs::read(&journal).expect("there");
    fs::write(&journal, &bytes[..bytes.len() - 9]).expect("written");
    let output = standstill(&["status", "shards", "--json"], path);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((output.status.code(), json["array"].as_str()), (Some(1), Some("1,3-5")));
    assert_eq!(
        (json["shards"][3]["state"].as_str(), json["shards"][1]["state"].as_str()),
        (Some("begun"), Some("done"))
    );
    for shard in ["1/5", "3/5", "4/5", "5/5"] {
        succeed(&["run", "s.toml", "--shard", shard, "--resume", "--out", "shards"], path);
    }
    assert!(succeed(&["status", "shards"], path).contains("5 shards: 5 done\n"));
    assert!(mistake(&["status", "nowhere"], path).contains("nowhere"));
    // A finished run has no journal any more.
    succeed(&["merge", "shards", "--out", "whole"], path);
    let text = succeed(&["status", "whole"], path);
    assert!(text.starts_with("a finished run: ") && text.contains("nothing is left to do"), "{text}");
    let json: serde_json::Value =
        serde_json::from_str(&succeed(&["status", "whole", "--json"], path)).expect("JSON");
    assert_eq!((&json["counts"]["done"], &json["counts"]["missing"]), (&1.into(), &0.into()));
    fs::create_dir(path.join("empty")).expect("a folder");
    assert!(mistake(&["status", "empty"], path).contains("no journal of a shard"));
    fs::write(path.join("shards/shard-9-of-9.journal"), "of something else").expect("written");
    assert!(mistake(&["status", "shards"], path).contains("shard-9-of-9.journal"));
}

#[test]
fn regress_of_a_run_without_shards_nothing_is_submitted_again() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SWEEP).expect("written");
    let journal = "run.journal";
    for rows in ["all", "none"] {
        let words = ["run", "s.toml", "--trials", "100000000", "--rows", rows, "--out", rows];
        let mut child = Command::new(env!("CARGO_BIN_EXE_standstill"))
            .args(words)
            .current_dir(path)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the program starts");
        let there = || fs::metadata(path.join(rows).join(journal)).is_ok_and(|file| file.len() > 0);
        for _ in 0..1200 {
            if there() {
                break;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        let running = standstill(&["status", rows], path);
        let _ = child.kill();
        child.wait().expect("ended");
        let text = String::from_utf8(running.stdout).expect("text");
        assert!(
            running.status.code() == Some(1) && text.starts_with("a run without shards: running\n"),
            "{text}"
        );
        assert!(!text.contains("--array") && !text.contains("--resume"), "{text}");
        let text = String::from_utf8(standstill(&["status", rows], path).stdout).expect("text");
        assert!(text.starts_with("a run without shards: begun\n") && text.contains(journal), "{text}");
        assert!(text.contains("with --resume") && !text.contains("--array"), "{text}");
        let again = format!("\n  standstill {} --resume\n", words.join(" "));
        assert!(text.contains(&again), "{text}");
        let json = standstill(&["status", rows, "--json"], path).stdout;
        let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
        assert!(json["array"].is_null() && json["shards"][0]["state"] == "begun", "{json}");
    }
}

#[test]
fn law_the_script_for_slurm_is_understood_by_a_shell_and_says_where_slurm_is_not() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SWEEP).expect("written");
    let script = succeed(
        &["slurm", "s.toml", "--shards", "3", "-s", "sensors.jitter=20 ns", "--out", "big out"],
        path,
    );
    fs::write(path.join("job.sh"), &script).expect("written");
    // With nothing else to find there is no sbatch.
    let run = |task: Option<&str>| {
        let mut bash = Command::new("/bin/bash");
        bash.arg("job.sh").current_dir(path).env("PATH", "/nowhere").env_remove("SLURM_ARRAY_TASK_ID");
        task.map(|task| bash.env("SLURM_ARRAY_TASK_ID", task));
        bash.output().expect("a shell")
    };
    let output = run(None);
    let message = String::from_utf8(output.stderr).expect("text");
    assert!(output.status.code() == Some(2) && message.starts_with("sbatch is not here"), "{message}");
    for task in ["1", "2", "3", "2"] {
        assert!(run(Some(task)).status.success());
    }
    succeed(&["merge", "big out/shards", "--out", "merged"], path);
    succeed(&["run", "s.toml", "-s", "sensors.jitter=20 ns", "--out", "whole"], path);
    let trials = |out: &str| fs::read(path.join(out).join("trials.csv")).expect("there");
    assert_eq!(trials("merged"), trials("whole"));
    // What is wrong shows before anything is submitted.
    let message = mistake(&["slurm", "s.toml", "--shards", "3", "-s", "sensors.nose=1"], path);
    assert!(message.contains("did you mean `noise`"), "{message}");
}

#[test]
fn law_results_in_other_formats_replace_each_other() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SWEEP).expect("written");
    for (format, begin) in
        [("npz", &b"PK\x03\x04"[..]), ("mat", b"MATLAB 5.0 MAT-file"), ("csv", b"sensors.noise,trial")]
    {
        succeed(&["run", "s.toml", "--trials", "5", "--format", format, "--out", "out"], path);
        let trials = format!("trials.{format}");
        assert_eq!(names(&path.join("out")), ["summary.json", trials.as_str()]);
        assert!(fs::read(path.join("out").join(trials)).expect("there").starts_with(begin), "{format}");
        succeed(&["trace", "--format", format, "--out", "trace"], path);
        assert!(path.join(format!("trace/waveform.{format}")).exists());
    }
}

#[test]
fn regress_shards_of_two_splits_are_not_put_into_one_folder() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SWEEP).expect("written");
    let shard = |of: &'static str| ["run", "s.toml", "--trials", "20", "--shard", of, "--out", "shards"];
    succeed(&shard("1/3"), path);
    let other = shard("1/4");
    for more in [&[][..], &["--resume"], &["--force"]] {
        let message = mistake(&[&other[..], more].concat(), path);
        for part in ["shard-1-of-3.journal is shard 1/3", "shard-1-of-4.journal shard 1/4", "two splits"] {
            assert!(message.contains(part), "{part} in {message}");
        }
    }
    // Nor those of another run, unless it is to take their place.
    let seed = [&shard("2/3")[..], &["--seed", "2"]].concat();
    assert!(mistake(&seed, path).contains("the seed is 1 there and 2 here"));
    assert_eq!(names(&path.join("shards")), ["shard-1-of-3.journal"]);
    succeed(&[&seed[..], &["--force"]].concat(), path);
}

#[test]
fn regress_a_run_that_a_rule_ended_is_extended_by_a_narrower_rule_or_none() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SWEEP).expect("written");
    // Lines are as wide as a terminal.
    let run = |out: &str, more: &[&str]| {
        let text = succeed(&[&["run", "s.toml", "-s", "axes={}", "--out", out], more].concat(), path);
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let summary = |out: &str| fs::read(path.join(out).join("summary.json")).expect("there");
    for rows in ["all", "none"] {
        run("short", &["--trials", "300", "--stop-at", "rms=14%", "--rows", rows]);
        // More trials change nothing where the rule is met, and it says so.
        let said = run("short", &["--trials", "320", "--stop-at", "rms=14%", "--rows", rows, "--resume"]);
        assert!(said.contains("is as long as before: stop_at is met"), "{said}");
        for (k, longer) in
            [&["--trials", "320", "--stop-at", "rms=9%"][..], &["--trials", "330"]].into_iter().enumerate()
        {
            let whole = format!("{rows}-{k}");
            run(&whole, &[longer, &["--rows", rows]].concat());
            let said = run("short", &[longer, &["--rows", rows, "--resume"]].concat());
            assert!(said.contains("was extended to"), "{said}");
            assert_eq!(summary("short"), summary(&whole), "{rows} {longer:?}");
        }
        // A wider one would have ended before.
        let wider = ["run", "s.toml", "-s", "axes={}", "--trials", "400", "--stop-at", "rms=20%", "--resume"];
        let wider = [&wider[..], &["--rows", rows, "--out", "short"]].concat();
        let message = mistake(&wider, path);
        assert!(
            message.contains("the number of trials is 330 there and 400 here; `stop_at.rms`"),
            "{message}"
        );
        fs::remove_dir_all(path.join("short")).expect("gone");
    }
}

/// `sbatch` that writes down what it was given, and a number for each job.
#[cfg(unix)]
fn submitted(folder: &Path, options: &[&str]) -> (String, Vec<String>, Option<i32>) {
    use std::os::unix::fs::PermissionsExt as _;

    let bin = folder.join("bin");
    fs::create_dir_all(&bin).expect("made");
    let sbatch = "#!/bin/bash\nn=$(($(cat \"$LOG.n\" 2>/dev/null || echo 100) + 1)); echo $n >\"$LOG.n\"\nprintf '%s|' \"$@\" >>\"$LOG\"; echo >>\"$LOG\"\necho \"$n;cluster\"\n";
    fs::write(bin.join("sbatch"), sbatch).expect("written");
    fs::set_permissions(bin.join("sbatch"), fs::Permissions::from_mode(0o755)).expect("set");
    let log = folder.join("submitted");
    let _ = fs::remove_file(&log);
    let _ = fs::remove_file(folder.join("submitted.n"));
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").expect("one"));
    let output = Command::new("bash")
        .arg("campaign.sh")
        .args(options)
        .env("PATH", path)
        .env("LOG", &log)
        .env_remove("SLURM_ARRAY_TASK_ID")
        .current_dir(folder)
        .output()
        .expect("bash");
    let said =
        format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let lines = fs::read_to_string(&log).unwrap_or_default().lines().map(str::to_owned).collect();
    (said, lines, output.status.code())
}

/// Options reached the shards alone, so that the job that merges them stayed without an account; and Slurm refuses an array of 2,500.
#[test]
#[cfg(unix)]
fn regress_options_reach_the_merging_job_and_many_shards_are_several_arrays() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), "trials = 2500\n[detector]\nmethod = \"bipolar\"\n").expect("written");
    let script = succeed(&["slurm", "s.toml", "--shards", "2500", "--out", "results"], path);
    assert!(!script.contains("#SBATCH --array"), "{script}");
    fs::write(path.join("campaign.sh"), script).expect("written");
    let (said, jobs, code) = submitted(path, &["--account=motors", "--mem", "2G"]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("shards as job 101, 102, 103, and job 104"), "{said}");
    assert_eq!(jobs.len(), 4, "{jobs:?}");
    for (job, (array, before)) in jobs.iter().zip([("1-1000", "0"), ("1-1000", "1000"), ("1-500", "2000")]) {
        assert!(job.contains(&format!("|--array={array}|--account=motors|--mem|2G|")), "{job}");
        assert!(job.ends_with(&format!("campaign.sh|{before}|")), "{job}");
    }
    assert!(jobs[3].contains("|--account=motors|--mem|2G|"), "{}", jobs[3]);
    assert!(jobs[3].contains("|--dependency=afterok:101:102:103|"), "{}", jobs[3]);
    // What is submitted again goes by the shards' own numbers, and is none of the merging job's options.
    for option in [&["--array=3,999-1002,2003-2009:3%7"][..], &["-a", "3,999-1002,2003-2009:3%7"]] {
        let (said, jobs, _) = submitted(path, &[option, &["--qos=low"]].concat());
        let arrays: Vec<_> =
            jobs.iter().flat_map(|job| job.split('|').filter(|word| word.starts_with("--array"))).collect();
        assert_eq!(arrays, ["--array=3,999-1000%7", "--array=1-2%7", "--array=3-9:3%7"], "{said}");
        assert!(jobs[3].contains("|--qos=low|") && !jobs[3].contains("array"), "{}", jobs[3]);
    }
    for (wrong, says) in [
        ("--array=0-3", "found '0-3', needed shards from 1 to 2500"),
        ("--array=2501", "found '2501', needed shards from 1 to 2500"),
        ("--array=9-3", "found '9-3', needed"),
        ("--array=three", "found 'three', needed shards such as 3,7-9"),
    ] {
        let (said, jobs, code) = submitted(path, &[wrong]);
        assert!(said.contains(says) && jobs.is_empty() && code == Some(2), "{wrong}: {said}");
    }
    // The task itself.
    let task = Command::new("bash")
        .args(["campaign.sh", "2000"])
        .env("SLURM_ARRAY_TASK_ID", "3")
        .current_dir(path)
        .output();
    let task = task.expect("bash");
    assert!(task.status.success(), "{}", String::from_utf8_lossy(&task.stderr));
    assert_eq!(names(&path.join("results/shards")), ["shard-2003-of-2500.journal"]);
}
