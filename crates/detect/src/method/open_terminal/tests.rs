use standstill_interface::{Detector, Nanos, Outcome, Step, Undetermined};

use super::*;
use crate::nameplate::{Dividers, Nameplate};
use crate::parts::lines::SaliencySign;
use crate::parts::polarity::Signature;
use crate::testing::{Noise, PLATE};

/// A motor whose terminals follow the closed form, and the dividers that see them.
struct Motor {
    angle: f64,
    /// L_B/L_A, (L_d + L_q)/2 in H, and the resistance of a phase in Ω.
    k: f64,
    inductance: f64,
    resistance: f64,
    /// β in 1/A: how much less L_d is along the magnet.
    falls: f64,
    dc_link: f64,
    gain: [f64; 3],
    offset: [f64; 3],
    deviation: f64,
    noise: Noise,
    /// Differences between the terminals at rest, in V.
    swing: f64,
    /// Constant speed in rad/s, and the speed that pulses along q add while both pulses of a pair are sampled.
    speed: f64,
    own: f64,
    /// Pulses so far, and the direction of the first one of the present pair.
    pulses: u32,
    begins: f64,
}

impl Motor {
    fn at(degrees: f64) -> Self {
        Self {
            angle: degrees.to_radians(),
            k: -4.0 / 14.0,
            inductance: 14e-3,
            resistance: 1.2,
            falls: 0.0,
            dc_link: 540.0,
            gain: [1.0; 3],
            offset: [0.0; 3],
            deviation: 0.0,
            noise: Noise::new(3),
            swing: 0.0,
            speed: 0.0,
            own: 0.0,
            pulses: 0,
            begins: 1.0,
        }
    }

    /// Potentials in V after `t` seconds of a stage.
    fn potentials(&self, legs: &Abc<Leg<f64>>, t: f64) -> [f64; 3] {
        let leg = |wanted: Leg<f64>| Phase::ALL.into_iter().find(|phase| legs[*phase] == wanted);
        let (Some(high), Some(low)) = (leg(Leg::High), leg(Leg::Low)) else {
            let level = if legs[Phase::A] == Leg::High { self.dc_link } else { 0.0 };
            return [level, level, level + self.swing];
        };
        let open = 3 - high as usize - low as usize;
        // From the first phase of the line to the second, or back.
        let forward = (high as usize + 1) % 3 == low as usize;
        let line = if forward { high } else { low } as usize;
        let x = line_angles::<f64>()[line] - self.angle;
        let (sin, cos) = (x.sin(), x.cos());
        let lines = 1.0 + self.k * (2.0 * x).cos();
        let across = self.dc_link * (-self.resistance * t / (self.inductance * lines)).exp();
        let linear = 3.0_f64.sqrt() / 2.0 * self.k * (2.0 * x).sin() / lines;
        let shared = self.dc_link * t / self.inductance * (1.0 - self.k * self.k) * sin * cos * cos;
        let way = if forward { 1.0 } else { -1.0 };
        let speed = self.speed + self.begins * self.own * sin / lines;
        let induced = 1.5 * speed * PLATE.magnet_flux / self.dc_link * (1.0 + self.k) * cos / lines;
        let r = linear - way * (self.falls * shared / (2.0 * lines.powi(3)) + induced);
        let mut potential = [0.0; 3];
        potential[high as usize] = self.dc_link;
        potential[open] = self.dc_link / 2.0 + way * r * across;
        potential
    }

    fn readings<T: Real>(&mut self, command: &Command<T>) -> Vec<Reading<T>> {
        let legs = |stage: &Stage<T>| {
            stage.legs.0.each_ref().map(|leg| match leg {
                Leg::High => Leg::High,
                Leg::Low => Leg::Low,
                _ => Leg::Off,
            })
        };
        let on = command.stage.duration;
        let first = legs(&command.stage);
        if let Some(high) =
            first.iter().position(|leg| *leg == Leg::High).filter(|_| first.contains(&Leg::Low))
        {
            if self.pulses.is_multiple_of(2) {
                self.begins = if first[(high + 1) % 3] == Leg::Low { 1.0 } else { -1.0 };
            }
            self.pulses += 1;
        }
        let reading = |n| {
            let at = command.sampling.trigger(n);
            let then = command.then.as_ref().filter(|_| at > on);
            let potential = self.potentials(&Abc(legs(then.unwrap_or(&command.stage))), at.seconds());
            let mut reading = Reading::measured(at, [T::zero(); 3], T::of(self.dc_link));
            reading.terminal.0 = core::array::from_fn(|k| {
                let noise = self.deviation * self.noise.gauss();
                T::of(self.gain[k] * potential[k] + self.offset[k] + noise)
            });
            reading.terminal_sensed.0 = [Sensed::Measured; 3];
            reading
        };
        (0..command.sampling.count).map(reading).collect()
    }

    /// The outcome of a detector, and the time that it took in s.
    fn outcome<T: Real>(&mut self, detector: &mut OpenTerminal<T>) -> (Outcome<T>, f64) {
        let (mut readings, mut time) = (Vec::new(), 0.0);
        loop {
            match detector.step(&readings) {
                Step::Drive(command) => {
                    time += command.duration().seconds();
                    assert!(time < 1.0, "it goes on for ever");
                    readings = self.readings(&command);
                }
                Step::Done(outcome) => return (outcome, time),
            }
        }
    }

    fn ended(&mut self, settings: OpenTerminalSettings<f64>) -> Outcome<f64> {
        self.outcome(&mut OpenTerminal::new(settings).expect("settings")).0
    }
}

extern crate std;
use std::vec::Vec;

/// Returns settings for a motor like that, without dead time and errors.
fn settings() -> OpenTerminalSettings<f64> {
    let plate = Nameplate { dead_time: Nanos::ZERO, ..PLATE };
    OpenTerminalSettings { offset: 0.0, ..OpenTerminalSettings::suited(&plate) }
}

fn error(outcome: &Outcome<f64>, motor: &Motor) -> f64 {
    let (Outcome::Found { angle, .. } | Outcome::Axis { angle, .. }) = *outcome else {
        panic!("{outcome:?}")
    };
    angle.difference(Angle::from_radians(motor.angle)).to_degrees()
}

#[test]
fn analytic_the_axis_of_a_linear_motor_is_exact() {
    for degrees in (0..360).step_by(7) {
        for (k, sign) in [(-4.0 / 14.0, SaliencySign::Negative), (0.2, SaliencySign::Positive)] {
            let mut motor = Motor { k, ..Motor::at(f64::from(degrees)) };
            let settings = OpenTerminalSettings { saliency: sign, ..settings() };
            let outcome = motor.ended(settings);
            let off = error(&outcome, &motor);
            let off = off - 180.0 * (off / 180.0).round();
            assert!(off.abs() < 1e-7, "{degrees}, {k}: {off}");
            // Nothing saturates, so nothing tells the poles apart.
            assert!(matches!(outcome, Outcome::Axis { .. }), "{outcome:?}");
        }
    }
}

#[test]
fn law_the_pole_follows_saturation_and_its_signature() {
    for degrees in (0..360).step_by(11) {
        let mut motor = Motor { falls: 0.01, ..Motor::at(f64::from(degrees)) };
        let outcome = motor.ended(settings());
        assert!(matches!(outcome, Outcome::Found { .. }), "{degrees}: {outcome:?}");
        assert!(error(&outcome, &motor).abs() < 0.5, "{degrees}: {outcome:?}");
        let inverted = OpenTerminalSettings { signature: Signature::Inverted, ..settings() };
        assert!(error(&motor.ended(inverted), &motor).abs() > 179.5);
        let none = OpenTerminalSettings { signature: Signature::None, ..settings() };
        let Outcome::Axis { reason: Undetermined::NoSignature, .. } = motor.ended(none) else {
            panic!("a pole without a signature")
        };
    }
}

/// The pulses of a pair turn a light rotor and stop it again. One round mistakes that for a rotor that turns, or for
/// the other pole; a second round, in the opposite order, avoids it.
#[test]
fn analytic_a_second_round_tells_a_rotor_that_its_own_pulses_turn_from_one_that_turns() {
    let turns = |outcome: &Outcome<f64>| match *outcome {
        Outcome::Failed { fault: Fault::RotorTurns { speed, way, .. }, .. } => Some((speed, way)),
        _ => None,
    };
    let run = |mut motor: Motor| motor.outcome(&mut OpenTerminal::new(settings()).expect("settings"));
    let mut twice = 0;
    for degrees in (0..360).step_by(7) {
        let motor = || Motor { falls: 0.01, ..Motor::at(f64::from(degrees)) };
        let (still, once) = run(motor());
        assert!(turns(&still).is_none(), "{degrees}");
        let (found, time) = run(Motor { own: 30.0, ..motor() });
        assert_eq!(turns(&found), None, "{degrees}");
        if time > 1.5 * once {
            twice += 1;
            let Outcome::Found { angle, findings } = found else { panic!("{degrees}: {found:?}") };
            let miss = angle.difference(Angle::from_radians(f64::from(degrees).to_radians()));
            assert!(
                miss.abs() < 0.02 && findings.fault_margin.is_none_or(|margin| margin > 0.0),
                "{degrees}"
            );
        }
        for speed in [20.0, -20.0] {
            let (found, way) = turns(&run(Motor { speed, ..motor() }).0).expect("turns");
            assert!((found / 20.0 - 1.0).abs() < 0.02, "{degrees}: {found}");
            let forward = standstill_interface::Rotation::Forward;
            assert!(way.is_none_or(|way| (way == forward) == (speed > 0.0)), "{degrees} {speed}");
        }
        assert!(turns(&run(Motor { own: 30.0, speed: 60.0, ..motor() }).0).is_some(), "{degrees}");
    }
    assert!(twice > 26, "{twice} of 52");
}

#[test]
fn law_compared_dividers_leave_no_error_and_uncompared_ones_leave_the_pole_open() {
    for degrees in (0..360).step_by(13) {
        let motor = || Motor {
            falls: 0.01,
            gain: [1.02, 0.99, 1.0],
            deviation: 0.1,
            ..Motor::at(f64::from(degrees))
        };
        let outcome = motor().ended(settings());
        assert!(matches!(outcome, Outcome::Found { .. }), "{degrees}: {outcome:?}");
        assert!(error(&outcome, &motor()).abs() < 0.6, "{degrees}: {outcome:?}");
        let alone = OpenTerminalSettings { comparison: false, gain_tolerance: 0.02, ..settings() };
        let outcome = motor().ended(alone);
        assert!(matches!(outcome, Outcome::Axis { .. }), "{degrees}: {outcome:?}");
    }
    // Offsets, which the comparison cannot see, count as stated.
    let settings = OpenTerminalSettings { offset: 5.0, ..settings() };
    let outcome = Motor { falls: 0.01, offset: [5.0, -5.0, 0.0], ..Motor::at(50.0) }.ended(settings);
    assert!(matches!(outcome, Outcome::Axis { .. }), "{outcome:?}");
    assert!((error(&outcome, &Motor::at(50.0)).rem_euclid(180.0) - 90.0).abs() > 89.0, "{outcome:?}");
}

#[test]
fn law_the_stated_deviation_of_the_axis_is_that_of_its_errors() {
    let (mut errors, mut stated) = (0.0, 0.0);
    let trials = 400_u32;
    for trial in 0..trials {
        let noise = Noise::new(u64::from(trial));
        let mut motor = Motor { deviation: 2.0, noise, ..Motor::at(f64::from(trial) * 0.9) };
        let outcome = motor.ended(settings());
        let off = error(&outcome, &motor);
        errors += (off - 180.0 * (off / 180.0).round()).powi(2);
        stated += outcome.findings().angle_deviation.expect("stated").to_degrees().powi(2);
    }
    let ratio = (errors / stated).sqrt();
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}: {errors} {stated}");
}

#[test]
fn law_single_precision_finds_the_same() {
    let plate = Nameplate { dead_time: Nanos::ZERO, ..PLATE };
    for degrees in (0..360).step_by(17) {
        let mut motor = Motor { falls: 0.01, ..Motor::at(f64::from(degrees)) };
        let settings = OpenTerminalSettings::suited(&plate.cast::<f32>());
        let (outcome, time) = motor.outcome(&mut OpenTerminal::new(settings).expect("settings"));
        let Outcome::Found { angle, .. } = outcome else { panic!("{outcome:?}") };
        let found = Angle::from_radians(f64::from(angle.radians()));
        assert!(found.difference(Angle::from_radians(motor.angle)).to_degrees().abs() < 0.5);
        // One vector and six pulses of 180 µs, each with 1.6 times as long a rest.
        assert!((time - 7.0 * 468e-6).abs() < 1e-9, "{time}");
    }
}

#[test]
fn law_what_cannot_be_used_is_a_fault() {
    let fault = |motor: &mut Motor, change: fn(&mut Reading<f64>)| {
        let mut detector = OpenTerminal::new(settings()).expect("settings");
        let mut readings = Vec::new();
        loop {
            match detector.step(&readings) {
                Step::Drive(command) => {
                    readings = motor.readings(&command);
                    readings.iter_mut().for_each(change);
                }
                Step::Done(Outcome::Failed { fault, .. }) => return fault,
                Step::Done(other) => panic!("{other:?}"),
            }
        }
    };
    let mut motor = Motor::at(20.0);
    assert_eq!(
        fault(&mut motor, |reading| reading.terminal_sensed = Abc([Sensed::Hidden; 3])),
        Fault::TerminalHidden
    );
    assert_eq!(
        fault(&mut motor, |reading| reading.terminal_sensed.0[2] = Sensed::Clipped),
        Fault::TerminalClipped
    );
    assert_eq!(fault(&mut motor, |reading| reading.terminal.0[0] = 0.0), Fault::NoVoltage);
    assert_eq!(fault(&mut motor, |reading| reading.terminal.0[1] = f64::NAN), Fault::NotANumber);
    assert_eq!(fault(&mut motor, |reading| reading.dc_link_clipped = true), Fault::DcLinkClipped);
    motor.swing = 300.0;
    assert_eq!(fault(&mut motor, |_| {}), Fault::TerminalsSwing);
    let round = Fault::NoSaliency { ratio: 0.0, needed: 0.005 };
    let Fault::NoSaliency { ratio, .. } = fault(&mut Motor { k: 0.0, ..Motor::at(20.0) }, |_| {}) else {
        panic!("not {round:?}")
    };
    assert!(ratio < 1e-9);
}

#[test]
fn law_settings_that_cannot_work_are_refused() {
    let refused = |change: fn(&mut OpenTerminalSettings<f64>)| {
        let mut settings = settings();
        change(&mut settings);
        OpenTerminal::new(settings).expect_err("refused").setting
    };
    assert_eq!(refused(|s| *s = s.with_pulse(Nanos::ZERO)), "pulse");
    assert_eq!(refused(|s| s.rounds = 0), "rounds");
    assert_eq!(refused(|s| s.rest = s.pulse), "rest");
    assert_eq!(refused(|s| s.interval = Nanos::ZERO), "interval");
    assert_eq!(refused(|s| s.gain_tolerance = 1.0), "gain_tolerance");
    assert_eq!(refused(|s| s.line_inductance = 0.0), "line_inductance");
    assert_eq!(refused(|s| s.pole_error = 0.6), "pole_error");
    // A filter of 1 kHz settles in 1.3 ms, longer than the pulse.
    let slow = Dividers { bandwidth: Some(1e3), ..PLATE.dividers };
    let plate = Nameplate { dividers: slow, ..PLATE };
    let error = OpenTerminal::new(OpenTerminalSettings::suited(&plate)).expect_err("too slow");
    assert_eq!(error.setting, "pulse");
}
