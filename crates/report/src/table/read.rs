//! Reading tables.

mod csv;
mod parquet;

use std::path::Path;

use super::{Column, Format, Kind, TableError, Value};

/// Reads a table row by row.
///
/// A Parquet file that ends too early is an error; other damage is found only where it breaks the encoding, since the
/// library writes no checksums. A CSV file cut after a whole row cannot be told from a shorter table.
pub struct Reader {
    columns: Vec<Column>,
    metadata: Vec<(String, String)>,
    row: Vec<Value<'static>>,
    source: Source,
}

enum Source {
    Csv(Box<csv::Source>),
    Parquet(Box<parquet::Source>),
}

impl Reader {
    /// Opens a file of the format that its extension names.
    ///
    /// CSV does not say what its columns hold: `kinds` gives it for each name. Parquet does, and `kinds` is not
    /// asked.
    pub fn open(path: &Path, kinds: impl Fn(&str) -> Kind) -> Result<Self, TableError> {
        let (columns, metadata, source) = match Format::of(path) {
            Some(Format::Csv) => {
                let (columns, metadata, source) = csv::Source::open(path, kinds)?;
                (columns, metadata, Source::Csv(Box::new(source)))
            }
            Some(Format::Parquet) => {
                let (columns, metadata, source) = parquet::Source::open(path)?;
                (columns, metadata, Source::Parquet(Box::new(source)))
            }
            None => {
                let why = "not a table, whose name ends in .csv or .parquet".to_owned();
                return Err(TableError::File { path: path.to_owned(), why });
            }
        };
        let row = vec![Value::Empty; columns.len()];
        Ok(Self { columns, metadata, row, source })
    }

    /// The columns, without that of a CSV file's metadata.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The metadata in the order of the file; other programs may have added their own to a Parquet file.
    pub fn metadata(&self) -> &[(String, String)] {
        &self.metadata
    }

    /// The next row, one value for each column; `None` after the last. An error ends the table.
    pub fn next_row(&mut self) -> Result<Option<&[Value<'static>]>, TableError> {
        let more = match &mut self.source {
            Source::Csv(source) => source.next(&self.columns, &mut self.row)?,
            Source::Parquet(source) => source.next(&self.columns, &mut self.row)?,
        };
        Ok(more.then_some(self.row.as_slice()))
    }
}

/// Puts a text into a cell, in the memory of the text that was there.
fn put_text(cell: &mut Value<'static>, text: &str) {
    match cell {
        _ if text.is_empty() => *cell = Value::Empty,
        Value::Text(old) => {
            let old = old.to_mut();
            old.clear();
            old.push_str(text);
        }
        _ => *cell = Value::from(text.to_owned()),
    }
}
