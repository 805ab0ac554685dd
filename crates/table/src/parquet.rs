//! Rows as Parquet: a row group is collected column by column and written as a whole.

use std::io;
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type};

use super::{Column, Destination, Kind, TableError, Value};

/// Rows of a group: enough that its share of the footer is small, few enough to hold in memory.
const GROUP_ROWS: usize = 1 << 16;

/// Bytes of text in a group, lest long texts fill the memory.
const GROUP_TEXT: usize = 1 << 23;

pub(super) struct Sink<'w> {
    to: SerializedFileWriter<Destination<'w>>,
    group: Vec<Chunk>,
    rows: usize,
    text: usize,
}

/// A column's part of the row group.
struct Chunk {
    /// For each row 1, or 0 where it is empty.
    present: Vec<i16>,
    values: Values,
}

/// What is not empty.
enum Values {
    Whole(Vec<i64>),
    Number(Vec<f64>),
    Flag(Vec<bool>),
    /// All texts in a row, and where each ends: an allocation for each would cost more than the texts.
    Text(Vec<u8>, Vec<usize>),
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
        let group = columns.iter().map(|column| Chunk::new(column.kind)).collect();
        Ok(Self { to, group, rows: 0, text: 0 })
    }

    pub(super) fn row(&mut self, values: &[Value<'_>]) -> Result<(), TableError> {
        for (chunk, value) in self.group.iter_mut().zip(values) {
            self.text += chunk.push(value);
        }
        self.rows += 1;
        if self.rows == GROUP_ROWS || self.text >= GROUP_TEXT { self.flush() } else { Ok(()) }
    }

    pub(super) fn finish(mut self) -> Result<(), TableError> {
        if self.rows > 0 {
            self.flush()?;
        }
        self.to.finish().map_err(failed)?;
        self.to.inner_mut().flush().map_err(TableError::Write)
    }

    fn flush(&mut self) -> Result<(), TableError> {
        self.rows = 0;
        self.text = 0;
        self.write_group().map_err(failed)
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        let mut group = self.to.next_row_group()?;
        let mut chunks = self.group.iter_mut();
        while let (Some(mut column), Some(Chunk { present, values })) = (group.next_column()?, chunks.next())
        {
            let levels = Some(present.as_slice());
            match values {
                Values::Whole(values) => {
                    column.typed::<Int64Type>().write_batch(values, levels, None)?;
                    values.clear();
                }
                Values::Number(values) => {
                    column.typed::<DoubleType>().write_batch(values, levels, None)?;
                    values.clear();
                }
                Values::Flag(values) => {
                    column.typed::<BoolType>().write_batch(values, levels, None)?;
                    values.clear();
                }
                Values::Text(bytes, ends) => {
                    let bytes = ByteArray::from(std::mem::take(bytes));
                    let starts = std::iter::once(0).chain(ends.iter().copied());
                    let texts: Vec<ByteArray> =
                        starts.zip(&*ends).map(|(start, end)| bytes.slice(start, end - start)).collect();
                    column.typed::<ByteArrayType>().write_batch(&texts, levels, None)?;
                    ends.clear();
                }
            }
            present.clear();
            column.close()?;
        }
        group.close()?;
        Ok(())
    }
}

impl Chunk {
    fn new(kind: Kind) -> Self {
        let values = match kind {
            Kind::Whole => Values::Whole(Vec::new()),
            Kind::Number => Values::Number(Vec::new()),
            Kind::Flag => Values::Flag(Vec::new()),
            Kind::Text => Values::Text(Vec::new(), Vec::new()),
        };
        Self { present: Vec::new(), values }
    }

    /// Appends a value of the column's kind; gives the bytes of a text.
    fn push(&mut self, value: &Value<'_>) -> usize {
        if value.is_empty() {
            self.present.push(0);
            return 0;
        }
        self.present.push(1);
        match (&mut self.values, value) {
            (Values::Whole(values), Value::Whole(whole)) => values.push(whole.cast_signed()),
            (Values::Number(values), Value::Number(number)) => values.push(*number),
            (Values::Flag(values), Value::Flag(flag)) => values.push(*flag),
            (Values::Text(bytes, ends), Value::Text(text)) => {
                bytes.extend_from_slice(text.as_bytes());
                ends.push(bytes.len());
                return text.len();
            }
            _ => unreachable!("the writer lets no other kind pass"),
        }
        0
    }
}

/// A column of the schema. Signed whole numbers are what every reader calls integers.
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

/// An error of writing; inside may be one of the file system.
fn failed(error: ParquetError) -> TableError {
    TableError::Write(match error {
        ParquetError::External(inner) => {
            inner.downcast::<io::Error>().map_or_else(io::Error::other, |error| *error)
        }
        other => io::Error::other(other),
    })
}
