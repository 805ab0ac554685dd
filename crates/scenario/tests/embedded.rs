//! The detectors as a static C library: the same readings give the bits that Rust gets.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Output};
use std::sync::OnceLock;

use standstill_detect::{
    AnyDetector, Method, MethodName, Nameplate, Place, Settings as _, Signature, Source,
};
use standstill_interface::{Command, Detector, Leg, Nanos, Outcome, Reading, Stage, Step, abi};
use standstill_scenario::{Document, Plan, Scenario};
use standstill_sim::{NoProbe, run};

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
        // Beside this program's own: `scripts/ci-more.sh` builds it there too.
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

/// The scenario of a method on a motor with current sensors in these places: six pulses with a timer and comparators, the open terminal
/// with dividers.
fn scenario(method: MethodName, motor: &str, arrangement: &str) -> Scenario<Method<f64>> {
    let mut text =
        format!("motor = \"{motor}\"\nerrors = \"default\"\ndetector.method = \"{}\"\n", method.name());
    text += match method {
        MethodName::SixPulse => "sensors.timer = \"0.32 us\"\nsensors.comparators = \"common\"\n",
        MethodName::OpenTerminal => "sensors.terminals = true\n",
        _ => "",
    };
    let _ = writeln!(text, "sensors.arrangement = \"{arrangement}\"");
    let document = Document::parse(Path::new("scenario"), &text).expect("a scenario");
    Plan::new(document).expect("a plan").scenario(0).expect("valid")
}

/// A detection in single precision in the simulator: what the drive knows and has, and what was said.
fn recorded(method: MethodName, motor: &str, trial: u64, arrangement: &str) -> (Plate, Recorder) {
    let scenario = scenario(method, motor, arrangement);
    let knows: Nameplate<f32> = scenario.nameplate().cast();
    let inner = Method::<f32>::suited(method, &knows).detector().expect("suits");
    let mut recorder = Recorder { inner, steps: Vec::new() };
    run(&scenario.case(trial), &mut recorder, false, &mut NoProbe);
    (Plate { knows, readings: scenario.sources() }, recorder)
}

/// What a program in C says of motor and drive.
struct Plate {
    knows: Nameplate<f32>,
    readings: Vec<Source>,
}

fn in_c(Plate { knows: plate, readings }: &Plate) -> String {
    let stronger = |signature| match signature {
        Signature::Normal => 1,
        Signature::Inverted => -1,
        Signature::None => 0,
    };
    let comparator = plate.sensing.comparator;
    let pair = |[a, b]: [f32; 2]| format!("{{{a:e}f, {b:e}f}}");
    let mut all = String::new();
    let mut field = |name: &str, value: String| _ = writeln!(all, "    .{name} = {value},");
    for (name, time) in [
        ("rated_pulse_ns", plate.rated_pulse),
        ("dead_time_ns", plate.dead_time),
        ("period_ns", plate.carrier_period),
        ("skew_ns", plate.sensing.skew),
        ("settle_ns", plate.sensing.settle),
        ("averaged_ns", plate.sensing.averaged),
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
        ("delay_mismatch", plate.delay_mismatch),
        ("sensor_bandwidth", plate.sensing.bandwidth.unwrap_or(0.0)),
        ("bandwidth_mismatch", plate.sensing.bandwidth_mismatch),
        ("timer_tick", comparator.tick),
        ("comparator_delay", comparator.delay),
        ("comparator_delay_spread", comparator.delay_spread),
        ("comparator_offset", comparator.offset),
        ("comparator_noise", comparator.noise),
        ("comparator_blanking", comparator.blanking),
        ("threshold_highest", comparator.highest),
        ("timer_error", comparator.clock_error),
        ("link_noise", plate.sensing.link_noise),
        ("divider_tolerance", plate.dividers.gain_tolerance),
        ("divider_offset", plate.dividers.offset),
        ("divider_bandwidth", plate.dividers.bandwidth.unwrap_or(0.0)),
    ] {
        field(name, format!("{value:e}f"));
    }
    let bit = |source: &Source| match source {
        Source::PhaseCurrents => abi::PHASE_CURRENTS,
        Source::LinkCurrent => abi::LINK_CURRENT,
        Source::Terminals => abi::TERMINALS,
        Source::CapturedTimes => abi::CAPTURES,
    };
    let below = if plate.sensing.place == Place::BelowLegs { abi::BELOW_LEGS } else { 0 };
    field("readings", (readings.iter().map(bit).sum::<u32>() | below).to_string());
    field("comparators", if comparator.own { "6" } else { "1" }.to_owned());
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
fn recording(method: MethodName, plate: &Plate, recorder: &Recorder) -> String {
    let mut text = format!(
        "/* A detection by `{method}`, written by the tests: see main.c. */\nstatic const char recorded_method[] = \"{method}\";\n\
         static const sts_plate recorded_plate = {{\n{}}};\n/* In the order of sts_sample. */\n\
         static const sts_sample recorded_samples[] = {{\n",
        in_c(plate)
    );
    for reading in recorder.steps.iter().flat_map(|(readings, _)| readings) {
        let s = abi::Sample::of(reading, Nanos::ZERO, 0);
        let numbers = |of: [f32; 3]| of.map(|value| format!("{value:e}f")).join(", ");
        let codes = |of: [u32; 3]| of.map(|value| value.to_string()).join(", ");
        let kinds = |of: [u8; 3]| of.map(|value| value.to_string()).join(", ");
        let _ = writeln!(
            text,
            "    {{{}u, {{{}}}, {:e}f, {{{}}}, {}, {{{}}}, {}, 0, {}, {}, {}, {:e}f, {}, {{{}}}, {{{}}}, {{{}}}, 0, {}}},",
            s.time_ns,
            numbers(s.current),
            s.dc_link,
            codes(s.current_count),
            s.dc_link_count,
            kinds(s.sensed),
            s.dc_link_clipped,
            s.link_sensed,
            s.captured,
            s.comparator,
            s.link_current,
            s.link_current_count,
            numbers(s.terminal),
            codes(s.terminal_count),
            kinds(s.terminal_sensed),
            s.capture_ticks
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
    if let Some(threshold) = command.threshold {
        let _ = write!(line, " until {:08x},", threshold.to_bits());
    }
    let sampling = command.sampling;
    let _ =
        write!(line, " sample {} from {} every {}", sampling.count, sampling.first.0, sampling.interval.0);
    line
}

#[test]
fn cross_each_detector_in_a_c_program_gives_the_bits_that_it_gives_in_rust() {
    let mut angles = std::collections::BTreeSet::new();
    let through = |arrangement| move |method| (method, arrangement);
    let both_ways = [MethodName::Bipolar, MethodName::MaximumLikelihood];
    let through_shunts =
        ["dc-link-shunt", "low-side-shunts"].into_iter().flat_map(|of| both_ways.map(through(of)));
    let all = MethodName::ALL.into_iter().map(through("three-in-line")).chain(through_shunts);
    for (number, (method, arrangement)) in all.enumerate() {
        let motor = ["paper-5k5", "light-vehicle"][number % 2];
        let (plate, recorder) = recorded(method, motor, number as u64, arrangement);
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
        let (plate, recorder) = recorded(method, "light-vehicle", 3, "three-in-line");
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
    sts_readings readings = {sizeof readings, STS_MOST_SAMPLES + 1, sizeof many[0], 0, many};
    sts_command command;
    sts_result result;
    int status;
    status = sts_step(&state, NULL, &command, &result);
    printf("%d %u\n", status, (unsigned)result.reason);
    try("bipolar", 7.0f, NULL, 0.0);
    status = sts_step(&state, &readings, &command, &result);
    printf("%d %u\n", status, (unsigned)result.reason);
    try("bipolar", 7.0f, "rounds", 3.0);
    status = sts_step(&state, NULL, &command, &result);
    printf("%d\n", status);
    /* Other samples than were asked for end it, and it stays ended. */
    status = sts_step(&state, NULL, &command, &result);
    printf("%d %u\n", status, (unsigned)result.reason);
    status = sts_step(&state, NULL, &command, &result);
    printf("%d %u\n", status, (unsigned)result.reason);
    try("bi-polar", 7.0f, NULL, 0.0);
    try("bipolar", 0.0f, NULL, 0.0);
    try("bipolar", 7.0f, "rounds", 300.0);
    try("bipolar", 7.0f, "round", 3.0);
    try("bipolar", 7.0f, "checks", 3.0);
    try("hfi-rotating", 7.0f, "checks", 32.0);
    try("hfi-rotating", 7.0f, "rounds", 3.0);
    try("open-terminal", 7.0f, NULL, 0.0);
    try("six-pulse", 7.0f, "timed", 1.0);
    status = sts_step(&state, NULL, &command, &result);
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
        setting `rounds` must be a whole number from 1 to 255\nno setting `round` of this method\n\
        setting `checks` must be 0 for none, 1 for all, or a sum of 2 for link, 4 for sensors, 8 for inductance, 16 for both-ways, \
        32 for contact, 64 for codes, 128 for turning, 256 for saliency\n\
        setting `checks` must be 0 for none, 1 for all, or a sum of 16 for both-ways, 128 for turning\nno setting `rounds` of this method\n\"open-terminal\" reads none of what sts_plate.readings has\n\
        detector setting `timed` must be false, or `sensors.timer` be set: without a timer this drive captures no time to a threshold\n3 26\n";
    assert_eq!(said, expected);
}
