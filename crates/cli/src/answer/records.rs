//! Rows of results for programs: one list for JSON and CSV.

use std::io;

use indexmap::IndexMap;
use serde::Serialize;
use serde_json::{Value, json};
use standstill_campaign::Estimate;

/// Rows of a table. All rows have the same columns in the same order.
#[derive(Clone, Debug, Default, Serialize)]
#[serde(transparent)]
pub struct Records(pub Vec<Record>);

/// A row of a table. It has the names and values of its fields, in the order of the columns. A missing value becomes null in JSON and an
/// empty cell in CSV.
#[derive(Clone, Debug, Default, Serialize)]
#[serde(transparent)]
#[must_use]
pub struct Record(IndexMap<String, Value>);

impl Record {
    /// Adds a field. The value NaN is stored as a missing value.
    pub fn with(mut self, name: &str, value: impl Serialize) -> Self {
        self.0.insert(name.to_owned(), json!(value));
        self
    }

    /// Adds three fields: an estimate as `NAME_UNIT`, and the ends of its interval as `NAME_low_UNIT` and `NAME_high_UNIT`.
    pub fn estimate(self, name: &str, unit: &str, estimate: Option<Estimate>) -> Self {
        let part = |of: fn(&Estimate) -> f64| estimate.as_ref().map(of);
        self.with(&format!("{name}{unit}"), part(|e| e.value))
            .with(&format!("{name}_low{unit}"), part(|e| e.low))
            .with(&format!("{name}_high{unit}"), part(|e| e.high))
    }
}

impl FromIterator<Record> for Records {
    fn from_iter<T: IntoIterator<Item = Record>>(rows: T) -> Self {
        Self(rows.into_iter().collect())
    }
}

impl Records {
    /// Returns the rows as CSV with a header.
    pub fn csv(&self) -> io::Result<Vec<u8>> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        if let Some(Record(first)) = self.0.first() {
            writer.write_record(first.keys())?;
        }
        for Record(row) in &self.0 {
            let cell = |value: &Value| match value {
                Value::Null => String::new(),
                Value::String(text) => standstill_table::defused(text).into_owned(),
                value => value.to_string(),
            };
            writer.write_record(row.values().map(cell))?;
        }
        writer.into_inner().map_err(csv::IntoInnerError::into_error)
    }
}
