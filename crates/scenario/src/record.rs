//! The record of a trial.

use serde::{Deserialize, Serialize};
use standstill_detect::SettingsError;
use standstill_interface::{Angle, Outcome};
use standstill_sim::{Ended, Run};

/// One trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Its number.
    pub trial: u64,
    /// Outcome of the detection.
    pub run: Run<f64>,
}

/// End of a trial, in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Verdict {
    /// An angle with its pole.
    Found,
    /// An axis without a pole.
    Undetermined,
    /// The detector gave up, with a reason.
    Failed,
    /// The simulation could not go on.
    Error,
}

impl Verdict {
    /// As in `trials.csv`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Found => "found",
            Self::Undetermined => "undetermined",
            Self::Failed => "failed",
            Self::Error => "error",
        }
    }
}

impl Record {
    /// Its end.
    pub fn verdict(&self) -> Verdict {
        match self.run.ended {
            Ended::Outcome(Outcome::Found { .. }) => Verdict::Found,
            Ended::Outcome(Outcome::Axis { .. }) => Verdict::Undetermined,
            Ended::Outcome(Outcome::Failed { .. }) => Verdict::Failed,
            Ended::Error(_) => Verdict::Error,
        }
    }

    /// Why there is no angle; empty if there is one.
    pub fn reason(&self) -> String {
        match self.run.ended {
            Ended::Outcome(Outcome::Found { .. }) => String::new(),
            Ended::Outcome(Outcome::Axis { reason, .. }) => reason.to_string(),
            Ended::Outcome(Outcome::Failed { fault, .. }) => fault.to_string(),
            Ended::Error(error) => error.to_string(),
        }
    }

    /// Kind of that reason, without its numbers; none if there is an angle.
    pub fn reason_name(&self) -> Option<String> {
        match self.run.ended {
            Ended::Outcome(Outcome::Found { .. }) => None,
            Ended::Outcome(Outcome::Axis { reason, .. }) => Some(reason.name().to_owned()),
            Ended::Outcome(Outcome::Failed { fault, .. }) => Some(fault.name().to_owned()),
            Ended::Error(error) => Some(error.to_string()),
        }
    }

    /// Electrical angle of the north pole in [0, 360)° when the detection ends. A rotor that moved is where it is now:
    /// that is where the drive must start it.
    pub fn true_angle_deg(&self) -> f64 {
        Angle::from_radians(self.run.end_angle).degrees()
    }

    /// Electrical angle at the beginning, in [0, 360)°.
    pub fn start_angle_deg(&self) -> f64 {
        Angle::from_radians(self.run.start_angle).degrees()
    }

    /// Angle that the detector found, in [0, 360)°.
    pub fn estimated_angle_deg(&self) -> Option<f64> {
        self.run.found().map(f64::to_degrees)
    }

    /// Found minus true, in (−180, 180]°.
    pub fn error_deg(&self) -> Option<f64> {
        let found = Angle::from_radians(self.run.found()?);
        Some(found.difference(Angle::from_radians(self.run.end_angle)).to_degrees())
    }

    /// The axis, in [0, 180)°, if one was found, with its pole or without.
    pub fn axis_deg(&self) -> Option<f64> {
        match self.run.ended {
            Ended::Outcome(Outcome::Found { angle, .. } | Outcome::Axis { angle, .. }) => {
                Some(angle.degrees().rem_euclid(180.0))
            }
            _ => None,
        }
    }

    /// The error of the axis alone, in (−90, 90]°: a wrong pole counts by itself.
    pub fn axis_error_deg(&self) -> Option<f64> {
        let error = (self.axis_deg()? - self.true_angle_deg()).rem_euclid(180.0);
        Some(if error > 90.0 { error - 180.0 } else { error })
    }

    /// True if the pole is the right one; none if none was named. Where there is no magnet, no pole is right.
    pub fn pole_correct(&self) -> Option<bool> {
        self.error_deg().map(|error| self.run.has_pole && error.abs() <= 90.0)
    }

    /// Margin to the nearest fault, see [`standstill_interface::Findings::fault_margin`].
    pub fn fault_margin(&self) -> Option<f64> {
        match &self.run.ended {
            Ended::Outcome(outcome) => outcome.findings().fault_margin,
            Ended::Error(_) => None,
        }
    }

    /// Furthest the rotor was from its start, in electrical degrees.
    pub fn rotor_moved_deg(&self) -> f64 {
        self.run.moved.to_degrees()
    }
}

/// A trial that could not be run: no detector or no machine can be made for it.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialError<E> {
    /// Its number.
    pub trial: u64,
    /// Why.
    pub error: E,
}

impl From<TrialError<SettingsError>> for SettingsError {
    fn from(of: TrialError<Self>) -> Self {
        of.error
    }
}
