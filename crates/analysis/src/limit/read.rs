//! Parses limits and measures.

use std::str::FromStr;

use standstill_quantity::short;
use standstill_quantity::unit::{Ampere, Degree, Second, Share};
use standstill_scenario::quoted;
use thiserror::Error;

use super::{Limit, Limits, Measure, NAMES, Subject};
use crate::event::bound;

/// Names of all measures, for messages.
const MEASURES: &str =
    "rms, p95, p99, p95_at_instant, P(|e| > 2 deg), wrong_poles, unanswered, moved, duration or peak_current";

/// Error of a text that is not a list of limits.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{text}` {wrong}")]
pub struct LimitError {
    text: String,
    /// End of the error message: the reason, and the texts that are allowed.
    wrong: String,
}

/// Error of a text that is not a measure.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct MeasureError(String);

impl FromStr for Measure {
    type Err = MeasureError;

    fn from_str(text: &str) -> Result<Self, MeasureError> {
        let text = text.trim();
        if let Some((_, measure)) = NAMES.iter().find(|(name, _)| *name == text) {
            return Ok(*measure);
        }
        let inside = text.strip_prefix("P(").and_then(|rest| rest.strip_suffix(')')?.split_once('>'));
        let Some((_, least)) = inside.filter(|(what, _)| what.trim() == "|e|") else {
            let known = NAMES.iter().map(|(name, _)| *name).chain(["P(|e| > X)"]);
            return Err(MeasureError(format!("{} is no measure: needed {MEASURES}", quoted(text, known))));
        };
        bound::<Degree>(least.trim(), 0.0..180.0).map(Self::Beyond).map_err(|found| {
            let needed = "an error from 0 deg to less than 180 deg, such as `P(|e| > 2 deg)`";
            MeasureError(format!("`{text}` is no measure: found {found}, needed {needed}"))
        })
    }
}

/// Allowed bounds of an angle, for messages.
const ANGLES: &str = "an angle above 0 deg, such as `1 deg`";
/// Allowed bounds of a share, for messages.
const SHARES: &str = "a share above 0 % and up to 100 % with its sign, such as `5 %`";
/// Allowed bounds of a time, for messages.
const TIMES: &str = "a time above 0 s, such as `20 ms`";
/// Allowed bounds of a current, for messages.
const CURRENTS: &str = "a current above 0 A, such as `8 A` or `800 mA`";

impl Measure {
    /// Parses a bound of this measure. The error contains the text that was found and the bounds that are allowed.
    fn bound(self, text: &str) -> Result<f64, (String, String)> {
        let least = f64::MIN_POSITIVE;
        let (found, needed) = match self {
            Self::Rms | Self::P95 | Self::P99 | Self::P95AtInstant | Self::Moved => {
                (bound::<Degree>(text, least..), ANGLES)
            }
            Self::Beyond(_) | Self::WrongPoles | Self::Unanswered => {
                (bound::<Share>(text, least..=1.0), SHARES)
            }
            Self::Duration => (bound::<Second>(text, least..), TIMES),
            Self::PeakCurrent => (bound::<Ampere>(text, least..), CURRENTS),
            Self::Distance => (Err(text.to_owned()), "another measure: nobody limits this one"),
        };
        let needed = match text.parse::<f64>() {
            // Odds are written without a sign.
            Ok(share) if needed == SHARES && share > 0.0 && share <= 1.0 => {
                format!("{SHARES}; {text} is `{} %`", short(100.0 * share))
            }
            _ => needed.to_owned(),
        };
        found.map_err(|found| (found, needed))
    }
}

/// Parses limits separated by commas. The function `of` parses the bound of a measure.
fn each<T>(
    text: &str,
    of: impl Fn(Measure, &str) -> Result<T, (String, String)>,
) -> Result<Vec<T>, LimitError> {
    let limit = |part: &str| {
        let error = |text: &str, wrong| LimitError { text: text.trim().to_owned(), wrong };
        if part.trim().is_empty() && text.contains(',') {
            let wrong = "has a comma with no limit before or after it: needed limits joined by single commas, such as \
                         `rms <= 1 deg, wrong_poles <= 5 %`";
            return Err(error(text, wrong.to_owned()));
        }
        let no_limit = |why: String| error(part, format!("is no limit: {why}"));
        let Some((measure, bound)) = part.split_once("<=").or_else(|| part.split_once('≤')) else {
            return Err(no_limit(format!(
                "needed a measure, `<=` and its bound, such as `rms <= 1 deg`, several joined by commas; the measures are \
                 {MEASURES}"
            )));
        };
        let measure = measure.parse().map_err(|wrong: MeasureError| no_limit(wrong.to_string()))?;
        of(measure, bound.trim())
            .map_err(|(found, needed)| no_limit(format!("found {found}, needed {needed}")))
    };
    text.split(',').map(limit).collect()
}

impl FromStr for Limits {
    type Err = LimitError;

    fn from_str(text: &str) -> Result<Self, LimitError> {
        each(text, |measure, bound| Ok(Limit { measure, most: measure.bound(bound)? })).map(Self)
    }
}

impl FromStr for Subject {
    type Err = LimitError;

    fn from_str(text: &str) -> Result<Self, LimitError> {
        let most = |measure: Measure, bound: &str| match bound {
            "start" => Ok((measure, None)),
            _ => Ok((measure, Some(measure.bound(bound)?))),
        };
        each(text, most).map(Self)
    }
}
