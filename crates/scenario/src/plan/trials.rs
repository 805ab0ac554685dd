//! Runs trials of a plan, one by one or side by side, from seeds or from tapes.

use standstill_detect::Method;
use standstill_sim::{Streams, Tape};

use super::Plan;
use crate::document::FileError;
use crate::scenario::side_by_side;
use crate::{Record, Scenario, TrialError};

/// Number of trials, each with a machine of its own, that are drawn at a time: enough to fill the lanes several times.
const AT_A_TIME: usize = 64;

impl Plan {
    /// Runs one trial at a point whose scenario is `scenario`.
    ///
    /// # Errors
    /// An invalid drawn value.
    pub fn trial(
        &self,
        point: usize,
        scenario: &Scenario<Method<f64>>,
        trial: u64,
    ) -> Result<Record, FileError> {
        let run = |scenario: &Scenario<Method<f64>>| {
            scenario.trial(trial).map_err(|error| FileError::settings(&error))
        };
        if self.has_tolerances() { run(&self.drawn(point, Some(scenario), trial)?) } else { run(scenario) }
    }

    /// Runs trials at a point whose scenario is `scenario` side by side in this thread, until there are no more or one trial
    /// cannot be run; trials that have begun are completed. `done` gets each record, in any order.
    ///
    /// # Errors
    /// A trial for which no machine or no detector can be made.
    pub fn trials(
        &self,
        point: usize,
        scenario: &Scenario<Method<f64>>,
        trials: &mut dyn Iterator<Item = u64>,
        done: &mut dyn FnMut(Record),
    ) -> Result<(), TrialError<FileError>> {
        if let Some(remote) = &self.remote {
            return self.remote_trials(remote.as_ref(), (point, scenario), trials, done);
        }
        let failed = |trial| move |error| TrialError { trial, error };
        if !self.has_tolerances() {
            return scenario
                .trials(trials, done)
                .map_err(|TrialError { trial, error }| failed(trial)(FileError::settings(&error)));
        }
        let mut drawer = self.drawer(point, Some(scenario));
        loop {
            let numbers: Vec<u64> = trials.take(AT_A_TIME).collect();
            let mut draw = |trial| drawer.draw(Streams::new(self.file.seed, trial)).map_err(failed(trial));
            let drawn = all_until_error(numbers.iter().map(|trial| draw(*trial)));
            let cases = drawn.all.iter().zip(&numbers).map(|(scenario, trial)| {
                let case = scenario.case(*trial);
                let detector = scenario.detector_for(&case);
                let detector = detector.map_err(|error| failed(*trial)(FileError::settings(&error)))?;
                Ok((case, detector))
            });
            side_by_side(cases, |number, run| done(Record { trial: numbers[number], run }))?;
            drawn.ended?;
            if numbers.len() < AT_A_TIME {
                return Ok(());
            }
        }
    }

    /// Runs the trial whose draws, tolerances included, a tape gives.
    ///
    /// # Errors
    /// An invalid drawn value.
    pub fn trial_taped(
        &self,
        point: usize,
        scenario: &Scenario<Method<f64>>,
        tape: &Tape,
    ) -> Result<Record, FileError> {
        let run = |scenario: &Scenario<Method<f64>>| {
            scenario.trial_taped(tape).map_err(|error| FileError::settings(&error))
        };
        if self.has_tolerances() {
            run(&self.drawer(point, Some(scenario)).draw(Streams::taped(tape))?)
        } else {
            run(scenario)
        }
    }

    /// Makes the scenario of the trial whose draws, tolerances included, a tape gives.
    ///
    /// # Errors
    /// An invalid drawn value.
    pub fn scenario_taped(
        &self,
        point: usize,
        scenario: &Scenario<Method<f64>>,
        tape: &Tape,
    ) -> Result<Scenario<Method<f64>>, FileError> {
        self.drawer(point, Some(scenario)).draw(Streams::taped(tape))
    }

    /// Runs the trials whose draws tapes give in this thread: side by side, unless each trial has a machine of its own. `change`
    /// is applied to each trial's scenario after the draws and before the detector is made. `done` gets each record with the
    /// index of its tape. Both are `dyn` references, so that the code that runs detectors is compiled in this crate.
    ///
    /// # Errors
    /// An invalid drawn value, or a trial for which no detector can be made.
    pub fn trials_taped(
        &self,
        point: usize,
        scenario: &Scenario<Method<f64>>,
        tapes: &[Tape],
        change: &dyn Fn(&mut Scenario<Method<f64>>),
        done: &mut dyn FnMut(usize, Record),
    ) -> Result<(), FileError> {
        if !self.has_tolerances() {
            let mut scenario = scenario.clone();
            change(&mut scenario);
            return scenario.trials_taped(tapes, done).map_err(|error| FileError::settings(&error));
        }
        let mut drawer = self.drawer(point, Some(scenario));
        for (block, tapes) in tapes.chunks(AT_A_TIME).enumerate() {
            let changed = |tape| {
                let mut scenario = drawer.draw(Streams::taped(tape))?;
                change(&mut scenario);
                Ok(scenario)
            };
            let drawn = all_until_error(tapes.iter().map(changed));
            let cases = drawn.all.iter().zip(tapes).map(|(scenario, tape)| {
                let case = scenario.case_taped(tape);
                let detector = scenario.detector_for(&case).map_err(|error| FileError::settings(&error))?;
                Ok((case, detector))
            });
            side_by_side(cases, |number, run| {
                done(block * AT_A_TIME + number, Record { trial: tapes[number].index(), run });
            })?;
            drawn.ended?;
        }
        Ok(())
    }
}

/// Results before the first error, and that error if there was one.
struct Made<T, E> {
    all: Vec<T>,
    ended: Result<(), E>,
}

fn all_until_error<T, E>(made: impl Iterator<Item = Result<T, E>>) -> Made<T, E> {
    let mut ended = Ok(());
    let all = made.map_while(|one| one.map_err(|error| ended = Err(error)).ok()).collect();
    Made { all, ended }
}
