//! Tables as files: what was written is held by both formats, and numbers are read back.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::data_type::{DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::record::Field;
use parquet::schema::parser::parse_message_type;
use standstill_report::table::{Column, Format, Kind, Reader, TableError, Value, Writer};
use tempfile::TempDir;

const FORMATS: [Format; 2] = [Format::Csv, Format::Parquet];

type Row = Vec<Value<'static>>;

fn columns() -> Vec<Column> {
    [
        ("trial", Kind::Whole),
        ("error_deg", Kind::Number),
        ("pole_correct", Kind::Flag),
        ("reason", Kind::Text),
    ]
    .map(|(name, kind)| Column::new(name, kind))
    .to_vec()
}

fn metadata() -> Vec<(String, String)> {
    let scenario = ("scenario", "a = \"b\"\n[ü]\\ 'x', y");
    [("zeta", "last letter, first key"), ("seed", "7"), scenario, ("empty", "")]
        .map(|(key, value)| (key.to_owned(), value.to_owned()))
        .to_vec()
}

fn text(text: &'static str) -> Value<'static> {
    Value::Text(Cow::Borrowed(text))
}

fn write(format: Format, rows: &[Row], metadata: &[(String, String)]) -> Vec<u8> {
    let mut writer = Writer::new(Vec::new(), format, columns(), metadata).expect("columns that fit");
    for row in rows {
        writer.row(row).expect("a row that fits");
    }
    writer.finish().expect("memory takes everything")
}

fn parquet_of(bytes: &[u8]) -> SerializedFileReader<File> {
    let mut file = tempfile::tempfile().expect("a file for the test");
    file.write_all(bytes).expect("the folder takes files");
    SerializedFileReader::new(file).expect("whole")
}

/// The cells of a table without those of the metadata, as the libraries of the formats read them: numbers with their
/// bits, since 0 equals −0.
fn held(format: Format, bytes: &[u8]) -> Vec<Vec<String>> {
    let number = |number: f64| format!("{:016x}", number.to_bits());
    match format {
        Format::Csv => {
            let mut reader = csv::Reader::from_reader(bytes);
            let cell = |(k, text): (usize, &str)| match k {
                1 if !text.is_empty() => number(text.parse().expect("a number")),
                _ => text.to_owned(),
            };
            reader
                .records()
                .map(|row| row.expect("whole").iter().take(4).enumerate().map(cell).collect())
                .collect()
        }
        Format::Parquet => {
            let cell = |field: &Field| match field {
                Field::Null => String::new(),
                Field::Long(whole) => whole.to_string(),
                Field::Double(value) => number(*value),
                Field::Bool(flag) => flag.to_string(),
                Field::Str(text) => text.clone(),
                other => panic!("{other:?}"),
            };
            let file = parquet_of(bytes);
            let rows = file.get_row_iter(None).expect("rows");
            rows.map(|row| row.expect("whole").get_column_iter().map(|(_, field)| cell(field)).collect())
                .collect()
        }
    }
}

/// What a table should hold for these rows.
fn expected(rows: &[Row]) -> Vec<Vec<String>> {
    let cell = |value: &Value<'_>| match value {
        empty if empty.is_empty() => String::new(),
        Value::Empty => String::new(),
        Value::Whole(whole) => whole.to_string(),
        Value::Number(number) => format!("{:016x}", number.to_bits()),
        Value::Flag(flag) => flag.to_string(),
        Value::Text(text) => text.clone().into_owned(),
    };
    rows.iter().map(|row| row.iter().map(cell).collect()).collect()
}

/// Every kind of value, and every one that could be taken for another.
fn everything() -> Vec<Row> {
    let numbers = [0.0, -0.0, 0.1, -1.5e-5, 5e-324, f64::MIN_POSITIVE, f64::MAX, f64::MIN, 1e16, 2.0 / 3.0];
    let nothing = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    let texts = [
        "a,b",
        "\"",
        "say \"so\"",
        "two\nlines",
        "\r\n",
        "ψ_d in Wb 🧲",
        " kept ",
        "0",
        "true",
        "NaN",
        "run",
        ";",
        "\t",
        "'",
        "\u{feff}",
        "",
    ];
    let wholes = [0, 1, 1 << 53, (1 << 53) + 1, i64::MAX.cast_unsigned()];
    let mut rows = vec![vec![Value::Empty; 4]];
    let row = |place: usize, value: Value<'static>| {
        let mut row = vec![Value::Empty; 4];
        row[place] = value;
        row
    };
    rows.extend(wholes.map(|whole| row(0, whole.into())));
    rows.extend(numbers.into_iter().chain(nothing).map(|number| row(1, number.into())));
    rows.extend([true, false].map(|flag| row(2, flag.into())));
    rows.extend(texts.map(|value| row(3, text(value))));
    rows.push(vec![Value::Whole(3), Value::Number(0.5), Value::Flag(true), text("all")]);
    rows
}

fn some_rows(count: u64) -> Vec<Row> {
    (0..count).map(|k| vec![k.into(), 0.5.into(), true.into(), format!("reason {k}").into()]).collect()
}

#[test]
fn law_both_formats_hold_what_was_written() {
    let many = (0..150_000_u32).map(|k| {
        let number = (k % 7 != 0).then_some(f64::from(k).sqrt());
        let text = (k % 5 == 0).then(|| format!("reason {}", k % 3));
        vec![u64::from(k).into(), number.into(), (k % 11 == 0).into(), text.into()]
    });
    for rows in [everything(), many.collect()] {
        for format in FORMATS {
            assert!(held(format, &write(format, &rows, &metadata())) == expected(&rows), "{format:?}");
        }
    }
}

#[test]
fn law_long_texts_close_a_row_group_early() {
    let long = "x".repeat(1 << 20);
    let row = |k| vec![Value::Whole(k), Value::Empty, Value::Empty, format!("{k} {long}").into()];
    let rows: Vec<Row> = (0..20).map(row).collect();
    let bytes = write(Format::Parquet, &rows, &[]);
    assert!(held(Format::Parquet, &bytes) == expected(&rows));
    assert_eq!(parquet_of(&bytes).num_row_groups(), 3, "of 8 MiB");
}

#[test]
fn law_equal_tables_give_equal_bytes() {
    for format in FORMATS {
        assert_eq!(write(format, &everything(), &metadata()), write(format, &everything(), &metadata()));
    }
    let bytes = write(Format::Parquet, &everything(), &metadata());
    let holds = |text: &str| bytes.windows(text.len()).any(|window| window == text.as_bytes());
    assert!(holds("standstill") && !holds("parquet-rs"), "the library's version would change with it");
}

#[test]
fn golden_csv() {
    let rows = vec![
        vec![Value::Whole(0), Value::Number(1.5e-5), Value::Flag(true), Value::Empty],
        vec![Value::Whole(1), Value::Number(1e16), Value::Empty, text("a, \"b\"\nc")],
    ];
    let pairs = [("seed".to_owned(), "7".to_owned()), ("motor".to_owned(), "paper".to_owned())];
    let expected = "trial,error_deg,pole_correct,reason,run\n\
         0,0.000015,true,,\"{\"\"seed\"\":\"\"7\"\",\"\"motor\"\":\"\"paper\"\"}\"\n\
         1,1e16,,\"a, \"\"b\"\"\nc\",\n";
    let written = write(Format::Csv, &rows, &pairs);
    assert_eq!(String::from_utf8(written).expect("CSV is text"), expected);
    assert_eq!(write(Format::Csv, &[], &[]), b"trial,error_deg,pole_correct,reason\n");
}

#[test]
fn cross_csv_is_what_the_csv_crate_serialises() {
    let numbers = everything().into_iter().filter_map(|row| match row[1] {
        Value::Number(number) if number.is_finite() => Some(number),
        _ => None,
    });
    let rows: Vec<(u64, Option<f64>, Option<bool>, &str)> = numbers
        .chain((1..2000).map(|k| f64::from(k).powi(7).sin() * 10_f64.powi(k % 40 - 20)))
        .zip(0..)
        .map(|(number, k)| (k, (k % 9 != 4).then_some(number), (k % 3 != 1).then_some(k % 2 == 0), "a, b"))
        .collect();
    let mut other = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    other.write_record(columns().iter().map(|column| &column.name)).expect("memory takes everything");
    for row in &rows {
        other.serialize(row).expect("memory takes everything");
    }
    let own = |(whole, number, flag, text): (u64, _, _, &'static str)| -> Row {
        vec![whole.into(), Option::<f64>::into(number), Option::<bool>::into(flag), text.into()]
    };
    let rows: Vec<Row> = rows.into_iter().map(own).collect();
    assert_eq!(write(Format::Csv, &rows, &[]), other.into_inner().expect("memory takes everything"));
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
    let [a, b, c, d] = std::array::from_fn(|_| Value::Empty);
    let row = |place: usize, value: Value<'static>| {
        let mut row = vec![a.clone(), b.clone(), c.clone(), d.clone()];
        row[place] = value;
        row
    };
    let whole = "row 2, column `trial`: found the whole number 9223372036854775808, needed a whole number from 0 to 2^63 - 1";
    let faults: [(Row, &str); 5] = [
        (vec![Value::Empty; 3], "row 2: found 3 value(s), needed 4, one for each column"),
        (row(0, (1_u64 << 63).into()), whole),
        (row(1, 3_u64.into()), "row 2, column `error_deg`: found the whole number 3, needed a finite number"),
        (
            row(2, f64::NAN.into()),
            "row 2, column `pole_correct`: found the number NaN, needed `true` or `false`",
        ),
        (
            row(1, "two\nlines".into()),
            "row 2, column `error_deg`: found the text `two\\nlines`, needed a finite number",
        ),
    ];
    let good = some_rows(2);
    for format in FORMATS {
        let mut writer = Writer::new(Vec::new(), format, columns(), &[]).expect("columns that fit");
        writer.row(&good[0]).expect("a row that fits");
        for (row, expected) in &faults {
            assert_eq!(writer.row(row).expect_err(expected).to_string(), *expected, "{format:?}");
        }
        writer.row(&good[1]).expect("a row that fits");
        assert_eq!(
            writer.finish().expect("memory takes everything"),
            write(format, &good, &[]),
            "{format:?}"
        );
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
    for (format, room) in FORMATS.into_iter().flat_map(|format| [(format, 0), (format, 100_000)]) {
        let fill = || -> Result<Full, TableError> {
            let mut writer = Writer::new(Full(room), format, columns(), &[])?;
            some_rows(200_000).iter().try_for_each(|row| writer.row(row))?;
            writer.finish()
        };
        match fill().map(|_| ()) {
            Err(TableError::Write(error)) => assert_eq!(error.kind(), io::ErrorKind::StorageFull),
            other => panic!("{format:?} with {room} bytes: {other:?}"),
        }
    }
}

/// A file with these bytes; it lasts as long as the folder.
fn file(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("the folder takes files");
    (folder, path)
}

/// The numbers of the columns `trial` and `error_deg`, or else of the first.
fn numbers(path: &Path) -> Result<Vec<[Option<f64>; 2]>, TableError> {
    let reader = Reader::open(path)?;
    let place = |name: &str| reader.columns.iter().position(|column| column == name).unwrap_or(0);
    let places = [place("error_deg"), place("x")];
    let mut rows = Vec::new();
    reader.numbers(places, |row| rows.push(row))?;
    Ok(rows)
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
        .map(|number| vec![Value::Whole(1), (*number).into(), Value::Empty, text("two\nlines")])
        .collect();
    for format in FORMATS {
        let (_folder, path) =
            file(&format!("table.{}", format.extension()), &write(format, &rows, &metadata()));
        let reader = Reader::open(&path).expect("a table");
        assert_eq!(reader.columns, ["trial", "error_deg", "pole_correct", "reason"], "{format:?}");
        assert_eq!(reader.metadata, metadata().into_iter().collect::<BTreeMap<_, _>>(), "{format:?}");
        let mut found = Vec::new();
        reader.numbers([1, 1], |[a, b]| found.push((a, b))).expect("whole");
        assert!(found.into_iter().eq(given.iter().map(|number| (*number, *number))), "{format:?}");
    }
    // Only CSV needs a row for its metadata.
    for (format, kept) in FORMATS.into_iter().zip([0, metadata().len()]) {
        let (_folder, path) =
            file(&format!("table.{}", format.extension()), &write(format, &[], &metadata()));
        assert_eq!(Reader::open(&path).expect("a table").metadata.len(), kept);
        assert!(numbers(&path).expect("no rows").is_empty());
    }
}

#[test]
fn regress_csv_as_other_programs_save_it() {
    let saved = "\u{feff}trial,error_deg,note\r\n1,nan,x\r\n\r\n2,1E-3,\"y\r\nz\"\r\n3,,";
    let (_folder, path) = file("table.CSV", saved.as_bytes());
    let found: Vec<_> = numbers(&path).expect("a table").into_iter().map(|[error, _]| error).collect();
    assert_eq!(found, [None, Some(1e-3), None]);
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
    let whole = write(Format::Parquet, &some_rows(300), &[("seed".to_owned(), "7".to_owned())]);
    let ends = (0..whole.len()).map(|end| &whole[..end]);
    for bytes in ends.chain([&b"trial,error_deg\n1,0.5\n"[..]]) {
        let message = message("table.parquet", bytes);
        assert!(message.starts_with("table.parquet: not a complete Parquet file: "), "{message}");
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
    let schema = parse_message_type("message m { required int64 n; required double x; }").expect("a schema");
    let properties = Arc::new(WriterProperties::builder().build());
    let mut file = SerializedFileWriter::new(Vec::new(), Arc::new(schema), properties).expect("a file");
    let mut group = file.next_row_group().expect("a group");
    let mut column = group.next_column().expect("a column").expect("the first");
    column.typed::<Int64Type>().write_batch(&vec![1; number.len()], None, None).expect("values");
    column.close().expect("complete");
    let mut column = group.next_column().expect("a column").expect("the second");
    column.typed::<DoubleType>().write_batch(number, None, None).expect("values");
    column.close().expect("complete");
    group.close().expect("complete");
    file.into_inner().expect("memory takes everything")
}

#[test]
fn regress_parquet_of_another_make() {
    let read = |bytes: &[u8], places| {
        let (_folder, path) = file("table.parquet", bytes);
        let mut rows = Vec::new();
        let result = Reader::open(&path).and_then(|reader| reader.numbers(places, |[x]| rows.push(x)));
        result.map(|()| rows).map_err(|error| error.to_string().replace(&path.display().to_string(), "T"))
    };
    assert_eq!(read(&foreign(&[f64::NAN, 0.5]), [1]), Ok(vec![None, Some(0.5)]));
    let infinite = "T, row 2, column `x`: found inf, needed a finite number";
    assert_eq!(read(&foreign(&[0.0, f64::INFINITY]), [1]), Err(infinite.to_owned()));
    let whole = "T: unreadable after row 0: the column `n` has no numbers";
    assert_eq!(read(&foreign(&[0.0]), [0]), Err(whole.to_owned()));
}

#[test]
fn law_damage_gives_an_error_or_a_table_but_no_panic() {
    let whole = write(Format::Parquet, &some_rows(40), &[]);
    let (_folder, path) = file("table.parquet", &whole);
    for (at, bits) in (0..whole.len()).flat_map(|at| [(at, 0x55), (at, 0x04)]) {
        let mut damaged = whole.clone();
        damaged[at] ^= bits;
        std::fs::write(&path, &damaged).expect("the folder takes files");
        // What is left may still be a table, with other values.
        let _ = numbers(&path);
    }
}
