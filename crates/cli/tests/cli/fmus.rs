//! `standstill fmu`: what it writes and refuses. What is inside is tried in `crates/fmu`, by importers in `tests/fmu`.

use std::fs;

use super::{folder, mistake, names, standstill};

#[test]
fn law_an_fmu_is_one_file_or_none() {
    let folder = folder();
    let path = folder.path();
    fs::create_dir(path.join("deep")).expect("made");
    let odd = standstill(&["fmu", "paper-5k5", "-s", "inverter.carrier=12345Hz", "-o", "odd.fmu"], path);
    let said = String::from_utf8_lossy(&odd.stdout).into_owned();
    assert!(said.contains("steps of 81.004 µs, a period of the PWM"), "{said}");
    let output = standstill(&["fmu", "paper-5k5", "--errors", "field", "-o", "deep/drive.fmu"], path);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("drive of paper-5k5, FMI 2.0, 6 inputs, 23 outputs"), "{said}");
    assert_eq!(names(&path.join("deep")), ["drive.fmu"]);
    assert!(fs::read(path.join("deep/drive.fmu")).expect("there").starts_with(b"PK"));
    // The same again changes nothing; another one needs leave.
    let before = fs::read(path.join("deep/drive.fmu")).expect("there");
    let same = standstill(&["fmu", "paper-5k5", "--errors", "field", "-o", "deep/drive.fmu"], path);
    assert!(same.status.success(), "{}", String::from_utf8_lossy(&same.stderr));
    let other = ["fmu", "paper-5k5", "--part", "motor", "--fmi", "3", "-o", "deep/drive.fmu"];
    let message = mistake(&other, path);
    assert!(message.contains("deep/drive.fmu: found the results of another run"), "{message}");
    assert_eq!(fs::read(path.join("deep/drive.fmu")).expect("there"), before);
    let again = standstill(&[&other[..], &["--force"]].concat(), path);
    let said = String::from_utf8_lossy(&again.stdout).into_owned();
    assert!(said.contains("motor of paper-5k5, FMI 3.0, 3 inputs, 6 outputs"), "{said}");
    fs::write(path.join("notes.fmu"), "notes").expect("written");
    let message = mistake(&["fmu", "paper-5k5", "-o", "notes.fmu"], path);
    assert!(message.contains("notes.fmu is no FMU, but"), "{message}");
    assert_eq!(fs::read(path.join("notes.fmu")).expect("there"), b"notes");
}

#[test]
fn law_what_cannot_be_exported_is_named_and_nothing_is_written() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("axes.toml"), "[axes]\n\"sensors.noise\" = [0.01, 0.02]\n").expect("written");
    fs::write(path.join("resolver.toml"), "[sensors]\nresolver_error = \"0.3 deg\"\n").expect("written");
    let cases: [(&[&str], &str); 20] = [
        (&["fmu", "nothing", "-o", "x.fmu"], "`nothing`"),
        (&["fmu", "axes.toml", "-o", "x.fmu"], "`axes`"),
        (&["fmu", "paper-5k5", "-s", "inverter.dead_time=-1", "-o", "x.fmu"], "`inverter.dead_time`"),
        (&["fmu", "paper-5k5", "--seed", "5000000000", "-o", "x.fmu"], "at most 2147483647"),
        (&["fmu", "paper-5k5", "--binary", "none.so", "-o", "x.fmu"], "none.so"),
        (
            &["fmu", "paper-5k5", "--binary", "axes.toml", "-o", "x.fmu"],
            "axes.toml: found no library: the file does not begin as one, needed the library of FMUs of standstill",
        ),
        (
            &["fmu", "paper-5k5", "--binary", env!("CARGO_BIN_EXE_standstill"), "-o", "x.fmu"],
            "found a library without fmi2DoStep, needed",
        ),
        (
            &["fmu", "paper-5k5", "-s", "inverter.dead_time=25us", "-o", "x.fmu"],
            "`inverter.dead_time`: found 25 µs, needed from 0 to 24.999 µs",
        ),
        (
            &["fmu", "paper-5k5", "-s", "inverter.dc_link=0", "-o", "x.fmu"],
            "`inverter.dc_link`: found 0 V, needed at least 1 mV",
        ),
        (
            &["fmu", "paper-5k5", "--part", "motor", "-s", "sensors.noise=1mA", "-o", "x.fmu"],
            "set on the command line: `sensors.noise`: found in an FMU of the motor alone, needed a key of `motor`, `rotor`, `inverter.carrier`, `seed`; inverter and sensors are in `--part drive`",
        ),
        (
            &["fmu", "paper-5k5", "--part", "motor", "--errors", "harsh", "-o", "x.fmu"],
            "`errors`: found in an FMU of the motor",
        ),
        (
            &["fmu", "paper-5k5", "-s", "detector.pulse=80us", "-o", "x.fmu"],
            "`detector.pulse`: found in an FMU, which the importing tool runs, needed a key of `motor`, `rotor`, `inverter`, `sensors`",
        ),
        (
            &["fmu", "paper-5k5", "-s", "sensors.resolver_error=2", "-o", "x.fmu"],
            "set on the command line: `sensors.resolver_error`: found 2 in an FMU, which has no resolver, needed 0 or no such key; its `actual.angle` is without error",
        ),
        (
            &["fmu", "resolver.toml", "-o", "x.fmu"],
            "resolver.toml: line 2: `sensors.resolver_error`: found \"0.3 deg\" in an FMU, which has no resolver, needed 0 or no such key",
        ),
        (
            &["fmu", "paper-5k5", "-o", "axes.toml"],
            "axes.toml is no FMU's name, but must be a file's that ends in .fmu",
        ),
        (&["fmu", "paper-5k5", "-o", "x"], "x is no FMU's name"),
        (&["fmu", "paper-5k5", "-o", "nowhere/x.fmu"], "cannot write nowhere/x.fmu: "),
        (&["fmu", "paper-5k5", "-o", ".."], "must be a file"),
        // Nobody can write there.
        (&["fmu", "paper-5k5", "-o", "/proc/drive.fmu"], "cannot write /proc/drive.fmu: "),
        (&["fmu", "paper-5k5", "--fmi", "1", "-o", "x.fmu"], "[possible values: 2, 3]"),
    ];
    for (arguments, says) in cases {
        let message = mistake(arguments, path);
        assert!(message.contains(says), "{arguments:?}: {message}");
        assert_eq!(names(path), ["axes.toml", "resolver.toml"], "{arguments:?}");
        assert!(fs::read(path.join("axes.toml")).expect("there").starts_with(b"[axes]"), "{arguments:?}");
    }
    // Without error there is nothing to miss, and a motor alone has none of the drive's sensors.
    for more in [["-s", "sensors.resolver_error=0"], ["--part", "motor"]] {
        let output =
            standstill(&[&["fmu", "resolver.toml", "-o", "x.fmu", "--force"][..], &more].concat(), path);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}
