//! A key: the entry that everything else follows from.

use std::ops::Range as Draws;

use standstill_detect::Method;
use standstill_quantity::{Dimension, rounded};
use standstill_sim::Purpose;
use toml::Value;

use super::range::{LARGEST, Range};
use super::written::{Written, readable};
use crate::Scenario;
use crate::document::FileError;

/// With what a value is compared that hardly anybody means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Usual {
    /// The whole, of a share.
    Whole,
    /// The motor's rated current.
    RatedCurrent,
    /// The DC link.
    Link,
    /// The DC link, of a resistance's drop at rated current.
    LinkByDrop,
    /// The DC link of the motor's nameplate.
    NominalLink,
    /// The carrier's period.
    Carrier,
}

/// The kind of a key's values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Values {
    /// Numbers: the symbol of their SI unit, and whether they are shares, which people write in per cent.
    Number {
        /// Symbol of the unit; empty for shares and pure numbers.
        unit: &'static str,
        /// True for shares.
        share: bool,
    },
    /// One of these names; each with a sentence about it.
    Choice(Vec<(&'static str, &'static str)>),
    /// Yes or no.
    Flag,
    /// Whole numbers.
    Whole,
    /// A text or a table: a file, a class, settings of a library.
    Text,
}

/// Sets a number of a scenario.
pub(crate) type Setter = fn(&mut Scenario<Method<f64>>, f64);

/// A key of scenario files.
///
/// ```
/// let noise = standstill_scenario::key("sensors.noise").expect("a key");
/// assert_eq!(noise.allowed(), Some("zero or more"));
/// assert_eq!(noise.values(), standstill_scenario::Values::Number { unit: "A", share: false });
/// ```
#[derive(Debug)]
pub struct Key {
    /// Its path, such as `sensors.noise`.
    pub path: &'static str,
    /// Its meaning, in a sentence or two.
    pub about: &'static str,
    /// A value as TOML has it; empty where the example of `init` has text of its own.
    pub example: &'static str,
    /// The numbers that it may have; none of choices, flags and texts.
    pub range: Option<Range>,
    /// The draws of a trial whose spread it is: what a budget takes for a source of error.
    pub draws: Option<(Purpose, Draws<usize>)>,
    /// More than this share of something is hardly meant.
    pub usual: Option<(f64, Usual)>,
    pub(super) values: fn() -> Values,
    /// Its value in a scenario, whether a file sets it or not.
    pub(super) get: fn(&Scenario<Method<f64>>) -> Option<Value>,
    /// True if this scenario has the part that the key belongs to.
    pub(super) applies: fn(&Scenario<Method<f64>>) -> bool,
    /// True if trials of this scenario draw with it, provided that its spread is more than zero.
    pub(super) drawn: fn(&Scenario<Method<f64>>) -> bool,
    /// Sets the number that it is by itself.
    pub(crate) set: Option<Setter>,
}

impl Key {
    pub(super) const fn of(path: &'static str, about: &'static str, values: fn() -> Values) -> Self {
        let (about, get, drawn) = (about.trim_ascii(), none as fn(&_) -> _, always as fn(&_) -> _);
        let example = "";
        Self {
            path,
            about,
            example,
            range: None,
            draws: None,
            usual: None,
            values,
            get,
            applies: drawn,
            drawn,
            set: None,
        }
    }

    /// The kind of its values.
    pub fn values(&self) -> Values {
        (self.values)()
    }

    /// Its numbers in words, as messages have them; none of choices, flags and texts.
    pub fn allowed(&self) -> Option<&'static str> {
        self.range.as_ref().map(|range| range.needed)
    }

    /// True if this scenario has the part that the key belongs to: a channel is a MOSFET's, a threshold an IGBT's.
    pub fn applies_to(&self, scenario: &Scenario<Method<f64>>) -> bool {
        (self.applies)(scenario)
    }

    /// True if a trial of this scenario draws with a spread that this key sets.
    pub fn is_drawn(&self, scenario: &Scenario<Method<f64>>) -> bool {
        let zero = scenario.value(self.path).and_then(|value| value.as_float()) == Some(0.0);
        self.draws.is_some() && (self.applies)(scenario) && (self.drawn)(scenario) && !zero
    }

    /// A number of this key in the unit in which its range is written.
    pub(super) fn readable(&self, value: f64, needed: &str) -> String {
        let dimension = match self.values() {
            Values::Number { unit, .. } => Dimension::of_symbol(unit),
            _ => None,
        };
        dimension.map_or_else(|| value.to_string(), |dimension| readable(dimension, value, needed))
    }

    /// # Errors
    /// A value beyond the range.
    pub(crate) fn check(&self, value: &dyn Written) -> Result<(), FileError> {
        match (&self.range, value.number()) {
            (Some(range), Some(number)) if !range.contains(number) => {
                let beyond = number.abs() > LARGEST;
                let needed = if beyond {
                    format!("{}, at most {LARGEST:e}", range.needed)
                } else {
                    range.needed.to_owned()
                };
                Err(FileError::key(self.path, &value.readable(range.needed), &needed))
            }
            _ => Ok(()),
        }
    }
}

fn none(_: &Scenario<Method<f64>>) -> Option<Value> {
    None
}

fn always(_: &Scenario<Method<f64>>) -> bool {
    true
}

pub(super) fn number(value: f64) -> Value {
    Value::Float(rounded(value, 0))
}
