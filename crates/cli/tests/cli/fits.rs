//! `standstill fit`: its files, and what it says to traces that are none.

use std::fs;

use serde_json::Value;

use super::{folder, mistake, names, standstill};

const TRACE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/traces/six_vectors.csv");

#[test]
fn law_a_trace_becomes_a_motor_that_loads() {
    let folder = folder();
    let at = folder.path();
    let output = standstill(&["fit", TRACE, "--motor", "paper-5k5", "--out", "f", "--json"], at);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(names(&at.join("f")), ["fit.csv", "fit.html", "fit.json", "fit.png", "fit.svg", "motor.toml"]);
    // Another fit does not take its place without leave.
    let message = mistake(&["fit", TRACE, "--motor", "gearless-hoist", "--out", "f"], at);
    assert!(message.contains("f/motor.toml: found the results of another run"), "{message}");
    let said: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let kept: Value =
        serde_json::from_str(&fs::read_to_string(at.join("f/fit.json")).expect("written")).expect("JSON");
    assert_eq!(said, kept);
    let get = |name: &str| {
        let all = said["parameters"].as_array().expect("a list");
        all.iter().find(|one| one["name"] == name).unwrap_or_else(|| panic!("no {name}"))
    };
    // The core of tests/cross/scipy_pulses.py, by channels with a common gain of 1.
    for (name, truth) in [("L_d", 10.6495e-3), ("L_q", 16.9492e-3), ("angle", 40.0), ("resistance", 1.2)] {
        let one = get(name);
        let [low, high] = ["low", "high"].map(|end| one[end].as_f64().expect("a number"));
        assert!(one["identified"] == true && low < high, "{one}");
        let half = (high - low) / 2.0;
        assert!((truth - low.midpoint(high)).abs() < 1.5 * half, "{one}");
    }
    assert_eq!(get("common_gain")["identified"], false);
    assert_eq!(said["pole"]["identified"], true);
    assert!(said["residual_rms_A"].as_f64().is_some_and(|rms| rms > 0.02 && rms < 0.06));
    let sheet = fs::read_to_string(at.join("f/motor.toml")).expect("written");
    assert!(sheet.matches("source = \"measured\"").count() >= 5, "{sheet}");
    // The pulses reached 7.1 A along −d and 4.8 A along q, and the motor's saturation is stated at 8 A.
    assert_eq!(sheet.matches("extrapolated: the pulses reached").count(), 2, "{sheet}");
    let stated_at = |name: &str| get(name)["at_A"].as_f64().expect("a current");
    assert!(
        (stated_at("saturation.d") - 8.0).abs() < 1e-9 && (4.0..5.5).contains(&stated_at("saturation.q"))
    );
    let shown = String::from_utf8(standstill(&["motors", "f/motor.toml"], at).stdout).expect("text");
    assert!(shown.lines().any(|line| line.contains("nameplate.L_d") && line.contains("measured")), "{shown}");
    let traced =
        ["trace", "--motor", "f/motor.toml", "--angle", "40", "--method", "maximum-likelihood", "--out", "t"];
    assert!(standstill(&traced, at).status.success());
}

/// Times in s with a value of a column each, of a table that `trace` wrote; rows without a value are left out.
fn column(table: &str, name: &str) -> Vec<(f64, String)> {
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    let place = header.iter().position(|head| *head == name).expect("the column");
    let rows = lines.filter(|row| row.len() > place && !row[place].is_empty());
    rows.map(|row| (row[0].parse().expect("a time"), row[place].to_owned())).collect()
}

/// A drive with one shunt in its DC link, as `trace` simulates and exports it: the shunt's current, rounded to 5 mA with a step of noise, and the
/// gates as they were asked for give the motor back. Pulses along one line alone are refused by name.
#[test]
fn law_the_exported_current_of_one_shunt_gives_the_motor_back() {
    let folder = folder();
    let at = folder.path();
    let shunt = "sensors.arrangement=dc-link-shunt";
    let traced = ["trace", "--motor", "paper-5k5", "--method", "maximum-likelihood", "--errors", "none"];
    let output = standstill(&[&traced[..], &["--angle", "40", "-s", shunt, "--out", "t"]].concat(), at);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let table = |name: &str| fs::read_to_string(at.join("t").join(name)).expect("written");
    let current: Vec<(f64, f64)> = column(&table("waveform.csv"), "i_link_A")
        .into_iter()
        .map(|(time, current)| (time, current.parse().expect("a current")))
        .collect();
    let gates: Vec<(f64, usize, String)> = table("events.csv")
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>())
        .filter(|row| row[1] == "gate")
        .map(|row| {
            let leg = "abc".find(row[2]).expect("a leg");
            (row[0].parse().expect("a time"), leg, row[3].to_owned())
        })
        .collect();
    let mut rows = vec!["t_s,i_link_A,u_dc_V,leg_a,leg_b,leg_c".to_owned()];
    let (mut place, mut change, mut noise) = (0, 0, 1_u64);
    let mut legs = ["off"; 3].map(str::to_owned);
    let end = current[current.len() - 1].0;
    for time in (0_u32..).map(|k| 2.037e-6 * f64::from(k)).take_while(|time| *time < end) {
        while let Some((_, leg, to)) = gates.get(change).filter(|(from, ..)| *from <= time) {
            legs[*leg].clone_from(to);
            change += 1;
        }
        while current[place + 1].0 <= time {
            place += 1;
        }
        let ((from, a), (to, b)) = (current[place], current[place + 1]);
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let read =
            a + (b - a) * (time - from) / (to - from) + 5e-3 * ((noise >> 40) as f64 / 2_f64.powi(23) - 1.0);
        let code = (read / 5e-3).round() * 5e-3;
        rows.push(format!("{time:.9},{code:.3},550,{}", legs.join(",")));
    }
    let text = rows.join("\n") + "\n";
    fs::write(at.join("shunt.csv"), &text).expect("written");
    // An ideal bridge, as error set `none` has it.
    let ideal = [
        "switch_drop=0 V",
        "diode_drop=0 V",
        "switch_resistance=0 ohm",
        "diode_resistance=0 ohm",
        "dead_time=0 s",
    ];
    let ideal = ideal.map(|key| format!("inverter.{key}"));
    let known = ideal.iter().flat_map(|key| ["-s", key]);
    let asked: Vec<&str> = ["fit", "shunt.csv", "--motor", "gearless-hoist", "--out", "f", "--json"]
        .into_iter()
        .chain(known)
        .collect();
    let output = standstill(&asked, at);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(said["describes"] == true && said["converged"] == true && said["pulses"] == 18, "{said:#}");
    // What coverage shows of one shunt is said with each answer.
    let page = fs::read_to_string(at.join("f/fit.html")).expect("a page");
    assert!(said["intervals_too_narrow"] == true && page.contains("Take twice the interval"), "{said:#}");
    for (name, truth) in [("L_d", 10.65e-3), ("L_q", 16.95e-3), ("angle", 40.0), ("resistance", 1.2)] {
        let all = said["parameters"].as_array().expect("a list");
        let one = all.iter().find(|one| one["name"] == name).expect("named");
        let [value, low, high] = ["value", "low", "high"].map(|key| one[key].as_f64().expect("a number"));
        let half = (high - low) / 2.0;
        assert!(one["identified"] == true && (truth - low.midpoint(high)).abs() < 1.5 * half, "{one}");
        assert!(half < 0.2 * value, "{one}");
    }
    assert_eq!(
        said["parameters"].as_array().map(|all| all.iter().any(|one| one["name"] == "gain_link")),
        Some(false)
    );
    // The first two pulses go along one line.
    let line: String = text
        .lines()
        .take_while(|line| !line.starts_with("0.0013"))
        .map(|line| line.to_owned() + "\n")
        .collect();
    fs::write(at.join("line.csv"), line).expect("written");
    let message = mistake(&["fit", "line.csv", "--out", "g"], at);
    assert!(message.contains("found pulses along one axis and the current of one shunt"), "{message}");
    let message = mistake(&["fit", TRACE, "-s", "sensors.settle=1 us", "--out", "g"], at);
    assert!(message.contains("-s sensors.settle: needed a trace with i_link_A"), "{message}");
}

/// The trace's dead time is 2 µs, known to within 0.7 of the 2 µs between two rows. One that is stated otherwise is contradicted, in a
/// sentence and with what to do next.
#[test]
fn regress_a_stated_number_that_the_currents_contradict_is_said() {
    let folder = folder();
    let at = folder.path();
    let said = |dead_time: &str| {
        let set = format!("inverter.dead_time={dead_time}");
        let output =
            standstill(&["fit", TRACE, "--motor", "paper-5k5", "-s", &set, "--out", "f", "--force"], at);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).expect("text");
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let text = said("6 us");
    assert!(text.contains("standard deviations below the stated 6 µs: one of the two is wrong"), "{text}");
    assert!(text.contains("For dead_time: measure both gate signals of a leg and state it"), "{text}");
    let kept = fs::read_to_string(at.join("f/fit.json")).expect("written");
    let kept: Value = serde_json::from_str(&kept).expect("JSON");
    let one = &kept["discrepancies"][0];
    assert!(one["name"] == "dead_time" && one["stated"] == true, "{one}");
    assert!(one["deviations"].as_f64().is_some_and(|deviations| deviations < -3.0), "{one}");
    assert!(!said("2 us").contains("standard deviations below the stated"));
}

#[test]
fn law_mistakes_in_traces_name_file_line_and_column_and_leave_nothing() {
    let folder = folder();
    let at = folder.path();
    let trace = fs::read_to_string(TRACE).expect("the trace");
    let fail = |text: &str, more: &[&str]| {
        fs::write(at.join("p.csv"), text).expect("written");
        let message = mistake(&[&["fit", "p.csv"], more].concat(), at);
        assert_eq!(names(at), ["p.csv"], "{message}");
        message
    };
    let changed = |line: usize, from: &str, to: &str| {
        let lines = trace.lines().enumerate();
        let change =
            |(k, row): (usize, &str)| if k + 1 == line { row.replacen(from, to, 1) } else { row.to_owned() };
        lines.map(change).collect::<Vec<_>>().join("\n")
    };
    let message = fail(&changed(700, "off", "open"), &[]);
    assert!(
        message.contains("p.csv, line 700, column leg_a: found `open`; needed: off, low or high"),
        "{message}"
    );
    let message = fail(&trace.replace("u_dc_V", "u_V"), &[]);
    assert!(
        message.contains(
            "p.csv, line 1: found no column u_dc_V, but the unknown `u_V`; needed: all of t_s, i_a_A"
        ),
        "{message}"
    );
    let message = fail(&trace, &["-s", "sensors.noise=1 A"]);
    assert!(message.contains("-s sensors.noise: needed a key of the drive"), "{message}");
    let message = fail(&trace, &["-s", "inverter.carrier_period=100 us"]);
    assert!(message.contains("needed a key of the drive that a fit uses: inverter.devices"), "{message}");
    assert!(fail(&trace, &["p.csv"]).contains("found the same file twice"));
    assert!(fail(&trace, &["./p.csv"]).contains("found the same file twice"));
    let message = fail(&trace.replace("high", "off"), &[]);
    assert!(message.contains("needed: a pulse"), "{message}");
    let still: String = trace
        .lines()
        .enumerate()
        .map(|(k, row)| {
            let mut fields: Vec<&str> = row.split(',').collect();
            if k > 0 {
                fields[1..4].fill("0");
            }
            fields.join(",") + "\n"
        })
        .collect();
    let message = fail(&still, &[]);
    assert!(message.contains("found no current that rises in a pulse"), "{message}");
    assert!(mistake(&["fit", "none.csv"], at).contains("cannot read none.csv"));
    assert!(mistake(&["fit", "p.csv", "--motor", "nosuch"], at).contains("nosuch"));
}

#[test]
fn law_no_file_that_is_read_is_overwritten() {
    let folder = folder();
    let at = folder.path();
    let sheet = "[nameplate]\n";
    fs::write(at.join("motor.toml"), sheet).expect("written");
    let message = mistake(&["fit", TRACE, "--motor", "motor.toml", "--out", "."], at);
    assert!(message.contains("motor.toml there is motor.toml, which is read"), "{message}");
    assert_eq!(fs::read_to_string(at.join("motor.toml")).expect("still there"), sheet);
}

/// The link sags by a quarter in each pulse as it is recorded, and the last pulse's currents are a fifth too large: the answer names the swing,
/// asks for other records, and says what share of the currents is not described.
#[test]
fn regress_a_link_that_sags_is_named_with_what_to_record() {
    let folder = folder();
    let at = folder.path();
    let trace = fs::read_to_string(TRACE).expect("the trace");
    let (header, rows) = trace.split_once('\n').expect("rows");
    let place = header.split(',').position(|name| name == "u_dc_V").expect("the column");
    let (mut driven, mut pulses) = (0, 0);
    let sagging: Vec<String> = rows
        .lines()
        .map(|row| {
            let mut fields: Vec<String> = row.split(',').map(str::to_owned).collect();
            driven = if row.contains("high") && row.contains("low") { driven + 1 } else { 0 };
            fields[place] = format!("{:.2}", 550.0 - 1.2 * f64::from(driven));
            pulses += u32::from(driven == 1);
            for field in fields[1..4].iter_mut().filter(|_| pulses == 6) {
                *field = format!("{:.6}", 1.2 * field.parse::<f64>().expect("a current"));
            }
            fields.join(",")
        })
        .collect();
    fs::write(at.join("soft.csv"), header.to_owned() + "\n" + &sagging.join("\n")).expect("written");
    let output = standstill(&["fit", "soft.csv", "--motor", "paper-5k5", "--out", "f"], at);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("text");
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("does NOT describe these currents: residual"), "{text}");
    let (_, share) = text.split_once(" rms (").expect("a share");
    let (share, rest) = share.split_once(" % of the currents)").expect("a share");
    assert!((2.0..15.0).contains(&share.parse::<f64>().expect("a number")), "{share}");
    assert!(rest.starts_with(", noise and converter"), "{rest}");
    assert!(text.contains("The DC link of soft.csv moves between 41"), "{text}");
    assert!(text.contains("For a steadier DC link: record shorter pulses"), "{text}");
}

/// A record whose phases are renamed in a circle is one of a rotor 120° away. Of two such files the program names neither, since either may be wrong: it
/// asks for a fit of each. Of four files it asks to leave out the one that differs.
#[test]
fn law_files_of_different_rotor_positions_lead_to_a_fit_of_each() {
    let folder = folder();
    let at = folder.path();
    // Each second row, which tells as much of where a rotor stands.
    let trace = fs::read_to_string(TRACE).expect("the trace");
    let trace: Vec<&str> =
        trace.lines().enumerate().filter(|(line, _)| line % 2 == 0).map(|(_, row)| row).collect();
    let trace = trace.join("\n");
    let turned: Vec<String> = trace
        .lines()
        .enumerate()
        .map(|(line, row)| {
            let of: Vec<&str> = row.split(',').collect();
            let order = if line == 0 { [0, 1, 2, 3, 4, 5, 6, 7] } else { [0, 3, 1, 2, 4, 7, 5, 6] };
            order.map(|column| of[column]).join(",")
        })
        .collect();
    fs::write(at.join("turned.csv"), turned.join("\n")).expect("written");
    fs::write(at.join("here.csv"), &trace).expect("written");
    for name in ["again.csv", "more.csv"] {
        fs::write(at.join(name), &trace).expect("written");
    }
    let said = |files: &[&str]| {
        let asked = [&["fit"], files, &["--motor", "paper-5k5", "--out", "f", "--force"]].concat();
        let output = standstill(&asked, at);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).expect("text");
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let two = said(&["here.csv", "turned.csv"]);
    assert!(two.contains("does NOT describe these currents"), "{two}");
    assert!(
        two.contains("by itself: standstill fit here.csv --out ANOTHER, and so on up to turned.csv"),
        "{two}"
    );
    // As it says: each alone is described, 120° from the other.
    for file in ["here.csv", "turned.csv"] {
        let alone = said(&[file]);
        assert!(!alone.contains("does NOT describe") && !alone.contains("by itself"), "{alone}");
    }
    let four = said(&["here.csv", "turned.csv", "again.csv", "more.csv"]);
    assert!(four.contains("Leave out turned.csv, or record its pulses again with the rotor held"), "{four}");
}
