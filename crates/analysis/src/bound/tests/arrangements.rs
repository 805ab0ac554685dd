//! Bounds of drives without sensors in their phases: times to a threshold, one shunt, terminals.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use standstill_campaign::Statistics;
use standstill_detect::{Method, MethodName};
use standstill_plant::{Motor, built_in};
use standstill_scenario::ErrorSet;
use standstill_sim::{Comparators, RotorState, TerminalSensor};

use super::super::*;
use super::ThreePulses;

/// A motor that obeys the closed forms: neither saturation nor resistance.
fn linear() -> Motor {
    let mut motor = built_in("paper-5k5").expect("built in").linearised();
    motor.resistance = 0.0;
    motor
}

/// Makes a scenario with an ideal drive that reads no current.
fn blind(method: MethodName, motor: Motor) -> Scenario<Method<f64>> {
    let mut scenario = Scenario::of_method(method, motor, ErrorSet::None, RotorState::Locked, 3);
    scenario.sensors.arrangement = Arrangement::None;
    scenario
}

const TICK: f64 = 0.32e-6;
const THRESHOLD: f64 = 5.0;

/// Six pulses to a threshold.
fn six_pulse(motor: Motor) -> Scenario<Method<f64>> {
    let mut scenario = blind(MethodName::SixPulse, motor);
    scenario.sensors.comparator.timer = TICK;
    let Method::SixPulse(settings) = &scenario.detector else { panic!("{:?}", scenario.detector) };
    let mut settings = *settings;
    (settings.timed, settings.rounds) = (true, 1);
    settings.threshold = THRESHOLD;
    settings.longest = Nanos::from_micros(600);
    settings.sensing.comparator.tick = TICK;
    scenario.detector = Method::SixPulse(settings);
    scenario
}

fn at<S: Settings<f64>>(bounds: Bounds<S>, angle: f64) -> Bound {
    bounds.at(angle).expect("simulated").expect("a method that finds the rotor where it stood")
}

/// Time to the threshold in the direction of this number, by angle, L_A and L_B: t = X (9/4)(L_A² − L_B²) / (U (L_A − L_B cos 2(θ − φ))).
fn time(number: usize, [angle, mean, saliency]: [f64; 3]) -> f64 {
    let direction = TAU / 6.0 * number as f64;
    let inverse = mean - saliency * (2.0 * (angle - direction)).cos();
    THRESHOLD * 2.25 * (mean * mean - saliency * saliency) / (550.0 * inverse)
}

/// ∂t/∂(θ, L_A, L_B) of the six directions, of which opposite ones are alike.
fn slopes(at: [f64; 3]) -> Vec<Vector3<f64>> {
    let differ = |number: usize, k: usize| {
        let step = 1e-6 * if k == 0 { 1.0 } else { at[1] };
        let moved = |by: f64| time(number, std::array::from_fn(|n| at[n] + if n == k { by } else { 0.0 }));
        (moved(step) - moved(-step)) / (2.0 * step)
    };
    (0..6).map(|number| Vector3::new(differ(number, 0), differ(number, 1), differ(number, 2))).collect()
}

#[test]
fn analytic_times_to_a_threshold_of_a_linear_motor() {
    for noise in [0.0, 30e-3] {
        let mut scenario = six_pulse(linear());
        scenario.sensors.comparator.noise = noise;
        let winding = scenario.motor.winding;
        for angle in [0.0, 0.4, 1.3, 2.9] {
            let nominal = [angle, winding.mean_inductance, winding.saliency];
            let mut known = 0.0;
            let mut information = Matrix3::zeros();
            for (number, slope) in slopes(nominal).iter().enumerate() {
                // The tick's q²/12, and the noise of the threshold by the current's slope X/t.
                let variance = TICK * TICK / 12.0 + (noise * time(number, nominal) / THRESHOLD).powi(2);
                known += slope[0] * slope[0] / variance;
                information += slope * slope.transpose() / variance;
            }
            let got = at(Bounds { unknown: &[], ..Bounds::new(&scenario) }, angle);
            assert!((got.scheme_deg.to_radians() * known.sqrt() - 1.0).abs() < 1e-3, "{angle}: {got:?}");
            // Between two trips such a drive has no readings.
            assert_eq!(got.all_deg, Some(got.scheme_deg));
            let expected =
                information.try_inverse().expect("three directions tell three numbers")[(0, 0)].sqrt();
            let unknown = &[Unknown::MeanInductance, Unknown::Saliency];
            let got = at(Bounds { unknown, ..Bounds::new(&scenario) }, angle).scheme_deg.to_radians();
            assert!((got / expected - 1.0).abs() < 2e-3, "{angle}: {got} {expected}");
        }
    }
}

#[test]
fn law_what_all_times_have_in_common_costs_little_and_own_comparators_much() {
    let mut scenario = six_pulse(linear());
    let bound = |scenario: &Scenario<Method<f64>>| at(Bounds::new(scenario), 0.4);
    let base = bound(&scenario);
    assert_eq!(base.hybrid_deg.map(|hybrid| (hybrid / base.scheme_deg * 1e6).round()), Some(1e6));
    scenario.sensors.comparator.offset = 0.05;
    scenario.sensors.comparator.timer_error = 0.01;
    let hybrid = |scenario: &Scenario<Method<f64>>| bound(scenario).hybrid_deg.expect("noise");
    let common = hybrid(&scenario);
    assert!(common < 1.05 * base.scheme_deg, "{common} {base:?}");
    scenario.sensors.comparator.arrangement = Comparators::PerLeg;
    let own = hybrid(&scenario);
    assert!(own > 1.5 * common, "{own} {common}");
}

/// One pulse on each line. The floating terminal is read before the pulse ends, while the other two legs still drive.
const PULSES: ThreePulses = ThreePulses { early: Nanos::from_micros(2) };

#[test]
fn analytic_floating_terminals_of_a_linear_motor() {
    const NOISE: f64 = 0.5;
    let mut scenario = Scenario::new(linear(), ErrorSet::None, RotorState::Locked, 1, |_| PULSES);
    scenario.sensors.arrangement = Arrangement::None;
    scenario.sensors.terminal = Some(TerminalSensor { noise: NOISE, ..TerminalSensor::IDEAL });
    let winding = scenario.motor.winding;
    let ratio = winding.saliency / winding.mean_inductance;
    // The open terminal against the middle of the other two.
    let open = |line: usize, angle: f64| {
        let turned = 2.0 * (angle - TAU / 3.0 * line as f64) + TAU / 6.0;
        -0.75_f64.sqrt() * 550.0 * ratio * turned.sin() / (1.0 + ratio * turned.cos())
    };
    for angle in [0.1, 0.8, 2.0] {
        let slope = |line: usize| (open(line, angle + 1e-6) - open(line, angle - 1e-6)) / 2e-6;
        let squares: f64 = (0..3).map(|line| slope(line).powi(2)).sum();
        let expected = (NOISE / squares.sqrt()).to_degrees();
        let got = at(Bounds { unknown: &[], ..Bounds::new(&scenario) }, angle);
        assert!((got.scheme_deg / expected - 1.0).abs() < 1e-5, "{angle}: {got:?} {expected}");
    }
    // A drive without readings has no bound.
    scenario.sensors.terminal = None;
    assert!(at(Bounds::new(&scenario), 0.1).scheme_deg.is_infinite());
}

#[test]
fn analytic_one_shunt_reads_a_line_once_where_two_sensors_read_it_twice() {
    let mut scenario = Scenario::new(linear(), ErrorSet::None, RotorState::Locked, 1, |_| PULSES);
    scenario.sensors.noise = 20e-3;
    let three = at(Bounds::new(&scenario), 0.4).scheme_deg;
    scenario.sensors.arrangement = Arrangement::DcLinkShunt;
    let one = at(Bounds::new(&scenario), 0.4).scheme_deg;
    assert!((one / three / 2.0_f64.sqrt() - 1.0).abs() < 1e-6, "{one} {three}");
}

/// Rms of the axis over so many starts in degrees, and the bound over the angles.
fn measured(scenario: &Scenario<Method<f64>>, trials: u64) -> (f64, f64) {
    let records: Vec<_> =
        (0..trials).into_par_iter().map(|trial| scenario.trial(trial).expect("settings")).collect();
    let mut statistics = Statistics::default();
    for record in &records {
        statistics.add(record);
    }
    let summary = statistics.summary();
    assert_eq!(summary.axes, trials, "{:?}", summary.reasons);
    let bound = Bound::of(Bounds::of_method(scenario), 7).expect("simulated").expect("a bound");
    (summary.rms_deg.value, bound.scheme_deg)
}

#[test]
fn law_six_pulses_come_near_the_bound_of_their_times_and_never_below() {
    // Noise of the threshold that is larger than a tick, so that errors are near normal.
    let mut scenario = six_pulse(linear());
    scenario.sensors.comparator.noise = 40e-3;
    let (rms, bound) = measured(&scenario, 2000);
    assert!((0.95..1.1).contains(&(rms / bound)), "{rms} {bound}");
}

#[test]
fn law_the_open_terminal_comes_near_the_bound_of_its_voltages_and_never_below() {
    let mut scenario = blind(MethodName::OpenTerminal, linear());
    scenario.sensors.terminal = Some(TerminalSensor { noise: 0.5, ..TerminalSensor::IDEAL });
    let Method::OpenTerminal(mut settings) = Method::suited(MethodName::OpenTerminal, &scenario.nameplate())
    else {
        panic!("another method")
    };
    // Terminals without a capacitance do not oscillate. The bound uses more than the method: the samples of the decay, as many as those of
    // the pulse, and the voltages of the driven terminals, whose noise makes that of the difference half as large again. Together √3.
    settings.settle = Nanos::ZERO;
    scenario.detector = Method::OpenTerminal(settings);
    let (rms, bound) = measured(&scenario, 2000);
    assert!((1.6..2.2).contains(&(rms / bound)), "{rms} {bound}");
}
