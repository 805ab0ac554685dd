//! The trials of a run, as far as they are compared.

use standstill_campaign::store::Row;
use standstill_campaign::{Statistics, Summary};
use standstill_scenario::Verdict;
use standstill_table::{Column, Kind, Value};

use crate::error::Error;
use crate::results::Run;

/// A trial as far as it is compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    pub start_deg: f64,
    /// Of the axis.
    pub error_deg: Option<f64>,
    /// Wrong pole, undetermined, no angle at all.
    pub cases: [bool; 3],
    /// Whether it could not be simulated.
    pub is_error: bool,
}

/// What some trials say, of the figures that two runs are compared by.
pub fn summary<'a>(trials: impl Iterator<Item = &'a Trial>, limit_deg: f64) -> Summary {
    let mut statistics = Statistics::with_limit(limit_deg);
    for (number, trial) in (0..).zip(trials) {
        let [wrong, undetermined, failed] = trial.cases;
        let verdict = match (trial.is_error, undetermined, failed) {
            (true, ..) => Verdict::Error,
            (_, true, _) => Verdict::Undetermined,
            (.., true) => Verdict::Failed,
            _ => Verdict::Found,
        };
        statistics.add_row(&Row {
            trial: number,
            true_angle_deg: trial.start_deg,
            start_angle_deg: trial.start_deg,
            axis_error_deg: trial.error_deg,
            verdict,
            pole_correct: wrong.then_some(false),
            ..blank()
        });
    }
    statistics.summary()
}

/// A trial of which nothing is known.
pub fn blank() -> Row {
    Row {
        trial: 0,
        true_angle_deg: f64::NAN,
        start_angle_deg: f64::NAN,
        estimated_angle_deg: None,
        error_deg: None,
        axis_deg: None,
        axis_error_deg: None,
        verdict: Verdict::Found,
        pole_correct: None,
        rotor_moved_deg: f64::NAN,
        duration_s: 0.0,
        peak_current_a: f64::NAN,
        reason: String::new(),
        kind: String::new(),
    }
}

/// All trials of a run, point by point.
pub fn of_run(run: &Run) -> Result<Vec<Vec<Trial>>, Error> {
    let columns = [
        ("trial", Kind::Whole),
        ("start_angle_deg", Kind::Number),
        ("axis_error_deg", Kind::Number),
        ("outcome", Kind::Text),
        ("pole_correct", Kind::Flag),
    ]
    .map(|(name, kind)| Column::new(name, kind));
    let (reader, []) = run.columns([])?;
    let mut points: Vec<Vec<Trial>> = Vec::new();
    let number = |value: &Value<'_>| if let Value::Number(number) = value { Some(*number) } else { None };
    let read = reader.values(&columns, |row| {
        // Each point begins with trial 0.
        if points.is_empty() || row[0] == Value::Whole(0) {
            points.push(Vec::new());
        }
        let outcome = if let Value::Text(outcome) = &row[3] { outcome.as_ref() } else { "" };
        let trial = Trial {
            start_deg: number(&row[1]).unwrap_or(f64::NAN),
            error_deg: number(&row[2]),
            cases: [row[4] == Value::Flag(false), outcome == "undetermined", outcome == "failed"],
            is_error: outcome == "error",
        };
        if let Some(point) = points.last_mut() {
            point.push(trial);
        }
    });
    read.map_err(Error::Table)?;
    Ok(points)
}
