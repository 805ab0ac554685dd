//! Earlier results of a run with fewer trials, which `--resume` extends: result files, journals, or statistics.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, sync_channel};

use standstill_campaign::store::{Earlier, Identity, Journal, JournalError, Row, Shard, Tallied, head};
use standstill_scenario::Verdict;
use standstill_table::{Format, Reader};

use crate::results::{STATISTICS, SummaryFile, rows, trials_name};

use crate::error::Error;
use crate::shell::terminal::tell;
use standstill_quantity::count;

/// Number of blocks of rows that the channel from the reading thread can hold.
const WAITING: usize = 64;
/// Number of rows in a block.
const BLOCK: usize = 256;

/// Rows and statistics of earlier runs in a folder.
#[derive(Default)]
pub struct Found {
    /// Rows of earlier runs.
    pub rows: Earlier,
    /// Statistics of earlier runs without rows.
    pub tallies: Vec<Tallied>,
    /// Number of trials of the longest earlier run.
    pub trials: u64,
    /// Total number of trials of the finished run in the folder; none if there is no finished run.
    finished: Option<u64>,
    /// Journals that are removed when the new, longer run is complete.
    journals: Vec<PathBuf>,
}

impl Found {
    /// Finds the rows and statistics of earlier runs in a folder: runs of the same scenario with fewer trials. If an earlier journal has
    /// the name of the new journal, renames the earlier one.
    pub fn of(folder: &Path, identity: &Identity) -> Result<Self, Error> {
        let mut found = Self::default();
        let journal = folder.join(identity.shard.file_name());
        if journal.exists() && !Journal::is_busy(&journal) {
            let earlier = head(&journal);
            if let Ok(earlier) = &earlier
                && earlier.begins(identity)
            {
                let aside = journal.with_extension(format!("{}.{EARLIER}", earlier.trials));
                std::fs::rename(&journal, &aside).map_err(Error::writing(&aside))?;
            }
        }
        let stem = journal.file_stem().map(|stem| format!("{}.", stem.to_string_lossy())).unwrap_or_default();
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let aside = name.starts_with(&stem) && name.ends_with(&format!(".{EARLIER}"));
            if aside && found.journal(&entry.path(), identity)? {
                found.journals.push(entry.path());
            }
        }
        if identity.shard == Shard::WHOLE {
            let statistics = folder.join(STATISTICS);
            if statistics.exists() {
                found.journal(&statistics, identity)?;
            }
            found.files(folder, identity)?;
        }
        Ok(found)
    }

    /// Adds the rows or statistics of a journal that contains the first trials of this run. Returns false if the journal does not contain
    /// these trials.
    fn journal(&mut self, path: &Path, identity: &Identity) -> Result<bool, Error> {
        let Some(earlier) = head(path).ok().filter(|earlier| earlier.begins(identity)) else {
            return Ok(false);
        };
        match Tallied::read(path) {
            // Statistics of a shard do not show which trials they contain.
            Ok(_) if identity.shard != Shard::WHOLE && identity.stop_at.is_empty() => {
                return Err(JournalError::Other {
                    path: path.to_owned(),
                    difference: format!(
                        "the number of trials is {} there and {} here, and statistics alone of a shard cannot be extended",
                        count(earlier.trials),
                        count(identity.trials)
                    ),
                }
                .into());
            }
            Ok(tallied) => self.tallies.push(tallied),
            Err(_) => self.rows.add_journal(path)?,
        }
        self.trials = self.trials.max(earlier.trials);
        Ok(true)
    }

    /// Adds those rows of a finished run whose trials found an angle. All other trials run again, because the files contain the reasons of
    /// failures only as words.
    fn files(&mut self, folder: &Path, identity: &Identity) -> Result<(), Error> {
        let Ok(summary) = SummaryFile::read(folder) else { return Ok(()) };
        if !summary.run.begins(identity) {
            return Ok(());
        }
        self.finished = Some(summary.trials());
        let names = [Format::Csv, Format::Parquet].map(trials_name);
        let Some(path) = names.map(|name| folder.join(name)).into_iter().find(|path| path.exists()) else {
            let others = [Format::Npz, Format::Mat].map(|format| folder.join(trials_name(format)));
            if let Some(other) = others.iter().find(|path| path.exists()) {
                tell(&format!("{} is not read back: its trials are run again", other.display()));
            }
            return Ok(());
        };
        if let Err(changed) = summary.check(&path) {
            // A run that was ended after writing its table, but before writing its summary, leaves its own table, and its journal with all
            // rows.
            let journal = folder.join(identity.shard.file_name());
            let own = || Reader::open(&path).is_ok_and(|reader| is_of(&reader, identity));
            return if journal.exists() && own() { Ok(()) } else { Err(changed) };
        }
        let Ok(reader) = Reader::open(&path) else { return Ok(()) };
        if is_of(&reader, &summary.run) {
            self.trials = self.trials.max(summary.run.trials);
            self.rows.add(found(reader).into_iter().flatten());
        }
        Ok(())
    }

    /// Returns a sentence about the run that was extended. Call this function after the new files are in place.
    pub fn said(&self, folder: &Path) -> String {
        let now = SummaryFile::read(folder).ok().map(|summary| summary.trials());
        match (self.finished, now) {
            (Some(before), Some(now)) if before == now => format!(
                "The run of {} trials that was there is as long as before: stop_at is met. A narrower stop_at extends it, or none.",
                count(before)
            ),
            (Some(before), Some(now)) => {
                format!("The run of {} trials that was there was extended to {}.", count(before), count(now))
            }
            _ => format!("The run of {} trials that was there was extended.", count(self.trials)),
        }
    }

    /// Removes the renamed journals.
    pub fn remove(&self) {
        for path in &self.journals {
            let _ = std::fs::remove_file(path);
        }
    }
}

/// Returns true if a table's metadata belong to this run.
fn is_of(reader: &Reader, run: &Identity) -> bool {
    run.metadata().iter().all(|(key, value)| reader.metadata.get(key) == Some(value))
}

/// Extension of the name of a renamed journal. The number of trials precedes it.
const EARLIER: &str = "earlier";

/// Reads the rows of trials that found an angle, each with the index of its sweep point, in a separate thread. After a read error no more
/// rows follow.
fn found(reader: Reader) -> Receiver<Vec<(usize, Row)>> {
    let (to, from) = sync_channel(WAITING);
    std::thread::spawn(move || {
        let mut block = Vec::with_capacity(BLOCK);
        let _ = rows(reader, |point, row| {
            if row.verdict == Verdict::Found {
                block.push((point, row));
            }
            if block.len() == BLOCK {
                // Sending fails if the run has ended; the rows are then not needed.
                let _ = to.send(std::mem::take(&mut block));
            }
        });
        let _ = to.send(block);
    });
    from
}
