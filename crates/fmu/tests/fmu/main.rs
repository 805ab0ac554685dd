//! The FMU as an importer meets it: by its shared library and its description.
#![allow(unsafe_code, reason = "an importer calls through pointers")]
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

mod archive;
mod description;
mod importer;
mod samples;
mod serial;
mod time;
mod truth;

use std::path::Path;
use std::ptr::null_mut;

use importer::{Slave, State, unpacked};
use standstill_fmu::Part;
use standstill_interface::abi::sensed_code;
use standstill_interface::{
    Abc, Command, Detector, Fault, Findings, Leg, Nanos, Outcome, Reading, Sampling, Stage, Step,
};
use standstill_scenario::{Document, Plan};
use standstill_sim::{Event, Trace, run};

const FIELD: &str = "motor = \"low-inertia\"\ninverter.carrier = 12500.0\nerrors = \"field\"\nseed = 7\nrotor.state = \"free\"";

/// The PWM period of these scenarios.
const PERIOD: Nanos = Nanos(80_000);

/// Modes and duties of step `n`: pulses, PWM, and legs that are off.
fn legs(n: u32) -> ([u8; 3], [f64; 3]) {
    match n % 10 {
        0 => ([2, 1, 0], [0.0; 3]),
        1 | 2 => ([0, 0, 0], [0.0; 3]),
        3 => ([1, 2, 1], [0.0; 3]),
        _ => ([3, 3, if n.is_multiple_of(3) { 0 } else { 3 }], [0.45 + 0.003 * f64::from(n % 7), 0.5, 0.52]),
    }
}

/// The same as a command, of a half or of a whole period.
fn command(n: u32, whole: bool, second: bool, sample_at: f64) -> Command<f64> {
    let ((mode, duty), half) = (legs(n), Nanos(PERIOD.0 / 2));
    let stage = |second: bool| {
        let leg = |k: usize| match mode[k] {
            0 => Leg::Off,
            1 => Leg::Low,
            2 => Leg::High,
            _ => Leg::in_half(duty[k], half, second),
        };
        Stage { legs: Abc([leg(0), leg(1), leg(2)]), duration: half }
    };
    let length = if whole { PERIOD } else { half };
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let sampling = Sampling::once(Nanos((length.0 as f64 * sample_at).round() as u64));
    if whole {
        Command::sequence(stage(false), stage(true), sampling)
    } else {
        Command::hold(stage(second), sampling)
    }
}

/// Gives commands and keeps what it reads.
struct Script(Vec<Command<f64>>, Vec<Reading<f64>>);

impl Detector<f64> for Script {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        self.1.extend_from_slice(readings);
        if self.0.is_empty() {
            let fault = Fault::UnexpectedReadings;
            return Step::Done(Outcome::Failed { fault, findings: Findings::default() });
        }
        Step::Drive(self.0.remove(0))
    }
}

fn set_legs(slave: &Slave, n: u32) {
    let (mode, duty) = legs(n);
    for (k, phase) in ["a", "b", "c"].iter().enumerate() {
        assert_eq!(slave.set(&format!("mode_{phase}"), mode[k].into()), 0);
        assert_eq!(slave.set(&format!("duty_{phase}"), duty[k]), 0);
    }
}

/// What `standstill trace` shows of the same trial under the same commands, and what the sensors said.
#[test]
fn cross_samples_and_truth_are_those_of_a_trace() {
    traced("");
}

/// Of a drive with one shunt in the DC link, and with dividers at its terminals.
#[test]
fn cross_currents_of_the_link_and_voltages_of_terminals_are_those_of_a_trace() {
    traced(
        "\ndetector.method = \"bipolar\"\nsensors.arrangement = \"dc-link-shunt\"\nsensors.terminals = true",
    );
}

fn traced(sensors: &str) {
    let text = format!("{FIELD}{sensors}");
    let unpacked = unpacked(&text, Part::Drive);
    let parameters =
        [("trial", 5.0), ("sample_at", 0.5), ("inverter.dead_time", 3e-6), ("sensors.noise", 0.02)];
    let text = format!("{text}\ninverter.dead_time = 3e-6\nsensors.noise = 0.02");
    let plan = Plan::new(Document::parse(Path::new("s.toml"), &text).expect("TOML")).expect("valid");
    let scenario = plan.scenario(0).expect("valid");
    assert_eq!(scenario.drive.carrier_period, PERIOD);
    for whole in [true, false] {
        let slave = Slave::ready(&unpacked, &parameters);
        let steps = 60;
        let commands = (0..steps).map(|n| command(n, whole, n % 2 == 1, 0.5)).collect();
        let mut script = Script(commands, Vec::new());
        let mut trace = Trace::new(1e-3);
        run(&scenario.case(5), &mut script, false, &mut trace);
        let samples: Vec<_> =
            trace.events.iter().filter(|(_, event)| matches!(event, Event::Sample(..))).collect();
        assert_eq!(samples.len(), steps as usize);
        let length = if whole { 80e-6 } else { 40e-6 };
        assert_eq!(slave.get("actual.angle"), trace.snapshots[0].angle);
        let (mut largest, mut seen_of_link) = (0.0_f64, 0.0_f64);
        for n in 0..steps {
            set_legs(&slave, n);
            let time = f64::from(n) * length;
            assert_eq!(slave.step(time, f64::from(n + 1) * length - time), 0, "{}", slave.said());
            let (_, Event::Sample(seen)) = samples[n as usize] else { unreachable!() };
            let (current, link) = (seen.current.0, seen.dc_link);
            let reading = &script.1[n as usize];
            for (k, phase) in ["a", "b", "c"].iter().enumerate() {
                let sampled = slave.get(&format!("sampled.i_{phase}"));
                assert!((sampled - current[k]).abs() < 1e-9, "{n}: {sampled} {current:?}");
                assert_eq!(slave.get(&format!("count.i_{phase}")), f64::from(reading.counts.current.0[k]));
                largest = largest.max(sampled.abs());
            }
            assert!((slave.get("sampled.u_dc") - link).abs() < 1e-9);
            assert_eq!(slave.get("count.u_dc"), f64::from(reading.counts.dc_link));
            if !sensors.is_empty() {
                further(&slave, reading);
                seen_of_link = seen_of_link.max(reading.link_current.abs());
            }
            let end = f64::from(n + 1) * length;
            let there = trace.snapshots.iter().rfind(|there| (there.time - end).abs() < 1e-12).expect("one");
            assert_eq!(slave.get("actual.i_a"), there.current[0], "{n}");
            assert_eq!(slave.get("actual.angle"), there.angle, "{n}");
            assert_eq!(slave.get("actual.torque"), there.torque, "{n}");
            assert_eq!(slave.get("actual.i_link"), there.link_current(), "{n}");
        }
        assert!(sensors.is_empty() || seen_of_link > 0.3, "{seen_of_link} A in the link");
        assert!(largest > 0.3 && slave.get("actual.speed") != 0.0, "{largest}: something must happen");
    }
}

/// The readings that not every drive has.
fn further(slave: &Slave, reading: &Reading<f64>) {
    assert!((slave.get("sampled.i_link") - reading.link_current).abs() < 1e-9);
    assert_eq!(slave.get("count.i_link"), f64::from(reading.counts.link_current));
    assert_eq!(slave.get("sensed.i_link"), f64::from(sensed_code(reading.link_sensed)));
    for (k, phase) in ["a", "b", "c"].iter().enumerate() {
        assert!((slave.get(&format!("sampled.u_{phase}")) - reading.terminal.0[k]).abs() < 1e-9);
        assert_eq!(slave.get(&format!("count.u_{phase}")), f64::from(reading.counts.terminal.0[k]));
        // A terminal at the negative rail is at the end of its converter's range.
        let sensed = sensed_code(reading.terminal_sensed.0[k]);
        assert_eq!(slave.get(&format!("sensed.u_{phase}")), f64::from(sensed));
    }
    assert!(reading.counts.terminal.0.iter().any(|count| *count > 0), "{reading:?}");
}

#[test]
fn law_a_motor_takes_voltages_and_draws_what_its_winding_lets_through() {
    let unpacked = unpacked("motor = \"paper-5k5\"\nrotor.angle = 0", Part::Motor);
    let slave = Slave::ready(&unpacked, &[("motor.winding.resistance", 2.0)]);
    assert_eq!((slave.get("i_a"), slave.get("angle")), (0.0, 0.0));
    // Along the d-axis, for many time constants, in steps of any length.
    for (name, value) in [("u_a", 8.0), ("u_b", -4.0), ("u_c", -4.0)] {
        assert_eq!(slave.set(name, value), 0);
    }
    let mut time = 0.0;
    for n in 0..400 {
        let length = 1e-3 + 1e-6 * f64::from(n % 7);
        assert_eq!(slave.step(time, length), 0, "{}", slave.said());
        time += length;
    }
    assert!((slave.get("i_a") - 4.0).abs() < 1e-6, "u/R = {}", slave.get("i_a"));
    assert!((slave.get("i_b") + 2.0).abs() < 1e-6 && slave.get("torque").abs() < 1e-6);
    assert_ne!(slave.step(time, 1e-10), 0);
    assert!(slave.said().contains("at least 1 ns"), "{}", slave.said());
}

/// Outputs can be read in initialization mode, for which there must be a machine: what is set afterwards makes another one.
#[test]
fn law_a_parameter_counts_also_after_outputs_were_read() {
    let unpacked = unpacked("motor = \"paper-5k5\"\nrotor.angle = 0", Part::Motor);
    let slave = Slave::begun(&unpacked, &[]);
    assert_eq!(slave.get("i_a"), 0.0);
    assert_eq!(slave.set("motor.winding.resistance", 2.0), 0);
    assert_eq!(slave.call("fmi2ExitInitializationMode"), 0, "{}", slave.said());
    for (name, value) in [("u_a", 8.0), ("u_b", -4.0), ("u_c", -4.0)] {
        assert_eq!(slave.set(name, value), 0);
    }
    assert_eq!(slave.step(0.0, 0.4), 0, "{}", slave.said());
    assert!((slave.get("i_a") - 4.0).abs() < 1e-6, "u/R = {}", slave.get("i_a"));
}

/// promise: fmu-states
#[test]
fn law_a_state_comes_back_to_the_same_bits_and_instances_do_not_disturb_each_other() {
    let unpacked = unpacked(FIELD, Part::Drive);
    let outputs = [
        "sampled.i_a",
        "sampled.i_b",
        "actual.i_a",
        "actual.i_c",
        "actual.angle",
        "actual.speed",
        "actual.torque",
    ];
    let go = |slave: &Slave, steps: std::ops::Range<u32>| {
        let mut seen = Vec::new();
        for n in steps {
            set_legs(slave, n);
            assert_eq!(slave.step(f64::from(n) * 40e-6, 40e-6), 0, "{}", slave.said());
            seen.push(outputs.map(|name| slave.get(name).to_bits()));
        }
        seen
    };
    let slave = Slave::ready(&unpacked, &[]);
    go(&slave, 0..13);
    let mut state: State = null_mut();
    assert_eq!(slave.state("fmi2GetFMUstate", &mut state), 0);
    let first = go(&slave, 13..40);
    assert_eq!(slave.set_state(state), 0);
    assert_eq!(go(&slave, 13..40), first);
    // Into the same place again.
    assert_eq!(slave.state("fmi2GetFMUstate", &mut state), 0);
    assert_eq!(slave.state("fmi2FreeFMUstate", &mut state), 0);
    assert!(state.is_null());
    // Step by step beside one of another seed.
    let (one, other) = (Slave::ready(&unpacked, &[]), Slave::ready(&unpacked, &[("seed", 8.0)]));
    let mut apart = 0;
    for n in 0..40 {
        let (ours, theirs) = (go(&one, n..n + 1), go(&other, n..n + 1));
        apart += u32::from(ours != theirs);
        if n >= 13 {
            assert_eq!(ours[0], first[n as usize - 13]);
        }
    }
    assert_eq!(apart, 40, "another seed is another drive");
    assert_eq!(one.call("fmi2Terminate"), 0);
    assert_ne!(one.step(40.0 * 40e-6, 40e-6), 0);
    assert_eq!((one.call("fmi2Reset"), one.call("fmi2EnterInitializationMode")), (0, 0));
    assert_eq!(one.call("fmi2ExitInitializationMode"), 0);
    assert_eq!(go(&one, 0..40)[13..], first);
}

#[test]
fn law_mistakes_are_errors_with_a_message() {
    let unpacked = unpacked(FIELD, Part::Drive);
    let wrong = Slave::new(&unpacked, "{other}").err().expect("refused");
    assert!(wrong.contains("{other}") && wrong.contains("different versions"), "{wrong}");
    let slave = Slave::begun(&unpacked, &[]);
    for (name, value, says) in [
        ("inverter.dead_time", -1.0, "`inverter.dead_time`: found -1 s, needed from 0 to 19.999 µs"),
        (
            "inverter.dead_time",
            20e-6,
            "found 20 µs, needed from 0 to 19.999 µs: less than a quarter of the PWM period of 80 µs",
        ),
        ("inverter.dc_link", 0.0, "`inverter.dc_link`: found 0 V, needed at least 1 mV"),
        ("sensors.gain_error", 1.5, "`sensors.gain_error`: found 1.5, needed a share from 0 to 1"),
        ("sensors.noise", f64::NAN, "found NaN A"),
        ("mode_a", 4.0, "`mode_a`: found 4, needed 0, 1, 2 or 3"),
        ("duty_b", 1.1, "`duty_b`: found 1.1, needed a share from 0 to 1"),
        ("actual.i_a", 1.0, "no parameter and no input"),
        ("seed", -1.0, "`seed`: found -1, needed a whole number from 0 to 2147483647"),
    ] {
        assert_eq!(slave.set(name, value), 3, "{name}");
        assert!(slave.said().contains(says), "{name}: {}", slave.said());
    }
    // What depends on other keys is refused when the machine is made.
    assert_eq!(slave.set("inverter.terminal_capacitance", 1e-12), 0);
    assert_eq!(slave.call("fmi2ExitInitializationMode"), 3);
    let said = slave.said();
    assert!(
        said.contains("set by the importer: `inverter.terminal_capacitance`") && said.contains("0.1 nF"),
        "{said}"
    );
    assert_eq!(slave.set("inverter.terminal_capacitance", 0.0), 0);
    assert_eq!(slave.call("fmi2ExitInitializationMode"), 0, "{}", slave.said());
    assert_eq!(slave.set("sensors.noise", 0.1), 3);
    assert!(slave.said().contains("cannot be set once the simulation has begun"), "{}", slave.said());
    // A half period, then a whole one would end in the middle of a period.
    assert_eq!(slave.step(0.0, 40e-6), 0);
    assert_eq!(slave.step(40e-6, 80e-6), 3);
    assert!(slave.said().contains("found 80 µs, needed 40 µs, half a PWM period"), "{}", slave.said());
    assert_eq!(slave.step(40e-6, 40e-6), 3);
    assert!(slave.said().contains("in error"), "{}", slave.said());
    let again = Slave::ready(&unpacked, &[]);
    assert_eq!(again.step(1.0, 40e-6), 3);
    assert!(again.said().contains("communication point: found 1 s, needed 0 s"), "{}", again.said());
}
