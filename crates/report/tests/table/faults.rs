//! What is no table, or no row of it, gives one line that says what and where.

use std::io::{self, Write};
use std::sync::Arc;

use parquet::data_type::{DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use standstill_report::table::{Column, Format, Kind, Reader, TableError, Value, Writer};

use super::{FORMATS, Row, columns, file, kind, named, read, write};

fn some_rows(count: u64) -> Vec<Row> {
    (0..count).map(|k| vec![k.into(), 0.5.into(), true.into(), format!("reason {k}").into()]).collect()
}

/// The message about a file, which starts with the file's path.
fn message(name: &str, bytes: &[u8]) -> String {
    let (folder, path) = file(name, bytes);
    let message = read(&path).expect_err("not a table").to_string();
    assert!(!message.contains('\n'), "one line: {message}");
    message.replace(&format!("{}/", folder.path().display()), "")
}

#[test]
fn regress_columns_and_metadata_that_make_no_table() {
    let column = |name: &str| Column::new(name, Kind::Text);
    let pair = |key: &str| (key.to_owned(), "x".to_owned());
    for format in FORMATS {
        let faults = [
            (vec![], vec![], "a table needs a column"),
            (vec![column("")], vec![], "a column needs a name"),
            (vec![column("run")], vec![], "`run` is the name of the column for metadata"),
            (vec![column("a"), column("a")], vec![], "the column `a` is there twice"),
            (vec![column("a")], vec![pair("k"), pair("k")], "the metadata have `k` twice"),
        ];
        for (columns, metadata, expected) in faults {
            let error = Writer::new(Vec::new(), format, columns, &metadata).map(|_| ());
            assert_eq!(error.expect_err(expected).to_string(), expected, "{format:?}");
        }
    }
}

#[test]
fn regress_rows_that_do_not_fit_leave_no_trace() {
    let faults: [(Row, &str); 5] = [
        (vec![Value::Empty; 3], "row 2: found 3 value(s), needed 4, one for each column"),
        (
            vec![(1_u64 << 63).into(), Value::Empty, Value::Empty, Value::Empty],
            "row 2, column `trial`: found the whole number 9223372036854775808, needed a whole number from 0 to 2^63 - 1",
        ),
        (
            vec![Value::Empty, 3_u64.into(), Value::Empty, Value::Empty],
            "row 2, column `error_deg`: found the whole number 3, needed a finite number",
        ),
        (
            vec![Value::Whole(9), Value::Empty, f64::NAN.into(), Value::Empty],
            "row 2, column `pole_correct`: found the number NaN, needed `true` or `false`",
        ),
        (
            vec![Value::Empty, "two\nlines".into(), Value::Empty, Value::Empty],
            "row 2, column `error_deg`: found the text `two\\nlines`, needed a finite number",
        ),
    ];
    let good = some_rows(2);
    for format in FORMATS {
        let mut writer = Writer::new(Vec::new(), format, columns(), &[]).expect("columns that fit");
        writer.row(&good[0]).expect("a row that fits");
        for (row, expected) in &faults {
            let error = writer.row(row).expect_err(expected);
            assert_eq!(error.to_string(), *expected, "{format:?}");
        }
        writer.row(&good[1]).expect("a row that fits");
        let bytes = writer.finish().expect("memory takes everything");
        assert_eq!(bytes, write(format, &good, &[]), "{format:?}");
    }
}

/// A disk that is full after so many bytes.
struct Full(usize);

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 = self.0.checked_sub(bytes.len()).ok_or(io::ErrorKind::StorageFull)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn law_a_full_disk_is_named_as_such() {
    for format in FORMATS {
        for room in [0, 100_000] {
            let fill = || -> Result<Full, TableError> {
                let mut writer = Writer::new(Full(room), format, columns(), &[])?;
                for row in some_rows(200_000) {
                    writer.row(&row)?;
                }
                writer.finish()
            };
            match fill().map(|_| ()) {
                Err(TableError::Write(error)) => assert_eq!(
                    error.kind(),
                    io::ErrorKind::StorageFull,
                    "{format:?} with {room} bytes: {error:?}"
                ),
                other => panic!("{format:?} with {room} bytes: {other:?}"),
            }
        }
    }
}

#[test]
fn regress_files_that_are_none() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    for format in FORMATS {
        let path = folder.path().join(named(format));
        let missing = read(&path).expect_err("no file");
        let TableError::Read { path: at, error } = missing else { panic!("{missing:?}") };
        assert_eq!((at.as_path(), error.kind()), (path.as_path(), io::ErrorKind::NotFound));
        std::fs::create_dir(&path).expect("nothing is there");
        let folder = read(&path).expect_err("a folder");
        assert!(matches!(folder, TableError::Read { .. }), "{format:?}: {folder:?}");
    }
    assert_eq!(message("table.txt", b""), "table.txt: not a table, whose name ends in .csv or .parquet");
    assert_eq!(
        message("table.csv", b""),
        "table.csv: an empty file; a table begins with the names of its columns"
    );
    for bytes in [&b""[..], b"PAR1", b"trial,error_deg\n1,0.5\n"] {
        let message = message("table.parquet", bytes);
        assert!(message.starts_with("table.parquet: not a complete Parquet file: "), "{message}");
    }
}

#[test]
fn law_a_truncated_parquet_file_is_an_error_wherever_it_ends() {
    let whole = write(Format::Parquet, &some_rows(300), &[("seed".to_owned(), "7".to_owned())]);
    for end in 0..whole.len() {
        let message = message("table.parquet", &whole[..end]);
        assert!(message.starts_with("table.parquet: not a complete Parquet file: "), "{end}: {message}");
    }
}

#[test]
fn regress_csv_names_line_column_and_what_was_found() {
    let header = "trial,error_deg,pole_correct,reason\n";
    let whole = "needed a whole number from 0 to 2^63 - 1";
    let faults = [
        ("1,0.5,true,x\n2,0.5\n", "line 3: found 2 field(s), needed 4 as in the header".to_owned()),
        ("1,0.5,true,x,y\n", "line 2: found 5 field(s), needed 4 as in the header".to_owned()),
        ("1,0.5,true,\"a\nb\"\nx,,,\n", format!("line 4, column `trial`: found `x`, {whole}")),
        ("1,0.5,true,x\r\n\r\n-1,,,\r\n", format!("line 4, column `trial`: found `-1`, {whole}")),
        ("9223372036854775808,,,\n", format!("line 2, column `trial`: found `9223372036854775808`, {whole}")),
        ("1,a b,,\n", "line 2, column `error_deg`: found `a b`, needed a finite number".to_owned()),
        ("1,1e999,,\n", "line 2, column `error_deg`: found `1e999`, needed a finite number".to_owned()),
        ("1,,yes,\n", "line 2, column `pole_correct`: found `yes`, needed `true` or `false`".to_owned()),
    ];
    for (rows, expected) in faults {
        let message = message("table.csv", format!("{header}{rows}").as_bytes());
        assert_eq!(message, format!("table.csv, {expected}"));
    }
    assert_eq!(
        message("table.csv", b"trial\n1\n\xff\n"),
        "table.csv, line 3: found bytes that are not UTF-8, needed a text"
    );
    assert_eq!(
        message("table.csv", b"trial,trial\n"),
        "table.csv, line 1: found the column `trial` twice, needed unique names"
    );
    assert_eq!(message("table.csv", b"run\n{}\n"), "table.csv: only metadata; a table needs a column");
}

#[test]
fn regress_csv_metadata_stand_in_the_first_row_as_a_json_object() {
    let found = |rows: &str| message("table.csv", format!("trial,run\n{rows}").as_bytes());
    let needed = "needed a JSON object of strings";
    assert_eq!(found("1,x\n"), format!("table.csv, line 2, column `run`: found `x`, {needed}"));
    assert_eq!(
        found("1,\"{\"\"seed\"\":7}\"\n"),
        format!("table.csv, line 2, column `run`: found `{{\\\"seed\\\":7}}`, {needed}")
    );
    // As when two tables were joined.
    assert_eq!(
        found("1,{}\n2,{}\n"),
        "table.csv, line 3, column `run`: found `{}`, needed nothing but in the first row"
    );
}

/// A Parquet file of another make: columns that cannot be empty, without compression.
fn foreign(schema: &str, whole: &[i64], number: &[f64]) -> Vec<u8> {
    let schema = Arc::new(parse_message_type(schema).expect("a schema"));
    let properties = Arc::new(WriterProperties::builder().build());
    let mut file = SerializedFileWriter::new(Vec::new(), schema, properties).expect("a file");
    let mut group = file.next_row_group().expect("a group");
    let mut column = group.next_column().expect("a column").expect("the first");
    column.typed::<Int64Type>().write_batch(whole, None, None).expect("values");
    column.close().expect("complete");
    let mut column = group.next_column().expect("a column").expect("the second");
    column.typed::<DoubleType>().write_batch(number, None, None).expect("values");
    column.close().expect("complete");
    group.close().expect("complete");
    file.into_inner().expect("memory takes everything")
}

#[test]
fn regress_parquet_of_another_make() {
    let schema = "message m { required int64 n (INTEGER(64,false)); required double x; }";
    let (_folder, path) = file("table.parquet", &foreign(schema, &[1, 2], &[f64::NAN, 0.5]));
    let mut reader = Reader::open(&path, kind).expect("a table");
    assert_eq!(reader.columns(), [Column::new("n", Kind::Whole), Column::new("x", Kind::Number)]);
    assert_eq!(reader.next_row().expect("whole"), Some(&[Value::Whole(1), Value::Empty][..]));
    assert_eq!(reader.next_row().expect("whole"), Some(&[Value::Whole(2), Value::Number(0.5)][..]));
    assert_eq!(reader.next_row().expect("whole"), None);

    assert_eq!(
        message("table.parquet", &foreign(schema, &[1, -1], &[0.0, 0.0])),
        "table.parquet, row 2, column `n`: found -1, needed a whole number from 0 to 2^63 - 1"
    );
    assert_eq!(
        message("table.parquet", &foreign(schema, &[1, 1], &[0.0, f64::INFINITY])),
        "table.parquet, row 2, column `x`: found inf, needed a finite number"
    );
    let time = "message m { required int64 n (TIMESTAMP(MICROS,true)); required double x; }";
    assert_eq!(
        message("table.parquet", &foreign(time, &[1], &[0.0])),
        "table.parquet: the column `n` is of none of the types INT64, DOUBLE, BOOLEAN and STRING"
    );
}

#[test]
fn law_damage_gives_an_error_or_a_table_but_no_panic() {
    let whole = write(Format::Parquet, &some_rows(40), &[]);
    let (_folder, path) = file("table.parquet", &whole);
    for at in 0..whole.len() {
        for bits in [0x55, 0x04] {
            let mut damaged = whole.clone();
            damaged[at] ^= bits;
            std::fs::write(&path, &damaged).expect("the folder takes files");
            // What is left may still be a table, with other values.
            let _ = read(&path);
        }
    }
}
