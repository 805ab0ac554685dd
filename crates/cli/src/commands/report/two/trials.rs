//! The trials of a run, reduced to the values that are compared.

use standstill_campaign::{Statistics, Summary};
use standstill_scenario::{Verdict, miss_deg};

use crate::error::Error;
use crate::results::FinishedRun;

/// The results of a trial by which two runs are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    pub start_deg: f64,
    /// Error of the axis in degrees; if the answer is a sector, the part beyond the sector.
    pub error_deg: Option<f64>,
    pub verdict: Verdict,
    pub pole_correct: Option<bool>,
}

impl Trial {
    /// Returns three flags: wrong pole, undetermined pole, no angle.
    pub fn cases(&self) -> [bool; 3] {
        let is = |verdict| self.verdict == verdict;
        [self.pole_correct == Some(false), is(Verdict::Undetermined), is(Verdict::Failed)]
    }
}

/// Returns the summary of these trials. An answer with an error above `limit_deg` degrees counts as off.
pub fn summary<'a>(trials: impl Iterator<Item = &'a Trial>, limit_deg: f64) -> Summary {
    let mut statistics = Statistics::with_limit(limit_deg);
    for trial in trials {
        statistics.add_outcome(trial.verdict, trial.pole_correct, trial.error_deg);
    }
    statistics.summary()
}

/// Reads all trials of a run, point by point.
pub fn of_run(run: &FinishedRun) -> Result<Vec<Vec<Trial>>, Error> {
    let mut points: Vec<Vec<Trial>> = Vec::new();
    run.trials(|point, row| {
        points.resize(points.len().max(point + 1), Vec::new());
        points[point].push(Trial {
            start_deg: row.start_angle_deg,
            error_deg: row.axis_error_deg.map(|error| miss_deg(error, row.half_sector_deg)),
            verdict: row.verdict,
            pole_correct: row.pole_correct,
        });
    })?;
    Ok(points)
}
