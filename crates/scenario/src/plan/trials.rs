//! Runs trials of a plan, one by one or side by side, with random numbers from a seed or from tapes.

use standstill_detect::Method;
use standstill_sim::{Streams, Tape};

use super::Plan;
use crate::document::FileError;
use crate::side_by_side::side_by_side;
use crate::{Record, Scenario, TrialError};

/// Number of trials whose scenarios are made together if there are tolerances. It is several times the number of trials that run side by
/// side.
const AT_A_TIME: usize = 64;

impl Plan {
    /// Runs one trial at a point. `scenario` is the scenario of the point with nominal values.
    ///
    /// # Errors
    /// A drawn value is invalid.
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

    /// Runs trials at a point side by side in this thread. `scenario` is the scenario of the point with nominal values. `done` receives
    /// each record, in any order. After an error no further trial begins, but trials that have begun are completed.
    ///
    /// # Errors
    /// A drawn value is invalid, or no detector can be made for a trial.
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
        let streams = trials.map(|trial| Streams::new(self.file.seed, trial));
        self.side_by_side(point, scenario, streams, &|_| (), &mut |_, record| done(record))
    }

    /// Makes the scenario of a trial. All draws of the trial, tolerances included, come from a tape.
    ///
    /// # Errors
    /// A drawn value is invalid.
    pub fn scenario_taped(
        &self,
        point: usize,
        scenario: &Scenario<Method<f64>>,
        tape: &Tape,
    ) -> Result<Scenario<Method<f64>>, FileError> {
        self.drawer(point, Some(scenario)).draw(Streams::taped(tape))
    }

    /// Runs trials side by side in this thread. The draws of each trial come from a tape. `change` changes each trial's scenario after the
    /// draws and before the detector is made. `done` receives each record with the index of its tape. `change` and `done` are `dyn`
    /// references, so that the code that runs detectors is compiled in this crate.
    ///
    /// # Errors
    /// A drawn value is invalid, or no detector can be made for a trial.
    pub fn trials_taped(
        &self,
        point: usize,
        scenario: &Scenario<Method<f64>>,
        tapes: &[Tape],
        change: &dyn Fn(&mut Scenario<Method<f64>>),
        done: &mut dyn FnMut(usize, Record),
    ) -> Result<(), FileError> {
        let streams = tapes.iter().map(Streams::taped);
        self.side_by_side(point, scenario, streams, change, done).map_err(|failed| failed.error)
    }

    /// Runs one trial for each item of `streams`. An item contains the random numbers of its trial. `change` changes each trial's scenario
    /// before the detector is made. `done` receives each record with the index of the item.
    fn side_by_side<'t>(
        &self,
        point: usize,
        scenario: &Scenario<Method<f64>>,
        mut streams: impl Iterator<Item = Streams<'t>>,
        change: &dyn Fn(&mut Scenario<Method<f64>>),
        done: &mut dyn FnMut(usize, Record),
    ) -> Result<(), TrialError<FileError>> {
        let settings = |TrialError { trial, error }| TrialError { trial, error: FileError::settings(&error) };
        if !self.has_tolerances() {
            let mut scenario = scenario.clone();
            change(&mut scenario);
            return side_by_side(streams.map(|streams| (&scenario, streams)), done).map_err(settings);
        }
        let (mut drawer, mut before) = (self.drawer(point, Some(scenario)), 0);
        loop {
            let block: Vec<Streams<'_>> = streams.by_ref().take(AT_A_TIME).collect();
            let (mut drawn, mut ended) = (Vec::new(), Ok(()));
            for streams in &block {
                match drawer.draw(*streams) {
                    Ok(mut scenario) => {
                        change(&mut scenario);
                        drawn.push(scenario);
                    }
                    Err(error) => {
                        ended = Err(TrialError { trial: streams.index(), error });
                        break;
                    }
                }
            }
            let trials = drawn.iter().zip(block.iter().copied());
            side_by_side(trials, |number, record| done(before + number, record)).map_err(settings)?;
            ended?;
            if block.len() < AT_A_TIME {
                return Ok(());
            }
            before += AT_A_TIME;
        }
    }
}
