//! Rows as CSV.

use std::borrow::Cow;
use std::io;

use serde::ser::{Serialize, Serializer};

use super::formula::defused;
use super::{Cell, Column, Destination, METADATA, TableError};

pub(super) struct Sink<'w> {
    to: csv::Writer<Destination<'w>>,
    /// Content of the next row's metadata column, if there is one.
    run: Option<String>,
}

impl<'w> Sink<'w> {
    pub(super) fn new(
        to: Destination<'w>,
        columns: &[Column],
        metadata: &[(String, String)],
    ) -> Result<Self, TableError> {
        let run = object(metadata)?;
        let mut to = csv::WriterBuilder::new().has_headers(false).from_writer(to);
        let names = columns.iter().map(|column| defused(&column.name));
        to.write_record(names.chain(run.is_some().then_some(METADATA.into())).map(Cow::into_owned))
            .map_err(failed)?;
        Ok(Self { to, run })
    }

    pub(super) fn row(&mut self, values: &[Cell<'_>]) -> Result<(), TableError> {
        self.to.serialize(Row { values, run: self.run.as_deref() }).map_err(failed)?;
        if let Some(run) = &mut self.run {
            run.clear();
        }
        Ok(())
    }

    pub(super) fn finish(mut self) -> Result<(), TableError> {
        self.to.flush().map_err(TableError::Write)
    }
}

/// Returns an error of writing; inside may be one of the file system.
fn failed(error: csv::Error) -> TableError {
    let said = error.to_string();
    TableError::Write(match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        _ => io::Error::other(said),
    })
}

/// Returns the metadata as the text of a JSON object; none if there are none.
pub(super) fn object(metadata: &[(String, String)]) -> Result<Option<String>, TableError> {
    let text = (!metadata.is_empty()).then(|| serde_json::to_string(&Object(metadata)));
    text.transpose().map_err(|error| TableError::Design(error.to_string()))
}

/// The metadata as a JSON object, in the order given.
struct Object<'a>(&'a [(String, String)]);

impl Serialize for Object<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(key, value)| (key, value)))
    }
}

/// Serialised as the rows of the project's other CSV files are, so that equal numbers are equal texts.
struct Row<'a> {
    values: &'a [Cell<'a>],
    run: Option<&'a str>,
}

impl Serialize for Row<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let run = self.run.map(|run| Cell::Text(run.into()));
        serializer.collect_seq(self.values.iter().chain(&run).map(Field))
    }
}

struct Field<'a>(&'a Cell<'a>);

impl Serialize for Field<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            empty if empty.is_empty() => serializer.serialize_none(),
            Cell::Empty => serializer.serialize_none(),
            Cell::Whole(whole) => serializer.serialize_u64(*whole),
            Cell::Number(number) => serializer.serialize_f64(*number),
            Cell::Flag(flag) => serializer.serialize_bool(*flag),
            Cell::Text(text) => serializer.serialize_str(&defused(text)),
        }
    }
}
