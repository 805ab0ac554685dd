//! Limits on measures of trials: `rms <= 1 deg, wrong_poles <= 0.1 %`.

mod read;
pub mod rms;

use std::fmt;

use standstill_campaign::{Estimate, binomial_interval, quantile_ranks};
use standstill_numeric::{ln, whole};
use standstill_quantity::rounded;
use standstill_scenario::{Record, Verdict as Ending};

pub use self::read::{LimitError, MeasureError};
use crate::bracket::{Look, forecast_trials};

/// A measure that can be limited. Simulated motor starts without an answer (undetermined or failed) count against every measure. They count
/// as an axis error of 90° in the rms, as an error beyond every bound, as a wrong pole, and as infinite movement, duration and current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    /// Root mean square of the axis error in degrees. If answers are sectors, all error measures count the error from the sector's border.
    Rms,
    /// 95th percentile of the magnitude of the axis error in degrees.
    P95,
    /// 99th percentile of the magnitude of the axis error in degrees.
    P99,
    /// 95th percentile of the magnitude of the axis error in degrees at the instant for which the angle holds. Infinite for a start whose
    /// detector does not state the instant.
    P95AtInstant,
    /// Probability that the error of the angle exceeds this bound in degrees. A wrong pole counts as an error of the angle.
    Beyond(f64),
    /// Share of starts with a wrong pole.
    WrongPoles,
    /// Share of starts without an answer, which are undetermined or failed.
    Unanswered,
    /// 99th percentile of the rotor's movement in electrical degrees.
    Moved,
    /// 99th percentile of the duration of a detection in s.
    Duration,
    /// 99th percentile of the peak phase current in A.
    PeakCurrent,
    /// Mean distance of the starts from an answer. Only the search of `tune` uses this measure.
    Distance,
}

/// A measure and its largest allowed value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// The measure.
    pub measure: Measure,
    /// Largest allowed value in the unit of the measure, which is degrees, s, A, or none for a share.
    pub most: f64,
}

/// Limits that must all hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits(pub Vec<Limit>);

/// Names of the measures that need no number. The first name of a measure is the one that is written. The names `undetermined` and `failed`
/// come from earlier versions.
const NAMES: [(&str, Measure); 11] = [
    ("rms", Measure::Rms),
    ("p95", Measure::P95),
    ("p99", Measure::P99),
    ("p95_at_instant", Measure::P95AtInstant),
    ("wrong_poles", Measure::WrongPoles),
    ("unanswered", Measure::Unanswered),
    ("undetermined", Measure::Unanswered),
    ("failed", Measure::Unanswered),
    ("moved", Measure::Moved),
    ("duration", Measure::Duration),
    ("peak_current", Measure::PeakCurrent),
];

/// Largest distance from an answer ([`distance`]) for a start with an axis but no pole. For a start without an axis, the distance is
/// larger.
const FAR: f64 = 10.0;

/// Returns a start's distance from an answer. It is the logarithm of the factor by which the start's evidence falls short, and 0 for a
/// start with an answer. For a start with an axis, the evidence is that for the pole. For a start without an axis, it is the quantity that
/// the failed check requires, such as the spread of the inductances over the angle.
fn distance(record: &Record) -> f64 {
    let lacks = |factor: f64| if factor.is_nan() { FAR } else { ln(factor).clamp(0.0, FAR) };
    let findings = record.findings();
    match record.verdict() {
        Ending::Found => 0.0,
        Ending::Undetermined => {
            findings.pole_evidence.map_or(FAR, |of| lacks(of.needed / of.deviations.abs()))
        }
        Ending::Failed | Ending::Error => {
            FAR + findings.fault_margin.map_or(FAR, |margin| lacks((1.0 + margin.min(0.0)).recip()))
        }
    }
}

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self, NAMES.iter().find(|(_, measure)| measure == self)) {
            (Self::Beyond(bound), _) => write!(f, "P(|e| > {bound} deg)"),
            (Self::Distance, _) => f.write_str("distance"),
            (_, name) => f.write_str(name.map_or("", |(name, _)| name)),
        }
    }
}

impl Measure {
    /// Returns the symbol of the measure's unit. None for measures without a unit, such as shares.
    pub const fn unit(self) -> Option<&'static str> {
        match self {
            Self::Rms | Self::P95 | Self::P99 | Self::P95AtInstant | Self::Moved => Some("deg"),
            Self::Beyond(_) | Self::WrongPoles | Self::Unanswered | Self::Distance => None,
            Self::Duration => Some("s"),
            Self::PeakCurrent => Some("A"),
        }
    }

    /// Returns the contribution of a start to the measure, in the measure's unit. For a share it is 0 or 1. For a start without an answer
    /// it is infinite, except for the distance.
    fn of(self, record: &Record) -> f64 {
        let answered = record.verdict() == Ending::Found;
        // Whatever is measured: infinite without an answer.
        let unless = |value: f64| if answered { value } else { f64::INFINITY };
        let flag = |is: bool| unless(f64::from(u8::from(is)));
        match self {
            Self::Rms => unless(record.axis_miss_deg().unwrap_or(f64::INFINITY)),
            Self::P95 | Self::P99 => unless(record.axis_miss_deg().map_or(f64::INFINITY, f64::abs)),
            Self::P95AtInstant => unless(record.axis_miss_at_instant_deg().map_or(f64::INFINITY, f64::abs)),
            Self::Beyond(bound) => flag(record.miss_deg().is_none_or(|error| error.abs() > bound)),
            Self::WrongPoles => flag(record.pole_correct() == Some(false)),
            Self::Unanswered => flag(false),
            Self::Moved => unless(record.rotor_moved_deg()),
            Self::Duration => unless(record.run.duration.seconds()),
            Self::PeakCurrent => unless(record.run.peak_current),
            Self::Distance => distance(record),
        }
    }

    /// Estimates the measure from the contributions of the starts, for a search that compares settings on common random numbers. The
    /// interval of a root mean square then covers only the observed errors. It does not cover starts without an answer that are possible
    /// but were not observed.
    pub(crate) fn seen(self, values: Vec<f64>) -> Estimate {
        if self == Self::Rms { rms::seen(&values) } else { self.estimate(values) }
    }

    /// Estimates the measure from the contributions of the starts, with its 95 % interval.
    pub(crate) fn estimate(self, values: Vec<f64>) -> Estimate {
        let count = values.len() as f64;
        self.estimates(values, &[count])[0]
    }

    /// Estimates the measure from the contributions of the starts. Returns one estimate for each number in `trials`, with the 95 % interval
    /// that it would have after this number of similar trials.
    fn estimates(self, mut values: Vec<f64>, trials: &[f64]) -> Vec<Estimate> {
        let mut quantiles = |share: f64| {
            values.sort_by(f64::total_cmp);
            trials.iter().map(|trials| quantile(&values, share, *trials)).collect()
        };
        match self {
            Self::Rms => {
                let seen = rms::Seen::of(&values);
                trials.iter().map(|trials| seen.rms(*trials)).collect()
            }
            Self::P95 | Self::P95AtInstant => quantiles(0.95),
            Self::P99 | Self::Moved | Self::Duration | Self::PeakCurrent => quantiles(0.99),
            Self::Distance => {
                let value = values.iter().sum::<f64>() / values.len() as f64;
                vec![Estimate { value, low: value, high: value }; trials.len()]
            }
            Self::Beyond(_) | Self::WrongPoles | Self::Unanswered => {
                let count = values.iter().filter(|value| **value > 0.0).count();
                trials.iter().map(|trials| share(count, values.len(), *trials)).collect()
            }
        }
    }

    /// Computes the measure from the starts with an answer only. `values` are the contributions of all starts. All starts count if none of
    /// them has an answer, or if the measure is the share of starts without an answer.
    fn answered(self, values: &[f64]) -> f64 {
        let answered: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        if answered.is_empty() || self == Self::Unanswered {
            return self.estimate(values.to_vec()).value;
        }
        self.estimate(answered).value
    }
}

/// Returns the share `count / all` with the exact 95 % interval that it would have after `trials` similar trials.
fn share(count: usize, all: usize, trials: f64) -> Estimate {
    let value = count as f64 / all as f64;
    let found = binomial_interval(whole((value * trials).round()), whole(trials.round()));
    Estimate { value, low: found.low.min(value), high: found.high.max(value) }
}

/// Returns the quantile of sorted non-negative values, with the 95 % interval that it would have after `trials` similar trials. `share`
/// selects the quantile, such as 0.95.
fn quantile(values: &[f64], share: f64, trials: f64) -> Estimate {
    let count = values.len() as f64;
    let [value, ..] = quantile_ranks(share, values.len() as u64);
    let [_, low, high] = quantile_ranks(share, whole(trials.round()));
    let at = |rank: u64| usize::try_from(rank).ok().and_then(|rank| values.get(rank).copied());
    // Converts a rank among `trials` values to the rank with the same share among the values given.
    let here = |rank: u64| whole((rank as f64 + 0.5) * count / trials);
    let end = |rank: Option<u64>| rank.map(here).and_then(at);
    Estimate {
        value: value.and_then(at).unwrap_or(f64::INFINITY),
        low: end(low).unwrap_or(0.0),
        high: end(high).unwrap_or(f64::INFINITY),
    }
}

impl Limits {
    /// Returns the limits with one more: an infinite limit on another measure, so that this measure is computed too.
    pub(crate) fn and(&self, measure: Measure) -> Self {
        let more = Limit { measure, most: f64::INFINITY };
        Self(self.0.iter().copied().chain([more]).collect())
    }

    /// Returns the least number of trials that can show that the limits hold. If an event is not observed in n trials, the share of this
    /// event may still be up to 3.7/n.
    pub fn least_trials(&self) -> u64 {
        let share = |limit: &Limit| match limit.measure {
            Measure::Rms => rms::share_of(limit.most),
            measure if measure.unit().is_none() => limit.most,
            _ => 1.0,
        };
        let least = self.0.iter().map(share).fold(1.0, f64::min);
        whole(-standstill_numeric::ln(0.025) / least)
    }
}

/// Limits of which some may be relative, such as `moved <= start, unanswered <= 0.1 %`. Each entry has the measure and its largest allowed
/// value in the measure's unit. A relative limit has no value: its limit is the measure at the initial settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Subject(pub Vec<(Measure, Option<f64>)>);

impl fmt::Display for Limits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        joined(f, self.0.iter().map(|limit| (limit.measure, Some(limit.most))))
    }
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        joined(f, self.0.iter().copied())
    }
}

fn joined(f: &mut fmt::Formatter<'_>, limits: impl Iterator<Item = (Measure, Option<f64>)>) -> fmt::Result {
    for (k, (measure, most)) in limits.enumerate() {
        f.write_str(if k > 0 { ", " } else { "" })?;
        match (most, measure.unit()) {
            (None, _) => write!(f, "{measure} <= start"),
            (Some(most), Some(unit)) => write!(f, "{measure} <= {most} {unit}"),
            (Some(most), None) => write!(f, "{measure} <= {} %", rounded(most, 2)),
        }?;
    }
    Ok(())
}

/// Contributions of the starts to each of several limited measures. For an rms, a start contributes its error; for a share, it contributes
/// 0 or 1.
#[derive(Clone, Debug)]
pub struct Tally {
    limits: Limits,
    values: Vec<Vec<f64>>,
}

impl Tally {
    /// Makes a tally that has no starts yet.
    pub fn new(limits: &Limits) -> Self {
        Self { limits: limits.clone(), values: vec![Vec::new(); limits.0.len()] }
    }

    /// Makes a tally from contributions of starts. `values` has one list for each limit.
    pub(crate) fn of(limits: &Limits, values: Vec<Vec<f64>>) -> Self {
        Self { limits: limits.clone(), values }
    }

    /// Adds the contributions of a start.
    pub fn add(&mut self, record: &Record) {
        for (values, limit) in self.values.iter_mut().zip(&self.limits.0) {
            values.push(limit.measure.of(record));
        }
    }

    /// Returns the contributions as one list for each limit.
    pub(crate) fn into_values(self) -> Vec<Vec<f64>> {
        self.values
    }

    /// Returns the contributions as one list for each limit. A list has one number for each start, in the unit of the measure.
    pub fn values(&self) -> &[Vec<f64>] {
        &self.values
    }

    /// Returns an estimate of each limited measure in the measure's unit, with its 95 % interval.
    pub fn estimates(&self) -> Vec<Estimate> {
        let both = self.limits.0.iter().zip(&self.values);
        both.map(|(limit, values)| limit.measure.estimate(values.clone())).collect()
    }

    /// Returns an estimate of each limited measure, as a search compares them (`Measure::seen`).
    pub(crate) fn seen(&self) -> Vec<Estimate> {
        let both = self.limits.0.iter().zip(&self.values);
        both.map(|(limit, values)| limit.measure.seen(values.clone())).collect()
    }

    /// Returns the number of starts.
    pub fn count(&self) -> u64 {
        self.values.first().map_or(0, |values| values.len() as u64)
    }

    /// Adds the contributions of further starts. `further` has one list for each limit.
    pub(crate) fn extend(&mut self, further: Vec<Vec<f64>>) {
        for (values, more) in self.values.iter_mut().zip(further) {
            values.extend(more);
        }
    }

    /// Returns the ratio of each measure to its limit, with forecasts for more trials. The result counts as clear if a quarter of the
    /// trials would already show it surely, although intervals are then twice as wide. If the trials stop at a clear result, that result is
    /// rarely wrong.
    pub fn look(&self) -> Look {
        let count = self.count() as f64;
        let then: Vec<f64> =
            [count, count / 4.0].into_iter().chain(forecast_trials().map(|n| n as f64)).collect();
        let both = || self.limits.0.iter().zip(&self.values);
        let all: Vec<Vec<Estimate>> = both()
            .map(|(limit, values)| {
                let share = |estimate: Estimate| estimate.map(|x| x / limit.most);
                limit.measure.estimates(values.clone(), &then).into_iter().map(share).collect()
            })
            .collect();
        let worst =
            |k: usize, of: fn(&Estimate) -> f64| all.iter().map(|then| of(&then[k])).fold(0.0, f64::max);
        let [low, high] = [worst(1, |e| e.low), worst(1, |e| e.high)];
        Look {
            trials: self.count(),
            shares: all.iter().map(|then| then[0]).collect(),
            answered: both().map(|(limit, values)| limit.measure.answered(values) / limit.most).collect(),
            forecast: (2..then.len()).map(|k| [worst(k, |e| e.low), worst(k, |e| e.high)]).collect(),
            clear: if low > 1.0 { Some(false) } else { (high <= 1.0).then_some(true) },
        }
    }

    /// Returns the share of starts without an answer if the root mean square is limited, else none. In the root mean square, each start
    /// without an answer counts as 90°.
    pub fn without_answer(&self) -> Option<Estimate> {
        let number = self.limits.0.iter().position(|limit| limit.measure == Measure::Rms)?;
        Some(rms::without_answer(&self.values[number]))
    }
}

#[cfg(test)]
mod tests;
