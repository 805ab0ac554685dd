//! Statistics with their uncertainty.
//!
//! Errors are those of the axis, in (−90, 90]°; a wrong pole is counted by itself, because half a turn is not a
//! large angle error but another kind of failure. All intervals are at 95 %.

use std::collections::BTreeMap;

use serde::Serialize;
use statrs::distribution::{Beta, Binomial, ContinuousCDF, DiscreteCDF, StudentsT};

use crate::store::Row;
use crate::{Record, Verdict};

/// A value with its 95 % interval. An end that the sample is too small to give is not a number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The estimate.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// The exact (Clopper–Pearson) 95 % interval of a probability from `count` in `total`.
pub fn binomial_interval(count: u64, total: u64) -> Estimate {
    if total == 0 {
        return Estimate { value: f64::NAN, low: 0.0, high: 1.0 };
    }
    let (k, n) = (count as f64, total as f64);
    // Beta's parameters are positive in both cases, so it exists.
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(p));
    Estimate {
        value: k / n,
        low: if count == 0 { 0.0 } else { quantile(k, n - k + 1.0, 0.025) },
        high: if count == total { 1.0 } else { quantile(k + 1.0, n - k, 0.975) },
    }
}

/// Collects records.
#[derive(Clone, Debug, Default)]
pub struct Statistics {
    trials: u64,
    undetermined: u64,
    failed: u64,
    errors_of_simulation: u64,
    reasons: BTreeMap<String, u64>,
    wrong_poles: u64,
    beyond_limit: u64,
    moved: f64,
    duration: f64,
    peak_current: f64,
    squares: f64,
    errors: Vec<f64>,
}

/// What a campaign says.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Trials in all.
    pub trials: u64,
    /// With an angle.
    pub found: u64,
    /// With an axis but no pole.
    pub undetermined: u64,
    /// Given up by the detector.
    pub failed: u64,
    /// That the simulation could not carry out.
    pub errors: u64,
    /// Why there was no angle, and how often.
    pub reasons: BTreeMap<String, u64>,
    /// Trials with an axis, of which the error statistics are: found and undetermined.
    pub axes: u64,
    /// Root mean square of the axis error in degrees. Its interval is the normal one of the mean square.
    pub rms_deg: Estimate,
    /// Mean axis error in degrees.
    pub bias_deg: Estimate,
    /// 95th percentile of the axis error's magnitude in degrees, between order statistics.
    pub p95_deg: Estimate,
    /// Largest axis error in degrees.
    pub max_deg: f64,
    /// The probability that a further detection exceeds it, as far as the trials tell.
    pub beyond_max: Estimate,
    /// P(|e| > 2°) of the whole error, wrong poles included, among the trials with an angle.
    pub beyond_2_deg: Estimate,
    /// Trials that named the wrong pole.
    pub wrong_poles: u64,
    /// Their probability among all trials.
    pub wrong_pole_probability: Estimate,
    /// Probability of an axis without pole.
    pub undetermined_probability: Estimate,
    /// Probability of no angle.
    pub failed_probability: Estimate,
    /// Furthest that any rotor moved, in electrical degrees.
    pub max_moved_deg: f64,
    /// Mean duration of a detection in s.
    pub mean_duration_s: f64,
    /// Largest current in A.
    pub peak_current_a: f64,
}

impl Statistics {
    /// The angle error in degrees whose exceedance is counted: the paper's "within ±2°".
    pub const LIMIT_DEG: f64 = 2.0;

    /// Adds a record.
    pub fn add(&mut self, record: &Record) {
        self.add_row(&Row::from(record));
    }

    /// Adds a record as it was stored.
    pub fn add_row(&mut self, row: &Row) {
        self.trials += 1;
        self.moved = self.moved.max(row.rotor_moved_deg);
        self.duration += row.duration_s;
        self.peak_current = self.peak_current.max(row.peak_current_a);
        match row.verdict {
            Verdict::Found => {}
            Verdict::Undetermined => self.undetermined += 1,
            Verdict::Failed => self.failed += 1,
            Verdict::Error => self.errors_of_simulation += 1,
        }
        if !row.kind.is_empty() {
            *self.reasons.entry(row.kind.clone()).or_default() += 1;
        }
        self.wrong_poles += u64::from(row.pole_correct == Some(false));
        self.beyond_limit += u64::from(row.error_deg.is_some_and(|e| e.abs() > Self::LIMIT_DEG));
        self.squares += row.axis_error_deg.map_or(0.0, |error| error * error);
        self.errors.extend(row.axis_error_deg);
    }

    /// Trials so far.
    pub fn trials(&self) -> u64 {
        self.trials
    }

    /// Root mean square of the axis error so far, in degrees.
    pub fn running_rms(&self) -> f64 {
        (self.squares / self.errors.len() as f64).sqrt()
    }

    /// The summary of what was added.
    pub fn summary(&self) -> Summary {
        let n = self.errors.len() as f64;
        let axes = self.errors.len() as u64;
        let found = self.trials - self.undetermined - self.failed - self.errors_of_simulation;
        let moment = |power: i32| self.errors.iter().map(|e| e.powi(power)).sum::<f64>() / n;
        let (mean, square, fourth) = (moment(1), moment(2), moment(4));
        // Student's factor, which is 1.96 for many; one value alone has no interval.
        let student = StudentsT::new(0.0, 1.0, n - 1.0).map_or(f64::NAN, |t| t.inverse_cdf(0.975));
        let half = student * ((fourth - square * square).max(0.0) / (n - 1.0)).sqrt();
        let mean_half = student * ((square - mean * mean).max(0.0) / (n - 1.0)).sqrt();
        let mut magnitudes: Vec<f64> = self.errors.iter().map(|e| e.abs()).collect();
        magnitudes.sort_unstable_by(f64::total_cmp);
        let max_deg = magnitudes.last().copied().unwrap_or(f64::NAN);
        Summary {
            trials: self.trials,
            found,
            undetermined: self.undetermined,
            failed: self.failed,
            errors: self.errors_of_simulation,
            reasons: self.reasons.clone(),
            axes,
            rms_deg: Estimate {
                value: square.sqrt(),
                // `max` would make a number of what is none.
                low: if half.is_nan() { half } else { (square - half).max(0.0).sqrt() },
                high: (square + half).sqrt(),
            },
            bias_deg: Estimate { value: mean, low: mean - mean_half, high: mean + mean_half },
            p95_deg: quantile(&magnitudes, 0.95),
            max_deg,
            beyond_max: binomial_interval(0, axes),
            beyond_2_deg: binomial_interval(self.beyond_limit, found),
            wrong_poles: self.wrong_poles,
            wrong_pole_probability: binomial_interval(self.wrong_poles, self.trials),
            undetermined_probability: binomial_interval(self.undetermined, self.trials),
            failed_probability: binomial_interval(self.failed, self.trials),
            max_moved_deg: self.moved,
            mean_duration_s: self.duration / self.trials as f64,
            peak_current_a: self.peak_current,
        }
    }
}

/// A quantile with its distribution-free interval: the order statistics that enclose it with 95 %.
fn quantile(sorted: &[f64], p: f64) -> Estimate {
    let n = sorted.len() as u64;
    let at = |rank: u64| usize::try_from(rank).ok().and_then(|rank| sorted.get(rank)).copied();
    let Some(last) = n.checked_sub(1) else {
        return Estimate { value: f64::NAN, low: f64::NAN, high: f64::NAN };
    };
    // With n values, as many as Bin(n, p) lie below the quantile.
    let below = |q: f64| Binomial::new(p, n).map_or(n, |binomial| binomial.inverse_cdf(q));
    // A share of a count is below it.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let middle = ((p * n as f64) as u64).min(last);
    let value = |rank: Option<u64>| rank.and_then(at).unwrap_or(f64::NAN);
    Estimate {
        value: value(Some(middle)),
        low: value(below(0.025).checked_sub(1)),
        high: value(Some(below(0.975))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_clopper_pearson() {
        // Known values: 0 of n has the upper end 1 − 0.025^(1/n); 5 of 100 gives 1.643 % to 11.284 %.
        let none = binomial_interval(0, 10_000);
        assert_eq!(none.low, 0.0);
        assert!((none.high - (1.0 - 0.025_f64.powf(1e-4))).abs() < 1e-9);
        let five = binomial_interval(5, 100);
        assert!((five.low - 0.016_432).abs() < 1e-5 && (five.high - 0.112_835).abs() < 1e-5, "{five:?}");
        assert_eq!(binomial_interval(7, 7).high, 1.0);
    }

    #[test]
    fn analytic_quantile_of_a_ramp() {
        let ramp: Vec<f64> = (0..1000).map(f64::from).collect();
        let q = quantile(&ramp, 0.95);
        assert_eq!(q.value, 950.0);
        // Normal approximation of the ranks: 950 ± 1.96 √(1000 · 0.95 · 0.05) = 950 ± 13.5.
        assert!((q.low - 936.0).abs() <= 1.0 && (q.high - 963.0).abs() <= 1.0, "{q:?}");
    }

    #[test]
    fn law_small_samples_have_no_bounds_that_they_cannot_give() {
        // Of 20 values the largest is below the 95 % quantile with a probability of 0.95^20 = 36 %.
        let ramp: Vec<f64> = (0..20).map(f64::from).collect();
        assert!(quantile(&ramp, 0.95).high.is_nan());
        assert!(quantile(&ramp[..1], 0.95).low.is_nan());
        // From 73 values on, the largest is an upper bound: 0.95^73 < 2.5 %.
        let ramp: Vec<f64> = (0..74).map(f64::from).collect();
        assert_eq!(quantile(&ramp, 0.95).high, 73.0);
    }

    #[test]
    fn law_no_trials_is_not_a_number_and_not_a_panic() {
        let summary = Statistics::default().summary();
        assert!(summary.rms_deg.value.is_nan() && summary.p95_deg.value.is_nan());
    }
}
