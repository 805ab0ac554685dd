//! Shunts in the DC link and below the legs: what they show, and which methods can do with it.

use std::f64::consts::{PI, TAU};

use standstill_detect::{Method, MethodName, Source};
use standstill_interface::{Abc, Command, Detector, Leg, Nanos, Phase, Reading, Sensed, Stage, Step};
use standstill_plant::built_in;
use standstill_scenario::{ErrorSet, Scenario};
use standstill_sim::{Adc, Arrangement, RotorState};

fn scenario(method: MethodName, errors: ErrorSet, arrangement: Arrangement) -> Scenario<Method<f64>> {
    let motor = built_in("paper-5k5").expect("built in");
    let mut scenario = Scenario::of_method(method, motor, errors, RotorState::Locked, 1);
    scenario.sensors.arrangement = arrangement;
    if arrangement == Arrangement::DcLinkShunt {
        scenario.sensors.settle = Nanos::from_micros(if errors == ErrorSet::None { 0 } else { 8 });
    }
    scenario.detector = Method::suited(method, &scenario.nameplate());
    scenario
}

/// Without errors the shunt shows the current of the line, so the answer is the same to the rounding of sums.
#[test]
fn law_an_ideal_shunt_gives_the_answers_of_ideal_sensors() {
    for method in [MethodName::Bipolar, MethodName::MaximumLikelihoodAdaptive] {
        let [shunt, sensors] = [Arrangement::DcLinkShunt, Arrangement::ThreeInLine].map(|arrangement| {
            let scenario = scenario(method, ErrorSet::None, arrangement);
            [0, 1, 2, 3].map(|trial| scenario.trial(trial).expect("settings").error_deg().expect("an angle"))
        });
        for (one, three) in shunt.into_iter().zip(sensors) {
            assert!((one - three).abs() < 1e-3, "{method}: {one}°, {three}°");
        }
    }
}

/// Below the legs the two directions of a line are read by two shunts, which are compared where one takes over from the other: taken as
/// equal, most poles would stay open.
#[test]
fn law_methods_by_pulses_both_ways_find_the_pole_through_shunts() {
    let both_ways =
        [MethodName::Bipolar, MethodName::MaximumLikelihood, MethodName::MaximumLikelihoodAdaptive];
    for arrangement in [Arrangement::DcLinkShunt, Arrangement::LowSideShunts] {
        for (method, errors) in both_ways
            .into_iter()
            .flat_map(|method| [ErrorSet::Default, ErrorSet::Field].map(|errors| (method, errors)))
        {
            let scenario = scenario(method, errors, arrangement);
            let records: Vec<_> = (0..60).map(|trial| scenario.trial(trial).expect("settings")).collect();
            let mut squares = 0.0;
            for record in &records {
                let error = record.axis_error_deg();
                let error = error.unwrap_or_else(|| panic!("{method} {errors:?}: {}", record.reason()));
                squares += error * error / records.len() as f64;
            }
            let open = records.iter().filter(|record| record.error_deg().is_none()).count();
            assert!(open <= 1, "{method} {errors:?} {arrangement:?}: {open} poles are open");
            // By three sensors 0.10° and 0.04 to 0.07°: noise counts √2 times, because no second sensor averages it.
            assert!(squares.sqrt() < 0.2, "{method} {errors:?} {arrangement:?}: {}°", squares.sqrt());
        }
    }
}

/// The paper's pulses with fast decay: what the vectors of its polarity test raised, diodes return to the link.
#[test]
fn law_line_pulses_with_fast_decay_find_the_pole_through_shunts() {
    for arrangement in [Arrangement::DcLinkShunt, Arrangement::LowSideShunts] {
        for errors in [ErrorSet::None, ErrorSet::Default, ErrorSet::Field] {
            let scenario = scenario(MethodName::LineInductanceFast, errors, arrangement);
            let mut squares = 0.0;
            for trial in 0..40 {
                let record = scenario.trial(trial).expect("settings");
                let error = record.error_deg();
                let error =
                    error.unwrap_or_else(|| panic!("{arrangement:?} {errors:?}: {}", record.reason()));
                squares += error * error / 40.0;
            }
            // By three sensors 0.8 and 1.7°; what is left without errors is the saturation by pulses of one direction.
            let most = if errors == ErrorSet::None { 0.5 } else { 1.6 };
            assert!(squares.sqrt() < most, "{arrangement:?} {errors:?}: {}°", squares.sqrt());
        }
    }
    // While the current circulates through the lower switches none flows in the link.
    let slow = scenario(MethodName::LineInductance, ErrorSet::Default, Arrangement::DcLinkShunt);
    let needs = standstill_detect::Settings::sources(&slow.detector);
    assert!(!Source::any_of(needs, &slow.sources()));
}

/// Edges that are shifted for windows, and back in the next period, leave the mean voltage and the current in the middle of both as they are.
#[test]
fn law_an_injection_through_one_shunt_gives_the_answer_of_three_sensors() {
    for method in [MethodName::HfiRotating, MethodName::HfiPulsating] {
        for trial in 0..6 {
            let [shunt, sensors] = [Arrangement::DcLinkShunt, Arrangement::ThreeInLine].map(|arrangement| {
                let mut scenario = scenario(method, ErrorSet::None, arrangement);
                scenario.motor = scenario.motor.linearised();
                let record = scenario.trial(trial).expect("settings");
                let error = record.axis_error_deg();
                error.unwrap_or_else(|| panic!("{method} {arrangement:?}: {}", record.reason()))
            });
            // What is left is the drop R i, `Γ R ∫ (i − i_mid) dt` over at most a carrier period T after the middle: for a current that
            // rises by ω i a second a share R/L ω T²/2 of it, of which half is the axis's angle.
            let motor = built_in("paper-5k5").expect("built in");
            let least = motor.winding.d_axis_inductance().min(motor.winding.q_axis_inductance());
            let (omega, period) = (TAU * 500.0, 100e-6);
            let most = (motor.resistance / least * omega * period * period / 4.0).to_degrees();
            assert!((shunt - sensors).abs() < most && most < 0.1, "{method}: {shunt}°, {sensors}°, {most}°");
        }
    }
}

/// With errors, dead time and an amplifier that has to settle the shunt costs noise, and no axis: the legs' delays and what the
/// compensation of dead time and drops leaves turn it, as they do where three sensors read.
#[test]
fn law_injections_through_one_shunt_find_the_pole_with_errors() {
    for method in [MethodName::HfiRotating, MethodName::HfiPulsating] {
        for errors in [ErrorSet::Default, ErrorSet::Field] {
            let scenario = scenario(method, errors, Arrangement::DcLinkShunt);
            let records: Vec<_> = (0..10).map(|trial| scenario.trial(trial).expect("settings")).collect();
            let mut squares = 0.0;
            for record in &records {
                let error = record.error_deg();
                let error = error.unwrap_or_else(|| panic!("{method} {errors:?}: {}", record.reason()));
                squares += error * error / 10.0;
            }
            let settings = match scenario.detector {
                Method::HfiRotating(settings) => settings.0,
                Method::HfiPulsating(settings) => settings.0,
                _ => panic!("an injection"),
            };
            // A leg loses √2 δ of a period T: of the voltage V the share √2 δ U/(T V) on average, of which 8/(3π²) of the square turns
            // backwards, four times as much of a pulsating voltage. The compensation leaves 3 % of what dead time and drops take.
            let pwm = settings.modulation;
            let (link, period) = (scenario.drive.link.voltage, pwm.carrier_period.seconds());
            let delays = 2.0_f64.sqrt() * scenario.drive.delay_mismatch * link / (period * settings.voltage);
            let turned = if method == MethodName::HfiRotating { 1.0 } else { 4.0 };
            let lost = (pwm.dead_time.seconds() / period * link + pwm.drop) / settings.voltage;
            let winding = scenario.motor.winding;
            let ratio = (winding.saliency / winding.mean_inductance).abs();
            // And it takes what an edge loses from the wrong side while the current i sin ωt is nearer to zero than it can predict: the
            // saliency's share of the ripple that a window makes, and what charges no terminal within a dead time. Of such edges there are
            // 2/π of that current over i; their loss has the fundamental 4/π, half of its square on average over the angles.
            let window = settings.windows.expect("one shunt").length.seconds();
            let charging = scenario.drive.bridge.terminal_capacitance * link / pwm.dead_time.seconds();
            let unknown = ratio * link * window / (3.0 * pwm.inductance) + charging;
            let omega = TAU / (2.0 * period * f64::from(settings.periods));
            let current = settings.voltage / (omega * pwm.inductance);
            let wrong = 4.0 / PI * lost * (2.0 / PI * unknown / current);
            let of_legs = 8.0 / (3.0 * PI * PI) * delays * delays + wrong * wrong / 2.0;
            let variance = turned * of_legs + (0.03 * lost).powi(2);
            let deviation = (variance.sqrt() / (2.0 * ratio)).to_degrees();
            // Ten squares have a mean of 2.96 times their expectation in one of a thousand cases.
            let most = (2.96_f64.sqrt() * deviation).min(7.0);
            println!("{method} {errors:?}: {:.2}° of {deviation:.2}°", squares.sqrt());
            assert!(squares.sqrt() < most, "{method} {errors:?}: {}° {most}°", squares.sqrt());
        }
    }
}

/// An amplifier for one direction clips what diodes return to the link: a method that reads the rise alone does not need it.
#[test]
fn law_bipolar_pulses_need_no_current_that_diodes_return() {
    let mut scenario = scenario(MethodName::Bipolar, ErrorSet::Default, Arrangement::DcLinkShunt);
    scenario.sensors.adc = Some(Adc { bits: 12, low: -0.5, high: 20.0 });
    for trial in 0..40 {
        let record = scenario.trial(trial).expect("settings");
        let error = record.error_deg().unwrap_or_else(|| panic!("{}", record.reason()));
        assert!(error.abs() < 0.6, "{error}°");
    }
}

/// Without a settling time a sample at the edge would show the current of either sign, as its jitter will have it.
#[test]
fn regress_jitter_takes_no_sample_beyond_the_edge() {
    let pulses = [MethodName::Bipolar, MethodName::MaximumLikelihood, MethodName::LineInductanceFast];
    for arrangement in [Arrangement::DcLinkShunt, Arrangement::LowSideShunts] {
        for method in pulses {
            let mut scenario = scenario(method, ErrorSet::Default, arrangement);
            scenario.sensors.settle = Nanos::ZERO;
            scenario.sensors.bandwidth = None;
            // As much as the margin of the samples allows.
            scenario.sensors.jitter = Nanos(1000);
            scenario.detector = Method::suited(method, &scenario.nameplate());
            let most = if method == MethodName::LineInductanceFast { 6.0 } else { 0.8 };
            for trial in 0..40 {
                let record = scenario.trial(trial).expect("settings");
                let error = record.axis_error_deg();
                let error = error.unwrap_or_else(|| panic!("{method} {arrangement:?}: {}", record.reason()));
                assert!(error.abs() < most, "{method} {arrangement:?}: {error}°");
            }
        }
    }
}

/// A detector that looks at each reading that its inner one gets.
struct Watch<D, F> {
    inner: D,
    look: F,
    last: Option<Command<f64>>,
    /// Legs before the last command, and how long ago they were changed.
    before: (Abc<Leg<f64>>, Nanos),
}

impl<D: Detector<f64>, F: FnMut(Abc<Leg<f64>>, Option<Nanos>, &Reading<f64>)> Detector<f64> for Watch<D, F> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        if let Some(command) = &self.last {
            // Changes of the legs: at the begin, and where the second stage follows.
            let second = command.then.unwrap_or(Stage { duration: Nanos::ZERO, ..command.stage });
            for reading in readings {
                let in_second = reading.at > command.stage.duration;
                let legs = if in_second { second.legs } else { command.stage.legs };
                let since = if in_second && second.legs != command.stage.legs {
                    Some(reading.at - command.stage.duration)
                } else if command.stage.legs != self.before.0 {
                    Some(reading.at)
                } else {
                    None
                };
                (self.look)(legs, since, reading);
            }
            self.before.0 = second.legs;
        }
        let step = self.inner.step(readings);
        if let Step::Drive(command) = &step {
            self.last = Some(*command);
        }
        step
    }
}

/// No method gets a reading that its hardware would not have.
#[test]
fn law_every_reading_is_one_that_the_shunt_can_give() {
    let scenario = scenario(MethodName::Bipolar, ErrorSet::Field, Arrangement::DcLinkShunt);
    let wait = scenario.drive.dead_time + scenario.sensors.settle;
    let (mut shown, mut phases, mut hidden) = (0, 0, 0);
    for trial in 0..5 {
        let inner = standstill_detect::Settings::detector(&scenario.detector).expect("settings");
        let look = |legs: Abc<Leg<f64>>, since: Option<Nanos>, reading: &Reading<f64>| {
            let settled = since.is_none_or(|since| since >= wait);
            assert_eq!(reading.link_sensed != Sensed::Hidden, settled, "{legs:?} {since:?}");
            shown += u32::from(settled);
            hidden += u32::from(!settled);
            for phase in Phase::ALL {
                let alone = !legs.0.contains(&Leg::Off)
                    && legs.0.iter().filter(|of| **of == legs[phase]).count() == 1;
                let sensed = reading.sensed[phase] != Sensed::Hidden;
                assert_eq!(sensed, settled && alone, "{legs:?} {phase:?}");
                phases += u32::from(sensed);
                assert_eq!(reading.terminal_sensed[phase], Sensed::Hidden);
            }
        };
        let off = Abc([Leg::Off; 3]);
        scenario.trial_with(trial, &mut Watch { inner, look, last: None, before: (off, Nanos::ZERO) });
    }
    // Pulses and their decays are sampled late enough; the method waits for that.
    assert!(shown > 500 && phases == 0 && hidden == 0, "{shown} {phases} {hidden}");
}
