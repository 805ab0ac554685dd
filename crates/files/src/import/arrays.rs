//! Conversion of four arrays to points, for all files with arrays.

use std::fmt;

use super::{MapError, MapPoint, MapSamples, Place};

/// An array of one or two dimensions, with its values row by row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Array {
    /// Name of the array in the file.
    pub(super) name: String,
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) values: Vec<f64>,
}

/// The current that changes from row to row, for files that give the currents as axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rows {
    /// i_d, as indices go in NumPy.
    Direct,
    /// i_q, as MATLAB's `meshgrid(Id, Iq)` lays them out.
    Quadrature,
}

/// The most that a map may have: 1,024 × 1,024.
pub(super) const MOST_POINTS: usize = 1 << 20;

impl Array {
    /// Returns whether all its values are in one line.
    fn is_vector(&self) -> bool {
        self.rows == 1 || self.columns == 1
    }

    fn shape(&self) -> String {
        format!("`{}` of {} × {}", self.name, self.rows, self.columns)
    }

    /// Makes the values of a column-major file, row by row.
    pub(super) fn from_columns(name: String, rows: usize, columns: usize, values: &[f64]) -> Self {
        let values = (0..rows).flat_map(|r| (0..columns).map(move |c| values[c * rows + r])).collect();
        Self { name, rows, columns, values }
    }
}

/// Returns the points of i_d, i_q, ψ_d, ψ_q: either all of one shape, or the currents as axes of the fluxes.
pub(super) fn points(file: &str, arrays: &[Array; 4], rows: Rows) -> Result<MapSamples, MapError> {
    let error = |found: String, needed: &str| MapError::new(file, None, found, needed.to_owned());
    for array in arrays {
        if array.values.len() > MOST_POINTS {
            return Err(error(array.shape(), "at most 1,048,576 points, 1,024 × 1,024"));
        }
        if let Some(at) = array.values.iter().position(|value| !value.is_finite()) {
            let place = format!("`{}`, {}", array.name, place(array, at));
            let found = array.values[at].to_string();
            return Err(MapError::new(file, Some(&place), found, "a finite number".to_owned()));
        }
    }
    let [i_d, i_q, psi_d, psi_q] = arrays;
    let alike = |a: &Array, b: &Array| (a.rows, a.columns) == (b.rows, b.columns);
    if !alike(psi_d, psi_q) {
        return Err(error(format!("{} and {}", psi_d.shape(), psi_q.shape()), "both of one shape"));
    }
    let count = psi_d.values.len();
    let point = |k: usize, d: usize, q: usize| MapPoint {
        i_d: i_d.values[d],
        i_q: i_q.values[q],
        psi_d: psi_d.values[k],
        psi_q: psi_q.values[k],
        place: place(psi_d, k),
    };
    let same = [i_d, i_q]
        .iter()
        .all(|i| alike(i, psi_d) || (i.is_vector() && psi_d.is_vector() && i.values.len() == count));
    let points = if same {
        (0..count).map(|k| point(k, k, k)).collect()
    } else {
        let (n, m) = (i_d.values.len(), i_q.values.len());
        let (expected, words) = match rows {
            Rows::Direct => ((n, m), "fluxes with i_d along the first index and i_q along the second"),
            Rows::Quadrature => {
                ((m, n), "fluxes with i_q along the rows and i_d along the columns, as meshgrid(Id, Iq)")
            }
        };
        if !i_d.is_vector() || !i_q.is_vector() || (psi_d.rows, psi_d.columns) != expected {
            let found = format!("{}, {} and {}", i_d.shape(), i_q.shape(), psi_d.shape());
            let turned = i_d.is_vector() && i_q.is_vector() && (psi_d.columns, psi_d.rows) == expected;
            let hint = if turned { "; the fluxes look transposed" } else { "" };
            return Err(error(
                found,
                &format!("all of one shape, or {words}: here {} × {}{hint}", expected.0, expected.1),
            ));
        }
        let columns = psi_d.columns;
        let pair = |k: usize| match rows {
            Rows::Direct => (k / columns, k % columns),
            Rows::Quadrature => (k % columns, k / columns),
        };
        (0..count).map(|k| point(k, pair(k).0, pair(k).1)).collect()
    };
    Ok(MapSamples { file: file.to_owned(), points, pole_pairs: None, resistance: None })
}

fn place(array: &Array, at: usize) -> Place {
    if array.is_vector() {
        Place::Element(at + 1)
    } else {
        Place::Cell(at / array.columns + 1, at % array.columns + 1)
    }
}

/// Returns the names in a row, for messages.
pub(super) fn listed(names: impl Iterator<Item = impl fmt::Display>) -> String {
    let all: Vec<String> = names.take(20).map(|name| name.to_string()).collect();
    if all.is_empty() { "none".to_owned() } else { all.join(", ") }
}

/// Returns the numbers of an array by NumPy's name of their type, such as `f8` or `u2`; none for a type without real
/// numbers.
pub(super) fn numbers(kind: &str, data: &[u8], big: bool) -> Option<Vec<f64>> {
    Some(match kind {
        "f8" => each(data, big, f64::from_le_bytes),
        "f4" => each(data, big, |bytes| f64::from(f32::from_le_bytes(bytes))),
        "i8" => each(data, big, |bytes| i64::from_le_bytes(bytes) as f64),
        "i4" => each(data, big, |bytes| f64::from(i32::from_le_bytes(bytes))),
        "i2" => each(data, big, |bytes| f64::from(i16::from_le_bytes(bytes))),
        "i1" => each(data, big, |bytes| f64::from(i8::from_le_bytes(bytes))),
        "u8" => each(data, big, |bytes| u64::from_le_bytes(bytes) as f64),
        "u4" => each(data, big, |bytes| f64::from(u32::from_le_bytes(bytes))),
        "u2" => each(data, big, |bytes| f64::from(u16::from_le_bytes(bytes))),
        "u1" => each(data, big, |bytes| f64::from(u8::from_le_bytes(bytes))),
        _ => return None,
    })
}

/// Returns the numbers of N bytes each; `of` takes them in little-endian order.
fn each<const N: usize>(data: &[u8], big_endian: bool, of: impl Fn([u8; N]) -> f64) -> Vec<f64> {
    data.chunks_exact(N)
        .map(|bytes| {
            let mut number = [0; N];
            number.copy_from_slice(bytes);
            if big_endian {
                number.reverse();
            }
            of(number)
        })
        .collect()
}
