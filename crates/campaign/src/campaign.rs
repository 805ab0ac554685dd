//! Running many trials on all cores, in order.

use std::fmt;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

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
    /// Runs the trials and hands each record to `sink`, in the order of their numbers. Stops early
    /// once `stop` is set; returns the number of trials done.
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
        let mut pace = Pace::new(pool.current_num_threads());
        while done < self.trials && !stop.load(Ordering::Relaxed) {
            let start = Instant::now();
            let end = (done + pace.size()).min(self.trials);
            for record in &self.block(&pool, done..end, stop).map_err(CampaignError::Settings)? {
                sink(record)?;
                done += 1;
            }
            pace = pace.after(start);
        }
        Ok(done)
    }

    /// Some trials, in order; each thread takes the next one when a lane of it is free. After `stop` is set none is begun,
    /// and those that were come to their ends: the first of the block.
    fn block(
        &self,
        pool: &rayon::ThreadPool,
        trials: Range<u64>,
        stop: &AtomicBool,
    ) -> Result<Vec<Record>, SettingsError> {
        let next = AtomicU64::new(trials.start);
        let parts = pool.broadcast(|_| {
            let mut records = Vec::new();
            let take = || {
                let go_on = !stop.load(Ordering::Relaxed);
                go_on.then(|| next.fetch_add(1, Ordering::Relaxed)).filter(|trial| *trial < trials.end)
            };
            self.scenario.trials(std::iter::from_fn(take), |record| records.push(record))?;
            Ok(records)
        });
        let mut all = Vec::new();
        for part in parts {
            all.append(&mut part?);
        }
        all.sort_unstable_by_key(|record| record.trial);
        Ok(all)
    }
}
