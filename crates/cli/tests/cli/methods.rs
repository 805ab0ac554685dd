//! `compare`, `check`, and other methods in `trace`.

use std::fs;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::{folder, mistake, names, standstill};

fn json(arguments: &[&str]) -> (Value, Option<i32>) {
    let output = standstill(arguments, folder().path());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let warned = String::from_utf8_lossy(&output.stderr);
    let is_meant = arguments.contains(&"--signature") && warned.contains("warning: detector.signature is");
    assert!(is_meant || super::quiet(&output), "{warned}");
    (serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}")), output.status.code())
}

/// promise: common-draws
#[test]
fn law_compare_prints_a_list_with_common_random_numbers() {
    let arguments = [
        "compare",
        "--method",
        "bipolar,line-inductance-fast",
        "--rotor",
        "locked,free",
        "--errors",
        "default",
        "--trials",
        "16",
        "--json",
    ];
    let (list, code) = json(&arguments);
    assert_eq!(code, Some(0));
    let rows = list.as_array().expect("a list");
    assert_eq!(rows.len(), 4);
    let keys = [
        "method",
        "rotor",
        "errors",
        "trials",
        "rms_deg",
        "p95_deg",
        "max_deg",
        "wrong_poles",
        "undetermined",
        "failed",
        "duration_ms",
        "peak_current_A",
        "energy_J",
        "moved_deg",
        "bound_deg",
        "efficiency",
    ];
    for row in rows {
        for key in keys {
            assert!(!row[key].is_null(), "{key}: {row}");
        }
        let number = |key: &str| row[key].as_f64().expect("a number");
        assert!(number("rms_deg") < 2.0 && number("wrong_poles") == 0.0, "{row}");
        // Nobody beats the limit, beyond what 16 trials leave to chance.
        assert!(number("efficiency") < 1.4, "{row}");
        assert!((number("bound_deg") / number("rms_deg") - number("efficiency")).abs() < 1e-9, "{row}");
    }
    let (again, _) = json(&[&arguments[..], &["--threads", "1"]].concat());
    assert_eq!(list, again, "the same on any number of threads");
}

#[test]
fn law_compare_writes_a_table_a_csv_and_a_figure() {
    let folder = folder();
    let arguments = ["compare", "--method", "bipolar", "--rotor", "locked", "--trials", "12", "--out", "c"];
    let output = standstill(&arguments, folder.path());
    assert!(output.status.success() && super::quiet(&output));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for part in ["bipolar", "default", "harsh", "Cramér–Rao", "comparison.csv"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let files = ["csv", "html", "json", "png", "svg"].map(|kind| format!("comparison.{kind}"));
    assert_eq!(names(&folder.path().join("c")), files);
    let csv = fs::read_to_string(folder.path().join("c/comparison.csv")).expect("written");
    assert!(
        csv.starts_with("method,rotor,errors,trials,right,rms_deg,") && csv.lines().count() == 3,
        "{csv}"
    );
}

#[test]
fn law_compare_takes_each_of_a_list_once_and_no_limit_beyond_a_guess() {
    let (list, _) = json(&[
        "compare",
        "--method",
        "maximum-likelihood,maximum-likelihood",
        "--rotor",
        "locked,locked",
        "--errors",
        "default,default",
        "--trials",
        "2",
        "--pulse",
        "20",
        "--json",
    ]);
    assert_eq!(list.as_array().expect("a list").len(), 1, "{list}");
    // Pulses too short to raise a current: given up after the first, which tells no angle.
    assert_eq!((&list[0]["failed"], &list[0]["bound_deg"]), (&2.into(), &Value::Null), "{list}");
}

/// The paper's motor with some of its data sheet changed.
fn changed(name: &str, changes: &[(&str, &str)]) -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../plant/motors/paper-5k5.toml");
    let mut sheet = fs::read_to_string(path).expect("the data sheet");
    sheet = sheet.replace("name = \"paper-5k5\"", &format!("name = \"{name}\""));
    for (from, to) in changes {
        assert!(sheet.contains(from), "{from}");
        sheet = sheet.replace(from, to);
    }
    sheet
}

#[test]
fn law_motors_on_any_dc_link_are_within_the_range_of_its_sensor() {
    let folder = folder();
    for link in ["24 V", "1500 V"] {
        // Resistance, inductances and magnet in proportion, hence the same pulses.
        let share = if link == "24 V" { 24.0 / 550.0 } else { 1500.0 / 550.0 };
        let scaled = |value: f64, power: i32| format!("value = {:.9}", value * f64::powi(share, power));
        let unit = |value: f64, unit: &str| format!("value = \"{:.9} {unit}\"", value * share);
        let sheet = changed(
            "link",
            &[
                ("value = \"550 V\"", &format!("value = \"{link}\"")),
                ("value = \"1.2 Ω\"", &unit(1.2, "Ω")),
                ("value = \"9.2 mH\"", &unit(9.2, "mH")),
                ("value = \"-2.1 mH\"", &unit(-2.1, "mH")),
                ("value = \"0.45 Wb\"", &unit(0.45, "Wb")),
                // With s = 1 in place of 5, of the same slope and curvature at the magnet's flux.
                ("value = 89.14", &scaled(70.1, -1)),
                ("value = 43.0", &scaled(26.45, -2)),
                ("value = 59.0", &scaled(59.0, -1)),
                ("s = { value = 5", "s = { value = 1"),
                ("value = \"40.47 A\"", "value = \"36.9 A\""),
            ],
        );
        fs::write(folder.path().join("link.toml"), sheet).expect("written");
        let arguments = ["compare", "--motor", "link.toml", "--method", "bipolar", "--rotor", "locked"];
        let output = standstill(
            &[&arguments[..], &["--errors", "default", "--trials", "30", "--json"]].concat(),
            folder.path(),
        );
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let list: Value = serde_json::from_str(&text)
            .unwrap_or_else(|error| panic!("{error}: {text} {}", String::from_utf8_lossy(&output.stderr)));
        assert_eq!(list[0]["failed"], 0, "{list}");
        assert!(list[0]["rms_deg"].as_f64().expect("a number") < 0.2, "{list}");
    }
}

#[test]
fn law_compare_told_wrongly_names_the_wrong_pole() {
    let (list, _) = json(&[
        "compare",
        "--method",
        "maximum-likelihood",
        "--rotor",
        "locked",
        "--errors",
        "default",
        "--trials",
        "8",
        "--signature",
        "inverted",
        "--json",
    ]);
    assert_eq!(list[0]["wrong_poles"], 8, "{list}");
    let (list, _) = json(&[
        "compare",
        "--method",
        "line-inductance-fast",
        "--rotor",
        "locked",
        "--errors",
        "noise",
        "--trials",
        "8",
        "--polarity",
        "sequential",
        "--pulse",
        "120",
        "--json",
    ]);
    assert_eq!((&list[0]["wrong_poles"], &list[0]["failed"]), (&0.into(), &0.into()), "{list}");
}

#[test]
fn law_check_gives_a_verdict_with_reasons_and_its_code() {
    // All methods are tried by the commands of the readme.
    let (suited, code) = json(&["check", "paper-5k5", "--json", "-s", "detector.method=bipolar"]);
    assert_eq!((code, &suited["suited"]), (Some(0), &Value::Bool(true)), "{suited}");
    let recommended = &suited["recommended"];
    assert_eq!((&suited["verdict"], &recommended["confirmed"]["wrong_poles"]), (&"suited".into(), &0.into()));
    assert!(recommended["margin"].as_f64().expect("a number") > 10.0, "{suited}");
    assert!(recommended["keys"]["detector.pulse"].is_string() && suited["scenario"].is_null(), "{suited}");
    let next = suited["next"][0].as_str().expect("a command");
    assert!(next.starts_with("standstill run paper-5k5 ") && next.contains("detector.pulse="), "{next}");
    // Too light a rotor: every pulse turns it.
    let method = ["-s", "detector.method=bipolar", "-s", "detector.rounds=3"];
    let pulse = ["-s", "detector.pulse=200us"];
    let (light, code) = json(&[&["check", "low-inertia", "--json"], &method[..], &pulse].concat());
    assert_eq!((code, &light["suited"]), (Some(1), &Value::Bool(false)), "{light}");
    let objections = light["candidates"][0]["objections"].to_string();
    assert!(objections.contains("a free rotor moves by"), "{objections}");
    let folder = folder();
    let output = standstill(&[&["check", "reluctance-6k7"], &method[..]].concat(), folder.path());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(
        text.contains("suited") && text.contains("Poles: none") && text.contains("Recommended"),
        "{text}"
    );
    assert!(!text.contains("signature"), "of a motor without poles: {text}");
    assert_eq!(names(folder.path()), ["check-reluctance-6k7.toml"]);
}

#[test]
fn law_check_writes_the_scenario_that_goes_on_and_replaces_nothing() {
    let folder = folder();
    let at = folder.path();
    let fixed = ["-s", "detector.pulse=200us", "-s", "rotor.state=locked"];
    let check = [&["check", "paper-5k5", "-s", "detector.method=bipolar"], &fixed[..]].concat();
    let text = |arguments: &[&str]| {
        let output = standstill(arguments, at);
        (String::from_utf8(output.stdout).expect("text"), output.status.code())
    };
    let (first, code) = text(&check);
    assert!(
        code == Some(0) && first.ends_with("Go on with\n  standstill run check-paper-5k5.toml\n"),
        "{first}"
    );
    // The command that it names.
    let run = standstill(&["run", "check-paper-5k5.toml", "--trials", "20", "--json"], at);
    let summary: Value = serde_json::from_slice(&run.stdout).expect("JSON");
    assert_eq!((&summary["summary"]["undetermined"], &summary["summary"]["failed"]), (&0.into(), &0.into()));
    // Its own file, which nobody has edited, follows the next check.
    let of_file = || fs::read_to_string(at.join("check-paper-5k5.toml")).expect("there");
    let before = of_file();
    let shorter: Vec<&str> = check
        .iter()
        .map(|word| if *word == "detector.pulse=200us" { "detector.pulse=150us" } else { word })
        .collect();
    assert!(text(&shorter).0.ends_with("Go on with\n  standstill run check-paper-5k5.toml\n"));
    assert!(of_file().contains("pulse = 0.00015") && before.contains("pulse = 0.0002"), "{}", of_file());
    fs::write(at.join("check-paper-5k5.toml"), before.replace("0.0002", "0.00021")).expect("written");
    assert!(text(&check).0.contains("is there already and says something else: it stays"));
    fs::write(at.join("check-paper-5k5.toml"), "trials = 5\n").expect("written");
    let (other, _) = text(&check);
    assert!(other.contains("is there already and says something else: it stays"), "{other}");
    assert_eq!(fs::read_to_string(at.join("check-paper-5k5.toml")).expect("there"), "trials = 5\n");
    // A name that was given must be free.
    let message = mistake(&[&check[..], &["--write", "check-paper-5k5.toml"]].concat(), at);
    assert!(message.contains("check-paper-5k5.toml is there already"), "{message}");
    assert_eq!(text(&[&check[..], &["--force"]].concat()).0, first);
}

#[test]
fn law_trace_shows_another_method() {
    let folder = folder();
    let arguments = ["trace", "--angle", "43.2", "--method", "maximum-likelihood-adaptive", "--out", "t"];
    let output = standstill(&arguments, folder.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let result = fs::read_to_string(folder.path().join("t/result.json")).expect("written");
    let result: Value = serde_json::from_str(&result).expect("JSON");
    assert_eq!(result["method"], "maximum-likelihood-adaptive");
    assert!(result["error_deg"].as_f64().expect("an angle").abs() < 0.4, "{result}");
    assert!(result["pole_error_probability"].as_f64().expect("a number") <= 1e-6, "{result}");
    let [speaks, needed] = ["pole_evidence_deviations", "pole_evidence_needed"]
        .map(|key| result[key].as_f64().expect("a number"));
    assert!(speaks >= needed && needed > 5.0, "{result}");
}

#[test]
fn law_mistakes_of_methods_are_named() {
    let folder = folder();
    let at = folder.path();
    let cases: [(&[&str], &[&str]); 12] = [
        (
            &["compare", "--method", "maximum"],
            &["'maximum'", "--method", "maximum-likelihood", "dc-alignment"],
        ),
        (&["compare", "--errors", "big"], &["'big'", "none, noise, default, harsh, field"]),
        (&["compare", "--trials", "0"], &["'0'", "--trials", "from 1 to"]),
        (&["compare", "--pulse", "5"], &["'5'", "--pulse", "from 20 to 1000"]),
        (&["compare", "--method", "hfi-rotating", "--pulse", "100"], &["--pulse", "hfi-rotating"]),
        (&["compare", "--method", "bipolar", "--polarity", "sequential"], &["--polarity", "bipolar"]),
        (
            &["compare", "--pulse", "100", "--uncompensated"],
            &["--pulse", "--uncompensated", "no method", "line-inductance-fast", "hfi-rotating"],
        ),
        (
            &["compare", "--load", "5", "--rotor", "locked"],
            &["set by --load: `rotor.load`", "locked", "needed `rotor.state` \"free\""],
        ),
        (&["compare", "--rotor", "brake"], &["set by --rotor: `rotor.state`", "brake_backlash"]),
        (&["check", "nosuch"], &["set by MOTOR: `motor`: found `nosuch`", "paper-5k5"]),
        (&["check", "paper-5k5", "--tolerance", "0"], &["'0'", "--tolerance", "from 0.001 to 90"]),
        (
            &["trace", "--angle", "1", "--method", "bipolar", "--decay", "fast", "--out", "t"],
            &["--method", "--decay"],
        ),
    ];
    for (arguments, parts) in cases {
        let message = mistake(arguments, at);
        for part in parts {
            assert!(message.contains(part), "{arguments:?} says: {message}");
        }
        assert!(names(at).is_empty(), "{arguments:?} left something behind");
    }
}

#[test]
fn law_an_interrupted_comparison_keeps_its_finished_rows() {
    let folder = folder();
    let child = Command::new(env!("CARGO_BIN_EXE_standstill"))
        .args(["compare", "--method", "bipolar,dc-alignment", "--rotor", "locked", "--errors", "default"])
        .args(["--trials", "600", "--out", "c"])
        .current_dir(folder.path())
        .env("XDG_CACHE_HOME", folder.path().join("cache"))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    // The first row ends with its limit, which is kept; the second takes minutes.
    let limits = folder.path().join("cache/standstill/limits");
    let kept = || fs::read_dir(&limits).into_iter().flatten().flatten();
    let begun = std::time::Instant::now();
    while !kept().any(|file| file.path().extension().is_some_and(|end| end == "limit")) {
        std::thread::sleep(std::time::Duration::from_millis(20));
        assert!(begun.elapsed() < std::time::Duration::from_secs(120), "no limit was kept");
    }
    std::thread::sleep(std::time::Duration::from_millis(500));
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(killed.expect("kill").success());
    let output = child.wait_with_output().expect("it ends");
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(130), "{text}");
    assert!(text.contains("Interrupted: 1 of 2 rows"), "{text}");
    let csv = fs::read_to_string(folder.path().join("c/comparison.csv")).expect("written");
    assert_eq!(csv.lines().count(), 2, "{csv}");
}

#[test]
fn law_limits_are_computed_once_for_each_scenario() {
    let folder = folder();
    let path = folder.path();
    let compare = |more: &[&str]| {
        let arguments =
            ["compare", "--method", "bipolar", "--rotor", "locked", "--errors", "default", "--json"];
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_standstill"))
            .args(arguments)
            .args(more)
            .current_dir(path)
            .env("XDG_CACHE_HOME", path.join("cache"))
            .output()
            .expect("the program starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let rows: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        rows[0]["bound_deg"].as_f64()
    };
    let kept = || names(&path.join("cache/standstill/limits"));
    let first = compare(&["--trials", "3"]);
    assert!(first.is_some_and(|limit| limit > 0.0));
    let one = kept();
    assert_eq!(one.len(), 1);
    // More trials have the same limit: what stands there is told, not what would be computed.
    let file = path.join("cache/standstill/limits").join(&one[0]);
    let mut bytes = std::fs::read(&file).expect("kept");
    let limit = first.expect("a limit").to_le_bytes();
    let place = bytes.windows(8).position(|some| some == limit).expect("the limit");
    bytes[place..place + 8].copy_from_slice(&0.5_f64.to_le_bytes());
    std::fs::write(&file, &bytes).expect("written");
    // An entry whose checksum does not fit is computed anew.
    assert_eq!(compare(&["--trials", "5"]), first);
    let sum = standstill_plant::Digest::of(&bytes[4..]).crc32.to_le_bytes();
    bytes[..4].copy_from_slice(&sum);
    std::fs::write(&file, &bytes).expect("written");
    assert_eq!(compare(&["--trials", "5"]), Some(0.5));
    // Another scenario has its own, and another program's is not found.
    assert_ne!(compare(&["--trials", "3", "-s", "sensors.noise=20 mA"]), Some(0.5));
    assert_eq!(kept().len(), 2);
    let version = bytes.windows(2).position(|some| some == b"0.").expect("the version");
    bytes[version] = b'9';
    std::fs::write(&file, bytes).expect("written");
    assert_eq!(compare(&["--trials", "3"]), first);
    assert_eq!(compare(&["--trials", "3", "--no-limit"]), None);
}
