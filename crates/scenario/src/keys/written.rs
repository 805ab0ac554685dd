//! Values in a file's tables, and fields of a scenario that are set from numbers.

use standstill_detect::Checks;
use standstill_interface::{Choice, Nanos};
use standstill_quantity::{Dimension, Quantity, Scale, Unit, rounded};

use super::entry::Values;
use crate::named::Named;

/// A value in a table of a scenario file.
pub(crate) trait Written {
    /// Returns a number in SI units; none for values that are not numbers.
    fn number(&self) -> Option<f64> {
        None
    }

    /// Returns the value of a flag; false for values that are not flags.
    fn flag(&self) -> bool {
        false
    }

    /// Returns the checks that are on; none for values that are not lists of checks.
    fn checks(&self) -> Option<Checks> {
        None
    }

    /// Returns the value as text: a number in its own unit, or the name of a choice.
    fn text(&self) -> String {
        String::new()
    }

    /// Formats a number in SI units with a suitable prefix, such as 20 nF. `_needed` describes the allowed range. If this description
    /// contains a `%`, a dimensionless number is shown in per cent. Returns an empty text for values that are not numbers.
    fn readable(&self, _needed: &str) -> String {
        String::new()
    }

    fn values() -> Values
    where
        Self: Sized;
}

impl<U: Unit> Written for Quantity<U> {
    fn number(&self) -> Option<f64> {
        Some(self.value())
    }

    fn text(&self) -> String {
        self.to_string()
    }

    fn readable(&self, needed: &str) -> String {
        readable(&U::DIMENSION, self.value(), needed)
    }

    fn values() -> Values {
        Values::Number { unit: U::SYMBOL, share: U::DIMENSION.is_share() }
    }
}

pub(super) fn readable(dimension: &Dimension, value: f64, needed: &str) -> String {
    let symbol = dimension.symbol;
    let scale = Scale::suiting(symbol, value.abs());
    let readable = scale.number(value);
    match symbol {
        "" if needed.contains('%') => format!("{} %", rounded(value, 2)),
        // A number that is too large or too small for any prefix is written by `Dimension::text`.
        _ if symbol.is_empty() || !(1e-3..1e6).contains(&readable.abs()) => dimension.text(value),
        _ => format!("{readable} {}", scale.unit),
    }
}

impl<T: Choice> Written for Named<T> {
    fn text(&self) -> String {
        self.0.name().to_owned()
    }

    fn values() -> Values {
        Values::Choice(T::ALL.iter().map(|choice| (choice.name(), choice.about().trim())).collect())
    }
}

impl Written for bool {
    fn flag(&self) -> bool {
        *self
    }

    fn values() -> Values {
        Values::Flag
    }
}

impl Written for String {
    fn values() -> Values {
        Values::Text
    }
}

/// Type of a field of the scenario. The field is set from the number of a key.
pub(super) trait Place: Copy {
    fn of(number: f64) -> Self;
    fn number(self) -> f64;
}

impl Place for f64 {
    fn of(number: f64) -> Self {
        number
    }

    fn number(self) -> f64 {
        self
    }
}

impl Place for Nanos {
    fn of(number: f64) -> Self {
        Self::from_seconds(number)
    }

    fn number(self) -> f64 {
        self.seconds()
    }
}
