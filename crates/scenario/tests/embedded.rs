//! The detectors as a static C library: the same readings give the bits that Rust gets.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Output};
use std::sync::OnceLock;

use standstill_detect::{AnyDetector, Method, MethodName, Nameplate, Settings as _, Signature};
use standstill_interface::{Command, Detector, Leg, Outcome, Reading, Sensed, Stage, Step, abi};
use standstill_plant::built_in;
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::{NoProbe, RotorState, run};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn succeeded(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The static library, built once.
fn library() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| {
        // Beside this program's own: `.ci/run` builds it there too.
        let folder =
            Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("a target folder").join("firmware");
        let output = Process::new(env!("CARGO"))
            .args(["build", "--release", "--locked", "--manifest-path"])
            .arg(root().join("crates/firmware/Cargo.toml"))
            .arg("--target-dir")
            .arg(&folder)
            .output()
            .expect("cargo");
        succeeded(&output);
        folder.join("release/libsts_detectors.a")
    })
}

/// Builds a program with the library from sources in a folder.
fn built(folder: &Path, source: &str) -> PathBuf {
    let program = folder.join("program");
    let output = Process::new("cc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1"])
        .args([Path::new("-I"), &root().join("crates/foreign/include"), Path::new("-I")])
        .arg(root().join("crates/firmware/include"))
        .arg("-o")
        .args([&program, &folder.join(source)])
        .arg(library())
        .output()
        .expect("a C compiler");
    succeeded(&output);
    program
}

/// A folder of this test's own.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("embedded").join(name);
    fs::create_dir_all(&folder).expect("made");
    folder
}

/// A detector and all that was said on both sides.
struct Recorder {
    inner: AnyDetector<f32>,
    steps: Vec<(Vec<Reading<f32>>, Step<f32>)>,
}

impl Detector<f32> for Recorder {
    fn step(&mut self, readings: &[Reading<f32>]) -> Step<f32> {
        let step = self.inner.step(readings);
        self.steps.push((readings.to_vec(), step));
        step
    }
}

/// A detection in single precision in the simulator.
fn recorded(method: MethodName, motor: &str, trial: u64) -> (Nameplate<f32>, Recorder) {
    let motor = built_in(motor).expect("a motor");
    let scenario = Scenario::of_method(method, motor, ErrorSet::Default, RotorState::Locked, 1);
    let plate: Nameplate<f32> = scenario.nameplate().cast();
    let inner = Method::<f32>::suited(method, &plate).detector().expect("suits");
    let mut recorder = Recorder { inner, steps: Vec::new() };
    run(&scenario.case(trial), &mut recorder, false, &mut NoProbe);
    (plate, recorder)
}

fn in_c(plate: &Nameplate<f32>) -> String {
    let stronger = |signature| match signature {
        Signature::Normal => 1,
        Signature::Inverted => -1,
        Signature::None => 0,
    };
    let pair = |[a, b]: [f32; 2]| format!("{{{a:e}f, {b:e}f}}");
    let mut all = String::new();
    let mut field = |name: &str, value: String| _ = writeln!(all, "    .{name} = {value},");
    for (name, time) in [
        ("rated_pulse_ns", plate.rated_pulse),
        ("dead_time_ns", plate.dead_time),
        ("period_ns", plate.carrier_period),
        ("skew_ns", plate.sensing.skew),
    ] {
        field(name, time.0.to_string());
    }
    for (name, value) in [
        ("rated_current", plate.rated_current),
        ("resistance", plate.resistance),
        ("ld", plate.d_axis_inductance),
        ("lq", plate.q_axis_inductance),
        ("flux", plate.magnet_flux),
        ("pole_difference", plate.polarity_difference),
        ("gain_tolerance", plate.gain_tolerance),
        ("dc_link", plate.dc_link),
        ("sensor_bandwidth", plate.sensing.bandwidth.unwrap_or(0.0)),
        ("bandwidth_mismatch", plate.sensing.bandwidth_mismatch),
    ] {
        field(name, format!("{value:e}f"));
    }
    field("stronger_pole", stronger(plate.signature).to_string());
    field("stronger_pole_half", stronger(plate.pulse_signature).to_string());
    field("switch_drop", pair(plate.switch_drop));
    field("diode_drop", pair(plate.diode_drop));
    field("reverse_drop", pair(plate.reverse_drop));
    field("pick_up", pair(plate.sensing.pick_up));
    all
}

/// Status and bits of angle, deviation, evidence, evidence needed, and the reason.
fn ending(steps: &[(Vec<Reading<f32>>, Step<f32>)]) -> (i32, [u32; 4], u32) {
    let Some((_, Step::Done(outcome))) = steps.last() else { panic!("not done") };
    let findings = outcome.findings();
    let (status, angle, reason) = match outcome {
        Outcome::Found { angle, .. } => (abi::FOUND, angle.radians(), 0),
        Outcome::Axis { angle, reason, .. } => (abi::AXIS, angle.radians(), abi::axis_reason(reason)),
        Outcome::Failed { fault, .. } => (abi::FAILED, abi::Answer::UNSET, abi::failure_reason(fault)),
    };
    let evidence = findings.pole_evidence;
    let known = [
        angle,
        findings.angle_deviation.unwrap_or(abi::Answer::UNSET),
        evidence.map_or(abi::Answer::UNSET, |evidence| evidence.deviations),
        evidence.map_or(abi::Answer::UNSET, |evidence| evidence.needed),
    ];
    (status, known.map(f32::to_bits), reason)
}

/// `recording.h` of a detection.
fn recording(method: MethodName, plate: &Nameplate<f32>, recorder: &Recorder) -> String {
    let mut text = format!(
        "/* A detection by `{method}`, written by the tests: see main.c. */\nstatic const char recorded_method[] = \"{method}\";\n\
         static const sts_plate recorded_plate = {{\n{}}};\n/* time_ns, currents, DC link, codes, sensed, clipped */\n\
         static const sts_sample recorded_samples[] = {{\n",
        in_c(plate)
    );
    for reading in recorder.steps.iter().flat_map(|(readings, _)| readings) {
        let [a, b, c] = reading.current.0.map(|current| format!("{current:e}f"));
        let [ka, kb, kc] = reading.counts.current.0;
        let [sa, sb, sc] = reading.sensed.0.map(|sensed| match sensed {
            Sensed::Measured => 0,
            Sensed::Derived => 1,
            Sensed::Clipped => 2,
            Sensed::Hidden => 3,
        });
        let _ = writeln!(
            text,
            "    {{{}u, {{{a}, {b}, {c}}}, {:e}f, {{{ka}, {kb}, {kc}}}, {}, {{{sa}, {sb}, {sc}}}, {}, 0, {{0}}}},",
            reading.at.0,
            reading.dc_link,
            reading.counts.dc_link,
            u8::from(reading.dc_link_clipped)
        );
    }
    let counts: Vec<String> = recorder.steps.iter().map(|(readings, _)| readings.len().to_string()).collect();
    let (status, bits, _) = ending(&recorder.steps);
    let _ = write!(
        text,
        "}};\nstatic const unsigned recorded_counts[] = {{{}}};\n/* Status, and bits of angle, deviation and evidence, from Rust. */\n\
         static const int recorded_status = {status};\nstatic const unsigned recorded_result[] = {{{:#010x}, {:#010x}, {:#010x}}};\n",
        counts.join(", "),
        bits[0],
        bits[1],
        bits[2]
    );
    text
}

/// A command as main.c prints it.
fn printed(command: &Command<f32>) -> String {
    let mut line = "drive".to_owned();
    let stage = |stage: &Stage<f32>, line: &mut String| {
        for leg in stage.legs.0 {
            let (state, duty, edge) = match leg {
                Leg::Off => (0, 0.0, 0),
                Leg::Low => (1, 0.0, 0),
                Leg::High => (2, 0.0, 0),
                Leg::Duty(duty) => (3, duty, 0),
                Leg::Rise(at) => (4, 0.0, at.0),
                Leg::Fall(at) => (5, 0.0, at.0),
            };
            let _ = write!(line, " {state}:{:08x}:{edge}", duty.to_bits());
        }
        let _ = write!(line, " for {} ns,", stage.duration.0);
    };
    stage(&command.stage, &mut line);
    if let Some(then) = &command.then {
        stage(then, &mut line);
    }
    let sampling = command.sampling;
    let _ =
        write!(line, " sample {} from {} every {}", sampling.count, sampling.first.0, sampling.interval.0);
    line
}

#[test]
fn cross_each_detector_in_a_c_program_gives_the_bits_that_it_gives_in_rust() {
    let mut angles = std::collections::BTreeSet::new();
    // A program in C hands over no terminal voltages: `sts_begin` refuses the method that reads them.
    let methods = MethodName::ALL.into_iter().filter(|method| *method != MethodName::OpenTerminal);
    for (number, method) in methods.enumerate() {
        let motor = ["paper-5k5", "light-vehicle"][number % 2];
        let (plate, recorder) = recorded(method, motor, number as u64);
        let folder = folder(method.name());
        fs::copy(root().join("examples/c/drive/main.c"), folder.join("main.c")).expect("copied");
        fs::write(folder.join("recording.h"), recording(method, &plate, &recorder)).expect("written");
        let output = Process::new(built(&folder, "main.c")).output().expect("runs");
        let said = String::from_utf8(output.stdout).expect("text");
        let mut lines = said.lines();
        for (_, step) in &recorder.steps {
            if let Step::Drive(command) = step {
                assert_eq!(lines.next(), Some(printed(command).as_str()), "{method}");
            }
        }
        let (status, [angle, deviation, evidence, needed], reason) = ending(&recorder.steps);
        let expected = format!(
            "done {status}: angle {angle:08x}, deviation {deviation:08x}, evidence {evidence:08x} of {needed:08x}, reason {reason}"
        );
        assert_eq!(lines.next(), Some(expected.as_str()), "{method}");
        assert!(output.status.success() && lines.next().is_none(), "{method}: {said}");
        angles.insert(angle);
    }
    assert!(angles.len() > 6, "detections differ: {angles:?}");
}

#[test]
fn regress_the_recording_of_the_example_gives_the_bits_that_it_says() {
    let example = root().join("examples/c/drive");
    let method = MethodName::Bipolar;
    if std::env::var("RECORDING").is_ok_and(|what| what == "renew") {
        let (plate, recorder) = recorded(method, "light-vehicle", 3);
        fs::write(example.join("recording.h"), recording(method, &plate, &recorder)).expect("written");
    }
    let folder = folder("example");
    fs::copy(example.join("main.c"), folder.join("main.c")).expect("copied");
    let text = fs::read_to_string(example.join("recording.h")).expect("there");
    fs::write(folder.join("recording.h"), &text).expect("written");
    let status = Process::new(built(&folder, "main.c")).output().expect("runs").status;
    assert!(
        status.success(),
        "after a change of a detector's arithmetic: RECORDING=renew cargo test -p standstill-scenario --test embedded"
    );
    // One code of one current more, and the program says that it is not the same.
    let at = text.find("    {").expect("a sample");
    let current = text[at..].split(['{', ',']).nth(4).expect("a current").trim().to_owned();
    let other = text.replacen(&format!("{{{current},"), "{9.5f,", 1);
    assert_ne!(other, text);
    fs::write(folder.join("recording.h"), other).expect("written");
    let status = Process::new(built(&folder, "main.c")).output().expect("runs").status;
    assert_eq!(status.code(), Some(1));
}

#[test]
fn law_what_c_asks_for_and_cannot_be_is_refused_with_its_reason() {
    let folder = folder("refused");
    let source = r#"
#include "sts_detectors.h"
#include <stdio.h>
static sts_state state;
static void try(const char *method, float current, const char *key, double value)
{
    sts_plate plate = {0};
    sts_setting setting = {0};
    const char *refused;
    plate.rated_current = current;
    plate.ld = plate.lq = 1e-3f;
    plate.rated_pulse_ns = plate.period_ns = 100000;
    plate.dc_link = 50.0f;
    setting.key = key;
    setting.value = value;
    refused = sts_begin(&state, method, &plate, &setting, key != NULL);
    printf("%s\n", refused == NULL ? "ready" : refused);
}
int main(void)
{
    static sts_sample many[STS_MOST_SAMPLES + 1];
    sts_command command;
    sts_result result;
    int status;
    status = sts_step(&state, NULL, 0, &command, &result);
    printf("%d %u\n", status, (unsigned)result.reason);
    try("bipolar", 7.0f, NULL, 0.0);
    status = sts_step(&state, many, STS_MOST_SAMPLES + 1, &command, &result);
    printf("%d %u\n", status, (unsigned)result.reason);
    try("bipolar", 7.0f, "rounds", 3.0);
    status = sts_step(&state, NULL, 0, &command, &result);
    printf("%d\n", status);
    /* Other samples than were asked for end it, and it stays ended. */
    status = sts_step(&state, NULL, 0, &command, &result);
    printf("%d %u\n", status, (unsigned)result.reason);
    status = sts_step(&state, NULL, 0, &command, &result);
    printf("%d %u\n", status, (unsigned)result.reason);
    try("bi-polar", 7.0f, NULL, 0.0);
    try("bipolar", 0.0f, NULL, 0.0);
    try("bipolar", 7.0f, "rounds", 300.0);
    try("bipolar", 7.0f, "round", 3.0);
    try("hfi-rotating", 7.0f, "rounds", 3.0);
    status = sts_step(&state, NULL, 0, &command, &result);
    printf("%d %u\n", status, (unsigned)result.reason);
    return 0;
}
"#;
    fs::write(folder.join("refused.c"), source).expect("written");
    let output = Process::new(built(&folder, "refused.c")).output().expect("runs");
    succeeded(&output);
    let said = String::from_utf8(output.stdout).expect("text");
    let expected = "3 26\nready\n3 26\nready\n0\n3 26\n3 26\nno method \"bi-polar\"\n\
        detector setting `rated_current` must be positive and finite\n\
        setting `rounds` must be a whole number from 0 to 255\nno setting `round` of this method\n\
        no setting `rounds` of this method\n3 26\n";
    assert_eq!(said, expected);
}
