//! Comparators: closed forms of the time to a threshold, what follows a trip, and the referee.
#![allow(clippy::disallowed_methods, reason = "tests compare with the C library")]

mod noise;
mod together;

use std::f64::consts::PI;

use crate::script::{Script, same_bits_in_lanes, stage};
use Leg::{High, Low, Off};
use standstill_interface::{Abc, Capture, Command, Leg, Nanos, Phase, Reading, Sampling, Stage};
use standstill_inverter::{Bridge, DcLink, DeviceKind, Devices, GateTiming, Inverter, OpenLeg};
use standstill_plant::{Motor, built_in};
use standstill_sim::{
    Arrangement, Case, Comparator, ComparatorSettings, Comparators, Ended, Event, NoProbe, RotorState, Run,
    RunError, SensorSettings, Sensors, Streams, Trace, referee, run,
};

const LINK: f64 = 550.0;

/// A timer of picoseconds.
const TIMER: ComparatorSettings = ComparatorSettings { timer: 1e-12, ..SensorSettings::IDEAL.comparator };

const USUAL: Devices = Devices {
    kind: DeviceKind::Igbt,
    switch_drop: 0.9,
    switch_resistance: 50e-3,
    diode_drop: 1.0,
    diode_resistance: 30e-3,
};

fn motor() -> Motor {
    built_in("paper-5k5").expect("built in")
}

/// Ideal switches, or usual ones with dead time and capacitance.
fn case(motor: &Motor, usual: bool, comparator: ComparatorSettings) -> Case<'_> {
    let mut bridge = Bridge { open_leg: OpenLeg::Open, ..Bridge::default() };
    let mut timing = GateTiming::default();
    if usual {
        bridge.devices = USUAL;
        bridge.open_leg = OpenLeg::Diodes;
        timing = GateTiming {
            dead_time: Nanos::from_micros(2),
            turn_off_delay: Nanos(150),
            turn_on_delay: Nanos(130),
        };
    }
    let inverter = Inverter {
        bridge,
        gates: [timing; 3],
        link: DcLink::stiff(LINK),
        carrier_period: Nanos::from_micros(100),
    };
    let settings = SensorSettings { comparator, ..SensorSettings::IDEAL };
    Case { sensors: Sensors::nominal(settings), ..Case::new(motor, inverter) }
}

/// The vector of this number: leg a, b or c alone high (even) or alone low (odd), in the order of their directions.
fn vector(number: usize) -> [Leg<f64>; 3] {
    let [alone, others] = if number.is_multiple_of(2) { [High, Low] } else { [Low, High] };
    let mut legs = [others; 3];
    legs[[0, 2, 1, 0, 2, 1][number]] = alone;
    legs
}

fn until(threshold: f64, legs: [Leg<f64>; 3]) -> Command<f64> {
    Command::until(
        threshold,
        stage(legs, 400),
        Stage::off(Nanos::from_micros(500)),
        Sampling::once(Nanos::ZERO),
    )
}

fn readings(case: &Case<'_>, commands: &[Command<f64>]) -> (Vec<Reading<f64>>, Run<f64>) {
    let mut script = Script::new(commands);
    let run = run(case, &mut script, false, &mut NoProbe);
    (script.readings, run)
}

/// Current in A of a linear motor along a vector of this number, a time in s after its begin.
fn current(motor: &Motor, angle: f64, number: usize, time: f64) -> f64 {
    let off = angle - f64::from(u32::try_from(number).expect("six")) * PI / 3.0;
    let share = |inductance: f64, part: f64| {
        part * part * (2.0 / 3.0) * LINK / motor.resistance
            * -(-motor.resistance * time / inductance).exp_m1()
    };
    share(motor.winding.d_axis_inductance(), off.cos()) + share(motor.winding.q_axis_inductance(), off.sin())
}

/// Time in s at which [`current`] reaches a threshold in A.
fn time_to(motor: &Motor, angle: f64, number: usize, threshold: f64) -> f64 {
    let (mut low, mut high) = (0.0, 400e-6);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if current(motor, angle, number, middle) < threshold { low = middle } else { high = middle }
    }
    low
}

#[test]
fn analytic_the_time_to_a_threshold_is_the_root_of_two_exponentials() {
    let motor = motor().linearised();
    let commands: Vec<_> = (0..6).map(|number| until(8.0, vector(number))).collect();
    let mut worst = 0.0_f64;
    for arrangement in [Comparators::Common, Comparators::PerLeg] {
        for start_angle in [0.0, 0.3, 1.1, 2.0, 3.3, 4.7, 6.0] {
            let settings = ComparatorSettings { arrangement, ..TIMER };
            let case = Case { start_angle, ..case(&motor, false, settings) };
            let (readings, _) = readings(&case, &commands);
            assert_eq!(readings.len(), 6);
            for (number, reading) in readings.iter().enumerate() {
                let Capture { ticks, comparator } = reading.capture.expect("tripped");
                let alone = Phase::ALL[[0, 2, 1, 0, 2, 1][number]];
                let expected = if arrangement == Comparators::Common { Phase::A } else { alone };
                assert_eq!(comparator, expected);
                let off = f64::from(ticks) * 1e-12 - time_to(&motor, start_angle, number, 8.0);
                worst = worst.max(off.abs());
                // Sampled at the next whole nanosecond.
                let rise = LINK / motor.winding.d_axis_inductance();
                assert!((reading.current[alone].abs() - 8.0).abs() < rise * 1.1e-9, "{reading:?}");
            }
        }
    }
    assert!(worst < 50e-12, "{worst} s");
}

#[test]
fn analytic_the_pulse_ends_after_the_delay_and_the_offset_shifts_the_level() {
    let motor = motor().linearised();
    let delayed = ComparatorSettings { delay: 1.5e-6, ..TIMER };
    let mut case = Case { start_angle: 1.0, ..case(&motor, false, delayed) };
    case.sensors.comparator.offset = [0.1, 0.0, 0.0, 0.0, 0.0, 0.0];
    case.sensors.comparator.tick = 1e-9;
    let (readings, run) = readings(&case, &[until(2.0, vector(0))]);
    let trip = time_to(&motor, 1.0, 0, 2.1) + 1.5e-6;
    assert!((f64::from(readings[0].capture.expect("tripped").ticks) - trip * 1e9).abs() < 1.01);
    let there = current(&motor, 1.0, 0, trip);
    assert!(
        (readings[0].current[Phase::A] - there).abs() < 1e-4,
        "{} {there}",
        readings[0].current[Phase::A]
    );
    assert!((run.duration.seconds() - (trip + 0.5e-9 + 500e-6)).abs() < 0.6e-9, "{:?}", run.duration);
    // The peak is where the gates open.
    assert!((run.peak_current - there).abs() < 1e-4);
}

#[test]
fn analytic_a_comparator_of_its_own_has_its_own_offset() {
    let motor = motor().linearised();
    let mut case = case(&motor, false, ComparatorSettings { arrangement: Comparators::PerLeg, ..TIMER });
    case.sensors.comparator.offset = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5];
    let commands: Vec<_> = (0..6).map(|number| until(2.0, vector(number))).collect();
    let (readings, _) = readings(&case, &commands);
    // Legs alone high: a, b, c; alone low: their comparators for current out of the motor.
    for (number, own) in [(0, 0.0), (2, 0.1), (4, 0.2), (3, 0.3), (5, 0.4), (1, 0.5)] {
        let expected = time_to(&motor, 0.0, number, 2.0 + own);
        let found = f64::from(readings[number].capture.expect("tripped").ticks) * 1e-12;
        assert!((found - expected).abs() < 20e-12, "{number}: {found} {expected}");
    }
}

/// Current in A into the motor in phase k, of a linear motor with its rotor at `angle`, a time in s after a vector of this number begins.
fn phase_current(motor: &Motor, angle: f64, number: usize, k: usize, time: f64) -> f64 {
    let turn = |n: usize| f64::from(u32::try_from(n).expect("small")) * PI / 3.0;
    let (voltage, ahead) = (2.0 / 3.0 * LINK, turn(number) - angle);
    let along = |inductance: f64, share: f64| {
        share * voltage / motor.resistance * -(-motor.resistance * time / inductance).exp_m1()
    };
    let d = along(motor.winding.d_axis_inductance(), ahead.cos());
    let q = along(motor.winding.q_axis_inductance(), ahead.sin());
    let axis = turn(2 * k) - angle;
    d * axis.cos() + q * axis.sin()
}

/// A shunt below a leg sees its current while the lower device conducts: of a leg that alone is low all of it, of two that are low each
/// its own, of a leg that is high nothing.
#[test]
fn analytic_comparators_below_the_legs_see_those_that_are_low() {
    let motor = motor().linearised();
    let commands: Vec<_> = (0..6).map(|number| until(3.0, vector(number))).collect();
    let below = ComparatorSettings { arrangement: Comparators::PerLeg, ..TIMER };
    for start_angle in [0.3, 1.1, 2.0, 4.7] {
        let mut case = Case { start_angle, ..case(&motor, false, below) };
        case.sensors.settings.arrangement = Arrangement::LowSideShunts;
        let (readings, _) = readings(&case, &commands);
        for (number, reading) in readings.iter().enumerate() {
            let alone = [0, 2, 1, 0, 2, 1][number];
            let low: Vec<usize> = (0..3).filter(|k| (*k == alone) != number.is_multiple_of(2)).collect();
            // The current of a leg that is low leaves the motor.
            let most = |time: f64| {
                low.iter().map(|k| -phase_current(&motor, start_angle, number, *k, time)).fold(0.0, f64::max)
            };
            let (mut early, mut late) = (0.0, 400e-6);
            for _ in 0..100 {
                let middle = 0.5 * (early + late);
                if most(middle) < 3.0 { early = middle } else { late = middle }
            }
            let Capture { ticks, comparator } = reading.capture.expect("tripped");
            let found = f64::from(ticks) * 1e-12;
            assert!((found - early).abs() < 50e-12, "{start_angle} {number}: {found} {early}");
            assert!(low.contains(&(comparator as usize)), "{start_angle} {number}: {comparator:?}");
            if !number.is_multiple_of(2) {
                assert!((found - time_to(&motor, start_angle, number, 3.0)).abs() < 50e-12);
            }
        }
    }
}

#[test]
fn law_without_a_trip_the_stage_has_its_duration() {
    let motor = motor();
    let case = case(&motor, false, TIMER);
    let command = Command::until(
        100.0,
        stage(vector(0), 50),
        Stage::off(Nanos::from_micros(70)),
        Sampling::twice(Nanos::ZERO, Nanos::from_micros(70)),
    );
    let (until, run) = readings(&case, &[command]);
    assert_eq!(run.duration, Nanos::from_micros(120));
    assert!(until.iter().all(|reading| reading.capture.is_none()));
    // The bits are those of the same pulse without threshold, sampled at the same times.
    let plain = Command {
        threshold: None,
        sampling: Sampling::twice(Nanos::from_micros(50), Nanos::from_micros(120)),
        ..command
    };
    let (plain, _) = readings(&case, &[plain]);
    for (a, b) in until.iter().zip(&plain) {
        assert_eq!(a.current, b.current);
    }
    assert_eq!((until.len(), until[1].at), (2, Nanos::from_micros(70)));
}

#[test]
fn law_comparators_that_nobody_asks_change_no_bit() {
    let motor = motor();
    let commands: Vec<_> = (0..6)
        .map(|number| {
            Command::sequence(
                stage(vector(number), 150),
                Stage::off(Nanos::from_micros(300)),
                Sampling::twice(Nanos::from_micros(150), Nanos::from_micros(450)),
            )
        })
        .collect();
    let bits = |settings| format!("{:?}", readings(&case(&motor, true, settings), &commands));
    let without = bits(ComparatorSettings::default());
    assert!(without == bits(TIMER) && without == bits(ComparatorSettings { trip: 1e3, ..TIMER }));
}

#[test]
fn law_a_threshold_needs_comparator_and_timer() {
    let motor = motor();
    for settings in [ComparatorSettings::default(), ComparatorSettings { timer: 0.0, trip: 20.0, ..TIMER }] {
        let (_, run) = readings(&case(&motor, false, settings), &[until(2.0, vector(0))]);
        assert_eq!(run.ended, Ended::Error(RunError::NoComparator));
    }
    let turns = Stage { legs: Abc([Leg::Duty(0.5), Low, Low]), duration: Nanos::from_micros(300) };
    let late = Sampling::once(Nanos::from_micros(501));
    let [off, pulse] = [Stage::off(Nanos::from_micros(500)), stage(vector(0), 300)];
    for bad in [
        Command::until(2.0, turns, off, Sampling::NONE),
        Command::until(f64::NAN, pulse, off, Sampling::NONE),
        Command::until(2.0, pulse, off, late),
        Command::until(2.0, Stage { duration: Nanos::ZERO, ..pulse }, off, Sampling::NONE),
    ] {
        let (_, run) = readings(&case(&motor, false, TIMER), &[bad]);
        assert_eq!(run.ended, Ended::Error(RunError::BadCommand));
    }
}

#[test]
fn analytic_blanking_hides_what_comes_before() {
    let motor = motor().linearised();
    let case = case(&motor, false, ComparatorSettings { blanking: Nanos(5_000), ..TIMER });
    // 0.1 A flow after about 1.5 µs, 2 A after 30 µs.
    let (readings, _) = readings(&case, &[until(0.1, vector(0)), until(2.0, vector(0))]);
    assert_eq!(readings[0].capture.expect("tripped").ticks, 5_000_000);
    let expected = time_to(&motor, 0.0, 0, 2.0);
    assert!((f64::from(readings[1].capture.expect("tripped").ticks) * 1e-12 - expected).abs() < 20e-12);
}

#[test]
fn analytic_an_overcurrent_ends_the_run() {
    let motor = motor().linearised();
    for arrangement in [Comparators::Common, Comparators::PerLeg] {
        let case = case(&motor, false, ComparatorSettings { arrangement, timer: 0.0, trip: 6.0, ..TIMER });
        let pulse = Command::hold(stage(vector(4), 400), Sampling::once(Nanos::from_micros(400)));
        let mut trace = Trace::new(1e-6);
        let run = run(&case, &mut Script::new([pulse]), false, &mut trace);
        assert_eq!(run.ended, Ended::Error(RunError::Overcurrent { current_ma: 6000 }));
        let expected = time_to(&motor, 0.0, 4, 6.0);
        assert!((run.duration.seconds() - expected).abs() < 1e-9);
        let of = if arrangement == Comparators::Common { Phase::A } else { Phase::C };
        assert!(
            matches!(trace.events.last(), Some((time, Event::Trip(phase)))
            if *phase == of && (time - expected).abs() < 1e-9),
            "{:?}",
            trace.events
        );
        // A threshold above it is never reached.
        let timed = Case {
            sensors: Sensors::nominal(SensorSettings {
                comparator: ComparatorSettings { arrangement, trip: 6.0, ..TIMER },
                ..SensorSettings::IDEAL
            }),
            ..case
        };
        let (_, run) = readings(&timed, &[until(7.0, vector(4))]);
        assert!(matches!(run.ended, Ended::Error(RunError::Overcurrent { .. })));
        let (_, run) = readings(&timed, &[until(5.0, vector(4))]);
        assert!(matches!(run.ended, Ended::Outcome(_)));
    }
}

#[test]
fn law_all_off_needs_no_comparator_to_fall_silent() {
    // A level that the current has before the pulse begins trips at once, and a command that may end there may be the last.
    let motor = motor();
    let mut case = case(&motor, false, TIMER);
    case.sensors.comparator.offset[0] = -1.0;
    let command = Command { then: None, sampling: Sampling::once(Nanos::ZERO), ..until(0.5, [Off; 3]) };
    let (readings, run) = readings(&case, &[command, until(5.0, vector(0))]);
    assert_eq!(readings[0].capture.map(|capture| capture.ticks), Some(0));
    assert!(matches!(run.ended, Ended::Outcome(_)) && readings[1].capture.is_some());
}
