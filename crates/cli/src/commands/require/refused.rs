//! Impossible values of a key, which the scenario or its detector refuses.

use std::fmt;

use serde::Serialize;
use standstill_scenario::{Document, FileError};

use crate::commands::question::allowed;
use crate::error::Error;
use crate::shell::values::shown;
use standstill_analysis::require::Judged;

/// The refused values with their errors.
#[derive(Debug, Default)]
pub struct Refused(Vec<(f64, FileError)>);

/// A range of values that are refused for the same reason.
#[derive(Serialize)]
pub struct Refusal {
    #[serde(skip)]
    key: String,
    from: f64,
    to: f64,
    message: String,
    allowed: Option<String>,
}

impl Refused {
    pub fn add(&mut self, value: f64, error: FileError) {
        self.0.push((value, error));
    }

    /// Returns an error if all values were refused, so that none was judged.
    pub fn check(&mut self, judged: &[Judged]) -> Result<(), Error> {
        if judged.is_empty() && !self.0.is_empty() {
            return Err(self.0.remove(0).1.into());
        }
        Ok(())
    }

    /// Returns the ranges of refused values. Neighbouring values with the same reason form one range.
    pub fn ranges(&self, document: &Document, key: &str, judged: &[Judged]) -> Vec<Refusal> {
        let mut all: Vec<(f64, String)> =
            self.0.iter().map(|(value, error)| (*value, reason(error))).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut ranges: Vec<Refusal> = Vec::new();
        for (value, message) in all {
            let between = |from: f64| judged.iter().any(|judged| from < judged.value && judged.value < value);
            match ranges.last_mut() {
                Some(last) if last.message == message && !between(last.to) => last.to = value,
                _ => ranges.push(Refusal {
                    key: key.to_owned(),
                    from: value,
                    to: value,
                    message,
                    allowed: None,
                }),
            }
        }
        for range in &mut ranges {
            range.allowed = allowed(document, key, range.to).or_else(|| allowed(document, key, range.from));
        }
        ranges
    }
}

/// Returns the message of an error without its position in a file, because the value comes from this command.
fn reason(error: &FileError) -> String {
    match error {
        FileError::Key { message, .. } => message.clone(),
        other => other.to_string(),
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, from, to, message, allowed } = self;
        write!(f, "{key} cannot be {}", shown(key, *from))?;
        if from < to {
            write!(f, " to {}", shown(key, *to))?;
        }
        write!(f, ": {message}")?;
        allowed.as_ref().map_or(Ok(()), |allowed| write!(f, "; {allowed}"))
    }
}
