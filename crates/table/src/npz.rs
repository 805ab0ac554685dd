//! Columns as a NumPy archive: a zip of one `.npy` file for each.
//!
//! Numbers are `<f8`, whole numbers `<i8`, flags `<f8` (1, 0, NaN where empty), texts `<U` as wide as the longest. The
//! metadata are a text without dimension, a JSON object. (NumPy Enhancement Proposal 1, "A simple file format for NumPy
//! arrays".)

use std::io::{self, Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::{Columns, Data, METADATA};

/// Returns the bytes of the archive; `run`: metadata of the table, if any.
pub(super) fn bytes(table: &Columns, run: Option<&str>) -> io::Result<Vec<u8>> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let rows = format!("({},)", table.rows());
    for (column, data) in table.iter() {
        let (kind, cells) = match data {
            Data::Whole(cells) => ("<i8".to_owned(), cells.iter().flat_map(|x| x.to_le_bytes()).collect()),
            Data::Number(cells) | Data::Flag(cells) => {
                ("<f8".to_owned(), cells.iter().flat_map(|x| x.to_le_bytes()).collect())
            }
            Data::Text(texts) => utf32(|| texts.iter()),
        };
        array(&mut zip, &column.name, &kind, &rows, &cells)?;
    }
    if let Some(run) = run {
        let (kind, cells) = utf32(|| std::iter::once(run));
        array(&mut zip, METADATA, &kind, "()", &cells)?;
    }
    Ok(zip.finish()?.into_inner())
}

/// Returns the kind of these texts and their cells: characters of four bytes, padded with zeros.
fn utf32<'a, I: Iterator<Item = &'a str>>(texts: impl Fn() -> I) -> (String, Vec<u8>) {
    let width = texts().map(|text| text.chars().count()).max().unwrap_or(0).max(1);
    let mut cells = Vec::new();
    for text in texts() {
        let padded = text.chars().chain(std::iter::repeat('\0')).take(width);
        cells.extend(padded.flat_map(|c| u32::from(c).to_le_bytes()));
    }
    (format!("<U{width}"), cells)
}

fn array(
    zip: &mut ZipWriter<Cursor<Vec<u8>>>,
    name: &str,
    kind: &str,
    shape: &str,
    cells: &[u8],
) -> io::Result<()> {
    // As it is: numbers hardly shrink, and programs can map what is not compressed. The time is that of no clock.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(zip::DateTime::default())
        .large_file(cells.len() > 1 << 31);
    zip.start_file(format!("{name}.npy"), options)?;
    let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    // The cells begin at a multiple of 64 bytes behind the ten of magic, version and length.
    let padding = 63 - (10 + header.len()) % 64;
    header.extend(std::iter::repeat_n(' ', padding));
    header.push('\n');
    let length = u16::try_from(header.len()).map_err(io::Error::other)?;
    zip.write_all(b"\x93NUMPY\x01\x00")?;
    zip.write_all(&length.to_le_bytes())?;
    zip.write_all(header.as_bytes())?;
    zip.write_all(cells)
}
