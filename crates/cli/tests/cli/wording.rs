//! What is said where little is said: files without a key, files of another kind, words for what was found, and lines that are
//! broken once.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::widths::CHECK;
use super::{folder, mistake, quiet, standstill};

fn narrow(columns: usize, arguments: &[&str], folder: &Path) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_standstill"));
    command.env("COLUMNS", columns.to_string()).env_remove("CLICOLOR_FORCE");
    let output = command.args(arguments).current_dir(folder).output().expect("it starts");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn regress_files_without_a_key_are_no_motors_in_silence() {
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("empty.toml"), "# to be written\n").expect("written");
    let output = standstill(&["check", "empty.toml", "-s", "detector.method=bipolar"], at);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    let said = "standstill: empty.toml has no key: this is the default scenario, with the motor paper-5k5\n";
    // Whatever else is there is progress: in a log, too, a line for each method as soon as it is judged.
    let rest = error.strip_prefix(said).unwrap_or_else(|| panic!("{error}"));
    let (judged, rest): (Vec<&str>, Vec<&str>) =
        rest.lines().partition(|line| line.starts_with("standstill: bipolar: "));
    assert!(judged.len() == 1 && judged[0].contains(": suited"), "{error}");
    let rest = std::process::Output { stderr: rest.join("\n").into_bytes(), ..output };
    assert!(rest.status.success() && quiet(&rest), "{error}");
    let run = standstill(&["run", "empty.toml", "--trials", "5"], at);
    assert!(run.stdout.starts_with(b"Simulating paper-5k5, "), "{run:?}");
    // What has a key says nothing, and neither do options alone.
    fs::write(at.join("seed.toml"), "seed = 2\n").expect("written");
    for arguments in [&["motors", "paper-5k5"][..], &["run", "seed.toml", "--trials", "5", "--out", "r"]] {
        assert!(quiet(&standstill(arguments, at)), "{arguments:?}");
    }
}

#[test]
fn regress_what_was_found_has_no_names_of_types() {
    let folder = folder();
    let at = folder.path();
    let sheet = "[nameplate]\npole_pairs = 5\nresistance = \"0.2 Ω\"\nL_d = \"1 mH\"\nL_q = \"2 mH\"\nmagnet_flux = \"50 mWb\"\nrated_current = \"10 A\"\ndc_link = \"310 V\"\nsaturation = 6\n";
    fs::write(at.join("percent.toml"), sheet).expect("written");
    fs::write(at.join("image.toml"), b"\x89PNG\r\n").expect("written");
    fs::write(at.join("drive.fmu"), b"PK\x03\x04").expect("written");
    fs::write(at.join("bare.toml"), "pole_pairs = 7\nresistance = \"21 mOhm\"\n").expect("written");
    for (text, said) in [
        (
            "trials = \"5\"",
            "s.toml: line 1: `trials`: found the text \"5\", needed a whole number, zero or more",
        ),
        (
            "\nKe_line_rms = \"34 V/krpm\"",
            "s.toml: line 2: `Ke_line_rms`: unknown here: it is a key of the table [nameplate] in a motor's data sheet",
        ),
        (
            "motor = \"bare.toml\"",
            "bare.toml: line 1, `pole_pairs`: unknown here: it is a key of the table [nameplate]; put the line [nameplate] above it",
        ),
        (
            "[axes.\"sensors.noise\"]\nfrom = \"0 A\"\nto = \"1 A\"\nbetween = 3",
            "`axes.\"sensors.noise\".between`: unknown; known: from, to, points",
        ),
        ("dc_link = \"48 V\"", "`dc_link`: unknown; did you mean `inverter.dc_link`?"),
        ("[rotor]\ninertia = 1", "`rotor.inertia`: unknown here: a motor has `motor."),
        (
            "[sensors]\nwinding = 1",
            "`sensors.winding`: unknown here: a motor has `motor.winding`; known here: ",
        ),
        ("motor = \"percent.toml\"", "`saturation.d` is 6 (did you mean \"6 %\"?), but must be from"),
        (
            "errors = \"none\"\ninverter = { devices = \"mosfet\", channel_resistance = \"10 mΩ\" }",
            "found 10 mΩ, needed at most 0.000 mΩ, or an `inverter.diode_drop` of at least 0.2002 V",
        ),
        ("trials = 5.5", "`trials`: found 5.5, needed a whole number"),
        ("trials = -1", "`trials`: found -1, needed a whole number, zero or more"),
        ("sensors = 3", "`sensors`: found 3, needed a table"),
        ("detector = [1]", "`detector`: found a list, needed a table"),
        ("errors = 3", "`errors`: found 3, needed a text in quotes"),
        (
            "[detector]\ncompensation = \"yes\"",
            "`detector.compensation`: found the text \"yes\", needed true or false",
        ),
        (
            "detector = { method = \"bipolar\", rest = \"100 %\" }",
            "found 100 %, needed from 100.1 % to 1000 % of the pulse",
        ),
        ("[axes]\n\"sensors.noise\" = 3", "s.toml: line 2: `axes.\"sensors.noise\"`: "),
    ] {
        fs::write(at.join("s.toml"), text).expect("written");
        let message = mistake(&["run", "s.toml"], at);
        assert!(message.contains(said), "{text}\n{message}");
        for word in ["u64", "f64", "struct", "expected", "invalid type", "boolean", "sequence"] {
            assert!(!message.contains(word), "{word}: {message}");
        }
    }
    for (arguments, said) in [
        (
            &["run", "image.toml"][..],
            "cannot read image.toml: found no text (byte 1 is not UTF-8), needed one",
        ),
        (&["run", "drive.fmu"], "drive.fmu: found an FMU, which is for tools that import them"),
        (&["merge", "s.toml"], "s.toml: found a file, needed the folder with the journals of a run's shards"),
        (
            &["status", "s.toml"],
            "s.toml: found a file, needed the folder with the journals of a run's shards",
        ),
    ] {
        let message = mistake(arguments, at);
        assert!(message.contains(said), "{arguments:?}: {message}");
    }
    // The least rest that is allowed is one that works.
    let least =
        ["run", "paper-5k5", "-s", "detector.method=bipolar", "-s", "detector.rest=100.1%", "--trials", "3"];
    assert!(standstill(&least, at).status.success());
}

#[test]
fn regress_prose_is_broken_once() {
    let folder = folder();
    let compare = ["compare", "--method", "bipolar", "--trials", "5", "--no-limit", "--out", "c"];
    // One function breaks the prose of all commands.
    let widths = [(&compare[..], "right: starts", &[60, 80, 100][..]), (CHECK, "Recommended:", &[80])];
    for (arguments, begin, widths) in widths {
        for &columns in widths {
            let text = narrow(columns, arguments, folder.path());
            let lines: Vec<&str> = text.lines().skip_while(|line| !line.starts_with(begin)).collect();
            let block: Vec<&str> =
                lines.into_iter().take_while(|line| !line.is_empty() && !line.starts_with("  ")).collect();
            assert!(!block.is_empty(), "{text}");
            for pair in block.windows(2) {
                let next = pair[1].split(' ').next().unwrap_or_default();
                let more = pair[0].chars().count() + 1 + next.chars().count();
                assert!(more > columns, "{columns}: {next:?} fits behind {:?}", pair[0]);
            }
        }
    }
}

#[test]
fn regress_starts_that_failed_are_not_left_out_first() {
    let folder = folder();
    // At the second point all starts fail, and nothing else happens anywhere.
    let words = ["sweep", "paper-5k5", "--trials", "40", "--vary", "sensors.noise=5mA,25A", "--force"];
    for (columns, gone) in [(80, "p95"), (60, "p95")] {
        let text = narrow(columns, &words, folder.path());
        let head = text.split("──").next().expect("titles");
        assert!(head.contains("failed") && head.contains("right %"), "{columns}:\n{text}");
        assert!(text.contains("40 (100 %)") && !head.contains(gone), "{columns}:\n{text}");
    }
}
