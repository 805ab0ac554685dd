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
        /// The detector found an angle: axis and pole. On a motor without a magnet, which has no poles: an axis.
        Found = "found",
        /// The detector found an axis without a pole, on a motor with a magnet.
        Undetermined = "undetermined",
        /// The detector gave up, with a reason.
        Failed = "failed",
        /// The simulation could not continue.
        Error = "error",
    }
}

impl Record {
    /// Returns the kind of the trial's end. A motor without a magnet has no poles. For this motor an axis alone counts as found, and errors
    /// are errors of the axis, even if the detector named a pole.
    ///
    /// ```
    /// use standstill_detect::MethodName;
    /// use standstill_plant::built_in;
    /// use standstill_scenario::{ErrorSet, Scenario, Verdict};
    /// use standstill_sim::RotorState;
    ///
    /// let motor = built_in("reluctance-6k7").expect("built in");
    /// let of = Scenario::of_method(MethodName::Bipolar, motor, ErrorSet::Default, RotorState::Locked, 1);
    /// let record = of.trial(0).expect("settings");
    /// assert_eq!((record.verdict(), record.pole_correct()), (Verdict::Found, None));
    /// assert!(record.error_deg().is_some_and(|error| error.abs() < 1.0));
    /// ```
    pub fn verdict(&self) -> Verdict {
        match self.run.ended {
            Ended::Outcome(Outcome::Found { .. }) => Verdict::Found,
            Ended::Outcome(Outcome::Axis { .. }) if !self.run.has_pole => Verdict::Found,
            Ended::Outcome(Outcome::Axis { .. }) => Verdict::Undetermined,
            Ended::Outcome(Outcome::Failed { .. }) => Verdict::Failed,
            Ended::Error(_) => Verdict::Error,
        }
    }

    /// Returns the reason for any other verdict than [`Verdict::Found`]. The text is empty if the verdict is [`Verdict::Found`].
    pub fn reason(&self) -> String {
        match self.run.ended {
            Ended::Outcome(Outcome::Axis { reason, .. }) if self.run.has_pole => reason.to_string(),
            Ended::Outcome(Outcome::Found { .. } | Outcome::Axis { .. }) => String::new(),
            Ended::Outcome(Outcome::Failed { fault, .. }) => fault.to_string(),
            Ended::Error(error) => error.to_string(),
        }
    }

    /// Returns the name of the reason that [`Self::reason`] describes, without numbers. Returns none if the verdict is [`Verdict::Found`].
    pub fn reason_name(&self) -> Option<String> {
        match self.run.ended {
            Ended::Outcome(Outcome::Axis { reason, .. }) if self.run.has_pole => {
                Some(reason.name().to_owned())
            }
            Ended::Outcome(Outcome::Found { .. } | Outcome::Axis { .. }) => None,
            Ended::Outcome(Outcome::Failed { fault, .. }) => Some(fault.name().to_owned()),
            Ended::Error(error) => Some(error.name()),
        }
    }

    /// Returns the true electrical angle of the north pole at the end of the detection, in [0, 360)°. The drive starts the motor from this
    /// angle, even if the rotor moved during the detection.
    pub fn true_angle_deg(&self) -> f64 {
        Angle::from_radians(self.run.end_angle).degrees()
    }

    /// Returns the electrical angle at the beginning of the trial, in [0, 360)°.
    pub fn start_angle_deg(&self) -> f64 {
        Angle::from_radians(self.run.start_angle).degrees()
    }

    /// Returns the angle that the detector found, in [0, 360)°. For a motor without a magnet, returns the angle of the axis, in [0, 180)°.
    /// Returns none if the detector found no angle.
    pub fn estimated_angle_deg(&self) -> Option<f64> {
        if self.run.has_pole { self.run.found().map(f64::to_degrees) } else { self.axis_deg() }
    }

    /// Returns the found angle minus the true angle, in (−180, 180]°. For a motor without a magnet, returns the error of the axis, in (−90,
    /// 90]°. Returns none if the detector found no angle.
    pub fn error_deg(&self) -> Option<f64> {
        if !self.run.has_pole {
            return self.axis_error_deg();
        }
        let found = Angle::from_radians(self.run.found()?);
        Some(found.difference(Angle::from_radians(self.run.end_angle)).to_degrees())
    }

    /// Returns the time in s from the instant for which the found angle or axis holds to the end of the detection. Returns none if the
    /// detector found no axis or does not state the instant.
    pub fn age_s(&self) -> Option<f64> {
        self.run.instant_angle.and(self.findings().age)
    }

    /// Returns the found angle minus the true angle at the instant for which it holds, in (−180, 180]°. For a motor without a magnet, returns
    /// the error of the axis, in (−90, 90]°. It differs from [`Self::error_deg`] by the angle by which the rotor turned in
    /// [`Self::age_s`]. Returns none if the detector found no angle or does not state the instant.
    ///
    /// ```
    /// # use standstill_detect::MethodName;
    /// # use standstill_plant::built_in;
    /// # use standstill_scenario::{ErrorSet, Scenario};
    /// # use standstill_sim::RotorState;
    /// let motor = built_in("paper-5k5").expect("built in");
    /// let mut of = Scenario::of_method(MethodName::Bipolar, motor, ErrorSet::None, RotorState::Driven, 1);
    /// of.start_speed = 5.0; // rpm: 0.57° in 4.7 ms with four pole pairs
    /// let record = of.trial(0).expect("settings");
    /// let [end, instant] = [record.error_deg(), record.error_at_instant_deg()].map(|error| error.expect("found").abs());
    /// assert!(end > 0.5 && instant < 0.1, "{end}°, {instant}°");
    /// ```
    pub fn error_at_instant_deg(&self) -> Option<f64> {
        let (error, turned) = (self.error_deg()?, self.turned_since_deg()?);
        Some(if self.run.has_pole { wrapped(error + turned, 360.0) } else { wrapped(error + turned, 180.0) })
    }

    /// Returns the error of the axis at the instant for which it holds, in (−90, 90]°. Returns none if the detector found no axis or does not
    /// state the instant.
    pub fn axis_error_at_instant_deg(&self) -> Option<f64> {
        Some(wrapped(self.axis_error_deg()? + self.turned_since_deg()?, 180.0))
    }

    /// Returns the angle in degrees by which the rotor turned from the instant for which the found angle holds to the end.
    fn turned_since_deg(&self) -> Option<f64> {
        Some((self.run.end_angle - self.run.instant_angle?).to_degrees())
    }

    /// Returns the angle of the axis that the detector found, in [0, 180)°. The detector may have found the axis without the pole. Returns
    /// none if it found no axis.
    pub fn axis_deg(&self) -> Option<f64> {
        match self.run.ended {
            Ended::Outcome(Outcome::Found { angle, .. } | Outcome::Axis { angle, .. }) => {
                Some(angle.degrees().rem_euclid(180.0))
            }
            _ => None,
        }
    }

    /// Returns the error of the axis, in (−90, 90]°. A wrong pole does not change this error. Returns none if the detector found no axis.
    pub fn axis_error_deg(&self) -> Option<f64> {
        Some(wrapped(self.axis_deg()? - self.true_angle_deg(), 180.0))
    }

    /// Returns half the width in degrees of the sector that the detector found. The found angle is the middle of this sector. Returns none
    /// for methods that find an angle instead of a sector.
    pub fn half_sector_deg(&self) -> Option<f64> {
        // The rounding removes the error of the conversion from radians.
        self.findings().half_sector.map(|half| (half.to_degrees() * 1e9).round() / 1e9)
    }

    /// Returns the error of the axis, in degrees with sign. If the detector found a sector, returns only the part of the error beyond half
    /// the width of the sector. Returns none if the detector found no axis.
    pub fn axis_miss_deg(&self) -> Option<f64> {
        self.axis_error_deg().map(|error| miss_deg(error, self.half_sector_deg()))
    }

    /// Returns the error of the axis at the instant for which it holds, in degrees with sign. If the detector found a sector, returns only the
    /// part of the error beyond half the width of the sector. Returns none if the detector found no axis or does not state the instant.
    pub fn axis_miss_at_instant_deg(&self) -> Option<f64> {
        self.axis_error_at_instant_deg().map(|error| miss_deg(error, self.half_sector_deg()))
    }

    /// Returns the error of the angle, in degrees with sign. If the detector found a sector, returns only the part of the error beyond half
    /// the width of the sector. Returns none if the detector found no angle.
    pub fn miss_deg(&self) -> Option<f64> {
        self.error_deg().map(|error| miss_deg(error, self.half_sector_deg()))
    }

    /// Returns true if the found pole is right, and false if it is wrong. Returns none if no pole was found or if the motor has no magnet.
    pub fn pole_correct(&self) -> Option<bool> {
        self.error_deg().filter(|_| self.run.has_pole).map(|error| error.abs() <= 90.0)
    }

    /// Returns the outcome in words. Angles are in degrees and have `decimals` decimals.
    ///
    /// ```
    /// # use standstill_detect::MethodName;
    /// # use standstill_plant::built_in;
    /// # use standstill_scenario::{ErrorSet, Scenario};
    /// # use standstill_sim::RotorState;
    /// let of = |motor: &str| {
    ///     let motor = built_in(motor).expect("built in");
    ///     let of = Scenario::of_method(MethodName::Bipolar, motor, ErrorSet::Default, RotorState::Locked, 1);
    ///     of.trial(0).expect("settings").in_words(2)
    /// };
    /// assert!(of("paper-5k5").starts_with("found "), "{}", of("paper-5k5"));
    /// assert!(of("reluctance-6k7").starts_with("found the axis "), "{}", of("reluctance-6k7"));
    /// ```
    pub fn in_words(&self, decimals: usize) -> String {
        match (self.estimated_angle_deg(), self.error_deg()) {
            (Some(angle), Some(error)) => {
                let axis = if self.run.has_pole { "" } else { "the axis " };
                format!("found {axis}{angle:.decimals$}°, error {error:+.decimals$}°")
            }
            _ => format!("{}: {}", self.verdict().name(), self.reason()),
        }
    }

    /// Returns the quantities that the detector measured. All quantities are empty if the simulation could not continue.
    pub fn findings(&self) -> Findings<f64> {
        match self.run.ended {
            Ended::Outcome(outcome) => *outcome.findings(),
            Ended::Error(_) => Findings::default(),
        }
    }

    /// Returns true if the detection failed because the method concluded that the rotor turns or moves.
    pub fn rotor_turns(&self) -> bool {
        let Ended::Outcome(Outcome::Failed { fault, .. }) = self.run.ended else { return false };
        matches!(fault, Fault::RotorTurns { .. } | Fault::RotorMoves { .. })
    }

    /// Returns the largest distance of the rotor from its initial angle, in electrical degrees.
    pub fn rotor_moved_deg(&self) -> f64 {
        self.run.moved.to_degrees()
    }
}

/// Returns an angle less whole periods, in the half-open interval from minus half a period (excluded) to half a period.
fn wrapped(angle: f64, period: f64) -> f64 {
    let angle = angle.rem_euclid(period);
    if angle > period / 2.0 { angle - period } else { angle }
}

/// Returns the part of `error` beyond half the width of the found sector. `half_sector` is half this width. Both are in degrees. If the
/// method found an angle instead of a sector, returns the whole error.
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

/// Error of a trial that could not be run. The reason is that its scenario or its detector cannot be made.
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
