//! Errors of a scenario file, with their positions, and the origins of keys that are not in the file.

use std::fmt;
use std::path::PathBuf;

use standstill_detect::{Check, MethodName, SettingsError};
use standstill_files::quoted;
use standstill_plant::{MotorError, TemperatureError};
use thiserror::Error;

use crate::suggestion::{suggest, unknown};

/// Origin of a key's value that the scenario file itself does not set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// Set on the command line.
    CommandLine,
    /// Set by an option that is a shorthand for the key, such as `--motor`.
    Option(&'static str),
    /// Set by a sweep axis at a point.
    Axis,
    /// Drawn by a tolerance.
    Tolerance,
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::CommandLine => f.write_str("set on the command line"),
            Self::Option(option) => write!(f, "set by {option}"),
            Self::Axis => f.write_str("set as an axis"),
            Self::Tolerance => f.write_str("drawn as a tolerance"),
        }
    }
}

/// End of the message for a setting that the scenario's method does not have.
const FOREIGN: &str = "a method that has such a setting";

/// Text of the error for a check that the scenario's method does not have.
const FOREIGN_CHECK: &str = "or a method that has such a check";

/// Error of a scenario file.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FileError {
    /// The file cannot be read.
    #[error("cannot read {file}: {error}")]
    Read {
        /// The file.
        file: PathBuf,
        /// Error of the operating system.
        error: String,
    },
    /// The file is not TOML.
    #[error("{file}: line {line}: {message}")]
    Syntax {
        /// The file.
        file: PathBuf,
        /// Line of the file, from 1.
        line: usize,
        /// Error of the parser.
        message: String,
    },
    /// A key is unknown, or its value is invalid.
    #[error("{place}{}`{key}`: {message}", if place.is_empty() { "" } else { ": " })]
    Key {
        /// File and line (from 1) of the key, or the origin of its value; empty if unknown.
        place: String,
        /// Path of the key, such as `sensors.noise`.
        key: String,
        /// Text with the value found and the values allowed.
        message: String,
    },
    /// The motor's data sheet is invalid.
    #[error(transparent)]
    Motor(MotorError),
}

impl FileError {
    /// Returns the error for a key whose value is invalid. `found` describes the value found, `needed` the values allowed.
    pub(crate) fn key(key: &str, found: &str, needed: &str) -> Self {
        let message = format!("found {found}, needed {needed}");
        Self::Key { place: String::new(), key: key.to_owned(), message }
    }

    /// Returns the error of a setting in `[detector]` that the chosen method does not have.
    pub(crate) fn foreign_setting(key: &str, method: MethodName) -> Self {
        Self::key(&format!("detector.{key}"), &format!("method \"{method}\""), FOREIGN)
    }

    /// Returns the error for a check in `detector.checks` that the chosen method does not have. The message lists the checks that the
    /// method has.
    pub(crate) fn foreign_check(check: Check, method: MethodName) -> Self {
        let names: Vec<String> =
            method.checks().iter().map(|check| format!("\"{}\"", check.name())).collect();
        let needed = format!("{} of method \"{method}\", {FOREIGN_CHECK}", names.join(", "));
        Self::key("detector.checks", &format!("\"{}\"", check.name()), &needed)
    }

    /// Returns true if the error reports a setting in `[detector]`, or a check, that the chosen method does not have.
    pub fn is_foreign_setting(&self) -> bool {
        self.foreign_setting_in_words().is_some()
    }

    /// Describes the setting in `[detector]`, or the check, that the chosen method does not have. The text contains the key and, for a
    /// check, the name of the check. Returns none for other errors.
    pub fn foreign_setting_in_words(&self) -> Option<String> {
        let Self::Key { key, message, .. } = self else { return None };
        if message.ends_with(FOREIGN) {
            return Some(format!("`{key}`"));
        }
        let found = message.strip_prefix("found ")?.split_once(", needed ")?.0;
        message.ends_with(FOREIGN_CHECK).then(|| format!("the check {found} of `{key}`"))
    }

    /// Converts an error message of serde about the key at `path`.
    pub(crate) fn serde(path: &str, message: &str) -> Self {
        // The lines after the first one give the position, which `path` contains.
        let message = message.trim().lines().next().unwrap_or_default().to_owned();
        let (key, message) = match unknown(&message) {
            Some((word, known)) => {
                // Serde's path ends at the table for some formats and at the key for others.
                let written = quoted(&word);
                let table = path.strip_suffix(&*written).unwrap_or(path).trim_end_matches(['.', '?']);
                let key = if table.is_empty() { written.to_string() } else { format!("{table}.{written}") };
                let key = if message.starts_with("unknown variant") { table.to_owned() } else { key };
                (key, suggest(&message, table, &word, &known))
            }
            None => (path.trim_end_matches(['.', '?']).to_owned(), message),
        };
        Self::Key { place: String::new(), key, message }
    }

    /// Converts the error of a temperature that no motor can have.
    pub(crate) fn temperature(error: &TemperatureError) -> Self {
        let message = error.to_string();
        Self::Key { place: String::new(), key: "rotor".to_owned(), message }
    }

    /// Converts the error of settings with which the method cannot work.
    pub fn settings(error: &SettingsError) -> Self {
        let SettingsError { setting, needed } = error;
        if let Some(text) = error.own_text() {
            let (message, key) = (text.to_owned(), "detector.library".to_owned());
            return Self::Key { place: String::new(), key, message };
        }
        let message = format!("the detector's setting {setting} must be {needed}");
        Self::Key { place: String::new(), key: "detector".to_owned(), message }
    }
}
