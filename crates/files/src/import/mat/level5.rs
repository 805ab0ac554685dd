//! MATLAB files of version 5 to 7: "Level 5" files, compressed or not.
//!
//! The reader is implemented here because maps need only a small part of the format (numeric matrices and structures of
//! them), and because a broken file must not cause a panic: every access is checked. The layout follows *MATLAB
//! MAT-File Format*, The MathWorks: a header of 128 bytes, then elements of a tag (type, length) and data. A matrix is
//! an element of elements: flags, dimensions, name, then values or fields.

use std::io::Read;

use standstill_numeric::whole;

use super::Variables;
use crate::import::arrays::{self, Array, MOST_POINTS};

/// Types of elements.
const COMPRESSED: u32 = 15;
const MATRIX: u32 = 14;

/// Classes of matrices.
const STRUCTURE: u8 = 2;
const DOUBLE: u8 = 6;
const LAST_NUMERIC: u8 = 15;

/// All variables that are read may unpack to this many bytes together: SyR-e keeps whole motor models with their geometry
/// in one.
const MOST_BYTES: u64 = 1 << 28;

/// Number of bytes unpacked of each variable to read its name.
const HEAD: u64 = 4096;

/// Largest number of separately compressed variables: each start of the decompression takes longer than the reading of
/// a name.
const MOST_PACKED: usize = 4096;

/// Largest number of names that are kept for messages.
const MOST_NAMES: usize = 40;
/// Largest number of bytes of a name; MATLAB's have at most 63.
const LONGEST_NAME: usize = 64;

/// Largest number of bytes for a matrix's dimensions; maps need only a few dimensions.
const LONGEST_DIMENSIONS: usize = 256;

/// Structures within structures that are followed.
const DEEPEST: usize = 4;

pub(super) struct Level5 {
    /// The top-level matrices that are asked for, unpacked, each without its tag.
    matrices: Vec<Vec<u8>>,
    names: Vec<String>,
    big: bool,
}

/// Bytes being read, in the file's byte order.
#[derive(Clone, Copy)]
struct Reader<'a> {
    bytes: &'a [u8],
    big: bool,
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, tail) = self.bytes.split_at_checked(count)?;
        self.bytes = tail;
        Some(head)
    }

    fn word(&mut self) -> Option<u32> {
        let bytes: [u8; 4] = self.take(4)?.try_into().ok()?;
        Some(if self.big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    /// Returns the type and data of the next element; small ones have both in eight bytes.
    fn element(&mut self) -> Option<(u32, &'a [u8])> {
        let first = self.word()?;
        if first >> 16 != 0 {
            let (length, kind) = (usize::try_from(first >> 16).ok()?, first & 0xffff);
            let data = self.take(4)?;
            return Some((kind, data.get(..length)?));
        }
        let length = usize::try_from(self.word()?).ok()?;
        let data = self.take(length)?;
        if first != COMPRESSED {
            // Padded to eight bytes, but for the end of a file that was cut there.
            self.take((8 - length % 8) % 8);
        }
        Some((first, data))
    }

    /// Returns the type and the beginning of the data of an element whose end may be missing.
    fn head(mut self) -> Option<(u32, &'a [u8])> {
        let kind = self.word()?;
        self.word()?;
        Some((kind, self.bytes))
    }

    /// Returns the numbers of an element of one of the numeric types.
    fn numbers(&self, kind: u32, data: &[u8]) -> Option<Vec<f64>> {
        // As numbers of eight bytes, bytes take eight times their room.
        if data.len() > 8 * MOST_POINTS {
            return None;
        }
        let kind = match kind {
            1 => "i1",
            2 => "u1",
            3 => "i2",
            4 => "u2",
            5 => "i4",
            6 => "u4",
            7 => "f4",
            9 => "f8",
            12 => "i8",
            13 => "u8",
            _ => return None,
        };
        arrays::numbers(kind, data, self.big)
    }
}

/// Returns at most `most` bytes of the unpacked data.
fn unpacked(data: &[u8], most: u64) -> Result<Vec<u8>, String> {
    let mut content = Vec::new();
    let read = flate2::read::ZlibDecoder::new(data).take(most).read_to_end(&mut content);
    read.map_err(|error| format!("a compressed variable that cannot be unpacked: {error}"))?;
    Ok(content)
}

/// Flags, dimensions and name of a matrix; `rest` has the bytes that follow.
struct Matrix<'a> {
    class: u8,
    complex: bool,
    dimensions: Vec<f64>,
    name: String,
    rest: Reader<'a>,
}

impl<'a> Matrix<'a> {
    fn open(mut rest: Reader<'a>) -> Option<Self> {
        let (_, flags) = rest.element()?;
        let first = Reader { bytes: flags, big: rest.big }.word()?;
        let (kind, data) = rest.element()?;
        let dimensions = rest.numbers(kind, data.get(..LONGEST_DIMENSIONS).unwrap_or(data))?;
        let name = rest.element()?.1;
        let name = String::from_utf8_lossy(name.get(..LONGEST_NAME).unwrap_or(name)).into_owned();
        let class = u8::try_from(first & 0xff).ok()?;
        Some(Self { class, complex: first & 0x0800 != 0, dimensions, name, rest })
    }

    /// Returns a field of a structure of one element.
    fn field(mut self, name: &str) -> Option<Matrix<'a>> {
        if self.class != STRUCTURE || self.dimensions.iter().any(|n| *n != 1.0) {
            return None;
        }
        let (kind, length) = self.rest.element()?;
        let length = *self.rest.numbers(kind, length)?.first()?;
        let (_, names) = self.rest.element()?;
        let names = names.chunks_exact(whole::<usize>(length).max(1));
        for text in names {
            let end = text.iter().position(|byte| *byte == 0).unwrap_or(text.len());
            let (kind, data) = self.rest.element()?;
            if &text[..end] == name.as_bytes() {
                return if kind == MATRIX {
                    Matrix::open(Reader { bytes: data, big: self.rest.big })
                } else {
                    None
                };
            }
        }
        None
    }

    fn array(mut self, path: &str) -> Result<Array, String> {
        if !(DOUBLE..=LAST_NUMERIC).contains(&self.class) {
            return Err(match self.class {
                1 => "a cell array".to_owned(),
                STRUCTURE => "a structure".to_owned(),
                4 => "a text".to_owned(),
                5 => "a sparse matrix, which `full` makes one".to_owned(),
                class => format!("a matrix of class {class}"),
            });
        }
        if self.complex {
            return Err("complex numbers".to_owned());
        }
        let [rows, columns] = self.dimensions[..] else {
            return Err(format!("{} dimensions", self.dimensions.len()));
        };
        if !(1.0..=MOST_POINTS as f64).contains(&(rows * columns)) {
            return Err(format!("{rows} × {columns} numbers, 1 to 1,048,576 are possible"));
        }
        let cut = || "less data than its size asks for".to_owned();
        let (kind, data) = self.rest.element().ok_or_else(cut)?;
        let values = self.rest.numbers(kind, data).ok_or_else(|| format!("values of type {kind}"))?;
        let (rows, columns): (usize, usize) = (whole(rows), whole(columns));
        if rows * columns == 0 || values.len() != rows * columns {
            return Err(cut());
        }
        Ok(Array::from_columns(path.to_owned(), rows, columns, &values))
    }
}

/// Returns whether this begins like a file of version 4, which has no header: five words in either order (a type
/// `MOPT` with O = 0, rows, columns, whether complex, length of the name), then the name and a zero.
fn is_level_4(bytes: &[u8]) -> bool {
    [false, true].into_iter().any(|big| {
        let mut reader = Reader { bytes, big };
        let words: Option<Vec<u32>> = (0..5).map(|_| reader.word()).collect();
        let Some(&[kind, rows, columns, complex, length]) = words.as_deref() else { return false };
        let [order, zero, precision, class] = [kind / 1000, kind / 100 % 10, kind / 10 % 10, kind % 10];
        let sensible = order <= 4 && zero == 0 && precision <= 5 && class <= 2 && complex <= 1;
        let size = u64::from(rows) * u64::from(columns) <= MOST_POINTS as u64 && (2..=64).contains(&length);
        let name = usize::try_from(length).ok().and_then(|length| reader.take(length));
        let named = |name: &[u8]| {
            name.split_last().is_some_and(|(zero, name)| *zero == 0 && name.iter().all(u8::is_ascii_graphic))
        };
        sensible && size && name.is_some_and(named)
    })
}

impl Level5 {
    /// Unpacks the variables with the wanted names; only the names of all others are read.
    pub(super) fn open(bytes: &[u8], wanted: &[&str]) -> Result<Self, String> {
        let big = match bytes.get(124..128) {
            Some([0, 1, b'I', b'M']) => false,
            Some([1, 0, b'M', b'I']) => true,
            _ if is_level_4(bytes) => return Err("a MATLAB file of version 4".to_owned()),
            _ => return Err("no MATLAB header".to_owned()),
        };
        let mut reader = Reader { bytes: &bytes[128..], big };
        let mut file = Self { matrices: Vec::new(), names: Vec::new(), big };
        let (mut room, mut packed) = (MOST_BYTES, 0);
        while !reader.bytes.is_empty() {
            let (kind, data) = reader.element().ok_or("a file that ends within a variable")?;
            let matrix = match kind {
                MATRIX if file.is_wanted(data, wanted) => data.to_vec(),
                COMPRESSED => {
                    packed += 1;
                    if packed > MOST_PACKED {
                        return Err(format!("more than {MOST_PACKED} packed variables"));
                    }
                    let head = unpacked(data, HEAD)?;
                    let Some((MATRIX, begin)) = (Reader { bytes: &head, big }).head() else { continue };
                    if !file.is_wanted(begin, wanted) {
                        continue;
                    }
                    let content = unpacked(data, room + 1)?;
                    if content.len() as u64 > room {
                        let most = MOST_BYTES >> 20;
                        return Err(format!("variables that unpack to more than {most} MiB"));
                    }
                    let Some((MATRIX, data)) = (Reader { bytes: &content, big }).element() else { continue };
                    data.to_vec()
                }
                _ => continue,
            };
            let size = matrix.len() as u64;
            room = room.checked_sub(size).ok_or("variables of more than 256 MiB")?;
            file.matrices.push(matrix);
        }
        Ok(file)
    }

    /// Returns true if the matrix that begins with these data is wanted, and notes its name.
    fn is_wanted(&mut self, data: &[u8], wanted: &[&str]) -> bool {
        let Some(matrix) = Matrix::open(Reader { bytes: data, big: self.big }) else { return false };
        let known = wanted.contains(&matrix.name.as_str());
        if self.names.len() < MOST_NAMES {
            self.names.push(matrix.name);
        }
        known
    }

    fn top(&self) -> impl Iterator<Item = Matrix<'_>> {
        self.matrices.iter().filter_map(|bytes| Matrix::open(Reader { bytes, big: self.big }))
    }
}

impl Variables for Level5 {
    fn array(&self, path: &str) -> Result<Option<Array>, String> {
        let mut parts = path.split('.').take(DEEPEST);
        let name = parts.next().unwrap_or_default();
        let Some(mut matrix) = self.top().find(|matrix| matrix.name == name) else { return Ok(None) };
        for part in parts {
            let Some(field) = matrix.field(part) else { return Ok(None) };
            matrix = field;
        }
        matrix.array(path).map(Some)
    }

    fn names(&self) -> Vec<String> {
        self.names.clone()
    }
}
