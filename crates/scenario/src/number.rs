//! A number as written, with its unit if there is one. Tolerances and axes can vary such a number without knowing the
//! key.

use standstill_quantity::{any_quantity, rounded, split};
use toml::Value;

/// A number with its unit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Number {
    pub(super) value: f64,
    /// Unit as the file writes it. Empty if the file gives no unit.
    pub(super) unit: String,
    /// True if the number was written as an integer without a unit.
    pub(super) whole: bool,
}

impl Number {
    /// Parses a number, or a text that begins with a number.
    pub(super) fn of(value: &Value) -> Option<Self> {
        match value {
            Value::Integer(number) => Some(Self { value: *number as f64, unit: String::new(), whole: true }),
            Value::Float(number) if number.is_finite() => {
                Some(Self { value: *number, unit: String::new(), whole: false })
            }
            Value::String(text) => {
                let (number, unit) = split(text);
                let value = number.parse().ok().filter(|value: &f64| value.is_finite())?;
                Some(Self { value, unit: unit.to_owned(), whole: false })
            }
            _ => None,
        }
    }

    /// Converts two numbers to a common unit. If both numbers have the same unit, they keep it; otherwise both are converted to the SI
    /// unit. A number without a unit is in the SI unit. Returns none if the dimensions differ.
    pub(super) fn alike(a: Self, b: Self) -> Option<(Self, Self)> {
        if a.unit == b.unit {
            return Some((a, b));
        }
        let si = |number: &Self| any_quantity(&format!("{} {}", number.value, number.unit));
        let ((value_a, symbol_a), (value_b, symbol_b)) = (si(&a)?, si(&b)?);
        let symbol = if a.unit.is_empty() { symbol_b } else { symbol_a };
        let other = if b.unit.is_empty() { symbol } else { symbol_b };
        let unit = || symbol.to_owned();
        (symbol == other).then(|| {
            (
                Self { value: value_a, unit: unit(), whole: false },
                Self { value: value_b, unit: unit(), whole: false },
            )
        })
    }

    /// Returns the number as a TOML value, as a file would write it.
    pub(super) fn to_value(&self) -> Value {
        let value = rounded(self.value, 0);
        if !self.unit.is_empty() {
            return Value::String(format!("{value} {}", self.unit));
        }
        // Whole, and far below 2^63.
        #[allow(clippy::cast_possible_truncation)]
        let whole = value as i64;
        if self.whole && value.fract() == 0.0 && value.abs() < 1e15 {
            Value::Integer(whole)
        } else {
            Value::Float(value)
        }
    }
}
