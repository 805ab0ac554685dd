//! The journal of a run: a header that says what run it is, then blocks of rows.
//!
//! ```text
//!   magic  length  header (JSON)  crc │ length  rows  crc │ length  rows  crc │ …
//! ```
//! Lengths and checksums are little-endian 32-bit numbers. A process that is killed leaves at most one block that is not
//! whole; opening the journal again cuts it off. Blocks are handed to the disk at least once a second, so that a power cut
//! costs no more than that.

use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::row::Row;

const MAGIC: &[u8; 8] = b"stdstil1";

/// Which part of a run this is: trials of all points are numbered through, and shard `index` of `count` has an equal part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// From 1.
    pub index: u64,
    /// How many there are.
    pub count: u64,
}

impl Shard {
    /// All of it.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// The rows of `all` that are its own.
    pub fn range(&self, all: u64) -> std::ops::Range<u64> {
        // In 128 bits, because a product of two counts may not fit in 64.
        let end = |index: u64| {
            u64::try_from(u128::from(all) * u128::from(index) / u128::from(self.count)).unwrap_or(all)
        };
        end(self.index - 1)..end(self.index)
    }
}

/// What makes two runs the same.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Version of the program.
    pub version: String,
    /// The scenario with all overrides, as a file would say it.
    pub scenario: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Points of the axes.
    pub points: u64,
    /// Trials at each.
    pub trials: u64,
    /// Which part of them.
    pub shard: Shard,
}

impl Identity {
    /// Rows of all shards together.
    pub fn rows(&self) -> u64 {
        self.points.saturating_mul(self.trials)
    }

    /// The first difference from another run, in words; none: they are the same.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let differ = |what: &str, own: &dyn fmt::Display, other: &dyn fmt::Display| {
            Some(format!("{what} is {own} there and {other} here"))
        };
        if self.version != other.version {
            return differ("the program's version", &self.version, &other.version);
        }
        if self.seed != other.seed {
            return differ("the seed", &self.seed, &other.seed);
        }
        if self.trials != other.trials {
            return differ("the number of trials", &self.trials, &other.trials);
        }
        if self.shard != other.shard {
            let name = |shard: &Shard| format!("{}/{}", shard.index, shard.count);
            return differ("the shard", &name(&self.shard), &name(&other.shard));
        }
        let mut lines = self.scenario.lines().zip(other.scenario.lines());
        if let Some((own, other)) = lines.find(|(own, other)| own != other) {
            return differ("the scenario", &format!("`{own}`"), &format!("`{other}`"));
        }
        (self != other).then(|| "one scenario says more than the other".to_owned())
    }
}

/// A journal that cannot be used.
#[derive(Debug)]
pub enum JournalError {
    /// The operating system refused.
    Io(PathBuf, io::Error),
    /// Not a journal, or its header is damaged.
    Foreign(PathBuf),
    /// The journal of another run.
    Other {
        /// The journal.
        path: PathBuf,
        /// What is different.
        difference: String,
    },
}

impl fmt::Display for JournalError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io(path, error) => write!(f, "{}: {error}", path.display()),
            Self::Foreign(path) => write!(f, "{} is no journal of a run", path.display()),
            Self::Other { path, difference } => {
                write!(f, "{} is the journal of another run: {difference}", path.display())
            }
        }
    }
}

impl std::error::Error for JournalError {}

/// How long rows may wait before the disk has them.
const PATIENCE: Duration = Duration::from_secs(1);

/// A journal that is being written.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: BufWriter<File>,
    rows: u64,
    synced: Instant,
}

impl Journal {
    /// Begins a journal; one that is there is replaced.
    pub fn create(path: &Path, identity: &Identity) -> Result<Self, JournalError> {
        let io = |error| JournalError::Io(path.to_owned(), error);
        let file = File::create(path).map_err(io)?;
        let mut journal =
            Self { path: path.to_owned(), file: BufWriter::new(file), rows: 0, synced: Instant::now() };
        let header = serde_json::to_vec(identity).map_err(|error| io(error.into()))?;
        journal.file.write_all(MAGIC).map_err(io)?;
        journal.write_block(&header)?;
        journal.sync()?;
        Ok(journal)
    }

    /// Goes on with the journal of this very run, behind its last whole block.
    pub fn resume(path: &Path, identity: &Identity) -> Result<Self, JournalError> {
        let mut rows = Rows::open(path)?;
        if let Some(difference) = rows.identity().difference(identity) {
            return Err(JournalError::Other { path: path.to_owned(), difference });
        }
        let mut count = 0;
        while let Some(block) = rows.block()? {
            count += block.len() as u64;
        }
        let whole = rows.whole;
        let io = |error| JournalError::Io(path.to_owned(), error);
        let mut file = OpenOptions::new().write(true).open(path).map_err(io)?;
        file.set_len(whole).map_err(io)?;
        file.seek(SeekFrom::End(0)).map_err(io)?;
        Ok(Self { path: path.to_owned(), file: BufWriter::new(file), rows: count, synced: Instant::now() })
    }

    /// Rows that it holds.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Appends rows as one block.
    pub fn append(&mut self, rows: &[Row]) -> Result<(), JournalError> {
        let bytes = postcard::to_stdvec(rows)
            .map_err(|error| JournalError::Io(self.path.clone(), io::Error::other(error)))?;
        self.write_block(&bytes)?;
        self.rows += rows.len() as u64;
        if self.synced.elapsed() >= PATIENCE {
            self.sync()?;
        }
        Ok(())
    }

    /// Hands everything to the disk.
    pub fn sync(&mut self) -> Result<(), JournalError> {
        let io = |error| JournalError::Io(self.path.clone(), error);
        self.file.flush().map_err(io)?;
        self.file.get_ref().sync_data().map_err(io)?;
        self.synced = Instant::now();
        Ok(())
    }

    fn write_block(&mut self, bytes: &[u8]) -> Result<(), JournalError> {
        let io = |error| JournalError::Io(self.path.clone(), error);
        let length = u32::try_from(bytes.len()).map_err(|_| io(io::ErrorKind::FileTooLarge.into()))?;
        self.file.write_all(&length.to_le_bytes()).map_err(io)?;
        self.file.write_all(bytes).map_err(io)?;
        self.file.write_all(&crc32fast::hash(bytes).to_le_bytes()).map_err(io)?;
        // The process may be killed at any time; what the system has, it keeps.
        self.file.flush().map_err(io)
    }
}

/// A journal that is being read, block by block.
#[derive(Debug)]
pub struct Rows {
    path: PathBuf,
    file: BufReader<File>,
    identity: Identity,
    /// Bytes up to the end of the last whole block.
    whole: u64,
}

impl Rows {
    /// Opens a journal and reads its header.
    pub fn open(path: &Path) -> Result<Self, JournalError> {
        let file = File::open(path).map_err(|error| JournalError::Io(path.to_owned(), error))?;
        let mut file = BufReader::new(file);
        let foreign = || JournalError::Foreign(path.to_owned());
        let mut magic = [0; MAGIC.len()];
        file.read_exact(&mut magic).map_err(|_| foreign())?;
        if magic != *MAGIC {
            return Err(foreign());
        }
        let mut whole = MAGIC.len() as u64;
        let header = read_block(&mut file, &mut whole).ok_or_else(foreign)?;
        let identity = serde_json::from_slice(&header).map_err(|_| foreign())?;
        Ok(Self { path: path.to_owned(), file, identity, whole })
    }

    /// What run it is of.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// The next block; none at the end, or where a block is not whole.
    pub fn block(&mut self) -> Result<Option<Vec<Row>>, JournalError> {
        let Some(bytes) = read_block(&mut self.file, &mut self.whole) else { return Ok(None) };
        // The checksum is right: only another version of the program writes what this one cannot read.
        postcard::from_bytes(&bytes).map(Some).map_err(|_| JournalError::Foreign(self.path.clone()))
    }
}

/// A block with the right checksum; `whole` moves behind it.
fn read_block(file: &mut impl Read, whole: &mut u64) -> Option<Vec<u8>> {
    let mut word = [0; 4];
    file.read_exact(&mut word).ok()?;
    let length = u32::from_le_bytes(word);
    let mut bytes = Vec::new();
    // A damaged length must not ask for gigabytes that are not there.
    file.take(u64::from(length)).read_to_end(&mut bytes).ok()?;
    if bytes.len() as u64 != u64::from(length) {
        return None;
    }
    file.read_exact(&mut word).ok()?;
    if u32::from_le_bytes(word) != crc32fast::hash(&bytes) {
        return None;
    }
    *whole += 8 + u64::from(length);
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Verdict;

    fn identity() -> Identity {
        Identity {
            version: "1".to_owned(),
            scenario: "seed = 1\ntrials = 100\n".to_owned(),
            seed: 1,
            points: 1,
            trials: 100,
            shard: Shard::WHOLE,
        }
    }

    fn row(trial: u64) -> Row {
        Row {
            trial,
            true_angle_deg: trial as f64 * 0.1,
            start_angle_deg: 1.0 / 3.0,
            estimated_angle_deg: (!trial.is_multiple_of(3)).then_some(0.1 + trial as f64),
            error_deg: None,
            axis_deg: Some(7.0),
            axis_error_deg: Some(-0.25),
            verdict: if trial.is_multiple_of(3) { Verdict::Undetermined } else { Verdict::Found },
            pole_correct: Some(trial.is_multiple_of(2)),
            rotor_moved_deg: 0.0,
            duration_s: 1e-3,
            peak_current_a: 5.0,
            reason: if trial.is_multiple_of(3) { "so".to_owned() } else { String::new() },
            kind: String::new(),
        }
    }

    fn all(path: &Path) -> Vec<Row> {
        let mut rows = Rows::open(path).expect("a journal");
        std::iter::from_fn(|| rows.block().expect("readable")).flatten().collect()
    }

    #[test]
    fn law_what_is_written_is_read_and_a_torn_block_is_cut_off_at_every_byte() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("journal");
        let mut journal = Journal::create(&path, &identity()).expect("writable");
        let rows: Vec<Row> = (0..12).map(row).collect();
        journal.append(&rows[..5]).expect("written");
        journal.sync().expect("written");
        let first = std::fs::metadata(&path).expect("there").len();
        journal.append(&rows[5..]).expect("written");
        drop(journal);
        assert_eq!(all(&path), rows);
        let bytes = std::fs::read(&path).expect("there");
        for cut in usize::try_from(first).expect("small")..bytes.len() {
            std::fs::write(&path, &bytes[..cut]).expect("written");
            let mut journal = Journal::resume(&path, &identity()).expect("the same run");
            assert_eq!(journal.rows(), 5, "{cut}");
            journal.append(&rows[5..]).expect("written");
            drop(journal);
            assert_eq!(std::fs::read(&path).expect("there"), bytes, "{cut}");
        }
        // A block with a flipped bit is none, nor is what follows it.
        let mut damaged = bytes.clone();
        let place = usize::try_from(first).expect("small") + 20;
        damaged[place] ^= 1;
        std::fs::write(&path, damaged).expect("written");
        assert_eq!(all(&path), rows[..5]);
    }

    #[test]
    fn law_the_journal_of_another_run_is_refused_with_the_difference() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("journal");
        drop(Journal::create(&path, &identity()).expect("writable"));
        let other = [
            (Identity { seed: 2, ..identity() }, "the seed is 1 there and 2 here"),
            (Identity { version: "2".to_owned(), ..identity() }, "version is 1 there and 2 here"),
            (Identity { trials: 50, ..identity() }, "trials is 100 there and 50 here"),
            (
                Identity { shard: Shard { index: 1, count: 2 }, ..identity() },
                "shard is 1/1 there and 1/2 here",
            ),
            (
                Identity { scenario: "seed = 1\ntrials = 100\nx = 1\n".to_owned(), ..identity() },
                "says more than the other",
            ),
        ];
        for (identity, part) in other {
            let error = Journal::resume(&path, &identity).expect_err("another run").to_string();
            assert!(error.contains(part), "{error}");
        }
        std::fs::write(&path, "something else").expect("written");
        assert!(matches!(Journal::resume(&path, &identity()), Err(JournalError::Foreign(_))));
    }

    #[test]
    fn law_shards_are_all_rows_once() {
        for all in [0, 1, 7, 1000, u64::MAX / 2] {
            for count in [1, 2, 3, 10] {
                let mut next = 0;
                for index in 1..=count {
                    let range = Shard { index, count }.range(all);
                    assert_eq!(range.start, next);
                    next = range.end;
                }
                assert_eq!(next, all);
            }
        }
    }
}
