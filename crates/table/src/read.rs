//! Reading results back: the numbers in some columns of a table.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use csv::{ErrorKind, StringRecord};

use self::parquet::Parquet;
use super::error::quoted;
use super::formula::restored;
use super::{Cell, Column, Format, Kind, METADATA, Place, TableError};

mod claims;
mod parquet;

/// Rows of a table: as many as a run may have, if it keeps a row of each trial.
const MOST_ROWS: u64 = 100_000_000;

/// Bytes of a row of a CSV file: its first one has the metadata, with a scenario of up to 4 MiB, whose quotation marks take
/// three characters each.
const MOST_RECORD: u64 = 16 << 20;

/// A table in a file: names of its columns, metadata and cells.
///
/// A truncated Parquet file is an error. Other damage is found only if it breaks the encoding, because the library
/// writes no checksums. A CSV file cut after a whole row cannot be distinguished from a shorter table.
pub struct Reader {
    /// The names of the columns, without that of a CSV file's metadata.
    pub columns: Vec<String>,
    /// The metadata; other programs may have added their own to a Parquet file.
    pub metadata: BTreeMap<String, String>,
    path: PathBuf,
    source: Source,
}

enum Source {
    /// Reader of a CSV file with the record read last, which is first that of the metadata; none for a table without
    /// rows.
    Csv(Box<csv::Reader<Rows>>, Option<StringRecord>),
    Parquet(Box<Parquet>),
}

/// A file of which no row is endless.
struct Rows {
    file: File,
    /// Number of bytes that the present row may still take.
    left: u64,
}

impl Read for Rows {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(into)?;
        self.left = self.left.checked_sub(count as u64).ok_or_else(|| {
            io::Error::other(format!("a row of more than {} MiB, which no table has", MOST_RECORD >> 20))
        })?;
        Ok(count)
    }
}

impl Reader {
    /// Opens a file of the format that its extension names.
    pub fn open(path: &Path) -> Result<Self, TableError> {
        match Format::of(path) {
            Some(Format::Csv) => Self::open_csv(path),
            Some(Format::Parquet) => Self::open_parquet(path),
            Some(Format::Npz | Format::Mat) | None => {
                Err(file_error(path, "not a table, whose name ends in .csv or .parquet"))
            }
        }
    }

    /// Calls `each` with the values that every row has in these columns, which must be there with these kinds.
    ///
    /// # Errors
    /// A column that is missing; a value of another kind; a file that cannot be read any further.
    pub fn values(self, columns: &[Column], mut each: impl FnMut(&[Cell<'_>])) -> Result<(), TableError> {
        let place = |column: &Column| {
            let found = self.columns.iter().position(|name| *name == column.name);
            let found = found.ok_or_else(|| file_error(&self.path, &format!("no column {}", column.name)));
            found.map(|place| (place, column.kind))
        };
        let columns = columns.iter().map(place).collect::<Result<Vec<_>, _>>()?;
        let wrong = |place: Place, (column, kind): (usize, Kind), found: String| TableError::At {
            path: self.path.clone(),
            place,
            column: Some(self.columns[column].clone()),
            found,
            needed: kind.needed().to_owned(),
        };
        match self.source {
            Source::Csv(mut from, first) => {
                let mut next = first;
                while let Some(mut record) = next {
                    let cell = |&(column, kind): &(usize, Kind)| {
                        let text = &record[column];
                        value(kind, text).ok_or_else(|| {
                            let place = Place::Line(line(&self.path, record.position()));
                            wrong(place, (column, kind), quoted(text))
                        })
                    };
                    let row = columns.iter().map(cell).collect::<Result<Vec<_>, _>>()?;
                    each(&row);
                    next = advance(&self.path, &mut from, &mut record)?.then_some(record);
                }
                Ok(())
            }
            Source::Parquet(file) => {
                let places: Vec<usize> = columns.iter().map(|(place, _)| *place).collect();
                file.rows(&self.path, &places, |row, cells| {
                    let unlike = |((_, kind), cell): &(&(usize, Kind), &Cell<'_>)| {
                        !cell.fits(*kind) || matches!(cell, Cell::Number(number) if !number.is_finite())
                    };
                    if let Some((column, cell)) = columns.iter().zip(cells).find(unlike) {
                        return Err(wrong(Place::Row(row), *column, said(cell)));
                    }
                    each(cells);
                    Ok(())
                })
            }
        }
    }

    fn open_csv(path: &Path) -> Result<Self, TableError> {
        let file = opened(path).map_err(|error| TableError::Read { path: path.to_owned(), error })?;
        let mut from =
            csv::ReaderBuilder::new().has_headers(false).from_reader(Rows { file, left: MOST_RECORD });
        let mut record = StringRecord::new();
        if !advance(path, &mut from, &mut record)? {
            return Err(file_error(path, "an empty file; a table begins with the names of its columns"));
        }
        let mut columns: Vec<String> = record.iter().map(|name| restored(name).into_owned()).collect();
        let has_metadata = columns.last().is_some_and(|last| last == METADATA);
        columns.truncate(columns.len() - usize::from(has_metadata));
        let first = advance(path, &mut from, &mut record)?.then_some(record);
        let text = first.iter().filter(|_| has_metadata).find_map(|record| record.iter().next_back());
        let metadata = match text {
            None | Some("") => BTreeMap::new(),
            Some(text) => serde_json::from_str(&restored(text)).map_err(|_| TableError::At {
                path: path.to_owned(),
                place: Place::Line(line(path, first.as_ref().and_then(StringRecord::position))),
                column: Some(METADATA.to_owned()),
                found: quoted(text),
                needed: "a JSON object of strings".to_owned(),
            })?,
        };
        let source = Source::Csv(Box::new(from), first);
        Ok(Self { columns, metadata, path: path.to_owned(), source })
    }

    fn open_parquet(path: &Path) -> Result<Self, TableError> {
        let (file, (columns, metadata)) = Parquet::open(path)?;
        Ok(Self { columns, metadata, path: path.to_owned(), source: Source::Parquet(Box::new(file)) })
    }
}

/// Returns the cell of a text in a column of this kind; none if the text is invalid.
fn value(kind: Kind, text: &str) -> Option<Cell<'_>> {
    if text.is_empty() {
        return Some(Cell::Empty);
    }
    match kind {
        Kind::Whole => text.parse().ok().map(Cell::Whole).filter(|cell| cell.fits(kind)),
        // Not-a-number is how other programs write nothing.
        Kind::Number => match text.parse::<f64>().ok()? {
            number if number.is_nan() => Some(Cell::Empty),
            number => number.is_finite().then_some(Cell::Number(number)),
        },
        Kind::Flag => text.parse().ok().map(Cell::Flag),
        Kind::Text => Some(Cell::Text(restored(text))),
    }
}

/// Returns the text of a cell for messages.
fn said(cell: &Cell<'_>) -> String {
    match cell {
        Cell::Empty => "nothing".to_owned(),
        Cell::Whole(whole) => whole.to_string(),
        Cell::Number(number) => number.to_string(),
        Cell::Flag(flag) => flag.to_string(),
        Cell::Text(text) => quoted(text),
    }
}

/// Reads the next record of a CSV file; returns false at the end of the file.
fn advance(path: &Path, from: &mut csv::Reader<Rows>, record: &mut StringRecord) -> Result<bool, TableError> {
    from.get_mut().left = MOST_RECORD;
    from.read_record(record).map_err(|error| {
        let text = error.to_string();
        let place = Place::Line(line(path, error.position()));
        let path = path.to_owned();
        let at = |found: String, needed: String| TableError::At {
            path: path.clone(),
            place,
            column: None,
            found,
            needed,
        };
        match error.into_kind() {
            ErrorKind::Io(error) => TableError::Read { path, error },
            ErrorKind::UnequalLengths { expected_len, len, .. } => {
                at(format!("{len} field(s)"), format!("{expected_len} as in the header"))
            }
            ErrorKind::Utf8 { .. } => at("bytes that are not UTF-8".to_owned(), "a text".to_owned()),
            _ => file_error(&path, &text),
        }
    })
}

/// Returns a file that has an end. To open a pipe already would be to wait for who writes to it.
fn opened(path: &Path) -> io::Result<File> {
    let kind = std::fs::metadata(path)?;
    if kind.is_dir() {
        return Err(io::Error::from(io::ErrorKind::IsADirectory));
    }
    if !kind.is_file() {
        return Err(io::Error::other("it is a pipe or a device, which may have no end; needed: a file"));
    }
    File::open(path)
}

/// Returns the line of a record in the file. The library does not count blank lines before a record and the second half
/// of `\r\n`, so the file is read once more; that happens at most once, because the error ends the table.
fn line(path: &Path, record: Option<&csv::Position>) -> u64 {
    let start = record.map_or(0, csv::Position::byte);
    let Ok(file) = opened(path) else { return 0 };
    let mut line = 1;
    for (at, byte) in (0..).zip(BufReader::new(file).bytes().map_while(Result::ok)) {
        if at >= start && !matches!(byte, b'\r' | b'\n') {
            break;
        }
        line += u64::from(byte == b'\n');
    }
    line
}

fn file_error(path: &Path, why: &str) -> TableError {
    TableError::File { path: path.to_owned(), why: why.to_owned() }
}
