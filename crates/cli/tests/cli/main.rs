//! The command as its users meet it: what it prints and writes, and what it says to mistakes.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

mod answers;
mod bits;
#[cfg(target_os = "linux")]
mod broken;
mod budgets;
mod campaigns;
mod changed;
mod checked;
mod circles;
mod clusters;
mod compared;
#[cfg(unix)]
mod completed;
#[cfg(unix)]
mod endless;
#[cfg(unix)]
mod escaped;
mod explained;
mod failing;
mod faults;
mod files;
#[cfg(target_os = "linux")]
mod firmware;
mod fits;
mod fmus;
mod guides;
mod known_traces;
mod lab;
#[cfg(target_os = "linux")]
mod libraries;
mod maps;
mod methods;
mod mistakes;
mod nameplates;
mod nexts;
mod odds;
mod onward;
mod pages;
mod papers;
mod printed;
mod products;
mod promises;
mod qualified;
mod questions;
#[cfg(target_os = "linux")]
mod releases;
mod replaced;
mod reports;
mod requirements;
mod scenarios;
mod sectors;
mod sources;
#[cfg(target_os = "linux")]
mod states;
mod terminal;
mod traces;
mod tuning;
mod widths;
mod wording;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;

/// Runs the program. What it says to people has no number of more than eight decimals, such as 66.11173649763003.
fn standstill(arguments: &[&str], folder: &Path) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_standstill"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts");
    let mut text = String::from_utf8_lossy(&output.stderr).into_owned();
    if !arguments.contains(&"--json") {
        text += &String::from_utf8_lossy(&output.stdout);
    }
    for decimals in text.split('.').skip(1) {
        let count = decimals.bytes().take_while(u8::is_ascii_digit).count();
        assert!(count <= 8, "{arguments:?}: .{}", &decimals[..count]);
    }
    output
}

/// Nothing on standard error but progress, which comes every ten seconds where a machine is slow.
fn quiet(output: &Output) -> bool {
    String::from_utf8_lossy(&output.stderr)
        .lines()
        .all(|line| line.contains(" s left") || line.contains(" after ") || printed::is_progress(line))
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// Runs with a mistake: code 2, and one line on standard error alone.
fn mistake(arguments: &[&str], folder: &Path) -> String {
    let output = standstill(arguments, folder);
    let message = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    assert_eq!(message.lines().count(), 1, "{arguments:?}: {message}");
    message
}

/// Without the note of what was asked.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .filter(|name| ![".standstill-asked.json", ".standstill-scenario.json"].contains(&name.as_str()))
        .collect();
    names.sort();
    names
}

/// promise: bits-threads
#[test]
fn law_reproduce_writes_all_files_and_repeats_itself_on_any_number_of_threads() {
    let folder = folder();
    let run = |out: &str, more: &[&str]| {
        let arguments = [&["reproduce", "--trials", "600", "--out", out], more].concat();
        let output = standstill(&arguments, folder.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(quiet(&output), "quiet in a pipe");
        (fs::read(folder.path().join(out).join("trials.csv")).expect("trials.csv"), output.stdout)
    };
    let (one, text) = run("one", &["--threads", "1"]);
    assert_eq!(one, run("two", &["--threads", "2"]).0);
    assert_eq!(one, run("five", &["--threads", "5"]).0);
    assert_ne!(one, run("other", &["--seed", "2"]).0);

    let text = String::from_utf8(text).expect("text");
    for part in [
        "Table 1, row 4",
        "Table 2, row 5",
        "wrong poles",
        "angle off by > 2°",
        "with an angle",
        "trials.csv",
    ] {
        assert!(text.contains(part), "{part}");
    }
    let expected = [
        "audit.csv",
        "error_over_angle.png",
        "error_over_angle.svg",
        "line_pulses.png",
        "line_pulses.svg",
        "polarity.png",
        "polarity.svg",
        "summary.json",
        "table1.csv",
        "table2.csv",
        "trials.csv",
    ];
    assert_eq!(names(&folder.path().join("one")), expected);

    let trials = String::from_utf8(one).expect("text");
    let header = trials.lines().next().expect("a header");
    let columns =
        "trial,true_angle_deg,estimated_angle_deg,error_deg,outcome,pole_correct,rotor_moved_deg,duration_s";
    assert!(header.starts_with(columns), "{header}");
    assert_eq!(trials.lines().count(), 601);
    for line in trials.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |k: usize| fields[k].parse::<f64>().expect("a number");
        let error = number(3);
        assert!(error > -180.0 && error <= 180.0, "{line}");
        let way = (number(2) - number(1) - error).rem_euclid(360.0);
        assert!(way.min(360.0 - way) < 1e-9, "{line}");
    }
}

#[test]
fn law_a_failed_trial_keeps_its_row() {
    let folder = folder();
    let sheet = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../plant/motors/paper-5k5.toml"))
        .expect("the data sheet");
    // Hardly any saliency: the method must fail, with a reason.
    let weak = sheet.replace("\"-2.1 mH\"", "\"-0.02 mH\"");
    let (head, tail) = weak.split_once("[saturation]").expect("the table");
    let tail = tail.split_once("[rotor]").expect("the table").1;
    fs::write(folder.path().join("weak.toml"), format!("{head}[rotor]{tail}")).expect("written");
    let output =
        standstill(&["reproduce", "--motor", "weak.toml", "--trials", "20", "--out", "out"], folder.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let trials = fs::read_to_string(folder.path().join("out/trials.csv")).expect("trials.csv");
    assert_eq!(trials.lines().count(), 21);
    assert_eq!(trials.matches(",failed,").count(), 20);
    assert!(trials.contains("no saliency"));
}

/// promise: currents-sum-to-zero
#[test]
fn law_trace_writes_waveforms_events_and_result() {
    let folder = folder();
    let arguments =
        ["trace", "--angle", "241.6", "--decay", "fast", "--rotor", "free", "--verify", "--out", "t"];
    let output = standstill(&arguments, folder.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let out = folder.path().join("t");
    let files = [
        "events.csv",
        "result.json",
        "trace.html",
        "verify.csv",
        "waveform.csv",
        "waveform.png",
        "waveform.svg",
    ];
    assert_eq!(names(&out), files);
    let verify = fs::read_to_string(out.join("verify.csv")).expect("verify.csv");
    assert!(verify.lines().count() > 20 && verify.contains("numerics"));
    for line in verify.lines().skip(1) {
        let error = |k: usize| line.split(',').nth(k).and_then(|e| e.parse::<f64>().ok()).expect("a number");
        assert!((4..7).all(|k| error(k).abs() < 1e-4), "a hundredth of the default noise: {line}");
    }

    let waveform = fs::read_to_string(out.join("waveform.csv")).expect("waveform.csv");
    let header = waveform.lines().next().expect("a header");
    let columns = "t_s,i_a_A,i_b_A,i_c_A,v_a_V,v_b_V,v_c_V,theta_deg,mode_a,mode_b,mode_c,u_dc_V,omega_electrical_rad_per_s,torque_Nm,i_leg_a_A,i_leg_b_A,i_leg_c_A,i_link_A,run";
    assert_eq!(header, columns);
    let mut last = -1.0;
    for line in waveform.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |k: usize| fields[k].parse::<f64>().expect("a number");
        assert!(number(0) >= last, "time runs backwards: {line}");
        last = number(0);
        assert!((number(1) + number(2) + number(3)).abs() < 1e-8, "currents sum to zero: {line}");
        for (k, current) in [(8, number(1)), (9, number(2)), (10, number(3))] {
            assert!(
                fields[k] != "blocked" || current.abs() < 1e-7,
                "a blocked leg carries no current: {line}"
            );
        }
    }
    let events = fs::read_to_string(out.join("events.csv")).expect("events.csv");
    for event in ["gate", "conduction", "sample", "command"] {
        assert!(events.contains(&format!(",{event},")), "{event}");
    }
    let result = fs::read_to_string(out.join("result.json")).expect("result.json");
    let result: serde_json::Value = serde_json::from_str(&result).expect("JSON");
    assert_eq!(result["outcome"], "found");
    assert_eq!(result["pole_correct"], true);
    let error = &result["numerical_error"];
    let (current, noise) = (error["current_A"].as_f64(), error["sensor_noise_A"].as_f64());
    assert!(current.zip(noise).is_some_and(|(current, noise)| current < noise / 100.0 && current > 0.0));
    assert!(result["energy_J"]["imbalance"].as_f64().is_some_and(|joule| joule.abs() < 1e-6));
}

#[test]
fn law_motors_names_the_source_of_each_number() {
    let folder = folder();
    let text = String::from_utf8(standstill(&["motors", "paper-5k5"], folder.path()).stdout).expect("text");
    for part in ["paper-5k5", "given", "inferred", "assumed", "9.2 mH", "winding.magnet_flux"] {
        assert!(text.contains(part), "{part}");
    }
    let one =
        String::from_utf8(standstill(&["motors", "gearless-hoist"], folder.path()).stdout).expect("text");
    assert!(!one.contains("paper-5k5:"));
}

#[test]
fn law_magnetics_tells_which_pole_draws_more_current() {
    let folder = folder();
    for (motor, signature) in
        [("paper-5k5", "normal"), ("pm-reluctance", "inverted"), ("reluctance-6k7", "none")]
    {
        let output = standstill(&["magnetics", motor, "--json"], folder.path());
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(json["polarity_signature"], signature, "{motor}");
        assert_eq!(json["convex"], true, "{motor}");
        for key in ["reciprocity_error_rel", "open_circuit_flux_Wb", "l_d_mH", "l_q_mH"] {
            assert!(json[key].is_number(), "{motor}: {key}");
        }
    }
    assert!(names(folder.path()).is_empty(), "--json writes no file");
    assert!(standstill(&["magnetics", "paper-5k5", "--out", "m"], folder.path()).status.success());
    assert_eq!(names(&folder.path().join("m")), ["magnetics.html", "magnetics.png", "magnetics.svg"]);
}

/// promise: mistakes-leave-nothing
#[test]
fn law_mistakes_are_named_in_a_line_and_leave_nothing_behind() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("taken"), "a file").expect("written");
    fs::create_dir_all(at.join("blocked/trials.csv")).expect("made");
    fs::write(at.join("broken.toml"), "name = \"x\"\ntitel = \"y\"\n").expect("written");

    let sheet = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../plant/motors/paper-5k5.toml"))
        .expect("the data sheet");
    let damaged = [
        ("negative", "\"1.2 Ω\"", "\"-1.2 Ω\""),
        ("unit", "\"1.2 Ω\"", "\"1.2 mH\""),
        ("poles", "value = 4,", "value = 0,"),
        ("winding", "\"9.2 mH\"", "\"10 mH\""),
        ("key", "\nresistance", "\nresistence"),
    ];
    for (name, from, to) in damaged {
        fs::write(at.join(format!("{name}.toml")), sheet.replacen(from, to, 1)).expect("written");
    }
    let before = names(at);

    let cases: [(&[&str], &[&str]); 26] = [
        (
            &["reproduce", "--motor", "nosuch"],
            &["set by --motor: `motor`: found `nosuch`", "paper-5k5", "gearless-hoist"],
        ),
        (&["reproduce", "--motor", "missing.toml"], &["set by --motor", "missing.toml", "No such file"]),
        (&["reproduce", "--motor", "broken.toml"], &["broken.toml", "line 2", "titel"]),
        (&["reproduce", "--trials", "0"], &["'0'", "--trials"]),
        (&["reproduce", "--trials", "many"], &["'many'", "--trials"]),
        (&["reproduce", "--errors", "big"], &["'big'", "none, noise, default, harsh, field"]),
        (&["reproduce", "--seed", "-1"], &["'-1'", "--seed", "whole number from 0"]),
        (&["reproduce", "--trials", "-1"], &["'-1'", "--trials", "whole number from 1 to 100,000,000"]),
        (
            &["reproduce", "--motor", "negative.toml"],
            &["negative.toml", "winding.resistance", "-1.2 Ω", "positive"],
        ),
        (
            &["reproduce", "--motor", "unit.toml"],
            &["unit.toml", "line 17", "`winding.resistance`", "`1.2 mH`", "Ω"],
        ),
        (&["reproduce", "--motor", "poles.toml"], &["poles.toml", "winding.pole_pairs", "is 0", "1 to 200"]),
        (
            &["reproduce", "--motor", "winding.toml"],
            &["winding.toml", "winding.mean_inductance", "within 2 %"],
        ),
        (&["reproduce", "--motor", "key.toml"], &["key.toml", "line 17", "resistence", "resistance"]),
        (&["motors", "negative.toml"], &["negative.toml", "winding.resistance"]),
        (&["trace", "--angle", "-inf", "--out", "t"], &["'-inf'", "degrees from -360 to 360"]),
        (&["trace", "--angle", "400", "--out", "t"], &["'400'", "degrees from -360 to 360"]),
        (&["reproduce", "--out", "taken"], &["taken is not a folder"]),
        (&["reproduce", "--out", "taken/below"], &["taken is not a folder"]),
        (&["reproduce", "--out", "blocked"], &["trials.csv is a folder"]),
        (&["trace", "--angle", "north", "--out", "t"], &["'north'", "degrees from -360 to 360"]),
        (&["trace", "--angle", "inf", "--out", "t"], &["'inf'", "degrees from -360 to 360"]),
        (&["magnetics", "nosuch"], &["unknown motor `nosuch`"]),
        (&["magnetics", "paper-5k5", "--current", "0"], &["'0'", "number of amperes from 1e-6 to 100,000"]),
        (&["motors", "nosuch"], &["unknown motor `nosuch`"]),
        (&["run", "outruner"], &["unknown motor `outruner` (did you mean `outrunner`?)"]),
        (&["motors", "outruner"], &["unknown motor `outruner` (did you mean `outrunner`?)", "paper-5k5"]),
    ];
    for (arguments, parts) in cases {
        let message = mistake(arguments, at);
        for part in parts {
            assert!(message.contains(part), "{arguments:?} says: {message}");
        }
        assert_eq!(names(at), before, "{arguments:?} left something behind");
    }
    assert_eq!(names(&at.join("blocked")), ["trials.csv"]);
}

/// promise: ctrl-c-keeps
#[test]
fn law_an_interrupt_keeps_what_is_done() {
    let folder = folder();
    let child = Command::new(env!("CARGO_BIN_EXE_standstill"))
        .args(["reproduce", "--trials", "1000000", "--out", "out"])
        .current_dir(folder.path())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the program starts");
    // Wait for the first block's rows to reach the file in the making, however slow the machine.
    let rows_written = || {
        let entries = fs::read_dir(folder.path().join("out")).into_iter().flatten().flatten();
        entries
            .map(|entry| entry.path().join("trials.csv"))
            .any(|path| path.metadata().is_ok_and(|m| m.len() > 0))
    };
    for _ in 0..600 {
        if rows_written() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(killed.expect("kill").success());
    let output = child.wait_with_output().expect("it ends");
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(130), "{text}");
    assert!(text.contains("Interrupted:"), "{text}");
    let trials = fs::read_to_string(folder.path().join("out/trials.csv")).expect("trials.csv");
    let done = trials.lines().count() - 1;
    assert!(done > 0 && done < 1_000_000 && trials.ends_with('\n'), "{done}");
}
