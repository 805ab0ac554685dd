//! Tables as files: what was written is held by both formats; `read.rs`: numbers are read back.
#![allow(clippy::disallowed_methods, reason = "any numbers will do")]

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, Write};

use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use standstill_table::{Cell, Column, Format, Kind, TableError, Writer};

mod crafted;
mod read;
mod whole;

const FORMATS: [Format; 2] = [Format::Csv, Format::Parquet];

type Row = Vec<Cell<'static>>;

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

fn text(text: &'static str) -> Cell<'static> {
    Cell::Text(Cow::Borrowed(text))
}

fn write(format: Format, rows: &[Row], metadata: &[(String, String)]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut writer = Writer::new(&mut file, format, columns(), metadata).expect("columns that fit");
    for row in rows {
        writer.row(row).expect("a row that fits");
    }
    writer.finish().expect("memory takes everything");
    file
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
        Format::Npz | Format::Mat => unreachable!("see `whole.rs`"),
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
    let cell = |value: &Cell<'_>| match value {
        empty if empty.is_empty() => String::new(),
        Cell::Empty => String::new(),
        Cell::Whole(whole) => whole.to_string(),
        Cell::Number(number) => format!("{:016x}", number.to_bits()),
        Cell::Flag(flag) => flag.to_string(),
        Cell::Text(text) => text.clone().into_owned(),
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
    let mut rows = vec![vec![Cell::Empty; 4]];
    let row = |place: usize, value: Cell<'static>| {
        let mut row = vec![Cell::Empty; 4];
        row[place] = value;
        row
    };
    rows.extend(wholes.map(|whole| row(0, whole.into())));
    rows.extend(numbers.into_iter().chain(nothing).map(|number| row(1, number.into())));
    rows.extend([true, false].map(|flag| row(2, flag.into())));
    rows.extend(texts.map(|value| row(3, text(value))));
    rows.push(vec![Cell::Whole(3), Cell::Number(0.5), Cell::Flag(true), text("all")]);
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
    let row = |k| vec![Cell::Whole(k), Cell::Empty, Cell::Empty, format!("{k} {long}").into()];
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
        vec![Cell::Whole(0), Cell::Number(1.5e-5), Cell::Flag(true), Cell::Empty],
        vec![Cell::Whole(1), Cell::Number(1e16), Cell::Empty, text("a, \"b\"\nc")],
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
        Cell::Number(number) if number.is_finite() => Some(number),
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
            let error = Writer::new(&mut Vec::new(), format, columns, &metadata).map(|_| ());
            assert_eq!(error.expect_err(expected).to_string(), expected, "{format:?}");
        }
    }
}

#[test]
fn regress_rows_that_do_not_fit_leave_no_trace() {
    let [a, b, c, d] = std::array::from_fn(|_| Cell::Empty);
    let row = |place: usize, value: Cell<'static>| {
        let mut row = vec![a.clone(), b.clone(), c.clone(), d.clone()];
        row[place] = value;
        row
    };
    let whole = "row 2, column `trial`: found the whole number 9223372036854775808, needed a whole number from 0 to 2^63 - 1";
    let faults: [(Row, &str); 5] = [
        (vec![Cell::Empty; 3], "row 2: found 3 value(s), needed 4, one for each column"),
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
        let mut file = Vec::new();
        let mut writer = Writer::new(&mut file, format, columns(), &[]).expect("columns that fit");
        writer.row(&good[0]).expect("a row that fits");
        for (row, expected) in &faults {
            assert_eq!(writer.row(row).expect_err(expected).to_string(), *expected, "{format:?}");
        }
        writer.row(&good[1]).expect("a row that fits");
        writer.finish().expect("memory takes everything");
        assert_eq!(file, write(format, &good, &[]), "{format:?}");
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
        let fill = || {
            let mut disk = Full(room);
            let mut writer = Writer::new(&mut disk, format, columns(), &[])?;
            some_rows(200_000).iter().try_for_each(|row| writer.row(row))?;
            writer.finish()
        };
        match fill() {
            Err(TableError::Write(error)) => assert_eq!(error.kind(), io::ErrorKind::StorageFull),
            other => panic!("{format:?} with {room} bytes: {other:?}"),
        }
    }
}
