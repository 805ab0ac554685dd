//! The journal of a run that keeps no rows: the statistics of each point so far.
//!
//! ```text
//!   magic  length  header (JSON)  crc │ length  where it stands, statistics of the trials since  crc │ …
//! ```
//! A block contains the statistics of the trials since the previous block, point by point; those of a point add up over the blocks. Up to
//! a hundred thousand trials, statistics have each error, so blocks with all trials of a point would repeat them. Blocks are
//! written ever more rarely, so that their total size stays small. A process that is killed loses at most ten seconds
//! of work or a hundredth of it. Statistics add up exactly ([`Statistics::merge`]), so the journal gives the same
//! statistics as the rows would.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::block::{Tail, encoded};
use super::identity::Identity;
use super::journal::{self, Blocks, JournalError, Keep, TALLY};
use super::row::Row;
use super::walk::Walk;
use crate::{Sectors, Statistics};

/// Longest time before trials are synchronised with the disk, unless the share of [`SHARE`] is longer.
const PATIENCE: Duration = Duration::from_secs(10);
/// The time since the beginning, divided by this, may pass before trials are synchronised.
const SHARE: u32 = 100;

/// Nor do more points wait: a block is bounded.
const MOST_POINTS: usize = 1 << 12;

/// A journal of statistics that is being written, by this process alone.
#[derive(Debug)]
pub struct Tally {
    path: PathBuf,
    file: File,
    walk: Walk,
    limit: f64,
    /// Statistics of the trials since the last block, by point.
    open: BTreeMap<usize, Statistics>,
    /// Statistics of the points by earlier runs with fewer trials.
    earlier: BTreeMap<usize, Statistics>,
    begun: Instant,
    written: Instant,
}

/// Content of a block.
#[derive(Serialize, Deserialize)]
struct Standing {
    /// Point and trial of the next row.
    next: (u64, u64),
    points: BTreeMap<usize, Statistics>,
}

impl Tally {
    /// Begins a journal, or continues the existing one of the same run; errors beyond `limit` degrees are counted.
    pub fn open(path: &Path, identity: &Identity, limit: f64) -> Result<Self, JournalError> {
        let io = |error| JournalError::Io(path.to_owned(), error);
        let mut how = OpenOptions::new();
        let mut file = journal::locked(path, how.read(true).write(true).create(true).truncate(false))?;
        let beginning = journal::beginning(TALLY, identity).map_err(io)?;
        let mut tally = Tallied {
            identity: identity.clone(),
            walk: Walk::new(identity),
            points: BTreeMap::new(),
            damaged: false,
        };
        let mut end = beginning.len() as u64;
        // Killed before even the header was whole: nothing was done yet.
        if journal::is_beginning(&file, TALLY, identity).map_err(io)? {
            file.seek(SeekFrom::Start(0)).and_then(|_| file.write_all(&beginning)).map_err(io)?;
        } else {
            let mut blocks = Blocks::open(path, TALLY)?;
            blocks.check(identity)?;
            tally = Tallied::of(&mut blocks)?;
            end = blocks.whole;
        }
        file.set_len(end).and_then(|()| file.seek(SeekFrom::End(0))).map_err(io)?;
        let now = Instant::now();
        Ok(Self {
            path: path.to_owned(),
            file,
            walk: tally.walk,
            limit,
            open: BTreeMap::new(),
            earlier: BTreeMap::new(),
            begun: now,
            written: now,
        })
    }

    /// Goes on from the statistics of an earlier run of fewer trials, point by point.
    #[must_use]
    pub fn after(mut self, earlier: &Tallied) -> Self {
        for (point, statistics) in &earlier.points {
            let known = self.earlier.get(point).map_or(0, Statistics::trials);
            if statistics.trials() > known {
                self.earlier.insert(*point, statistics.clone());
            }
        }
        self.adopt();
        self
    }

    /// At the beginning of a point, adopts the statistics that an earlier run has of it.
    fn adopt(&mut self) {
        while !self.walk.is_done()
            && let (point, 0) = self.walk.next()
            && let Some((point, statistics)) =
                usize::try_from(point).ok().and_then(|point| self.earlier.remove_entry(&point))
        {
            self.walk.jump(&statistics);
            self.open.insert(point, statistics);
        }
    }
}

impl Keep for Tally {
    fn walk(&self) -> &Walk {
        &self.walk
    }

    /// Returns the next trials, at most `most`, with their points. If there are earlier runs, stops at the end of the
    /// present point, because an earlier run may have the beginning of the next one.
    fn ahead(&self, most: u64) -> Vec<(usize, u64)> {
        let mut ahead = self.walk.ahead(most);
        if let Some(&(first, _)) = ahead.first()
            && !self.earlier.is_empty()
        {
            ahead.retain(|(point, _)| *point == first);
        }
        ahead
    }

    fn append(&mut self, rows: &[Row]) -> Result<(), JournalError> {
        for row in rows {
            let point = self.walk.take(row).ok_or_else(|| journal::out_of_order(&self.path))?;
            self.open.entry(point).or_insert_with(|| Statistics::with_limit(self.limit)).add_row(row);
        }
        self.adopt();
        let is_time = self.written.elapsed() >= PATIENCE.max(self.begun.elapsed() / SHARE);
        if is_time || self.open.len() >= MOST_POINTS { self.sync() } else { Ok(()) }
    }

    fn sync(&mut self) -> Result<(), JournalError> {
        let io = |error| JournalError::Io(self.path.clone(), error);
        let standing = Standing { next: self.walk.next(), points: std::mem::take(&mut self.open) };
        let sectors: Tail<Sectors> =
            standing.points.iter().filter_map(|(point, of)| Some((*point, of.sectors?))).collect();
        let written = encoded(&standing, &sectors).and_then(|block| self.file.write_all(&block));
        let synced = written.and_then(|()| self.file.sync_data());
        synced.and_then(|()| journal::still_there(&self.path)).map_err(io)?;
        self.written = Instant::now();
        Ok(())
    }
}

/// A journal of statistics that was read.
#[derive(Clone, Debug)]
pub struct Tallied {
    /// Identity of the run.
    pub identity: Identity,
    /// Progress of the run after its last whole block.
    pub walk: Walk,
    /// Statistics of each point that has trials in it.
    pub points: BTreeMap<usize, Statistics>,
    /// Whether the data after the last complete block are wrong, not just cut off; they will be computed again.
    pub damaged: bool,
}

impl Tallied {
    /// Reads a journal up to its last whole block.
    pub fn read(path: &Path) -> Result<Self, JournalError> {
        Self::of(&mut Blocks::open(path, TALLY)?)
    }

    /// Reads all whole blocks.
    fn of(blocks: &mut Blocks) -> Result<Self, JournalError> {
        let (mut walk, mut points) = (Walk::new(&blocks.identity), BTreeMap::new());
        while let Some((Standing { next, points: mut changed }, sectors)) = blocks.next()? {
            for (point, sectors) in sectors {
                if let Some(statistics) = changed.get_mut(&point) {
                    statistics.sectors = Some(sectors);
                }
            }
            // The checksum is right: no run writes such a block.
            let Identity { points: count, trials, .. } = blocks.identity;
            let of_run = |(point, statistics): (&usize, &Statistics)| {
                (*point as u64) < count && statistics.trials() <= trials && statistics.is_sound()
            };
            if !walk.has(next) || !changed.iter().all(of_run) {
                return Err(blocks.foreign());
            }
            for (point, since) in changed {
                match points.entry(point) {
                    Entry::Vacant(place) => drop(place.insert(since)),
                    Entry::Occupied(mut place) => {
                        let all: &mut Statistics = place.get_mut();
                        // Both are at most all trials of the run, so no count overflows.
                        if since.trials() > trials - all.trials() {
                            return Err(blocks.foreign());
                        }
                        all.merge(&since);
                    }
                }
            }
            walk.go_to(next, usize::try_from(next.0).ok().and_then(|point| points.get(&point)));
        }
        Ok(Self { identity: blocks.identity.clone(), walk, points, damaged: blocks.damaged })
    }
}

#[cfg(test)]
mod tests {
    use super::super::Shard;
    use super::super::walk::tests::{identity, row};
    use super::*;

    /// An error of a trial at a point.
    fn of(point: usize, trial: u64) -> Row {
        row(trial, ((trial * 7 + point as u64) as f64).sin() * 3.0)
    }

    #[test]
    fn law_counts_of_sectors_survive_the_journal() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.journal");
        let identity = identity("{}", Shard::WHOLE);
        let mut tally = Tally::open(&path, &identity, 2.0).expect("a new run");
        let mut expected = Statistics::with_limit(2.0);
        for (point, trial) in tally.walk().ahead(300) {
            assert_eq!(point, 0);
            let error = (trial as f64 - 150.0) / 2.0;
            let row = Row { half_sector_deg: Some(30.0), error_deg: Some(error), ..row(trial, error) };
            expected.add_row(&row);
            tally.append(&[row]).expect("the next one");
        }
        tally.sync().expect("written");
        drop(tally);
        let read = Tallied::read(&path).expect("readable");
        let summary = read.points[&0].summary();
        assert_eq!(summary.sectors, expected.summary().sectors);
        assert!(summary.sectors.is_some_and(|of| of.named == 300 && of.right > 100 && of.next > 50));
    }

    /// Appends the next rows in blocks of 100, at most `most` of them; a sync after each third block.
    fn go_on(tally: &mut Tally, most: u64) {
        let mut left = most;
        for block in 0.. {
            let ahead = tally.walk().ahead(100.min(left));
            if ahead.is_empty() {
                break;
            }
            left -= ahead.len() as u64;
            let rows: Vec<Row> = ahead.iter().map(|(point, trial)| of(*point, *trial)).collect();
            tally.append(&rows).expect("the next ones");
            if block % 3 == 0 {
                tally.sync().expect("written");
            }
        }
    }

    #[test]
    fn law_killed_and_resumed_the_statistics_are_those_of_the_rows() {
        for (stop_at, most) in [("{}", 8_765), ("{ rms = \"3 %\" }", 777)] {
            let folder = tempfile::tempdir().expect("a folder");
            let identity = identity(stop_at, Shard::WHOLE);
            // The rows themselves, without any journal.
            let mut walk = Walk::new(&identity);
            let mut expected: BTreeMap<usize, Statistics> = BTreeMap::new();
            while !walk.is_done() {
                for (point, trial) in walk.ahead(u64::MAX) {
                    let row = of(point, trial);
                    walk.take(&row).expect("the next one");
                    expected.entry(point).or_insert_with(|| Statistics::with_limit(1.5)).add_row(&row);
                }
            }
            let path = folder.path().join("run.journal");
            let mut times = 0;
            while !Tallied::read(&path).is_ok_and(|tallied| tallied.walk.is_done()) {
                let mut tally = Tally::open(&path, &identity, 1.5).expect("the same run");
                // A second process is kept out.
                assert!(matches!(Tally::open(&path, &identity, 1.5), Err(JournalError::Busy(_))));
                // Killed: what was appended after the last sync is lost, and a block may be cut.
                go_on(&mut tally, most);
                if tally.walk().is_done() {
                    tally.sync().expect("written");
                } else if times % 2 == 1 {
                    tally.file.set_len(tally.file.metadata().expect("there").len() - 3).expect("cut");
                }
                times += 1;
            }
            assert!(times > 1, "{times}");
            let found = Tallied::read(&path).expect("readable");
            assert_eq!(found.points.len(), 5);
            for (point, statistics) in &found.points {
                assert_eq!(statistics.summary(), expected[point].summary(), "{point}");
            }
            let other = Identity { seed: 2, ..identity };
            assert!(matches!(Tally::open(&path, &other, 1.5), Err(JournalError::Other { .. })));
            // A bit that fell over in the last block: it is reported, and computed again.
            let whole = std::fs::read(&path).expect("there");
            let mut bytes = whole.clone();
            let last = bytes.len() - 20;
            bytes[last] ^= 1;
            std::fs::write(&path, bytes).expect("written");
            let damaged = Tallied::read(&path).expect("readable up to there");
            assert!(damaged.damaged && !found.damaged);
            let standing = || crate::store::shards::standing(&path).expect("readable");
            assert!(standing().2, "status names it, too");
            std::fs::write(&path, &whole[..whole.len() - 20]).expect("written");
            assert!(!Tallied::read(&path).expect("cut off").damaged && !standing().2);
        }
    }

    /// Statistics of up to a hundred thousand trials have each error, of 8 bytes. A journal that wrote those of all trials at every hundredth
    /// trial would have 8 · 100 · (1 + 2 + … + n/100) bytes, 0.04 n²; this one has 8 n and a block's counts, sums and checksum.
    #[test]
    fn analytic_a_journal_has_each_error_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.journal");
        let mut tally = Tally::open(&path, &identity("{}", Shard::WHOLE), 1.5).expect("a new run");
        let (mut trials, mut blocks) = (0, 0);
        loop {
            let ahead = tally.walk().ahead(100);
            if ahead.is_empty() {
                break;
            }
            let rows: Vec<Row> = ahead.iter().map(|(point, trial)| of(*point, *trial)).collect();
            tally.append(&rows).expect("the next ones");
            tally.sync().expect("written");
            (trials, blocks) = (trials + rows.len() as u64, blocks + 1);
        }
        drop(tally);
        let length = std::fs::metadata(&path).expect("there").len();
        assert!(trials > 5000 && blocks > 50, "{trials} {blocks}");
        assert!(length < 8 * trials + 500 * blocks, "{length} {trials} {blocks}");
    }

    /// A block whose checksum is right, and that no run writes.
    #[test]
    fn regress_statistics_that_cannot_be_are_no_journal_of_a_run() {
        let identity = identity("{}", Shard::WHOLE);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.statistics");
        let mut statistics = Statistics::default();
        statistics.add_row(&row(0, 0.3));
        let text = serde_json::to_string(&statistics).expect("JSON");
        let read = |next: (u64, u64), point: usize, changed: &str| {
            let statistics: Statistics = serde_json::from_str(changed).expect("statistics");
            let standing = Standing { next, points: BTreeMap::from([(point, statistics)]) };
            let block = encoded(&standing, &Tail::<Sectors>::new()).expect("encoded");
            let bytes = [journal::beginning(TALLY, &identity).expect("a beginning"), block].concat();
            std::fs::write(&path, bytes).expect("written");
            Tallied::read(&path)
        };
        let last = usize::try_from(identity.points).expect("few") - 1;
        assert!(read((0, 1), 0, &text).is_ok() && read((identity.points, 0), last, &text).is_ok());
        for (next, point, from, to) in [
            ((0, 1), 0, "\"trials\":1", "\"trials\":0"),
            ((0, 1), 0, "\"failed\":0", "\"failed\":18446744073709551615"),
            ((0, 1), 0, "\"trials\":1", "\"trials\":99999999999"),
            ((0, 1), 0, "\"exact\":[0.3]", "\"exact\":[]"),
            ((0, 1), last + 1, "", ""),
            ((identity.points + 1, 0), 0, "", ""),
            ((0, identity.trials), 0, "", ""),
        ] {
            let changed = text.replacen(from, to, 1);
            assert!(from.is_empty() || changed != text, "{from}");
            let found = read(next, point, &changed);
            assert!(matches!(found, Err(JournalError::Foreign(_))), "{next:?} {to}: {found:?}");
        }
    }
}
