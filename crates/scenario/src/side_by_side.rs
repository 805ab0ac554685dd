//! Trials side by side in one thread.

use std::cell::RefCell;

use standstill_detect::{Settings, SettingsError};
use standstill_sim::{Streams, run_side_by_side};

use crate::{Record, Scenario, TrialError};

/// Runs trials side by side in this thread, each with a detector of its scenario. Each item of `trials` contains the scenario of a trial
/// and the trial's random numbers. `done` receives each record with the index of its item. If a detector cannot be made, no further trial
/// begins, but trials that have begun are completed.
pub(crate) fn side_by_side<'a, S: Settings<f64> + 'a>(
    trials: impl Iterator<Item = (&'a Scenario<S>, Streams<'a>)>,
    mut done: impl FnMut(usize, Record),
) -> Result<(), TrialError<SettingsError>> {
    let (numbers, mut failed) = (RefCell::new(Vec::new()), None);
    let cases = trials.map_while(|(scenario, streams)| {
        let trial = streams.index();
        numbers.borrow_mut().push(trial);
        let case = scenario.case_of(streams);
        let detector = scenario.detector_for(&case);
        Some((case, detector.map_err(|error| failed = Some(TrialError { trial, error })).ok()?))
    });
    // Fused, so that no trial begins after the first one without a detector.
    run_side_by_side(cases.fuse(), |number, run| {
        done(number, Record { trial: numbers.borrow()[number], run });
    });
    failed.map_or(Ok(()), Err)
}
