extern crate std;
use std::vec::Vec;

use standstill_interface::{AlphaBeta, Detector, Leg, Outcome, Phase, Sensed, Step};

use super::*;
use crate::checks::Checks;
use crate::nameplate::{Nameplate, Place, Sensing};
use crate::parts::lines::SaliencySign;
use crate::parts::plausibility::PlausibilitySettings;
use crate::parts::polarity::{PolarityRule, PolaritySettings, Signature};
use crate::parts::settle::SettleSettings;
use crate::testing::PLATE;

const L_A: f64 = 9.2e-3;
const L_B: f64 = -2.1e-3;
const RESISTANCE: f64 = 1.2;

fn settings(decay: Decay, sample_lead: Nanos) -> LineInductanceSettings<f64> {
    LineInductanceSettings {
        pulse: Nanos::from_micros(80),
        period: Nanos::from_micros(2400),
        pulses: 3,
        decay,
        sample_lead,
        dead_time: Nanos(2000),
        saliency: SaliencySign::Negative,
        least_current: 0.14,
        least_saliency: 0.05,
        gain_tolerance: 0.005,
        settle: SettleSettings {
            wait: Nanos::from_micros(500),
            threshold: 0.2,
            attempts: 3,
            place: Place::InLine,
        },
        plausibility: PlausibilitySettings::suited(&PLATE),
        polarity: PolaritySettings {
            carrier_period: Nanos::from_micros(100),
            periods: 10,
            current: 7.0,
            resistance: RESISTANCE,
            dead_time: Nanos::ZERO,
            least_current: 0.1,
            least_margin: 0.05,
            uneven: 0.0,
            signature: Signature::Normal,
            rule: PolarityRule::TwoVectors,
            place: Place::InLine,
            checks: Checks::ALL,
            least_share: 0.5,
            both_ways: 0.3,
            lost: 0.0,
            magnet_flux: 0.5,
            q_axis_inductance: 18e-3,
            window: Nanos::ZERO,
        },
        sensing: Sensing::default(),
    }
}

/// Offsets in A of the shunts below the legs; the shunt in the link has the first of them.
const OFFSETS: [f64; 3] = [0.05, -0.03, 0.02];

/// A motor whose currents satisfy the two trapezoids of equation (10) exactly, and whose vectors raise 10 % more
/// current towards north.
struct Motor {
    angle: f64,
    settings: LineInductanceSettings<f64>,
    left: f64,
    line: usize,
    pulses: usize,
    amplitude: f64,
    /// L_B in H.
    saliency: f64,
}

impl Motor {
    fn inductance(&self, line: usize) -> f64 {
        let shift = [-1.0, 0.0, 1.0][line] * core::f64::consts::TAU / 3.0;
        3.0 * L_A - 3.0 * self.saliency * (2.0 * self.angle + shift).cos()
    }

    fn readings(&mut self, command: &Command<f64>) -> Vec<Reading<f64>> {
        let mut currents = std::vec![[0.0; 3]; usize::try_from(command.sampling.count).expect("few")];
        let mut through_link = [0.0; 2];
        let legs = command.stage.legs;
        let pulse = LINES.into_iter().position(|(a, b)| legs[a] == Leg::High && legs[b] == Leg::Low);
        if let Some(line) = pulse {
            if line != self.line {
                (self.line, self.left) = (line, 0.0);
            }
            self.pulses += 1;
            let s = &self.settings;
            let (l, r) = (self.inductance(line), 2.0 * RESISTANCE);
            let next = |i: f64, volts: f64, t: f64| (volts - i * (r / 2.0 - l / t)) / (r / 2.0 + l / t);
            let lead = s.sample_lead.seconds();
            let t1 = s.pulse.seconds() - lead;
            let i2 = next(self.left, 540.0 * (t1 - s.dead_time.seconds()) / t1, t1);
            let (t2, off) = match s.decay {
                Decay::Slow => (s.period.seconds() - s.pulse.seconds(), 0.0),
                Decay::Fast => (64e-6, -540.0),
            };
            let i3 = next(i2, (540.0 * lead + off * t2) / (lead + t2), lead + t2);
            self.left = if s.decay == Decay::Slow { i3 } else { 0.0 };
            let (from, to) = LINES[line];
            for (current, value) in currents.iter_mut().zip([i2, i3]) {
                (current[from as usize], current[to as usize]) = (value, -value);
            }
            if s.sensing.place == Place::BelowLegs {
                // The upper switch of one leg carries i2, the upper diode of the other one i3.
                (currents[0][from as usize], currents[1][to as usize]) = (0.0, 0.0);
            }
            through_link = [i2, -i3];
        } else if let Leg::Duty(_) = legs.0[0] {
            let vector = legs.map(|leg| if let Leg::Duty(duty) = leg { duty * 540.0 } else { 0.0 }).clarke();
            self.amplitude = vector.norm();
            let north = AlphaBeta::new(self.angle.cos(), self.angle.sin());
            let along = 1.0 + 0.05 * vector.dot(north) / vector.norm();
            currents[0] = (vector * (7.0 * along / vector.norm())).phases().0;
            let returned = currents[0].iter().fold(0.0_f64, |most, current| most.max(current.abs()));
            // It falls while it is read.
            through_link = [0.3 - returned, 0.6 - returned];
        }
        let at = |k: usize| command.sampling.trigger(u32::try_from(k).expect("few"));
        let below = self.settings.sensing.place == Place::BelowLegs;
        let reading = |(k, current): (usize, [f64; 3])| {
            let shown = if below { core::array::from_fn(|p| current[p] + OFFSETS[p]) } else { current };
            let reading = Reading::measured(at(k), shown, 540.0);
            if self.settings.sensing.place != Place::InLink {
                return reading;
            }
            let link_current = through_link[k] + OFFSETS[0];
            Reading {
                sensed: Abc([Sensed::Hidden; 3]),
                link_current,
                link_sensed: Sensed::Measured,
                ..reading
            }
        };
        currents.into_iter().enumerate().map(reading).collect()
    }
}

/// Returns the outcome of a detection on this motor with errors of the readings in A.
fn detected(motor: &mut Motor, mut off: impl FnMut() -> f64) -> Outcome<f64> {
    let mut detector = LineInductance::new(motor.settings).expect("settings");
    let mut readings = Vec::new();
    loop {
        match detector.step(&readings) {
            Step::Drive(command) => readings = motor.readings(&command),
            Step::Done(outcome) => return outcome,
        }
        for current in readings.iter_mut().flat_map(|reading| &mut reading.current.0) {
            *current += off();
        }
    }
}

#[test]
fn analytic_trapezoids_give_axis_pole_and_both_parameters() {
    for decay in [Decay::Slow, Decay::Fast] {
        for sample_lead in [Nanos::ZERO, Nanos(5000)] {
            for degrees in [0.0, 33.0, 90.0, 170.0, 200.0, 359.0_f64] {
                let settings = settings(decay, sample_lead);
                let angle = degrees.to_radians();
                let mut motor =
                    Motor { angle, settings, left: 0.0, line: 9, pulses: 0, amplitude: 0.0, saliency: L_B };
                let outcome = detected(&mut motor, || 0.0);
                let Outcome::Found { angle: found, findings } = outcome else { panic!("{outcome:?}") };
                let off = (found.radians() - angle).sin().abs();
                assert!(off < 1e-9 && (found.radians() - angle).cos() > 0.0, "{degrees}: {outcome:?}");
                assert_eq!(motor.pulses, 9);
                let Abc(lines) = findings.line_inductance.expect("measured");
                let Abc(resistances) = findings.line_resistance.expect("measured");
                for k in 0..3 {
                    assert!((lines[k] / motor.inductance(k) - 1.0).abs() < 1e-9);
                    assert!((resistances[k] / (2.0 * RESISTANCE) - 1.0).abs() < 1e-6);
                }
                // The vector for 7 A through L_d = 3/2 (L_A + L_B) in 1 ms.
                let volts = 7.0 * (1.5 * (L_A + L_B) / 1e-3 + RESISTANCE / 2.0);
                assert!((motor.amplitude / volts - 1.0).abs() < 1e-9, "{} {volts}", motor.amplitude);
            }
        }
    }
}

#[test]
fn analytic_shunts_that_take_over_from_each_other_give_the_same() {
    for place in [Place::BelowLegs, Place::InLink] {
        for degrees in [0.0, 33.0, 90.0, 170.0, 200.0, 359.0_f64] {
            let mut settings = settings(Decay::Fast, Nanos(5000));
            settings.sensing.place = place;
            (settings.settle.place, settings.polarity.place, settings.polarity.window) =
                (place, place, Nanos(5000));
            let angle = degrees.to_radians();
            let mut motor =
                Motor { angle, settings, left: 0.0, line: 9, pulses: 0, amplitude: 0.0, saliency: L_B };
            let outcome = detected(&mut motor, || 0.0);
            let Outcome::Found { angle: found, findings } = outcome else { panic!("{outcome:?}") };
            let off = (found.radians() - angle).sin().abs();
            assert!(off < 1e-9 && (found.radians() - angle).cos() > 0.0, "{place:?} {degrees}: {outcome:?}");
            let Abc(lines) = findings.line_inductance.expect("measured");
            assert!((0..3).all(|k| (lines[k] / motor.inductance(k) - 1.0).abs() < 1e-9), "{lines:?}");
            let polarity = findings.polarity.expect("tested");
            assert!((polarity.along.max(polarity.against) / 7.35 - 1.0).abs() < 1e-9, "{polarity:?}");
        }
    }
}

#[test]
fn law_settings_that_cannot_work_are_refused() {
    let good = settings(Decay::Slow, Nanos::ZERO);
    assert!(good.check().is_ok());
    let broken = [
        LineInductanceSettings { pulse: Nanos::ZERO, ..good },
        LineInductanceSettings { pulses: 0, ..good },
        LineInductanceSettings { dead_time: good.pulse, ..good },
        LineInductanceSettings { sample_lead: good.pulse - good.dead_time, ..good },
        LineInductanceSettings { period: Nanos::from_micros(660), ..good },
        LineInductanceSettings { period: Nanos(u64::MAX), ..good },
        LineInductanceSettings { least_current: f64::NAN, ..good },
        LineInductanceSettings { least_saliency: 1.0, ..good },
    ];
    assert!(broken.iter().all(|settings| settings.check().is_err()));
}

#[test]
fn law_a_single_pulse_a_line_is_as_noisy_as_the_readings_before_it() {
    let settings =
        LineInductanceSettings { pulses: 1, gain_tolerance: 0.0, ..settings(Decay::Slow, Nanos::ZERO) };
    let mut noise = crate::testing::Noise::new(3);
    let mut axes = |saliency: f64, deviation: f64| {
        (0..200)
            .filter(|_| {
                let mut motor =
                    Motor { angle: 1.0, settings, left: 0.0, line: 9, pulses: 0, amplitude: 0.0, saliency };
                let outcome = detected(&mut motor, || deviation * noise.gauss());
                !matches!(outcome, Outcome::Failed { fault: Fault::NoSaliency { .. }, .. })
            })
            .count()
    };
    // The pulses raise 1.5 A: 0.05 A are 4.7 % of a line, 3.9 % of saliency.
    assert_eq!(axes(0.0, 0.05), 0);
    assert_eq!(axes(L_B, 0.002), 200);
}

/// A data sheet's inductance that is right within 35 % is accepted; for others the fault names the first line.
#[test]
fn law_a_saliency_of_another_motor_is_a_fault() {
    for (saliency, holds) in [(0.2857, true), (0.6, false)] {
        let mut settings = settings(Decay::Fast, Nanos::ZERO);
        settings.plausibility.saliency = saliency;
        let mut motor =
            Motor { angle: 0.0, settings, left: 0.0, line: 9, pulses: 0, amplitude: 0.0, saliency: L_B };
        let outcome = detected(&mut motor, || 0.0);
        let refused = matches!(outcome, Outcome::Failed { fault: Fault::SaliencyOutOfRange { .. }, .. });
        assert_eq!(refused, !holds, "{saliency}: {outcome:?}");
    }
}

#[test]
fn law_lines_whose_inductance_is_not_the_data_sheets_are_a_fault() {
    let ended = |factor: f64, checks: Checks| {
        let plate = Nameplate {
            d_axis_inductance: PLATE.d_axis_inductance * factor,
            q_axis_inductance: PLATE.q_axis_inductance * factor,
            rated_pulse: Nanos::from_seconds(PLATE.rated_pulse.seconds() * factor),
            ..PLATE
        };
        let mut settings = settings(Decay::Fast, Nanos::ZERO);
        settings.plausibility = PlausibilitySettings { checks, ..PlausibilitySettings::suited(&plate) };
        let mut motor =
            Motor { angle: 0.0, settings, left: 0.0, line: 9, pulses: 0, amplitude: 0.0, saliency: L_B };
        detected(&mut motor, || 0.0)
    };
    for factor in [0.8, 1.0, 1.2] {
        let outcome = ended(factor, Checks::ALL);
        assert!(matches!(outcome, Outcome::Found { .. }), "{factor}: {outcome:?}");
    }
    for factor in [0.4, 3.0] {
        let outcome = ended(factor, Checks::ALL);
        let Outcome::Failed { fault: Fault::InductanceOutOfRange { phase, .. }, .. } = outcome else {
            panic!("{factor}: {outcome:?}");
        };
        assert_eq!(phase, Phase::A);
        assert!(matches!(ended(factor, Checks::NONE), Outcome::Found { .. }), "{factor}");
    }
}
