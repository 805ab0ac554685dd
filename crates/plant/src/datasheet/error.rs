//! Errors of data sheets.

use standstill_files::{MapError, TableError, key_span, line_of};
use thiserror::Error;

use super::nameplate::known_keys;

/// A data sheet that is not a motor.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum MotorError {
    /// The text is not TOML or has wrong keys; the message shows the line.
    #[error("{file}: {message}")]
    Format {
        /// The file, or the built-in's name.
        file: String,
        /// The parser's message.
        message: String,
    },
    /// A number that no motor has.
    #[error(
        "{file}: {}`{key}` is {found}, but must be {needed}",
        if *line > 0 { format!("line {line}, ") } else { String::new() }
    )]
    Value {
        /// The file, or the built-in's name.
        file: String,
        /// Line of the key, from 1; 0 if the key is not in the file.
        line: usize,
        /// The key.
        key: &'static str,
        /// The value that was found.
        found: String,
        /// The least value that would do.
        needed: String,
    },
    /// The flux map is invalid.
    #[error(transparent)]
    Map(MapError),
}

/// Makes the error, with its line, of a table that cannot be read from a file with this text.
pub(super) fn of_file(error: &TableError, file: &str, text: &str) -> MotorError {
    let TableError { key, message } = error;
    let line = key_span(text, key).map(|span| format!("line {}, ", line_of(text, span.start)));
    let place = if key.is_empty() { String::new() } else { format!("`{key}`: ") };
    let belongs = message.starts_with("unknown field") && known_keys().contains(&key.as_str());
    let message = if belongs {
        "unknown here: it is a key of the table [nameplate]; put the line [nameplate] above it"
    } else {
        message
    };
    MotorError::Format { file: file.to_owned(), message: line.unwrap_or_default() + &place + message }
}

/// Makes the error of an impossible number in a sheet with this file and text.
pub(super) fn wrong(
    (file, text): (&str, &str),
    key: &'static str,
    found: String,
    needed: String,
) -> MotorError {
    let line = key_span(text, key).map_or(0, |span| line_of(text, span.start));
    MotorError::Value { file: file.to_owned(), line, key, found, needed }
}
