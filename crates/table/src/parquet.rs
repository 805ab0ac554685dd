//! Rows as Parquet: a row group is collected column by column and written as a whole.

use std::io;
use std::ops::Range;
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{ColumnPath, Type};

use super::{Cell, Column, Columns, Data, Destination, Kind, TableError};

/// Rows of a group: enough that its share of the footer is small, few enough to hold in memory.
const GROUP_ROWS: u64 = 1 << 16;

/// Bytes of text in a group, lest long texts fill the memory.
const GROUP_TEXT: usize = 1 << 23;

pub(super) struct Sink<'w> {
    to: SerializedFileWriter<Destination<'w>>,
    group: Columns,
}

impl<'w> Sink<'w> {
    pub(super) fn new(
        to: Destination<'w>,
        columns: &[Column],
        metadata: &[(String, String)],
    ) -> Result<Self, TableError> {
        let fields = columns.iter().map(field).collect::<Result<_, _>>().map_err(failed)?;
        let schema = Type::group_type_builder("table").with_fields(fields).build().map_err(failed)?;
        let to = SerializedFileWriter::new(to, Arc::new(schema), Arc::new(properties(columns, metadata)))
            .map_err(failed)?;
        Ok(Self { to, group: Columns::new(columns.to_vec()) })
    }

    pub(super) fn row(&mut self, values: &[Cell<'_>]) -> Result<(), TableError> {
        self.group.push(values);
        let full = self.group.rows() == GROUP_ROWS || self.group.text_bytes() >= GROUP_TEXT;
        if full { self.flush() } else { Ok(()) }
    }

    pub(super) fn finish(mut self) -> Result<(), TableError> {
        if self.group.rows() > 0 {
            self.flush()?;
        }
        self.to.finish().map_err(failed)?;
        self.to.inner_mut().flush().map_err(TableError::Write)
    }

    fn flush(&mut self) -> Result<(), TableError> {
        self.write_group().map_err(failed)?;
        self.group.clear();
        Ok(())
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        let mut group = self.to.next_row_group()?;
        let mut columns = self.group.iter();
        while let (Some(to), Some((_, data))) = (group.next_column()?, columns.next()) {
            let number = |cell: &f64| (!cell.is_nan()).then_some(*cell);
            match data {
                Data::Whole(cells) => {
                    write::<Int64Type>(to, cells.iter().map(|cell| (*cell >= 0).then_some(*cell)))
                }
                Data::Number(cells) => write::<DoubleType>(to, cells.iter().map(number)),
                Data::Flag(cells) => {
                    write::<BoolType>(to, cells.iter().map(|cell| number(cell).map(|cell| cell != 0.0)))
                }
                Data::Text(texts) => {
                    // One allocation for all: one for each would cost more than the texts.
                    let bytes = ByteArray::from(texts.bytes.clone());
                    let text = |Range { start, end }| (start < end).then(|| bytes.slice(start, end - start));
                    write::<ByteArrayType>(to, texts.ranges().map(text))
                }
            }?;
        }
        group.close()?;
        Ok(())
    }
}

/// Writes a column of a group; an empty cell has the definition level 0.
fn write<D: DataType>(
    mut to: SerializedColumnWriter<'_>,
    cells: impl Iterator<Item = Option<D::T>>,
) -> Result<(), ParquetError> {
    let (mut present, mut values) = (Vec::new(), Vec::new());
    for cell in cells {
        present.push(i16::from(cell.is_some()));
        values.extend(cell);
    }
    to.typed::<D>().write_batch(&values, Some(&present), None)?;
    to.close()
}

/// Returns a column of the schema. Whole numbers are signed, because all readers accept signed integers.
fn field(column: &Column) -> Result<Arc<Type>, ParquetError> {
    let (physical, logical) = match column.kind {
        Kind::Whole => (Physical::INT64, None),
        Kind::Number => (Physical::DOUBLE, None),
        Kind::Flag => (Physical::BOOLEAN, None),
        Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let field = Type::primitive_type_builder(&column.name, physical)
        .with_logical_type(logical)
        .with_repetition(Repetition::OPTIONAL)
        .build()?;
    Ok(Arc::new(field))
}

fn properties(columns: &[Column], metadata: &[(String, String)]) -> WriterProperties {
    let pairs = metadata.iter().map(|(key, value)| KeyValue::new(key.clone(), value.clone())).collect();
    let mut properties = WriterProperties::builder()
        // Else the version of the library, which would change the bytes.
        .set_created_by("standstill".to_owned())
        .set_key_value_metadata((!metadata.is_empty()).then_some(pairs))
        .set_compression(Compression::SNAPPY)
        .set_dictionary_enabled(false)
        // Those of pages would let a reader skip within a group, and grow the footer.
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_offset_index_disabled(true)
        .set_max_row_group_row_count(None);
    for column in columns {
        let path = ColumnPath::from(vec![column.name.clone()]);
        properties = match column.kind {
            Kind::Text => properties.set_column_dictionary_enabled(path, true),
            // Counters take almost no space, and seeds no more than otherwise.
            Kind::Whole => properties.set_column_encoding(path, Encoding::DELTA_BINARY_PACKED),
            Kind::Number | Kind::Flag => properties,
        };
    }
    properties.build()
}

/// Returns an error of writing; inside may be one of the file system.
fn failed(error: ParquetError) -> TableError {
    TableError::Write(match error {
        ParquetError::External(inner) => {
            inner.downcast::<io::Error>().map_or_else(io::Error::other, |error| *error)
        }
        other => io::Error::other(other),
    })
}
