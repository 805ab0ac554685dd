//! Errors of tables, in one line each.

use std::path::PathBuf;
use std::{fmt, io};

use thiserror::Error;

/// Why a table could not be written or read.
#[derive(Debug, Error)]
pub enum TableError {
    /// The columns or the metadata do not make a table.
    #[error("{0}")]
    Design(String),
    /// A row to be written does not fit the columns.
    #[error("row {row}{}: found {found}, needed {needed}", in_column(column.as_ref()))]
    Row {
        /// Number of the row, from 1.
        row: u64,
        /// Name of the column; none for an error of the whole row.
        column: Option<String>,
        /// The value that was given.
        found: String,
        /// The requirement, in words.
        needed: String,
    },
    /// The table could not be written.
    #[error("the table could not be written: {0}")]
    Write(#[source] io::Error),
    /// A file could not be read.
    #[error("cannot read {path}: {error}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        error: io::Error,
    },
    /// A file is not a table, or its format's own structure is damaged.
    #[error("{path}: {why}")]
    File {
        /// The file.
        path: PathBuf,
        /// The fault, in words.
        why: String,
    },
    /// A place in a file has invalid content.
    #[error("{path}, {place}{}: found {found}, needed {needed}", in_column(column.as_ref()))]
    At {
        /// The file.
        path: PathBuf,
        /// Place in the file.
        place: Place,
        /// Name of the column; none for an error of the whole row.
        column: Option<String>,
        /// Content found at that place.
        found: String,
        /// The requirement, in words.
        needed: String,
    },
}

/// A place in a file, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line of a text; the first one of several.
    Line(u64),
    /// Row of a table.
    Row(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Row(row) => write!(f, "row {row}"),
        }
    }
}

fn in_column(column: Option<&String>) -> String {
    column.map_or_else(String::new, |name| format!(", column {}", quoted(name)))
}

/// Returns the beginning of a text on one line, for messages.
pub(super) fn quoted(text: &str) -> String {
    let mut line: String = text.chars().take(60).flat_map(char::escape_debug).collect();
    if text.chars().nth(60).is_some() {
        line.push('…');
    }
    format!("`{line}`")
}
