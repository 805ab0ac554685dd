//! Columns as a MATLAB file of level 5, which MATLAB, Octave and SciPy read: a variable for each.
//!
//! Numbers and flags are `double` (flags 1, 0, NaN where empty), whole numbers too, texts rows of `char` as wide as the
//! longest. The metadata are a text `run`, a JSON object. (MathWorks, *MAT-File Format*, chapter 1.)

use std::collections::HashSet;
use std::io;

use super::{Columns, Data, METADATA};

/// Longest name of a variable.
const LONGEST: usize = 63;

/// Types of elements in a file, and classes of arrays.
const INT8: u32 = 1;
const UINT16: u32 = 4;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const MATRIX: u32 = 14;
const CHAR_CLASS: u32 = 4;
const DOUBLE_CLASS: u32 = 6;

/// Returns the bytes of the file; `run`: metadata of the table, if any.
pub(super) fn bytes(table: &Columns, run: Option<&str>) -> io::Result<Vec<u8>> {
    let mut file = format!("{:116}", "MATLAB 5.0 MAT-file, written by Standstill").into_bytes();
    file.extend([0; 8]);
    file.extend(0x0100_u16.to_le_bytes());
    file.extend(*b"IM");
    let mut taken = HashSet::from([METADATA.to_owned()]);
    for (column, data) in table.iter() {
        let name = variable(&column.name, &mut taken);
        match data {
            // Exact up to 2^53, and what MATLAB calculates with.
            Data::Whole(cells) => doubles(&mut file, &name, cells.iter().map(|cell| *cell as f64))?,
            Data::Number(cells) | Data::Flag(cells) => doubles(&mut file, &name, cells.iter().copied())?,
            Data::Text(texts) => characters(&mut file, &name, &texts.iter().collect::<Vec<_>>())?,
        }
    }
    if let Some(run) = run {
        characters(&mut file, METADATA, &[run])?;
    }
    Ok(file)
}

/// Returns a name that no other variable has: letters, digits and underscores, and a letter first.
fn variable(column: &str, taken: &mut HashSet<String>) -> String {
    let mut name: String = column.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name.insert_str(0, "x_");
    }
    name.truncate(LONGEST);
    let plain = name.clone();
    for number in 2.. {
        if taken.insert(name.clone()) {
            break;
        }
        let end = format!("_{number}");
        name = plain.chars().take(LONGEST - end.len()).collect::<String>() + &end;
    }
    name
}

fn doubles(file: &mut Vec<u8>, name: &str, cells: impl ExactSizeIterator<Item = f64>) -> io::Result<()> {
    let size = [cells.len(), 1];
    matrix(file, name, DOUBLE_CLASS, size, DOUBLE, &cells.flat_map(f64::to_le_bytes).collect::<Vec<u8>>())
}

/// Texts as rows of a matrix, which is stored column by column.
fn characters(file: &mut Vec<u8>, name: &str, texts: &[&str]) -> io::Result<()> {
    let rows: Vec<Vec<u16>> = texts.iter().map(|text| text.encode_utf16().collect()).collect();
    let width = rows.iter().map(Vec::len).max().unwrap_or(0).max(1);
    let blank = u16::from(b' ');
    let cells = (0..width).flat_map(|k| rows.iter().map(move |row| row.get(k).copied().unwrap_or(blank)));
    let cells: Vec<u8> = cells.flat_map(u16::to_le_bytes).collect();
    matrix(file, name, CHAR_CLASS, [rows.len(), width], UINT16, &cells)
}

fn matrix(
    file: &mut Vec<u8>,
    name: &str,
    class: u32,
    size: [usize; 2],
    kind: u32,
    cells: &[u8],
) -> io::Result<()> {
    let mut content = Vec::new();
    element(&mut content, UINT32, &[class.to_le_bytes(), [0; 4]].concat())?;
    let size = size.map(|length| i32::try_from(length).unwrap_or(i32::MAX).to_le_bytes());
    element(&mut content, INT32, &size.concat())?;
    element(&mut content, INT8, name.as_bytes())?;
    element(&mut content, kind, cells)?;
    element(file, MATRIX, &content)
}

/// Returns the type, length and content, which is filled up to a multiple of eight bytes.
fn element(to: &mut Vec<u8>, kind: u32, content: &[u8]) -> io::Result<()> {
    let length = u32::try_from(content.len()).ok().filter(|length| *length < 1 << 31);
    let length = length.ok_or_else(|| {
        io::Error::new(
            io::ErrorKind::FileTooLarge,
            "a variable of a MATLAB file of level 5 ends at 2 GiB; Parquet takes tables of any length",
        )
    })?;
    to.extend(kind.to_le_bytes());
    to.extend(length.to_le_bytes());
    to.extend(content);
    to.resize(to.len().next_multiple_of(8), 0);
    Ok(())
}
