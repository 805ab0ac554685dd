//! Errors of data sheets.

use standstill_files::{MapError, TableError, key_span, line_of};
use thiserror::Error;

/// A data sheet that is not a motor.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum MotorError {
    /// Not TOML, or not with these keys; the message shows the line.
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
        /// The line of its key, from 1, where it stands in a file; 0 if not.
        line: usize,
        /// Its key.
        key: &'static str,
        /// The value that was found.
        found: String,
        /// The least value that would do.
        needed: String,
    },
    /// Its flux map is none.
    #[error(transparent)]
    Map(MapError),
}

/// Returns a table that is none, of a file with this text, with its line.
pub(super) fn of_file(error: &TableError, file: &str, text: &str) -> MotorError {
    let TableError { key, message } = error;
    let line = key_span(text, key).map(|span| format!("line {}, ", line_of(text, span.start)));
    let place = if key.is_empty() { String::new() } else { format!("`{key}`: ") };
    MotorError::Format { file: file.to_owned(), message: line.unwrap_or_default() + &place + message }
}

/// Returns a number that no motor has, of a sheet's file and text.
pub(super) fn wrong(
    (file, text): (&str, &str),
    key: &'static str,
    found: String,
    needed: String,
) -> MotorError {
    let line = key_span(text, key).map_or(0, |span| line_of(text, span.start));
    MotorError::Value { file: file.to_owned(), line, key, found, needed }
}
