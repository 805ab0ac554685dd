//! Demands of requirements: `rms <= 1 deg`, `P(wrong_pole) <= 1e-6`, `faults.phase-open: coverage >= 99 %`.

use std::fmt;

use standstill_interface::Choice as _;
use standstill_quantity::unit::{Ampere, Degree, Second, Share};
use standstill_quantity::{Quantity, rounded};
use standstill_scenario::{FaultMode, Record, Verdict as Ending, quoted};

use crate::event::{Event, bound};

/// A limit on a phase current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Current {
    /// A limit given in A.
    Amperes(f64),
    /// A multiple of the motor's rated current.
    OfRated(f64),
}

/// A bad result of a simulated motor start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bad {
    /// The start has no answer, because it is undetermined, failed, or could not be simulated to its end.
    Unanswered,
    /// The start found the wrong pole.
    WrongPole,
    /// The angle has an error of more than this in degrees. A wrong pole counts as an error. The angle of a sector is its middle.
    Angle(f64),
    /// The axis has an error of more than this in degrees.
    Axis(f64),
    /// The axis has an error of more than this in degrees at the instant for which it holds, or the detector does not state this instant.
    AxisAtInstant(f64),
    /// The answer is a sector that does not contain the rotor's angle.
    WrongSector,
    /// The rotor moved by more than this in electrical degrees.
    Moved(f64),
    /// A phase current exceeded this limit.
    Current(Current),
    /// The detection took longer than this in s.
    Time(f64),
}

/// A measure and its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LimitedMeasure {
    /// The root mean square of the axis error is at most this value in degrees. A start without an answer counts as 90°.
    Rms(f64),
    /// The share of starts with the result `bad` is at most `most`. If `or_unanswered` is true, starts without an answer count too.
    Share {
        /// The result that counts against a start.
        bad: Bad,
        /// True if a start without an answer counts too.
        or_unanswered: bool,
        /// Largest allowed share.
        most: f64,
    },
    /// The diagnostic coverage is at least this value. Among the starts whose answer is dangerous with the method's checks off, at least
    /// this share has no answer with the checks on.
    Coverage(f64),
}

/// A demand on starts, with or without a fault in the drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
    /// The fault with which the demand is judged, in its typical size. None for a drive without a fault.
    pub fault: Option<FaultMode>,
    /// The measure and its limit.
    pub what: LimitedMeasure,
}

/// Share of starts that may exceed the limits of `moved`, `current` and `time`. As in `require`, 99 of 100 starts must keep these limits.
const BEYOND: f64 = 0.01;

/// Two parts of a message about a wrong limit: the text that was found, and the text that is allowed in its place.
pub(super) type Refused = (String, String);

const SHAPE: &str = "a measure, `<=` and its limit, such as `rms <= 1 deg`, `p95 <= 3 deg`, `p95_at_instant <= 1 deg`, `P(wrong_pole) <= 1e-6`, `P(undetermined) <= 1 %`, \
     `P(|e| > 5 deg) <= 0.1 %`, `moved <= 2 deg`, `current <= 1.2 rated`, `time <= 20 ms`, `right_sector >= 99 %` or \
     `faults.phase-open: coverage >= 99 %`";
const MEASURES: [&str; 9] =
    ["rms", "p95", "p99", "p95_at_instant", "moved", "current", "time", "right_sector", "coverage"];
const EVENTS: [&str; 6] = ["wrong_pole", "undetermined", "|e|", "moved", "current", "time"];
const ANGLES: &str = "an angle above 0 deg, such as `1 deg`";
const AXES: &str = "an angle above 0 deg and below 90 deg, beyond which no axis error is, such as `1 deg`";
const TIMES: &str = "a time above 0 s, such as `20 ms`";
const CURRENTS: &str = "a current above 0 A, such as `8 A`, or of the rated current, such as `1.2 rated`";
const SHARES: &str = "a share of at least 1e-12, above 0 and below 1, such as `1e-6` or `1 %`";
/// Least share that is allowed as a limit. For smaller shares, the functions of the sequential tests have no significant digits left.
const LEAST_SHARE: f64 = 1e-12;

impl Demand {
    /// Parses the limit of a requirement. The error contains the text that was found and the text that is allowed in its place.
    pub(super) fn parse(text: &str) -> Result<Self, Refused> {
        let (fault, rest) = match text.trim().strip_prefix("faults.") {
            None => (None, text.trim()),
            Some(rest) => {
                let wrong = || {
                    (
                        format!("`{text}`"),
                        "a failure mode, a colon and a limit, such as `faults.phase-open: coverage >= 99 %`"
                            .to_owned(),
                    )
                };
                let (mode, rest) = rest.split_once(':').ok_or_else(wrong)?;
                (Some(fault(mode.trim())?), rest.trim())
            }
        };
        let sides = [("<=", true), ("≤", true), (">=", false), ("≥", false)];
        let halves = sides.iter().find_map(|(sign, most)| Some((rest.split_once(sign)?, *most)));
        let ((measure, limit), is_most) = halves.ok_or_else(|| (format!("`{rest}`"), SHAPE.to_owned()))?;
        let (measure, limit) = (measure.trim(), limit.trim());
        let mut what = what(measure, limit)?;
        let at_most = !matches!(measure, "right_sector" | "coverage");
        if at_most != is_most {
            let sign = if at_most { "<=" } else { ">=" };
            return Err((format!("`{rest}`"), format!("`{sign}` after {measure}")));
        }
        if matches!(what, LimitedMeasure::Coverage(_)) && fault.is_none() {
            return Err((
                format!("`{rest}`"),
                "the fault that is covered, such as `faults.phase-open: coverage >= 99 %`".to_owned(),
            ));
        }
        if fault.is_some() {
            match &mut what {
                // A start that names no sector has not named the right one.
                LimitedMeasure::Share { bad: Bad::WrongSector, .. } | LimitedMeasure::Coverage(_) => {}
                // With a fault in the drive, no answer is the right result.
                LimitedMeasure::Share { bad: Bad::Unanswered, .. } => {
                    let needed = "a limit of wrong answers, such as `P(wrong_pole) <= 0.1 %`, or a coverage: with a fault no answer is the right answer";
                    return Err((format!("`{rest}`"), needed.to_owned()));
                }
                LimitedMeasure::Share { or_unanswered, .. } => *or_unanswered = false,
                LimitedMeasure::Rms(_) => {
                    let needed = "a limit of which a start without an answer is no breach, such as `p95 <= 2 deg`: with a fault no answer is the right answer";
                    return Err((format!("`{rest}`"), needed.to_owned()));
                }
            }
        }
        Ok(Self { fault, what })
    }

    /// Returns true if the demand limits the share of an event that a start without an answer does not have. A method could meet such a
    /// demand by giving no answers, so the share of starts without an answer must be limited too. Returns false if the event is the missing
    /// answer itself, or if starts without an answer count as the event. Also returns false with a fault in the drive, because no answer is
    /// right then.
    pub(super) fn is_guarded(&self) -> bool {
        let silent = matches!(self.what, LimitedMeasure::Share { or_unanswered: false, bad, .. } if bad != Bad::Unanswered);
        silent && self.fault.is_none()
    }

    /// Returns the event whose probability decides if plain trials do not. None if the demand has no such event. `rated` is the rated
    /// current in A.
    pub(super) fn event(&self, rated: f64) -> Option<Event> {
        let LimitedMeasure::Share { bad, or_unanswered: false, .. } = self.what else { return None };
        match bad {
            Bad::WrongPole => Some(Event::WrongPole),
            Bad::Moved(most) => Some(Event::Moved(most)),
            Bad::Current(current) => Some(Event::PeakCurrent(current.amperes(rated))),
            _ => None,
        }
    }
}

/// Returns the failure mode with this name.
fn fault(name: &str) -> Result<FaultMode, Refused> {
    FaultMode::named(name).ok_or_else(|| {
        let needed = format!("one of {}", FaultMode::NAMES.join(", "));
        match FaultMode::refused(name) {
            Some(why) => (format!("`{name}`"), format!("{needed}; `{name}` is not simulated: {why}")),
            None => (quoted(name, FaultMode::NAMES.iter().copied()), needed),
        }
    })
}

fn share(text: &str) -> Result<f64, Refused> {
    let value = text.parse::<Quantity<Share>>().ok().map(Quantity::value);
    value
        .filter(|share| (LEAST_SHARE..1.0).contains(share))
        .ok_or_else(|| (format!("`{text}`"), SHARES.to_owned()))
}

fn current(text: &str) -> Result<Current, Refused> {
    let refused = |found| (found, CURRENTS.to_owned());
    if let Some(number) = text.strip_suffix("rated") {
        let factor = number.trim().parse::<f64>().ok().filter(|factor| *factor > 0.0 && factor.is_finite());
        return factor.map(Current::OfRated).ok_or_else(|| refused(format!("`{text}`")));
    }
    bound::<Ampere>(text, f64::MIN_POSITIVE..).map(Current::Amperes).map_err(refused)
}

/// Parses a measure and its limit.
fn what(measure: &str, limit: &str) -> Result<LimitedMeasure, Refused> {
    let least = f64::MIN_POSITIVE;
    let refused = |needed: &'static str| move |found| (found, needed.to_owned());
    let axis = || bound::<Degree>(limit, least..90.0).map_err(refused(AXES));
    let share_of = |bad, or_unanswered, most| LimitedMeasure::Share { bad, or_unanswered, most };
    if let Some(event) = measure.strip_prefix("P(").and_then(|rest| rest.strip_suffix(')')) {
        let bad = event_of(event.trim())?;
        // A start without an angle is not within the limit.
        return Ok(share_of(bad, matches!(bad, Bad::Angle(_)), share(limit)?));
    }
    let (percentile, at_instant) =
        measure.strip_suffix("_at_instant").map_or((measure, false), |percentile| (percentile, true));
    if let Some(rank) = percentile.strip_prefix('p').and_then(|rank| rank.parse::<f64>().ok()) {
        if !(rank > 0.0 && rank < 100.0) {
            return Err((
                format!("`{measure}`"),
                "a percentile above p0 and below p100, such as `p95`".to_owned(),
            ));
        }
        let bad = if at_instant { Bad::AxisAtInstant } else { Bad::Axis };
        return Ok(share_of(bad(axis()?), true, (100.0 - rank) / 100.0));
    }
    match measure {
        "rms" => axis().map(LimitedMeasure::Rms),
        "moved" => {
            let most = bound::<Degree>(limit, least..).map_err(refused(ANGLES))?;
            Ok(share_of(Bad::Moved(most), true, BEYOND))
        }
        "current" => Ok(share_of(Bad::Current(current(limit)?), true, BEYOND)),
        "time" => {
            let most = bound::<Second>(limit, least..).map_err(refused(TIMES))?;
            Ok(share_of(Bad::Time(most), true, BEYOND))
        }
        "right_sector" => Ok(share_of(Bad::WrongSector, true, 1.0 - share(limit)?)),
        "coverage" => share(limit).map(LimitedMeasure::Coverage),
        _ => Err((unknown(measure, &MEASURES), SHAPE.to_owned())),
    }
}

/// Parses the event inside `P(…)`.
fn event_of(text: &str) -> Result<Bad, Refused> {
    let least = f64::MIN_POSITIVE;
    match text {
        "wrong_pole" => return Ok(Bad::WrongPole),
        "undetermined" | "failed" | "unanswered" => return Ok(Bad::Unanswered),
        _ => {}
    }
    let needed = "wrong_pole, undetermined, `|e| > 5 deg`, `moved > 2 deg`, `current > 1.2 rated` or `time > 20 ms` in `P(…)`";
    let (what, limit) = text.split_once('>').ok_or_else(|| (unknown(text, &EVENTS), needed.to_owned()))?;
    let (what, limit) = (what.trim(), limit.trim());
    let refused = |needed: &'static str| move |found| (found, needed.to_owned());
    match what {
        "|e|" => bound::<Degree>(limit, least..180.0)
            .map(Bad::Angle)
            .map_err(refused("an angle above 0 deg and below 180 deg, such as `5 deg`")),
        "moved" => bound::<Degree>(limit, least..).map(Bad::Moved).map_err(refused(ANGLES)),
        "current" => current(limit).map(Bad::Current),
        "time" => bound::<Second>(limit, least..).map(Bad::Time).map_err(refused(TIMES)),
        _ => Err((unknown(what, &EVENTS), needed.to_owned())),
    }
}

fn unknown(word: &str, known: &[&str]) -> String {
    quoted(word, known.iter().copied())
}

impl Current {
    /// Returns the limit in A for a motor with this rated current in A.
    pub(super) fn amperes(self, rated: f64) -> f64 {
        match self {
            Self::Amperes(amperes) => amperes,
            Self::OfRated(factor) => factor * rated,
        }
    }
}

/// Returns true if a start ended without an answer.
pub(super) fn is_unanswered(record: &Record) -> bool {
    record.verdict() != Ending::Found
}

impl Bad {
    /// Returns true if a start has this result. `rated` is the rated current of its motor in A.
    pub(super) fn happened(self, record: &Record, rated: f64) -> bool {
        let beyond = |value: Option<f64>, most: f64| value.is_some_and(|value| value.abs() > most);
        match self {
            Self::Unanswered => is_unanswered(record),
            Self::WrongPole => record.pole_correct() == Some(false),
            Self::Angle(most) => beyond(record.error_deg(), most),
            Self::Axis(most) => beyond(record.axis_error_deg(), most),
            Self::AxisAtInstant(most) => {
                record.axis_error_deg().is_some()
                    && record.axis_error_at_instant_deg().is_none_or(|error| error.abs() > most)
            }
            Self::WrongSector => beyond(record.miss_deg(), 0.0),
            Self::Moved(most) => record.rotor_moved_deg() > most,
            Self::Current(most) => record.run.peak_current > most.amperes(rated),
            Self::Time(most) => record.run.duration.seconds() > most,
        }
    }
}

impl fmt::Display for Current {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Amperes(amperes) => write!(f, "{amperes} A"),
            Self::OfRated(factor) => write!(f, "{factor} times rated"),
        }
    }
}

impl fmt::Display for Bad {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unanswered => f.write_str("no answer"),
            Self::WrongPole => f.write_str("wrong pole"),
            Self::Angle(most) => write!(f, "|e| > {most}°"),
            Self::Axis(most) => write!(f, "axis off by more than {most}°"),
            Self::AxisAtInstant(most) => {
                write!(
                    f,
                    "axis off by more than {most}° at the instant for which it holds, or no such instant stated"
                )
            }
            Self::WrongSector => f.write_str("wrong sector"),
            Self::Moved(most) => write!(f, "moved > {most}°"),
            Self::Current(most) => write!(f, "current > {most}"),
            Self::Time(most) => write!(f, "time > {} ms", rounded(*most, 3)),
        }
    }
}

#[cfg(test)]
mod tests;
