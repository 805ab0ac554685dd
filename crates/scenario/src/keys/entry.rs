//! A key of scenario files: the registry entry from which all other descriptions of the key are derived.

use std::ops::Range as Draws;

use standstill_detect::Method;
use standstill_quantity::{Dimension, rounded};
use standstill_sim::Purpose;
use toml::Value;

use super::range::{LARGEST, Range};
use super::written::{Written, readable};
use crate::Scenario;
use crate::document::FileError;

/// Reference for the value of a key. If the value is too large in relation to the reference, the program warns of a probable mistake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Usual {
    /// The number 1, for shares.
    Whole,
    /// Rated current of the motor.
    RatedCurrent,
    /// Voltage of the DC link.
    Link,
    /// Voltage of the DC link. The value is a resistance, and its voltage drop at rated current is compared with this voltage.
    LinkByDrop,
    /// Nominal DC-link voltage of the motor's nameplate.
    NominalLink,
    /// Period of the PWM carrier.
    Carrier,
}

/// The kind of a key's values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Values {
    /// Numbers, with the symbol of their SI unit.
    Number {
        /// Symbol of the unit; empty for shares and pure numbers.
        unit: &'static str,
        /// True for shares, dimensionless numbers that are written in per cent.
        share: bool,
    },
    /// A choice among names, each with a sentence that describes it.
    Choice(Vec<(&'static str, &'static str)>),
    /// True or false.
    Flag,
    /// True, false or a list of some of these names, each with a sentence that describes it.
    List(Vec<(&'static str, &'static str)>),
    /// Integers.
    Whole,
    /// A text or a table. It names a file or a class, or contains the settings of a library.
    Text,
}

/// Function that writes a number into a scenario.
pub(crate) type Setter = fn(&mut Scenario<Method<f64>>, f64);

/// A key of scenario files, with all its properties.
///
/// ```
/// let noise = standstill_scenario::key("sensors.noise").expect("a key");
/// assert_eq!(noise.allowed(), Some("zero or more"));
/// assert_eq!(noise.values(), standstill_scenario::Values::Number { unit: "A", share: false });
/// ```
#[derive(Debug)]
pub struct Key {
    /// Path of the key, such as `sensors.noise`.
    pub path: &'static str,
    /// Meaning of the key, in one or two sentences.
    pub about: &'static str,
    /// Example of a value in TOML; empty if the example file of `init` describes the key itself.
    pub example: &'static str,
    /// Numbers that are allowed; none for choices, flags and texts.
    pub range: Option<Range>,
    /// The random draws of a trial whose spread the key sets. The fields are the purpose of the draws, and the indices of the draws among
    /// all draws of this purpose. Such a key is a source of error in an error budget.
    pub draws: Option<(Purpose, Draws<usize>)>,
    /// Limit above which a value is probably a mistake and causes a warning. The fields are the limit as a share of the reference, and the
    /// reference.
    pub usual: Option<(f64, Usual)>,
    pub(super) values: fn() -> Values,
    /// Function that returns the key's effective value in a scenario, whether or not a file sets the key.
    pub(super) get: fn(&Scenario<Method<f64>>) -> Option<Value>,
    /// Function that returns true if a scenario has the part to which the key belongs.
    pub(super) applies: fn(&Scenario<Method<f64>>) -> bool,
    /// Function that returns true if trials of a scenario use the key's draws when the spread is above zero.
    pub(super) drawn: fn(&Scenario<Method<f64>>) -> bool,
    /// Function that writes the key's number into a scenario; none if the number sets no field directly.
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

    /// Returns the kind of the key's values.
    pub fn values(&self) -> Values {
        (self.values)()
    }

    /// Returns the allowed numbers in words, as in messages; none for choices, flags and texts.
    pub fn allowed(&self) -> Option<&'static str> {
        self.range.as_ref().map(|range| range.needed)
    }

    /// Returns true if a scenario has the part to which the key belongs. For example, the channel resistance belongs to a MOSFET, and the
    /// switch drop to an IGBT.
    pub fn applies_to(&self, scenario: &Scenario<Method<f64>>) -> bool {
        (self.applies)(scenario)
    }

    /// Returns true if trials of this scenario draw values whose spread this key sets. Returns false if the spread is zero.
    pub fn is_drawn(&self, scenario: &Scenario<Method<f64>>) -> bool {
        let zero = scenario.value(self.path).and_then(|value| value.as_float()) == Some(0.0);
        self.draws.is_some() && (self.applies)(scenario) && (self.drawn)(scenario) && !zero
    }

    /// Formats a number of this key in SI units with a suitable prefix. `needed` describes the allowed range: if it contains a `%`, a
    /// dimensionless number is shown in per cent.
    pub(super) fn readable(&self, value: f64, needed: &str) -> String {
        let dimension = match self.values() {
            Values::Number { unit, .. } => Dimension::of_symbol(unit),
            _ => None,
        };
        dimension.map_or_else(|| value.to_string(), |dimension| readable(dimension, value, needed))
    }

    /// Checks a value of this key.
    ///
    /// # Errors
    /// The value is outside the range.
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
