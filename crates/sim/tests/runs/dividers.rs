//! The dividers at the terminals: against closed forms.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

use std::f64::consts::TAU;

use standstill_interface::{Abc, Command, Leg, Nanos, Phase, Reading, Sampling, Sensed, Stage};
use standstill_inverter::{Bridge, DcLink, GateTiming, Inverter, OpenLeg};
use standstill_plant::{Motor, built_in};
use standstill_sim::{
    Broken, Case, Fault, NoProbe, SensorSettings, Sensors, Streams, TerminalSensor, Tolerance, run,
};

use crate::script::{LINK, Script, same_bits_in_lanes, sampled, stage};

const LINES: [(Phase, Phase, f64); 3] =
    [(Phase::A, Phase::B, -30.0), (Phase::B, Phase::C, 90.0), (Phase::C, Phase::A, 210.0)];

fn motor() -> Motor {
    built_in("paper-5k5").expect("built in").linearised()
}

fn inverter(capacitance: f64) -> Inverter {
    let open_leg = if capacitance > 0.0 { OpenLeg::Diodes } else { OpenLeg::Open };
    Inverter {
        bridge: Bridge { open_leg, terminal_capacitance: capacitance, ..Bridge::default() },
        gates: [GateTiming::default(); 3],
        link: DcLink::stiff(LINK),
        carrier_period: Nanos::from_micros(100),
    }
}

fn case(motor: &Motor, angle: f64, terminal: TerminalSensor, capacitance: f64) -> Case<'_> {
    let mut case = Case::new(motor, inverter(capacitance));
    case.start_angle = angle;
    case.tolerance = Tolerance { flux: 1e-12 };
    case.sensors = Sensors::nominal(SensorSettings { terminal: Some(terminal), ..SensorSettings::IDEAL });
    case
}

fn readings(case: &Case<'_>, commands: &[Command<f64>]) -> Vec<Reading<f64>> {
    let mut script = Script::new(commands);
    run(case, &mut script, false, &mut NoProbe);
    let asked: u32 = commands.iter().map(|command| command.sampling.count).sum();
    assert_eq!(script.readings.len(), asked as usize, "a run that ended early");
    script.readings
}

/// r and 2 R/L in 1/s of a line at an angle in rad.
fn closed(motor: &Motor, line: f64, angle: f64) -> (f64, f64) {
    let k = motor.winding.saliency / motor.winding.mean_inductance;
    let twice = 2.0 * (angle - line.to_radians());
    let lines = 1.0 + k * twice.cos();
    let inductance = 3.0 * motor.winding.mean_inductance * lines;
    (-(3.0_f64.sqrt() / 2.0) * k * twice.sin() / lines, 2.0 * motor.resistance / inductance)
}

/// Samples of a pulse of 200 µs that show the terminals' voltages.
fn pulse(high: Phase, low: Phase) -> Command<f64> {
    let sampling = Sampling { first: Nanos(10_000), interval: Nanos(10_000), count: 20 };
    let rest = Stage::off(Nanos::from_micros(320));
    Command::sequence(Stage::line(high, low, Nanos::from_micros(200)), rest, sampling)
}

#[test]
fn analytic_the_open_terminal_follows_its_closed_form() {
    let motor = motor();
    let mut worst = 0.0_f64;
    for step in 0..12 {
        let angle = f64::from(step) * 0.55;
        for (from, to, line) in LINES {
            for (high, low, way) in [(from, to, 1.0), (to, from, -1.0)] {
                let (r, rate) = closed(&motor, line, angle);
                let open = Phase::ALL[3 - high as usize - low as usize];
                let read = readings(&case(&motor, angle, TerminalSensor::IDEAL, 0.0), &[pulse(high, low)]);
                assert_eq!(read.len(), 20);
                for reading in read {
                    let left = LINK * (-rate * reading.at.seconds()).exp();
                    let should = LINK / 2.0 + way * r * left;
                    worst = worst.max((reading.terminal[open] - should).abs());
                    assert_eq!((reading.terminal[high], reading.terminal[low]), (LINK, 0.0));
                    assert_eq!(reading.terminal_sensed.0, [Sensed::Measured; 3]);
                }
            }
        }
    }
    assert!(worst < 1e-6, "{worst}");
}

/// The converters of the terminals share the reference and the results with those of the currents.
#[test]
fn analytic_a_reference_that_drifts_and_lost_samples_reach_the_terminals() {
    let motor = motor();
    let with = |broken: Option<Broken>| {
        let mut case = case(&motor, 0.3, TerminalSensor::IDEAL, 0.0);
        if let Some(broken) = broken {
            assert!(case.faults.push(Fault::lasting(broken)));
        }
        readings(&case, &[pulse(Phase::A, Phase::B)])
    };
    let (sound, lost) = (with(None), with(Some(Broken::Stale)));
    for (drifts, sound) in with(Some(Broken::Drift(-500.0))).iter().zip(&sound) {
        let grown = 1.0 - 500.0 * sound.at.seconds();
        for (reads, there) in drifts.terminal.0.into_iter().zip(sound.terminal.0) {
            assert!((reads - there * grown).abs() <= 1e-12 * LINK, "{reads} {there}");
        }
    }
    // Before the first sample there is none.
    assert_eq!(lost[0].terminal, sound[0].terminal);
    for k in 1..sound.len() {
        assert_eq!(lost[k].terminal, sound[k - 1].terminal);
        assert!(lost[k].terminal != sound[k].terminal, "the open terminal moves");
    }
}

#[test]
fn analytic_a_filter_behind_a_divider_lags() {
    let (motor, corner) = (motor(), 20e3);
    let lag = 1.0 / (TAU * corner);
    let of = TerminalSensor { bandwidth: Some(corner), resistance: Some(1e6), ..TerminalSensor::IDEAL };
    for angle in [0.3, 1.7, 4.0] {
        let (r, rate) = closed(&motor, -30.0, angle);
        for reading in readings(&case(&motor, angle, of, 0.0), &[pulse(Phase::A, Phase::B)]) {
            let t = reading.at.seconds();
            let settled = (-t / lag).exp();
            let open =
                LINK / 2.0 * (1.0 - settled) + r * LINK * ((-rate * t).exp() - settled) / (1.0 - rate * lag);
            for (k, should) in [LINK * (1.0 - settled), 0.0, open].into_iter().enumerate() {
                let read = reading.terminal.0[k];
                assert!((read - should).abs() < 1e-6, "{k} at {t}: {read} {should}");
            }
        }
    }
}

/// Terminals that ring while a filter follows: `U − U/2 cos ωt` through a filter, also where a step is many periods long.
#[test]
fn analytic_a_filter_follows_terminals_that_ring() {
    let mut motor = motor();
    motor.winding.saliency = 0.0;
    motor.resistance = 1e-6;
    let motor = motor.linearised();
    let (capacitance, corner) = (1e-9, 30e3);
    let omega = 1.0 / (1.5 * motor.winding.d_axis_inductance() * capacitance).sqrt();
    let rate = TAU * corner;
    let of = TerminalSensor { bandwidth: Some(corner), ..TerminalSensor::IDEAL };
    let command = sampled(Command::hold(stage([Leg::High, Leg::High, Leg::Off], 150), Sampling::NONE), 15);
    let mut ringing = case(&motor, 0.3, of, capacitance);
    // No diode ends the swing.
    ringing.inverter.bridge.open_leg = OpenLeg::Open;
    for reading in readings(&ringing, &[command]) {
        let t = reading.at.seconds();
        let decayed = (-rate * t).exp();
        // x = U − U/2 cos ωt from U/2 at rest; y' = rate (x − y).
        let (square, sum) = (rate * rate, rate * rate + omega * omega);
        let cos = (square * (omega * t).cos() + rate * omega * (omega * t).sin()) / sum;
        let swing = cos - square / sum * decayed;
        let should = LINK / 2.0 * decayed + LINK * (1.0 - decayed) - LINK / 2.0 * swing;
        let read = reading.terminal.0[2];
        assert!((read - should).abs() < 2e-5 * LINK, "at {t}: {read} {should}");
    }
}

#[test]
fn law_idle_terminals_are_where_their_loads_hold_them() {
    let motor = motor();
    let once = |legs: [Leg<f64>; 3]| {
        Command::hold(
            Stage { legs: Abc(legs), duration: Nanos::from_micros(50) },
            Sampling::once(Nanos::from_micros(40)),
        )
    };
    let commands = [once([Leg::Off; 3]), once([Leg::High; 3]), once([Leg::Low; 3])];
    for (resistance, idle) in [(None, LINK / 2.0), (Some(1e6), 0.0)] {
        let of = TerminalSensor { resistance, ..TerminalSensor::IDEAL };
        let read = readings(&case(&motor, 0.4, of, 0.0), &commands);
        for (reading, level) in read.iter().zip([idle, LINK, 0.0]) {
            assert!(reading.terminal.0.iter().all(|read| (read - level).abs() < 1e-11), "{reading:?}");
        }
    }
    // A drive without dividers reads nothing, and one without current sensors no current.
    let mut case = case(&motor, 0.4, TerminalSensor::IDEAL, 0.0);
    case.sensors = Sensors::nominal(SensorSettings {
        arrangement: standstill_sim::Arrangement::None,
        ..SensorSettings::IDEAL
    });
    let read = readings(&case, &[pulse(Phase::A, Phase::B)])[5];
    assert_eq!((read.terminal.0, read.terminal_sensed.0), ([0.0; 3], [Sensed::Hidden; 3]));
    assert_eq!((read.current.0, read.sensed.0), ([0.0; 3], [Sensed::Hidden; 3]));
}

#[test]
fn law_a_sample_at_an_edge_reads_what_was_before_it() {
    let motor = motor();
    let read = readings(&case(&motor, 0.4, TerminalSensor::IDEAL, 0.0), &[pulse(Phase::A, Phase::B)]);
    assert_eq!(read[19].at, Nanos::from_micros(200));
    assert_eq!((read[19].terminal.0[0], read[19].terminal.0[1]), (LINK, 0.0));
    // Converted phase after phase, the terminals are taken with the first.
    let mut skewed = case(&motor, 0.4, TerminalSensor::IDEAL, 0.0);
    skewed.sensors.settings.skew = Nanos(500);
    let late = readings(&skewed, &[pulse(Phase::A, Phase::B)]);
    assert_eq!(late[19].terminal, read[19].terminal);
}

/// The drive's end of an open wire: at the rail of its leg's gate, also where the link ripples; without a gate halfway between the rails by
/// the leakages, or at the negative rail by its divider. The intact legs beside it show what a terminal behind an ideal switch shows.
#[test]
fn law_the_drives_end_of_an_open_wire_is_at_a_rail_or_where_leakages_or_its_divider_hold_it() {
    let motor = motor();
    let command = |legs: [Leg<f64>; 3], micros: u64| {
        let first = Nanos::from_micros(micros - 10);
        Command::hold(stage(legs, micros), Sampling { first, interval: Nanos(2_000), count: 6 })
    };
    let driven = [Leg::High, Leg::Low, Leg::Off].map(|b| command([Leg::High, b, Leg::Low], 400));
    // The current is gone after 1.2 ms, as long as it rose; then all terminals float.
    let commands = [driven[0], driven[1], driven[2], command([Leg::Off; 3], 2000)];
    for (capacitance, bandwidth) in [(0.0, None), (0.0, Some(20e3)), (0.3e-9, None), (0.3e-9, Some(20e3))] {
        for (resistance, idle) in [(None, 0.5), (Some(1e6), 0.0)] {
            let of = TerminalSensor { bandwidth, resistance, ..TerminalSensor::IDEAL };
            let mut case = case(&motor, 0.4, of, capacitance);
            case.inverter.link = DcLink { ripple: 0.02, ripple_frequency: 300.0, ..DcLink::stiff(LINK) };
            assert!(case.faults.push(Fault::lasting(Broken::Wire(1))));
            let read = readings(&case, &commands);
            let said = |reading: &Reading<f64>| {
                format!("{capacitance} F, {bandwidth:?} Hz, {resistance:?} Ω, {reading:?}")
            };
            for (number, share) in [1.0, 0.0, idle].into_iter().enumerate() {
                for reading in &read[6 * number..6 * (number + 1)] {
                    let [high, open, low] = reading.terminal.0;
                    let off = (open - share * high).abs().max(low.abs());
                    assert!(off < 1e-6 * LINK && (high / LINK - 1.0).abs() < 0.03, "{}", said(reading));
                }
            }
            // The link's ripple moves an end without divider by 2 % of its half.
            for reading in &read[18..] {
                let off = (reading.terminal.0[1] - idle * LINK).abs();
                assert!(off <= 0.021 * idle * LINK + 1e-6 * LINK, "{}", said(reading));
            }
        }
    }
}

/// A link that ripples, `U (1 + r sin ωt)`, moves terminals at rest by half of it. The filter, y′ = a (x − y), follows from y = U/2:
/// `y/U − ½ = r/2 · (a² sin ωt − aω cos ωt + aω e^(−at))/(a² + ω²)`, over waits of several periods of the ripple.
#[test]
fn analytic_a_filter_at_rest_follows_half_of_a_link_that_ripples() {
    let (motor, corner, ripple, frequency) = (motor(), 500.0, 0.05, 300.0);
    let of = TerminalSensor { bandwidth: Some(corner), ..TerminalSensor::IDEAL };
    let (a, omega) = (TAU * corner, TAU * frequency);
    let mut case = case(&motor, 0.3, of, 0.0);
    case.inverter.link = DcLink { ripple, ripple_frequency: frequency, ..DcLink::stiff(LINK) };
    let sampling = Sampling { first: Nanos(1_300_000), interval: Nanos(9_700_000), count: 3 };
    let rest = Stage::off(Nanos::from_micros(25_000));
    for reading in readings(&case, &[Command::hold(rest, sampling)]) {
        let t = reading.at.seconds();
        let wave = a * a * (omega * t).sin() + a * omega * ((-a * t).exp() - (omega * t).cos());
        let should = LINK / 2.0 * (1.0 + ripple * wave / (a * a + omega * omega));
        for read in reading.terminal.0 {
            // A cubic through four points of an eighth of a period is off by at most (π/4)⁴/(24 · 81) · 16/9 of the ripple, 3.5e-4.
            assert!((read - should).abs() < 3.5e-4 * ripple * LINK / 2.0, "at {t}: {read} {should}");
        }
    }
}

#[test]
fn law_dividers_in_lanes_read_what_they_read_alone() {
    let motor = motor();
    let of = TerminalSensor {
        gain_error: 0.005,
        offset: 0.5,
        noise: 0.5,
        bandwidth: Some(100e3),
        resistance: Some(1e6),
        ..TerminalSensor::IDEAL
    };
    for capacitance in [0.0, 0.3e-9] {
        let cases: Vec<_> = (0_u32..9)
            .map(|number| {
                let mut case = case(&motor, f64::from(number) * 0.7, of, capacitance);
                case.streams = Streams::new(1, u64::from(number));
                case.sensors = Sensors::draw(case.sensors.settings, case.streams);
                let commands = [pulse(Phase::A, Phase::B), pulse(Phase::C, Phase::B)];
                (case, Script::new(commands))
            })
            .collect();
        same_bits_in_lanes(&cases);
    }
}
