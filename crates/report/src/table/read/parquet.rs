//! Rows from Parquet, a batch of each column at a time.

use std::fs::File;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{BoolType, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::RowGroupMetaData;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::Type;

use super::super::error::quoted;
use super::super::{Column, Kind, Place, TableError, Value};
use super::put_text;

/// Rows decoded at once.
const BATCH: usize = 1 << 12;

pub(super) struct Source {
    path: PathBuf,
    file: SerializedFileReader<File>,
    /// How many row groups were opened.
    groups: usize,
    /// The columns of the group that is being read.
    streams: Vec<Stream>,
    /// Rows that the current batch still has.
    left: usize,
    /// Rows given out.
    rows: u64,
}

enum Stream {
    Whole(Batches<Int64Type>),
    Number(Batches<DoubleType>),
    Flag(Batches<BoolType>),
    Text(Batches<ByteArrayType>),
}

/// One column of one row group.
struct Batches<T: DataType> {
    from: ColumnReaderImpl<T>,
    /// For each row 1, or 0 where it is empty; nothing in a column that has no empty cells by its schema.
    present: Vec<i16>,
    values: Vec<T::T>,
    row: usize,
    value: usize,
}

type Opened = (Vec<Column>, Vec<(String, String)>, Source);

impl Source {
    pub(super) fn open(path: &Path) -> Result<Opened, TableError> {
        let read = |error| TableError::Read { path: path.to_owned(), error };
        let file = File::open(path).map_err(read)?;
        if !file.metadata().map_err(read)?.is_file() {
            return Err(read(io::Error::from(io::ErrorKind::IsADirectory)));
        }
        let file = guarded(|| SerializedFileReader::new(file))
            .map_err(|error| failed(path, "not a complete Parquet file", error))?;
        let about = file.metadata().file_metadata();
        let fields = about.schema().get_fields();
        let columns = fields.iter().map(|field| column(path, field)).collect::<Result<Vec<_>, _>>()?;
        check_chunks(path, &file)?;
        let pairs = about.key_value_metadata().into_iter().flatten();
        let metadata = pairs.map(|pair| (pair.key.clone(), pair.value.clone().unwrap_or_default())).collect();
        let source = Self { path: path.to_owned(), file, groups: 0, streams: Vec::new(), left: 0, rows: 0 };
        Ok((columns, metadata, source))
    }

    pub(super) fn next(
        &mut self,
        columns: &[Column],
        row: &mut [Value<'static>],
    ) -> Result<bool, TableError> {
        while self.left == 0 {
            self.left = guarded(|| self.next_batch())
                .map_err(|error| failed(&self.path, &format!("unreadable after row {}", self.rows), error))?;
            if self.left == 0 {
                if self.groups == self.file.num_row_groups() {
                    return Ok(false);
                }
                guarded(|| self.next_group()).map_err(|error| {
                    failed(&self.path, &format!("unreadable after row {}", self.rows), error)
                })?;
            }
        }
        self.left -= 1;
        self.rows += 1;
        for ((column, cell), stream) in columns.iter().zip(row).zip(&mut self.streams) {
            stream.next(cell).map_err(|found| TableError::At {
                path: self.path.clone(),
                place: Place::Row(self.rows),
                column: Some(column.name.clone()),
                found,
                needed: column.kind.needed().to_owned(),
            })?;
        }
        Ok(true)
    }

    fn next_group(&mut self) -> Result<(), ParquetError> {
        let group = self.file.get_row_group(self.groups)?;
        self.streams = (0..group.num_columns())
            .map(|k| Stream::new(group.get_column_reader(k)?))
            .collect::<Result<_, _>>()?;
        self.groups += 1;
        Ok(())
    }

    /// Decodes the next rows of all columns; gives how many, 0 at the end of the group.
    fn next_batch(&mut self) -> Result<usize, ParquetError> {
        let mut rows = None;
        for stream in &mut self.streams {
            let read = match stream {
                Stream::Whole(batches) => batches.read()?,
                Stream::Number(batches) => batches.read()?,
                Stream::Flag(batches) => batches.read()?,
                Stream::Text(batches) => batches.read()?,
            };
            if *rows.get_or_insert(read) != read {
                return Err(ParquetError::General("columns of different lengths".to_owned()));
            }
        }
        Ok(rows.unwrap_or(0))
    }
}

impl Stream {
    fn new(from: ColumnReader) -> Result<Self, ParquetError> {
        match from {
            ColumnReader::Int64ColumnReader(from) => Ok(Self::Whole(Batches::new(from))),
            ColumnReader::DoubleColumnReader(from) => Ok(Self::Number(Batches::new(from))),
            ColumnReader::BoolColumnReader(from) => Ok(Self::Flag(Batches::new(from))),
            ColumnReader::ByteArrayColumnReader(from) => Ok(Self::Text(Batches::new(from))),
            _ => Err(ParquetError::General("a column of another type than the schema".to_owned())),
        }
    }

    /// Puts the next value into a cell, or says what is there instead.
    fn next(&mut self, cell: &mut Value<'static>) -> Result<(), String> {
        match self {
            Self::Whole(batches) => {
                *cell = match batches.next() {
                    Some(&whole) => Value::Whole(u64::try_from(whole).map_err(|_| whole.to_string())?),
                    None => Value::Empty,
                }
            }
            Self::Number(batches) => {
                *cell = match batches.next() {
                    Some(number) if number.is_infinite() => return Err(number.to_string()),
                    // As other programs write what is missing.
                    Some(number) if !number.is_nan() => Value::Number(*number),
                    _ => Value::Empty,
                }
            }
            Self::Flag(batches) => {
                *cell = batches.next().map_or(Value::Empty, |flag| Value::Flag(*flag));
            }
            Self::Text(batches) => match batches.next() {
                Some(bytes) => {
                    let text = bytes.as_utf8().map_err(|_| "bytes that are not UTF-8".to_owned())?;
                    put_text(cell, text);
                }
                None => *cell = Value::Empty,
            },
        }
        Ok(())
    }
}

impl<T: DataType> Batches<T> {
    fn new(from: ColumnReaderImpl<T>) -> Self {
        Self { from, present: Vec::new(), values: Vec::new(), row: 0, value: 0 }
    }

    fn read(&mut self) -> Result<usize, ParquetError> {
        self.present.clear();
        self.values.clear();
        self.row = 0;
        self.value = 0;
        let (rows, ..) = self.from.read_records(BATCH, Some(&mut self.present), None, &mut self.values)?;
        Ok(rows)
    }

    fn next(&mut self) -> Option<&T::T> {
        let present = self.present.get(self.row).is_none_or(|level| *level == 1);
        self.row += 1;
        if !present {
            return None;
        }
        self.value += 1;
        self.values.get(self.value - 1)
    }
}

/// The column that a field of the schema describes.
fn column(path: &Path, field: &Type) -> Result<Column, TableError> {
    let about = field.get_basic_info();
    let flat = field.is_primitive() && about.repetition() != Repetition::REPEATED;
    let kind = if flat {
        match (field.get_physical_type(), about.logical_type_ref(), about.converted_type()) {
            (
                Physical::INT64,
                None | Some(LogicalType::Integer { .. }),
                ConvertedType::NONE | ConvertedType::INT_64 | ConvertedType::UINT_64,
            ) => Some(Kind::Whole),
            (Physical::DOUBLE, ..) => Some(Kind::Number),
            (Physical::BOOLEAN, ..) => Some(Kind::Flag),
            (Physical::BYTE_ARRAY, Some(LogicalType::String), _)
            | (Physical::BYTE_ARRAY, None, ConvertedType::UTF8) => Some(Kind::Text),
            _ => None,
        }
    } else {
        None
    };
    let kind = kind.ok_or_else(|| TableError::File {
        path: path.to_owned(),
        why: format!(
            "the column {} is of none of the types INT64, DOUBLE, BOOLEAN and STRING",
            quoted(field.name())
        ),
    })?;
    Ok(Column::new(field.name(), kind))
}

/// Finds before the first row what would fail, or in the library panic, in the middle.
fn check_chunks(path: &Path, file: &SerializedFileReader<File>) -> Result<(), TableError> {
    let fault = |why| TableError::File { path: path.to_owned(), why };
    for chunk in file.metadata().row_groups().iter().flat_map(RowGroupMetaData::columns) {
        let codec = chunk.compression();
        if !matches!(codec, Compression::SNAPPY | Compression::UNCOMPRESSED) {
            let codec = codec.to_string();
            let name = codec.split('(').next().unwrap_or_default();
            return Err(fault(format!("compressed with {name}; only SNAPPY and UNCOMPRESSED are read")));
        }
        let start = chunk.dictionary_page_offset().unwrap_or(chunk.data_page_offset());
        if start < 0 || chunk.compressed_size() < 0 || chunk.num_values() < 0 {
            return Err(fault("damaged: a column before the file's beginning".to_owned()));
        }
    }
    Ok(())
}

/// The library panics on some damage; whoever reads a file gets an error. The standard library still reports the panic.
fn guarded<T>(work: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| Err(ParquetError::General("damaged".to_owned())))
}

fn failed(path: &Path, what: &str, error: ParquetError) -> TableError {
    let path = path.to_owned();
    let why = match error {
        ParquetError::External(inner) => match inner.downcast::<io::Error>() {
            Ok(error) => return TableError::Read { path, error: *error },
            Err(other) => other.to_string(),
        },
        ParquetError::General(why) | ParquetError::EOF(why) | ParquetError::NYI(why) => why,
        other => other.to_string(),
    };
    let why = why.split_whitespace().collect::<Vec<_>>().join(" ");
    TableError::File { path, why: format!("{what}: {why}") }
}
