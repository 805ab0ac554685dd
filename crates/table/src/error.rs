//! What can go wrong with a table, in one line each.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// Why a table could not be written or read.
#[derive(Debug)]
pub enum TableError {
    /// The columns or the metadata do not make a table.
    Design(String),
    /// A row to be written does not fit the columns.
    Row {
        /// Which row, from 1.
        row: u64,
        /// Which column, unless it is about the whole row.
        column: Option<String>,
        /// What was given.
        found: String,
        /// What would fit.
        needed: String,
    },
    /// The table could not be written.
    Write(io::Error),
    /// A file could not be read.
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// A file is not a table, or its format's own structure is damaged.
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A place in a file does not hold what it must.
    At {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// Which column, unless it is about the whole row.
        column: Option<String>,
        /// What is there.
        found: String,
        /// What must be.
        needed: String,
    },
}

/// A place in a file, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line of a text; of several, the first.
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

impl fmt::Display for TableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let column = |column: &Option<String>| match column {
            Some(name) => format!(", column {}", quoted(name)),
            None => String::new(),
        };
        match self {
            Self::Design(why) => f.write_str(why),
            Self::Row { row, column: name, found, needed } => {
                write!(f, "row {row}{}: found {found}, needed {needed}", column(name))
            }
            Self::Write(error) => write!(f, "the table could not be written: {error}"),
            Self::Read { path, error } => write!(f, "cannot read {}: {error}", path.display()),
            Self::File { path, why } => write!(f, "{}: {why}", path.display()),
            Self::At { path, place, column: name, found, needed } => {
                write!(f, "{}, {place}{}: found {found}, needed {needed}", path.display(), column(name))
            }
        }
    }
}

impl std::error::Error for TableError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Write(error) | Self::Read { error, .. } => Some(error),
            _ => None,
        }
    }
}

/// For messages: a text on one line, and no more than its beginning.
pub(super) fn quoted(text: &str) -> String {
    let mut line: String = text.chars().take(60).flat_map(char::escape_debug).collect();
    if text.chars().nth(60).is_some() {
        line.push('…');
    }
    format!("`{line}`")
}
