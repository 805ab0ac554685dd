//! The goal of a search, and the comparison of settings by it.

use standstill_campaign::Estimate;
use standstill_numeric::ln;

use crate::limit::{Limits, Measure};

/// The goal: a measure to be minimised, and limits to be kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Goal {
    /// The measure to be minimised.
    pub minimise: Measure,
    /// The limits to be kept.
    pub limits: Limits,
}

/// Estimates of measures for one combination of settings, in the units of the measures.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured(pub Vec<(Measure, Estimate)>);

impl Measured {
    /// Returns the estimate of a measure, or NaN if the measure was not computed.
    pub fn get(&self, measure: Measure) -> Estimate {
        let none = Estimate { value: f64::NAN, low: f64::NAN, high: f64::NAN };
        self.0.iter().find(|(taken, _)| *taken == measure).map_or(none, |(_, estimate)| *estimate)
    }

    /// Returns a penalty for settings with which no start has an answer. It is added to the objective and subtracted from the slacks of
    /// broken limits. It is 0 if a start has an answer, or if the distance from an answer was not measured.
    fn away(&self) -> f64 {
        let all_open = self.get(Measure::Unanswered).value >= 1.0;
        let distance = self.get(Measure::Distance).value;
        if all_open && !distance.is_nan() { OF_DISTANCE * distance } else { 0.0 }
    }
}

/// Weight of the starts' mean distance from an answer in this penalty. It is small compared with the measures, so that settings with a
/// first answer are always better.
const OF_DISTANCE: f64 = 0.1;

/// Value of a confidence interval that is compared with a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// The point estimate.
    Likely,
    /// The unfavourable end of the interval. A limit that holds there certainly holds.
    Sure,
}

/// Score of settings. The settings that break the limits less are better. If they break them equally, those with the smaller minimised
/// measure are better (rules of K. Deb, "An efficient constraint handling method for genetic algorithms", 2000,
/// doi:10.1016/S0045-7825(99)00389-8).
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Score {
    /// Sum of the relative amounts by which limits are broken; 0 if all limits hold.
    pub broken: f64,
    /// Logarithm of the measure to be minimised.
    pub merit: f64,
}

impl Score {
    /// Score of invalid settings.
    pub const WORST: Self = Self { broken: f64::INFINITY, merit: f64::INFINITY };

    /// Returns true if this score is better than another.
    pub fn beats(&self, other: &Self) -> bool {
        self.partial_cmp(other) == Some(std::cmp::Ordering::Less)
    }
}

/// Smallest and largest logarithm of the minimised measure. Values outside this range count as the nearer end.
const MERITS: (f64, f64) = (-30.0, 8.0);

/// Largest magnitude of a negative slack. The slack of a limit of zero has this magnitude if the limit is exceeded.
const BROKEN: f64 = 10.0;

/// Returns the slack of the limit `most` at a value. The slack is 1 at a value of zero, 0 at the limit, and −1 at twice the limit. Beyond
/// that it falls with the logarithm of the value, down to −[`BROKEN`]. The slack of a limit of zero is 0 if the limit holds, else
/// −[`BROKEN`].
fn left(value: f64, most: f64) -> f64 {
    if most <= 0.0 {
        return if value <= most { 0.0 } else { -BROKEN };
    }
    let left = 1.0 - value / most;
    if left >= -1.0 {
        left
    } else if left.is_finite() {
        (-1.0 - ln(-left)).max(-BROKEN)
    } else {
        -BROKEN
    }
}

impl Goal {
    /// Returns objective and constraints for the optimiser. The objective is the logarithm of the minimised measure. The constraints are
    /// the slacks of the limits, which are negative if the limits are broken. Invalid settings have the worst possible values. If no start
    /// has an answer, measures that count such starts do not distinguish settings. A penalty for the starts' distance from an answer does
    /// this instead.
    pub fn view(&self, measured: Option<&Measured>, view: View) -> (f64, Vec<f64>) {
        let Some(measured) = measured else {
            return (MERITS.1, vec![-BROKEN; self.limits.0.len()]);
        };
        let value = measured.get(self.minimise).value;
        let merit = if value > 0.0 { ln(value) } else { MERITS.0 };
        let merit = if merit.is_nan() { MERITS.1 } else { merit.clamp(MERITS.0, MERITS.1) };
        let away = measured.away();
        let left = self.limits.0.iter().map(|limit| {
            let estimate = measured.get(limit.measure);
            let value = if view == View::Sure { estimate.high } else { estimate.value };
            let left = left(value, limit.most);
            if left < 0.0 { left - away } else { left }
        });
        (merit + away, left.collect())
    }

    /// Returns the score of settings. `measured` is none for invalid settings.
    pub fn score(&self, measured: Option<&Measured>, view: View) -> Score {
        if measured.is_none() {
            return Score::WORST;
        }
        let (merit, left) = self.view(measured, view);
        Score { broken: left.iter().map(|left| (-left).max(0.0)).sum(), merit }
    }
}
