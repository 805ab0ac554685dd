//! A scenario: everything that the trials of a campaign have in common.

use std::f64::consts::TAU;

use rand::RngExt;
use standstill_detect::{Decay, LineInductance, LineInductanceSettings, SaliencySign, SettingsError};
use standstill_interface::{Detector, Nanos};
use standstill_plant::Motor;
use standstill_sim::{
    Case, NoProbe, Play, Purpose, RotorState, SensorSettings, Sensors, Streams, Tolerance, run,
};

use crate::{DriveSettings, ErrorSet, Record};

/// One motor, one kind of drive, one method.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// The motor.
    pub motor: Motor,
    /// Whether it can move. Where a brake lets it play, each trial stands somewhere else within the same play.
    pub rotor: RotorState,
    /// Torque in N·m that the load exerts against forward motion.
    pub load_torque: f64,
    /// The drive.
    pub drive: DriveSettings,
    /// Its sensors.
    pub sensors: SensorSettings,
    /// The method.
    pub detector: LineInductanceSettings<f64>,
    /// Numerical tolerance.
    pub tolerance: Tolerance,
    /// Key of all random numbers.
    pub seed: u64,
}

/// Pulses that raise as much of the rated current as the paper's do on its own motor: the paper leaves their choice
/// to the motor (section 1.2) and prints 80 µs for its own, which is what this gives there.
fn suit(detector: &mut LineInductanceSettings<f64>, motor: &Motor, dc_link: f64) {
    // A fifth of the rated current into the mean line inductance, equation (4), in steps of 10 µs.
    let line = 3.0 * motor.winding.mean_inductance + 2.0 * motor.winding.leakage;
    let pulse = 0.2 * motor.rated_current * line / dc_link;
    let steps = (pulse / 10e-6).round().clamp(2.0, 60.0);
    detector.pulse = Nanos::from_seconds(steps * 10e-6);
    // A vector of at most 0.3 of the link, which PWM can give in any direction, and at least as long as the paper's.
    let duration = motor.winding.d_axis_inductance() * detector.polarity.current / (0.3 * dc_link);
    let carrier = detector.polarity.carrier_period;
    let least = detector.polarity.periods;
    let periods = Nanos::from_seconds(duration).0.div_ceil(carrier.0.max(1));
    detector.polarity.periods =
        u16::try_from(periods).unwrap_or(u16::MAX).clamp(least, least.saturating_mul(20));
}

/// Which random numbers a case takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Specimen {
    /// Trial whose drive and sensors are taken: gains, offsets, delays.
    pub drive: u64,
    /// Trial whose noise and jitter are taken.
    pub noise: u64,
}

impl Scenario {
    /// DC-link voltage in V where a motor names none: the paper's.
    pub const DC_LINK: f64 = 550.0;

    /// The paper's method, told the sign of the motor's saliency, on this motor, its DC link and one of the error sets.
    pub fn paper(motor: Motor, errors: ErrorSet, decay: Decay, rotor: RotorState, seed: u64) -> Self {
        let drive = errors.drive(motor.dc_link.unwrap_or(Self::DC_LINK));
        let mut detector = LineInductanceSettings::paper(
            decay,
            if motor.winding.saliency > 0.0 { SaliencySign::Positive } else { SaliencySign::Negative },
            motor.rated_current,
            motor.resistance,
            drive.dead_time,
            drive.carrier_period,
        );
        suit(&mut detector, &motor, drive.link.voltage);
        Self {
            motor,
            rotor,
            load_torque: 0.0,
            drive,
            sensors: errors.sensors(),
            detector,
            tolerance: Tolerance::default(),
            seed,
        }
    }

    /// Whether the detector's settings can work.
    pub fn check(&self) -> Result<(), SettingsError> {
        if self.detector.polarity.carrier_period != self.drive.carrier_period {
            let needed = "the carrier period of the drive";
            return Err(SettingsError { setting: "polarity.carrier_period", needed });
        }
        LineInductance::new(self.detector).map(|_| ())
    }

    /// The case of a trial: a uniform rotor angle, a specimen of the drive and of its sensors.
    pub fn case(&self, trial: u64) -> Case<'_> {
        let angle = Streams::new(self.seed, trial).open(Purpose::Angle).random_range(0.0..TAU);
        self.case_at(angle, Specimen { drive: trial, noise: trial })
    }

    /// The case at a given electrical angle in rad. A free rotor that cannot stand there, because cogging exceeds its
    /// stiction, stands at the next angle where it can.
    pub fn case_at(&self, angle: f64, specimen: Specimen) -> Case<'_> {
        let drive = Streams::new(self.seed, specimen.drive);
        let mut angle = angle;
        let mut rotor = self.rotor;
        match &mut rotor {
            RotorState::Locked => {}
            RotorState::Free => angle = self.motor.standing_angle(angle, self.load_torque).unwrap_or(angle),
            RotorState::Braked(play) => *play = self.standing_play(angle, *play, drive),
        }
        Case {
            motor: &self.motor,
            inverter: self.drive.draw(drive),
            sensors: Sensors::draw(self.sensors, drive),
            start_angle: angle,
            rotor,
            load_torque: self.load_torque,
            streams: Streams::new(self.seed, specimen.noise),
            tolerance: self.tolerance,
            time_limit: Case::TIME_LIMIT,
        }
    }

    /// Where within the brake's play a rotor stands: anywhere, or at the end to which its load turns it.
    fn standing_play(&self, angle: f64, play: Play, streams: Streams) -> Play {
        let whole = play.below + play.above;
        let torque = self.motor.cogging(angle) - self.load_torque;
        let below = if torque.abs() <= self.motor.rotor.friction.stiction {
            whole * streams.open(Purpose::Backlash).random_range(0.0..=1.0)
        } else if torque > 0.0 {
            whole
        } else {
            0.0
        };
        Play { below, above: whole - below }
    }

    /// A trial with the scenario's own detector.
    pub fn trial(&self, trial: u64) -> Result<Record, SettingsError> {
        Ok(self.trial_with(trial, &mut LineInductance::new(self.detector)?))
    }

    /// A trial with any detector.
    pub fn trial_with(&self, trial: u64, detector: &mut dyn Detector<f64>) -> Record {
        Record { trial, run: run(&self.case(trial), detector, false, &mut NoProbe) }
    }
}
