//! The trials of a scenario as a function of their draws.

use rayon::prelude::*;
use standstill_campaign::file::{FileError, Plan};
use standstill_campaign::{Record, Scenario};
use standstill_detect::Method;
use standstill_sim::Tape;

use crate::{Event, Halt, System, Watch};

/// The trials of a scenario without axes, tolerances included.
#[derive(Clone, Debug)]
pub struct Trials<'a> {
    plan: &'a Plan,
    scenario: Scenario<Method<f64>>,
}

impl<'a> Trials<'a> {
    /// Those of a plan's first point.
    ///
    /// # Errors
    /// Values that make no scenario.
    pub fn new(plan: &'a Plan) -> Result<Self, FileError> {
        Ok(Self { plan, scenario: plan.scenario(0)? })
    }

    /// What they have in common.
    pub fn scenario(&self) -> &Scenario<Method<f64>> {
        &self.scenario
    }

    /// The plan whose trials they are.
    pub fn plan(&self) -> &Plan {
        self.plan
    }

    /// The records of these tapes in their order, computed in this thread.
    ///
    /// # Errors
    /// A value drawn that cannot be.
    pub fn records(&self, tapes: &[Tape]) -> Result<Vec<Record>, FileError> {
        let mut records: Vec<Option<Record>> = vec![None; tapes.len()];
        self.plan.trials_taped(0, &self.scenario, tapes, |place, record| records[place] = Some(record))?;
        Ok(records.into_iter().flatten().collect())
    }

    /// The same of many tapes, on all threads.
    ///
    /// # Errors
    /// A value drawn that cannot be; that it was stopped.
    pub fn all_records(&self, tapes: Vec<Tape>, watch: &dyn Watch) -> Result<Vec<Record>, Halt<FileError>> {
        let mut parts: Vec<Vec<Tape>> = Vec::new();
        for tape in tapes {
            match parts.last_mut() {
                Some(part) if part.len() < AT_ONCE => part.push(tape),
                _ => parts.push(vec![tape]),
            }
        }
        let parts = parts.into_par_iter().map(|part| {
            if watch.stopped() {
                return Err(Halt::Stopped);
            }
            let records = self.records(&part)?;
            watch.did(records.len() as u64);
            Ok(records)
        });
        Ok(parts.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
    }

    /// How far they are from an event.
    pub fn towards(&self, event: Event) -> Towards<'_> {
        Towards { trials: self, event }
    }
}

/// Tapes that a thread runs at a time.
const AT_ONCE: usize = 128;

/// The distance to an event as a function of the draws.
#[derive(Clone, Copy, Debug)]
pub struct Towards<'a> {
    trials: &'a Trials<'a>,
    event: Event,
}

impl System for Towards<'_> {
    type Error = FileError;

    fn values(&self, tapes: &[Tape]) -> Result<Vec<f64>, FileError> {
        Ok(self.trials.records(tapes)?.iter().map(|record| self.event.value(record)).collect())
    }
}
