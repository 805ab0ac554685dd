//! Selection of the trials to be explained.

use crate::arguments::Explain as Options;
use crate::error::Error;
use crate::results::FinishedRun;

/// Number of wrong poles that are explained by default.
const WRONG_POLES: usize = 10;

/// A selected trial of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chosen {
    /// Number of the sweep's point.
    pub point: usize,
    /// Number of the trial at this point.
    pub trial: u64,
    /// Magnitude of the axis error in degrees, by which trials are ordered; 180° without an axis.
    far: f64,
}

/// The selection of trials to be explained.
pub struct Choice {
    pub chosen: Vec<Chosen>,
    /// Number of selected trials without an axis. They were selected in the order of their numbers, because none is
    /// worse than another.
    pub lost: u64,
    /// Name of the output folder for these trials.
    pub name: String,
}

/// Selects the requested trials: one by its number, those with the largest errors, or those with a wrong pole.
pub fn choose(run: &FinishedRun, options: &Options) -> Result<Choice, Error> {
    let identity = &run.summary.run;
    let points = usize::try_from(identity.points).unwrap_or(usize::MAX);
    if options.point.is_some_and(|point| point >= points) {
        return Err(Error::Arguments(format!(
            "--point: needed from 0 to {}, the last of the run",
            points - 1
        )));
    }
    if let Some(trial) = options.trial {
        if trial >= identity.trials {
            let last = identity.trials - 1;
            return Err(Error::Arguments(format!(
                "--trial {trial}: needed from 0 to {last}, the last of the run"
            )));
        }
        let point = options.point.unwrap_or(0);
        let done = run.summary.each().nth(point).map_or(0, |summary| summary.trials);
        if trial >= done {
            let last = done.saturating_sub(1);
            return Err(Error::Arguments(format!(
                "--trial {trial}: point {point} ended early (stop_at), with trial {last}; needed from 0 to {last}"
            )));
        }
        let chosen = vec![Chosen { point, trial, far: 0.0 }];
        return Ok(Choice { chosen, lost: 0, name: format!("trial-{trial}{}", of_point(options)) });
    }
    let most = options.worst.map_or(if options.wrong_poles { WRONG_POLES } else { 1 }, usize::from);
    let (mut all, mut lost): (Vec<Chosen>, u64) = (Vec::new(), 0);
    run.trials(|point, row| {
        let (axis, wrong) = (row.axis_error_deg, row.error_deg.is_some_and(|error| error.abs() > 90.0));
        let far = if options.wrong_poles { axis.unwrap_or(0.0).abs() } else { axis.map_or(180.0, f64::abs) };
        let asked = options.point.is_none_or(|asked| asked == point) && (wrong || !options.wrong_poles);
        lost += u64::from(asked && !options.wrong_poles && axis.is_none());
        let worse = all.len() < most || all.last().is_some_and(|least| far > least.far);
        if asked && worse {
            let place = all.partition_point(|other| other.far >= far);
            all.insert(place, Chosen { point, trial: row.trial, far });
            all.truncate(most);
        }
    })?;
    if all.is_empty() {
        let found = if options.wrong_poles { "no wrong pole" } else { "no trial" };
        return Err(Error::results(&run.trials, found, "--worst K for the largest errors, or --trial N"));
    }
    let kind = if options.wrong_poles { "wrong-poles" } else { "worst" };
    Ok(Choice { chosen: all, lost, name: format!("{kind}-{most}{}", of_point(options)) })
}

/// Returns the requested point as part of a folder's name; empty if no point was requested.
fn of_point(options: &Options) -> String {
    options.point.map_or_else(String::new, |point| format!("-point-{point}"))
}
