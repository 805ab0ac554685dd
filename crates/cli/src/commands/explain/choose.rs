//! Selection of the trials to be explained.

use standstill_scenario::Verdict;

use crate::arguments::Explain as Options;
use crate::error::Error;
use crate::results::FinishedRun;

/// Default number of explained trials if the user asks for trials with a wrong pole or without an answer.
const OF_A_KIND: usize = 10;

/// A selected trial of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chosen {
    /// Number of the trial's sweep point.
    pub point: usize,
    /// Number of the trial at this sweep point.
    pub trial: u64,
    /// Magnitude of the axis error in electrical degrees, which determines the order of the trials. 180° if the trial has no axis, 0 if the
    /// trials are not ordered by error.
    far: f64,
}

/// The selection of trials to be explained.
pub struct Choice {
    pub chosen: Vec<Chosen>,
    /// Number of trials without an axis, at the requested sweep point or else in the whole run. They come before all other trials, by
    /// ascending number. 0 if the selection is not by error.
    pub lost: u64,
    /// Name of the output folder for these trials.
    pub name: String,
}

/// Selects the requested trials: one trial by its number, the trials with the largest errors, those with a wrong pole, or those without an
/// answer.
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
    let of_a_kind = options.wrong_poles || options.unanswered;
    let most = options.worst.map_or(if of_a_kind { OF_A_KIND } else { 1 }, usize::from);
    let (mut all, mut lost): (Vec<Chosen>, u64) = (Vec::new(), 0);
    run.trials(|point, row| {
        let (axis, wrong) = (row.axis_error_deg, row.error_deg.is_some_and(|error| error.abs() > 90.0));
        let far = match axis {
            // No start without an answer is worse than another.
            _ if options.unanswered => 0.0,
            axis => axis.map_or(180.0, f64::abs),
        };
        let is_kind = match (options.wrong_poles, options.unanswered) {
            (true, _) => wrong,
            (_, true) => row.verdict != Verdict::Found,
            _ => true,
        };
        let asked = options.point.is_none_or(|asked| asked == point) && is_kind;
        lost += u64::from(asked && !of_a_kind && axis.is_none());
        let worse = all.len() < most || all.last().is_some_and(|least| far > least.far);
        if asked && worse {
            let place = all.partition_point(|other| other.far >= far);
            all.insert(place, Chosen { point, trial: row.trial, far });
            all.truncate(most);
        }
    })?;
    if all.is_empty() {
        let found = match (options.wrong_poles, options.unanswered) {
            (true, _) => "no wrong pole",
            (_, true) => "no trial without an answer",
            _ => "no trial",
        };
        return Err(Error::results(&run.trials, found, "--worst K for the largest errors, or --trial N"));
    }
    let kind = match (options.wrong_poles, options.unanswered) {
        (true, _) => "wrong-poles",
        (_, true) => "unanswered",
        _ => "worst",
    };
    Ok(Choice { chosen: all, lost, name: format!("{kind}-{most}{}", of_point(options)) })
}

/// Returns the number of the requested sweep point as part of a folder's name. Empty if no point was requested.
fn of_point(options: &Options) -> String {
    options.point.map_or_else(String::new, |point| format!("-point-{point}"))
}
