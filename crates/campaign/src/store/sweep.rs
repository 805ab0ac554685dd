//! Running a plan into a journal.

use std::fmt;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use rayon::prelude::*;
use standstill_detect::Method;

use super::identity::{Identity, Shard};
use super::journal::{Journal, JournalError};
use super::row::Row;
use crate::{NUMERICS, Scenario};
use crate::file::{FileError, Plan};
use crate::pace::Pace;

/// A plan, or a shard of it.
#[derive(Clone, Copy, Debug)]
pub struct Sweep<'a> {
    /// What each trial is.
    pub plan: &'a Plan,
    /// Which trials.
    pub shard: Shard,
    /// Threads; none: as many as there are cores. The rows do not depend on it.
    pub threads: Option<usize>,
}

/// A sweep that could not go on.
#[derive(Debug)]
pub enum SweepError {
    /// A value that cannot be, at a point or as drawn by a trial.
    File(FileError),
    /// The journal.
    Journal(JournalError),
    /// The operating system gave no threads.
    Threads(rayon::ThreadPoolBuildError),
}

impl fmt::Display for SweepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(error) => error.fmt(f),
            Self::Journal(error) => error.fmt(f),
            Self::Threads(error) => write!(f, "no worker threads: {error}"),
        }
    }
}

impl std::error::Error for SweepError {}

impl From<FileError> for SweepError {
    fn from(error: FileError) -> Self {
        Self::File(error)
    }
}

impl From<JournalError> for SweepError {
    fn from(error: JournalError) -> Self {
        Self::Journal(error)
    }
}

/// Parts of a block per thread: enough that none waits long for another at its end.
const PARTS: usize = 4;

/// Trials of a part, if the block has as many: in lanes they take turns, and at a part's end some lanes are empty.
const LEAST_PART: usize = 32;

/// Trials of a part of a block: so that all threads have work, and with it all lanes if there is enough.
fn part_length(block: usize, threads: usize, least: usize) -> usize {
    block.div_ceil(PARTS * threads).max(least.min(block.div_ceil(threads)))
}

/// Trials of one point that follow each other, at most so many of them.
fn parts(block: &[(usize, u64)], most: usize) -> Vec<(usize, Range<u64>)> {
    let mut parts: Vec<(usize, Range<u64>)> = Vec::new();
    for &(point, trial) in block {
        match parts.last_mut() {
            Some((last, trials))
                if *last == point && trials.end == trial && trials.end - trials.start < most as u64 =>
            {
                trials.end += 1;
            }
            _ => parts.push((point, trial..trial + 1)),
        }
    }
    parts
}

impl Sweep<'_> {
    /// What makes it this run.
    ///
    /// # Errors
    /// A scenario that cannot be written down.
    pub fn identity(&self) -> Result<Identity, FileError> {
        let file = self.plan.file();
        Ok(Identity {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            numerics: NUMERICS,
            seed: file.seed,
            points: self.plan.points().len() as u64,
            trials: file.trials,
            stop_at: file.stop_at,
            shard: self.shard,
            scenario: self.plan.text()?,
            files: self.plan.files().into_iter().map(|(path, digest)| (path, digest.to_string())).collect(),
        })
    }

    /// Runs what the journal does not have yet, block by block, until it is done or `stop` is set. `progress` sees each
    /// block once the journal has it. True if all is done.
    pub fn run(
        &self,
        journal: &mut Journal,
        stop: &AtomicBool,
        mut progress: impl FnMut(&[Row]),
    ) -> Result<bool, SweepError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads.unwrap_or(0))
            .build()
            .map_err(SweepError::Threads)?;
        let threads = pool.current_num_threads();
        let mut pace = Pace::new(threads);
        // Scenarios of the points that the last block touched; their neighbours come next.
        let mut scenarios: Vec<(usize, Scenario<Method<f64>>)> = Vec::new();
        while !journal.walk().is_done() && !stop.load(Ordering::Relaxed) {
            let begun = Instant::now();
            let block = journal.walk().ahead(pace.size());
            let (first, last) = (block[0].0, block[block.len() - 1].0);
            scenarios.retain(|(point, _)| (first..=last).contains(point));
            for point in first..=last {
                if !scenarios.iter().any(|(known, _)| *known == point) {
                    scenarios.push((point, self.plan.scenario(point)?));
                }
            }
            scenarios.sort_by_key(|(point, _)| *point);
            // Without lanes, a part of one is as good as any.
            let least = if self.plan.has_tolerances() { 1 } else { LEAST_PART };
            let whole = parts(&block, part_length(block.len(), threads, least));
            let part = |part: &(usize, Range<u64>)| {
                let (point, trials) = part.clone();
                let records = self.plan.trials(point, &scenarios[point - first].1, trials, stop)?;
                Ok(records.iter().map(Row::from).collect())
            };
            let done: Result<Vec<Vec<Row>>, FileError> =
                pool.install(|| whole.par_iter().map(part).collect());
            // After an interruption, what is done up to the first part that is not whole.
            let mut rows = Vec::with_capacity(block.len());
            for (mut done, (_, trials)) in done?.into_iter().zip(&whole) {
                let cut = (done.len() as u64) < trials.end - trials.start;
                rows.append(&mut done);
                if cut {
                    break;
                }
            }
            journal.append(&rows)?;
            progress(&rows);
            pace = pace.after(begun);
        }
        journal.sync()?;
        Ok(journal.walk().is_done())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::file::Document;
    use crate::store::Rows;

    #[test]
    fn law_all_threads_have_work() {
        let block = |rows: u64| (0..rows).map(|row| (usize::from(row >= 30), row % 30)).collect::<Vec<_>>();
        for (rows, threads, least, expected) in
            [(16, 2, 32, 8), (32, 8, 32, 4), (25, 8, 32, 4), (2048, 2, 32, 256), (64, 8, 1, 2), (8, 8, 1, 1)]
        {
            let length = part_length(rows, threads, least);
            assert_eq!(length, expected, "{rows} {threads}");
            let parts = parts(&block(rows as u64), length);
            assert!(parts.len() + 1 >= threads.min(rows), "{rows} {threads}");
            let all: Vec<_> = parts
                .iter()
                .flat_map(|(point, trials)| trials.clone().map(|trial| (*point, trial)))
                .collect();
            assert!(rows > 60 || all == block(rows as u64), "nothing is lost or out of order");
        }
    }

    const TEXT: &str = r#"
        trials = 40
        [detector]
        method = "bipolar"
        [axes]
        "sensors.noise" = { from = "0 mA", to = "20 mA", points = 3 }
        [tolerances]
        "motor.winding.resistance" = { normal = "5 %" }
        "#;

    fn plan() -> Plan {
        Plan::new(Document::parse(Path::new("s.toml"), TEXT).expect("TOML")).expect("valid")
    }

    fn rows(path: &Path) -> Vec<Row> {
        let mut rows = Rows::open(path).expect("a journal");
        let blocks = std::iter::from_fn(|| rows.block().expect("readable"));
        blocks.flatten().map(|(_, row)| row).collect()
    }

    #[test]
    fn law_threads_interruptions_and_shards_change_no_row() {
        let folder = tempfile::tempdir().expect("a folder");
        let plan = plan();
        let sweep = Sweep { plan: &plan, shard: Shard::WHOLE, threads: Some(1) };
        let identity = sweep.identity().expect("TOML");
        let never = AtomicBool::new(false);
        let path = folder.path().join("whole");
        let mut journal = Journal::create(&path, &identity).expect("writable");
        assert!(sweep.run(&mut journal, &never, |_| {}).expect("runs"));
        let whole = rows(&path);
        assert_eq!(whole.len(), 120);
        assert!(whole.iter().enumerate().all(|(k, row)| row.trial == k as u64 % 40));
        // Stopped after each block, and resumed.
        let path = folder.path().join("stopped");
        drop(Journal::create(&path, &identity).expect("writable"));
        let sweep = Sweep { threads: Some(2), ..sweep };
        let mut done = false;
        while !done {
            let stop = AtomicBool::new(false);
            let mut journal = Journal::resume(&path, &identity, |_, _| {}).expect("the same run");
            done = sweep.run(&mut journal, &stop, |_| stop.store(true, Ordering::Relaxed)).expect("runs");
        }
        assert_eq!(rows(&path), whole);
        let mut together = Vec::new();
        for index in 1..=3 {
            let sweep = Sweep { shard: Shard { index, count: 3 }, ..sweep };
            let path = folder.path().join(format!("shard-{index}"));
            let mut journal =
                Journal::create(&path, &sweep.identity().expect("TOML")).expect("writable");
            sweep.run(&mut journal, &never, |_| {}).expect("runs");
            together.extend(rows(&path));
        }
        assert_eq!(together, whole);
        // The points have their own noise, and the trials their own draws.
        assert!(whole[0].axis_error_deg != whole[40].axis_error_deg && whole[0] != whole[1]);
    }
}
