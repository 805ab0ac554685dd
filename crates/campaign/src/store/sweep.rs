//! Running a plan into a journal.

use std::sync::atomic::{AtomicBool, Ordering};

use super::earlier::Earlier;
use super::identity::{Identity, Shard};
use super::journal::{JournalError, Keep};
use super::row::Row;
use crate::NUMERICS;
use crate::engine::Engine;
use standstill_scenario::{FileError, Note, Plan, Record};
use thiserror::Error;

/// A plan, or a shard of it.
#[derive(Clone, Copy, Debug)]
pub struct Sweep<'a> {
    /// The scenario of each trial.
    pub plan: &'a Plan,
    /// The shard whose trials are run.
    pub shard: Shard,
    /// Threads; none: as many as there are cores. The rows do not depend on it.
    pub threads: Option<usize>,
}

/// Reason why a sweep could not continue.
#[derive(Debug, Error)]
pub enum SweepError {
    /// A value that cannot be, at a point or as drawn by a trial.
    #[error(transparent)]
    File(#[from] FileError),
    /// The journal.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The operating system gave no threads.
    #[error("no worker threads: {0}")]
    Threads(rayon::ThreadPoolBuildError),
}

impl Sweep<'_> {
    /// Returns the identity of the run.
    ///
    /// # Errors
    /// The scenario cannot be written as text.
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
            pole_note: if self.plan.has_poles() {
                self.plan.note(Note::Poles)
            } else {
                Some("a motor without a magnet has none; its axis is the answer".to_owned())
            },
            pole_is_open: self.plan.pole_is_open() || !self.plan.has_poles(),
            map_note: self.plan.note(Note::Maps),
            motor_note: self.plan.note(Note::Numbers),
            library_note: self.plan.note(Note::Libraries),
            files: self.plan.files().into_iter().map(|(path, digest)| (path, digest.to_string())).collect(),
        })
    }

    /// Runs the trials that the journal does not have yet, block by block, until all are done or `stop` is set.
    /// `progress` receives each block's rows after the journal has stored the rows before it.
    ///
    /// # Errors
    /// A drawn value is invalid (the rows before it are stored), the journal cannot be written, or threads cannot be
    /// started.
    pub fn run(
        &self,
        journal: &mut impl Keep,
        stop: &AtomicBool,
        mut progress: impl FnMut(&[Row]),
    ) -> Result<bool, SweepError> {
        self.run_after(&mut Earlier::default(), journal, stop, |_, rows| progress(rows))
    }

    /// Runs the sweep as [`Sweep::run`] does, but takes the rows that earlier runs have from these. `progress` also gets the point of the
    /// block's last row.
    ///
    /// # Errors
    /// Those of [`Sweep::run`].
    pub fn run_after(
        &self,
        earlier: &mut Earlier,
        journal: &mut impl Keep,
        stop: &AtomicBool,
        mut progress: impl FnMut(usize, &[Row]),
    ) -> Result<bool, SweepError> {
        let mut engine = Engine::new(self.plan, self.threads).map_err(SweepError::Threads)?;
        while !journal.walk().is_done() && !stop.load(Ordering::Relaxed) {
            let block = journal.ahead(engine.size());
            let known: Vec<Option<Row>> = block.iter().map(|place| earlier.row(*place)).collect();
            let unknown: Vec<(usize, u64)> =
                block.iter().zip(&known).filter(|(_, row)| row.is_none()).map(|(place, _)| *place).collect();
            let (records, outcome) =
                if unknown.is_empty() { (Vec::new(), Ok(())) } else { engine.block(&unknown, stop) };
            // A detector whose program raised an error has no result, and ends the run.
            let ends = records.iter().any(Record::is_void);
            let mut records = records.iter().take_while(|record| !record.is_void()).map(Row::from);
            // Up to the first that is not there.
            let rows: Vec<Row> = known.into_iter().map_while(|row| row.or_else(|| records.next())).collect();
            journal.append(&rows)?;
            if let Some((point, _)) = rows.len().checked_sub(1).and_then(|last| block.get(last)) {
                progress(*point, &rows);
            }
            outcome?;
            if ends {
                break;
            }
        }
        journal.sync()?;
        Ok(journal.walk().is_done())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::store::{Journal, Rows};
    use standstill_scenario::{Document, Origin};

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

    /// promise: bits-interruptions
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
            let mut journal = Journal::create(&path, &sweep.identity().expect("TOML")).expect("writable");
            sweep.run(&mut journal, &never, |_| {}).expect("runs");
            together.extend(rows(&path));
        }
        assert_eq!(together, whole);
        // The points have their own noise, and the trials their own draws.
        assert!(whole[0].axis_error_deg != whole[40].axis_error_deg && whole[0] != whole[1]);
    }

    /// promise: other-runs-refused
    #[test]
    fn law_every_key_changed_between_kill_and_resume_is_refused_by_its_name() {
        let text = "trials = 40\ndetector.method = \"bipolar\"";
        let document = || Document::parse(Path::new("s.toml"), text).expect("TOML");
        let identity = |document: Document| -> Result<_, FileError> {
            let plan = Plan::new(document)?;
            Sweep { plan: &plan, shard: Shard::WHOLE, threads: Some(1) }.identity()
        };
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.journal");
        let own = identity(document()).expect("valid");
        drop(Journal::create(&path, &own).expect("writable"));
        let (mut whole, mut alone) = (0, 0);
        for key in standstill_scenario::keys() {
            // Choices have names in place of an example.
            let value = if key.example.is_empty() { "7" } else { key.example };
            let mut changed = document();
            changed.set(key.path, value, Origin::CommandLine).expect("a key");
            let other = identity(changed).inspect(|_| whole += 1).unwrap_or_else(|_| {
                // A key that needs companions is compared as a line of the run's text.
                alone += 1;
                let scenario = format!("trials = 40\n{} = {value}\n", key.path);
                Identity { scenario, ..own.clone() }
            });
            let error = Journal::resume(&path, &other, |_, _| {}).expect_err(key.path).to_string();
            assert!(error.contains(key.path) && error.contains(" there and "), "{}: {error}", key.path);
        }
        assert!(whole >= 50 && whole + alone > 100, "{whole} and {alone}");
        Journal::resume(&path, &own, |_, _| {}).expect("the run itself goes on");
    }
}
