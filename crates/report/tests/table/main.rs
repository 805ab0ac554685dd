//! Tables as files: what was written is read again, in both formats.

mod faults;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use standstill_report::table::{Column, Format, Kind, Reader, TableError, Value, Writer};
use tempfile::TempDir;

const FORMATS: [Format; 2] = [Format::Csv, Format::Parquet];

type Row = Vec<Value<'static>>;

fn columns() -> Vec<Column> {
    vec![
        Column::new("trial", Kind::Whole),
        Column::new("error_deg", Kind::Number),
        Column::new("pole_correct", Kind::Flag),
        Column::new("reason", Kind::Text),
    ]
}

fn kind(name: &str) -> Kind {
    columns().into_iter().find(|column| column.name == name).map_or(Kind::Text, |column| column.kind)
}

fn metadata() -> Vec<(String, String)> {
    [
        ("zeta", "last letter, first key"),
        ("seed", "7"),
        ("scenario", "a = \"b\"\n[ü]\\ 'x', y"),
        ("empty", ""),
    ]
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

/// A file with these bytes; it lasts as long as the folder.
fn file(name: &str, bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("the folder takes files");
    (folder, path)
}

fn named(format: Format) -> String {
    format!("table.{}", format.extension())
}

fn rows(reader: &mut Reader) -> Result<Vec<Row>, TableError> {
    let mut rows = Vec::new();
    while let Some(row) = reader.next_row()? {
        rows.push(row.to_vec());
    }
    Ok(rows)
}

fn read(path: &Path) -> Result<Vec<Row>, TableError> {
    rows(&mut Reader::open(path, kind)?)
}

/// Every kind of value, and every one that could be taken for another.
fn everything() -> Vec<Row> {
    let numbers = [0.0, -0.0, 0.1, -1.5e-5, 5e-324, f64::MIN_POSITIVE, f64::MAX, f64::MIN, 1e16, 2.0 / 3.0];
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
    ];
    let wholes = [0, 1, 1 << 53, (1 << 53) + 1, i64::MAX.cast_unsigned()];
    let mut rows = vec![vec![Value::Empty; 4]];
    let row = |place: usize, value: Value<'static>| {
        let mut row = vec![Value::Empty; 4];
        row[place] = value;
        row
    };
    rows.extend(wholes.map(|whole| row(0, whole.into())));
    rows.extend(numbers.map(|number| row(1, number.into())));
    rows.extend([true, false].map(|flag| row(2, flag.into())));
    rows.extend(texts.map(|value| row(3, text(value))));
    rows.push(vec![Value::Whole(3), Value::Number(0.5), Value::Flag(true), text("all")]);
    rows
}

/// With the bits of numbers, since 0 equals −0.
fn exact(rows: &[Row]) -> Vec<Vec<String>> {
    let cell = |value: &Value<'_>| match value {
        Value::Number(number) => format!("{:016x}", number.to_bits()),
        other => format!("{other:?}"),
    };
    rows.iter().map(|row| row.iter().map(cell).collect()).collect()
}

#[test]
fn law_both_formats_give_back_what_was_written() {
    for format in FORMATS {
        let bytes = write(format, &everything(), &metadata());
        let (_folder, path) = file(&named(format), &bytes);
        let mut reader = Reader::open(&path, kind).expect("a table");
        assert_eq!(reader.columns(), columns(), "{format:?}");
        assert_eq!(reader.metadata(), metadata(), "{format:?}");
        assert_eq!(exact(&rows(&mut reader).expect("whole")), exact(&everything()), "{format:?}");
        assert!(reader.next_row().expect("the end stays the end").is_none());
    }
}

#[test]
fn law_what_one_format_cannot_hold_neither_does() {
    let given = vec![
        vec![Value::Whole(1), f64::NAN.into(), true.into(), text("")],
        vec![Value::Whole(2), f64::INFINITY.into(), None::<bool>.into(), String::new().into()],
        vec![Value::Whole(3), f64::NEG_INFINITY.into(), Some(true).into(), None::<&str>.into()],
    ];
    let held = vec![
        vec![Value::Whole(1), Value::Empty, Value::Flag(true), Value::Empty],
        vec![Value::Whole(2), Value::Empty, Value::Empty, Value::Empty],
        vec![Value::Whole(3), Value::Empty, Value::Flag(true), Value::Empty],
    ];
    for format in FORMATS {
        let (_folder, path) = file(&named(format), &write(format, &given, &[]));
        assert_eq!(read(&path).expect("whole"), held, "{format:?}");
    }
}

#[test]
fn law_more_rows_than_a_row_group() {
    let given: Vec<Row> = (0..150_000_u32)
        .map(|k| {
            let number = (k % 7 != 0).then_some(f64::from(k).sqrt());
            let text = (k % 5 == 0).then(|| format!("reason {}", k % 3));
            vec![u64::from(k).into(), number.into(), (k % 11 == 0).into(), text.into()]
        })
        .collect();
    for format in FORMATS {
        let (_folder, path) = file(&named(format), &write(format, &given, &metadata()));
        assert!(read(&path).expect("whole") == given, "{format:?}");
    }
}

#[test]
fn law_long_texts_close_a_row_group_early() {
    let long = "x".repeat(1 << 20);
    let given: Vec<Row> = (0..20)
        .map(|k| vec![Value::Whole(k), Value::Empty, Value::Empty, format!("{k} {long}").into()])
        .collect();
    let bytes = write(Format::Parquet, &given, &[]);
    let (_folder, path) = file("table.parquet", &bytes);
    assert!(read(&path).expect("whole") == given);
    let file = std::fs::File::open(&path).expect("just written");
    let parquet = parquet::file::reader::SerializedFileReader::new(file).expect("whole");
    assert_eq!(parquet::file::reader::FileReader::num_row_groups(&parquet), 3, "of 8 MiB");
}

#[test]
fn law_equal_tables_give_equal_bytes() {
    for format in FORMATS {
        assert_eq!(
            write(format, &everything(), &metadata()),
            write(format, &everything(), &metadata()),
            "{format:?}"
        );
    }
    let bytes = write(Format::Parquet, &everything(), &metadata());
    let holds = |text: &str| bytes.windows(text.len()).any(|window| window == text.as_bytes());
    assert!(holds("standstill") && !holds("parquet-rs"), "the library's version would change with it");
}

#[test]
fn law_a_table_survives_the_way_over_the_other_format() {
    let first = write(Format::Csv, &everything(), &metadata());
    let mut bytes = first.clone();
    for (from, to) in [(Format::Csv, Format::Parquet), (Format::Parquet, Format::Csv)] {
        let (_folder, path) = file(&named(from), &bytes);
        let mut reader = Reader::open(&path, kind).expect("a table");
        let mut writer = Writer::new(Vec::new(), to, reader.columns().to_vec(), reader.metadata())
            .expect("columns that fit");
        while let Some(row) = reader.next_row().expect("whole") {
            writer.row(row).expect("a row that fits");
        }
        bytes = writer.finish().expect("memory takes everything");
    }
    assert_eq!(bytes, first);
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
        Value::Number(number) => Some(number),
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
    let rows: Vec<Row> = rows
        .into_iter()
        .map(|(whole, number, flag, text)| vec![whole.into(), number.into(), flag.into(), text.into()])
        .collect();
    assert_eq!(write(Format::Csv, &rows, &[]), other.into_inner().expect("memory takes everything"));
}

#[test]
fn law_only_csv_needs_a_row_for_the_metadata() {
    for (format, kept) in [(Format::Csv, Vec::new()), (Format::Parquet, metadata())] {
        let (_folder, path) = file(&named(format), &write(format, &[], &metadata()));
        let mut reader = Reader::open(&path, kind).expect("a table");
        assert_eq!(reader.columns(), columns(), "{format:?}");
        assert_eq!(reader.metadata(), kept, "{format:?}");
        assert!(reader.next_row().expect("no row").is_none());
    }
}

#[test]
fn law_a_single_column_keeps_its_empty_cells() {
    for format in FORMATS {
        let columns = vec![Column::new("error_deg", Kind::Number)];
        let mut writer = Writer::new(Vec::new(), format, columns, &[]).expect("columns that fit");
        let given = [Value::Empty, Value::Number(1.0), Value::Empty];
        for value in &given {
            writer.row(std::slice::from_ref(value)).expect("a row that fits");
        }
        let (_folder, path) = file(&named(format), &writer.finish().expect("memory takes everything"));
        assert_eq!(read(&path).expect("whole").concat(), given, "{format:?}");
    }
}

#[test]
fn regress_csv_as_other_programs_save_it() {
    let saved =
        "\u{feff}trial,pole_correct,error_deg,note\r\n1,True,nan,x\r\n\r\n2,False,1E-3,\"y\r\nz\"\r\n3,,,";
    let (_folder, path) = file("table.CSV", saved.as_bytes());
    let expected = [
        vec![Value::Whole(1), Value::Flag(true), Value::Empty, text("x")],
        vec![Value::Whole(2), Value::Flag(false), Value::Number(1e-3), text("y\r\nz")],
        vec![Value::Whole(3), Value::Empty, Value::Empty, Value::Empty],
    ];
    assert_eq!(read(&path).expect("whole"), expected);
}
