//! The two ends between which a command looks for a key's value: `--between` of `require`, `--vary` of `tune`.

use standstill_quantity::si_value;
use standstill_scenario::{Document, FileError, Origin, Plan, unit};
use toml::Value;

use crate::error::Error;

/// A key whose values are numbers.
pub struct Key<'a> {
    /// The option that names it, as messages repeat it.
    pub option: String,
    pub name: &'a str,
    pub whole: bool,
    /// What the option needs, with an example.
    pub needed: &'static str,
}

impl Key<'_> {
    /// `FROM:TO` in SI, each a value that the scenario can have.
    ///
    /// # Errors
    /// No two numbers, the first not below the second, or a value that the key cannot have.
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
        // With its unit, as it would stand in the file.
        let value = match (plain, self.whole) {
            (_, true) => Value::Integer(text.parse().map_err(|_| {
                let needed = "which takes whole numbers alone, such as 1:8";
                Error::Arguments(format!("{}: found `{text}` for {}, {needed}", self.option, self.name))
            })?),
            (Some(_), false) => Value::Float(number),
            (None, false) => Value::String(text.to_owned()),
        };
        let mut tried = document.clone();
        let possible = tried.set_value(self.name, value, Origin::CommandLine).and_then(|()| Plan::new(tried));
        possible.map(|_| number).map_err(|error| self.impossible(text, plain, error))
    }

    /// A value that cannot be. Where its unit was left out, that is the likeliest reason.
    fn impossible(&self, text: &str, plain: Option<f64>, error: FileError) -> Error {
        let unit = unit(self.name).filter(|unit| !unit.is_empty());
        match (plain, unit, &error) {
            (Some(_), Some(unit), FileError::Key { key, message, .. }) if key == self.name => {
                let Some((_, needed)) = message.rsplit_once("needed ") else { return error.into() };
                Error::Arguments(format!(
                    "{}: found {text} without a unit, which is {text} {unit}, needed {needed}, with the unit",
                    self.option
                ))
            }
            _ => error.into(),
        }
    }
}
