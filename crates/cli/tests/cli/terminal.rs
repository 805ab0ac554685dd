//! What stands on the terminal: widths, colours, what is said first, warnings, and what is in the way of results.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use super::nameplates::{PLATES, Plate, sheet};
use super::{folder, mistake, standstill};

pub fn said(arguments: &[&str], folder: &Path) -> String {
    let output = standstill(arguments, folder);
    assert!(output.status.code() < Some(2), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

pub fn with(variables: &[(&str, &str)], arguments: &[&str], folder: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_standstill"));
    for name in ["COLUMNS", "NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"] {
        command.env_remove(name);
    }
    command.envs(variables.iter().copied()).args(arguments).current_dir(folder).output().expect("it starts")
}

pub fn columns(text: &str) -> usize {
    text.lines()
        .filter(|line| !line.starts_with("  ") || line.contains('─'))
        .map(|line| line.chars().count())
        .max()
        .unwrap_or_default()
}

/// The table in a text: its line, and what stands around it until empty lines.
pub fn tables(text: &str) -> impl Iterator<Item = &str> {
    text.split("\n\n").filter(|block| block.contains("──"))
}

#[test]
fn regress_the_share_of_right_answers_stays_on_narrow_terminals() {
    let folder = folder();
    let axes = ["--vary", "sensors.noise=5mA,10mA", "--vary", "inverter.dead_time=1us,2us"];
    let start = ["sweep", "paper-5k5", "--trials", "200", "--force"];
    // With how many axes, in how many columns, what is shown, and what goes before it.
    let cases: [(usize, &str, &[&str], &[&str]); 3] = [
        (4, "60", &["right"], &["trials", "p95"]),
        (2, "60", &["right", "wrong poles"], &["trials", "p95"]),
        (4, "80", &["right", "wrong poles", "failed"], &["trials", "p95", "undetermined"]),
    ];
    for (words, columns, shown, gone) in cases {
        let output = with(&[("COLUMNS", columns)], &[&start[..], &axes[..words]].concat(), folder.path());
        let text = String::from_utf8(output.stdout).expect("text");
        let table = tables(&text).next().expect("a table");
        let head = table.split("──").next().expect("titles");
        for title in shown {
            assert!(head.contains(title), "{columns}: {title} in\n{text}");
        }
        for title in gone {
            assert!(!head.contains(title), "{columns}: {title} in\n{text}");
        }
    }
}

#[test]
fn regress_what_happened_at_a_point_of_two_axes_is_counted_in_eighty_columns() {
    let folder = folder();
    let axes = ["--vary", "sensors.noise=10mA,205mA,400mA", "--vary", "errors=default,harsh"];
    let method = ["-s", "detector.method=line-inductance-fast", "--trials", "100"];
    let arguments = [&["sweep", "paper-5k5"][..], &method, &axes].concat();
    let output = with(&[("COLUMNS", "80")], &arguments, folder.path());
    let text = String::from_utf8(output.stdout).expect("text");
    let table = tables(&text).next().expect("a table");
    let (head, rows) = table.split_once("──").expect("titles");
    assert!(["rms", "undetermined", "failed"].iter().all(|title| head.contains(title)), "{text}");
    // Of a hundred starts with much noise most fail, and of the others some stay undetermined; a share may stand behind.
    let noisy: Vec<Vec<&str>> = rows.lines().map(|row| row.split_whitespace().collect()).collect();
    for set in ["default", "harsh"] {
        let row = noisy.iter().find(|row| row.starts_with(&["205", set])).expect("its row");
        let failed: u32 = row.iter().rev().find_map(|cell| cell.parse().ok()).expect("a count");
        assert!((80..100).contains(&failed), "{text}");
    }
    assert!(
        text.replace('\n', " ").contains("No room for trials, p95 °, wrong poles, and the brackets of"),
        "{text}"
    );
}

#[test]
fn law_tables_fit_eighty_columns_on_the_smallest_and_the_largest_motor() {
    tables_fit_eighty_columns(&[&PLATES[0], &PLATES[5]]);
}

#[test]
#[ignore = "six motors in place of two: scripts/test-all.sh long"]
fn law_tables_fit_eighty_columns_on_motors_of_any_size() {
    tables_fit_eighty_columns(&PLATES.each_ref());
}

fn tables_fit_eighty_columns(plates: &[&Plate]) {
    let folder = folder();
    let at = folder.path();
    for (name, plate) in plates {
        fs::write(at.join("m.toml"), sheet(*plate)).expect("written");
        let commands: [&[&str]; 7] = [
            &["check", "m.toml", "-s", "detector.method=bipolar"],
            &["magnetics", "m.toml", "--out", "m", "--force"],
            &["motors", "m.toml"],
            &[
                "compare",
                "--motor",
                "m.toml",
                "--method",
                "bipolar,maximum-likelihood",
                "--trials",
                "20",
                "--no-limit",
                "--force",
            ],
            &["bounds", "-s", "motor=m.toml", "--angles", "4"],
            &[
                "sweep",
                "m.toml",
                "--trials",
                "8",
                "--vary",
                "inverter.dead_time=1us,2us",
                "--vary",
                "sensors.gain_error=0%,1%",
                "--force",
            ],
            &["budget", "m.toml", "--pairs", "100", "--force"],
        ];
        // The search takes nine seconds of the smallest motor and one of the largest: `long` has each.
        let searched = plates.len() > 2 || *name == PLATES[5].0;
        for arguments in &commands[usize::from(!searched)..] {
            let text = said(arguments, at);
            let mut found = 0;
            for table in tables(&text) {
                found += 1;
                for line in table.lines() {
                    assert!(line.chars().count() <= 80, "{name}: {arguments:?}: {line}");
                }
            }
            assert!(found > 0, "{arguments:?} shows a table:\n{text}");
            assert!(!text.contains("NaN") && !text.contains("inf "), "{name}: {arguments:?}:\n{text}");
            let zeros = text
                .split_whitespace()
                .filter(|word| word.trim_matches('0') == "." && word.len() < 5)
                .count();
            // What is small has its digits: a motor of milliamperes draws no 0.0 A.
            if arguments[0] == "check" {
                let peaks = text.lines().filter(|line| line.contains("suited")).count();
                assert!(peaks > 0 && zeros <= 2 * peaks, "{name}:\n{text}");
            }
        }
    }
    // More room shows more.
    let wide = with(
        &[("COLUMNS", "200")],
        &["compare", "--method", "bipolar", "--trials", "20", "--no-limit", "--force"],
        at,
    );
    let wide = String::from_utf8(wide.stdout).expect("text");
    assert!(wide.contains("limit °") && wide.contains(" J ") && !wide.contains("No room"), "{wide}");
    assert!(columns(&wide) > 100);
}

#[test]
fn law_what_is_simulated_is_said_first() {
    let folder = folder();
    fs::write(
        folder.path().join("s.toml"),
        "trials = 12\nerrors = \"harsh\"\ndetector.method = \"bipolar\"\n",
    )
    .expect("written");
    let text = said(&["run", "s.toml"], folder.path());
    assert!(
        text.starts_with("Simulating paper-5k5, bipolar, harsh errors, rotor locked, seed 1: 12 trials\n\n"),
        "{text}"
    );
    let text = said(&["sweep", "s.toml", "--vary", "sensors.noise=1 mA:9 mA:3", "--out", "o"], folder.path());
    assert!(
        text.replace('\n', " ").contains("3 points over sensors.noise (3 values), 12 trials at each"),
        "{text}"
    );
    // Nothing stands before JSON.
    let json = said(&["run", "s.toml", "--json", "--out", "j"], folder.path());
    assert!(serde_json::from_str::<serde_json::Value>(&json).is_ok(), "{json}");
}

#[test]
fn law_results_of_another_run_stay_unless_forced_and_their_page_says_that_it_is_old() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), "trials = 12\n").expect("written");
    said(&["run", "s.toml", "--out", "o"], at);
    said(&["report", "o"], at);
    let trials = || fs::read(at.join("o/trials.csv")).expect("trials");
    let page = || fs::read_to_string(at.join("o/report/report.html")).expect("the page");
    let (first, fresh) = (trials(), page());
    // The same run again, or its continuation, writes the same.
    said(&["run", "s.toml", "--out", "o"], at);
    assert!(said(&["run", "s.toml", "--out", "o", "--resume"], at).contains("nothing to do"));
    assert_eq!((trials(), page()), (first.clone(), fresh.clone()));
    for more in
        [&["--seed", "2"][..], &["--trials", "13"], &["-s", "errors=harsh"], &["--seed", "2", "--resume"]]
    {
        let message = mistake(&[&["run", "s.toml", "--out", "o"], more].concat(), at);
        assert!(message.contains("the results of another run") && message.contains("--force"), "{message}");
        assert_eq!(trials(), first);
    }
    // Shards of another run do not get there by way of `merge` either.
    for shard in ["1/2", "2/2"] {
        said(&["run", "s.toml", "--seed", "3", "--shard", shard, "--out", "p"], at);
    }
    for arguments in [&["merge", "p", "--out", "o"][..], &["reproduce", "--trials", "2", "--out", "o"]] {
        let message = mistake(arguments, at);
        assert!(message.contains("the results of a"), "{message}");
    }
    let text = said(&["run", "s.toml", "--out", "o", "--seed", "2", "--force"], at);
    assert!(text.contains("report/report.html, which is older"), "{text}");
    assert_ne!(trials(), first);
    assert!(page().contains("older than the data beside it") && !fresh.contains("older than the data"));
    said(&["report", "o"], at);
    assert!(!page().contains("older than the data"), "a new page is new");
    // What is no run's is not overwritten either.
    fs::create_dir(at.join("mine")).expect("made");
    fs::write(at.join("mine/summary.json"), "{}").expect("written");
    let message = mistake(&["run", "s.toml", "--out", "mine"], at);
    assert!(message.contains("not of `standstill run`"), "{message}");
}

#[test]
fn law_motors_and_scenarios_are_understood_in_each_others_place() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("motor.toml"), sheet(PLATES[1].1)).expect("written");
    fs::write(at.join("s.toml"), "motor = \"motor.toml\"\ntrials = 20\n").expect("written");
    // A data sheet as a scenario is the default one with that motor.
    for motor in ["motor.toml", "gimbal"] {
        let output =
            standstill(&["run", motor, "--trials", "20", "--out", motor.trim_end_matches(".toml")], at);
        let note = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && note.contains("is a motor, not a scenario"), "{note}");
    }
    said(&["run", "s.toml", "--out", "scenario"], at);
    let rows = |out: &str| fs::read_to_string(at.join(out).join("trials.csv")).expect("trials");
    assert_eq!(rows("motor"), rows("scenario"));
    // A scenario as a data sheet is its motor.
    for command in ["magnetics", "motors"] {
        let output = standstill(&[command, "s.toml", "--json"], at);
        let note = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(note.contains("is a scenario, not a data sheet: this is its motor"), "{command}: {note}");
        let mut both = [output.stdout, standstill(&[command, "motor.toml", "--json"], at).stdout]
            .map(|text| serde_json::from_slice::<serde_json::Value>(&text).expect("JSON"));
        both.iter_mut().filter_map(|json| json.as_object_mut()).for_each(|json| {
            json.remove("name");
        });
        assert_eq!(both[0], both[1], "{command}");
    }
    // Elsewhere it is named for what it is.
    fs::write(at.join("twice.toml"), "motor = \"s.toml\"\n").expect("written");
    fs::write(at.join("table.csv"), "i_d_A\n").expect("written");
    for (arguments, parts) in [
        (&["run", "twice.toml"][..], &["`s.toml`, which is a scenario", "motor.toml"][..]),
        (&["compare", "--motor", "s.toml"], &["`s.toml`, which is a scenario"]),
        (&["run", "table.csv"], &["found a table", "standstill magnetics"]),
        (&["run", "scenario"], &["the folder of a run", "standstill report scenario"]),
        (&["report", "s.toml"], &["found a file", "the folder of a finished run"]),
    ] {
        let message = mistake(arguments, at);
        assert!(parts.iter().all(|part| message.contains(part)), "{arguments:?}: {message}");
    }
}

#[test]
fn law_a_run_without_an_end_has_no_page_and_is_told_how_to_go_on() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), "trials = 12\n").expect("written");
    said(&["run", "s.toml", "--shard", "1/2", "--out", "parts"], at);
    let message = mistake(&["report", "parts"], at);
    assert!(
        message.contains("1 shards of a run") && message.contains("standstill status parts"),
        "{message}"
    );
    // As an interrupt leaves it: the journal of a shard of all has the format of that of a run.
    fs::create_dir(at.join("half")).expect("made");
    fs::copy(at.join("parts/shard-1-of-2.journal"), at.join("half/run.journal")).expect("copied");
    let message = mistake(&["report", "half"], at);
    for part in ["half/run.journal", "a run that is not finished", "of 12 trials", "--resume --out half"] {
        assert!(message.contains(part), "{message}");
    }
    let message = mistake(&["run", "s.toml", "--out", "half"], at);
    assert!(message.contains("--resume to go on") && message.contains("--force"), "{message}");
    assert!(said(&["run", "s.toml", "--out", "half", "--force"], at).contains("12 trials"));
}

#[test]
fn law_absurd_values_are_simulated_with_a_warning() {
    let folder = folder();
    let output =
        standstill(&["run", "paper-5k5", "--trials", "4", "-s", "sensors.noise=20 A"], folder.path());
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success());
    assert!(
        text.contains("warning: sensors.noise is 20 A, 2.5 times the motor's rated current of 8 A"),
        "{text}"
    );
}

#[test]
fn law_what_lies_beside_results_is_said() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), "trials = 20\ndetector.method = \"bipolar\"\n").expect("written");
    said(&["run", "s.toml", "--out", "o"], at);
    // A shard of another run does not go beside these results; one of the same run does.
    let shard = ["run", "s.toml", "--shard", "1/2", "--out", "o"];
    let message = mistake(&[&shard[..], &["-s", "errors=harsh"]].concat(), at);
    assert!(message.contains("the results of another run") && message.contains("--force"), "{message}");
    assert!(!at.join("o/shard-1-of-2.journal").exists());
    said(&shard, at);
    // More trials of it that were begun: their journal is that of a longer run that was cut short.
    said(&["run", "s.toml", "--out", "p"], at);
    let longer = ["run", "s.toml", "--trials", "400000", "--resume", "--out", "p"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_standstill"))
        .args(longer)
        .current_dir(at)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("it starts");
    let begun = std::time::Instant::now();
    while fs::metadata(at.join("p/run.journal")).map_or(0, |file| file.len()) < 20_000 {
        std::thread::sleep(std::time::Duration::from_millis(10));
        assert!(begun.elapsed() < std::time::Duration::from_secs(60), "no block was written");
    }
    child.kill().expect("SIGKILL");
    child.wait().expect("ended");
    for arguments in [&["report", "p"][..], &["explain", "p", "--trial", "3"]] {
        let output = standstill(arguments, at);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && error.contains("these results are being extended"), "{error}");
        assert!(error.contains("of 400000 trials are done") && error.contains("--resume --out p"), "{error}");
    }
    // Those of another run do not extend these results.
    said(&["run", "s.toml", "-s", "errors=harsh", "--out", "h"], at);
    fs::copy(at.join("p/run.journal"), at.join("h/run.journal")).expect("copied");
    let error = String::from_utf8_lossy(&standstill(&["report", "h"], at).stderr).into_owned();
    assert!(error.contains("being replaced by another run") && error.contains("--force --resume"), "{error}");
    // What is not read back is run again, and that is said.
    said(&["run", "s.toml", "--format", "npz", "--out", "n"], at);
    let output =
        standstill(&["run", "s.toml", "--trials", "30", "--resume", "--format", "npz", "--out", "n"], at);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && error.contains("trials.npz is not read back"), "{error}");
}
