//! A number as it is written, with its unit if it has one: what can be varied without knowing what it is.

use toml::Value;

/// A number and its unit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Number {
    pub(super) value: f64,
    /// As written; empty without.
    pub(super) unit: String,
    /// Whether it was written as a whole number without unit.
    pub(super) whole: bool,
}

impl Number {
    /// From a number, or a text that begins with one.
    pub(super) fn of(value: &Value) -> Option<Self> {
        match value {
            Value::Integer(number) => Some(Self { value: *number as f64, unit: String::new(), whole: true }),
            Value::Float(number) if number.is_finite() => {
                Some(Self { value: *number, unit: String::new(), whole: false })
            }
            Value::String(text) => {
                let text = text.trim();
                let digits = text.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c)));
                let (number, unit) = text.split_at(digits.unwrap_or(text.len()));
                let value = number.trim().parse().ok().filter(|value: &f64| value.is_finite())?;
                Some(Self { value, unit: unit.trim().to_owned(), whole: false })
            }
            _ => None,
        }
    }

    /// As it would be written.
    pub(super) fn to_value(&self) -> Value {
        // Twelve digits hide what arithmetic rounds.
        let value: f64 = format!("{:.11e}", self.value).parse().unwrap_or(self.value);
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
