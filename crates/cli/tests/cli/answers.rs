//! What `odds`, `budget`, `require` and `tune` have in common, and lists of `trace`.

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
pub fn has(value: &Value, keys: &[&str]) {
    for key in keys {
        assert!(value.get(key).is_some(), "{key} in {value}");
    }
}

pub fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} of {value}"))
}

#[test]
fn law_a_trace_lays_settings_over_one_another() {
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

/// promise: questions-resume
#[test]
fn law_an_interrupted_question_goes_on_from_what_it_computed_to_the_same_answer() {
    goes_on(&[
        ("odds", &["--event", "|e| > 1 deg", "--effort", "quick"]),
        ("qualify", &["r.toml", "--no-witness"]),
    ]);
}

/// promise: questions-resume
#[test]
#[ignore = "many trials; a short witness runs by default: scripts/test-all.sh long"]
fn law_an_interrupted_search_goes_on_from_what_it_computed_to_the_same_answer() {
    let key = ["--key", "sensors.noise", "--between", "5 mA:30 mA", "--most", "1000"];
    let settings = ["--vary", "detector.pulse=60us:120us", "--trials", "1000", "--starts", "1"];
    goes_on(&[
        ("budget", &["--pairs", "250"]),
        ("require", &[&key[..], &["--limit", "rms <= 1 deg"]].concat()),
        ("tune", &[&settings[..], &["--minimise", "rms"]].concat()),
    ]);
}

fn goes_on(questions: &[(&str, &[&str])]) {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), SCENARIO).expect("written");
    let list = "[[requirement]]\nid = \"A\"\ntext = \"…\"\nlimit = \"rms <= 6 deg\"\n";
    fs::write(path.join("r.toml"), list).expect("written");
    for &(name, more) in questions {
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
fn law_mistakes_name_what_there_is() {
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
    says(
        &["odds", "s.toml", "--event", "wrong-pole", "-s", "motor=reluctance-6k7"],
        &[
            "`--event wrong-pole`",
            "the motor reluctance-6k7, which has no magnet and so no poles",
            "`|e| > 3 deg`",
        ],
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
