//! Running many trials on all cores, in order.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use rayon::prelude::*;
use standstill_detect::{LineInductanceSettings, Settings, SettingsError};

use crate::pace::Pace;
use crate::{Record, Scenario};

/// A number of trials of a scenario.
#[derive(Clone, Debug)]
pub struct Campaign<'a, S = LineInductanceSettings<f64>> {
    /// What each trial is.
    pub scenario: &'a Scenario<S>,
    /// How many.
    pub trials: u64,
    /// Threads; none: as many as there are cores. The records do not depend on it.
    pub threads: Option<usize>,
}

/// A campaign that could not run.
#[derive(Debug)]
pub enum CampaignError {
    /// The detector's settings cannot work.
    Settings(SettingsError),
    /// The operating system gave no threads.
    Threads(rayon::ThreadPoolBuildError),
}

impl fmt::Display for CampaignError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Settings(error) => error.fmt(f),
            Self::Threads(error) => write!(f, "no worker threads: {error}"),
        }
    }
}

impl std::error::Error for CampaignError {}

impl<S: Settings<f64> + Sync> Campaign<'_, S> {
    /// Runs the trials and hands each record to `sink`, in the order of their numbers. Stops early, after a
    /// whole block, once `stop` is set; returns the number of trials done.
    pub fn run<E: From<CampaignError>>(
        &self,
        stop: &AtomicBool,
        mut sink: impl FnMut(&Record) -> Result<(), E>,
    ) -> Result<u64, E> {
        self.scenario.check().map_err(CampaignError::Settings)?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads.unwrap_or(0))
            .build()
            .map_err(CampaignError::Threads)?;
        let mut done = 0;
        let mut pace = Pace::START;
        while done < self.trials && !stop.load(Ordering::Relaxed) {
            let start = Instant::now();
            let end = (done + pace.size()).min(self.trials);
            let block: Result<Vec<Record>, SettingsError> = pool
                .install(|| (done..end).into_par_iter().map(|trial| self.scenario.trial(trial)).collect());
            for record in &block.map_err(CampaignError::Settings)? {
                sink(record)?;
            }
            done = end;
            pace = pace.after(start);
        }
        Ok(done)
    }
}
