//! Flux maps on the command line.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::{folder, mistake, names, standstill};

/// A map of a motor that saturates and couples its axes, with a curl, up to 12 A.
pub fn write_map(path: &Path, step: usize) {
    let mut text = String::from("i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n");
    for d in (-12..=12).step_by(step) {
        for q in (-12..=12).step_by(step) {
            let (d, q) = (f64::from(d), f64::from(q));
            let psi_d = 0.45 + 0.0106 * d - 2e-5 * d * d - 5e-5 * q * q + 1e-5 * q;
            let psi_q = 0.0169 * q - 1e-4 * d * q;
            let _ = writeln!(text, "{d},{q},{psi_d:.9},{psi_q:.9}");
        }
    }
    fs::write(path, text).expect("written");
}

/// The paper's motor with `map.csv` beside it as its core.
pub fn write_sheet(folder: &Path) {
    let sheet = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../plant/motors/paper-5k5.toml"));
    let sheet = sheet.expect("the data sheet");
    let (head, rest) = sheet.split_once("[saturation]").expect("a table");
    let rotor = &rest[rest.find("[rotor]").expect("a table")..];
    let line = "file = { value = \"map.csv\", source = \"given\", reason = \"measured\" }";
    fs::write(folder.join("own.toml"), format!("{head}[map]\n{line}\n{rotor}")).expect("written");
}

#[test]
fn law_a_scenario_finds_a_motor_and_its_map_and_notices_when_they_change() {
    let folder = folder();
    let at = folder.path();
    fs::create_dir(at.join("motors")).expect("made");
    write_map(&at.join("motors/map.csv"), 4);
    write_sheet(&at.join("motors"));
    let scenario = |tolerance: &str| {
        let text = format!(
            "motor = \"motors/own.toml\"\ntrials = 3\n[tolerances]\n\"{tolerance}\" = {{ normal = \"0 %\" }}\n"
        );
        fs::write(at.join("s.toml"), text).expect("written");
    };
    // Whether a trial has a motor of its own or not, it is the same motor.
    scenario("motor.winding.resistance");
    let run =
        |more: &[&str]| standstill(&[&["run", "s.toml", "--shard", "1/2", "--out", "a"], more].concat(), at);
    let output = run(&[]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let trials = |out: &str| {
        let output = standstill(&["run", "s.toml", "--out", out], at);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = fs::read_to_string(at.join(out).join("trials.csv")).expect("readable");
        text.lines()
            .map(|line| line.split(',').take(8).map(str::to_owned).collect::<Vec<_>>())
            .collect::<Vec<_>>()
    };
    let each = trials("each");
    fs::write(at.join("s.toml"), "motor = \"motors/own.toml\"\ntrials = 3\n").expect("written");
    assert_eq!(each, trials("one"));
    // Another map is another run.
    scenario("motor.winding.resistance");
    let map = fs::read_to_string(at.join("motors/map.csv")).expect("readable");
    fs::write(at.join("motors/map.csv"), format!("{map}\n")).expect("written");
    let message = mistake(&["run", "s.toml", "--shard", "1/2", "--out", "a", "--resume"], at);
    assert!(message.contains("the file motors/map.csv is of "), "{message}");
}

#[test]
fn law_magnetics_reads_flux_maps_and_says_how_far_they_are_from_an_energy() {
    let folder = folder();
    let at = folder.path();
    write_map(&at.join("map.csv"), 1);
    let arguments = ["magnetics", "map.csv", "--pole-pairs", "4", "--resistance", "1.2"];
    let output = standstill(&[&arguments[..], &["--json"]].concat(), at);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(json["polarity_signature"], "normal");
    assert_eq!(json["convex"], true);
    let close = |key: &str, expected: f64| {
        let got = json[key].as_f64().unwrap_or(f64::NAN);
        assert!((got / expected - 1.0).abs() < 1e-3, "{key}: {got} {expected}");
    };
    close("l_d_mH", 10.6);
    close("l_q_mH", 16.9);
    close("open_circuit_flux_Wb", 0.45);
    close("time_constant_d_ms", 10.6 / 1.2);
    // A curl of 10 µH over the rms of the mean of both cross inductances, -1e-4 i_q + 5e-6.
    let mean_square = 1e-8 * (2.0 * 650.0 / 25.0) + 25e-12;
    close("reciprocity_error_rel", 1e-5 / f64::sqrt(mean_square));
    assert!(json["map"]["projection_rms_Wb"].as_f64().expect("a number") < 1e-4);
    let text =
        String::from_utf8(standstill(&[&arguments[..], &["--out", "m"]].concat(), at).stdout).expect("text");
    for part in ["625 points, 25 × 25 grid", "magnet along d", "nearest map with an energy", "L_d/R 8.833 ms"]
    {
        assert!(text.contains(part), "{part} in {text}");
    }

    // What is said of the file is followed: rms values are 1.414 times as large, and inductances as large as before.
    let rms = [&arguments[..], &["--values", "rms", "--columns", "i_d_A,i_q_A,psi_d_Wb,psi_q_Wb", "--json"]]
        .concat();
    let lines = fs::read_to_string(at.join("map.csv")).expect("the map");
    fs::write(at.join("bare.csv"), lines.split_once('\n').expect("lines").1).expect("written");
    let rms: Vec<&str> =
        rms.into_iter().map(|word| if word == "map.csv" { "bare.csv" } else { word }).collect();
    let json: serde_json::Value = serde_json::from_slice(&standstill(&rms, at).stdout).expect("JSON");
    let value = |key: &str| json[key].as_f64().unwrap_or(f64::NAN);
    assert!((value("open_circuit_flux_Wb") / 0.45 - std::f64::consts::SQRT_2).abs() < 1e-3, "{json}");
    assert!((value("l_d_mH") / 10.6 - 1.0).abs() < 1e-3 && value("l_d_error_mH") < 0.02, "{json}");
    assert_eq!(json["map"]["too_coarse"], false);

    // The same map as the core of a data sheet.
    write_sheet(at);
    let output =
        standstill(&["trace", "--motor", "own.toml", "--angle", "40", "--decay", "fast", "--out", "t"], at);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let result = fs::read_to_string(at.join("t/result.json")).expect("result.json");
    let result: serde_json::Value = serde_json::from_str(&result).expect("JSON");
    assert!(result["error_deg"].as_f64().expect("an angle").abs() < 4.0, "{result}");
    let message = mistake(&["reproduce", "--motor", "own.toml", "--magnet-temperature", "1000"], at);
    assert!(message.contains("'1000'") && message.contains("-60 to 300"), "{message}");
}

#[test]
fn law_what_is_wrong_with_a_map_is_named() {
    let folder = folder();
    let at = folder.path();
    write_map(&at.join("map.csv"), 1);
    let whole = fs::read_to_string(at.join("map.csv")).expect("the map");
    let lines: Vec<&str> = whole.lines().collect();
    let write = |name: &str, lines: Vec<String>| fs::write(at.join(name), lines.join("\n")).expect("written");
    let changed = |line: usize, to: &str| {
        let mut all: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
        to.clone_into(&mut all[line - 1]);
        all
    };
    write("nan.csv", changed(7, "-12,-7,NaN,-0.1"));
    write("column.csv", changed(1, "i_d_A,i_q_A,psi_d_H,psi_q_Wb"));
    write("unknown.csv", changed(1, "a,b,c,d"));
    write("row.csv", lines[..26].iter().map(|line| (*line).to_owned()).collect());
    write("falling.csv", changed(300, "-1,11,0.1,0.2"));
    write("half.csv", lines[..=325].iter().map(|line| (*line).to_owned()).collect());
    write("gap.csv", lines[..600].iter().map(|line| (*line).to_owned()).collect());
    let before = names(at);
    let cases: [(&[&str], &[&str]); 19] = [
        (
            &["magnetics", "unknown.csv"],
            &[
                "unknown.csv: line 1",
                "`a,b,c,d`",
                "standstill magnetics unknown.csv --columns i_d_A,i_q_A,psi_d_Wb,psi_q_Wb",
            ],
        ),
        (&["magnetics", "/dev/zero.csv"], &["cannot be read"]),
        (&["magnetics", "paper-5k5", "--values", "rms"], &["--values, --columns and --beyond", "[map]"]),
        (&["magnetics", "nan.csv"], &["nan.csv: line 7", "psi_d_Wb = `NaN`", "a finite number"]),
        (
            &["magnetics", "column.csv"],
            &["column.csv: line 1", "the column `psi_d_H`", "one of the units Wb"],
        ),
        (&["magnetics", "row.csv"], &["row.csv", "only 1 value(s) of i_d", "at least 3"]),
        (&["magnetics", "falling.csv"], &["falling.csv: line 300", "psi_d = 0.1 Wb", "more flux along d"]),
        (&["magnetics", "gap.csv"], &["gap.csv", "no point at i_d = 11 A, i_q = 12 A", "1 of the 24 × 25"]),
        (&["magnetics", "none.csv"], &["none.csv", "No such file"]),
        (&["magnetics", "map.csv", "--pole-pairs", "0"], &["'0'", "--pole-pairs", "from 1 to 200"]),
        (&["magnetics", "map.csv", "--resistance", "-1"], &["'-1'", "--resistance", "positive"]),
        (
            &["magnetics", "map.csv", "--current", "40"],
            &["--current 40", "map.csv", "i_d from -12 to 12 A", "at most 12 A"],
        ),
        (
            &["magnetics", "half.csv"],
            &["half.csv: found i_d from -12 to 0 A", "needed: current to both sides"],
        ),
        (&["magnetics", "paper-5k5", "--pole-pairs", "4"], &["--pole-pairs", "data sheet"]),
        (&["trace", "--angle", "1", "--load", "heavy", "--out", "t"], &["'heavy'", "newton metres"]),
        (
            &["trace", "--angle", "1", "--load", "2", "--out", "t"],
            &["set by --load: `rotor.load`", "locked", "needed `rotor.state` \"free\""],
        ),
        (&["reproduce", "--load", "-0.5", "--out", "t"], &["set by --load: `rotor.load`", "locked"]),
        (
            &["trace", "--angle", "1", "--rotor", "brake", "--motor", "pm-reluctance", "--out", "t"],
            &["set by --rotor: `rotor.state`", "found \"brake\"", "rotor.brake_backlash"],
        ),
        (&["trace", "--angle", "1", "--rotor", "loose", "--out", "t"], &["'loose'", "locked, free, brake"]),
    ];
    for (arguments, parts) in cases {
        let message = mistake(arguments, at);
        for part in parts {
            assert!(message.contains(part), "{arguments:?} says: {message}");
        }
        assert_eq!(names(at), before, "{arguments:?} left something behind");
    }
}

/// The example of own-motor.md with a map of one side of the d-axis, or of both.
fn write_example(folder: &Path, map: &str, more: &str) {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/maps");
    fs::copy(examples.join(map), folder.join("map.csv")).expect("copied");
    let sheet = format!(
        "name = \"example\"\n[rating]\ncurrent = \"8.8 A\"\ndc_link = \"550 V\"\n[winding]\npole_pairs = 2\nresistance = \"0.63 ohm\"\n[map]\nfile = \"map.csv\"\n{more}\n[rotor]\ninertia = \"0.015 kg m²\"\nstiction = \"0.2 N m\"\ncoulomb = \"0.2 N m\"\nviscous = \"0 N m s\"\n"
    );
    fs::write(folder.join("own.toml"), sheet).expect("written");
}

#[test]
fn law_poles_that_a_map_does_not_tell_are_counted_nowhere() {
    let folder = folder();
    let at = folder.path();
    write_example(at, "one_side.csv", "beyond = \"fitted\"");
    // Each second line of currents, 3 A apart: each command reads the map.
    let map = fs::read_to_string(at.join("map.csv")).expect("readable");
    let kept =
        |line: &&str| line.split(',').take(2).all(|cell| cell.parse().is_ok_and(|i: f64| i % 3.0 == 0.0));
    let (head, points) = map.split_at(map.find("\n-18,").expect("points"));
    let points: Vec<&str> = points.lines().filter(kept).collect();
    assert_eq!(points.len(), 49);
    fs::write(at.join("map.csv"), format!("{head}\n{}\n", points.join("\n"))).expect("written");
    let said = |arguments: &[&str]| {
        let output = standstill(arguments, at);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {errors}");
        String::from_utf8(output.stdout).expect("text")
    };
    let note = "not determined by this map";
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words(&said(&["magnetics", "own.toml", "--out", "m"])).contains(note));
    let compare = ["compare", "--motor", "own.toml", "--method", "bipolar", "--errors", "default"];
    let compare = [&compare[..], &["--rotor", "locked", "--trials", "20", "--no-limit"]].concat();
    let rows: serde_json::Value =
        serde_json::from_str(&said(&[&compare[..], &["--json"]].concat())).expect("JSON");
    assert!(rows[0]["pole_note"].as_str().is_some_and(|said| said.contains(note)), "{rows}");
    for key in ["right", "wrong_poles", "wrong_poles_at_most"] {
        assert!(rows[0].get(key).is_some_and(serde_json::Value::is_null), "{key} in {rows}");
    }
    let text = words(&said(&[&compare[..], &["--out", "c"]].concat()));
    assert!(text.contains(note) && text.contains("axis %") && text.contains("axis: starts with"), "{text}");
    assert!(!text.contains("right"), "{text}");
    let table = fs::read_to_string(at.join("c/comparison.csv")).expect("readable");
    assert!(table.lines().next().is_some_and(|head| head.contains("pole_note")), "{table}");
    assert!(table.lines().nth(1).is_some_and(|row| row.contains(note)), "{table}");
    let figure = fs::read_to_string(at.join("c/comparison.svg")).expect("readable");
    assert!(figure.contains("poles not judged"), "the figure does not say it");
    fs::write(at.join("s.toml"), "motor = \"own.toml\"\ntrials = 40\ndetector.method = \"bipolar\"\n")
        .expect("written");
    let text = words(&said(&["run", "s.toml", "--out", "r"]));
    assert!(text.contains(note) && text.contains("wrong poles not judged"), "{text}");
    let scenario = fs::read_to_string(at.join("s.toml")).expect("readable");
    fs::write(at.join("w.toml"), scenario + "[axes]\n\"sensors.noise\" = [\"5 mA\", \"10 mA\"]\n")
        .expect("written");
    let text = words(&said(&["run", "w.toml", "--out", "w"]));
    assert!(text.contains("axis %") && !text.contains("right %"), "{text}");
    said(&["report", "r"]);
    let page = fs::read_to_string(at.join("r/report/report.html")).expect("readable");
    for part in ["poles not judged", "without an axis", note] {
        assert!(page.contains(part), "{part}");
    }
    for part in ["answered rightly", "Probability of a wrong pole:"] {
        assert!(!page.contains(part), "{part}");
    }
}

#[test]
fn law_a_map_that_is_too_coarse_is_said_to_be_so_wherever_it_is_used() {
    let folder = folder();
    let at = folder.path();
    write_example(at, "both_sides.csv", "");
    let said = |arguments: &[&str]| {
        let output = standstill(arguments, at);
        String::from_utf8(output.stdout).expect("text").split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let note = "too coarse for its saturation";
    assert!(said(&["magnetics", "own.toml", "--out", "m"]).contains("TOO COARSE for its saturation"));
    fs::write(at.join("s.toml"), "motor = \"own.toml\"\ntrials = 10\ndetector.method = \"bipolar\"\n")
        .expect("written");
    assert!(said(&["run", "s.toml", "--out", "r"]).contains(note));
    said(&["report", "r"]);
    assert!(fs::read_to_string(at.join("r/report/report.html")).expect("readable").contains(note));
    let few = ["-s", "detector.method=bipolar", "-s", "detector.rounds=3", "-s", "detector.pulse=100us"];
    let few = [&few[..], &["-s", "rotor.state=locked"]].concat();
    assert!(said(&[&["check", "own.toml"], &few[..]].concat()).contains(note));
    let compare = ["compare", "--motor", "own.toml", "--method", "bipolar", "--errors", "default"];
    let compare = [&compare[..], &["--rotor", "locked", "--trials", "10", "--no-limit"]].concat();
    // Its JSON has what its text has (answer.rs).
    assert!(said(&[&compare[..], &["--out", "c"]].concat()).contains(note));
}

#[test]
fn law_a_limit_that_leaves_the_map_is_left_out_and_the_row_says_why() {
    let folder = folder();
    let at = folder.path();
    write_example(at, "both_sides.csv", "");
    let sheet = fs::read_to_string(at.join("own.toml")).expect("readable");
    // Nearly as much current as the map has. Twice the voltage makes twice the current.
    let compare = |link: &str| {
        let sheet = sheet.replace("8.8 A", "17 A").replace("550 V", link);
        fs::write(at.join("own.toml"), sheet).expect("written");
        let start = ["compare", "--motor", "own.toml", "--method", "bipolar", "--errors", "default"];
        let rest = ["--rotor", "locked", "--trials", "10", "--pulse", "900", "--json"];
        let output = standstill(&[&start[..], &rest[..]].concat(), at);
        let rows: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        rows[0].clone()
    };
    let low = compare("550 V");
    assert!(low["bound_deg"].as_f64().is_some_and(|limit| limit > 0.0), "{low}");
    assert!(!low["reasons"].as_str().expect("a text").contains("no limit"), "{low}");
    let high = compare("1100 V");
    assert!(high["bound_deg"].is_null() && high["efficiency"].is_null(), "{high}");
    assert_eq!(high["trials"], 10, "{high}");
    let why = high["reasons"].as_str().expect("a text");
    assert!(why.contains("no limit: the currents left the motor's flux map"), "{high}");
}

#[test]
fn law_a_data_sheet_for_a_map_names_it_and_the_next_command_writes_one() {
    let folder = folder();
    let at = folder.path();
    write_map(&at.join("my map.csv"), 1);
    let text =
        String::from_utf8(standstill(&["magnetics", "my map.csv", "--out", "m"], at).stdout).expect("text");
    assert!(text.contains("standstill init --motor mine.toml --map 'my map.csv'"), "{text}");
    fs::create_dir(at.join("sheets")).expect("made");
    for sheet in ["mine.toml", "sheets/mine.toml"] {
        let output = standstill(&["init", "--motor", sheet, "--map", "my map.csv"], at);
        assert!(output.status.success(), "{output:?}");
        let text = String::from_utf8(standstill(&["motors", sheet], at).stdout).expect("text");
        assert!(text.contains("winding.resistance"), "{text}");
    }
    // A sheet beside its map names it by its name, so that both can be moved.
    assert!(fs::read_to_string(at.join("mine.toml")).expect("a sheet").contains("file = \"my map.csv\""));
    fs::write(at.join("other.csv"), "a,b,c\n1,2,3\n").expect("written");
    let message = mistake(&["init", "--motor", "third.toml", "--map", "other.csv"], at);
    assert!(message.contains("other.csv") && !at.join("third.toml").exists(), "{message}");
    mistake(&["init", "--map", "my map.csv"], at);
}
