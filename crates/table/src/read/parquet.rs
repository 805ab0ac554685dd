//! The columns of a Parquet file, a few thousand rows at a time.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use parquet::basic::{Repetition, Type as Physical};
use parquet::column::reader::{ColumnReaderImpl, get_typed_column_reader};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::claims::{self, Part};
use super::{MOST_ROWS, file_error, opened, quoted};
use crate::{Cell, TableError};

/// Rows decoded at once.
const BATCH: usize = 1 << 12;

/// Largest number of rows, or bytes of texts, per byte of the file: repeated values take little room. Tables of trials
/// have less than one row and a few bytes of texts.
const MOST_OF_A_BYTE: u64 = 64;

/// Bytes of texts that every file may have.
const LITTLE_TEXT: u64 = 1 << 20;

/// A file with a valid footer.
pub(super) struct Parquet {
    reader: SerializedFileReader<File>,
    /// Second handle of the file, to check its pages first.
    file: File,
    length: u64,
}

/// Names of the columns, and the metadata.
type About = (Vec<String>, BTreeMap<String, String>);

impl Parquet {
    pub(super) fn open(path: &Path) -> Result<(Self, About), TableError> {
        let read = |error| TableError::Read { path: path.to_owned(), error };
        let incomplete = |error| failed(path, "not a complete Parquet file", error);
        let file = opened(path).map_err(read)?;
        let length = file.metadata().map_err(read)?.len();
        claims::footer(&file, length).map_err(read)?.map_err(|claim| incomplete(general(claim)))?;
        let second = file.try_clone().map_err(read)?;
        let reader = guarded(|| SerializedFileReader::new(second)).map_err(incomplete)?;
        let metadata = reader.metadata();
        let rows = metadata.row_groups().iter().try_fold(0_u64, |sum, group| {
            u64::try_from(group.num_rows()).ok().and_then(|rows| sum.checked_add(rows))
        });
        let most = MOST_ROWS.min(length.saturating_mul(MOST_OF_A_BYTE));
        if rows.is_none_or(|rows| rows > most) {
            let rows = rows.map_or_else(|| "an impossible number of".to_owned(), |rows| rows.to_string());
            let found = format!("{rows} rows in {length} bytes, {most} at most are possible");
            return Err(incomplete(general(found)));
        }
        let about = metadata.file_metadata();
        let fields = about.schema().get_fields();
        let nested = |field: &&std::sync::Arc<parquet::schema::types::Type>| {
            !field.is_primitive() || field.get_basic_info().repetition() == Repetition::REPEATED
        };
        if let Some(field) = fields.iter().find(nested) {
            let name = quoted(field.name());
            return Err(incomplete(general(format!("the column {name} has many values in a row"))));
        }
        let columns = fields.iter().map(|field| field.name().to_owned()).collect();
        let pairs = about.key_value_metadata().into_iter().flatten();
        let pairs = pairs.map(|pair| (pair.key.clone(), pair.value.clone().unwrap_or_default())).collect();
        Ok((Self { reader, file, length }, (columns, pairs)))
    }

    /// Calls `each` with the number of every row, from 1, and its cells in these columns.
    pub(super) fn rows(
        &self,
        path: &Path,
        places: &[usize],
        mut each: impl FnMut(u64, &[Cell<'_>]) -> Result<(), TableError>,
    ) -> Result<(), TableError> {
        let (mut rows, mut bytes, mut text) = (0, 0, 0);
        let most = self.length.saturating_mul(MOST_OF_A_BYTE).saturating_add(LITTLE_TEXT);
        for group in 0..self.reader.num_row_groups() {
            let broken = |error, rows| failed(path, &format!("unreadable after row {rows}"), error);
            let mut columns =
                guarded(|| self.columns(group, places, &mut bytes)).map_err(|e| broken(e, rows))?;
            loop {
                let batch = guarded(|| batch(&mut columns)).map_err(|e| broken(e, rows))?;
                text += batch.iter().map(Cells::text).sum::<u64>();
                if text > most {
                    return Err(broken(general("texts that unpack to too much".to_owned()), rows));
                }
                let count = batch.first().map_or(0, Cells::rows);
                let mut next = vec![0; batch.len()];
                let mut cells = Vec::with_capacity(batch.len());
                for row in 0..count {
                    for (column, next) in batch.iter().zip(&mut next) {
                        let cell = column.cell(row, next);
                        cells.push(cell.ok_or_else(|| broken(general("damaged".to_owned()), rows))?);
                    }
                    rows += 1;
                    each(rows, &cells)?;
                    cells.clear();
                }
                if count == 0 {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Returns the columns of a row group, whose pages were looked at. Parts of the file that several groups name are
    /// read as often, so their bytes are counted.
    fn columns(&self, group: usize, places: &[usize], bytes: &mut u64) -> Result<Vec<Chunk>, ParquetError> {
        let group = self.reader.get_row_group(group)?;
        let chunk = |place: &usize| {
            let column = group.metadata().column(*place);
            let (start, length) = column.byte_range();
            *bytes = bytes.saturating_add(length);
            if *bytes > self.length.saturating_mul(places.len() as u64) {
                return Err(general("row groups that share their bytes".to_owned()));
            }
            let descriptor = column.column_descr();
            // Plain, dictionary; of numbers what differences and bytes by themselves make, of flags their runs.
            let (least, encodings): (_, &'static [i64]) = match descriptor.physical_type() {
                Physical::DOUBLE => (Some(8), &[0, 2, 8, 9]),
                Physical::INT64 => (Some(8), &[0, 2, 5, 8, 9]),
                Physical::BOOLEAN => (None, &[0, 3]),
                Physical::BYTE_ARRAY => (Some(4), &[0, 2, 8]),
                _ => {
                    let name = quoted(descriptor.name());
                    return Err(general(format!(
                        "the column {name} has neither numbers nor flags nor texts"
                    )));
                }
            };
            let place_of = start..start.saturating_add(length).min(self.length);
            let part = Part { place: place_of, rows: group.metadata().num_rows(), least, encodings };
            claims::pages(&self.file, &part)?.map_err(general)?;
            let reader = group.get_column_reader(*place)?;
            Ok(match descriptor.physical_type() {
                Physical::DOUBLE => Chunk::Number(get_typed_column_reader(reader)),
                Physical::INT64 => Chunk::Whole(get_typed_column_reader(reader)),
                Physical::BOOLEAN => Chunk::Flag(get_typed_column_reader(reader)),
                _ => Chunk::Text(get_typed_column_reader(reader)),
            })
        };
        places.iter().map(chunk).collect()
    }
}

/// A column of a row group.
enum Chunk {
    Number(ColumnReaderImpl<DoubleType>),
    Whole(ColumnReaderImpl<Int64Type>),
    Flag(ColumnReaderImpl<BoolType>),
    Text(ColumnReaderImpl<ByteArrayType>),
}

/// Some rows of a column: a 1 for each cell that is not empty and a 0 for each empty one, and the values that are not
/// empty. Columns whose schema excludes empty cells have no such flags.
struct Cells {
    rows: usize,
    present: Vec<i16>,
    values: Values,
}

enum Values {
    Number(Vec<f64>),
    Whole(Vec<i64>),
    Flag(Vec<bool>),
    Text(Vec<ByteArray>),
}

impl Cells {
    fn rows(&self) -> usize {
        self.rows
    }

    /// Bytes of texts.
    fn text(&self) -> u64 {
        if let Values::Text(texts) = &self.values {
            texts.iter().map(|text| text.len() as u64).sum()
        } else {
            0
        }
    }

    /// Returns the cell of a row; `next`: number of non-empty cells so far. None if the value is missing or is not a
    /// valid text.
    fn cell(&self, row: usize, next: &mut usize) -> Option<Cell<'_>> {
        if self.present.get(row).is_some_and(|level| *level != 1) {
            return Some(Cell::Empty);
        }
        let at = *next;
        *next += 1;
        Some(match &self.values {
            Values::Number(numbers) => match *numbers.get(at)? {
                // Not-a-number is how other programs write what is missing, too.
                number if number.is_nan() => Cell::Empty,
                number => Cell::Number(number),
            },
            // What is below zero is no whole number of ours, but a number.
            Values::Whole(wholes) => {
                let whole = *wholes.get(at)?;
                u64::try_from(whole).map_or(Cell::Number(whole as f64), Cell::Whole)
            }
            Values::Flag(flags) => Cell::Flag(*flags.get(at)?),
            Values::Text(texts) => Cell::Text(texts.get(at)?.as_utf8().ok()?.into()),
        })
    }
}

/// Returns the next rows of each column; none at the end of the group.
fn batch(columns: &mut [Chunk]) -> Result<Vec<Cells>, ParquetError> {
    /// Returns the next cells of one column.
    fn some<T: DataType>(
        from: &mut ColumnReaderImpl<T>,
        values: impl Fn(Vec<T::T>) -> Values,
    ) -> Result<Cells, ParquetError> {
        let (mut present, mut there) = (Vec::new(), Vec::new());
        let (rows, ..) = from.read_records(BATCH, Some(&mut present), None, &mut there)?;
        Ok(Cells { rows, present, values: values(there) })
    }
    let cells = |from: &mut Chunk| match from {
        Chunk::Number(from) => some(from, Values::Number),
        Chunk::Whole(from) => some(from, Values::Whole),
        Chunk::Flag(from) => some(from, Values::Flag),
        Chunk::Text(from) => some(from, Values::Text),
    };
    let all: Vec<Cells> = columns.iter_mut().map(cells).collect::<Result<_, ParquetError>>()?;
    if all.windows(2).any(|pair| pair[0].rows != pair[1].rows) {
        return Err(general("columns of different lengths".to_owned()));
    }
    Ok(all)
}

fn general(why: String) -> ParquetError {
    ParquetError::General(why)
}

/// Returns the library panics on some damage; whoever reads a file gets an error. The standard library still reports
/// the panic.
fn guarded<T>(work: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| Err(general("damaged".to_owned())))
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
