//! Tables of typed columns. They are written and read row by row as CSV and Parquet, and written as a whole to NumPy
//! and MATLAB files.
//!
//! For any number of rows, a [`Writer`] holds at most one row group of 65,536 rows (Parquet) or one row (CSV), and a
//! [`Reader`] a few thousand rows. Only the Parquet footer grows, in memory by about 1.6 kB per column and group. For
//! the formats of NumPy and MATLAB, a writer holds the whole table twice. Equal tables give equal bytes.
//!
//! ```
//! use standstill_table::{Column, Format, Kind, Cell, Writer};
//!
//! let columns = vec![Column::new("trial", Kind::Whole), Column::new("error_deg", Kind::Number)];
//! let run = [("seed".to_owned(), "7".to_owned())];
//! let mut file = Vec::new();
//! let mut table = Writer::new(&mut file, Format::Csv, columns, &run)?;
//! table.row(&[Cell::from(0), Cell::from(0.25)])?;
//! table.row(&[Cell::from(1), Cell::Empty])?;
//! table.finish()?;
//! assert_eq!(file, b"trial,error_deg,run\n0,0.25,\"{\"\"seed\"\":\"\"7\"\"}\"\n1,,\n");
//! # Ok::<(), standstill_table::TableError>(())
//! ```
//!
//! # Content of a cell
//!
//! Any cell may be empty. A number that is not finite and a text without characters are empty, too, in all formats,
//! because some formats cannot distinguish them. Whole numbers end at `i64::MAX`, beyond which most readers would
//! convert them to floats.
//!
//! # Metadata
//!
//! Pairs of texts about the whole table. Parquet keeps them in its footer. In CSV they are a JSON object in the first
//! row of an additional last column named [`METADATA`], empty in all others, so that any program reads the file without
//! options. A CSV table without rows loses its metadata; a table without metadata does not have this column.

mod columns;
mod csv;
mod error;
mod formula;
mod mat;
mod npz;
mod parquet;
mod read;

use std::borrow::Cow;
use std::collections::HashSet;
use std::io::Write;
use std::path::Path;

pub use columns::{Columns, Data, Texts};
pub use error::{Place, TableError};
pub use formula::defused;
pub use read::Reader;

/// The examples of the README run too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

/// Name of the column that holds the metadata of a CSV table. No other column may have it.
pub const METADATA: &str = "run";

/// Kind of a column's cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Whole numbers from 0 to `i64::MAX`.
    Whole,
    /// Finite `f64`; written in the fewest digits that give the same number back.
    Number,
    /// `true` or `false`.
    Flag,
    /// Text.
    Text,
}

/// A column: its name, with a unit if it has one, and the kind of its cells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Unique in its table and not empty.
    pub name: String,
    /// Kind of its cells.
    pub kind: Kind,
}

/// Content of a cell. As JSON an empty one is null.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum Cell<'a> {
    /// Nothing.
    Empty,
    /// Cell of [`Kind::Whole`].
    Whole(u64),
    /// Cell of [`Kind::Number`]; empty unless finite.
    Number(f64),
    /// Cell of [`Kind::Flag`].
    Flag(bool),
    /// Cell of [`Kind::Text`]; empty if it has no characters.
    Text(Cow<'a, str>),
}

standstill_interface::choice! {
    /// How a table is stored, by the extension of its file.
    pub enum Format {
        /// Text after RFC 4180 with `\n` at the end of lines and a header.
        Csv = "csv",
        /// Parquet, compressed with Snappy.
        Parquet = "parquet",
        /// A NumPy archive with an array for each column.
        Npz = "npz",
        /// A MATLAB file of level 5 with a variable for each column; what its name cannot have is an underscore.
        Mat = "mat",
    }
}

/// Writes a table row by row. Without [`Writer::finish`] the file is incomplete.
pub struct Writer<'w> {
    columns: Vec<Column>,
    rows: u64,
    sink: Sink<'w>,
}

/// Destination of a table. It is a trait object, so that the formats are compiled once, in this crate, and not for each
/// kind of file.
type Destination<'w> = &'w mut (dyn Write + Send);

enum Sink<'w> {
    Csv(Box<csv::Sink<'w>>),
    Parquet(Box<parquet::Sink<'w>>),
    /// Format, table so far, destination and metadata.
    Whole(Whole, Box<Columns>, Destination<'w>, Option<String>),
}

/// Converts the columns of a whole table to the bytes of a file.
type Whole = fn(&Columns, Option<&str>) -> std::io::Result<Vec<u8>>;

impl Kind {
    /// Describes the requirement for a cell of this kind, for messages.
    fn needed(self) -> &'static str {
        match self {
            Self::Whole => "a whole number from 0 to 2^63 - 1",
            Self::Number => "a finite number",
            Self::Flag => "`true` or `false`",
            Self::Text => "a text",
        }
    }
}

impl Column {
    /// Makes a column of this name and kind.
    pub fn new(name: impl Into<String>, kind: Kind) -> Self {
        Self { name: name.into(), kind }
    }
}

impl Format {
    /// Returns the format of a path's extension, in upper or lower case.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?;
        Self::ALL.into_iter().find(|format| extension.eq_ignore_ascii_case(format.name()))
    }
}

impl Cell<'_> {
    /// Returns whether a table holds nothing for it: [`Cell::Empty`], a number that is not finite, an empty text.
    pub fn is_empty(&self) -> bool {
        match self {
            Self::Empty => true,
            Self::Number(number) => !number.is_finite(),
            Self::Text(text) => text.is_empty(),
            Self::Whole(_) | Self::Flag(_) => false,
        }
    }

    fn fits(&self, kind: Kind) -> bool {
        match self {
            Self::Empty => true,
            Self::Whole(whole) => kind == Kind::Whole && i64::try_from(*whole).is_ok(),
            Self::Number(_) => kind == Kind::Number,
            Self::Flag(_) => kind == Kind::Flag,
            Self::Text(_) => kind == Kind::Text,
        }
    }

    /// Returns the cell as a text for messages.
    fn shown(&self) -> String {
        match self {
            Self::Empty => "nothing".to_owned(),
            Self::Whole(whole) => format!("the whole number {whole}"),
            Self::Number(number) => format!("the number {number:?}"),
            Self::Flag(flag) => format!("the flag `{flag}`"),
            Self::Text(text) => format!("the text {}", error::quoted(text)),
        }
    }
}

macro_rules! cells {
    ($($from:ty: $variant:ident,)+) => {$(
        impl<'a> From<$from> for Cell<'a> {
            fn from(value: $from) -> Self {
                Self::$variant(value.into())
            }
        }
    )+};
}
cells! { u64: Whole, f64: Number, bool: Flag, &'a str: Text, String: Text, }

impl<'a, T: Into<Cell<'a>>> From<Option<T>> for Cell<'a> {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Empty, Into::into)
    }
}

impl<'w> Writer<'w> {
    /// Begins a table. In CSV, `to` receives small writes, so a file should be buffered.
    ///
    /// Returns [`TableError::Design`] if there are no columns, if a name is empty, repeated or [`METADATA`], or if a
    /// key of the metadata is repeated.
    pub fn new(
        to: Destination<'w>,
        format: Format,
        columns: Vec<Column>,
        metadata: &[(String, String)],
    ) -> Result<Self, TableError> {
        check(&columns, metadata)?;
        let sink = match format {
            Format::Csv => Sink::Csv(Box::new(csv::Sink::new(to, &columns, metadata)?)),
            Format::Parquet => Sink::Parquet(Box::new(parquet::Sink::new(to, &columns, metadata)?)),
            Format::Npz | Format::Mat => {
                let bytes = if format == Format::Npz { npz::bytes } else { mat::bytes };
                let table = Box::new(Columns::new(columns.clone()));
                Sink::Whole(bytes, table, to, csv::object(metadata)?)
            }
        };
        Ok(Self { columns, rows: 0, sink })
    }

    /// Adds a row of one value for each column, of its kind or empty.
    ///
    /// Returns [`TableError::Row`] if the row does not fit; then none of it is written, and further rows can be added.
    /// After a [`TableError::Write`], no rows can be added.
    pub fn row(&mut self, values: &[Cell<'_>]) -> Result<(), TableError> {
        check_row(&self.columns, self.rows, values)?;
        match &mut self.sink {
            Sink::Csv(sink) => sink.row(values)?,
            Sink::Parquet(sink) => sink.row(values)?,
            Sink::Whole(_, table, ..) => table.push(values),
        }
        self.rows += 1;
        Ok(())
    }

    /// Completes the table and flushes its destination.
    pub fn finish(self) -> Result<(), TableError> {
        match self.sink {
            Sink::Csv(sink) => sink.finish(),
            Sink::Parquet(sink) => sink.finish(),
            Sink::Whole(bytes, table, to, run) => {
                let written = bytes(&table, run.as_deref()).and_then(|bytes| to.write_all(&bytes));
                written.and_then(|()| to.flush()).map_err(TableError::Write)
            }
        }
    }
}

fn check(columns: &[Column], metadata: &[(String, String)]) -> Result<(), TableError> {
    if columns.is_empty() {
        return Err(TableError::Design("a table needs a column".to_owned()));
    }
    let mut names = HashSet::new();
    for Column { name, .. } in columns {
        if name.is_empty() {
            return Err(TableError::Design("a column needs a name".to_owned()));
        }
        if name == METADATA {
            return Err(TableError::Design(format!("`{METADATA}` is the name of the column for metadata")));
        }
        if !names.insert(name) {
            return Err(TableError::Design(format!("the column {} is there twice", error::quoted(name))));
        }
    }
    let mut keys = HashSet::new();
    match metadata.iter().find(|(key, _)| !keys.insert(key)) {
        Some((key, _)) => Err(TableError::Design(format!("the metadata have {} twice", error::quoted(key)))),
        None => Ok(()),
    }
}

/// Returns whether a row fits the columns; `rows` is how many there are before it.
fn check_row(columns: &[Column], rows: u64, values: &[Cell<'_>]) -> Result<(), TableError> {
    let wrong = |column: Option<&Column>, found, needed| TableError::Row {
        row: rows + 1,
        column: column.map(|column| column.name.clone()),
        found,
        needed,
    };
    if values.len() != columns.len() {
        let needed = format!("{}, one for each column", columns.len());
        return Err(wrong(None, format!("{} value(s)", values.len()), needed));
    }
    for (column, value) in columns.iter().zip(values) {
        if !value.fits(column.kind) {
            return Err(wrong(Some(column), value.shown(), column.kind.needed().to_owned()));
        }
    }
    Ok(())
}
