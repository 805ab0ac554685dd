//! Columns of the result files.

pub mod traces;

use serde::Serialize;
use standstill_campaign::store::Row;
use standstill_quantity::si_value;
use standstill_scenario::Point;
use standstill_table::{Cell, Column, Kind};

/// Columns that all files of trials have for a trial.
const TRIAL: [(&str, Kind); 13] = [
    ("trial", Kind::Whole),
    ("true_angle_deg", Kind::Number),
    ("estimated_angle_deg", Kind::Number),
    ("error_deg", Kind::Number),
    ("outcome", Kind::Text),
    ("pole_correct", Kind::Flag),
    ("rotor_moved_deg", Kind::Number),
    ("duration_s", Kind::Number),
    ("axis_deg", Kind::Number),
    ("axis_error_deg", Kind::Number),
    ("start_angle_deg", Kind::Number),
    ("peak_current_a", Kind::Number),
    ("reason", Kind::Text),
];

/// Column of half the width in degrees of the sector that a trial's answer names. It is the last column of a trial,
/// present only if answers are sectors.
pub const HALF_SECTOR: &str = "half_sector_deg";

/// Returns the columns of a trial in files of trials; `in_sectors`: whether answers are sectors.
pub fn trial_columns(in_sectors: bool) -> impl Iterator<Item = Column> {
    let sector = in_sectors.then_some((HALF_SECTOR, Kind::Number));
    TRIAL.into_iter().chain(sector).map(|(name, kind)| Column::new(name, kind))
}

/// Returns the values of a trial in the order of these columns.
pub fn trial_values(row: &Row, in_sectors: bool) -> impl Iterator<Item = Cell<'_>> {
    let number = |value: Option<f64>| value.map_or(Cell::Empty, Cell::Number);
    let sector = in_sectors.then(|| number(row.half_sector_deg));
    let values = [
        Cell::Whole(row.trial),
        Cell::Number(row.true_angle_deg),
        number(row.estimated_angle_deg),
        number(row.error_deg),
        Cell::Text(row.verdict.name().into()),
        row.pole_correct.map_or(Cell::Empty, Cell::Flag),
        Cell::Number(row.rotor_moved_deg),
        Cell::Number(row.duration_s),
        number(row.axis_deg),
        number(row.axis_error_deg),
        Cell::Number(row.start_angle_deg),
        Cell::Number(row.peak_current_a),
        Cell::Text(row.reason.as_str().into()),
    ];
    values.into_iter().chain(sector)
}

/// The column of a sweep axis.
#[derive(Debug)]
pub struct AxisColumn {
    pub column: Column,
}

impl AxisColumn {
    /// Returns the columns of all sweep axes. A column is numeric (in SI, angles in degrees) if the axis has a number
    /// at every point.
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
            Self { column: Column::new(first.values[k].0.as_str(), kind) }
        };
        (0..first.values.len()).map(column).collect()
    }

    /// Returns a point's value in this column.
    pub fn value(&self, value: &toml::Value) -> Cell<'static> {
        match (self.column.kind, value) {
            (Kind::Number, value) => si(value).map_or(Cell::Empty, Cell::Number),
            (_, toml::Value::Boolean(flag)) if self.column.kind == Kind::Flag => Cell::Flag(*flag),
            (_, toml::Value::String(text)) => Cell::Text(text.clone().into()),
            (_, value) => Cell::Text(value.to_string().into()),
        }
    }

    /// Returns a point's value as JSON.
    pub fn json(&self, value: &toml::Value) -> serde_json::Value {
        match self.value(value) {
            Cell::Number(number) => number.into(),
            Cell::Flag(flag) => flag.into(),
            Cell::Text(text) => text.into_owned().into(),
            Cell::Whole(whole) => whole.into(),
            Cell::Empty => serde_json::Value::Null,
        }
    }
}

/// Returns the SI value of a number with or without a unit.
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
