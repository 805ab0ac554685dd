//! What the commands that answer questions say of a detector from a C library, where a formula says what it must be.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use crate::firmware::{build, probe};
use crate::{folder, standstill};

fn answer(arguments: &[&str], folder: &Path) -> Value {
    let output = standstill(arguments, folder);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} of {value}"))
}

/// Of a library that takes its first sample, 0.5 rad for 1 A, for the angle of a rotor at 0°. No current flows then: its error
/// is offset and noise of one sensor, 40 mA and 30 mA, so 20 and 15 mrad.
fn reads() -> TempDir {
    let folder = folder();
    probe(folder.path(), "reads");
    let text = "motor = \"light-vehicle\"\nerrors = \"none\"\nrotor.angle = 0\n[sensors]\nnoise = \"30 mA\"\noffset = \"40 mA\"\n\
                [detector.config]\nwhat = \"reads\"\nangle = 0.5\n";
    fs::write(folder.path().join("s.toml"), text).expect("written");
    folder
}

#[test]
fn analytic_a_budget_of_a_library_has_the_variances_of_its_errors() {
    let folder = reads();
    let budget = ["budget", "s.toml", "--detector", "./probe.so", "--pairs", "4000", "--json"];
    let budget = answer(&budget, folder.path());
    assert_eq!(budget["method"], "probe");
    let of = |name: &str| {
        let sources = budget["sources"].as_array().expect("a list");
        sources.iter().find(|source| source["source"] == name).expect(name)
    };
    let degrees = |radians: f64| radians.to_degrees();
    for (name, alone, share) in
        [("sensors.offset", degrees(20e-3), 16.0 / 25.0), ("sensors.noise", degrees(15e-3), 9.0 / 25.0)]
    {
        let source = of(name);
        assert!((number(source, "alone_rms_deg") / alone - 1.0).abs() < 0.05, "{source}");
        assert!(number(source, "share_low") < share && share < number(source, "share_high"), "{source}");
        assert!((number(source, "share") - share).abs() < 0.06, "{source}");
    }
    assert!((number(&budget, "rms_deg") / degrees(25e-3) - 1.0).abs() < 0.05, "{budget}");
    let none = of("interaction");
    assert!(number(none, "share_low") < 0.0 && 0.0 < number(none, "share_high"), "errors add up: {none}");
}

#[test]
fn analytic_what_a_library_requires_of_a_sensor_is_what_its_other_errors_leave() {
    let folder = reads();
    let arguments = [
        "require",
        "s.toml",
        "--detector",
        "./probe.so",
        "--key",
        "sensors.noise",
        "--limit",
        "p95 <= 3.2 deg",
        "--between",
        "10 mA:100 mA",
        "--most",
        "20000",
        "--json",
    ];
    let edge = answer(&arguments, folder.path());
    // 95 of 100 errors are within 1.96 standard deviations. Of an rms half a million trials would be needed: a start without an
    // answer might be 90° off.
    let deviation = 3.2_f64.to_radians() / 1.959_963_984_540_054;
    let expected = ((deviation / 0.5).powi(2) - 0.04_f64.powi(2)).sqrt();
    assert_eq!((&edge["method"], &edge["answer"]), (&"probe".into(), &"at most".into()));
    assert!(number(&edge, "low") < expected && expected < number(&edge, "high"), "{edge}: {expected}");
    assert!((number(&edge, "value") / expected - 1.0).abs() < 0.04, "{edge}: {expected}");
}

/// The error is in proportion to the gain: the least that may be is the best, with a fifth of the error.
#[test]
fn analytic_a_library_is_tuned_by_a_key_of_its_own() {
    let folder = reads();
    let arguments = [
        "tune",
        "s.toml",
        "--detector",
        "./probe.so",
        "--vary",
        "detector.config.angle=0.1:0.5",
        "--minimise",
        "rms",
        "--trials",
        "1000",
        "--starts",
        "1",
        "--json",
    ];
    let tuned = answer(&arguments, folder.path());
    let rms = |of: &str| number(&tuned[of]["measures"]["rms"], "value");
    assert!(
        (number(&tuned["settings"], "detector.config.angle") - 0.1).abs() < 1e-3,
        "{}",
        tuned["settings"]
    );
    assert!((rms("start") / rms("best") - 5.0).abs() < 0.05, "{} {}", rms("start"), rms("best"));
}

/// What the page calls yours: registers that became variables, and an injection that is done after ten interrupts.
const YOURS: &str = "
static struct { unsigned JDR1; } adc1, adc2;
static struct { unsigned CCR1, CCR2, CCR3, ARR; } tim1;
#define ADC1 (&adc1)
#define ADC2 (&adc2)
#define TIM1 (&tim1)
static struct { float Ld; } motor;
static struct { int done, calls; float angle, first_harmonic, noise, duration; } hfi;
static void hfi_start(void) { tim1.ARR = 1000; tim1.CCR1 = 510; tim1.CCR2 = tim1.CCR3 = 500; }
static void hfi_interrupt(void)
{
    hfi.angle = motor.Ld > 0 && adc1.JDR1 > 0 && adc2.JDR1 > 0 ? 1.0f : 0.0f;
    hfi.noise = 1.0f;
    hfi.done = ++hfi.calls == 10;
}
";

#[test]
fn law_the_interrupt_of_the_page_is_a_detector() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = fs::read_to_string(root.join("docs/firmware.md")).expect("the page");
    let printed =
        page.split("```c\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a block in C");
    assert!(printed.contains("hfi_interrupt();") && printed.contains("sts_entry"));
    let folder = folder();
    let at = folder.path();
    fs::write(at.join("start.c"), printed).expect("written");
    fs::write(at.join("hfi.h"), YOURS).expect("written");
    fs::write(at.join("s.toml"), "motor = \"light-vehicle\"\ntrials = 20\n").expect("written");
    build(at, &at.join("start.c").to_string_lossy(), "mine.so");
    let run = ["run", "s.toml", "--detector", "./mine.so", "--json", "--out", "out"];
    assert_eq!(answer(&run, at)["summary"]["found"], 20);
    let trials = fs::read_to_string(at.join("out/trials.csv")).expect("written");
    let of =
        |line: &str, column: usize| line.split(',').nth(column).and_then(|cell| cell.parse::<f64>().ok());
    for line in trials.lines().skip(1) {
        // Ten periods of 50 us, and the answer at the eleventh: one radian, each time from cleared variables.
        assert!((of(line, 2).expect("an angle") - 1.0_f64.to_degrees()).abs() < 1e-4, "{line}");
    }
    let found: std::collections::BTreeSet<_> =
        trials.lines().skip(1).map(|line| line.split(',').nth(7)).collect();
    assert_eq!(found.len(), 1, "all take the same time: {found:?}");
}

#[test]
fn law_a_bound_of_a_librarys_commands_bears_its_name() {
    let folder = folder();
    build(folder.path(), "examples/c/six_vectors.c", "six.so");
    fs::write(folder.path().join("s.toml"), "motor = \"light-vehicle\"\n").expect("written");
    let of = |more: &[&str]| {
        answer(&[&["bounds", "s.toml", "--angles", "4", "--json"], more].concat(), folder.path())
    };
    let (library, method) = (of(&["--detector", "./six.so"]), of(&[]));
    assert_eq!((&library["method"], &method["method"]), (&"six".into(), &"line-inductance-fast".into()));
    assert_ne!(number(&library["rms"], "scheme_deg"), number(&method["rms"], "scheme_deg"));
}

#[test]
fn analytic_the_odds_of_a_library_that_always_says_the_same_angle_are_even() {
    let folder = folder();
    probe(folder.path(), "found");
    let odds = ["odds", "s.toml", "--event", "wrong-pole", "--detector", "./probe.so", "--json"];
    let output = standstill(&odds, folder.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("text");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let [low, high] = ["low", "high"].map(|end| json[end].as_f64());
    assert!(low < Some(0.5) && high > Some(0.5) && low > Some(0.48) && high < Some(0.52), "{text}");
}

/// Runs the program with so many KiB of addresses.
fn with_addresses(kib: u64, arguments: &[&str], folder: &Path) -> std::process::Output {
    std::process::Command::new("sh")
        .args(["-c", &format!("ulimit -v {kib} && exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_standstill")])
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("a shell")
}

/// Each copy of a library has 256 MiB of addresses. Where the system has no more, the run ends with what it needs, and both ways out
/// that it names go on to the same table: one thread within 1 GiB, and no limit.
#[test]
fn regress_a_run_without_room_for_a_copy_of_a_library_says_what_suffices() {
    let folder = reads();
    let at = folder.path();
    let run = ["run", "s.toml", "--detector", "./probe.so", "--trials", "400", "--out"];
    let of = |out: &str, more: &[&str]| [&run[..], &[out], more].concat().join(" ");
    let split = |command: &str| command.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let limited = |kib: u64, command: &str| {
        let arguments = split(command);
        with_addresses(kib, &arguments.iter().map(String::as_str).collect::<Vec<_>>(), at)
    };
    for threads in ["16", "1"] {
        let output = limited(500_000, &of(threads, &["--threads", threads]));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        for part in [
            "no room for a copy of the library, whose heap takes 256 MiB of addresses: Cannot allocate memory",
            "needed more addresses (ulimit -v unlimited), or fewer copies (--threads 1, with which 1 GiB",
            "--resume goes on",
        ] {
            assert!(said.contains(part), "{said}");
        }
    }
    let fewer = limited(1 << 20, &of("16", &["--threads", "1", "--resume"]));
    assert!(fewer.status.success(), "{}", String::from_utf8_lossy(&fewer.stderr));
    for command in [of("1", &["--threads", "1", "--resume"]), of("free", &[])] {
        let output = standstill(&split(&command).iter().map(String::as_str).collect::<Vec<_>>(), at);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let rows = |out: &str| fs::read(at.join(out).join("trials.csv")).expect("a table");
    assert!(rows("16") == rows("free") && rows("1") == rows("free"));
}
