//! Data sheets that are no motor, and what is said of them.

use std::fmt::Write as _;
use std::path::Path;

use standstill_interface::Dq;
use standstill_plant::{DataSheet, Magnetics, Motor, MotorError, PoleKnowledge, Source, built_in};

/// The text of a built-in data sheet.
fn built_in_text(name: &str) -> &'static str {
    match name {
        "reluctance-6k7" => include_str!("../motors/reluctance-6k7.toml"),
        _ => include_str!("../motors/paper-5k5.toml"),
    }
}

/// What is said of a built-in data sheet after a change of its text.
fn refused(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    let sheet = DataSheet::parse("own.toml", &text.replacen(from, to, 1)).expect("its keys are right");
    sheet.motor().expect_err("must be refused").to_string()
}

#[test]
fn regress_the_harmonic_that_is_too_large_is_the_one_named() {
    let text = include_str!("../motors/paper-5k5.toml");
    let entry = |key: &str, value: &str| {
        format!("{key} = {{ value = \"{value}\", source = \"assumed\", reason = \"a test\" }}\n")
    };
    let with = |lines: String| refused(text, "[rotor]", &format!("[harmonics]\n{lines}\n[rotor]"));
    let error = with(entry("asymmetry", "20 mH"));
    assert!(
        error.starts_with("own.toml: line 37, `harmonics.asymmetry` is 20 mH") && error.contains("half"),
        "{error}"
    );
    let error = with(entry("inductance_4", "9 mH") + &entry("asymmetry", "0.1 mH"));
    assert!(error.starts_with("own.toml: line 37, `harmonics.inductance_4` is 9 mH"), "{error}");
    let error = with(entry("inductance_4", "0.1 mH") + &entry("asymmetry", "-20 mH"));
    assert!(error.starts_with("own.toml: line 38, `harmonics.asymmetry` is -20 mH"), "{error}");
}

/// A built-in data sheet of a map of its core in this folder, its currents in A times `current`, and with a share `trace`
/// of the largest flux more along d.
fn on_a_map(folder: &Path, name: &str, current: f64, trace: f64, d: &[f64], q: &[f64]) -> String {
    let core = built_in(name).expect("built in").magnetics.core().clone();
    let largest = core.flux_at(Dq::new(d[d.len() - 1], 0.0)).expect("convex").d;
    let mut text = "i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n".to_owned();
    for (i_d, i_q) in d.iter().flat_map(|d| q.iter().map(move |q| (*d, *q))) {
        let flux = core.flux_at(Dq::new(i_d, i_q)).expect("convex");
        let psi_d = flux.d + trace * largest;
        let _ = writeln!(text, "{},{},{psi_d},{}", i_d * current, i_q * current, flux.q);
    }
    std::fs::write(folder.join("map.csv"), text).expect("written");
    let sheet = built_in_text(name);
    let (head, rest) = sheet.split_once("[saturation]").expect("a table");
    let stated =
        |line: &&str| ["mean_ind", "saliency", "leakage", "magnet_f"].iter().any(|key| line.starts_with(key));
    let kept: Vec<&str> = head.lines().filter(|line| !stated(line)).collect();
    let file = "[map]\nfile = { value = \"map.csv\", source = \"given\", reason = \"a test\" }\n\n";
    let rotor = &rest[rest.find("[rotor]").expect("a table")..];
    (kept.join("\n") + "\n\n" + file + rotor).replace("\"8 A\"", &format!("\"{} A\"", 8.0 * current))
}

#[test]
fn regress_a_map_that_ends_before_a_detection_does_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path().join("own.toml").display().to_string();
    let axis = |low: f64, high: f64| -> Vec<f64> {
        (0..=16).map(|k| low + (high - low) * f64::from(k) / 16.0).collect()
    };
    let motor = |d: [f64; 2], q: [f64; 2]| {
        let text = on_a_map(folder.path(), "paper-5k5", 1.0, 0.0, &axis(d[0], d[1]), &axis(q[0], q[1]));
        DataSheet::parse(&at, &text).expect("its keys are right").motor()
    };
    motor([-8.4, 8.4], [-9.0, 8.4]).expect("a motor");
    // Half of i_q is continued by symmetry, half of i_d is not.
    motor([-8.4, 8.4], [0.0, 8.4]).expect("a motor");
    // Unless it is asked for, which the message says where it would help.
    let error = motor([-12.0, 0.0], [-12.0, 12.0]).expect_err("must be refused").to_string();
    assert!(error.contains("or beyond = \"fitted\" in [map]"), "{error}");
    let error = motor([-8.0, 8.0], [-12.0, 12.0]).expect_err("must be refused").to_string();
    assert!(!error.contains("beyond"), "{error}");
    let text = on_a_map(folder.path(), "paper-5k5", 1.0, 0.0, &axis(-12.0, 0.0), &axis(0.0, 12.0));
    let fitted = DataSheet::parse(&at, &text.replace("[map]", "[map]\nbeyond = \"fitted\"")).expect("keys");
    assert_eq!(fitted.motor().expect("a motor").pole_knowledge(), PoleKnowledge::Assumed);
    for (d, q, found) in [
        ([-12.0, 0.0], [-12.0, 12.0], "i_d from -12 to 0 A, i_q from -12 to 12 A"),
        ([-8.0, 8.0], [-12.0, 12.0], "i_d from -8 to 8 A"),
        ([-12.0, 12.0], [-8.3, 12.0], "i_q from -8.3 to 12 A"),
    ] {
        let error = motor(d, q).expect_err("must be refused").to_string();
        assert!(error.starts_with(&at) && error.contains(", `map.file` is map.csv with "), "{error}");
        assert!(error.contains(found) && error.contains("at least ±8.4000 A along d and q"), "{error}");
    }
}

#[test]
fn law_a_map_says_once_whether_there_is_a_magnet() {
    let folder = tempfile::tempdir().expect("a folder");
    let map = |name: &str, current: f64, trace: f64| {
        let reach = 1.5 * built_in(name).expect("built in").rated_current;
        let axis: Vec<f64> = (-8..=8).map(|k| reach * f64::from(k) / 8.0).collect();
        on_a_map(folder.path(), name, current, trace, &axis, &axis)
    };
    let at = folder.path().join("own.toml").display().to_string();
    let motor = |text: &str| DataSheet::parse(&at, text).expect("its keys are right").motor();
    // A trace of flux that a measurement left is no magnet, for anyone.
    let text = map("reluctance-6k7", 1.0, 0.01);
    let own = motor(&text).expect("a motor");
    assert!(own.magnet_flux == 0.0 && !own.has_magnet());
    // Nor can it be declared one.
    let flux = "[winding]\nmagnet_flux = { value = \"0.008 Wb\", source = \"assumed\", reason = \"a test\" }";
    let error = motor(&text.replace("[winding]", flux)).expect_err("must be refused").to_string();
    assert!(error.contains("`winding.magnet_flux`") && error.contains("makes it, 0 Wb"), "{error}");
    // A magnet stays one in a motor of microamperes.
    let own = motor(&map("paper-5k5", 1e-6, 0.0)).expect("a motor");
    assert!((own.magnet_flux - 0.45).abs() < 1e-3 && own.has_magnet(), "{}", own.magnet_flux);
}

#[test]
fn analytic_cogging_has_an_even_number_of_periods() {
    let lcm = |a: u32, b: u32| (1..=b).map(|k| k * a).find(|n| n % b == 0).expect("the product");
    for (slots, pole_pairs) in (3..=96).step_by(3).flat_map(|slots| (1..=30).map(move |p| (slots, p))) {
        assert_eq!(lcm(slots, 2 * pole_pairs) / pole_pairs % 2, 0, "{slots} slots, {pole_pairs} pole pairs");
    }
    let text = include_str!("../motors/slot-harmonics.toml");
    let error = refused(text, "cogging_periods = { value = 6", "cogging_periods = { value = 9");
    assert!(error.contains(", `rotor.cogging_periods` is 9") && error.contains("even"), "{error}");
}

#[test]
fn regress_the_flux_of_a_small_motor_must_agree_as_well() {
    let mut text = include_str!("../motors/paper-5k5.toml").to_owned();
    for (from, to) in [
        ("\"9.2 mH\"", "\"9.2 µH\""),
        ("\"-2.1 mH\"", "\"-2.1 µH\""),
        ("a_d0 = { value = 89.14", "a_d0 = { value = 93897"),
        ("a_dd = { value = 43.0", "a_dd = { value = 0"),
        ("a_q0 = { value = 59.0", "a_q0 = { value = 58997"),
        ("\"40.47 A\"", "\"8 A\""),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    // 8 A · 10.65 µH = 85.2 µWb.
    let error = refused(&text, "\"0.45 Wb\"", "\"0.02 mWb\"");
    assert!(error.contains("winding.magnet_flux") && error.contains("85.2 µWb"), "{error}");
    let good = DataSheet::parse("own.toml", &text.replacen("\"0.45 Wb\"", "\"0.0852 mWb\"", 1));
    good.and_then(|sheet| sheet.motor()).expect("a motor");
}

#[test]
fn law_a_plain_number_is_given_without_a_reason() {
    let whole = include_str!("../motors/paper-5k5.toml");
    let line = whole.lines().find(|line| line.starts_with("resistance = ")).expect("a resistance");
    let value = line.split('"').nth(1).expect("a quantity");
    let sheet = |line_of: &str| {
        DataSheet::parse("own.toml", &whole.replace(line, line_of)).expect("its keys are right")
    };
    let expected = sheet(line).motor().expect("a motor");
    for plain in [format!("resistance = \"{value}\""), format!("resistance = {}", expected.resistance)] {
        let sheet = sheet(&plain);
        assert_eq!(sheet.motor().expect("a motor"), expected, "{plain}");
        let entries = sheet.entries();
        let entry = entries.iter().find(|entry| entry.key == "winding.resistance").expect("an entry");
        assert_eq!(
            (entry.source, entry.reason.as_str()),
            (Source::Given, "in the data sheet, without a reason")
        );
    }
    let error =
        DataSheet::parse("own.toml", &whole.replace(line, "resistance = true")).expect_err("no number");
    assert!(error.to_string().contains("a number with its unit"), "{error}");
    // Neither title nor notes are needed.
    let bare = "name = \"bare\"\n".to_owned() + &whole[whole.find("[rating]").expect("a table")..];
    let sheet = DataSheet::parse("own.toml", &bare).expect("its keys are right");
    assert_eq!((sheet.title(), sheet.notes()), ("A motor by its data sheet", ""));
}

/// Hysteresis has three numbers; each has its range, and without a threshold or without cells there is none.
#[test]
fn law_hysteresis_is_small_or_none() {
    let sheet = |current: &str, depth: &str, cells: &str| {
        let text = format!(
            "{}\n[hysteresis]\ncoercive_current = \"{current}\"\ndepth = \"{depth}\"\ncells = {cells}\n",
            built_in_text("paper-5k5")
        );
        DataSheet::parse("motor.toml", &text).and_then(|sheet| sheet.motor())
    };
    let hysteresis = sheet("80 mA", "5 %", "3").expect("a motor").magnetics.hysteresis().expect("remembers");
    assert_eq!((hysteresis.coercive_current, hysteresis.depth, hysteresis.cells), (0.08, 0.05, 3));
    for none in [sheet("0 A", "5 %", "3"), sheet("80 mA", "5 %", "0")] {
        assert_eq!(none.expect("a motor"), sheet("0 A", "5 %", "3").expect("a motor"));
    }
    let wrong = |motor: Result<Motor, MotorError>| motor.expect_err("refused").to_string();
    let current = wrong(sheet("2 A", "5 %", "3"));
    assert!(
        current.contains("`hysteresis.coercive_current` is 2 A")
            && current.contains("from 0.01 % to 10 % of rated current, 800 µA to 800 mA"),
        "{current}"
    );
    let depth = wrong(sheet("80 mA", "60 %", "3"));
    assert!(depth.contains("`hysteresis.depth`") && depth.contains("from 0.001 to 0.5"), "{depth}");
    for cells in ["4", "1.5", "-1"] {
        let cells = wrong(sheet("80 mA", "5 %", cells));
        assert!(cells.contains("`hysteresis.cells`") && cells.contains("1, 2 or 3"), "{cells}");
    }
}

/// Whatever is wrong in a table of a data sheet, with or without a nameplate: the message has file, line and key.
#[test]
fn law_bad_numbers_have_a_line_and_a_key() {
    let nameplate = "[nameplate]\npole_pairs = 3\nresistance = \"0.9 Ω\"\nL_d = \"9 mH\"\nL_q = \"12 mH\"\nmagnet_flux = \"0.3 Wb\"\nrated_current = \"8 A\"\ndc_link = \"550 V\"\n";
    for sheet in [nameplate, built_in_text("paper-5k5")] {
        for (table, line, key, found) in [
            ("hysteresis", "coercive_current = \"2 A\"\ndepth = \"5 %\"\ncells = 3", 0, "is 2 A, but must be 0, or from"),
            ("hysteresis", "coercive_current = \"8 mV\"\ndepth = \"5 %\"\ncells = 3", 0, "`8 mV` is not"),
            ("hysteresis", "depth = \"5 %\"\ncoercive_current = \"80 mA\"\ncells = \"3\"", 2, "found the text \"3\""),
            ("hysteresis", "depth = \"5 %\"\ncoercive_current = \"80 mA\"\ncells = { value = \"3\", source = \"given\", reason = \"\" }", 2, "found the text \"3\""),
            ("hysteresis", "depth = \"5 %\"\ncoercive_current = \"80 mA\"\ncells = 7", 2, "is 7, but must be 0"),
            ("eddy", "d_depth = 0.1\ntime_constant = \"5 s\"\nq_depth = 0", 1, "from 1 µs to 1 s"),
            ("thermal", "reference = \"20 °C\"\nwinding_coefficient = 0.5\nmagnet_coefficient = 0", 1, "from -0.02"),
        ]
        .map(|(table, lines, line, found)| {
            let key = lines.lines().nth(line).and_then(|line| line.split(' ').next()).expect("a key");
            (table, line, format!("`{table}.{key}`"), (lines, found))
        }) {
            let text = format!("{sheet}\n[{table}]\n{}\n", found.0);
            let place = format!("own.toml: line {}, {key}", sheet.lines().count() + 3 + line);
            let motor = DataSheet::parse("own.toml", &text).and_then(|sheet| sheet.motor());
            let error = motor.expect_err("refused").to_string();
            assert!(error.starts_with(&place) && error.contains(found.1), "{place}: {error}");
        }
    }
}

#[test]
fn regress_all_keys_that_a_table_lacks_are_named_at_once() {
    let base = include_str!("../motors/paper-5k5.toml");
    let message =
        |table: &str| DataSheet::parse("m.toml", &format!("{base}\n{table}\n")).unwrap_err().to_string();
    let all = message("[hysteresis]");
    assert!(all.contains("`hysteresis`: missing fields `coercive_current`, `depth` and `cells`"), "{all}");
    let two = message("[hysteresis]\ndepth = 0.05");
    assert!(two.contains("missing fields `coercive_current` and `cells`"), "{two}");
    let one = message("[eddy]\ntime_constant = \"1 ms\"\nd_depth = 0.1");
    assert!(one.contains("`eddy`: missing field `q_depth`"), "{one}");
    // What is wrong otherwise is said as it is.
    let other = message("[hysteresis]\ndepth = 0.05\nwidth = 3");
    assert!(other.contains("unknown field `width`"), "{other}");
}

#[test]
fn regress_missing_tables_and_tables_that_are_none_are_named() {
    let message = |text: &str| DataSheet::parse("m.toml", text).unwrap_err().to_string();
    for (text, said) in [
        (
            "",
            "m.toml: missing `name` and the tables [rating], [winding] and [rotor], or [nameplate] with what a motor's owner knows",
        ),
        (
            "name = \"m\"\n[rating]\ncurrent = 8\n[winding]",
            "m.toml: line 4, `winding`: missing fields `pole_pairs` and `resistance`",
        ),
        (
            "nameplate = [1, 2]",
            "m.toml: line 1, `nameplate`: found a list, needed a table, which begins with [nameplate]",
        ),
        ("name = \"m\"\nwinding = 3", "m.toml: line 2, `winding`: found 3, needed a table"),
        (
            "rotor = true\n[nameplate]",
            "m.toml: line 1, `rotor`: found true, needed a table, which begins with [rotor]",
        ),
        ("name = 3", "m.toml: line 1, `name`: found 3, needed a text in quotes"),
        // A part with dots keeps its quotes, and is found by them.
        (
            "\n[rotor]\n\"inertia.value\" = 3",
            "m.toml: line 3, `rotor.\"inertia.value\"`: unknown field `inertia.value`",
        ),
    ] {
        let found = message(text);
        assert!(found.starts_with(said), "{text}\n{found}");
    }
    // What lacks only tables says so, and no name of a type stands in any message.
    let base = include_str!("../motors/paper-5k5.toml");
    let without = base.split("[rotor]").next().expect("a begin");
    assert_eq!(
        message(without),
        "m.toml: missing the table [rotor], or [nameplate] with what a motor's owner knows"
    );
}

#[test]
fn law_every_example_sheet_is_a_motor_and_says_where_its_numbers_come_from() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/motors");
    let mut known = 0;
    for entry in std::fs::read_dir(folder).expect("examples/motors") {
        let path = entry.expect("an entry").path();
        let text = std::fs::read_to_string(&path).expect("a text");
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        let sheet = DataSheet::parse(&name, &text).unwrap_or_else(|error| panic!("{error}"));
        let motor = sheet.motor().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(format!("{}.toml", motor.name), name);
        assert!(sheet.notes().contains("Source:"), "{name} names no source");
        for entry in sheet.entries() {
            let has_reason = entry.reason != standstill_files::sheet::PLAIN && !entry.reason.is_empty();
            assert!(has_reason, "{name}: {} has no reason", entry.key);
        }
        known += 1;
    }
    assert!(known >= 7, "{known} sheets");
}
