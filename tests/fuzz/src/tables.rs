//! Tables of results: CSV and Parquet.

use standstill_table::{Cell, Column, Format, Kind, Reader, Writer};

use crate::{file, refused};

/// A table as CSV.
pub fn table_csv(bytes: &[u8]) {
    read("given.csv", Format::Csv, bytes);
}

/// A table as Parquet.
pub fn parquet(bytes: &[u8]) {
    read("given.parquet", Format::Parquet, bytes);
}

type Rows = Vec<Vec<Cell<'static>>>;

fn rows(name: &str, bytes: &[u8], columns: &[Column]) -> Result<Rows, String> {
    let path = file(name, bytes);
    let mut rows = Rows::new();
    let own = |cell: &Cell<'_>| match cell {
        Cell::Text(text) => Cell::Text(text.clone().into_owned().into()),
        Cell::Empty => Cell::Empty,
        Cell::Whole(whole) => Cell::Whole(*whole),
        Cell::Number(number) => Cell::Number(*number),
        Cell::Flag(flag) => Cell::Flag(*flag),
    };
    let read = Reader::open(&path)
        .and_then(|reader| reader.values(columns, |row| rows.push(row.iter().map(own).collect())));
    read.map(|()| rows).map_err(|error| {
        refused(&error, name);
        error.to_string()
    })
}

fn read(name: &str, format: Format, bytes: &[u8]) {
    let reader = match Reader::open(&file(name, bytes)) {
        Err(error) => return refused(error, name),
        Ok(reader) => reader,
    };
    // Each column by the first kind that all its cells have.
    let (mut columns, mut all): (Vec<Column>, Vec<Rows>) = Default::default();
    for column in reader.columns.iter().take(MOST_COLUMNS) {
        let kinds = [Kind::Flag, Kind::Whole, Kind::Number, Kind::Text].map(|kind| Column::new(column, kind));
        for column in kinds {
            if let Ok(rows) = rows(name, bytes, std::slice::from_ref(&column)) {
                columns.push(column);
                all.push(rows);
                break;
            }
        }
    }
    let count = all.first().map_or(0, Vec::len);
    assert!(all.iter().all(|rows| rows.len() == count), "columns of unequal length");
    let rows_of = |k: usize| -> Vec<Cell<'_>> { all.iter().map(|column| column[k][0].clone()).collect() };
    let metadata: Vec<(String, String)> = reader.metadata.clone().into_iter().collect();
    let mut written = Vec::new();
    let Ok(mut writer) = Writer::new(&mut written, format, columns.clone(), &metadata) else {
        // Names that no table of this program has: none, the same one twice, that of the metadata.
        return;
    };
    for k in 0..count {
        writer.row(&rows_of(k)).unwrap_or_else(|error| panic!("{error}"));
    }
    writer.finish().expect("written");
    let again = format!("again.{}", name.rsplit('.').next().unwrap_or_default());
    let found = rows(&again, &written, &columns).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(found, (0..count).map(rows_of).collect::<Vec<_>>());
}

/// Columns that are looked at, each by up to four readings of the file.
const MOST_COLUMNS: usize = 8;
