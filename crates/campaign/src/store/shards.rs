//! The shards of a run, put together again.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::{NUMERICS, Statistics};

use super::identity::{Identity, Shard};
use super::journal::{JournalError, Rows, is_tally};
use super::row::Row;
use super::tally::Tallied;

/// Journals that together are one run, in order.
#[derive(Clone, Debug)]
pub struct Shards {
    /// The run that they are together.
    pub identity: Identity,
    journals: Vec<PathBuf>,
    /// Whether they keep statistics alone.
    tallies: bool,
}

/// Reads the identity of a journal's run, for journals of rows and of statistics.
///
/// # Errors
/// The file is not a journal, or cannot be read.
pub fn head(path: &Path) -> Result<Identity, JournalError> {
    if is_tally(path) { Ok(Tallied::read(path)?.identity) } else { Ok(Rows::open(path)?.identity().clone()) }
}

/// Returns the error for two shards of different splits: their rows overlap.
fn split(paths: [&Path; 2], of: [&Identity; 2]) -> Result<(), ShardsError> {
    let shards = of.map(|identity| identity.shard);
    if shards[0].count == shards[1].count {
        return Ok(());
    }
    Err(ShardsError::Split { paths: paths.map(Path::to_owned), shards })
}

/// Returns the reason why two journals are not shards of one run; none if they are.
fn difference(paths: [&Path; 2], of: [&Identity; 2]) -> Option<String> {
    let keeps = |tally| if tally { "statistics alone" } else { "rows" };
    let [there, here] = paths.map(is_tally);
    of[0].whole().difference(&of[1].whole()).or_else(|| {
        (there != here).then(|| format!("it keeps {} there and {} here (--rows)", keeps(there), keeps(here)))
    })
}

/// Returns whether a shard is of a run whose first trials those of another's run are, in as many shards.
fn begins(shorter: &Identity, longer: &Identity) -> bool {
    shorter.shard.count == longer.shard.count
        && shorter.stop_at == longer.stop_at
        && shorter.whole().begins(&longer.whole())
}

/// Returns whether a journal has all that it should, how many trials are missing, at most, and whether a block is
/// wrong.
pub(super) fn standing(path: &Path) -> Result<(bool, u64, bool), JournalError> {
    if is_tally(path) {
        let tallied = Tallied::read(path)?;
        return Ok((tallied.walk.is_done(), tallied.walk.left(), tallied.damaged));
    }
    let mut rows = Rows::open(path)?;
    while rows.block()?.is_some() {}
    Ok((rows.walk().is_done(), rows.walk().left(), rows.is_damaged()))
}

/// Journals of one run, each of a different shard.
#[derive(Default)]
pub(super) struct Gathered {
    /// The journal that has most trials a point, and its run.
    pub(super) run: Option<(PathBuf, Identity)>,
    /// Path and identity of each shard, by its index.
    pub(super) shards: BTreeMap<u64, (PathBuf, Identity)>,
}

impl Gathered {
    /// Adds a journal.
    ///
    /// # Errors
    /// One of another split or of another run, and a shard that is there already.
    pub(super) fn add(&mut self, path: PathBuf, identity: Identity) -> Result<(), ShardsError> {
        let (first, of) = self.run.get_or_insert_with(|| (path.clone(), identity.clone()));
        split([first, &path], [of, &identity])?;
        if let Some(difference) = difference([&path, first], [&identity, of])
            && !begins(&identity, of)
            && !begins(of, &identity)
        {
            return Err(ShardsError::Foreign { path, first: first.clone(), difference });
        }
        let shard = identity.shard;
        if let Some((first, _)) = self.shards.get(&shard.index) {
            return Err(ShardsError::Overlap { shard, first: first.clone(), second: path });
        }
        if of.trials < identity.trials {
            self.run = Some((path.clone(), identity.clone()));
        }
        self.shards.insert(shard.index, (path, identity));
        Ok(())
    }
}

/// Why journals are not one run.
#[derive(Debug, Error)]
pub enum ShardsError {
    /// A journal cannot be read.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// A folder has no journal.
    #[error(
        "{0} has no journal of a shard (run.journal or shard-I-of-N.journal, as `--shard I/N` leaves it)"
    )]
    None(PathBuf),
    /// A file was given where a folder is needed.
    #[error(
        "{0}: found a file, needed the folder with the journals of a run's shards, as `--shard I/N` leaves them"
    )]
    File(PathBuf),
    /// Two journals contain the same shard.
    #[error("shard {shard} is there twice: {first} and {second}")]
    Overlap {
        /// The shard.
        shard: Shard,
        /// Path of the first journal.
        first: PathBuf,
        /// Path of the second journal.
        second: PathBuf,
    },
    /// Two journals belong to different splits.
    #[error(
        "{} is shard {} and {} shard {}: shards of two splits overlap; needed those of one, in a folder of their own",
        .paths[0].display(), .shards[0], .paths[1].display(), .shards[1]
    )]
    Split {
        /// Both.
        paths: [PathBuf; 2],
        /// The two shards.
        shards: [Shard; 2],
    },
    /// A journal belongs to another run.
    #[error("{path} is not of the same run as {first}: {difference}")]
    Foreign {
        /// The one.
        path: PathBuf,
        /// A journal of the run to which the first one belongs.
        first: PathBuf,
        /// The differences, in words.
        difference: String,
    },
    /// A journal has fewer trials than another, because it was not extended yet.
    #[error(
        "shard {shard} in {path} is of a run of {trials} trials, others of {of}: run it again with --shard {shard} \
         --trials {of} --resume"
    )]
    Shorter {
        /// The one.
        path: PathBuf,
        /// The shard.
        shard: Shard,
        /// Trials of its run.
        trials: u64,
        /// Trials of the other shard's run.
        of: u64,
    },
    /// A journal was computed by a program with other numerics, so its rows would give other points and statistics now.
    #[error(
        "the number of the program's numerics is {found} in {path} and {NUMERICS} here: merge its shards with the program \
         that computed them"
    )]
    Numerics {
        /// Path of the journal.
        path: PathBuf,
        /// Number of the journal's numerics.
        found: u32,
    },
    /// Shards are missing.
    #[error(
        "missing: {}: give their folders too, or run them with the command of the others and --shard {}",
        .0.iter().map(|shard| format!("shard {shard}")).collect::<Vec<_>>().join(", "), .0[0]
    )]
    Missing(Vec<Shard>),
    /// A shard was interrupted.
    #[error("shard {shard} is not finished: {path} lacks up to {left} trials; run it again with --resume")]
    Unfinished {
        /// Path of its journal.
        path: PathBuf,
        /// The shard.
        shard: Shard,
        /// Largest possible number of missing rows.
        left: u64,
    },
}

impl Shards {
    /// Makes the journal of a whole run.
    pub fn single(path: &Path) -> Result<Self, ShardsError> {
        let identity = head(path)?.whole();
        Ok(Self { identity, journals: vec![path.to_owned()], tallies: is_tally(path) })
    }

    /// Makes all shards in these folders.
    ///
    /// # Errors
    /// One that is missing, not finished, there twice or of another run, by its name.
    pub fn collect(folders: &[PathBuf]) -> Result<Self, ShardsError> {
        let mut gathered = Gathered::default();
        for path in journals(folders)? {
            let identity = head(&path)?;
            if identity.numerics != NUMERICS {
                return Err(ShardsError::Numerics { path, found: identity.numerics });
            }
            gathered.add(path, identity)?;
        }
        let Gathered { run, shards: found } = gathered;
        let Some((_, identity)) = run else {
            return Err(ShardsError::None(folders.first().cloned().unwrap_or_default()));
        };
        let of = identity.trials;
        if let Some((path, shorter)) = found.values().find(|(_, identity)| identity.trials < of) {
            let Identity { shard, trials, .. } = *shorter;
            return Err(ShardsError::Shorter { path: path.clone(), shard, trials, of });
        }
        let count = identity.shard.count;
        // The first of them are enough: a damaged header could claim any number of shards.
        let missing = (1..=count).filter(|index| !found.contains_key(index)).take(20);
        let missing: Vec<Shard> = missing.map(|index| Shard { index, count }).collect();
        if !missing.is_empty() {
            return Err(ShardsError::Missing(missing));
        }
        for (path, identity) in found.values() {
            let (done, left, _) = standing(path)?;
            if !done {
                let (path, shard) = (path.clone(), identity.shard);
                return Err(ShardsError::Unfinished { path, shard, left });
            }
        }
        let journals: Vec<PathBuf> = found.into_values().map(|(path, _)| path).collect();
        let tallies = journals.first().is_some_and(|path| is_tally(path));
        Ok(Self { identity: identity.whole(), journals, tallies })
    }

    /// Returns the statistics of each point, if that is all that they keep; errors beyond `limit` degrees were
    /// counted.
    pub fn tallies(&self, limit: f64) -> Result<Option<BTreeMap<usize, Statistics>>, JournalError> {
        if !self.tallies {
            return Ok(None);
        }
        let mut points: BTreeMap<usize, Statistics> = BTreeMap::new();
        for journal in &self.journals {
            for (point, statistics) in Tallied::read(journal)?.points {
                points.entry(point).or_insert_with(|| Statistics::with_limit(limit)).merge(&statistics);
            }
        }
        Ok(Some(points))
    }

    /// Hands over all rows with their points, in order.
    pub fn rows<E: From<JournalError>>(
        &self,
        mut sink: impl FnMut(usize, &Row) -> Result<(), E>,
    ) -> Result<(), E> {
        for journal in &self.journals {
            let mut rows = Rows::open(journal)?;
            while let Some(block) = rows.block()? {
                block.iter().try_for_each(|(point, row)| sink(*point, row))?;
            }
            // They were complete when they were collected.
            if !rows.walk().is_done() {
                return Err(JournalError::Short(journal.clone()).into());
            }
        }
        Ok(())
    }
}

/// Checks that the journal of a shard may be written into this folder. It may not be beside shards of another split, nor,
/// unless `others` is set, beside shards of another run. Unreadable files are ignored.
///
/// # Errors
/// The folder has a journal of another split or of another run.
pub fn beside(folder: &Path, own: &Identity, others: bool) -> Result<(), ShardsError> {
    let path = folder.join(own.shard.file_name());
    for other in journals(&[folder.to_owned()]).unwrap_or_default() {
        let Ok(of) = head(&other) else { continue };
        if other == path || of.shard == Shard::WHOLE {
            continue;
        }
        split([&other, &path], [&of, own])?;
        let whole = [of.whole(), own.whole()];
        let extends = whole[0].begins(&whole[1]) || whole[1].begins(&whole[0]);
        if !others
            && !extends
            && let Some(difference) = whole[0].difference(&whole[1])
        {
            return Err(ShardsError::Foreign { path: other, first: path, difference });
        }
    }
    Ok(())
}

/// Returns the journals in these folders, each once.
pub(super) fn journals(folders: &[PathBuf]) -> Result<Vec<PathBuf>, ShardsError> {
    let mut all: Vec<PathBuf> = Vec::new();
    let mut seen: Vec<PathBuf> = Vec::new();
    for folder in folders {
        let io = |error| ShardsError::Journal(JournalError::Io(folder.clone(), error));
        let real = folder.canonicalize().map_err(io)?;
        // A folder named twice is no shard there twice.
        if seen.contains(&real) {
            continue;
        }
        if real.is_file() {
            return Err(ShardsError::File(folder.clone()));
        }
        seen.push(real);
        let entries = std::fs::read_dir(folder).map_err(io)?;
        let paths: Result<Vec<PathBuf>, _> = entries.map(|entry| entry.map(|entry| entry.path())).collect();
        let mut paths = paths.map_err(io)?;
        paths.retain(|path| path.extension().is_some_and(|extension| extension == "journal"));
        // Beside shards, the journal of a whole run is of another run.
        let whole = folder.join(Shard::WHOLE.file_name());
        if paths.len() > 1 {
            paths.retain(|path| *path != whole);
        }
        if paths.is_empty() {
            return Err(ShardsError::None(folder.clone()));
        }
        paths.sort();
        all.extend(paths);
    }
    Ok(all)
}

#[cfg(test)]
mod tests;
