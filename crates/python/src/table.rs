//! Tables whose columns NumPy and Arrow read where they are.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{
    ArrayRef, BooleanArray, Float64Array, Int64Array, LargeStringArray, RecordBatch, RecordBatchIterator,
};
use arrow_buffer::{Buffer, NullBuffer, OffsetBuffer, ScalarBuffer};
use arrow_schema::{ArrowError, DataType, Field, Schema};
use numpy::{Element, PyArray1, ndarray::ArrayView1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyDict, PyList, PyString};
use standstill_table::{Columns, Data};

use crate::Error;

/// The columns of a table, by their names. NumPy's arrays are views of them and cannot be written to.
#[pyclass(frozen, module = "standstill")]
pub struct Table {
    columns: Vec<(String, Cells)>,
    rows: usize,
}

/// The cells of a column, in memory that several can hold.
enum Cells {
    Whole(ScalarBuffer<i64>),
    Number(ScalarBuffer<f64>),
    Flag(ScalarBuffer<f64>),
    Text(OffsetBuffer<i64>, Buffer),
}

/// Owner of a column's memory for as long as an array reads it.
#[pyclass(frozen)]
struct Keeper(#[allow(dead_code, reason = "held, not read")] Buffer);

/// A view of cells as a NumPy array.
fn view<'py, T: Element>(py: Python<'py>, cells: &[T], buffer: &Buffer) -> PyResult<Bound<'py, PyAny>> {
    let keeper = Bound::new(py, Keeper(buffer.clone()))?.into_any();
    // SAFETY: the array's base is the keeper, which holds the buffer of these cells; nobody writes to it, for the array is
    // made read-only below, and buffers of Arrow never change.
    let array = unsafe { PyArray1::borrow_from_array(&ArrayView1::from(cells), keeper) };
    locked(array.into_any())
}

/// Makes an array read-only.
fn locked(array: Bound<'_, PyAny>) -> PyResult<Bound<'_, PyAny>> {
    let options = PyDict::new(array.py());
    options.set_item("write", false)?;
    array.call_method("setflags", (), Some(&options))?;
    Ok(array)
}

/// Which cells of numbers are not empty; none if all are.
fn present(cells: &[f64]) -> Option<NullBuffer> {
    cells.iter().any(|cell| cell.is_nan()).then(|| cells.iter().map(|cell| !cell.is_nan()).collect())
}

impl Cells {
    fn new(data: Data) -> Self {
        match data {
            Data::Whole(cells) => Self::Whole(cells.into()),
            Data::Number(cells) => Self::Number(cells.into()),
            Data::Flag(cells) => Self::Flag(cells.into()),
            Data::Text(texts) => Self::Text(OffsetBuffer::new(texts.offsets.into()), texts.bytes.into()),
        }
    }

    /// Returns the name of the kind, and the bytes of offsets (of texts) and of values.
    fn bytes(&self) -> (&'static str, &[u8], &[u8]) {
        match self {
            Self::Whole(cells) => ("whole", &[], cells.inner().as_slice()),
            Self::Number(cells) => ("number", &[], cells.inner().as_slice()),
            Self::Flag(cells) => ("flag", &[], cells.inner().as_slice()),
            Self::Text(offsets, bytes) => ("text", offsets.inner().inner().as_slice(), bytes.as_slice()),
        }
    }

    /// Makes a column of `rows` cells of what [`Cells::bytes`] returned; none where that cannot be.
    fn of_bytes(kind: &str, offsets: &[u8], values: &[u8], rows: usize) -> Option<Self> {
        let eights = |bytes: &[u8]| -> Option<Vec<[u8; 8]>> {
            bytes.chunks(8).map(|chunk| chunk.try_into().ok()).collect()
        };
        let whole =
            |bytes: &[u8]| Some(eights(bytes)?.into_iter().map(i64::from_ne_bytes).collect::<Vec<_>>());
        let number =
            |bytes: &[u8]| Some(eights(bytes)?.into_iter().map(f64::from_ne_bytes).collect::<Vec<_>>());
        let cells = match kind {
            "whole" => Self::Whole(whole(values)?.into()),
            "number" => Self::Number(number(values)?.into()),
            "flag" => Self::Flag(number(values)?.into()),
            "text" => {
                let ends = whole(offsets)?;
                let texts = std::str::from_utf8(values).ok()?;
                let sound = ends.first() == Some(&0)
                    && ends.is_sorted()
                    && ends
                        .iter()
                        .all(|end| usize::try_from(*end).is_ok_and(|end| texts.is_char_boundary(end)));
                sound.then(|| Self::Text(OffsetBuffer::new(ends.into()), values.to_vec().into()))?
            }
            _ => return None,
        };
        let length = match &cells {
            Self::Whole(cells) => cells.len(),
            Self::Number(cells) | Self::Flag(cells) => cells.len(),
            Self::Text(offsets, _) => offsets.len() - 1,
        };
        (length == rows).then_some(cells)
    }

    fn arrow(&self) -> Result<ArrayRef, ArrowError> {
        Ok(match self {
            Self::Whole(cells) => Arc::new(Int64Array::new(cells.clone(), None)),
            Self::Number(cells) => Arc::new(Float64Array::new(cells.clone(), present(cells))),
            Self::Flag(cells) => {
                let flags = cells.iter().map(|cell| *cell == 1.0).collect();
                Arc::new(BooleanArray::new(flags, present(cells)))
            }
            Self::Text(offsets, bytes) => {
                let empty = offsets.lengths().any(|length| length == 0);
                let present = empty.then(|| offsets.lengths().map(|length| length > 0).collect());
                Arc::new(LargeStringArray::try_new(offsets.clone(), bytes.clone(), present)?)
            }
        })
    }

    fn kind(&self) -> DataType {
        match self {
            Self::Whole(_) => DataType::Int64,
            Self::Number(_) => DataType::Float64,
            Self::Flag(_) => DataType::Boolean,
            Self::Text(..) => DataType::LargeUtf8,
        }
    }

    /// Returns the cells as a NumPy array: numbers as a view, flags and texts as copies.
    fn numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self {
            Self::Whole(cells) => view(py, cells, cells.inner()),
            Self::Number(cells) => view(py, cells, cells.inner()),
            Self::Flag(cells) => {
                locked(PyArray1::from_iter(py, cells.iter().map(|cell| *cell == 1.0)).into_any())
            }
            Self::Text(offsets, bytes) => {
                let text = |ends: &[i64]| {
                    let [from, to] = [ends[0], ends[1]].map(|end| usize::try_from(end).unwrap_or_default());
                    let text = std::str::from_utf8(&bytes[from..to]).unwrap_or_default();
                    // The same few texts, again and again.
                    PyString::intern(py, text)
                };
                let texts: Vec<_> = offsets.windows(2).map(text).collect();
                let options = PyDict::new(py);
                options.set_item("dtype", "object")?;
                locked(py.import("numpy")?.call_method(
                    "array",
                    (PyList::new(py, texts)?,),
                    Some(&options),
                )?)
            }
        }
    }

    /// Returns which cells are empty, as a NumPy array; none if no cell is.
    fn empty<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let empty: Vec<bool> = match self {
            Self::Whole(_) => return Ok(None),
            Self::Number(cells) | Self::Flag(cells) => cells.iter().map(|cell| cell.is_nan()).collect(),
            Self::Text(offsets, _) => offsets.lengths().map(|length| length == 0).collect(),
        };
        empty.contains(&true).then(|| locked(PyArray1::from_vec(py, empty).into_any())).transpose()
    }
}

impl Table {
    /// Returns the columns without copying them.
    pub fn new(columns: Columns) -> Self {
        let rows = usize::try_from(columns.rows()).unwrap_or(usize::MAX);
        let columns =
            columns.into_columns().into_iter().map(|(column, data)| (column.name, Cells::new(data)));
        Self { columns: columns.collect(), rows }
    }

    fn schema(&self) -> Schema {
        let field = |(name, cells): &(String, Cells)| Field::new(name, cells.kind(), true);
        Schema::new(self.columns.iter().map(field).collect::<Vec<_>>())
    }
}

/// A column for Python: its kind, its cells and, if some are empty, which.
type Column<'py> = (&'static str, Bound<'py, PyAny>, Option<Bound<'py, PyAny>>);

#[pymethods]
impl Table {
    /// Names of the columns, in their order.
    fn keys(&self) -> Vec<&str> {
        self.columns.iter().map(|(name, _)| name.as_str()).collect()
    }

    fn __len__(&self) -> usize {
        self.rows
    }

    /// Kind, cells and which of them are empty, of a column; nothing if there is no such column.
    fn column<'py>(
        &self,
        py: Python<'py>,
        name: &str,
    ) -> PyResult<Option<Column<'py>>> {
        let Some((_, cells)) = self.columns.iter().find(|(known, _)| known == name) else { return Ok(None) };
        Ok(Some((cells.bytes().0, cells.numpy(py)?, cells.empty(py)?)))
    }

    fn __repr__(&self) -> String {
        format!("<{} rows of {}>", self.rows, self.keys().join(", "))
    }

    /// Rows, and of each column its name, its kind, and the bytes of its offsets and values: for pickles.
    fn parts<'py>(
        &self,
        py: Python<'py>,
    ) -> (usize, Vec<(&str, &'static str, Bound<'py, PyBytes>, Bound<'py, PyBytes>)>) {
        let columns = self.columns.iter().map(|(name, cells)| {
            let (kind, offsets, values) = cells.bytes();
            (name.as_str(), kind, PyBytes::new(py, offsets), PyBytes::new(py, values))
        });
        (self.rows, columns.collect())
    }

    /// The table of its parts.
    #[staticmethod]
    fn of_parts(rows: usize, columns: Vec<(String, String, Vec<u8>, Vec<u8>)>) -> PyResult<Self> {
        let columns = columns.into_iter().map(|(name, kind, offsets, values)| {
            let cells = Cells::of_bytes(&kind, &offsets, &values, rows)
                .ok_or_else(|| PyValueError::new_err(format!("column `{name}` of the pickle is damaged")))?;
            Ok((name, cells))
        });
        Ok(Self { columns: columns.collect::<PyResult<_>>()?, rows })
    }

    /// The Arrow PyCapsule interface: one record batch, which is not copied but for flags, with the schema's metadata.
    fn stream<'py>(
        &self,
        py: Python<'py>,
        metadata: HashMap<String, String>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = Arc::new(self.schema().with_metadata(metadata));
        let failed = |error: ArrowError| Error::new_err(error.to_string());
        let arrays = self
            .columns
            .iter()
            .map(|(_, cells)| cells.arrow())
            .collect::<Result<Vec<_>, _>>()
            .map_err(failed)?;
        let batch = RecordBatch::try_new(Arc::clone(&schema), arrays).map_err(failed)?;
        let stream = FFI_ArrowArrayStream::new(Box::new(RecordBatchIterator::new([Ok(batch)], schema)));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }
}
