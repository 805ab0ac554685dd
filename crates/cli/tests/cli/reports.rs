//! Reports of finished runs: one file that says what was run, and none of trials that do not belong together.

use std::fs;

use super::campaigns::{SWEEP, files, scenario, succeed};
use super::{folder, mistake, names, standstill};

#[test]
fn law_a_report_is_one_file_that_says_what_was_run() {
    let folder = folder();
    let path = folder.path();
    scenario(path, SWEEP);
    for format in ["csv", "parquet"] {
        succeed(&["run", "s.toml", "--trials", "60", "--format", format, "--out", format], path);
        let text = succeed(&["report", format], path);
        assert!(
            text.contains("at any of 4 points")
                && text.contains("Worst point: ")
                && text.contains("answered rightly"),
            "{text}"
        );
        let report = path.join(format).join("report");
        let made = names(&report);
        for name in ["report.html", "sweep_sensors.noise.png", "heat_sensors.noise_errors.png"] {
            assert!(made.iter().any(|made| made == name), "{name} in {made:?}");
        }
        let page = fs::read_to_string(report.join("report.html")).expect("readable");
        for part in
            ["bipolar", "standstill run scenario.toml", "errors&quot; = [", "sensors.noise", "Verdict"]
        {
            assert!(page.contains(part), "{part}");
        }
    }
    // Both formats hold the same trials; the printed command alone differs.
    let pictures = |format: &str| {
        let mut files = files(&path.join(format).join("report"));
        files.remove("report.html");
        files
    };
    assert_eq!(pictures("csv"), pictures("parquet"));

    assert!(mistake(&["report", "nowhere"], path).contains("nowhere: found no such folder"));
    fs::remove_file(path.join("parquet/trials.parquet")).expect("there");
    assert!(mistake(&["report", "parquet"], path).contains("no trials"));
    succeed(&["run", "s.toml", "--trials", "60", "--seed", "2", "--out", "other"], path);
    let write = |out: &str, trials: &str| super::changed::write_with_its_digest(&path.join(out), trials);
    let other = fs::read_to_string(path.join("other/trials.csv")).expect("readable");
    write("csv", &other);
    assert!(mistake(&["report", "csv"], path).contains("another seed"));
    let short: Vec<&str> = other.lines().take(100).collect();
    write("other", &short.join("\n"));
    assert!(mistake(&["report", "other"], path).contains("99 trials instead of 240"));
}

/// The command by which a report goes on is the run's own, and runs: the motor's name, the keys and the seed of its command line.
#[test]
fn regress_a_report_goes_on_with_the_command_line_of_its_run() {
    let folder = folder();
    let path = folder.path();
    let run =
        ["run", "paper-5k5", "-s", "detector.method=bipolar", "--seed", "7", "--trials", "40", "--out", "r"];
    assert!(standstill(&run, path).status.success());
    let report = |path: &std::path::Path, run: &str| {
        String::from_utf8(standstill(&["report", run, "--force"], path).stdout).expect("text")
    };
    let said = report(path, "r");
    let command =
        said.split("`standstill run ").nth(1).and_then(|rest| rest.split('`').next()).expect("a command");
    let again = "paper-5k5 -s detector.method=bipolar --seed 7 --trials 37000 --resume --out r";
    assert_eq!(command, again, "{said}");
    assert!(
        said.contains("`standstill odds paper-5k5 -s detector.method=bipolar --seed 7 --event wrong-pole`"),
        "{said}"
    );
    // Fewer are enough to see that it goes on.
    let fewer = format!("run {}", command.replace("37000", "50"));
    let output =
        standstill(&super::guides::words(&fewer).iter().map(String::as_str).collect::<Vec<_>>(), path);
    let text = String::from_utf8_lossy(&output.stdout).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("The run of 40 trials that was there was extended to 50."), "{text}");
    // Where the scenario's file is not at hand, a stand-in has a word about it.
    fs::write(path.join("s.toml"), "detector.method = \"bipolar\"\ntrials = 20\n").expect("written");
    assert!(standstill(&["run", "s.toml", "--out", "q"], path).status.success());
    assert!(report(path, "q").contains("`standstill run s.toml --trials 37000 --resume --out q`;"));
    fs::remove_file(path.join("s.toml")).expect("removed");
    let said = report(path, "q");
    assert!(
        said.contains("`standstill run scenario.toml --trials") && said.contains("(scenario.toml: "),
        "{said}"
    );
}

/// Of results that somebody has changed or removed `status` does not say that nothing is left to do.
#[test]
fn regress_status_looks_at_the_tables_that_are_there() {
    let folder = folder();
    let path = folder.path();
    let run = ["run", "paper-5k5", "-s", "detector.method=bipolar", "--trials", "20", "--out", "r"];
    assert!(standstill(&run, path).status.success());
    let status = || {
        let output = standstill(&["status", "r"], path);
        let said = [output.stdout, output.stderr].map(|text| String::from_utf8(text).expect("text"));
        (output.status.code(), said.concat())
    };
    let (code, said) = status();
    assert!(code == Some(0) && said.starts_with("a finished run: 20 trials"), "{said}");
    let table = path.join("r/trials.csv");
    let whole = fs::read_to_string(&table).expect("a table");
    fs::write(&table, whole.replacen("found", "failed", 1)).expect("written");
    let (code, said) = status();
    assert!(code == Some(2) && said.contains("which is not what the run wrote"), "{said}");
    fs::remove_file(&table).expect("removed");
    let (code, said) = status();
    assert!(code == Some(2) && said.contains("trials.csv"), "{said}");
}
