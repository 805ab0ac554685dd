//! Compares methods on the same motor, with the same drives, sensors and rotor angles.
//!
//! A trial's angle, drive and sensors depend only on the seed and the trial's number, not on the method. So a difference between two rows
//! of a comparison is a difference between methods (common random numbers).

use standstill_campaign::Summary;
use standstill_detect::{Method, SettingsError};
use standstill_scenario::{ErrorSet, Rotor, Scenario};
use standstill_sim::{NoProbe, RunError, run};

use crate::bound::{Bound, BoundError, Bounds, Counted};

/// One row of the comparison: the result of one method with one state of the rotor and one set of errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Name of the method or of the library.
    pub method: String,
    /// State of the rotor.
    pub rotor: Rotor,
    /// Error set of drive and sensors.
    pub errors: ErrorSet,
    /// Statistics of the trials.
    pub summary: Summary,
    /// Mean energy in J that a detection takes from the DC link.
    pub energy_j: f64,
    /// Cramér–Rao limit as rms over the rotor angles. None if the limit was not requested or does not exist.
    pub bound: Option<Bound>,
    /// Error of the simulation that failed, which is why a requested limit does not exist.
    pub no_bound: Option<RunError>,
}

/// Rms error in degrees of an axis drawn at random.
const RANDOM_AXIS: f64 = 51.961_524_227_066_32;

/// Returns the Cramér–Rao limit in degrees if it is informative. None if it is not a number or is larger than 52°, the rms error of a
/// random axis. The limit is valid only for small errors. It grows without bound if a detection gives up before its readings determine the
/// angle.
pub fn informative(limit: f64) -> Option<f64> {
    (limit <= RANDOM_AXIS).then_some(limit)
}

impl Entry {
    /// Returns the Cramér–Rao limit in degrees for the samples that the method takes. None if there is no [`informative`] limit.
    pub fn limit(&self) -> Option<f64> {
        informative(self.bound?.scheme_deg)
    }

    /// Returns the Cramér–Rao limit divided by the measured rms error, which is 1 for an efficient method. None without a limit, without
    /// noise, or if the method's answers are sectors.
    pub fn efficiency(&self) -> Option<f64> {
        if self.summary.sectors.is_some() {
            return None;
        }
        let efficiency = self.limit()? / self.summary.rms_deg.value;
        (efficiency.is_finite() && efficiency > 0.0).then_some(efficiency)
    }
}

/// Largest number of trials over which the mean energy is computed.
const ENERGY_TRIALS: u64 = 8;

/// Returns the mean energy in J that a detection takes from the DC link, over the first few trials. NaN if no trial reaches its end.
///
/// # Errors
/// The method cannot work with its settings.
pub fn mean_energy(scenario: &Scenario<Method<f64>>, trials: u64) -> Result<f64, SettingsError> {
    let (mut sum, mut count) = (0.0, 0.0);
    for trial in 0..trials.min(ENERGY_TRIALS) {
        let case = scenario.case(trial);
        let run = run(&case, &mut scenario.detector_for(&case)?, true, &mut NoProbe);
        if let Some(ledger) = run.ledger {
            sum += ledger.source - ledger.link_change;
            count += 1.0;
        }
    }
    Ok(sum / count)
}

impl Bound {
    /// Computes the limit like [`Self::of`]. If a simulation fails, the second value is the reason. The limit is computed with nominal
    /// plants, whose currents may leave the motor's flux map even if the currents of the trials do not.
    ///
    /// # Errors
    /// Errors of [`Self::of`], except for a simulation that failed.
    pub fn or_reason(
        bounds: Bounds<'_, Method<f64>>,
        angles: usize,
    ) -> Result<(Option<Self>, Option<RunError>), BoundError> {
        match Self::of(bounds, angles) {
            Ok(bound) => Ok((bound, None)),
            Err(BoundError::Run(reason)) => Ok((None, Some(reason))),
            Err(error) => Err(error),
        }
    }

    /// Computes the bounds at this number of rotor angles, evenly spaced over the turn, and returns the rms of these bounds. None if the
    /// method turns the rotor.
    ///
    /// # Errors
    /// The detector cannot work with its settings, or a plant cannot be simulated.
    pub fn of(bounds: Bounds<'_, Method<f64>>, angles: usize) -> Result<Option<Self>, BoundError> {
        Ok(bounds.over(angles)?.map(|bounds| Self::rms(&bounds)))
    }
}

impl<'a> Bounds<'a, Method<f64>> {
    /// Sets up the bounds of a scenario's method. If the method has line pulses, only these pulses count, because the axis is known before
    /// the polarity test begins.
    pub fn of_method(scenario: &'a Scenario<Method<f64>>) -> Self {
        let counted = if scenario.detector.has_line_pulses() { Counted::BeforePwm } else { Counted::All };
        // Without noise an adaptive method would stop too early.
        let noise = scenario.detector.is_adaptive().then_some(0);
        Bounds { counted, noise, ..Bounds::new(scenario) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_a_limit_beyond_a_guess_says_nothing() {
        // Uniform from -90° to 90°.
        assert!((RANDOM_AXIS - 90.0 / 3.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(informative(0.05), Some(0.05));
        for limit in [52.0, f64::INFINITY, f64::NAN] {
            assert_eq!(informative(limit), None);
        }
    }
}
