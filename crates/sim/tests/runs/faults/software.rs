//! Faults of software and comparators, each with a closed form of the current.

use super::*;
use standstill_interface::Stage;
use standstill_sim::ComparatorSettings;

fn sampled(legs: [Leg<f64>; 3], micros: u64, at: u64) -> Command<f64> {
    Command::hold(stage(legs, micros), Sampling::once(Nanos(at * US)))
}

/// The edges come 100 µs late, also those that end a pulse; the samples do not.
#[test]
fn analytic_a_late_command_moves_the_edges_and_not_the_samples() {
    let motor = motor().linearised();
    let ([ab, ..], r) = (lines(&motor, 0.7), 2.0 * motor.resistance);
    let late = [Fault::lasting(Broken::Late(Nanos(100 * US)))];
    let legs = [High, Low, Off];
    let (readings, _) = play(&case(&motor, false, &late), &[sampled(legs, 300, 90), sampled(legs, 150, 150)]);
    assert!(readings[0].current.0[0].abs() < 1e-9, "before the late edge: {:?}", readings[0].current);
    near(readings[1].current.0[0], line(LINK, ab, r, 350e-6), "since the late edge");
    // A pulse of 300 µs whose end is late lasts 300 µs, and still rises 90 µs after it should have ended.
    let (readings, run) = play(
        &case(&motor, false, &late),
        &[sampled([High, Low, Off], 300, 250), sampled([Off; 3], 5000, 90), sampled([Off; 3], 200, 100)],
    );
    near(readings[0].current.0[0], line(LINK, ab, r, 150e-6), "while it rises");
    near(readings[1].current.0[0], line(LINK, ab, r, 290e-6), "before the late end");
    near(run.peak_current, line(LINK, ab, r, 300e-6), "as long as ordered");
}

/// One period of 100 µs of a leg against the two others along the d-axis: a pulse in its middle.
#[test]
fn analytic_a_limited_duty_shortens_the_pulse_in_the_middle_of_a_period() {
    let motor = motor().linearised();
    let (inductance, r) = (motor.winding.d_axis_inductance(), motor.resistance);
    let read = |duty: f64, faults: &[Fault]| {
        let case = Case { start_angle: 0.0, ..case(&motor, false, faults) };
        play(&case, &[sampled([Duty(duty), Low, Low], 100, 100)]).0[0].current.0[0]
    };
    let expected = |duty: f64| {
        let (on, after) = (duty * 1e-4, (1.0 - duty) * 0.5e-4);
        line(2.0 / 3.0 * LINK, inductance, r, on) * (-r * after / inductance).exp()
    };
    let limited = [Fault::lasting(Broken::Duty(0.5))];
    near(read(0.8, &[]), expected(0.8), "whole");
    near(read(0.8, &limited), expected(0.5), "limited");
    near(read(0.3, &limited), expected(0.3), "below the limit");
    // It limits what is ordered while it lasts.
    let later = [Fault { from: Nanos(100 * US), ..limited[0] }];
    near(read(0.8, &later), expected(0.8), "before");
}

#[test]
fn analytic_a_lost_sample_repeats_the_one_before() {
    let motor = motor().linearised();
    let ([ab, ..], r) = (lines(&motor, 0.7), 2.0 * motor.resistance);
    let read = |faults: &[Fault]| {
        let sampling = Sampling { first: Nanos(20 * US), interval: Nanos(20 * US), count: 5 };
        let commands = [Command::hold(stage([High, Low, Off], 100), sampling)];
        let (readings, _) = play(&case(&motor, false, faults), &commands);
        readings.iter().map(|read| read.current.0[0]).collect::<Vec<_>>()
    };
    let there = [20e-6, 40e-6, 60e-6, 80e-6, 100e-6].map(|time| line(LINK, ab, r, time));
    let same = |found: Vec<f64>, expected: [f64; 5]| {
        for (found, expected) in found.into_iter().zip(expected) {
            near(found, expected, "sample");
        }
    };
    let lost = Fault { from: Nanos(50 * US), until: Nanos(70 * US), ..Fault::lasting(Broken::Stale) };
    same(read(&[]), there);
    same(read(&[lost]), [there[0], there[1], there[1], there[3], there[4]]);
    // All of them: each result is the one of the sample before; the first has none.
    let [a, b, c, d, _] = there;
    same(read(&[Fault::lasting(Broken::Stale)]), [a, a, b, c, d]);
}

#[test]
fn analytic_a_pulse_goes_on_to_its_end_where_no_comparator_trips() {
    let motor = motor().linearised();
    let (inductance, r) = (motor.winding.d_axis_inductance(), motor.resistance);
    let comparator = ComparatorSettings { timer: 1e-9, ..SensorSettings::IDEAL.comparator };
    let until = Command::until(
        8.0,
        stage([High, Low, Low], 400),
        Stage::off(Nanos::from_micros(5000)),
        Sampling::once(Nanos::ZERO),
    );
    let read = |faults: &[Fault]| {
        let sensors = Sensors::nominal(SensorSettings { comparator, ..SensorSettings::IDEAL });
        let case = Case { sensors, start_angle: 0.0, ..case(&motor, false, faults) };
        let (readings, run) = play(&case, &[until]);
        (readings[0].capture.map(|capture| f64::from(capture.ticks) * 1e-9), run.peak_current)
    };
    let rises = |time: f64| line(2.0 / 3.0 * LINK, inductance, r, time);
    let time = -inductance / r * (-8.0 * r / (2.0 / 3.0 * LINK)).ln_1p();
    let (tripped, peak) = read(&[]);
    assert!(
        (tripped.expect("tripped") - time).abs() < 3e-9 && (peak - 8.0).abs() < 1e-3,
        "{tripped:?} {peak}"
    );
    let (tripped, peak) = read(&[Fault::lasting(Broken::Deaf)]);
    assert_eq!(tripped, None);
    near(peak, rises(400e-6), "at the end of the pulse");
    // As soon as it works again, it trips: its level has been passed.
    let (tripped, peak) = read(&[Fault { until: Nanos(300 * US), ..Fault::lasting(Broken::Deaf) }]);
    assert!((tripped.expect("tripped") - 300e-6).abs() < 3e-9, "{tripped:?}");
    assert!((peak - rises(300e-6)).abs() < 1e-3, "{peak}");
}
