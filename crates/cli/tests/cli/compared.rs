//! `report` of two runs, and docs/answers.md as it is printed.

use std::fs;

use serde_json::Value;

use super::answers::SCENARIO;
use super::{folder, mistake, names, quiet, standstill};

/// Words as a shell has them: quotes hold them together.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut open, mut quote): (Vec<String>, bool, Option<char>) = (Vec::new(), false, None);
    for c in line.chars() {
        match (quote, c) {
            (Some(mark), c) if c == mark => quote = None,
            (None, '"' | '\'') => {
                quote = Some(c);
                if !std::mem::replace(&mut open, true) {
                    words.push(String::new());
                }
            }
            (None, c) if c.is_whitespace() => open = false,
            (_, c) => {
                if !std::mem::replace(&mut open, true) {
                    words.push(String::new());
                }
                if let Some(word) = words.last_mut() {
                    word.push(c);
                }
            }
        }
    }
    words
}

/// Each command of the page, with few trials; the line below it that says what it speaks of is what the program says.
#[test]
fn golden_the_commands_of_the_page_on_answers_run_as_they_are_printed() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/answers.md");
    let page = fs::read_to_string(page).expect("the page").replace("\\\n", " ");
    let folder = folder();
    let path = folder.path();
    let scenario = format!("{SCENARIO}errors = \"default\"\n")
        .replace("detector.method", "trials = 300\ndetector.method");
    for name in ["scenario.toml", "lif.toml"] {
        fs::write(path.join(name), &scenario).expect("written");
    }
    let bipolar = scenario.replace("line-inductance-fast", "bipolar") + "rotor.state = \"free\"\n";
    fs::write(path.join("bipolar.toml"), bipolar).expect("written");
    fs::write(path.join("free.toml"), scenario.clone() + "rotor.state = \"free\"\n").expect("written");
    for (seed, out) in [("1", "scenario-run"), ("1", "before"), ("1", "after")] {
        let out = format!("standstill-out/{out}");
        assert!(standstill(&["run", "lif.toml", "--seed", seed, "--out", &out], path).status.success());
    }
    let few = |command: &str| -> &[&str] {
        match command {
            "odds" => &["--effort", "quick"],
            "budget" => &["--pairs", "100"],
            "require" => &["--most", "100"],
            "tune" => &["--trials", "1000", "--starts", "1"],
            _ => &[],
        }
    };
    let lines: Vec<&str> = page.split("```").skip(1).step_by(2).flat_map(str::lines).collect();
    let mut run = 0;
    for (number, line) in lines.iter().enumerate() {
        let printed = line.strip_prefix("$ ").unwrap_or(line).split(" #").next().unwrap_or_default();
        let Some(command) = printed.strip_prefix("standstill ") else { continue };
        // What is rare takes a minute; what is not takes a second. So do long pulses, and many of them.
        let shorter = [
            ("5.1 deg", "1 deg"),
            ("unanswered <= 0.1 %", "unanswered <= 5 %"),
            ("--vary detector.pulse=50us:400us ", ""),
            ("--vary detector.pulse=20us:400us ", ""),
            ("rounds=2:8", "rounds=2:3"),
            ("rounds=1:8", "rounds=1:2"),
            (" --vary detector.rest=1.05:1.2", ""),
        ];
        let command =
            shorter.iter().fold(command.to_owned(), |text, (long, short)| text.replace(long, short));
        let mut all = words(&command);
        let more = few(&all[0]);
        // The page's own numbers of trials are given up.
        for option in more.iter().step_by(2) {
            if let Some(place) = all.iter().position(|word| word == option) {
                all.drain(place..place + 2);
            }
        }
        let all: Vec<&str> = all.iter().map(String::as_str).chain(more.iter().copied()).collect();
        let output = standstill(&all, path);
        let told = String::from_utf8_lossy(&output.stdout).into_owned();
        // Settings that few trials cannot tell to be better are an answer too, with code 1.
        let fine = output.status.success() || output.status.code() == Some(1);
        assert!(fine && quiet(&output), "{all:?}: {}", String::from_utf8_lossy(&output.stderr));
        if line.starts_with("$ ") {
            let setting = lines[number + 1];
            assert!(told.contains(setting), "{all:?}: {setting} in {told}");
        }
        run += 1;
    }
    assert_eq!(run, 10, "commands of the page");
}

#[test]
fn law_two_runs_are_compared_trial_by_trial_where_they_share_the_seed() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let run = |out: &str, more: &[&str]| {
        let all = [&["run", "s.toml", "--trials", "600", "--out", out], more].concat();
        assert!(standstill(&all, path).status.success());
    };
    run("a", &[]);
    run("b", &["-s", "sensors.noise=12 mA"]);
    run("c", &["-s", "sensors.noise=12 mA", "--seed", "2", "--format", "parquet"]);
    run("d", &["--rows", "none"]);
    run("e", &["--format", "npz"]);
    let compared = |a: &str, b: &str| {
        let output = standstill(&["report", a, b, "--out", "both", "--force"], path);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let rows = fs::read_to_string(path.join("both/comparison.csv")).expect("the table");
        let rms: Vec<String> = rows.lines().nth(2).expect("rms").split(',').map(str::to_owned).collect();
        let text = String::from_utf8(output.stdout).expect("text");
        // Lines are as wide as a terminal.
        (text.split_whitespace().collect::<Vec<_>>().join(" "), rms)
    };
    let (text, paired) = compared("a", "b");
    let number = |row: &[String], k: usize| row[k].parse::<f64>().expect("a number");
    for part in ["B is worse: it is less exact; rms", "600 pairs", "sensors.noise", "12 mA", "seed 1"] {
        assert!(text.contains(part), "{part} in {text}");
    }
    // The rms of each is that of its own summary, and the difference theirs.
    for (k, out) in [(2, "a"), (5, "b")] {
        let summary = fs::read_to_string(path.join(out).join("summary.json")).expect("summary.json");
        let summary: Value = serde_json::from_str(&summary).expect("JSON");
        assert_eq!(summary["summary"]["rms_deg"]["value"].as_f64(), Some(number(&paired, k)));
    }
    assert!((number(&paired, 5) - number(&paired, 2) - number(&paired, 8)).abs() < 1e-9);
    assert_eq!(paired[11], "600");
    // Independent random numbers tell far less.
    let (text, alone) = compared("a", "c");
    assert!(text.contains("independent runs: their seeds are 1 and 2") && text.contains("seed"), "{text}");
    let width = |row: &[String]| number(row, 10) - number(row, 9);
    assert!(width(&alone) > 2.0 * width(&paired), "{} {}", width(&alone), width(&paired));
    let (text, same) = compared("a", "a");
    assert!(text.contains("no difference shown") && text.contains("No setting differs"), "{text}");
    assert_eq!((number(&same, 8), number(&same, 9), number(&same, 10)), (0.0, 0.0, 0.0));
    assert_eq!(
        names(&path.join("both")),
        ["comparison.csv", "comparison.html", "comparison.json", "comparison.png", "comparison.svg"]
    );
    // What cannot be read names what is there.
    assert!(mistake(&["report", "a", "d"], path).contains("statistics alone (--rows none)"));
    for command in [&["report", "e"][..], &["report", "a", "e"], &["explain", "e"]] {
        let message = mistake(command, path);
        assert!(message.contains("trials.npz") && message.contains("--format csv"), "{message}");
    }
    // Axes with other points cannot stand side by side.
    let sweep = ["sweep", "s.toml", "--trials", "60", "--vary", "sensors.noise=5 mA,10 mA,20 mA"];
    for (out, more) in [("f", &[][..]), ("g", &["-s", "sensors.gain_error=1 %"])] {
        assert!(standstill(&[&sweep[..], more, &["--out", out]].concat(), path).status.success());
    }
    assert!(mistake(&["report", "a", "f"], path).contains("axes with other points"));
    let (text, _) = compared("f", "g");
    assert!(text.contains("Of 3 points B is worse at 3"), "{text}");
}

/// The root mean square of the errors of a run's first trials.
fn rms_of_first(count: usize, trials: &std::path::Path) -> f64 {
    let text = fs::read_to_string(trials).expect("trials.csv");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let place = lines.next().expect("a header").split(',').position(|name| name == "axis_error_deg");
    let error = |line: &str| line.split(',').nth(place.expect("its column"))?.parse::<f64>().ok();
    let errors: Vec<f64> = lines.take(count).filter_map(error).collect();
    (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn regress_runs_of_other_lengths_are_compared_on_the_trials_that_both_have() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    for (out, more) in [
        ("a", &["--trials", "400"][..]),
        ("b", &["--trials", "300", "-s", "sensors.noise=12 mA"]),
        ("c", &["--trials", "300", "--seed", "2"]),
    ] {
        assert!(standstill(&[&["run", "s.toml", "--out", out], more].concat(), path).status.success());
    }
    let compared = |b: &str| {
        let output = standstill(&["report", "a", b, "--out", "both", "--force"], path);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).expect("text");
        let table = fs::read_to_string(path.join("both/comparison.csv")).expect("the table");
        let rows = table.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect());
        (text.split_whitespace().collect::<Vec<_>>().join(" "), rows.collect::<Vec<Vec<String>>>())
    };
    let (text, rows) = compared("b");
    assert!(text.contains("A has 400 trials, B 300: every figure is of the trials that both have"), "{text}");
    assert!(text.contains("paired") && text.contains("300 pairs"), "{text}");
    let counts = [2, 5, 11].map(|k: usize| rows[0][k].parse::<f64>().ok());
    assert_eq!((rows[0][1].as_str(), counts), ("trials", [Some(400.0), Some(300.0), Some(300.0)]));
    let number = |k: usize| rows[1][k].parse::<f64>().expect("a number");
    // A's figure is that of its first 300, so that the difference is that of the figures beside it.
    let first = rms_of_first(300, &path.join("a/trials.csv"));
    assert!((number(2) / first - 1.0).abs() < 1e-9, "{} {first}", number(2));
    assert!((rms_of_first(400, &path.join("a/trials.csv")) / first - 1.0).abs() > 1e-4);
    assert!((number(5) - number(2) - number(8)).abs() < 1e-9);
    // Of other seeds each has its own, and it says so.
    let (text, rows) = compared("c");
    assert!(text.contains("A has 400 trials, B 300: each figure is of its own run's"), "{text}");
    assert!(text.contains("unpaired: differences of independent runs: their seeds are 1 and 2"), "{text}");
    assert_eq!((rows[0][11].as_str(), rows[1][11].as_str()), ("", ""));
    let summary = fs::read_to_string(path.join("a/summary.json")).expect("summary.json");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    assert_eq!(summary["summary"]["rms_deg"]["value"].as_f64(), rows[1][2].parse().ok());
}

/// Rows of a comparison in JSON: the values of a measure at a point.
fn measured(json: &Value, point: &str, measure: &str) -> Value {
    let rows = json["rows"].as_array().expect("rows");
    let of = |row: &&Value| {
        row["point"].as_str().is_some_and(|it| it.contains(point)) && row["measure"] == measure
    };
    rows.iter().find(of).cloned().unwrap_or_else(|| panic!("{measure} at {point} in {json:#}"))
}

#[test]
fn regress_errors_are_compared_where_both_runs_found_an_axis() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    for out in ["a", "b"] {
        assert!(standstill(&["run", "s.toml", "--trials", "300", "--out", out], path).status.success());
    }
    // The trial of the largest error finds no axis in B: all others are the same.
    let trials = path.join("b/trials.csv");
    let text = fs::read_to_string(&trials).expect("trials.csv");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let header = lines.iter().position(|line| line.starts_with("trial,")).expect("a header");
    let places: Vec<String> = lines[header].split(',').map(str::to_owned).collect();
    let place = |name: &str| places.iter().position(|place| place == name).expect("a column");
    let error = |line: &str| line.split(',').nth(place("axis_error_deg")).and_then(|e| e.parse::<f64>().ok());
    let worst = (header + 1..lines.len())
        .max_by(|a, b| {
            let size = |k: usize| error(&lines[k]).map_or(0.0, f64::abs);
            size(*a).total_cmp(&size(*b))
        })
        .expect("trials");
    let mut cells: Vec<String> = lines[worst].split(',').map(str::to_owned).collect();
    for name in ["estimated_angle_deg", "error_deg", "axis_deg", "axis_error_deg", "pole_correct"] {
        cells[place(name)].clear();
    }
    cells[place("outcome")] = "failed".to_owned();
    lines[worst] = cells.join(",");
    fs::write(&trials, lines.join("\n") + "\n").expect("written");
    // As an earlier version left it, without digests: this table is made up.
    let summary = path.join("b/summary.json");
    let mut without: Value =
        serde_json::from_str(&fs::read_to_string(&summary).expect("a summary")).expect("JSON");
    for digest in ["tables", "digest"] {
        without.as_object_mut().expect("an object").remove(digest).expect("digests");
    }
    fs::write(&summary, without.to_string()).expect("written");
    let output = standstill(&["report", "a", "b", "--json"], path);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    // Nothing is written without --out.
    assert!(!path.join("a/report").exists());
    for measure in ["rms", "p95"] {
        let row = measured(&json, "", measure);
        assert_eq!((&row["a"], &row["pairs"]), (&row["b"], &299.into()), "{measure}");
        assert_eq!(row["difference"].as_f64(), Some(0.0), "{measure}");
    }
    let all = rms_of_first(300, &path.join("a/trials.csv"));
    assert!(measured(&json, "", "rms")["a"].as_f64().expect("rms") < all * (1.0 - 1e-3));
    assert_eq!(measured(&json, "", "failed")["pairs"], 300);
    let notes = json["notes"].to_string();
    assert!(
        notes.contains("rms and p95 are of the 299 of 300 trials in which both found an axis"),
        "{notes}"
    );
}

#[test]
fn regress_sweeps_are_compared_at_the_points_that_both_have() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    for (out, values) in [("a", "5 mA,10 mA,20 mA"), ("b", "20 mA,10 mA,40 mA")] {
        let vary = format!("sensors.noise={values}");
        let sweep = ["sweep", "s.toml", "--trials", "60", "--vary", &vary, "--out", out];
        assert!(standstill(&sweep, path).status.success());
    }
    let output = standstill(&["report", "a", "b", "--json", "--out", "both"], path);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(fs::read(path.join("both/comparison.json")).expect("written"), output.stdout);
    assert!(
        json["notes"].to_string().contains("A has 3 points, B 3: compared are the 2 that both have"),
        "{json:#}"
    );
    // The same points of the same seed are the same trials, wherever they stand.
    for point in ["10 mA", "20 mA"] {
        let row = measured(&json, point, "rms");
        assert_eq!((&row["a"], row["difference"].as_f64()), (&row["b"], Some(0.0)), "{point}");
    }
    assert!(json["rows"].as_array().expect("rows").iter().all(|row| row["point"] != "sensors.noise = 40 mA"));
    assert_eq!(json["settings"][0]["key"], "axes.sensors.noise");
}

#[test]
fn regress_a_method_that_answers_few_starts_does_not_look_good() {
    let folder = folder();
    let path = folder.path();
    let compare = ["compare", "--method", "bipolar,hfi-rotating", "--rotor", "locked", "--errors", "default"];
    let noise = |noise: &str, out: &str| {
        let all = [&compare[..], &["--trials", "20", "--no-limit", "-s", noise, "--out", out]].concat();
        let output = standstill(&all, path);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let read = |name: &str| fs::read_to_string(path.join(out).join(name)).expect("written");
        (String::from_utf8(output.stdout).expect("text"), read("comparison.csv"), read("comparison.svg"))
    };
    // No pole is certain with so much noise: all errors are of starts without an answer.
    let (text, table, figure) = noise("sensors.noise=80 mA", "noisy");
    assert!(text.contains("right"), "{text}");
    let right = table.lines().next().and_then(|head| head.split(',').position(|name| name == "right"));
    let shares: Vec<f64> = table
        .lines()
        .skip(1)
        .map(|row| {
            row.split(',').nth(right.expect("a column")).and_then(|x| x.parse().ok()).expect("a share")
        })
        .collect();
    assert!(shares[0] == 0.0 && shares[1] > 0.5, "{shares:?}");
    assert!(figure.contains("bipolar, 0 % right") && figure.contains("ring: more than 1 %"), "{figure}");
    // Where all are answered there is nothing to warn of.
    let (_, _, figure) = noise("sensors.noise=1 mA", "quiet");
    assert!(!figure.contains("right"), "{figure}");
}
