//! The range in which a command searches a key's value: `--between` of `require`, `--vary` of `tune`.

use standstill_analysis::limit::Limits;
use standstill_analysis::require::Bench;
use standstill_quantity::si_value;
use standstill_scenario::{Document, FileError, Origin, Plan, unit};
use toml::Value;

use crate::error::Error;
use crate::shell::values::shown;

/// A key with numbers as values, and the option that names this key.
pub struct Key<'a> {
    /// Text of the option, for error messages.
    pub option: String,
    pub name: &'a str,
    pub whole: bool,
    /// Syntax that the option requires, with an example.
    pub needed: &'static str,
}

impl Key<'_> {
    /// Parses `FROM:TO` and returns both numbers in SI units. The scenario must be valid with each of them.
    ///
    /// # Errors
    /// The text is not two numbers, the first is not below the second, or a value is not possible for the key.
    pub fn ends(&self, text: &str, document: &Document) -> Result<(f64, f64), Error> {
        let (from, to) = text.split_once(':').ok_or_else(|| self.refused())?;
        let (from, to) = (self.end(from.trim(), document)?, self.end(to.trim(), document)?);
        if from < to { Ok((from, to)) } else { Err(self.refused()) }
    }

    fn refused(&self) -> Error {
        Error::Arguments(format!("{}: needed {}", self.option, self.needed))
    }

    fn end(&self, text: &str, document: &Document) -> Result<f64, Error> {
        let plain = text.parse().ok();
        let number = plain.or_else(|| si_value(text)).ok_or_else(|| self.refused())?;
        // The value with its unit, as in a scenario file.
        let value = match (plain, self.whole) {
            (_, true) => Value::Integer(text.parse().map_err(|_| {
                let needed = "which takes whole numbers alone, such as 1:8";
                Error::Arguments(format!("{}: found `{text}` for {}, {needed}", self.option, self.name))
            })?),
            (Some(_), false) => Value::Float(number),
            (None, false) => Value::String(text.to_owned()),
        };
        possible(document, self.name, value)
            .map(|()| number)
            .map_err(|error| self.impossible((text, number), plain, document, error))
    }

    /// Returns the error for a value that the key does not allow. If the value has no unit, the message names this as the likely cause.
    fn impossible(
        &self,
        (text, number): (&str, f64),
        plain: Option<f64>,
        document: &Document,
        error: FileError,
    ) -> Error {
        let unit = unit(self.name).filter(|unit| !unit.is_empty());
        match (plain, unit, &error) {
            (Some(_), Some(unit), FileError::Key { key, message, .. }) if key == self.name => {
                let Some((_, needed)) = message.rsplit_once("needed ") else { return error.into() };
                Error::Arguments(format!(
                    "{}: found {text} without a unit, which is {text} {unit}, needed {needed}, with the unit",
                    self.option
                ))
            }
            // The error names a setting of the detector that follows from the key. The key's allowed range is found by trying values.
            (.., FileError::Key { key, message, .. }) if key != self.name && !self.whole => {
                let needed = allowed(document, self.name, number)
                    .map_or_else(String::new, |allowed| format!("; {allowed}"));
                Error::Arguments(format!(
                    "{}: found {text} for {}, which cannot be: {message}{needed}",
                    self.option, self.name
                ))
            }
            _ => error.into(),
        }
    }
}

/// Checks that a scenario can be run with this value of a key.
fn possible(document: &Document, key: &str, value: Value) -> Result<(), FileError> {
    let mut tried = document.clone();
    tried.set_value(key, value, Origin::CommandLine)?;
    Plan::new(tried)?.scenario(0).map(|_| ())
}

/// Returns the limit of a key's allowed values as text, such as `needed at least 2 µs`. The limit lies between the scenario's own value,
/// which must be allowed, and `refused`, a value in SI units that is not allowed. None if the scenario's own value is not allowed, or if
/// one of the two values is not above zero.
pub fn allowed(document: &Document, key: &str, refused: f64) -> Option<String> {
    let none = Limits(Vec::new());
    let own = Bench::new(document, &none, &[key.to_owned()]).ok()?.nominal(0)?;
    let can = |value: f64| possible(document, key, Value::Float(value)).is_ok();
    if !(can(own) && own > 0.0 && refused > 0.0) {
        return None;
    }
    let (mut good, mut bad) = (own, refused);
    // Bisection to a relative width of 0.1 %.
    while (bad / good - 1.0).abs() > 1e-3 {
        let middle = (good * bad).sqrt();
        if can(middle) { good = middle } else { bad = middle }
    }
    let side = if own > refused { "at least" } else { "at most" };
    Some(format!("needed {side} {}", shown(key, good)))
}
