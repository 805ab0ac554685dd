//! Events that a start may end with, and the order parameter of each: the quantity that shows how near a start is to the event.

use std::fmt;
use std::ops::RangeBounds;
use std::str::FromStr;

use standstill_interface::{Angle, Outcome, PoleEvidence};
use standstill_quantity::unit::{Ampere, Degree};
use standstill_quantity::{Quantity, Unit, split};
use standstill_scenario::{Record, Verdict, nearest};
use standstill_sim::Ended;
use thiserror::Error;

/// A possible outcome of a simulated motor start. Its probability can be computed. Angles are in degrees, currents in A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// The detector found the wrong pole.
    WrongPole,
    /// The readings favour the wrong pole. Their evidence need not suffice for a decision.
    WrongEvidence,
    /// The axis error exceeds this bound in degrees. If the answer is a sector, the error is measured from the sector's border. Starts
    /// without an axis count neither as this event nor as `undetermined`.
    Error(f64),
    /// The detector found an axis, but could not decide on the pole.
    Undetermined,
    /// The detector gave up and found no angle.
    Failed,
    /// The rotor moved away from its initial angle by more than this many electrical degrees.
    Moved(f64),
    /// A phase current exceeded this value in A.
    PeakCurrent(f64),
}

/// Error of a text that does not name an event.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{text}` is no event{wrong}")]
pub struct EventError {
    text: String,
    /// End of the error message: the reason, and the texts that are allowed.
    wrong: String,
}

/// Names of the events that have no bound.
const NAMES: [(&str, Event); 4] = [
    ("wrong-pole", Event::WrongPole),
    ("wrong-evidence", Event::WrongEvidence),
    ("undetermined", Event::Undetermined),
    ("failed", Event::Failed),
];
/// Names of the quantities that define an event together with a bound.
const QUANTITIES: [&str; 3] = ["|e|", "moved", "peak_current"];

impl FromStr for Event {
    type Err = EventError;

    fn from_str(text: &str) -> Result<Self, EventError> {
        let text = text.trim();
        let error = |wrong| EventError { text: text.to_owned(), wrong };
        let unknown = |what: &str| {
            let near = nearest(what, NAMES.iter().map(|(name, _)| *name).chain(QUANTITIES));
            let near = near.map_or_else(String::new, |near| format!(" (did you mean `{near}`?)"));
            error(format!(
                "{near}: needed wrong-pole, wrong-evidence, undetermined, failed, `|e| > 3 deg`, `moved > 1 deg` or \
                 `peak_current > 8 A`"
            ))
        };
        if let Some((_, event)) = NAMES.iter().find(|(name, _)| *name == text) {
            return Ok(*event);
        }
        let (what, most) = text.split_once('>').ok_or_else(|| unknown(text))?;
        let most = most.trim();
        let (value, needed) = match what.trim() {
            "|e|" => (bound::<Degree>(most, 0.0..90.0).map(Self::Error), ERRORS),
            "moved" => (bound::<Degree>(most, 0.0..MOST).map(Self::Moved), MOVEMENTS),
            "peak_current" => (bound::<Ampere>(most, 0.0..MOST).map(Self::PeakCurrent), CURRENTS),
            what => return Err(unknown(what)),
        };
        value.map_err(|found| error(format!(": found {found}, needed {needed}")))
    }
}

/// Largest bound allowed for movement and current. Real values never reach it.
const MOST: f64 = 1e6;

/// Allowed bounds of each quantity, for messages.
const ERRORS: &str =
    "an error of the axis from 0 deg to less than 90 deg, which is the largest there is, such as `3 deg`";
const MOVEMENTS: &str = "an electrical angle from 0 deg to less than 1000000 deg, such as `1 deg`";
const CURRENTS: &str = "a current from 0 A to less than 1000000 A, such as `8 A` or `800 mA`";

/// Parses a bound with its unit. The error contains the text that was found instead, as messages quote it.
pub(crate) fn bound<U: Unit>(text: &str, allowed: impl RangeBounds<f64>) -> Result<f64, String> {
    let bare = split(text).1.is_empty();
    let value = text.parse::<Quantity<U>>().ok().map(Quantity::value);
    match value.filter(|value| !bare && allowed.contains(value)) {
        Some(value) => Ok(value),
        None if bare && value.is_some() && !U::SYMBOL.is_empty() => Err(format!("`{text}` without a unit")),
        None => Err(format!("`{text}`")),
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Error(bound) => write!(f, "|e| > {bound} deg"),
            Self::Moved(bound) => write!(f, "moved > {bound} deg"),
            Self::PeakCurrent(bound) => write!(f, "peak_current > {bound} A"),
            _ => f.write_str(NAMES.iter().find(|(_, event)| event == self).map_or("", |(name, _)| name)),
        }
    }
}

/// Largest value of [`Event::value`] for a start in which the event did not happen.
const OUTSIDE: f64 = 0.0;
/// Smallest value of [`Event::value`] for a start in which the event happened.
const INSIDE: f64 = f64::MIN_POSITIVE;

impl Event {
    /// Returns the name of the order parameter. This quantity rises as a start comes nearer to the event. `in_sectors` is true if answers
    /// are sectors.
    pub const fn order_parameter(self, in_sectors: bool) -> &'static str {
        match self {
            Self::WrongPole => {
                "evidence for the wrong pole less what a decision needs, in standard deviations"
            }
            Self::WrongEvidence => "evidence for the wrong pole, in standard deviations",
            Self::Error(_) if in_sectors => {
                "the axis error from the border of the sector named, negative inside it, in degrees"
            }
            Self::Error(_) => "the axis error, in degrees",
            Self::Undetermined => "what a decision needs less the evidence found, in standard deviations",
            Self::Failed => {
                "the nearest fault check's margin with its sign turned: 1 less the factor to its limit"
            }
            Self::Moved(_) => "the movement, in degrees",
            Self::PeakCurrent(_) => "the largest phase current, in A",
        }
    }

    /// Returns true if the event is about poles. It cannot happen to a motor without a magnet, which has no poles.
    ///
    /// ```
    /// use standstill_analysis::Event;
    ///
    /// assert!(Event::WrongPole.is_of_poles() && !Event::Error(3.0).is_of_poles());
    /// ```
    pub const fn is_of_poles(self) -> bool {
        matches!(self, Self::WrongPole | Self::WrongEvidence | Self::Undetermined)
    }

    /// Returns the bound that the order parameter must exceed, in the unit of the order parameter.
    pub const fn bound(self) -> f64 {
        match self {
            Self::Error(bound) | Self::Moved(bound) | Self::PeakCurrent(bound) => bound,
            Self::WrongPole | Self::WrongEvidence | Self::Undetermined | Self::Failed => 0.0,
        }
    }

    /// Returns the order parameter minus its bound. The value is above zero if the event happened, and zero or negative if it did not. A
    /// more negative value means that the start was further from the event. Minus infinity if nothing shows the distance.
    pub fn value(self, record: &Record) -> f64 {
        let Ended::Outcome(outcome) = record.run.ended else { return f64::NEG_INFINITY };
        let run = &record.run;
        let value = match self {
            Self::WrongPole => {
                let happened = record.pole_correct() == Some(false);
                beyond(happened, evidence(&outcome, run.end_angle).map(|(wrong, needed)| wrong - needed))
            }
            Self::WrongEvidence => {
                evidence(&outcome, run.end_angle).map_or(f64::NEG_INFINITY, |(wrong, _)| wrong)
            }
            Self::Error(bound) => beyond_sector(record).map_or(f64::NEG_INFINITY, |error| error - bound),
            Self::Undetermined => {
                let happened = record.verdict() == Verdict::Undetermined;
                let found = evidence(&outcome, run.end_angle);
                beyond(happened, found.map(|(wrong, needed)| needed - wrong.abs()))
            }
            Self::Failed => beyond(
                record.verdict() == Verdict::Failed,
                record.findings().fault_margin.map(|margin| -margin),
            ),
            Self::Moved(bound) => run.moved.to_degrees() - bound,
            Self::PeakCurrent(bound) => run.peak_current - bound,
        };
        if value.is_nan() { f64::NEG_INFINITY } else { value }
    }
}

/// Returns the magnitude of the axis error in degrees. If the answer is a sector, half the width of the sector is subtracted: the value is
/// then negative inside the sector and rises towards its border.
fn beyond_sector(record: &Record) -> Option<f64> {
    Some(record.axis_error_deg()?.abs() - record.half_sector_deg().unwrap_or(0.0))
}

/// Makes the sign of `distance` agree with the outcome. Returns a value above zero if the event happened, and zero or less if it did not.
/// The value is infinite if the distance is unknown.
fn beyond(happened: bool, distance: Option<f64>) -> f64 {
    match (happened, distance) {
        (true, distance) => distance.unwrap_or(f64::INFINITY).max(INSIDE),
        (false, distance) => distance.unwrap_or(f64::NEG_INFINITY).min(OUTSIDE),
    }
}

/// Returns the evidence for the wrong pole and the evidence that a decision needs, both in standard deviations. None if the method reports
/// no evidence. `north` is the true angle of the magnet's north pole in rad.
pub(crate) fn evidence(outcome: &Outcome<f64>, north: f64) -> Option<(f64, f64)> {
    let right = outcome.evidence_for(Angle::from_radians(north))?;
    let PoleEvidence { needed, .. } = outcome.findings().pole_evidence?;
    Some((-right, needed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_events_are_read_as_they_are_written() {
        for text in [
            "wrong-pole",
            "wrong-evidence",
            "undetermined",
            "failed",
            "|e| > 3.4 deg",
            "moved > 1 deg",
            "peak_current > 8.5 A",
        ] {
            let event: Event = text.parse().expect("an event");
            assert_eq!(event.to_string(), text);
        }
        assert_eq!("|e|>3°".parse(), Ok(Event::Error(3.0)));
        assert_eq!("peak_current > 800 mA".parse(), Ok(Event::PeakCurrent(0.8)));
    }

    #[test]
    fn regress_what_is_no_event_names_those_that_are() {
        for text in ["wrongpole", "moved", "current > 8 A", "|e| < 3", ""] {
            let message = text.parse::<Event>().expect_err("no event").to_string();
            assert!(
                message.contains(&format!("`{text}`")) && message.contains("wrong-evidence"),
                "{message}"
            );
        }
        for (text, near) in [
            ("wrongpole", "wrong-pole"),
            ("wrong_poles", "wrong-pole"),
            ("current > 8 A", "peak_current"),
            ("move > 1 deg", "moved"),
        ] {
            let message = text.parse::<Event>().expect_err("no event").to_string();
            assert!(message.contains(&format!("did you mean `{near}`?")), "{message}");
        }
        assert!(!"luck".parse::<Event>().expect_err("no event").to_string().contains("did you mean"));
    }

    #[test]
    fn regress_a_bound_that_cannot_be_names_those_that_can() {
        for (text, found, needed) in [
            ("|e| > 200 deg", "200 deg", "from 0 deg to less than 90 deg"),
            ("|e| > 90 deg", "90 deg", "from 0 deg to less than 90 deg"),
            ("|e| > -1 deg", "-1 deg", "from 0 deg to less than 90 deg"),
            ("|e| > 3 mm", "3 mm", "such as `3 deg`"),
            ("|e| > nan", "nan", "from 0 deg"),
            ("moved > -5 deg", "-5 deg", "an electrical angle from 0 deg"),
            ("moved >", "", "an electrical angle from 0 deg"),
            ("peak_current > 8 V", "8 V", "a current from 0 A"),
        ] {
            let message = text.parse::<Event>().expect_err("no event").to_string();
            assert!(message.contains(&format!("`{text}` is no event: found `{found}`")), "{message}");
            assert!(message.contains(needed), "{message}");
        }
        for (text, found) in [("|e| > 3", "3"), ("moved > 0.1", "0.1"), ("peak_current > 8", "8")] {
            let message = text.parse::<Event>().expect_err("no event").to_string();
            assert!(message.contains(&format!("found `{found}` without a unit, needed a")), "{message}");
        }
        assert_eq!("|e| > 89.9 deg".parse(), Ok(Event::Error(89.9)));
    }

    #[test]
    fn law_a_distance_never_contradicts_what_happened() {
        for distance in [None, Some(-2.0), Some(0.0), Some(3.0), Some(f64::INFINITY)] {
            assert!(beyond(true, distance) > 0.0);
            assert!(beyond(false, distance) <= 0.0);
        }
    }
}
