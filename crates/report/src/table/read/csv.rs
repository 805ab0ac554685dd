//! Rows from CSV.

use std::fmt;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use csv::{ErrorKind, StringRecord};
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};

use super::super::error::quoted;
use super::super::{Column, Kind, METADATA, Place, TableError, Value};
use super::put_text;

pub(super) struct Source {
    path: PathBuf,
    from: csv::Reader<File>,
    record: StringRecord,
    /// Whether `record` is the first row, which was read for its metadata.
    ahead: bool,
    /// Whether the last field belongs to the metadata.
    run: bool,
}

type Opened = (Vec<Column>, Vec<(String, String)>, Source);

impl Source {
    pub(super) fn open(path: &Path, kinds: impl Fn(&str) -> Kind) -> Result<Opened, TableError> {
        let file = File::open(path).map_err(|error| TableError::Read { path: path.to_owned(), error })?;
        let from = csv::ReaderBuilder::new().has_headers(false).from_reader(file);
        let mut source =
            Self { path: path.to_owned(), from, record: StringRecord::new(), ahead: false, run: false };
        if !source.advance()? {
            return Err(source.broken("an empty file; a table begins with the names of its columns"));
        }
        let mut names: Vec<&str> = source.record.iter().collect();
        let run = names.last() == Some(&METADATA);
        if run {
            names.pop();
        }
        if let Some(name) =
            names.iter().enumerate().find_map(|(k, name)| names[..k].contains(name).then_some(name))
        {
            return Err(source.wrong(None, format!("the column {} twice", quoted(name)), "unique names"));
        }
        if names.is_empty() {
            return Err(source.broken("only metadata; a table needs a column"));
        }
        let columns = names.into_iter().map(|name| Column::new(name, kinds(name))).collect();
        source.run = run;
        source.ahead = source.advance()?;
        let metadata = source.metadata()?;
        Ok((columns, metadata, source))
    }

    pub(super) fn next(
        &mut self,
        columns: &[Column],
        row: &mut [Value<'static>],
    ) -> Result<bool, TableError> {
        let first = std::mem::take(&mut self.ahead);
        if !first && !self.advance()? {
            return Ok(false);
        }
        for ((column, cell), text) in columns.iter().zip(row).zip(&self.record) {
            if parse(cell, column.kind, text).is_none() {
                return Err(self.wrong(Some(&column.name), quoted(text), column.kind.needed()));
            }
        }
        let rest = self.record.get(columns.len()).unwrap_or_default();
        if !first && !rest.is_empty() {
            let needed = "nothing but in the first row";
            return Err(self.wrong(Some(METADATA), quoted(rest), needed));
        }
        Ok(true)
    }

    /// Reads the next record; `false` if there is none.
    fn advance(&mut self) -> Result<bool, TableError> {
        self.from.read_record(&mut self.record).map_err(|error| {
            let path = self.path.clone();
            let at = |line, found, needed| TableError::At {
                path: self.path.clone(),
                place: Place::Line(line),
                column: None,
                found,
                needed,
            };
            let line = self.line(error.position());
            let said = error.to_string();
            match error.into_kind() {
                ErrorKind::Io(error) => TableError::Read { path, error },
                ErrorKind::UnequalLengths { expected_len, len, .. } => {
                    at(line, format!("{len} field(s)"), format!("{expected_len} as in the header"))
                }
                ErrorKind::Utf8 { .. } => {
                    at(line, "bytes that are not UTF-8".to_owned(), "a text".to_owned())
                }
                _ => TableError::File { path, why: said },
            }
        })
    }

    /// What the first row says of the table.
    fn metadata(&self) -> Result<Vec<(String, String)>, TableError> {
        let text = self.record.iter().next_back().unwrap_or_default();
        if !(self.run && self.ahead) || text.is_empty() {
            return Ok(Vec::new());
        }
        match serde_json::from_str(text) {
            Ok(Object(pairs)) => Ok(pairs),
            Err(_) => Err(self.wrong(Some(METADATA), quoted(text), "a JSON object of strings")),
        }
    }

    /// The line of a record, counted in the file: the library counts neither the blank lines before a record nor the
    /// second half of `\r\n`. Costs a pass over the file, once, since the error ends the table.
    fn line(&self, record: Option<&csv::Position>) -> u64 {
        let start = record.map_or(0, csv::Position::byte);
        let Ok(file) = File::open(&self.path) else { return 0 };
        let mut line = 1;
        for (at, byte) in (0..).zip(BufReader::new(file).bytes().map_while(Result::ok)) {
            if at >= start && !matches!(byte, b'\r' | b'\n') {
                break;
            }
            line += u64::from(byte == b'\n');
        }
        line
    }

    fn broken(&self, why: &str) -> TableError {
        TableError::File { path: self.path.clone(), why: why.to_owned() }
    }

    fn wrong(&self, column: Option<&str>, found: String, needed: &str) -> TableError {
        TableError::At {
            path: self.path.clone(),
            place: Place::Line(self.line(self.record.position())),
            column: column.map(ToOwned::to_owned),
            found,
            needed: needed.to_owned(),
        }
    }
}

/// Puts what a field says into a cell; `None` if the column cannot hold it.
fn parse(cell: &mut Value<'static>, kind: Kind, text: &str) -> Option<()> {
    if kind == Kind::Text || text.is_empty() {
        put_text(cell, text);
        return Some(());
    }
    *cell = match kind {
        Kind::Whole => Value::Whole(text.parse().ok().filter(|whole| i64::try_from(*whole).is_ok())?),
        Kind::Number => match text.parse::<f64>().ok()? {
            // As other programs write what is missing.
            number if number.is_nan() => Value::Empty,
            number => Value::Number(Some(number).filter(|number| number.is_finite())?),
        },
        Kind::Flag => match text {
            "true" | "True" => Value::Flag(true),
            "false" | "False" => Value::Flag(false),
            _ => return None,
        },
        Kind::Text => return None,
    };
    Some(())
}

/// A JSON object of strings, in the order written.
struct Object(Vec<(String, String)>);

impl<'de> Deserialize<'de> for Object {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Pairs;
        impl<'de> Visitor<'de> for Pairs {
            type Value = Object;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object of strings")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Object, A::Error> {
                let mut pairs = Vec::new();
                while let Some(pair) = map.next_entry()? {
                    pairs.push(pair);
                }
                Ok(Object(pairs))
            }
        }
        deserializer.deserialize_map(Pairs)
    }
}
