//! Statistics with their uncertainty.
//!
//! Errors are those of the axis, in (−90, 90]°. Wrong poles are counted separately, because half a turn is not a large
//! angle error but another kind of failure. If an answer is a sector, the error is the part beyond that sector. All
//! intervals are 95 % intervals.

mod binomial;
mod judged;
mod merge;
mod quantiles;
mod rms;
mod sectors;
mod student;
mod sum;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use self::judged::{Apart, Judgement};
use self::quantiles::Magnitudes;
use self::rms::root_mean_square;
pub use self::sectors::Sectors;
pub use self::student::{student, student_beyond};
use self::sum::Sum;
use crate::store::Row;
use standstill_numeric::rank;
pub use standstill_quantity::Estimate;
use standstill_scenario::{Record, Verdict, miss_deg};

/// Count and probability of an event.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Occurrence {
    /// Trials in which it did.
    pub count: u64,
    /// Probability of the event.
    pub probability: Estimate,
}

/// Returns the exact (Clopper–Pearson) 95 % interval of a probability from `count` in `total`.
///
/// ```
/// use standstill_campaign::binomial_interval;
///
/// // The rule of three: none in a thousand leaves up to 3.7 in a thousand, with both tails at 2.5 %.
/// let wrong = binomial_interval(0, 1000);
/// assert_eq!(wrong.low, 0.0);
/// assert!((wrong.high - 3.68e-3).abs() < 1e-5);
/// ```
pub fn binomial_interval(count: u64, total: u64) -> Estimate {
    if total == 0 {
        return Estimate { value: f64::NAN, low: 0.0, high: 1.0 };
    }
    Estimate {
        value: count as f64 / total as f64,
        low: binomial::lower(count, total, 0.025),
        high: binomial::upper(count, total, 0.025),
    }
}

/// Returns the ends of the exact (Clopper–Pearson) one-sided 95 % intervals of a probability from `count` in `total`:
/// it is at least the first, and at most the second.
///
/// ```
/// use standstill_campaign::one_sided_bounds;
///
/// // The rule of three: none in 3,000 is at most one in a thousand.
/// let [least, most] = one_sided_bounds(0, 3000);
/// assert!(least == 0.0 && (most - 9.98e-4).abs() < 1e-6);
/// ```
pub fn one_sided_bounds(count: u64, total: u64) -> [f64; 2] {
    if total == 0 {
        return [0.0, 1.0];
    }
    [binomial::lower(count, total, 0.05), binomial::upper(count, total, 0.05)]
}

/// Returns the second of two independent estimates minus the first, with an interval computed from their intervals (G.
/// Y. Zou and A. Donner, "Construction of confidence limits about effect measures", 2008, doi:10.1002/sim.3095). It is
/// exact for normal estimates, and still informative if the event was observed in neither.
pub fn independent_difference(estimates: [Estimate; 2]) -> Estimate {
    correlated_difference(estimates, 0.0)
}

/// Returns the share of an event in the second of two runs minus that in the first, over the same `pairs` of trials.
/// `alone`: numbers of pairs in which only the first or only the second run had the event. Pairs in which both or
/// neither had it carry no information.
///
/// The two counts belong to one multinomial distribution: with their shares p and q, their covariance is −p q/n. The
/// interval is computed from those of the two shares with that correlation (R. G. Newcombe, "Improved confidence
/// intervals for the difference between binomial proportions based on paired data", 1998). Those are mid-P ones to
/// close approximation, because exact ones of few events combine to too wide an interval (G. Berry and P. Armitage,
/// "Mid-P confidence intervals: a brief review", 1995); without an event, the exact interval is used.
///
/// ```
/// use standstill_campaign::paired_difference;
///
/// // 90 of 200 against 90: ± 1.96·√(180)/200.
/// let even = paired_difference([90, 90], 200);
/// assert!(even.value == 0.0 && (even.high - 0.1315).abs() < 1e-3);
/// ```
pub fn paired_difference(alone: [u64; 2], pairs: u64) -> Estimate {
    let estimates = alone.map(|count| middle_interval(count, pairs));
    let odds = |share: f64| share / (1.0 - share).max(f64::MIN_POSITIVE);
    let correlation = -(odds(estimates[0].value) * odds(estimates[1].value)).sqrt();
    correlated_difference(estimates, correlation.max(-1.0))
}

/// Returns the interval for [`paired_difference`]: each end is in the middle between the exact ends for this count and
/// for its neighbour on the inner side.
fn middle_interval(count: u64, total: u64) -> Estimate {
    let exact = binomial_interval(count, total);
    if count == 0 || count == total {
        return exact;
    }
    let low = binomial::lower(count + 1, total, 0.025).min(exact.value);
    let high = binomial::upper(count - 1, total, 0.025).max(exact.value);
    Estimate { low: (exact.low + low) / 2.0, high: (exact.high + high) / 2.0, ..exact }
}

/// Returns the rms of the second errors minus that of the first, over pairs with the same random numbers. To first
/// order it is the difference of the means of b²/(2 r_b) and a²/(2 r_a), with the rms values r; its standard deviation
/// comes from the pairs, and the interval from Student's t.
pub fn paired_rms(pairs: &[(f64, f64)]) -> Estimate {
    let n = pairs.len() as f64;
    let rms =
        |of: fn(&(f64, f64)) -> f64| (pairs.iter().map(|pair| of(pair) * of(pair)).sum::<f64>() / n).sqrt();
    let (a, b) = (rms(|pair| pair.0), rms(|pair| pair.1));
    let part = |error: f64, rms: f64| if rms > 0.0 { error * error / (2.0 * rms) } else { 0.0 };
    let parts: Vec<f64> = pairs.iter().map(|(x, y)| part(*y, b) - part(*x, a)).collect();
    let mean = parts.iter().sum::<f64>() / n;
    let variance = parts.iter().map(|part| (part - mean) * (part - mean)).sum::<f64>() / (n - 1.0);
    let half = student(n - 1.0) * (variance / n).sqrt();
    let value = b - a;
    Estimate { value, low: value - half, high: value + half }
}

/// Returns the second of two estimates less the first, where these have this correlation: see
/// [`independent_difference`].
pub fn correlated_difference([a, b]: [Estimate; 2], correlation: f64) -> Estimate {
    let length = |x: f64, y: f64| {
        let square = x * x + y * y - 2.0 * correlation * x * y;
        // Below zero by rounding; of what is not known nothing is known.
        if square < 0.0 { 0.0 } else { square.sqrt() }
    };
    let value = b.value - a.value;
    let low = value - length(b.value - b.low, a.high - a.value);
    let high = value + length(b.high - b.value, a.value - a.low);
    Estimate { value, low, high }
}

/// Collects records, in memory that does not grow with their number. Sums are exact: the order of the records changes no bit.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Statistics {
    limit_deg: f64,
    trials: u64,
    undetermined: u64,
    failed: u64,
    errors_of_simulation: u64,
    reasons: BTreeMap<String, u64>,
    wrong_poles: u64,
    beyond_limit: u64,
    moved: f64,
    duration: Sum,
    peak_current: f64,
    /// Sums of the errors' first, second, fourth and sixth powers.
    powers: [Sum; 4],
    magnitudes: Magnitudes,
    /// Counts of answers that are sectors. Journals store them after the statistics, so that journals written before there were sectors can
    /// still be read.
    #[serde(skip)]
    pub(crate) sectors: Option<Sectors>,
}

impl Default for Statistics {
    fn default() -> Self {
        Self::with_limit(Self::LIMIT_DEG)
    }
}

/// Summary of a campaign.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Trials in all.
    pub trials: u64,
    /// Number of trials with an angle.
    pub found: u64,
    /// Number of trials with an axis but no pole.
    pub undetermined: u64,
    /// Given up by the detector.
    pub failed: u64,
    /// Trials that the simulation could not carry out.
    pub errors: u64,
    /// Why there was no angle, and how often.
    pub reasons: BTreeMap<String, Occurrence>,
    /// Number of trials with an axis, found or undetermined, which the error statistics cover.
    pub axes: u64,
    /// Root mean square of the axis error in degrees. Its interval is that of the mean square by Student's t
    /// with Hall's correction for the skewness of squares.
    pub rms_deg: Estimate,
    /// Mean axis error in degrees.
    pub bias_deg: Estimate,
    /// Median of the axis error's magnitude in degrees, between order statistics. Of more than a hundred thousand
    /// errors, quantiles are to four digits.
    pub p50_deg: Estimate,
    /// 95th percentile.
    pub p95_deg: Estimate,
    /// 99th percentile.
    pub p99_deg: Estimate,
    /// Largest axis error in degrees.
    #[serde(deserialize_with = "standstill_quantity::or_nan")]
    pub max_deg: f64,
    /// Probability that the error of a further detection exceeds this maximum, as estimated from the trials.
    pub beyond_max: Estimate,
    /// The error in degrees whose exceedance is counted.
    pub limit_deg: f64,
    /// Among the trials with an angle, the share of those whose angle is off by more than the limit, wrong poles included.
    pub beyond_limit: Estimate,
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
    #[serde(deserialize_with = "standstill_quantity::or_nan")]
    pub mean_duration_s: f64,
    /// Largest current in A.
    pub peak_current_a: f64,
    /// Counts of answers that are sectors; none if no answer is a sector. If present, all errors above are the parts
    /// beyond the named sector.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sectors: Option<Sectors>,
}

impl Statistics {
    /// The angle error in degrees whose exceedance is counted unless another is asked for: the paper's "within ±2°".
    pub const LIMIT_DEG: f64 = 2.0;

    /// Makes empty statistics that count the angle errors beyond `limit_deg`.
    pub fn with_limit(limit_deg: f64) -> Self {
        Self {
            limit_deg,
            trials: 0,
            undetermined: 0,
            failed: 0,
            errors_of_simulation: 0,
            reasons: BTreeMap::new(),
            wrong_poles: 0,
            beyond_limit: 0,
            moved: 0.0,
            duration: Sum::default(),
            peak_current: 0.0,
            powers: Default::default(),
            magnitudes: Magnitudes::default(),
            sectors: None,
        }
    }

    /// Adds a record.
    pub fn add(&mut self, record: &Record) {
        self.add_row(&Row::from(record));
    }

    /// Adds a stored record.
    pub fn add_row(&mut self, row: &Row) {
        let half = row.half_sector_deg;
        let beyond = |error: Option<f64>| error.map(|error| miss_deg(error, half));
        self.add_outcome(row.verdict, row.pole_correct, beyond(row.axis_error_deg));
        self.moved = self.moved.max(row.rotor_moved_deg);
        self.duration.add(row.duration_s);
        self.peak_current = self.peak_current.max(row.peak_current_a);
        if !row.kind.is_empty() {
            *self.reasons.entry(row.kind.clone()).or_default() += 1;
        }
        self.beyond_limit += u64::from(beyond(row.error_deg).is_some_and(|e| e.abs() > self.limit_deg));
        // Errors of axes are those beyond the sector, too, where no pole is named.
        if let (Some(half), Some(_)) = (half, row.axis_error_deg) {
            let sectors = self.sectors.get_or_insert_default();
            sectors.note(half);
            if let Some(error) = row.error_deg {
                sectors.add(half, error, self.limit_deg);
            }
        }
    }

    /// Adds a trial of which only its outcome is known: the error of its axis in degrees, if it has one, and whether the pole that
    /// it named is the right one.
    pub fn add_outcome(&mut self, verdict: Verdict, pole_correct: Option<bool>, axis_error_deg: Option<f64>) {
        self.trials += 1;
        match verdict {
            Verdict::Found => {}
            Verdict::Undetermined => self.undetermined += 1,
            Verdict::Failed => self.failed += 1,
            Verdict::Error => self.errors_of_simulation += 1,
        }
        self.wrong_poles += u64::from(pole_correct == Some(false));
        if let Some(error) = axis_error_deg {
            let square = error * error;
            let [first, second, fourth, sixth] = &mut self.powers;
            first.add(error);
            second.add_product(error, error);
            fourth.add(square * square);
            sixth.add(square * square * square);
            self.magnitudes.add(error.abs());
        }
    }

    /// Trials so far.
    pub fn trials(&self) -> u64 {
        self.trials
    }

    /// Returns the mean and rms of the axis error in degrees.
    fn moments(&self) -> [Estimate; 2] {
        let n = self.magnitudes.count() as f64;
        let [mean, square, fourth, sixth] = self.powers.each_ref().map(|sum| sum.value() / n);
        let about_mean = self.powers[1].about_mean(&self.powers[0], n);
        let mean_half = student(n - 1.0) * (about_mean / n / (n - 1.0)).sqrt();
        let rms = root_mean_square([square, fourth, sixth], n);
        [Estimate { value: mean, low: mean - mean_half, high: mean + mean_half }, rms]
    }

    /// Returns the root mean square of the axis error in degrees.
    pub fn rms(&self) -> Estimate {
        self.moments()[1]
    }

    /// Returns the probability of a wrong pole.
    pub fn wrong_pole_probability(&self) -> Estimate {
        binomial_interval(self.wrong_poles, self.trials)
    }

    /// Returns the summary of all added records.
    pub fn summary(&self) -> Summary {
        let axes = self.magnitudes.count();
        let found = self.trials - self.undetermined - self.failed - self.errors_of_simulation;
        let [bias_deg, rms_deg] = self.moments();
        let probability = |count: u64| binomial_interval(count, self.trials);
        let reasons = self.reasons.iter().map(|(reason, count)| {
            (reason.clone(), Occurrence { count: *count, probability: probability(*count) })
        });
        let [p50_deg, p95_deg, p99_deg] = [0.5, 0.95, 0.99].map(|p| quantile(&self.magnitudes, p));
        Summary {
            trials: self.trials,
            found,
            undetermined: self.undetermined,
            failed: self.failed,
            errors: self.errors_of_simulation,
            reasons: reasons.collect(),
            axes,
            rms_deg,
            bias_deg,
            p50_deg,
            p95_deg,
            p99_deg,
            max_deg: self.magnitudes.largest().unwrap_or(f64::NAN),
            beyond_max: binomial_interval(0, axes),
            limit_deg: self.limit_deg,
            beyond_limit: binomial_interval(self.beyond_limit, found),
            wrong_poles: self.wrong_poles,
            wrong_pole_probability: self.wrong_pole_probability(),
            undetermined_probability: probability(self.undetermined),
            failed_probability: probability(self.failed),
            max_moved_deg: self.moved,
            mean_duration_s: self.duration.value() / self.trials as f64,
            peak_current_a: self.peak_current,
            sectors: self.sectors,
        }
    }
}

/// Returns the ranks, counted from 0, of a quantile among `count` sorted values, and of the ends of its
/// distribution-free interval: the order statistics that enclose it with 95 %. If there are too few values, an end is
/// none or beyond the last value.
pub fn quantile_ranks(p: f64, count: u64) -> [Option<u64>; 3] {
    // With n values, as many as Bin(n, p) lie below the quantile.
    let below = |q: f64| binomial::quantile(count, p, q);
    [rank(p, count), below(0.025).checked_sub(1), Some(below(0.975))]
}

/// Returns a quantile with its interval.
fn quantile(values: &Magnitudes, p: f64) -> Estimate {
    let ranks = quantile_ranks(p, values.count());
    let [value, low, high] = values.at(ranks).map(|value| value.unwrap_or(f64::NAN));
    Estimate { value, low, high }
}
