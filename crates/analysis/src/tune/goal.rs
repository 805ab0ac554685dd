//! The goal of a search: a measure and its limits.

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

/// Estimates for settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured(pub Vec<(Measure, Estimate)>);

impl Measured {
    /// A measure; unknown if it was not taken.
    pub fn get(&self, measure: Measure) -> Estimate {
        let none = Estimate { value: f64::NAN, low: f64::NAN, high: f64::NAN };
        self.0.iter().find(|(taken, _)| *taken == measure).map_or(none, |(_, estimate)| *estimate)
    }
}

/// The end of an interval that counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// The estimate.
    Likely,
    /// Of limits the bad end: what holds then holds surely.
    Sure,
}

/// Settings compared: those that break limits less are better, then those with the smaller measure (the rules of K. Deb,
/// "An efficient constraint handling method for genetic algorithms", 2000, doi:10.1016/S0045-7825(99)00389-8).
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Score {
    /// By how much the limits are broken, in all, as shares of them; 0: they hold.
    pub broken: f64,
    /// The measure's logarithm.
    pub merit: f64,
}

impl Score {
    /// Of settings that cannot be.
    pub const WORST: Self = Self { broken: f64::INFINITY, merit: f64::INFINITY };

    /// True if it is better than another.
    pub fn beats(&self, other: &Self) -> bool {
        self.partial_cmp(other) == Some(std::cmp::Ordering::Less)
    }
}

/// Logarithms of measures between which the search looks: beyond, one is as bad, or as good, as another.
const MERITS: (f64, f64) = (-30.0, 8.0);

/// Slack of a limit that nothing can keep.
const BROKEN: f64 = 10.0;

/// Slack of a limit as a share of it; beyond twice the limit by its logarithm, so that it stays a number. Of a limit
/// of zero nothing is left, and zero keeps it.
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
    /// Objective and constraints of the optimiser: the measure's logarithm; and the slack of each limit as a share,
    /// negative where it is broken. Of settings that cannot be the worst of all.
    pub fn view(&self, measured: Option<&Measured>, view: View) -> (f64, Vec<f64>) {
        let Some(measured) = measured else {
            return (MERITS.1, vec![-BROKEN; self.limits.0.len()]);
        };
        let value = measured.get(self.minimise).value;
        let merit = if value > 0.0 { ln(value) } else { MERITS.0 };
        let left = self.limits.0.iter().map(|limit| {
            let estimate = measured.get(limit.measure);
            let value = if view == View::Sure { estimate.high } else { estimate.value };
            left(value, limit.most)
        });
        (if merit.is_nan() { MERITS.1 } else { merit.clamp(MERITS.0, MERITS.1) }, left.collect())
    }

    /// Merit of settings.
    pub fn score(&self, measured: Option<&Measured>, view: View) -> Score {
        if measured.is_none() {
            return Score::WORST;
        }
        let (merit, left) = self.view(measured, view);
        Score { broken: left.iter().map(|left| (-left).max(0.0)).sum(), merit }
    }
}
