//! One scenario, however it is told: by a file, by keys, by options that are shorthands for keys; and one trial of it.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::{folder, mistake, names, standstill};

fn succeed(arguments: &[&str], folder: &Path) -> String {
    let output = standstill(arguments, folder);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {message}");
    String::from_utf8(output.stdout).expect("text")
}

fn json(path: &Path) -> Value {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).expect("JSON")
}

/// A number of a JSON file as it is written, to the last bit.
fn number(path: &Path, key: &str) -> Option<f64> {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let (_, rest) =
        text.split_once(&format!("\n  \"{key}\": ")).unwrap_or_else(|| panic!("no {key} in {text}"));
    rest.split([',', '\n']).next().and_then(|number| number.parse().ok())
}

#[test]
fn law_options_keys_and_files_are_the_same_scenario() {
    let folder = folder();
    let at = folder.path();
    let options = [
        "--motor",
        "slot-harmonics",
        "--errors",
        "harsh",
        "--rotor",
        "free",
        "--load",
        "0.25",
        "--seed",
        "7",
        "--decay",
        "fast",
        "--winding-temperature",
        "71.5",
        "--magnet-temperature",
        "60",
    ];
    let keys = [
        "motor=slot-harmonics",
        "errors=harsh",
        "rotor.state=free",
        "rotor.load=0.25 N m",
        "seed=7",
        "detector.method=line-inductance-fast",
        "rotor.winding_temperature=71.5",
        "rotor.magnet_temperature=60 °C",
    ];
    let keys: Vec<&str> = keys.into_iter().flat_map(|key| ["-s", key]).collect();
    fs::write(
        at.join("s.toml"),
        "motor = \"slot-harmonics\"\nerrors = \"harsh\"\nseed = 7\ntrials = 12\n\
         [rotor]\nstate = \"free\"\nload = \"0.25 N m\"\nwinding_temperature = 71.5\nmagnet_temperature = 60\n\
         [detector]\nmethod = \"line-inductance-fast\"\nsignature = \"normal\"\n",
    )
    .expect("written");
    let trials = |out: &str| fs::read_to_string(at.join(out).join("trials.csv")).expect("trials.csv");
    succeed(&[&["reproduce", "--trials", "12", "--out", "options"], &options[..]].concat(), at);
    succeed(&[&["reproduce", "--trials", "12", "--out", "keys"], &keys[..]].concat(), at);
    succeed(&["reproduce", "s.toml", "--out", "file"], at);
    assert_eq!(trials("options"), trials("keys"));
    assert_eq!(trials("options"), trials("file"));
    succeed(&["reproduce", "s.toml", "--out", "other", "-s", "errors=default"], at);
    assert_ne!(trials("options"), trials("other"));
    // As `run` has it: its rows have a column more.
    succeed(&["run", "s.toml", "--out", "run"], at);
    for (a, b) in trials("options").lines().zip(trials("run").lines()) {
        assert!(b.starts_with(a), "{a}\n{b}");
    }
    let result = |out: &str| json(&at.join(out).join("result.json"));
    succeed(&[&["trace", "--angle", "77", "--out", "t-options"], &options[..]].concat(), at);
    succeed(&[&["trace", "--out", "t-keys", "-s", "rotor.angle=77 deg"], &keys[..]].concat(), at);
    for key in ["true_angle_deg", "error_deg", "peak_current_A", "energy_J", "setup", "specimen"] {
        assert_eq!(result("t-options")[key], result("t-keys")[key], "{key}");
    }
    let compare = ["compare", "--json", "--method", "line-inductance-fast", "--trials", "3"];
    let conditions = ["--rotor", "free", "--errors", "harsh", "--motor", "slot-harmonics", "--seed", "7"];
    let more = ["--signature", "normal", "--load", "0.25", "--winding-temperature", "71.5"];
    let by_options =
        succeed(&[&compare[..], &conditions, &more, &["--magnet-temperature", "60"]].concat(), at);
    assert_eq!(by_options, succeed(&[&compare[..], &["s.toml"]].concat(), at));
    assert_ne!(by_options, succeed(&[&compare[..], &["s.toml", "-s", "sensors.noise=80 mA"]].concat(), at));
}

#[test]
fn golden_reproduce_is_a_shipped_scenario() {
    let folder = folder();
    let at = folder.path();
    let shipped = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/reproduce.toml");
    succeed(&["reproduce", "--trials", "20", "--out", "plain"], at);
    succeed(&["reproduce", shipped, "--trials", "20", "--out", "file"], at);
    for name in names(&at.join("plain")) {
        let read = |out: &str| fs::read(at.join(out).join(&name)).expect("readable");
        assert_eq!(read("plain"), read("file"), "{name}");
    }
    let summary = json(&at.join("plain/summary.json"));
    assert_eq!(summary["trials_asked_for"], 20);
    assert!(fs::read_to_string(shipped).expect("shipped").contains("trials = 10000"));
}

const SWEEP: &str = r#"
trials = 40
errors = "harsh"
[rotor]
state = "free"
[inverter]
ripple = "2 %"
[axes]
"sensors.noise" = { from = "1 mA", to = "40 mA", points = 2 }
"detector.method" = ["bipolar", "line-inductance-fast"]
[tolerances]
"motor.winding.resistance" = { normal = "5 %", truncated = 3 }
"inverter.dead_time" = { uniform = "200 ns", mean = "2 us" }
"#;

/// promise: any-trial-again
#[test]
fn law_a_trace_is_the_campaigns_trial_to_the_last_bit() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), SWEEP).expect("written");
    succeed(&["run", "s.toml", "--out", "r"], at);
    let mut rows = csv::Reader::from_path(at.join("r/trials.csv")).expect("CSV");
    let header = rows.headers().expect("a header").clone();
    let rows: Vec<csv::StringRecord> = rows.records().map(|row| row.expect("a row")).collect();
    let points = json(&at.join("r/summary.json"))["points"].clone();
    let mut gains = Vec::new();
    for (point, trial) in [(0, 0), (1, 17), (2, 17), (3, 39)] {
        let [p, n] = [point, trial].map(|number: usize| number.to_string());
        let text = succeed(&["trace", "s.toml", "--point", &p, "--trial", &n, "--out", "t", "--force"], at);
        let result = json(&at.join("t/result.json"));
        let row = &rows[40 * point + trial];
        let cell = |name: &str| &row[header.iter().position(|column| column == name).expect("a column")];
        for (column, key) in [
            ("true_angle_deg", "true_angle_deg"),
            ("start_angle_deg", "start_angle_deg"),
            ("estimated_angle_deg", "estimated_angle_deg"),
            ("error_deg", "error_deg"),
            ("axis_deg", "axis_deg"),
            ("rotor_moved_deg", "rotor_moved_deg"),
            ("duration_s", "duration_s"),
            ("peak_current_a", "peak_current_A"),
        ] {
            let expected = cell(column).parse::<f64>().ok().map(f64::to_bits);
            let found = number(&at.join("t/result.json"), key).map(f64::to_bits);
            assert_eq!(found, expected, "{column}, {p} {n}: {row:?}");
        }
        assert_eq!(result["outcome"], cell("outcome"));
        assert_eq!((&result["point"]["number"], &result["trial"]), (&point.into(), &trial.into()));
        let noise = points[point]["values"]["sensors.noise"].as_f64().expect("a number");
        assert_eq!(result["point"]["values"]["sensors.noise"], if noise < 0.002 { "1 mA" } else { "40 mA" });
        assert_eq!(result["method"], points[point]["values"]["detector.method"]);

        let specimen = &result["specimen"];
        let resistance = specimen["tolerances"]["motor.winding.resistance"].as_str().expect("a text");
        // The file has all digits, the text those that people read.
        let read = resistance.get(..4).expect("four digits");
        assert!(resistance.ends_with('Ω') && text.contains(read), "{resistance}: {text}");
        for part in [
            "trial ",
            "(of 0 to 3)",
            "sensors.noise = ",
            "rotor starts at",
            "current gains",
            "current offsets",
            "switch-on delays",
            "ripple begins at",
            "inverter.dead_time",
            "mA (phases a, b, c)",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        gains.push(specimen["current_gain"][0].as_f64().expect("a number"));
    }
    // Trials of the same number have the same specimen, and others have others.
    assert_eq!(gains[1], gains[2]);
    assert!(gains[0] != gains[1] && gains[1] != gains[3], "{gains:?}");
    let message = mistake(&["trace", "s.toml", "--point", "4", "--out", "u"], at);
    assert!(message.contains("--point 4") && message.contains("from 0 to 3"), "{message}");
    assert!(!at.join("u").exists());
}

#[test]
fn law_axes_of_the_command_line_have_points_to_trace() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), "trials = 3\n[detector]\nmethod = \"bipolar\"\n").expect("written");
    let vary = ["--vary", "inverter.dead_time=1 us:3 us:3"];
    succeed(&[&["sweep", "s.toml", "--out", "r"], &vary[..]].concat(), at);
    succeed(&[&["trace", "s.toml", "--point", "2", "--trial", "1", "--out", "t"], &vary[..]].concat(), at);
    let trials = fs::read_to_string(at.join("r/trials.csv")).expect("trials.csv");
    let error: f64 =
        trials.lines().nth(8).and_then(|row| row.split(',').nth(4)?.parse().ok()).expect("a row");
    assert_eq!(number(&at.join("t/result.json"), "error_deg"), Some(error));

    // An option for the key of an axis would do nothing.
    for option in [["-s", "inverter.dead_time=5 us"], ["--seed", "7"]] {
        let axes = ["--vary", "inverter.dead_time=1 us:3 us:3", "--vary", "seed=1,2"];
        let refused = standstill(&[&["trace", "s.toml", "--out", "x"], &option[..], &axes[..]].concat(), at);
        let message = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(refused.status.code() == Some(2) && message.contains("is an axis"), "{message}");
        assert!(!at.join("x").exists());
    }
}

#[test]
fn law_a_method_by_its_key_is_the_one_by_its_option() {
    let folder = folder();
    let at = folder.path();
    let trace = |method: &[&str], out: &str| {
        let common = ["trace", "--motor", "pm-reluctance", "--angle", "40", "--out", out];
        succeed(&[&common[..], method].concat(), at);
        number(&at.join(out).join("result.json"), "error_deg")
    };
    let by_option = trace(&["--method", "bipolar"], "option");
    assert!(by_option.is_some_and(|error| error.abs() < 10.0), "{by_option:?}");
    assert_eq!(trace(&["-s", "detector.method=bipolar"], "key"), by_option);
}

#[test]
fn law_check_takes_a_scenario_file_and_keys() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("s.toml"), "motor = \"light-vehicle\"\n[sensors]\nnoise = \"1 A\"\n").expect("written");
    let check = |more: &[&str]| {
        let output = standstill(&[&["check", "--json", "-s", "detector.method=bipolar"], more].concat(), at);
        let mut answer: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        // It names what was asked about.
        answer.as_object_mut().expect("an object").remove("next").expect("what goes on");
        answer
    };
    let by_file = check(&["s.toml"]);
    assert_eq!(by_file, check(&["light-vehicle", "-s", "sensors.noise=1 A"]));
    assert!(by_file != check(&["light-vehicle"]));
    let one = by_file;
    assert_eq!(one["candidates"].as_array().map(Vec::len), Some(1));
    assert_eq!(one["candidates"][0]["method"], "bipolar");
}

#[test]
fn law_mistakes_in_scenarios_of_other_commands_are_named() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("axes.toml"), "[axes]\n\"sensors.noise\" = [\"1 mA\"]\n").expect("written");
    fs::write(at.join("bipolar.toml"), "[detector]\nmethod = \"bipolar\"\npulse = \"90 us\"\n")
        .expect("written");
    let before = names(at);
    let cases: [(&[&str], &[&str]); 9] = [
        (&["reproduce", "axes.toml"], &["axes.toml: line 1: `axes`", "needed a scenario without"]),
        (&["compare", "axes.toml"], &["axes.toml: line 1: `axes`", "standstill sweep"]),
        (&["check", "axes.toml"], &["axes.toml: line 1: `axes`"]),
        (
            &["reproduce", "bipolar.toml"],
            &["bipolar.toml: line 2: `detector.method`", "line-inductance-fast"],
        ),
        (&["reproduce", "none.toml"], &["cannot read none.toml"]),
        (&["trace", "none.toml", "--out", "t"], &["cannot read none.toml"]),
        (&["compare", "-s", "sensors.noize=1 mA"], &["set on the command line: `sensors.noize`", "`noise`"]),
        (
            &["compare", "bipolar.toml", "--method", "hfi-rotating"],
            &["`detector.pulse`: found with --method hfi-rotating", "allowed: line-inductance"],
        ),
        (
            &["trace", "bipolar.toml", "--method", "hfi-rotating", "--out", "t"],
            &["bipolar.toml: line 3", "`detector.pulse`"],
        ),
    ];
    for (arguments, parts) in cases {
        let message = mistake(arguments, at);
        for part in parts {
            assert!(message.contains(part), "{arguments:?} says: {message}");
        }
        assert_eq!(names(at), before, "{arguments:?} left something behind");
    }
}
