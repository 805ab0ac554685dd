//! Columns of the result files.

pub mod traces;

use serde::Serialize;
use standstill_campaign::store::Row;
use standstill_quantity::si_value;
use standstill_scenario::Point;
use standstill_table::{Cell, Column, Kind};

/// Column with half the width in degrees of the sector that the method names. It is the last of the needed columns, and exists only if
/// answers are sectors.
pub const HALF_SECTOR: &str = "half_sector_deg";

/// Function from a trial's row to its cell in a column.
type Value = for<'a> fn(&'a Row) -> Cell<'a>;

/// Columns of a trial in files of trials: name, kind and value.
const TRIAL: [(&str, Kind, Value); 14] = [
    ("trial", Kind::Whole, |row| row.trial.into()),
    ("true_angle_deg", Kind::Number, |row| row.true_angle_deg.into()),
    ("estimated_angle_deg", Kind::Number, |row| row.estimated_angle_deg.into()),
    ("error_deg", Kind::Number, |row| row.error_deg.into()),
    ("outcome", Kind::Text, |row| row.verdict.name().into()),
    ("pole_correct", Kind::Flag, |row| row.pole_correct.into()),
    ("rotor_moved_deg", Kind::Number, |row| row.rotor_moved_deg.into()),
    ("duration_s", Kind::Number, |row| row.duration_s.into()),
    ("axis_deg", Kind::Number, |row| row.axis_deg.into()),
    ("axis_error_deg", Kind::Number, |row| row.axis_error_deg.into()),
    ("start_angle_deg", Kind::Number, |row| row.start_angle_deg.into()),
    ("peak_current_a", Kind::Number, |row| row.peak_current_a.into()),
    ("reason", Kind::Text, |row| row.reason.as_str().into()),
    (HALF_SECTOR, Kind::Number, |row| row.half_sector_deg.into()),
];

/// Name of the column with the age of the angle in s. Tables of earlier versions do not have it.
pub const AGE: &str = "age_s";

/// Columns of a trial that a table need not have: the age of the angle, and the error at the instant for which the angle holds.
const INSTANT: [(&str, Kind, Value); 2] = [
    (AGE, Kind::Number, |row| row.age_s.into()),
    ("error_at_instant_deg", Kind::Number, |row| row.error_at_instant_deg.into()),
];

/// Returns the number of columns of a trial. `in_sectors` is true if the method answers with sectors.
fn count(in_sectors: bool) -> usize {
    TRIAL.len() - usize::from(!in_sectors)
}

/// Returns the columns that a table of trials must have. `in_sectors` is true if the method answers with sectors.
pub fn needed_columns(in_sectors: bool) -> impl Iterator<Item = Column> {
    TRIAL.iter().take(count(in_sectors)).map(|(name, kind, _)| Column::new(*name, *kind))
}

/// Returns the columns of a trial in files of trials. `in_sectors` is true if the method answers with sectors.
pub fn trial_columns(in_sectors: bool) -> impl Iterator<Item = Column> {
    needed_columns(in_sectors).chain(INSTANT.iter().map(|(name, kind, _)| Column::new(*name, *kind)))
}

/// Returns the values of a trial in the order of [`trial_columns`].
pub fn trial_values(row: &Row, in_sectors: bool) -> impl Iterator<Item = Cell<'_>> {
    TRIAL.iter().take(count(in_sectors)).chain(&INSTANT).map(|(.., value)| value(row))
}

/// The column of a sweep axis.
#[derive(Debug)]
pub struct AxisColumn(pub Column);

impl AxisColumn {
    /// Returns the columns of all sweep axes. A column is numeric if its axis has a number at every point. Numbers are in SI units, angles
    /// in degrees.
    pub fn of(points: &[Point]) -> Vec<Self> {
        let Some(first) = points.first() else { return Vec::new() };
        let column = |k: usize| {
            let all = |of: fn(&toml::Value) -> bool| points.iter().all(|point| of(&point.values[k].1));
            let kind = if all(|value| si(value).is_some()) {
                Kind::Number
            } else if all(toml::Value::is_bool) {
                Kind::Flag
            } else {
                Kind::Text
            };
            Self(Column::new(first.values[k].0.as_str(), kind))
        };
        (0..first.values.len()).map(column).collect()
    }

    /// Returns the cell of this column for the axis value of a sweep point.
    pub fn value(&self, value: &toml::Value) -> Cell<'static> {
        match (self.0.kind, value) {
            (Kind::Number, value) => si(value).map_or(Cell::Empty, Cell::Number),
            (_, toml::Value::Boolean(flag)) if self.0.kind == Kind::Flag => Cell::Flag(*flag),
            (_, toml::Value::String(text)) => Cell::Text(text.clone().into()),
            (_, value) => Cell::Text(value.to_string().into()),
        }
    }

    /// Converts the axis value of a sweep point to JSON.
    pub fn json(&self, value: &toml::Value) -> serde_json::Value {
        serde_json::json!(self.value(value))
    }
}

/// Converts a number, with or without a unit, to SI units. None for values that are not numbers.
pub fn si(value: &toml::Value) -> Option<f64> {
    match value {
        toml::Value::Integer(number) => Some(*number as f64),
        toml::Value::Float(number) => Some(*number),
        toml::Value::String(text) => si_value(text),
        _ => None,
    }
}

/// Returns rows as CSV with a header.
pub fn csv(rows: impl IntoIterator<Item = impl Serialize>) -> std::io::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(std::io::Error::from)?;
    }
    writer.into_inner().map_err(csv::IntoInnerError::into_error)
}
