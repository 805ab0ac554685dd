//! Numbers are read back, from own tables and from others; damage is named.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::data_type::{BoolType, DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use standstill_table::{Cell, Column, Format, Kind, Reader, TableError};
use tempfile::TempDir;

use super::{FORMATS, Row, metadata, some_rows, text, write};

/// A file with these bytes; it lasts as long as the folder.
fn file(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("the folder takes files");
    (folder, path)
}

/// The numbers of a column.
fn column(reader: Reader, place: usize) -> Result<Vec<Option<f64>>, TableError> {
    let columns = [Column::new(reader.columns[place].as_str(), Kind::Number)];
    let mut rows = Vec::new();
    reader.values(&columns, |cells| {
        rows.push(if let Cell::Number(number) = cells[0] { Some(number) } else { None });
    })?;
    Ok(rows)
}

/// The numbers of the column `error_deg`, or else of the first.
fn numbers(path: &Path) -> Result<Vec<Option<f64>>, TableError> {
    let reader = Reader::open(path)?;
    let place = reader.columns.iter().position(|column| column == "error_deg").unwrap_or(0);
    column(reader, place)
}

/// The message about a file, which starts with the file's path.
fn message(name: &str, bytes: &[u8]) -> String {
    let (folder, path) = file(name, bytes);
    let message = numbers(&path).expect_err("not a table of numbers").to_string();
    assert!(!message.contains('\n'), "one line: {message}");
    message.replace(&format!("{}/", folder.path().display()), "")
}

#[test]
fn law_numbers_and_metadata_are_read_back_from_both_formats() {
    let given: Vec<Option<f64>> =
        (0..150_000_u32).map(|k| (k % 7 != 0).then_some(f64::from(k).sqrt())).collect();
    let rows: Vec<Row> = given
        .iter()
        .map(|number| vec![Cell::Whole(1), (*number).into(), Cell::Empty, text("two\nlines")])
        .collect();
    for format in FORMATS {
        let (_folder, path) = file(&format!("table.{}", format.name()), &write(format, &rows, &metadata()));
        let reader = Reader::open(&path).expect("a table");
        assert_eq!(reader.columns, ["trial", "error_deg", "pole_correct", "reason"], "{format:?}");
        assert_eq!(reader.metadata, metadata().into_iter().collect::<BTreeMap<_, _>>(), "{format:?}");
        assert_eq!(column(reader, 1).expect("whole"), given, "{format:?}");
    }
    // Only CSV needs a row for its metadata.
    for (format, kept) in FORMATS.into_iter().zip([0, metadata().len()]) {
        let (_folder, path) = file(&format!("table.{}", format.name()), &write(format, &[], &metadata()));
        assert_eq!(Reader::open(&path).expect("a table").metadata.len(), kept);
        assert!(numbers(&path).expect("no rows").is_empty());
    }
}

#[test]
fn regress_csv_as_other_programs_save_it() {
    let saved = "\u{feff}trial,error_deg,note\r\n1,nan,x\r\n\r\n2,1E-3,\"y\r\nz\"\r\n3,,";
    let (_folder, path) = file("table.CSV", saved.as_bytes());
    assert_eq!(numbers(&path).expect("a table"), [None, Some(1e-3), None]);
}

#[test]
fn regress_files_that_are_none() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    for name in ["table.csv", "table.parquet"] {
        let path = folder.path().join(name);
        let missing = numbers(&path).expect_err("no file");
        let TableError::Read { path: at, error } = missing else { panic!("{missing:?}") };
        assert_eq!((at.as_path(), error.kind()), (path.as_path(), io::ErrorKind::NotFound));
        std::fs::create_dir(&path).expect("nothing is there");
        assert!(matches!(numbers(&path), Err(TableError::Read { .. })), "{name}");
    }
    assert_eq!(message("table.txt", b""), "table.txt: not a table, whose name ends in .csv or .parquet");
    let empty = "table.csv: an empty file; a table begins with the names of its columns";
    assert_eq!(message("table.csv", b""), empty);
    let message = message("table.parquet", b"trial,error_deg\n1,0.5\n");
    assert!(message.starts_with(INCOMPLETE), "{message}");
    // Each end within the footer's last bytes, and some of those before them.
    incomplete(|end, len| end % 16 == 0 || end + 24 > len);
}

#[test]
#[ignore = "all ends; some of them run by default: scripts/test-all.sh long"]
fn regress_parquet_files_that_end_at_any_byte() {
    incomplete(|_, _| true);
}

const INCOMPLETE: &str = "table.parquet: not a complete Parquet file: ";

/// A file of Parquet that ends at these bytes of its length is refused.
fn incomplete(takes: fn(usize, usize) -> bool) {
    let whole = write(Format::Parquet, &some_rows(300), &[("seed".to_owned(), "7".to_owned())]);
    for end in (0..whole.len()).filter(|end| takes(*end, whole.len())) {
        let message = message("table.parquet", &whole[..end]);
        assert!(message.starts_with(INCOMPLETE), "{end}: {message}");
    }
}

#[test]
fn regress_csv_names_line_column_and_what_was_found() {
    let metadata = "needed a JSON object of strings";
    for (rows, expected) in [
        ("0.5,x,\n2,0.5\n", "line 3: found 2 field(s), needed 3 as in the header".to_owned()),
        ("0.5,\"a\nb\",\nx,,\n", "line 4, column `error_deg`: found `x`, needed a finite number".to_owned()),
        (
            "0.5,x,\r\n\r\na b,,\r\n",
            "line 4, column `error_deg`: found `a b`, needed a finite number".to_owned(),
        ),
        ("1e999,,\n", "line 2, column `error_deg`: found `1e999`, needed a finite number".to_owned()),
        ("1,,x\n", format!("line 2, column `run`: found `x`, {metadata}")),
        ("1,,\"{\"\"s\"\":7}\"\n", format!("line 2, column `run`: found `{{\\\"s\\\":7}}`, {metadata}")),
    ] {
        let message = message("table.csv", format!("error_deg,reason,run\n{rows}").as_bytes());
        assert_eq!(message, format!("table.csv, {expected}"));
    }
    let bytes = message("table.csv", b"error_deg\n1\n\xff\n");
    assert_eq!(bytes, "table.csv, line 3: found bytes that are not UTF-8, needed a text");
}

/// A Parquet file of another make: columns that cannot be empty, without compression.
fn foreign(number: &[f64]) -> Vec<u8> {
    let schema = parse_message_type("message m { required int64 n; required double x; required boolean b; }")
        .expect("a schema");
    let properties = Arc::new(WriterProperties::builder().build());
    let mut file = SerializedFileWriter::new(Vec::new(), Arc::new(schema), properties).expect("a file");
    let mut group = file.next_row_group().expect("a group");
    let mut column = group.next_column().expect("a column").expect("the first");
    column.typed::<Int64Type>().write_batch(&vec![1; number.len()], None, None).expect("values");
    column.close().expect("complete");
    let mut column = group.next_column().expect("a column").expect("the second");
    column.typed::<DoubleType>().write_batch(number, None, None).expect("values");
    column.close().expect("complete");
    let mut column = group.next_column().expect("a column").expect("the third");
    column.typed::<BoolType>().write_batch(&vec![true; number.len()], None, None).expect("values");
    column.close().expect("complete");
    group.close().expect("complete");
    file.into_inner().expect("memory takes everything")
}

#[test]
fn regress_parquet_of_another_make() {
    let read = |bytes: &[u8], place| {
        let (_folder, path) = file("table.parquet", bytes);
        let result = Reader::open(&path).and_then(|reader| column(reader, place));
        result.map_err(|error| error.to_string().replace(&path.display().to_string(), "T"))
    };
    assert_eq!(read(&foreign(&[f64::NAN, 0.5]), 1), Ok(vec![None, Some(0.5)]));
    let infinite = "T, row 2, column `x`: found inf, needed a finite number";
    assert_eq!(read(&foreign(&[0.0, f64::INFINITY]), 1), Err(infinite.to_owned()));
    for (place, what) in [(0, "`n`: found 1"), (2, "`b`: found true")] {
        let neither = format!("T, row 1, column {what}, needed a finite number");
        assert_eq!(read(&foreign(&[0.0]), place), Err(neither));
    }
}

#[test]
fn law_damage_gives_an_error_or_a_table_but_no_panic() {
    // Each second byte in one of two ways by turns.
    damaged(|at, bits| at % 4 == if bits == 0x55 { 0 } else { 2 });
}

#[test]
#[ignore = "each byte in two ways: scripts/test-all.sh long"]
fn law_damage_of_any_byte_gives_an_error_or_a_table_but_no_panic() {
    damaged(|_, _| true);
}

/// Reads a file of Parquet with one byte changed, for these bytes and bits.
fn damaged(takes: fn(usize, u8) -> bool) {
    let whole = write(Format::Parquet, &some_rows(40), &[]);
    let (_folder, path) = file("table.parquet", &whole);
    let changes = (0..whole.len()).flat_map(|at| [(at, 0x55), (at, 0x04)]);
    for (at, bits) in changes.filter(|(at, bits)| takes(*at, *bits)) {
        let mut damaged = whole.clone();
        damaged[at] ^= bits;
        std::fs::write(&path, &damaged).expect("the folder takes files");
        // What is left may still be a table, with other values.
        let _ = numbers(&path);
    }
}

#[test]
fn regress_a_whole_number_of_a_csv_file_ends_where_those_of_other_formats_do() {
    for (text, fits) in [("9223372036854775807", true), ("9223372036854775808", false)] {
        let (_folder, path) = file("table.csv", format!("seed\n{text}\n").as_bytes());
        let read = Reader::open(&path).expect("a table").values(&[Column::new("seed", Kind::Whole)], |_| {});
        let message = read.err().map(|error| error.to_string());
        assert_eq!(message.is_none(), fits, "{message:?}");
        assert!(message.is_none_or(|said| said.ends_with("needed a whole number from 0 to 2^63 - 1")));
    }
}
