//! The detector fails with a reason instead of guessing.

use standstill_detect::{Decay, LineInductance, LineInductanceSettings, MethodName};
use standstill_interface::{Command, Detector, Fault, Nanos, Outcome, Reading, Real, Step, Undetermined};
use standstill_plant::built_in;
use standstill_scenario::{ErrorSet, Record, Scenario, Verdict};
use standstill_sim::{Arrangement, Ended, NoProbe, RotorState, RunError, run};

use crate::bench::scenario;

fn outcome(change: impl FnOnce(&mut Scenario)) -> Outcome<f64> {
    let mut scenario = scenario(ErrorSet::Default, Decay::Fast, RotorState::Locked);
    change(&mut scenario);
    match scenario.trial(0).expect("settings").run.ended {
        Ended::Outcome(outcome) => outcome,
        Ended::Error(error) => panic!("{error}"),
    }
}

fn fault(change: impl FnOnce(&mut Scenario)) -> Fault<f64> {
    match outcome(change) {
        Outcome::Failed { fault, .. } => fault,
        other => panic!("must fail: {other:?}"),
    }
}

#[test]
fn law_a_clipped_converter_is_named() {
    let fault = fault(|s| {
        s.sensors.adc = s.sensors.adc.map(|adc| standstill_sim::Adc { low: -1.0, high: 1.0, ..adc });
    });
    assert!(matches!(fault, Fault::Clipped(_)), "{fault:?}");
}

#[test]
fn law_a_dead_link_raises_no_current() {
    let fault = fault(|s| s.drive.link.voltage = 20.0);
    assert!(matches!(fault, Fault::NoCurrent { .. }), "{fault:?}");
}

#[test]
fn law_a_motor_without_saliency_has_no_axis() {
    let fault = fault(|s| {
        s.motor.winding.saliency = -0.05e-3;
        s.motor = s.motor.linearised();
    });
    assert!(matches!(fault, Fault::NoSaliency { ratio, .. } if ratio < 0.05), "{fault:?}");
}

#[test]
fn law_a_core_without_saturation_has_no_pole() {
    let outcome = outcome(|s| {
        s.motor = s.motor.linearised();
        s.sensors.offset = 0.0;
    });
    let Outcome::Axis { reason: Undetermined::MarginBelowNoise { margin, needed }, .. } = outcome else {
        panic!("must not name a pole: {outcome:?}")
    };
    assert!(margin < needed);
}

#[test]
fn law_a_current_that_does_not_decay_is_named() {
    let fault = fault(|s| {
        s.sensors.offset = 1.0;
        s.sensors.gain_error = 0.0;
    });
    assert!(matches!(fault, Fault::CurrentPersists(_)), "{fault:?}");
}

#[test]
fn law_a_clipped_link_is_named() {
    let fault = fault(|s| s.drive.link.voltage = 1200.0);
    assert_eq!(fault, Fault::DcLinkClipped);
}

/// Passes commands on and spoils the readings after a number of them.
struct Spoiled {
    inner: LineInductance<f64>,
    after: u32,
    spoil: fn(&mut Reading<f64>),
}

impl Detector<f64> for Spoiled {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        let mut readings = readings.to_vec();
        if self.after == 0 {
            readings.iter_mut().for_each(self.spoil);
        }
        self.after = self.after.saturating_sub(1);
        self.inner.step(&readings)
    }
}

#[test]
fn law_a_reading_that_is_no_number_never_becomes_an_angle() {
    let scenario = scenario(ErrorSet::Default, Decay::Fast, RotorState::Locked);
    let spoils: [fn(&mut Reading<f64>); 3] = [
        |reading| reading.current = standstill_interface::Abc([f64::NAN; 3]),
        |reading| reading.current[standstill_interface::Phase::B] = f64::INFINITY,
        |reading| reading.dc_link = f64::NAN,
    ];
    for spoil in spoils {
        for after in 1..24 {
            let inner = LineInductance::new(scenario.detector).expect("settings");
            let record = scenario.trial_with(0, &mut Spoiled { inner, after, spoil });
            let Ended::Outcome(outcome) = record.run.ended else { panic!("{:?}", record.run.ended) };
            assert!(matches!(outcome, Outcome::Failed { .. }), "after {after}: {outcome:?}");
        }
    }
}

#[test]
fn law_two_sensors_and_shunts_suffice() {
    for arrangement in [Arrangement::TwoInLine, Arrangement::LowSideShunts] {
        for decay in [Decay::Slow, Decay::Fast] {
            let mut scenario = scenario(ErrorSet::Default, decay, RotorState::Locked);
            scenario.sensors.arrangement = arrangement;
            scenario.detector.sample_lead = Nanos(500);
            for trial in 0..20 {
                let record = scenario.trial(trial).expect("settings");
                let error = record.error_deg().unwrap_or(180.0);
                assert!(error.abs() < 6.0, "{arrangement:?} {decay:?} {trial}: {error}° {}", record.reason());
            }
        }
    }
}

#[test]
fn law_shunts_sampled_at_the_edge_fail_with_a_reason_and_not_with_an_angle() {
    // A late sample comes when the lower switch is off already: the current has left the shunt.
    let mut scenario = scenario(ErrorSet::Harsh, Decay::Fast, RotorState::Locked);
    scenario.sensors.arrangement = Arrangement::LowSideShunts;
    let records: Vec<_> = (0..20).map(|trial| scenario.trial(trial).expect("settings")).collect();
    assert!(records.iter().any(|record| record.reason().contains("too little current")));
    scenario.detector.sample_lead = Nanos(1500);
    assert!((0..20).all(|trial| scenario.trial(trial).expect("settings").pole_correct() == Some(true)));
}

#[test]
fn law_an_early_second_sample_is_accounted_for() {
    for decay in [Decay::Slow, Decay::Fast] {
        let mut scenario = scenario(ErrorSet::None, decay, RotorState::Locked);
        scenario.motor = scenario.motor.linearised();
        scenario.detector.polarity.least_margin = 0.0;
        scenario.detector.sample_lead = Nanos(5000);
        for trial in 0..20 {
            let error = scenario.trial(trial).expect("settings").axis_error_deg().expect("found");
            assert!(error.abs() < 0.01, "{decay:?}: {error}°");
        }
    }
}

#[test]
fn law_the_hoist_is_detected_too() {
    let mut scenario = scenario(ErrorSet::Default, Decay::Fast, RotorState::Free);
    scenario.motor = built_in("gearless-hoist").expect("built in");
    for trial in 0..50 {
        let record = scenario.trial(trial).expect("settings");
        assert!(record.error_deg().is_some_and(|e| e.abs() < 4.0), "{trial}: {:?}", record.run.ended);
        assert!(record.rotor_moved_deg() < 0.05);
    }
}

#[test]
fn law_the_papers_rule_names_the_wrong_pole_where_the_polarity_signature_is_inverted() {
    let verdicts = |name: &str| {
        let motor = built_in(name).expect("built in");
        let scenario = Scenario::paper(motor, ErrorSet::Default, Decay::Fast, RotorState::Locked, 1);
        (0..20).map(|trial| scenario.trial(trial).expect("settings")).collect::<Vec<_>>()
    };
    for record in verdicts("pm-reluctance") {
        assert_eq!(record.pole_correct(), Some(false), "{:?}", record.run.ended);
        assert!(record.axis_error_deg().is_some_and(|error| error.abs() < 10.0), "the axis is about right");
    }
    // The paper's own motor keeps the paper's pulses.
    let own = scenario(ErrorSet::Default, Decay::Fast, RotorState::Locked).detector;
    assert_eq!((own.pulse, own.polarity.periods), (Nanos::from_micros(80), 10));
}

#[test]
fn law_of_a_motor_without_a_magnet_the_axis_is_the_answer() {
    // Its torque goes with sin 2(θ - θ_d): both ends of the axis are one position to the drive.
    let motor = built_in("reluctance-6k7").expect("built in");
    let scenario = Scenario::of_method(MethodName::Bipolar, motor, ErrorSet::Default, RotorState::Locked, 1);
    let mut all: Vec<Record> = (0..20).map(|trial| scenario.trial(trial).expect("settings")).collect();
    // A detector that names one of its ends all the same is neither right nor wrong.
    for k in 0..all.len() {
        let mut named = all[k];
        let Ended::Outcome(Outcome::Axis { angle, findings, .. }) = named.run.ended else {
            panic!("{:?}", named.run.ended)
        };
        for angle in [angle, angle.opposite()] {
            named.run.ended = Ended::Outcome(Outcome::Found { angle, findings });
            all.push(named);
        }
    }
    for record in all {
        assert_eq!((record.verdict(), record.pole_correct()), (Verdict::Found, None));
        assert_eq!((record.reason(), record.reason_name()), (String::new(), None));
        let axis = record.estimated_angle_deg().expect("an axis");
        let error = record.error_deg().expect("an axis");
        assert!((0.0..180.0).contains(&axis) && (-90.0..=90.0).contains(&error));
        let turns = (axis - record.true_angle_deg() - error) / 180.0;
        assert!((turns - turns.round()).abs() < 1e-9, "{turns}");
    }
}

#[test]
fn law_single_precision_gives_the_same_angle() {
    let scenario = scenario(ErrorSet::None, Decay::Fast, RotorState::Locked);
    let single = LineInductanceSettings::paper(Decay::Fast, &scenario.nameplate().cast::<f32>());
    for trial in 0..20 {
        let case = scenario.case(trial);
        let double = scenario.trial(trial).expect("settings").run.found().expect("found");
        let mut detector = LineInductance::new(single).expect("settings");
        let single = run(&case, &mut detector, false, &mut NoProbe).found().expect("found");
        let difference = (single.to_double() - double).to_degrees();
        assert!(difference.abs() < 0.01, "trial {trial}: {difference}°");
    }
}

/// Asks for a sample after the end of its command.
struct Wrong;

impl Detector<f64> for Wrong {
    fn step(&mut self, _: &[standstill_interface::Reading<f64>]) -> Step<f64> {
        Step::Drive(Command::hold(
            standstill_interface::Stage::off(Nanos(10)),
            standstill_interface::Sampling::once(Nanos(11)),
        ))
    }
}

/// Never done.
struct Endless;

impl Detector<f64> for Endless {
    fn step(&mut self, _: &[standstill_interface::Reading<f64>]) -> Step<f64> {
        let stage = standstill_interface::Stage::off(Nanos::from_micros(100_000));
        Step::Drive(Command::hold(stage, standstill_interface::Sampling::NONE))
    }
}

/// Orders a wait of this many nanoseconds, again and again, after a first short one.
struct Waiting(u64);

impl Detector<f64> for Waiting {
    fn step(&mut self, _: &[Reading<f64>]) -> Step<f64> {
        let wait = std::mem::replace(&mut self.0, u64::MAX);
        let stage = standstill_interface::Stage::off(Nanos(wait));
        Step::Drive(Command::hold(stage, standstill_interface::Sampling::NONE))
    }
}

#[test]
fn regress_absurd_times_end_in_an_error_and_not_in_a_panic() {
    let mut scenario = scenario(ErrorSet::Harsh, Decay::Fast, RotorState::Locked);
    for first in [1000, u64::MAX] {
        let record = scenario.trial_with(0, &mut Waiting(first));
        assert!(matches!(record.run.ended, Ended::Error(RunError::TimeLimit(_))), "{:?}", record.run.ended);
    }
    for (pulse, period) in [(80_000, u64::MAX), (u64::MAX / 2 + 1, u64::MAX)] {
        (scenario.detector.pulse, scenario.detector.period) = (Nanos(pulse), Nanos(period));
        assert!(scenario.trial(0).is_err());
    }
}

#[test]
fn regress_pwm_without_a_carrier_is_an_error() {
    let mut scenario = scenario(ErrorSet::Default, Decay::Fast, RotorState::Locked);
    let mut detector = LineInductance::new(scenario.detector).expect("settings");
    scenario.drive.carrier_period = Nanos::ZERO;
    let record = scenario.trial_with(0, &mut detector);
    assert_eq!(record.run.ended, Ended::Error(RunError::BadDuty));
}

#[test]
fn law_different_carriers_of_drive_and_detector_are_refused() {
    let mut scenario = scenario(ErrorSet::Default, Decay::Fast, RotorState::Locked);
    assert!(scenario.check().is_ok());
    scenario.detector.polarity.carrier_period = Nanos::from_micros(50);
    let error = scenario.check().expect_err("must be refused").to_string();
    assert!(error.contains("polarity.carrier_period"), "{error}");
}

#[test]
fn regress_a_detector_that_misbehaves_is_a_record() {
    let scenario = scenario(ErrorSet::Default, Decay::Fast, RotorState::Locked);
    assert_eq!(scenario.trial_with(0, &mut Wrong).run.ended, Ended::Error(RunError::BadCommand));
    let endless = scenario.trial_with(0, &mut Endless);
    assert!(matches!(endless.run.ended, Ended::Error(RunError::TimeLimit(_))));
    assert_eq!(endless.error_deg(), None);
}

/// Terminals that follow a link that ripples: their devices carry what charges the terminals, which comes and goes. Which mode
/// follows had been decided by the current's slope alone, behind a resistance that conducts nothing by then.
#[test]
fn regress_idle_legs_at_a_rail_that_ripples_do_not_chatter() {
    let motor = built_in("paper-5k5").expect("built in");
    let scenario =
        Scenario::of_method(MethodName::OpenTerminal, motor, ErrorSet::Field, RotorState::Locked, 1);
    for (trial, angle) in [(280, 298.319_31), (2777, 271.134_11)] {
        let record = scenario.trial(trial).expect("settings");
        assert!((record.run.end_angle.to_degrees().rem_euclid(360.0) - angle).abs() < 1e-4, "another trial");
        assert!(matches!(record.run.ended, Ended::Outcome(_)), "{trial}: {}", record.reason());
    }
}
