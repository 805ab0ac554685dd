//! A table in memory, column by column: for programs that take it from there, and for files that hold columns as a whole.

use std::ops::Range;

use super::{Cell, Column, Kind, TableError, check_row};

/// A table in memory.
///
/// ```
/// use standstill_table::{Column, Columns, Data, Kind, Cell};
///
/// let mut table = Columns::new(vec![Column::new("trial", Kind::Whole), Column::new("error_deg", Kind::Number)]);
/// table.row(&[Cell::from(0), Cell::from(0.25)])?;
/// table.row(&[Cell::from(1), Cell::Empty])?;
/// let [(_, Data::Whole(trials)), (_, Data::Number(errors))] = &table.into_columns()[..] else { unreachable!() };
/// assert_eq!(*trials, [0, 1]);
/// assert!(errors[0] == 0.25 && errors[1].is_nan());
/// # Ok::<(), standstill_table::TableError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Columns {
    heads: Vec<Column>,
    data: Vec<Data>,
    rows: u64,
}

/// The cells of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Data {
    /// Cells of [`Kind::Whole`]; −1 for an empty cell.
    Whole(Vec<i64>),
    /// Cells of [`Kind::Number`]; NaN for an empty cell.
    Number(Vec<f64>),
    /// Cells of [`Kind::Flag`]: 1, 0, or NaN for an empty cell.
    Flag(Vec<f64>),
    /// Cells of [`Kind::Text`]; no characters for an empty cell.
    Text(Texts),
}

/// Texts in a row.
#[derive(Clone, Debug, PartialEq)]
pub struct Texts {
    /// All of them, in UTF-8.
    pub bytes: Vec<u8>,
    /// Start of each text, and the end of the last one.
    pub offsets: Vec<i64>,
}

impl Texts {
    /// Returns the texts, one after the other.
    pub fn iter(&self) -> impl Iterator<Item = &str> {
        self.ranges().map(|range| std::str::from_utf8(&self.bytes[range]).unwrap_or_default())
    }

    /// Returns the position of each text.
    pub(super) fn ranges(&self) -> impl Iterator<Item = Range<usize>> {
        let place = |offset: i64| usize::try_from(offset).unwrap_or_default();
        self.offsets.windows(2).map(move |ends| place(ends[0])..place(ends[1]))
    }
}

impl Data {
    fn new(kind: Kind) -> Self {
        match kind {
            Kind::Whole => Self::Whole(Vec::new()),
            Kind::Number => Self::Number(Vec::new()),
            Kind::Flag => Self::Flag(Vec::new()),
            Kind::Text => Self::Text(Texts { bytes: Vec::new(), offsets: vec![0] }),
        }
    }

    fn push(&mut self, value: &Cell<'_>) {
        match (self, value) {
            (Self::Whole(data), Cell::Whole(whole)) => data.push(whole.cast_signed()),
            (Self::Whole(data), _) => data.push(-1),
            (Self::Number(data), Cell::Number(number)) if number.is_finite() => data.push(*number),
            (Self::Flag(data), Cell::Flag(flag)) => data.push(f64::from(u8::from(*flag))),
            (Self::Number(data) | Self::Flag(data), _) => data.push(f64::NAN),
            (Self::Text(Texts { bytes, offsets }), value) => {
                if let Cell::Text(text) = value {
                    bytes.extend_from_slice(text.as_bytes());
                }
                offsets.push(bytes.len().cast_signed() as i64);
            }
        }
    }
}

impl Data {
    fn clear(&mut self) {
        match self {
            Self::Whole(cells) => cells.clear(),
            Self::Number(cells) | Self::Flag(cells) => cells.clear(),
            Self::Text(Texts { bytes, offsets }) => {
                bytes.clear();
                offsets.truncate(1);
            }
        }
    }
}

impl Columns {
    /// Makes a table without rows.
    pub fn new(columns: Vec<Column>) -> Self {
        let data = columns.iter().map(|column| Data::new(column.kind)).collect();
        Self { heads: columns, data, rows: 0 }
    }

    /// Adds a row of one value for each column, of its kind or empty.
    ///
    /// # Errors
    /// [`TableError::Row`] if it does not fit; then nothing of it is added.
    pub fn row(&mut self, values: &[Cell<'_>]) -> Result<(), TableError> {
        check_row(&self.heads, self.rows, values)?;
        self.push(values);
        Ok(())
    }

    /// Adds a row that was checked.
    pub(super) fn push(&mut self, values: &[Cell<'_>]) {
        for (data, value) in self.data.iter_mut().zip(values) {
            data.push(value);
        }
        self.rows += 1;
    }

    /// Removes all rows; their memory stays.
    pub(super) fn clear(&mut self) {
        self.data.iter_mut().for_each(Data::clear);
        self.rows = 0;
    }

    /// Bytes of all texts.
    pub(super) fn text_bytes(&self) -> usize {
        let text = |data: &Data| if let Data::Text(texts) = data { texts.bytes.len() } else { 0 };
        self.data.iter().map(text).sum()
    }

    /// Returns the number of rows.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Returns the columns with their cells.
    pub fn iter(&self) -> impl Iterator<Item = (&Column, &Data)> {
        self.heads.iter().zip(&self.data)
    }

    /// Returns the columns with their cells, given away.
    pub fn into_columns(self) -> Vec<(Column, Data)> {
        self.heads.into_iter().zip(self.data).collect()
    }
}
