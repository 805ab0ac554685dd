//! Reading results back: the numbers in some columns of a table.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use csv::{ErrorKind, StringRecord};
use parquet::column::reader::{ColumnReaderImpl, get_typed_column_reader};
use parquet::data_type::DoubleType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

use super::error::quoted;
use super::{Column, Format, Kind, METADATA, Place, TableError, Value};

/// Rows of a Parquet file decoded at once.
const BATCH: usize = 1 << 12;

/// A table in a file: what its columns are called, what is said of it, and its numbers.
///
/// A Parquet file that ends too early is an error; other damage is found only where it breaks the encoding, since the
/// library writes no checksums. A CSV file cut after a whole row cannot be told from a shorter table.
pub struct Reader {
    /// The names of the columns, without that of a CSV file's metadata.
    pub columns: Vec<String>,
    /// The metadata; other programs may have added their own to a Parquet file.
    pub metadata: BTreeMap<String, String>,
    path: PathBuf,
    source: Source,
}

enum Source {
    /// With the record read last, which is first that of the metadata; of a table without rows there is none.
    Csv(Box<csv::Reader<File>>, Option<StringRecord>),
    Parquet(Box<SerializedFileReader<File>>),
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

    /// Calls `each` with the numbers that every row has in the columns of these indices.
    ///
    /// # Panics
    ///
    /// If there is no column of one of the indices.
    pub fn numbers<const N: usize>(
        self,
        places: [usize; N],
        mut each: impl FnMut([Option<f64>; N]),
    ) -> Result<(), TableError> {
        let at = |place: Place, n: usize, found: String| TableError::At {
            path: self.path.clone(),
            place,
            column: Some(self.columns[places[n]].clone()),
            found,
            needed: Kind::Number.needed().to_owned(),
        };
        match self.source {
            Source::Csv(mut from, first) => {
                let mut next = first;
                while let Some(mut record) = next {
                    let mut row = [None; N];
                    for (n, cell) in row.iter_mut().enumerate() {
                        let text = &record[places[n]];
                        *cell = number(text).map_err(|()| {
                            at(Place::Line(line(&self.path, record.position())), n, quoted(text))
                        })?;
                    }
                    each(row);
                    next = advance(&self.path, &mut from, &mut record)?.then_some(record);
                }
            }
            Source::Parquet(file) => {
                let mut rows = 0;
                for group in 0..file.num_row_groups() {
                    let broken =
                        |error, rows| failed(&self.path, &format!("unreadable after row {rows}"), error);
                    let mut columns =
                        guarded(|| chunks(&file, group, places)).map_err(|e| broken(e, rows))?;
                    loop {
                        let batch = guarded(|| batches(&mut columns)).map_err(|e| broken(e, rows))?;
                        let count = batch.first().map_or(0, Vec::len);
                        let row = |k: usize| -> [f64; N] { std::array::from_fn(|n| batch[n][k]) };
                        for row in (0..count).map(row) {
                            rows += 1;
                            if let Some(n) = row.iter().position(|number| number.is_infinite()) {
                                return Err(at(Place::Row(rows), n, row[n].to_string()));
                            }
                            // Not-a-number is how other programs write what is missing, too.
                            each(row.map(|number| Some(number).filter(|number| !number.is_nan())));
                        }
                        if count == 0 {
                            break;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Calls `each` with the values that every row has in these columns, which must be there with these kinds.
    ///
    /// # Errors
    /// A column that is missing; a value of another kind; a file that cannot be read any further.
    pub fn values(self, columns: &[Column], mut each: impl FnMut(&[Value<'_>])) -> Result<(), TableError> {
        let place = |column: &Column| {
            let found = self.columns.iter().position(|name| *name == column.name);
            found.ok_or_else(|| file_error(&self.path, &format!("no column {}", column.name)))
        };
        let places = columns.iter().map(place).collect::<Result<Vec<_>, _>>()?;
        let wrong = |place: Place, column: &Column, found: String| TableError::At {
            path: self.path.clone(),
            place,
            column: Some(column.name.clone()),
            found,
            needed: column.kind.needed().to_owned(),
        };
        match self.source {
            Source::Csv(mut from, first) => {
                let mut next = first;
                while let Some(mut record) = next {
                    let cell = |(column, place): (&Column, &usize)| {
                        let text = &record[*place];
                        value(column.kind, text).ok_or_else(|| {
                            wrong(Place::Line(line(&self.path, record.position())), column, quoted(text))
                        })
                    };
                    let row = columns.iter().zip(&places).map(cell).collect::<Result<Vec<_>, _>>()?;
                    each(&row);
                    next = advance(&self.path, &mut from, &mut record)?.then_some(record);
                }
            }
            Source::Parquet(file) => {
                let mut rows = 0;
                for group in 0..file.num_row_groups() {
                    let broken =
                        |error, rows| failed(&self.path, &format!("unreadable after row {rows}"), error);
                    let group = guarded(|| file.get_row_group(group)).map_err(|e| broken(e, rows))?;
                    let mut records = guarded(|| group.get_row_iter(None)).map_err(|e| broken(e, rows))?;
                    while let Some(record) =
                        guarded(|| records.next().transpose()).map_err(|e| broken(e, rows))?
                    {
                        rows += 1;
                        let fields: Vec<&Field> = record.get_column_iter().map(|(_, field)| field).collect();
                        let cell = |(column, place): (&Column, &usize)| {
                            let field = fields[*place];
                            field_value(column.kind, field)
                                .ok_or_else(|| wrong(Place::Row(rows), column, field.to_string()))
                        };
                        let row = columns.iter().zip(&places).map(cell).collect::<Result<Vec<_>, _>>()?;
                        each(&row);
                    }
                }
            }
        }
        Ok(())
    }

    fn open_csv(path: &Path) -> Result<Self, TableError> {
        let file = File::open(path).map_err(|error| TableError::Read { path: path.to_owned(), error })?;
        let mut from = csv::ReaderBuilder::new().has_headers(false).from_reader(file);
        let mut record = StringRecord::new();
        if !advance(path, &mut from, &mut record)? {
            return Err(file_error(path, "an empty file; a table begins with the names of its columns"));
        }
        let mut columns: Vec<String> = record.iter().map(str::to_owned).collect();
        let has_metadata = columns.last().is_some_and(|last| last == METADATA);
        columns.truncate(columns.len() - usize::from(has_metadata));
        let first = advance(path, &mut from, &mut record)?.then_some(record);
        let text = first.iter().filter(|_| has_metadata).find_map(|record| record.iter().next_back());
        let metadata = match text {
            None | Some("") => BTreeMap::new(),
            Some(text) => serde_json::from_str(text).map_err(|_| TableError::At {
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
        let read = |error| TableError::Read { path: path.to_owned(), error };
        let file = File::open(path).map_err(read)?;
        if !file.metadata().map_err(read)?.is_file() {
            return Err(read(io::Error::from(io::ErrorKind::IsADirectory)));
        }
        let file = guarded(|| SerializedFileReader::new(file))
            .map_err(|error| failed(path, "not a complete Parquet file", error))?;
        let about = file.metadata().file_metadata();
        let columns = about.schema().get_fields().iter().map(|field| field.name().to_owned()).collect();
        let pairs = about.key_value_metadata().into_iter().flatten();
        let metadata = pairs.map(|pair| (pair.key.clone(), pair.value.clone().unwrap_or_default())).collect();
        Ok(Self { columns, metadata, path: path.to_owned(), source: Source::Parquet(Box::new(file)) })
    }
}

/// What a text says in a column of this kind.
fn value(kind: Kind, text: &str) -> Option<Value<'_>> {
    if text.is_empty() {
        return Some(Value::Empty);
    }
    match kind {
        Kind::Whole => text.parse().ok().map(Value::Whole),
        Kind::Number => number(text).ok().map(|number| number.map_or(Value::Empty, Value::Number)),
        Kind::Flag => text.parse().ok().map(Value::Flag),
        Kind::Text => Some(Value::Text(text.into())),
    }
}

/// The same of a Parquet file's field.
fn field_value(kind: Kind, field: &Field) -> Option<Value<'_>> {
    match (kind, field) {
        (_, Field::Null) => Some(Value::Empty),
        (Kind::Whole, Field::Long(whole)) => u64::try_from(*whole).ok().map(Value::Whole),
        (Kind::Number, Field::Double(number)) => Some(Value::Number(*number)),
        (Kind::Flag, Field::Bool(flag)) => Some(Value::Flag(*flag)),
        (Kind::Text, Field::Str(text)) => Some(Value::Text(text.as_str().into())),
        _ => None,
    }
}

/// What a field says: a number or, also as other programs write it, nothing.
fn number(text: &str) -> Result<Option<f64>, ()> {
    if text.is_empty() {
        return Ok(None);
    }
    match text.parse::<f64>() {
        Ok(number) if number.is_nan() => Ok(None),
        Ok(number) if number.is_finite() => Ok(Some(number)),
        _ => Err(()),
    }
}

/// Reads the next record of a CSV file; `false` if there is none.
fn advance(path: &Path, from: &mut csv::Reader<File>, record: &mut StringRecord) -> Result<bool, TableError> {
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

/// The line of a record, counted in the file: the library counts neither the blank lines before a record nor the second
/// half of `\r\n`. Costs a pass over the file, once, since the error ends the table.
fn line(path: &Path, record: Option<&csv::Position>) -> u64 {
    let start = record.map_or(0, csv::Position::byte);
    let Ok(file) = File::open(path) else { return 0 };
    let mut line = 1;
    for (at, byte) in (0..).zip(BufReader::new(file).bytes().map_while(Result::ok)) {
        if at >= start && !matches!(byte, b'\r' | b'\n') {
            break;
        }
        line += u64::from(byte == b'\n');
    }
    line
}

type Chunk = ColumnReaderImpl<DoubleType>;

/// The columns of a row group.
fn chunks<const N: usize>(
    file: &SerializedFileReader<File>,
    group: usize,
    places: [usize; N],
) -> Result<Vec<Chunk>, ParquetError> {
    let group = file.get_row_group(group)?;
    let chunk = |place| {
        let column = group.metadata().column(place).column_descr();
        if column.physical_type() != parquet::basic::Type::DOUBLE || column.max_rep_level() > 0 {
            return Err(ParquetError::General(format!(
                "the column {} has no numbers",
                quoted(column.name())
            )));
        }
        Ok(get_typed_column_reader(group.get_column_reader(place)?))
    };
    places.into_iter().map(chunk).collect()
}

/// The next numbers of each column, not-a-number where there are none; empty at the end of the group.
fn batches(columns: &mut [Chunk]) -> Result<Vec<Vec<f64>>, ParquetError> {
    let batch = |from: &mut Chunk| {
        let (mut present, mut values) = (Vec::new(), Vec::new());
        let (rows, ..) = from.read_records(BATCH, Some(&mut present), None, &mut values)?;
        let mut values = values.into_iter();
        // A column that has no empty cells by its schema has no levels either.
        let has = |row: usize| present.get(row).is_none_or(|level| *level == 1);
        Ok((0..rows).map(|row| if has(row) { values.next() } else { None }.unwrap_or(f64::NAN)).collect())
    };
    let all: Vec<Vec<f64>> = columns.iter_mut().map(batch).collect::<Result<_, ParquetError>>()?;
    if all.windows(2).any(|pair| pair[0].len() != pair[1].len()) {
        return Err(ParquetError::General("columns of different lengths".to_owned()));
    }
    Ok(all)
}

/// The library panics on some damage; whoever reads a file gets an error. The standard library still reports the panic.
fn guarded<T>(work: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| Err(ParquetError::General("damaged".to_owned())))
}

fn failed(path: &Path, what: &str, error: ParquetError) -> TableError {
    let why = match error {
        ParquetError::External(inner) => match inner.downcast::<io::Error>() {
            Ok(error) => return TableError::Read { path: path.to_owned(), error: *error },
            Err(other) => other.to_string(),
        },
        ParquetError::General(why) | ParquetError::EOF(why) | ParquetError::NYI(why) => why,
        other => other.to_string(),
    };
    let why = why.split_whitespace().collect::<Vec<_>>().join(" ");
    file_error(path, &format!("{what}: {why}"))
}

fn file_error(path: &Path, why: &str) -> TableError {
    TableError::File { path: path.to_owned(), why: why.to_owned() }
}
