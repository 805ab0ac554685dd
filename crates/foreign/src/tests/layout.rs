//! Each size, offset and number of the headers, by C compilers and by Rust.

use std::fmt::Write as _;
use std::mem::{offset_of, size_of};
use std::path::Path;
use std::process::Command as Process;

use standstill_interface::abi::*;
use standstill_interface::{Fault, Phase, Rotation, Undetermined};

/// The C name of each type and field with what Rust makes of it.
fn layout() -> Vec<(String, usize)> {
    let mut all = Vec::new();
    macro_rules! layout {
        ($($c:literal $rust:ident: $($field:ident)*;)*) => {$(
            all.push((format!("sizeof({})", $c), size_of::<$rust>()));
            $(all.push((format!("offsetof({}, {})", $c, stringify!($field)), offset_of!($rust, $field)));)*
        )*};
    }
    layout! {
        "sts_drive" Drive: size current_bits dc_link_bits amps_per_count amps_at_zero volts_per_count dc_link rated_current
            resistance ld lq flux dead_time stronger_pole period_ns settle_ns terminal_bits terminal_volts_per_count timer_tick
            comparator_delay comparator_offset comparator_noise comparators comparator_delay_spread
            comparator_blanking threshold_highest log_to log;
        "sts_sample" Sample: time_ns current dc_link current_count dc_link_count sensed dc_link_clipped half link_sensed
            captured comparator link_current link_current_count terminal terminal_count terminal_sensed reserved capture_ticks;
        "sts_readings" Readings: size count stride reserved first;
        "sts_legs" Legs: size leg reserved duty shift sample_at sample_every;
        "sts_stage" Stage: leg reserved duty edge_ns reserved_too duration_ns;
        "sts_command" Command: size stages stage samples until first_ns interval_ns;
        "sts_result" Answer: size angle angle_deviation pole_evidence pole_needed reason age;
        "sts_detector" Table: abi size flags pwm_hz sample_at update_delay name create destroy reason step isr probe samples
            sample_every task task_ns;
        "sts_plate" Plate: rated_pulse_ns dead_time_ns period_ns skew_ns rated_current resistance ld lq flux stronger_pole
            stronger_pole_half pole_difference gain_tolerance dc_link switch_drop diode_drop reverse_drop sensor_bandwidth
            bandwidth_mismatch pick_up settle_ns readings comparators timer_tick comparator_delay comparator_delay_spread
            comparator_offset comparator_noise divider_tolerance divider_offset divider_bandwidth comparator_blanking
            threshold_highest timer_error link_noise averaged_ns delay_mismatch;
        "sts_setting" Setting: key value;
    }
    for (name, value) in [
        ("STS_ABI", ABI),
        ("STS_OFF", OFF.into()),
        ("STS_LOW", LOW.into()),
        ("STS_HIGH", HIGH.into()),
        ("STS_DUTY", DUTY.into()),
        ("STS_RISE", RISE.into()),
        ("STS_FALL", FALL.into()),
        ("STS_INTERRUPT", INTERRUPT),
        ("STS_DOUBLE_UPDATE", DOUBLE_UPDATE),
        ("STS_REENTRANT", REENTRANT),
        ("STS_FOUND", FOUND.unsigned_abs()),
        ("STS_AXIS", AXIS.unsigned_abs()),
        ("STS_FAILED", FAILED.unsigned_abs()),
        ("STS_GO_ON", GO_ON.unsigned_abs()),
        ("STS_PHASE_CURRENTS", PHASE_CURRENTS),
        ("STS_LINK_CURRENT", LINK_CURRENT),
        ("STS_TERMINALS", TERMINALS),
        ("STS_CAPTURES", CAPTURES),
        ("STS_BELOW_LEGS", BELOW_LEGS),
        ("STS_MEASURED", 0),
        ("STS_DERIVED", 1),
        ("STS_CLIPPED", 2),
        ("STS_HIDDEN", 3),
        ("STS_DETECTOR_BYTES", u32::try_from(DETECTOR_BYTES).expect("small")),
        ("sizeof(sts_state)", u32::try_from(DETECTOR_BYTES).expect("small")),
        ("STS_MOST_SAMPLES", u32::try_from(MOST_SAMPLES).expect("small")),
    ] {
        all.push((name.to_owned(), value as usize));
    }
    let axis = [
        ("STS_POLE_BELOW_NOISE", Undetermined::MarginBelowNoise { margin: 0.0, needed: 0.0 }),
        ("STS_POLE_NO_SIGNATURE", Undetermined::NoSignature),
        ("STS_POLE_NOT_DECIDED", Undetermined::NotDecided { error: 0.0, allowed: 0.0 }),
        ("STS_POLE_OFF_AXIS", Undetermined::OffAxis { angle: 0.0, allowed: 0.0 }),
        ("STS_POLE_MAY_HAVE_TURNED", Undetermined::MayHaveTurned { angle: 0.0, allowed: 0.0 }),
    ];
    all.extend(axis.map(|(name, reason)| (name.to_owned(), axis_reason(&reason) as usize)));
    let (phase, allowed) = (Phase::A, [0.0; 2]);
    let failed = [
        ("STS_CURRENT_CLIPPED", Fault::Clipped(Phase::A)),
        ("STS_DC_LINK_CLIPPED", Fault::DcLinkClipped),
        ("STS_NOT_A_NUMBER", Fault::NotANumber),
        ("STS_CURRENT_HIDDEN", Fault::Hidden(Phase::A)),
        ("STS_NO_CURRENT", Fault::NoCurrent { peak: 0.0, needed: 0.0 }),
        ("STS_CURRENT_PERSISTS", Fault::CurrentPersists(0.0)),
        ("STS_NO_SALIENCY", Fault::NoSaliency { ratio: 0.0, needed: 0.0 }),
        ("STS_NOT_INDUCTIVE", Fault::NotInductive(Phase::A)),
        ("STS_DID_NOT_FOLLOW", Fault::DidNotFollow { swept: 0.0, needed: 0.0 }),
        ("STS_ROTOR_MOVES", Fault::RotorMoves { angle: 0.0, allowed: 0.0 }),
        ("STS_UNEXPECTED_SAMPLES", Fault::UnexpectedReadings),
        ("STS_TRIPPED_EARLY", Fault::TrippedEarly { time: 0.0, needed: 0.0 }),
        ("STS_TERMINAL_CLIPPED", Fault::TerminalClipped),
        ("STS_TERMINAL_HIDDEN", Fault::TerminalHidden),
        ("STS_NO_VOLTAGE", Fault::NoVoltage),
        ("STS_TERMINALS_SWING", Fault::TerminalsSwing),
        ("STS_SENSORS_DISAGREE", Fault::SensorsDisagree { apart: 0.0, allowed: 0.0 }),
        ("STS_DC_LINK_OUT_OF_RANGE", Fault::DcLinkOutOfRange { found: 0.0, allowed: [0.0; 2] }),
        ("STS_INDUCTANCE_OUT_OF_RANGE", Fault::InductanceOutOfRange { phase, found: 0.0, allowed }),
        ("STS_DIRECTIONS_DIFFER", Fault::DirectionsDiffer { phase: None, apart: 0.0, allowed: 0.0 }),
        ("STS_COARSE_TIMER", Fault::CoarseTimer { ratio: 0.0, needed: 0.0, tick: 0.0, allowed: 0.0 }),
        ("STS_SALIENCY_OUT_OF_RANGE", Fault::SaliencyOutOfRange { found: 0.0, allowed }),
        ("STS_CONTACT_RESISTIVE", Fault::ContactResistive { phase: Phase::A, found: 0.0, allowed: 0.0 }),
    ];
    let ways = [("", None), ("_FORWARD", Some(Rotation::Forward)), ("_BACKWARD", Some(Rotation::Backward))];
    all.extend(ways.map(|(end, way)| {
        let fault = Fault::RotorTurns { speed: 0.0, allowed: 0.0, way };
        (format!("STS_ROTOR_TURNS{end}"), failure_reason::<f64>(&fault) as usize)
    }));
    all.extend(failed.map(|(name, fault)| (name.to_owned(), failure_reason::<f64>(&fault) as usize)));
    all
}

/// Compiles a program that prints each size, offset and number, by C99 and by C++17, without a warning.
#[test]
fn cross_sizes_offsets_and_numbers_are_those_of_a_c_and_of_a_cpp_compiler() {
    let layout = layout();
    let mut source =
        "#include \"sts_detectors.h\"\n#include <stddef.h>\n#include <stdio.h>\nint main(void) {\n"
            .to_owned();
    for (expression, _) in &layout {
        let _ = writeln!(source, "printf(\"%lu\\n\", (unsigned long)({expression}));");
    }
    source += "return 0; }\n";
    let folder = tempfile::tempdir().expect("a folder");
    let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
    for (compiler, standard, file) in [("cc", "-std=c99", "layout.c"), ("c++", "-std=c++17", "layout.cpp")] {
        std::fs::write(folder.path().join(file), &source).expect("written");
        let built = Process::new(compiler)
            .args([standard, "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I"])
            .arg(&include)
            .arg("-I")
            .arg(include.join("../../firmware/include"))
            .args([file, "-o", "layout"])
            .current_dir(folder.path())
            .output();
        // A machine with a linker for Rust has a C compiler, not always one for C++.
        let built = match built {
            Err(error) if compiler == "c++" && error.kind() == std::io::ErrorKind::NotFound => {
                eprintln!("c++ is not installed: the header was not tried with it");
                continue;
            }
            built => built.expect("a compiler"),
        };
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        let printed = Process::new(folder.path().join("layout")).output().expect("runs").stdout;
        let printed = String::from_utf8(printed).expect("digits");
        assert_eq!(printed.lines().count(), layout.len());
        for ((expression, ours), theirs) in layout.iter().zip(printed.lines()) {
            assert_eq!(ours.to_string(), theirs, "{expression} by {compiler}");
        }
    }
}
