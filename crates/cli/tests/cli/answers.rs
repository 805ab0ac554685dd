//! `odds`, `budget`, `require`, `tune` and `explain`.

use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use super::{folder, mistake, names, standstill};

pub const SCENARIO: &str = "motor = \"paper-5k5\"\ndetector.method = \"line-inductance-fast\"\n";

pub fn answer(arguments: &[&str], code: i32, folder: &std::path::Path) -> Value {
    let output = standstill(arguments, folder);
    assert_eq!(output.status.code(), Some(code), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(super::quiet(&output), "quiet in a pipe");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// The keys that scripts rely on.
fn has(value: &Value, keys: &[&str]) {
    for key in keys {
        assert!(value.get(key).is_some(), "{key} in {value}");
    }
}

pub fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} of {value}"))
}

#[test]
fn odds_of_what_is_not_rare_are_those_of_plain_trials_on_any_number_of_threads() {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENARIO).expect("written");
    let arguments = ["odds", "s.toml", "--event", "|e| > 1 deg", "--json"];
    let one = answer(&[&arguments[..], &["--threads", "1"]].concat(), 0, folder.path());
    assert_eq!(one, answer(&[&arguments[..], &["--threads", "3"]].concat(), 0, folder.path()));
    has(&one, &["event", "probability", "low", "high", "trials", "levels"]);
    let (low, high) = (number(&one, "low"), number(&one, "high"));
    assert!(low < 0.24 && 0.22 < high && high - low < 0.02, "{low} to {high}");
    assert_eq!((&one["event"], &one["levels"]), (&"|e| > 1 deg".into(), &1.into()));
    assert_eq!(number(&one, "trials"), 32_000.0);
    assert_eq!(names(folder.path()), ["s.toml"], "with --json no files");
}

#[test]
fn a_budget_has_its_keys_and_writes_its_files() {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENARIO).expect("written");
    let arguments = ["budget", "s.toml", "--pairs", "200", "--json", "--out", "b"];
    let budget = answer(&arguments, 0, folder.path());
    assert!((0.6..1.1).contains(&number(&budget, "rms_deg")));
    let sources = budget["sources"].as_array().expect("a list");
    let share: f64 = sources.iter().map(|source| number(source, "share")).sum();
    assert!((share - 1.0).abs() < 1e-9, "{share}");
    // The page says of what it is, and how to make it again.
    let page = fs::read_to_string(folder.path().join("b/budget.html")).expect("a page");
    for part in [
        "paper-5k5",
        "inverter.dead_time",
        "winding.resistance",
        "standstill budget scenario.toml --pairs 200",
    ] {
        assert!(page.contains(part), "{part}");
    }
    for name in ["method", "sensors.noise", "sensors.gain_error", "sensors.bits", "interaction"] {
        let source = sources.iter().find(|source| source["source"] == name).expect(name);
        has(
            source,
            &["source", "alone_rms_deg", "without_rms_deg", "share", "share_low", "share_high", "total"],
        );
        assert!(number(source, "share_low") <= number(source, "share_high"));
        let end = |of: &str, end: &str| source[format!("{of}_{end}_deg")].as_f64();
        let wide = |of: &str| end(of, "low") < end(of, "high");
        assert!(name == "interaction" || wide("alone_rms") && wide("without_rms"), "{source}");
    }
    let expected = [
        "budget.csv",
        "budget.html",
        "budget.json",
        "budget.png",
        "budget.svg",
        "over_angle.png",
        "over_angle.svg",
    ];
    assert_eq!(names(&folder.path().join("b")), expected);
}

#[test]
fn a_requirement_is_an_edge_or_an_answer_with_code_1() {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENARIO).expect("written");
    let require = |limit: &str, more: &[&str], code: i32| {
        let arguments = ["require", "s.toml", "--key", "sensors.noise", "--limit", limit, "--json"];
        answer(&[&arguments[..], more].concat(), code, folder.path())
    };
    // Noise of 10 mA makes 0.84°; the gains alone 0.63°.
    let edge = require("rms <= 1 deg", &["--between", "2 mA:50 mA", "--most", "4000"], 0);
    let (low, value, high) = (number(&edge, "low"), number(&edge, "value"), number(&edge, "high"));
    assert!(0.010 < value && value <= high && high < 0.020, "{edge}");
    // Of 4,000 starts up to 0.09 % may be without an answer, which make 2.7°: surely it holds nowhere.
    assert_eq!((low, &edge["without_answer"]["decide"]), (0.002, &"interval".into()), "{edge}");
    has(&edge, &["key", "value", "low", "high", "limit"]);
    assert_eq!((&edge["key"], &edge["limit"]), (&"sensors.noise".into(), &"rms <= 1 deg".into()));
    let none = require("rms <= 0.1 deg", &["--between", "5 mA:50 mA"], 1);
    assert!(none["value"].is_null() && none["answer"] == "no value meets it");
    let all = require("rms <= 60 deg", &["--between", "5 mA:20 mA"], 1);
    assert_eq!(all["answer"], "every value meets it");
}

#[test]
fn tuning_recovers_what_was_spoiled_and_judges_on_fresh_seeds() {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENARIO).expect("written");
    let arguments = [
        "tune",
        "s.toml",
        "-s",
        "detector.pulse=40 us",
        "-s",
        "detector.rounds=1",
        "--vary",
        "detector.pulse=20us:200us",
        "--vary",
        "detector.rounds=1:4",
        "--minimise",
        "rms",
        "--subject-to",
        "duration <= 26 ms, undetermined <= 2 %",
        "--trials",
        "1600",
        "--starts",
        "2",
        "--json",
        "--out",
        "t",
    ];
    let tuned = answer(&arguments, 0, folder.path());
    has(&tuned, &["settings", "start", "best"]);
    let rms = |of: &str| number(&tuned[of]["measures"]["rms"], "value");
    // The default's pulse and rounds make 0.84°.
    assert!(rms("start") > 1.8 && rms("best") < 1.05 * 0.84, "{} to {}", rms("start"), rms("best"));
    // Of 1600 starts up to 0.23 % may lack an answer unseen, which make 4.3° of rms.
    assert!(tuned["surely_better"] == false && tuned["unseen"].is_object());
    assert_eq!(tuned["limits_hold"]["likely"], true);
    assert_eq!(tuned["start"]["settings"]["detector.pulse"], 40e-6);
    assert_eq!(tuned["settings"], tuned["best"]["settings"]);
    assert_eq!(tuned["judged_on_seed"], 3);
    let duration = number(&tuned["best"]["measures"]["duration"], "value");
    assert!(duration <= 26e-3, "{duration}");
    // What is to be copied is what was judged: `run` finds the same on the seed that is named.
    fs::write(
        folder.path().join("best.toml"),
        format!("{SCENARIO}{}", tuned["toml"].as_str().expect("text")),
    )
    .expect("written");
    let again = ["run", "best.toml", "--trials", "1600", "--seed", "3", "--json", "--out", "r"];
    let again = answer(&again, 0, folder.path());
    let found = number(&again["summary"]["rms_deg"], "value");
    assert!((found / rms("best") - 1.0).abs() < 1e-6, "{found} and {}", rms("best"));
    assert_eq!(
        names(&folder.path().join("t")),
        ["tune.csv", "tune.html", "tune.json", "tune.png", "tune.svg"]
    );
    // What the figure compares is of one seed, and what the search looked at is said to be of another.
    let page = fs::read_to_string(folder.path().join("t/tune.html")).expect("a page");
    for label in
        ["none better in both, by seed 3", "start, by seed 3", "best, by seed 3", "looked at, by seed 1"]
    {
        assert!(page.contains(label), "{label}");
    }
    let front = tuned["front"].as_array().expect("a list");
    assert!(front.contains(&tuned["best"]), "the best is one of the front, on the same trials");
}

#[test]
fn a_trial_is_explained_as_it_was_and_by_what_it_drew() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    assert!(standstill(&["run", "s.toml", "--trials", "300", "--out", "r"], path).status.success());
    let trials = fs::read_to_string(path.join("r/trials.csv")).expect("trials.csv");
    let axis_error = |line: &str| line.split(',').nth(9).and_then(|cell| cell.parse::<f64>().ok());
    let worst = trials.lines().skip(1).filter_map(axis_error).map(f64::abs).fold(0.0, f64::max);
    let told = answer(&["explain", "r", "--json", "--out", "e"], 0, path);
    let trial = &told["trials"][0];
    let error = number(&trial["ended"], "axis_error_deg");
    assert!((error.abs() - worst).abs() < 1e-9, "{error} and {worst}");
    let causes = trial["causes"].as_array().expect("a list");
    let cause = |name: &str| causes.iter().find(|cause| cause["error"] == name).expect(name);
    for name in ["gain of a", "gain of b", "gain of c", "noise of all current samples"] {
        assert!(cause(name)["without"]["outcome"] == "found", "{name}");
    }
    // An error in the tail is one of several that add up: without the first it is smaller.
    let without = number(&causes[0]["without"], "axis_error_deg");
    assert!(without.abs() < error.abs(), "{without}");
    // Without all of them the method's own error is left, which is below 0.7° at each angle.
    assert!(number(&trial["without_all"], "axis_error_deg").abs() < 0.7);
    assert!(
        cause("gain of a")["drawn_deviations"]
            .as_f64()
            .is_some_and(|drawn| drawn != 0.0 && drawn.abs() < 5.0)
    );
    let made = names(&path.join("e"));
    assert!(
        ["explain.csv", "explain.html", "explain.json"].iter().all(|name| made.contains(&(*name).to_owned()))
    );
    assert_eq!(made.iter().filter(|name| name.starts_with("trial_0_")).count(), 2);
    // What cannot be is said.
    assert!(mistake(&["explain", "r", "--wrong-poles"], path).contains("no wrong pole"));
    assert!(mistake(&["explain", "r", "--trial", "300"], path).contains("from 0 to 299"));
    let early = ["run", "s.toml", "--trials", "400", "--stop-at", "rms=20%", "--out", "early"];
    assert!(standstill(&early, path).status.success());
    assert!(
        mistake(&["explain", "early", "--trial", "399"], path)
            .contains("ended early (stop_at), with trial 99")
    );
    let summary = fs::read_to_string(path.join("r/summary.json")).expect("summary.json");
    let foreign = summary.replace("\"numerics\": ", "\"numerics\": 9");
    fs::write(path.join("r/summary.json"), foreign).expect("written");
    assert!(mistake(&["explain", "r", "--trial", "1"], path).contains("cannot be repeated"));
}

#[test]
fn a_trace_lays_settings_over_one_another() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let list = "detector.pulse=[40 us, 80 us]";
    let output = standstill(&["trace", "s.toml", "-s", list, "--out", "t"], path);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(names(&path.join("t")), ["overlay.html", "overlay.png", "overlay.svg", "result.json"]);
    let results = fs::read_to_string(path.join("t/result.json")).expect("result.json");
    let results: Value = serde_json::from_str(&results).expect("JSON");
    let error = |k: usize| number(&results[k], "error_deg");
    assert!(results[1]["setting"] == "detector.pulse = 80 us" && error(0) != error(1));
    // Motors have DC links of their own, and what follows from them.
    let motors = ["trace", "s.toml", "-s", "motor=[paper-5k5, light-vehicle]", "--out", "m"];
    let output = standstill(&motors, path);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let page = fs::read_to_string(path.join("m/overlay.html")).expect("a page");
    let link = page.split("inverter.dc_link").nth(1).expect("a fact");
    let link = &link[..link.find("inverter.").expect("another")];
    assert!(link.contains("550 V, 50 V"), "{link}");
    assert!(!page.contains("Data sheet paper-5k5"));
    let many = "detector.pulse=[40 us, 50 us, 60 us, 70 us, 80 us, 90 us, 100 us]";
    assert!(mistake(&["trace", "s.toml", "-s", many, "--out", "u"], path).contains("7 settings"));
    let twice = ["trace", "s.toml", "-s", "detector.pulse=[40 us, 40 us]", "--out", "u"];
    assert!(mistake(&twice, path).contains("detector.pulse = 40 us is there twice"));
    let format = ["trace", "s.toml", "-s", list, "--format", "parquet", "--out", "u"];
    assert!(mistake(&format, path).contains("--format: needed a single setting"));
}

#[test]
fn law_an_interrupted_question_goes_on_from_what_it_computed_to_the_same_answer() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let questions: [(&str, &[&str]); 4] = [
        ("odds", &["--event", "|e| > 1 deg"]),
        ("budget", &["--pairs", "1500"]),
        ("require", &["--key", "sensors.noise", "--limit", "rms <= 1 deg", "--most", "8000"]),
        (
            "tune",
            &[
                "--vary",
                "detector.pulse=60us:120us",
                "--minimise",
                "rms",
                "--trials",
                "2000",
                "--starts",
                "2",
            ],
        ),
    ];
    for (name, more) in questions {
        let asked = |out: &str| -> Vec<String> {
            let words = [&[name, "s.toml", "--json", "--out", out], more].concat();
            words.into_iter().map(str::to_owned).collect()
        };
        let journal = path.join(format!("{name}-b/{name}.journal"));
        let mut child = Command::new(env!("CARGO_BIN_EXE_standstill"))
            .args(asked(&format!("{name}-b")))
            .current_dir(path)
            .stdout(Stdio::null())
            .spawn()
            .expect("the program starts");
        let begun = std::time::Instant::now();
        while fs::metadata(&journal).map_or(0, |file| file.len()) < 3000 {
            std::thread::sleep(Duration::from_millis(5));
            assert!(begun.elapsed() < Duration::from_secs(120), "{name}: nothing was kept");
        }
        child.kill().expect("SIGKILL");
        assert!(!child.wait().expect("ended").success(), "{name} had already ended");
        let b = asked(&format!("{name}-b"));
        let again = |more: &[&'static str]| -> Vec<String> {
            b.iter().cloned().chain(more.iter().map(|word| (*word).to_owned())).collect()
        };
        let words =
            |owned: &[String]| owned.iter().map(|word| word.clone().leak() as &str).collect::<Vec<_>>();
        assert!(mistake(&words(&again(&[])), path).contains("--resume to go on with it"), "{name}");
        let message = mistake(&words(&again(&["--seed", "7", "--resume"])), path);
        assert!(message.contains("the seed is 1 there and 7 here"), "{name}: {message}");
        assert!(message.contains("--force in place of --resume"), "{name}: {message}");
        // Nobody computes what is there: it is read, and told apart from what is not there by its key alone.
        let resumed = answer(&words(&again(&["--resume"])), 0, path);
        assert!(!journal.exists(), "{name}");
        let whole = answer(&words(&asked(&format!("{name}-a"))), 0, path);
        assert_eq!(resumed, whole, "{name}");
        let [a, b] = ["a", "b"].map(|out| path.join(format!("{name}-{out}")));
        assert_eq!(names(&a), names(&b));
        for file in names(&a) {
            assert!(fs::read(a.join(&file)).ok() == fs::read(b.join(&file)).ok(), "{name}: {file}");
        }
    }
}

#[test]
fn mistakes_name_what_there_is() {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENARIO).expect("written");
    let says = |arguments: &[&str], parts: &[&str]| {
        let message = mistake(arguments, folder.path());
        for part in parts {
            assert!(message.contains(part), "{part} in {message}");
        }
    };
    says(
        &["odds", "s.toml", "--event", "wrongpole"],
        &["`wrongpole`", "did you mean `wrong-pole`?", "peak_current"],
    );
    says(&["odds", "s.toml", "--event", "peak_current > 8"], &["found `8` without a unit", "such as `8 A`"]);
    says(
        &["require", "s.toml", "--key", "sensors.noise", "--limit", "rmse <= 1 deg"],
        &["`rmse <= 1 deg`", "did you mean `rms`?", "wrong_poles", "duration"],
    );
    let no_unit = ["require", "s.toml", "--key", "sensors.noise", "--limit", "peak_current <= 8"];
    says(&no_unit, &["found `8` without a unit", "such as `8 A`"]);
    let bare = ["require", "s.toml", "--key", "sensors.noise", "--limit", "undetermined <= 5"];
    says(&bare, &["--limit", "found `5`, needed a share", "`5 %`"]);
    says(
        &["require", "s.toml", "--key", "sensors.noize", "--limit", "rms <= 1 deg"],
        &["sensors.noize", "noise", "gain_error"],
    );
    says(
        &["require", "s.toml", "--key", "rotor.state", "--limit", "rms <= 1 deg"],
        &["rotor.state", "its values are no numbers", "`sensors.noise`"],
    );
    let tune = |vary: &'static str, minimise: &'static str| {
        ["tune", "s.toml", "--vary", vary, "--minimise", minimise]
    };
    says(&tune("detector.pulse=20us:200us", "rmse"), &["`rmse` (did you mean `rms`?)", "wrong_poles"]);
    says(&tune("detector.pulse=200us:20us", "rms"), &["LOW:HIGH"]);
    says(&tune("detector.pulse=20 A:200us", "rms"), &["detector.pulse", "20 A"]);
    says(&tune("detector.puls=20us:200us", "rms"), &["detector.puls", "pulse"]);
    says(
        &tune("detector.voltage=20 V:200 V", "rms"),
        &["detector.voltage", "a method that has such a setting"],
    );
    // What a sensor makes wrong is none of the settings; those that there are, are named.
    let given = [
        "sensors.noise",
        "found a property of the motor or of a part",
        "detector.pulse",
        "inverter.dead_time",
        "standstill require",
    ];
    says(&tune("sensors.noise=1mA:5mA", "rms"), &given);
    says(&tune("motor.winding.resistance=1ohm:2ohm", "rms"), &["motor.winding.resistance", "detector.pulse"]);
    says(&tune("seed=1:5", "rms"), &["--vary seed", "detector.pulse"]);
    says(
        &tune("detector.rounds=0.5:8", "rms"),
        &["found `0.5` for detector.rounds", "whole numbers alone, such as 1:8"],
    );
    says(
        &["odds", "s.toml", "--event", "|e| > 200 deg"],
        &["found `200 deg`", "from 0 deg to less than 90 deg"],
    );
    // Of a campaign's trials there are as many as it says.
    let traced = |trial: &'static str, more: &[&'static str]| {
        [&["trace", "s.toml", "--trial", trial, "--out", "t"][..], more].concat()
    };
    says(&traced("99999999999", &[]), &["--trial 99999999999", "needed from 0 to 999", "`-s trials=N`"]);
    says(&traced("50", &["-s", "trials=50"]), &["--trial 50", "needed from 0 to 49"]);
    says(&["budget", "s.toml", "-s", "axes.\"sensors.noise\"=[\"1 mA\", \"2 mA\"]"], &["axes", "without"]);
    assert_eq!(names(folder.path()), ["s.toml"], "nothing half-written");
}

/// A part of the turn, or all of it, without an axis is a gap or a message, and no panic.
#[test]
fn regress_a_budget_of_starts_without_an_axis_says_so() {
    let folder = super::folder();
    let path = folder.path();
    std::fs::write(path.join("s.toml"), format!("{SCENARIO}errors = \"default\"\n")).expect("written");
    let none =
        super::mistake(&["budget", "s.toml", "--pairs", "100", "-s", "detector.least_saliency=0.9"], path);
    assert!(none.contains("of 100 pairs of starts 0 have an axis"), "{none}");
    let some = ["-s", "sensors.noise=1 mA", "-s", "errors=none", "-s", "detector.least_saliency=0.23"];
    let output = standstill(&[&["budget", "s.toml", "--pairs", "360"][..], &some].concat(), path);
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{output:?}");
}
