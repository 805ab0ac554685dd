//! The error of the paper's scheme under the two error sets, against an independent prototype.

use standstill_campaign::{Campaign, Summary};
use standstill_detect::Decay;
use standstill_interface::Nanos;
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::{Arrangement, RotorState};

use crate::bench::scenario;

/// An rms error of 1,000 trials is known to 2 %.
const TRIALS: u64 = 1000;

fn summary(scenario: &Scenario, trials: u64) -> Summary {
    Campaign { scenario, trials, threads: None }.summary().expect("settings")
}

#[test]
fn cross_rms_within_a_fifth_of_the_prototype_in_all_four_combinations() {
    for (decay, errors, expected) in [
        (Decay::Slow, ErrorSet::Default, 1.22),
        (Decay::Slow, ErrorSet::Harsh, 1.78),
        (Decay::Fast, ErrorSet::Default, 0.84),
        (Decay::Fast, ErrorSet::Harsh, 1.55),
    ] {
        let got = summary(&scenario(errors, decay, RotorState::Locked), TRIALS);
        let rms = got.rms_deg.value;
        assert!((rms / expected - 1.0).abs() < 0.2, "{decay:?} {errors:?}: {rms} against {expected}");
        assert_eq!(got.failed, 0);
        assert_eq!(got.found + got.undetermined, got.trials);
    }
}

#[test]
fn cross_each_source_alone_costs_what_the_prototype_found() {
    // Source, slow and fast decay; linear core so that nothing else shows.
    type Change = fn(&mut Scenario);
    let sources: [(&str, Change, f64, f64); 2] = [
        ("gain 0.5 %", |s| s.sensors.gain_error = 0.005, 0.50, 0.51),
        ("noise 10 mA", |s| s.sensors.noise = 0.01, 0.55, 0.53),
    ];
    for (name, change, slow, fast) in sources {
        for (decay, expected) in [(Decay::Slow, slow), (Decay::Fast, fast)] {
            let rms = alone(decay, TRIALS, change);
            assert!((rms / expected - 1.0).abs() < 0.2, "{name}, {decay:?}: {rms} against {expected}");
        }
    }
}

/// rms axis error in degrees with one source of error, on a linear core.
fn alone(decay: Decay, trials: u64, change: impl Fn(&mut Scenario)) -> f64 {
    let mut scenario = scenario(ErrorSet::None, decay, RotorState::Locked);
    scenario.motor = scenario.motor.linearised();
    scenario.detector.polarity.least_margin = 0.0;
    change(&mut scenario);
    summary(&scenario, trials).rms_deg.value
}

#[test]
fn analytic_jitter_with_slow_decay_costs_only_when_early() {
    // i2 is sampled where the pulse ends. An early sample misses current at the pulse's slope; a late one meets
    // the freewheeling current, which hardly changes. So the relative error of an inductance is min(δ, 0)/t1 with
    // δ uniform in ±1 µs: variance 1/6 − 1/16 µs², averaged over three pulses. (The prototype, 0.34°, lets late
    // samples rise along the pulse.) σ_θ = 0.408 ε / (|L_B|/L_A).
    let epsilon = (1.0_f64 / 6.0 - 1.0 / 16.0).sqrt() / 80.0 / 3.0_f64.sqrt();
    let expected = (0.408 * epsilon / (2.1 / 9.2)).to_degrees();
    let slow = alone(Decay::Slow, TRIALS, |s| s.sensors.jitter.0 = 1000);
    assert!((slow / expected - 1.0).abs() < 0.1, "{slow} against {expected}");
    // With fast decay a late sample meets a falling current: both ways cost. Prototype: 0.31°.
    let fast = alone(Decay::Fast, TRIALS, |s| s.sensors.jitter.0 = 1000);
    assert!((fast / 0.31 - 1.0).abs() < 0.2, "{fast}");
}

#[test]
fn law_other_sensor_arrangements_are_about_as_good() {
    // With two sensors the third phase's error is the sum of two; shunts derive the phase whose leg is high.
    let mut scenario = scenario(ErrorSet::Default, Decay::Fast, RotorState::Locked);
    for (arrangement, low, high) in
        [(Arrangement::TwoInLine, 0.7, 1.1), (Arrangement::LowSideShunts, 0.8, 1.4)]
    {
        scenario.sensors.arrangement = arrangement;
        scenario.detector.sample_lead = Nanos(500);
        let got = summary(&scenario, TRIALS);
        let rms = got.rms_deg.value;
        assert!(
            rms > low && rms < high && got.wrong_poles == 0 && got.failed == 0,
            "{arrangement:?}: {got:?}"
        );
    }
}

#[test]
fn analytic_gain_mismatch_obeys_the_small_error_formula() {
    let expected = (0.408 * 0.005 / (2.1_f64 / 9.2)).to_degrees();
    let got = alone(Decay::Slow, 3 * TRIALS, |s| s.sensors.gain_error = 0.005);
    assert!((got / expected - 1.0).abs() < 0.05, "{got} against {expected}");
}
