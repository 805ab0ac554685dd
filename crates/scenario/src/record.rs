//! The record of a trial, and its figures in degrees.

use serde::{Deserialize, Serialize};
use standstill_detect::SettingsError;
use standstill_interface::{Angle, Fault, Findings, Outcome, choice};
use standstill_sim::{Ended, Run};

/// Record of one trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Number of the trial.
    pub trial: u64,
    /// Result of the trial: the detection's outcome, angles and times.
    pub run: Run<f64>,
}

choice! {
    /// Kind of a trial's end, with its name in `trials.csv`.
    #[derive(Hash, Serialize, Deserialize)]
    pub enum Verdict {
        /// The detector found an angle: axis and pole.
        Found = "found",
        /// The detector found an axis without a pole.
        Undetermined = "undetermined",
        /// The detector gave up, with a reason.
        Failed = "failed",
        /// The simulation could not continue.
        Error = "error",
    }
}

impl Record {
    /// Returns the kind of the trial's end.
    pub fn verdict(&self) -> Verdict {
        match self.run.ended {
            Ended::Outcome(Outcome::Found { .. }) => Verdict::Found,
            Ended::Outcome(Outcome::Axis { .. }) => Verdict::Undetermined,
            Ended::Outcome(Outcome::Failed { .. }) => Verdict::Failed,
            Ended::Error(_) => Verdict::Error,
        }
    }

    /// Returns the reason why the trial has no angle; empty if it has an angle.
    pub fn reason(&self) -> String {
        match self.run.ended {
            Ended::Outcome(Outcome::Found { .. }) => String::new(),
            Ended::Outcome(Outcome::Axis { reason, .. }) => reason.to_string(),
            Ended::Outcome(Outcome::Failed { fault, .. }) => fault.to_string(),
            Ended::Error(error) => error.to_string(),
        }
    }

    /// Returns the name of that reason, without numbers; none if the trial has an angle.
    pub fn reason_name(&self) -> Option<String> {
        match self.run.ended {
            Ended::Outcome(Outcome::Found { .. }) => None,
            Ended::Outcome(Outcome::Axis { reason, .. }) => Some(reason.name().to_owned()),
            Ended::Outcome(Outcome::Failed { fault, .. }) => Some(fault.name().to_owned()),
            Ended::Error(error) => Some(error.name()),
        }
    }

    /// Returns the true electrical angle of the north pole in [0, 360)° at the end of the detection. The drive starts
    /// from this angle, even if the rotor has moved.
    pub fn true_angle_deg(&self) -> f64 {
        Angle::from_radians(self.run.end_angle).degrees()
    }

    /// Returns the electrical angle at the beginning of the trial, in [0, 360)°.
    pub fn start_angle_deg(&self) -> f64 {
        Angle::from_radians(self.run.start_angle).degrees()
    }

    /// Returns the angle that the detector found, in [0, 360)°; none without an angle.
    pub fn estimated_angle_deg(&self) -> Option<f64> {
        self.run.found().map(f64::to_degrees)
    }

    /// Returns the error of the angle, found minus true, in (−180, 180]°; none without an angle.
    pub fn error_deg(&self) -> Option<f64> {
        let found = Angle::from_radians(self.run.found()?);
        Some(found.difference(Angle::from_radians(self.run.end_angle)).to_degrees())
    }

    /// Returns the axis that was found, in [0, 180)°, with or without a pole; none without an axis.
    pub fn axis_deg(&self) -> Option<f64> {
        match self.run.ended {
            Ended::Outcome(Outcome::Found { angle, .. } | Outcome::Axis { angle, .. }) => {
                Some(angle.degrees().rem_euclid(180.0))
            }
            _ => None,
        }
    }

    /// Returns the error of the axis alone, in (−90, 90]°, whichever pole was found; none without an axis.
    pub fn axis_error_deg(&self) -> Option<f64> {
        let error = (self.axis_deg()? - self.true_angle_deg()).rem_euclid(180.0);
        Some(if error > 90.0 { error - 180.0 } else { error })
    }

    /// Returns half the width in degrees of the sector whose middle is the answer; none if the answer is an angle.
    pub fn half_sector_deg(&self) -> Option<f64> {
        // From radians, without what the conversion rounds.
        self.findings().half_sector.map(|half| (half.to_degrees() * 1e9).round() / 1e9)
    }

    /// Returns by how much the found axis misses the rotor's, in degrees with sign: the axis error, or for a sector the
    /// part of the error beyond half its width. None without an axis.
    pub fn axis_miss_deg(&self) -> Option<f64> {
        self.axis_error_deg().map(|error| miss_deg(error, self.half_sector_deg()))
    }

    /// Returns by how much the found angle misses the rotor's, in degrees with sign: the error, or for a sector the
    /// part of the error beyond half its width. None without an angle.
    pub fn miss_deg(&self) -> Option<f64> {
        self.error_deg().map(|error| miss_deg(error, self.half_sector_deg()))
    }

    /// Returns true if the right pole was found; none without a pole. A motor without a magnet has no right pole.
    pub fn pole_correct(&self) -> Option<bool> {
        self.error_deg().map(|error| self.run.has_pole && error.abs() <= 90.0)
    }

    /// Returns the quantities that the detector measured; all are empty if the simulation could not continue.
    pub fn findings(&self) -> Findings<f64> {
        match self.run.ended {
            Ended::Outcome(outcome) => *outcome.findings(),
            Ended::Error(_) => Findings::default(),
        }
    }

    /// Returns true if the start ended because its method takes the rotor to turn.
    pub fn rotor_turns(&self) -> bool {
        matches!(self.run.ended, Ended::Outcome(Outcome::Failed { fault: Fault::RotorTurns { .. }, .. }))
    }

    /// Returns the largest distance of the rotor from its initial angle, in electrical degrees.
    pub fn rotor_moved_deg(&self) -> f64 {
        self.run.moved.to_degrees()
    }
}

/// Returns the part of an error in degrees beyond half the width of the answer's sector; the whole error without a
/// sector.
///
/// ```
/// use standstill_scenario::miss_deg;
///
/// assert_eq!(miss_deg(-0.4, None), -0.4);
/// // A sector of 60° is right within 30° of its middle.
/// assert_eq!([-29.0, 31.5, -180.0].map(|error| miss_deg(error, Some(30.0))), [0.0, 1.5, -150.0]);
/// ```
pub fn miss_deg(error: f64, half_sector: Option<f64>) -> f64 {
    half_sector.map_or(error, |half| (error.abs() - half).max(0.0).copysign(error))
}

/// Error of a trial that could not be run, because no detector or no machine can be made for it.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialError<E> {
    /// Number of the trial.
    pub trial: u64,
    /// Reason why the trial could not be run.
    pub error: E,
}

impl From<TrialError<SettingsError>> for SettingsError {
    fn from(of: TrialError<Self>) -> Self {
        of.error
    }
}
