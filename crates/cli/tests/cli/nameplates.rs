//! Motors by their nameplates: of any size, with and without saturation, with mistakes.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

use super::{folder, mistake, names, standstill};

/// A nameplate: pole pairs, resistance, L_d, L_q, magnet flux, rated current, DC link, saturation.
pub type Plate = (&'static str, [&'static str; 8]);

/// Saturation of motors whose rated current makes as much flux as their magnet.
const BOTH_WAYS: &str = "{ d = \"15 %\", minus_d = \"-8 %\", q = \"20 %\" }";

/// From milliamperes to kiloamperes, from 12 to 1,000 V.
pub const PLATES: [Plate; 6] = [
    ("milliamperes", ["2", "400 ohm", "1 H", "1.4 H", "0.1 Wb", "20 mA", "24 V", "6 %"]),
    ("hobby", ["7", "40 mΩ", "13.5 uH", "16 uH", "1 mWb", "20 A", "12 V", "12 %"]),
    ("camera", ["11", "5.5 Ω", "1.4 mH", "1.6 mH", "8 mWb", "0.6 A", "12 V", "4 %"]),
    ("traction-24", ["4", "2 mΩ", "60 uH", "100 uH", "20 mWb", "300 A", "24 V", BOTH_WAYS]),
    ("traction-48", ["4", "2 mΩ", "40 uH", "60 uH", "20 mWb", "300 A", "48 V", BOTH_WAYS]),
    ("megawatt", ["6", "3 mΩ", "200 uH", "300 uH", "0.8 Wb", "1500 A", "1 kV", "8 %"]),
];

pub fn sheet([pole_pairs, resistance, l_d, l_q, flux, current, link, saturation]: [&str; 8]) -> String {
    let mut text = format!(
        "[nameplate]\npole_pairs = {pole_pairs}\nresistance = \"{resistance}\"\nL_d = \"{l_d}\"\nL_q = \"{l_q}\"\nmagnet_flux = \"{flux}\"\nrated_current = \"{current}\"\ndc_link = \"{link}\"\n"
    );
    let _ = match saturation {
        "" => Ok(()),
        BOTH_WAYS => writeln!(text, "saturation = {saturation}"),
        plain => writeln!(text, "saturation = \"{plain}\""),
    };
    text
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).expect("written")).expect("JSON")
}

/// Motors' names or data sheets, from milliamperes to kiloamperes.
fn motors(at: &Path) -> Vec<String> {
    let built_in = ["light-vehicle", "light-vehicle-stiff", "outrunner", "gimbal"].map(str::to_owned);
    let own = PLATES.map(|(name, plate)| {
        fs::write(at.join(format!("{name}.toml")), sheet(plate)).expect("written");
        format!("{name}.toml")
    });
    built_in.into_iter().chain(own).collect()
}

fn succeed(arguments: &[&str], at: &Path) -> String {
    let output = standstill(arguments, at);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

const ADAPTIVE: &str = "detector.method=maximum-likelihood-adaptive";

/// The smallest, a middle one and the largest are checked by one method in terminal.rs.
#[test]
#[ignore = "many trials; three motors run by default: scripts/test-all.sh long"]
fn law_motors_of_any_size_are_checked() {
    let folder = folder();
    for motor in motors(folder.path()) {
        let text = succeed(&["check", &motor, "-s", ADAPTIVE], folder.path());
        assert!(text.contains("suited to detection of the rotor position"), "{motor}: {text}");
    }
}

#[test]
fn law_motors_of_any_size_are_traced_and_run() {
    traced_and_run(&["milliamperes.toml", "traction-24.toml", "megawatt.toml"]);
}

#[test]
#[ignore = "all motors; three run by default: scripts/test-all.sh long"]
fn law_more_motors_are_traced_and_run() {
    traced_and_run(&[]);
}

/// The motors of these names, or all.
fn traced_and_run(of: &[&str]) {
    let folder = folder();
    let at = folder.path();
    let mut motors = motors(at);
    motors.retain(|motor| of.is_empty() || of.contains(&motor.as_str()));
    assert!(motors.len() >= of.len().max(3), "{motors:?}");
    for motor in &motors {
        let run = |arguments: &[&str]| succeed(arguments, at);
        // Numerical errors are small beside the sensors' noise, whatever the motor's size.
        let traced = ["--method", "maximum-likelihood-adaptive", "--verify"];
        run(&[&["trace", "--motor", motor, "--angle", "70", "--out", "t"], &traced[..]].concat());
        let result = json(&at.join("t/result.json"));
        assert_eq!(result["pole_correct"], true, "{motor}: {result}");
        let error = &result["numerical_error"];
        let (current, noise) = (error["current_A"].as_f64(), error["sensor_noise_A"].as_f64());
        assert!(
            current.zip(noise).is_some_and(|(current, noise)| current < noise / 100.0),
            "{motor}: {error}"
        );
        // Errors of the axis, as much as 20 trials tell.
        fs::write(at.join("s.toml"), format!("motor = \"{motor}\"\ntrials = 20\n")).expect("written");
        run(&["run", "s.toml", "-s", ADAPTIVE, "--out", "r"]);
        let summary = &json(&at.join("r/summary.json"))["summary"];
        assert_eq!(summary["wrong_poles"], 0, "{motor}: {summary}");
        assert!(summary["rms_deg"]["value"].as_f64().is_some_and(|rms| rms < 1.0), "{motor}");
        fs::remove_dir_all(at.join("r")).expect("removed");
        fs::remove_dir_all(at.join("t")).expect("removed");
        // Fixed pulses may leave a pole open.
        for (method, errors) in [
            ("bipolar", "default"),
            ("bipolar", "field"),
            ("maximum-likelihood", "default"),
            ("maximum-likelihood", "field"),
        ] {
            let set = [format!("detector.method={method}"), format!("errors={errors}")];
            run(&["run", "s.toml", "-s", &set[0], "-s", &set[1], "--out", "r"]);
            let summary = &json(&at.join("r/summary.json"))["summary"];
            assert_eq!(
                (&summary["wrong_poles"], &summary["failed"]),
                (&0.into(), &0.into()),
                "{motor} {method} {errors}: {summary}"
            );
            assert!(
                summary["rms_deg"]["value"].as_f64().is_some_and(|rms| rms < 1.6),
                "{motor} {method} {errors}: {summary}"
            );
            fs::remove_dir_all(at.join("r")).expect("removed");
        }
    }
}

#[test]
fn law_a_motor_without_saturation_is_judged_on_everything_else() {
    let folder = folder();
    let at = folder.path();
    let unknown = ["4", "2 mΩ", "40 uH", "60 uH", "20 mWb", "300 A", "48 V", ""];
    fs::write(at.join("own.toml"), sheet(unknown)).expect("written");
    let given = ["-s", "detector.method=bipolar", "-s", "detector.rounds=3", "-s", "rotor.state=locked"];
    let output = standstill(&[&["check", "own.toml", "--json"], &given[..]].concat(), at);
    // A condition that nobody has shown to hold is no success. (docs/own-motor.md has it in words.)
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((&json["suited"], &json["verdict"]), (&false.into(), &"suited-if".into()));
    assert!(json["condition"]["least"].as_f64().is_some_and(|least| (0.005..0.4).contains(&least)), "{json}");
}

#[test]
fn law_all_that_is_wrong_with_a_nameplate_is_named_at_once() {
    let folder = folder();
    let at = folder.path();
    let text = "[nameplate]\npole_pairs = 3.5\nresistance = \"50 mH\"\nLd = \"2.1 mH\"\nL_q = \"-3 mH\"\nmagnet_flux = \"90 mWb\"\ndc_link = 48\nsaturation = { d = 6, plus_d = \"3 %\" }\n[winding]\nleakage = 0\n";
    fs::write(at.join("own.toml"), text).expect("written");
    let before = names(at);
    for command in ["motors", "check"] {
        let message = mistake(&[command, "own.toml"], at);
        for part in [
            "own.toml: [nameplate]: ",
            "[winding] stands beside [nameplate]",
            "line 4, `Ld`: is no key of [nameplate], which are pole_pairs, ",
            "line 2, `pole_pairs` is 3.5, but must be a whole number from 1 to 200",
            "line 3, `resistance`: `50 mH` is not a finite number in Ω",
            "`L_d` is missing: the positive inductance",
            "line 5, `L_q` is -3 mH, but must be the positive inductance",
            "`rated_current` is missing: the positive peak current",
            "line 8, `saturation`: `plus_d` is none of d, minus_d, q",
            "`saturation.d` is 6 (did you mean \"6 %\"?), but must be from \"-100 %\" to \"90 %\"",
        ] {
            assert!(message.contains(part), "no {part} in {message}");
        }
        assert!(!message.contains("magnet_flux` is") && !message.contains("dc_link` is"), "{message}");
    }
    assert_eq!(names(at), before);
    // What no number alone gets wrong.
    let together = |plate: [&str; 8], more: &str| {
        fs::write(at.join("own.toml"), sheet(plate) + more).expect("written");
        mistake(&["motors", "own.toml"], at)
    };
    let slow = together(["4", "400 ohm", "40 uH", "60 uH", "20 mWb", "3 A", "48 V", ""], "");
    assert!(slow.contains("line 3, `resistance`: ") && slow.contains("below 1 µs"), "{slow}");
    let growing = "saturation = { d = \"-2 %\", minus_d = \"-3 %\" }\n";
    let growing = together(["4", "2 mΩ", "40 uH", "60 uH", "20 mWb", "3 A", "48 V", ""], growing);
    assert!(growing.contains("line 9, `saturation`: d must be positive where minus_d is not"), "{growing}");
}

#[test]
fn law_a_nameplate_in_a_scenario_has_keys_like_any_other() {
    let folder = folder();
    let at = folder.path();
    let own = ["4", "2 mΩ", "40 uH", "60 uH", "20 mWb", "300 A", "48 V", "6 %"];
    fs::write(at.join("own.toml"), sheet(own)).expect("written");
    let scenario = "trials = 10\n[motor]\nbase = \"own.toml\"\nnameplate.L_q = \"70 uH\"\n[detector]\nmethod = \"bipolar\"\n[tolerances]\n\"motor.nameplate.resistance\" = { normal = \"5 %\" }\n";
    fs::write(at.join("s.toml"), scenario).expect("written");
    let vary = ["--vary", "motor.nameplate.L_d=35 uH:45 uH:3"];
    let output = standstill(&[&["sweep", "s.toml", "--out", "r"], &vary[..]].concat(), at);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let summary = json(&at.join("r/summary.json"));
    assert_eq!(summary["points"].as_array().map(Vec::len), Some(3), "{summary}");
    // The whole of it in place.
    let table = sheet(own).replace("[nameplate]", "[motor.nameplate]");
    fs::write(at.join("s.toml"), format!("trials = 10\n{table}")).expect("written");
    let output = standstill(&["run", "s.toml", "--out", "q"], at);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let message = mistake(&["run", "s.toml", "-s", "motor.nameplate.L_d=3 Ω", "--out", "p"], at);
    assert!(message.contains("L_d") && message.contains("3 Ω"), "{message}");
}

#[test]
fn law_a_data_sheet_to_fill_in_is_one_and_is_never_overwritten() {
    let folder = folder();
    let at = folder.path();
    let output = standstill(&["init", "--motor", "mine.toml"], at);
    let text = String::from_utf8(output.stdout).expect("text");
    assert!(output.status.success() && text.contains("standstill check mine.toml"), "{text}");
    assert_eq!(names(at), ["mine.toml"]);
    let text = String::from_utf8(standstill(&["motors", "mine.toml"], at).stdout).expect("text");
    // What was left out is said to be assumed.
    for line in ["nameplate.leakage", "rotor.inertia", "rotor.stiction", "rotor.coulomb", "rotor.viscous"] {
        assert!(text.lines().any(|l| l.contains(line) && l.contains("assumed")), "{line}: {text}");
    }
    let message = mistake(&["init", "--motor", "mine.toml"], at);
    assert!(message.contains("mine.toml is there already"), "{message}");
    let message = mistake(&["init", "--motor", "mine.txt"], at);
    assert!(message.contains("mine.txt is no data sheet's name") && message.contains(".toml"), "{message}");
    mistake(&["init", "scenario.toml", "--motor", "other.toml"], at);
    assert_eq!(names(at), ["mine.toml"]);
}

#[test]
fn law_motors_lists_a_line_each() {
    let folder = folder();
    let text = String::from_utf8(standstill(&["motors"], folder.path()).stdout).expect("text");
    let lines: Vec<&str> = text.lines().take_while(|line| !line.is_empty()).collect();
    assert_eq!(lines.len(), standstill_plant::built_in_names().count(), "{text}");
    for name in ["paper-5k5 ", "light-vehicle ", "light-vehicle-stiff ", "outrunner ", "gimbal "] {
        assert!(lines.iter().any(|line| line.starts_with(name) && line.len() < 118), "{name}: {text}");
    }
}

#[test]
fn law_numbers_are_converted_to_what_other_sheets_print_or_refused_by_name() {
    let folder = folder();
    let at = folder.path();
    let given = ["convert", "pole_pairs=7", "Kv=900 rpm/V", "L_d=13.5 uH", "L_q=16 uH"];
    let text = String::from_utf8(standstill(&given, at).stdout).expect("text");
    for part in ["875.125 µWb", "Ke_line_rms", "(given)", "vesc_ld_lq_diff", "standstill check mine.toml"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let all: Value =
        serde_json::from_slice(&standstill(&[&given[..], &["--json"]].concat(), at).stdout).expect("JSON");
    let flux = all.as_array().expect("a list").iter().find(|number| number["key"] == "magnet_flux");
    assert!((flux.expect("a flux")["value"].as_f64().expect("a number") / 8.751_25e-4 - 1.0).abs() < 1e-5);
    for (words, part) in [
        (&["convert", "Kv=900"][..], "pole_pairs"),
        (&["convert", "Ke=4"][..], "Ke_line_rms"),
        (&["convert", "resistance=4", "resistance=5"][..], "given twice"),
        (&["convert", "resistance"][..], "KEY=VALUE"),
        (&["convert", "resistance=3 mH"][..], "Ω"),
        (&["convert", "resistance=1e999"][..], "resistance"),
    ] {
        let message = mistake(words, at);
        assert!(message.contains(part), "{words:?}: {message}");
    }
}

/// A sheet may give a resistance between two terminals: a tolerance of a phase's says which key the sheet has, and that one works.
#[test]
fn regress_a_tolerance_of_a_number_that_the_sheet_spells_otherwise_names_its_key() {
    let folder = super::folder();
    let path = folder.path();
    let sheet = sheet(["5", "0.12 Ω", "180 uH", "260 uH", "12 mWb", "20 A", "48 V", "5 %"]);
    let sheet = sheet.replace("resistance = \"0.12 Ω\"", "resistance_line_to_line = \"0.24 Ω\"");
    assert!(sheet.contains("line_to_line"), "{sheet}");
    std::fs::write(path.join("m.toml"), sheet).expect("written");
    let scenario = |key: &str, more: &str| {
        format!(
            "motor = \"m.toml\"\ntrials = 2\n[tolerances]\n\"motor.nameplate.{key}\" = {{ normal = \"5 %\"{more} }}\n"
        )
    };
    for more in ["", ", mean = \"0.12 Ω\""] {
        std::fs::write(path.join("s.toml"), scenario("resistance", more)).expect("written");
        let message = super::mistake(&["run", "s.toml"], path);
        let needed = "needed a tolerance of `motor.nameplate.resistance_line_to_line`";
        assert!(message.contains("s.toml: line 4") && message.contains(needed), "{message}");
    }
    std::fs::write(path.join("s.toml"), scenario("resistance_line_to_line", "")).expect("written");
    let output = super::standstill(&["run", "s.toml"], path);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
