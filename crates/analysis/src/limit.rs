//! Limits on what trials show: `rms <= 1 deg, wrong_poles <= 0.1 %`.

pub mod rms;

use std::fmt;
use std::str::FromStr;

use standstill_campaign::{Estimate, binomial_interval};
use standstill_quantity::si_value;
use standstill_scenario::{Record, Verdict as Ending};

use crate::bracket::Verdict;
use crate::event::{amperes, degrees};

/// What is limited. Starts without an answer, undetermined or failed, count against each: as an error of 90°, as an
/// error beyond every bound, as a wrong pole, as a start that moved too far, took too long or drew too much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    /// Root mean square of the axis error in degrees.
    Rms,
    /// 95th percentile of its magnitude.
    P95,
    /// 99th percentile.
    P99,
    /// Probability that the whole error, a wrong pole included, is beyond this many degrees.
    Beyond(f64),
    /// Share of wrong poles.
    WrongPoles,
    /// Share of starts without an answer.
    Undetermined,
    /// The same.
    Failed,
    /// What 99 of 100 starts stay below: movement in electrical degrees.
    Moved,
    /// Likewise, s.
    Duration,
    /// Likewise, A.
    PeakCurrent,
}

/// A measure and what it may be at most: degrees, a share, s or A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// What.
    pub measure: Measure,
    /// At most.
    pub most: f64,
}

/// Limits that must all hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits(pub Vec<Limit>);

/// A text that is no limit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LimitError {
    text: String,
    /// The bound, where a share is needed.
    share: Option<String>,
}

impl fmt::Display for LimitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(found) = &self.share {
            let needed = "a share above 0 % and up to 100 % with its sign, such as `5 %`";
            return write!(f, "`{}` is no limit: found `{found}`, needed {needed}", self.text);
        }
        write!(
            f,
            "`{}` is no limit: needed `rms <= 1 deg`, p95, p99 or moved in degrees, `P(|e| > 2 deg) <= 1 %`, wrong_poles, \
             undetermined or failed in per cent, `duration <= 20 ms`, `peak_current <= 8 A`, joined by commas",
            self.text
        )
    }
}

impl std::error::Error for LimitError {}

/// A text that is no measure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeasureError(String);

impl fmt::Display for MeasureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "`{}` is no measure: needed rms, p95, p99, P(|e| > 2 deg), wrong_poles, undetermined, failed, moved, duration or \
             peak_current",
            self.0
        )
    }
}

impl std::error::Error for MeasureError {}

impl FromStr for Measure {
    type Err = MeasureError;

    fn from_str(text: &str) -> Result<Self, MeasureError> {
        Self::named(text.trim()).ok_or_else(|| MeasureError(text.trim().to_owned()))
    }
}

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rms => "rms",
            Self::P95 => "p95",
            Self::P99 => "p99",
            Self::Beyond(bound) => return write!(f, "P(|e| > {bound} deg)"),
            Self::WrongPoles => "wrong_poles",
            Self::Undetermined => "undetermined",
            Self::Failed => "failed",
            Self::Moved => "moved",
            Self::Duration => "duration",
            Self::PeakCurrent => "peak_current",
        })
    }
}

impl Measure {
    /// Symbol of the unit of its values; of shares none.
    pub const fn unit(self) -> Option<&'static str> {
        match self {
            Self::Rms | Self::P95 | Self::P99 | Self::Moved => Some("deg"),
            Self::Beyond(_) | Self::WrongPoles | Self::Undetermined | Self::Failed => None,
            Self::Duration => Some("s"),
            Self::PeakCurrent => Some("A"),
        }
    }

    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "rms" => Self::Rms,
            "p95" => Self::P95,
            "p99" => Self::P99,
            "wrong_poles" => Self::WrongPoles,
            "undetermined" => Self::Undetermined,
            "failed" => Self::Failed,
            "moved" => Self::Moved,
            "duration" => Self::Duration,
            "peak_current" => Self::PeakCurrent,
            _ => {
                let inside = name.strip_prefix("P(")?.strip_suffix(')')?;
                let (error, bound) = inside.split_once('>')?;
                let bound = degrees(bound.trim()).filter(|bound| (0.0..180.0).contains(bound))?;
                (error.trim() == "|e|").then_some(Self::Beyond(bound))?
            }
        })
    }

    fn value(self, text: &str) -> Option<f64> {
        let value = match self {
            Self::Rms | Self::P95 | Self::P99 | Self::Moved => degrees(text)?,
            Self::Beyond(_) | Self::WrongPoles | Self::Undetermined | Self::Failed => share(text)?,
            Self::Duration => seconds(text)?,
            Self::PeakCurrent => amperes(text)?,
        };
        (value > 0.0 && value.is_finite()).then_some(value)
    }

    /// What a start contributes.
    fn of(self, record: &Record) -> f64 {
        let answered = record.verdict() == Ending::Found;
        let flag = |is: bool| f64::from(u8::from(is || !answered));
        let unless = |value: f64| if answered { value } else { f64::INFINITY };
        match self {
            // Without an answer infinite: see `rms`.
            Self::Rms => unless(record.axis_error_deg().unwrap_or(f64::INFINITY)),
            Self::P95 | Self::P99 => unless(record.axis_error_deg().map_or(f64::INFINITY, f64::abs)),
            Self::Beyond(bound) => flag(record.error_deg().is_none_or(|error| error.abs() > bound)),
            Self::WrongPoles => flag(record.pole_correct() == Some(false)),
            Self::Undetermined | Self::Failed => flag(false),
            Self::Moved => unless(record.rotor_moved_deg()),
            Self::Duration => unless(record.run.duration.seconds()),
            Self::PeakCurrent => unless(record.run.peak_current),
        }
    }

    /// The same as a search sees it, which compares settings on the same random numbers: the interval of a root mean square
    /// is that of the errors seen, and leaves out starts without an answer that may be and were not seen.
    pub(crate) fn seen(self, values: Vec<f64>) -> Estimate {
        if self == Self::Rms { rms::seen(&values) } else { self.estimate(values) }
    }

    /// The measure over starts with its 95 % interval.
    pub(crate) fn estimate(self, mut values: Vec<f64>) -> Estimate {
        match self {
            Self::Rms => rms::rms(&values),
            Self::P95 => quantile(&mut values, 0.95),
            Self::P99 | Self::Moved | Self::Duration | Self::PeakCurrent => quantile(&mut values, 0.99),
            Self::Beyond(_) | Self::WrongPoles | Self::Undetermined | Self::Failed => {
                let count = values.iter().filter(|value| **value > 0.0).count();
                binomial_interval(count as u64, values.len() as u64)
            }
        }
    }
}

/// A quantile between order statistics, whose ranks are binomial.
fn quantile(values: &mut [f64], share: f64) -> Estimate {
    values.sort_by(f64::total_cmp);
    let count = values.len() as f64;
    let spread = 1.96 * (count * share * (1.0 - share)).sqrt();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below their number")]
    let at = |rank: f64| {
        let place = rank.ceil().max(1.0) as usize - 1;
        values.get(place).copied().unwrap_or(f64::INFINITY)
    };
    let middle = count * share;
    Estimate { value: at(middle), low: at(middle - spread), high: at(middle + spread + 1.0) }
}

/// A share in per cent. A number without its sign may be meant either way, so it is none.
fn share(text: &str) -> Option<f64> {
    let percent: f64 = text.strip_suffix('%')?.trim().parse().ok()?;
    (percent <= 100.0).then_some(percent / 100.0)
}

fn seconds(text: &str) -> Option<f64> {
    text.parse().ok().or_else(|| si_value(text).filter(|_| text.ends_with('s')))
}

impl Limits {
    /// Trials that it takes at least to see that they hold: of n trials without a case, up to 3.7/n may be one.
    pub fn least_trials(&self) -> u64 {
        let share = |limit: &Limit| match limit.measure {
            Measure::Rms => rms::share_of(limit.most),
            measure if measure.unit().is_none() => limit.most,
            _ => 1.0,
        };
        let least = self.0.iter().map(share).fold(1.0, f64::min);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "above zero; saturates")]
        let trials = (-standstill_numeric::ln(0.025) / least) as u64;
        trials
    }
}

impl FromStr for Limits {
    type Err = LimitError;

    fn from_str(text: &str) -> Result<Self, LimitError> {
        let most = |measure: Measure, bound: &str| Some(Limit { measure, most: measure.value(bound)? });
        each(text, most).map(Self)
    }
}

/// Limits joined by commas, each as `of` reads its measure and the text of its bound.
fn each<T>(text: &str, of: impl Fn(Measure, &str) -> Option<T>) -> Result<Vec<T>, LimitError> {
    let limit = |part: &str| {
        let error = |share: Option<&str>| LimitError {
            text: part.trim().to_owned(),
            share: share.map(str::to_owned),
        };
        let (measure, bound) = halves(part).ok_or_else(|| error(None))?;
        of(measure, bound).ok_or_else(|| error(Some(bound).filter(|_| measure.unit().is_none())))
    };
    text.split(',').map(limit).collect()
}

/// A limit's measure and the text of its bound.
fn halves(part: &str) -> Option<(Measure, &str)> {
    let (name, bound) = part.split_once("<=").or_else(|| part.split_once('≤'))?;
    Some((Measure::named(name.trim())?, bound.trim()))
}

/// Limits of which some are what the settings that one starts from reach: `moved <= start, undetermined <= 0.1 %`.
#[derive(Clone, Debug, PartialEq)]
pub struct Subject(pub Vec<(Measure, Option<f64>)>);

impl FromStr for Subject {
    type Err = LimitError;

    fn from_str(text: &str) -> Result<Self, LimitError> {
        let most = |measure: Measure, bound: &str| match bound {
            "start" => Some((measure, None)),
            _ => Some((measure, Some(measure.value(bound)?))),
        };
        each(text, most).map(Self)
    }
}

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
            (Some(most), None) => write!(f, "{measure} <= {} %", 100.0 * most),
        }?;
    }
    Ok(())
}

/// What starts contribute to each limit.
#[derive(Clone, Debug)]
pub struct Tally {
    limits: Limits,
    values: Vec<Vec<f64>>,
}

impl Tally {
    /// Of no start yet.
    pub fn new(limits: &Limits) -> Self {
        Self { limits: limits.clone(), values: vec![Vec::new(); limits.0.len()] }
    }

    /// With what starts contributed, limit by limit.
    pub(crate) fn of(limits: &Limits, values: Vec<Vec<f64>>) -> Self {
        Self { limits: limits.clone(), values }
    }

    /// A start.
    pub fn add(&mut self, record: &Record) {
        for (values, limit) in self.values.iter_mut().zip(&self.limits.0) {
            values.push(limit.measure.of(record));
        }
    }

    /// The same of the tally's own.
    pub(crate) fn into_values(self) -> Vec<Vec<f64>> {
        self.values
    }

    /// What each start contributed to each limit, in their order.
    pub fn values(&self) -> &[Vec<f64>] {
        &self.values
    }

    /// The measures.
    pub fn estimates(&self) -> Vec<Estimate> {
        let both = self.limits.0.iter().zip(&self.values);
        both.map(|(limit, values)| limit.measure.estimate(values.clone())).collect()
    }

    /// The measures as a search sees them.
    pub(crate) fn seen(&self) -> Vec<Estimate> {
        let both = self.limits.0.iter().zip(&self.values);
        both.map(|(limit, values)| limit.measure.seen(values.clone())).collect()
    }

    /// The share of starts without an answer, where the root mean square is limited: they count in it as 90°.
    pub fn without_answer(&self) -> Option<Estimate> {
        let number = self.limits.0.iter().position(|limit| limit.measure == Measure::Rms)?;
        Some(rms::without_answer(&self.values[number]))
    }

    /// Whether all limits hold.
    pub fn verdict(&self) -> Verdict {
        let estimates = self.estimates();
        let all = |of: fn(&Estimate) -> f64| {
            self.limits.0.iter().zip(&estimates).all(|(limit, estimate)| of(estimate) <= limit.most)
        };
        Verdict { holds: all(|e| e.value), surely: all(|e| e.high), possibly: all(|e| e.low) }
    }
}

#[cfg(test)]
mod tests;
