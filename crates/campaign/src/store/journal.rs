//! The journal of a run: a header with the identity of the run, then blocks of rows.
//!
//! ```text
//!   magic  length  header (JSON)  crc │ length  rows  crc │ length  rows  crc │ …
//! ```
//! Lengths and checksums are little-endian 32-bit numbers. A process that is killed leaves at most one block that is
//! not complete; opening the journal again cuts it off. Blocks are synchronised with the disk at least once a second,
//! so that a power cut costs at most a second of work.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::de::DeserializeOwned;
use standstill_files::{open, open_as, remedy};
use thiserror::Error;

use super::block::{Block, Tail, block, encoded, read_block, split};
use super::identity::{Identity, Shard};
use super::row::Row;
use super::walk::Walk;

/// Magic bytes of a journal of rows.
const ROWS: [u8; 8] = *b"stdstil1";

/// Magic bytes of a journal of statistics, see [`super::Tally`].
pub(super) const TALLY: [u8; 8] = *b"stdstilU";

/// A journal that cannot be used.
#[derive(Debug, Error)]
pub enum JournalError {
    /// The operating system refused.
    #[error("{0}: {1}{remedy}", remedy = remedy(.1))]
    Io(PathBuf, io::Error),
    /// The file is not a journal, or its header is damaged.
    #[error("{0} is no journal of a run")]
    Foreign(PathBuf),
    /// The journal ended before all its rows were read, although they had been there.
    #[error("{0} has fewer rows than it had")]
    Short(PathBuf),
    /// Another process is writing it.
    #[error("{0} is being written by another process")]
    Busy(PathBuf),
    /// The journal of another run.
    #[error(
        "{path} is the journal of another run: {difference}; go on with what it was begun with, with another --out, \
         or begin anew with --force in place of --resume"
    )]
    Other {
        /// The journal.
        path: PathBuf,
        /// The differences, in words.
        difference: String,
    },
}

/// Destination of a run's rows during the run.
pub trait Keep {
    /// Returns the run's progress.
    fn walk(&self) -> &Walk;

    /// Returns the point and trial of the next rows, at most `most` of them.
    fn ahead(&self, most: u64) -> Vec<(usize, u64)> {
        self.walk().ahead(most)
    }

    /// Stores rows, which must be the next ones of the run.
    ///
    /// # Errors
    /// The rows are not the next ones, or they cannot be written.
    fn append(&mut self, rows: &[Row]) -> Result<(), JournalError>;

    /// Hands everything to the disk.
    ///
    /// # Errors
    /// Where it cannot be written.
    fn sync(&mut self) -> Result<(), JournalError>;
}

/// Longest time before rows are synchronised with the disk.
const PATIENCE: Duration = Duration::from_secs(1);

/// A journal that is being written, by this process alone.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: BufWriter<File>,
    walk: Walk,
    synced: Instant,
    damaged: Option<PathBuf>,
}

impl Journal {
    /// Begins a journal; one that is there is replaced.
    pub fn create(path: &Path, identity: &Identity) -> Result<Self, JournalError> {
        let file = BufWriter::new(begun(path, ROWS, identity)?);
        let (path, walk) = (path.to_owned(), Walk::new(identity));
        let mut journal = Self { path, file, walk, synced: Instant::now(), damaged: None };
        journal.sync()?;
        Ok(journal)
    }

    /// Goes on with the journal of this very run, behind its last whole block; `seen` gets its rows with their points.
    pub fn resume(
        path: &Path,
        identity: &Identity,
        mut seen: impl FnMut(usize, &Row),
    ) -> Result<Self, JournalError> {
        let io = |error| JournalError::Io(path.to_owned(), error);
        let mut file = locked(path, OpenOptions::new().read(true).write(true))?;
        // Killed before even the header was whole: nothing was done yet.
        if is_beginning(&file, ROWS, identity).map_err(io)? {
            drop(file);
            return Self::create(path, identity);
        }
        let mut rows = Rows::open(path)?;
        rows.blocks.check(identity)?;
        while let Some(block) = rows.block()? {
            for (point, row) in &block {
                seen(*point, row);
            }
        }
        let end = file.metadata().map_err(io)?.len();
        let Blocks { whole, damaged, .. } = rows.blocks;
        let damaged = damaged.then(|| damaged_name(path));
        if let Some(aside) = &damaged {
            // A process that is killed leaves a block that is short; this one is whole and wrong.
            let keep = |error| JournalError::Io(aside.clone(), error);
            file.seek(SeekFrom::Start(whole)).map_err(io)?;
            let mut tail = File::create(aside).map_err(keep)?;
            io::copy(&mut (&file).take(end - whole), &mut tail).map_err(keep)?;
        }
        file.set_len(whole).map_err(io)?;
        file.seek(SeekFrom::End(0)).map_err(io)?;
        let file = BufWriter::new(file);
        Ok(Self { path: path.to_owned(), file, walk: rows.walk, synced: Instant::now(), damaged })
    }

    /// Returns the path of the copy of a damaged block and all that followed it; none if no block was damaged.
    pub fn damaged(&self) -> Option<&Path> {
        self.damaged.as_deref()
    }

    /// Returns whether another process is writing this journal.
    pub fn is_busy(path: &Path) -> bool {
        open(path).is_ok_and(|file| matches!(lock(&file, path), Err(JournalError::Busy(_))))
    }
}

impl Keep for Journal {
    fn walk(&self) -> &Walk {
        &self.walk
    }

    /// Appends the rows as one block.
    fn append(&mut self, rows: &[Row]) -> Result<(), JournalError> {
        if rows.is_empty() {
            return Ok(());
        }
        let io = |error| JournalError::Io(self.path.clone(), error);
        for row in rows {
            self.walk.take(row).ok_or_else(|| out_of_order(&self.path))?;
        }
        // The numbers of rows count on from one quantity to the next. Earlier builds wrote the first quantity alone.
        let behind: Tail<f64> = (0..)
            .zip(rows)
            .flat_map(|(k, row)| {
                let values = row.clone().behind().map(|value| *value);
                (0..)
                    .zip(values)
                    .filter_map(move |(quantity, value)| Some((quantity * rows.len() + k, value?)))
            })
            .collect();
        encoded(rows, &behind).and_then(|block| self.file.write_all(&block)).map_err(io)?;
        // The process may be killed at any time; what the system has, it keeps.
        self.file.flush().map_err(io)?;
        if self.synced.elapsed() >= PATIENCE {
            self.sync()?;
        }
        Ok(())
    }

    fn sync(&mut self) -> Result<(), JournalError> {
        let io = |error| JournalError::Io(self.path.clone(), error);
        self.file.flush().map_err(io)?;
        self.file.get_ref().sync_data().and_then(|()| still_there(&self.path)).map_err(io)?;
        self.synced = Instant::now();
        Ok(())
    }
}

/// Returns the rows that are not the next ones.
pub(super) fn out_of_order(path: &Path) -> JournalError {
    JournalError::Io(path.to_owned(), io::Error::other("rows out of order"))
}

/// Returns the name of the file, beside a journal, for the part that was cut off from it.
fn damaged_name(path: &Path) -> PathBuf {
    path.with_extension("damaged")
}

/// Returns a journal, taken for this process.
pub(super) fn locked(path: &Path, how: &OpenOptions) -> Result<File, JournalError> {
    let file = open_as(path, how).map_err(|error| JournalError::Io(path.to_owned(), error))?;
    lock(&file, path)?;
    Ok(file)
}

/// Returns a journal of this run that has its header alone; one that is there is replaced.
pub(super) fn begun(path: &Path, magic: [u8; 8], identity: &Identity) -> Result<File, JournalError> {
    // Not truncated before it is locked: another process may be writing it.
    let mut file = locked(path, OpenOptions::new().write(true).create(true).truncate(false))?;
    let refused = |error| JournalError::Io(path.to_owned(), error);
    let bytes = beginning(magic, identity).map_err(refused)?;
    file.set_len(0).map_err(refused)?;
    file.write_all(&bytes).map_err(|error| {
        // Half a header keeps nothing, and would be in the way of the next try.
        let _ = std::fs::remove_file(path);
        refused(error)
    })?;
    Ok(file)
}

/// Takes a journal for this process. Where the file system has no locks, nobody is kept out.
fn lock(file: &File, path: &Path) -> Result<(), JournalError> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(JournalError::Busy(path.to_owned())),
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}

/// Returns the bytes that a journal of this run begins with.
pub(super) fn beginning(magic: [u8; 8], identity: &Identity) -> io::Result<Vec<u8>> {
    Ok([magic.to_vec(), block(&serde_json::to_vec(identity)?)?].concat())
}

/// Returns whether a file is the begin of such a journal of this run and ends within its header.
pub(super) fn is_beginning(file: &File, magic: [u8; 8], identity: &Identity) -> io::Result<bool> {
    let beginning = beginning(magic, identity)?;
    if file.metadata()?.len() >= beginning.len() as u64 {
        return Ok(false);
    }
    let (mut there, mut file) = (Vec::new(), file);
    file.seek(SeekFrom::Start(0))?;
    file.read_to_end(&mut there)?;
    Ok(beginning.starts_with(&there))
}

/// Refuses to go on where the journal is no longer under its name: what it keeps would be lost with the process.
pub(super) fn still_there(path: &Path) -> io::Result<()> {
    match path.metadata() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            Err(io::Error::new(error.kind(), "it was removed while the run wrote it"))
        }
        _ => Ok(()),
    }
}

/// Returns whether a journal keeps statistics alone.
pub(super) fn is_tally(path: &Path) -> bool {
    let mut found = [0; 8];
    open(path).and_then(|mut file| file.read_exact(&mut found)).is_ok() && found == TALLY
}

/// A journal of any kind that is being read, block by block.
#[derive(Debug)]
pub(super) struct Blocks {
    path: PathBuf,
    file: BufReader<File>,
    /// Identity of the run.
    pub(super) identity: Identity,
    /// Bytes up to the end of the last whole block.
    pub(super) whole: u64,
    /// Whether the data after the last block are a wrong block, not just a block that was cut short.
    pub(super) damaged: bool,
}

impl Blocks {
    /// Opens a journal with these magic bytes and reads its header.
    pub(super) fn open(path: &Path, magic: [u8; 8]) -> Result<Self, JournalError> {
        let io = |error| JournalError::Io(path.to_owned(), error);
        let foreign = || JournalError::Foreign(path.to_owned());
        let mut file = BufReader::new(open(path).map_err(io)?);
        let mut found = [0; 8];
        file.read_exact(&mut found).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => foreign(),
            _ => io(error),
        })?;
        if found != magic {
            let keeps = |what: &str, here: &str| JournalError::Other {
                path: path.to_owned(),
                difference: format!("it keeps {what} there and {here} here (--rows)"),
            };
            return Err(match (found, magic) {
                (ROWS, TALLY) => keeps("rows", "statistics alone"),
                (TALLY, ROWS) => keeps("statistics alone", "rows"),
                _ => foreign(),
            });
        }
        let mut whole = 8;
        let Block::Whole(header) = read_block(&mut file, &mut whole).map_err(io)? else {
            return Err(foreign());
        };
        let identity: Identity = serde_json::from_slice(&header).map_err(|_| foreign())?;
        let Shard { index, count } = identity.shard;
        if identity.trials == 0 || !(1..=count).contains(&index) {
            return Err(foreign());
        }
        Ok(Self { path: path.to_owned(), file, identity, whole, damaged: false })
    }

    /// Refuses the journal of another run.
    pub(super) fn check(&self, identity: &Identity) -> Result<(), JournalError> {
        let other = |difference| Err(JournalError::Other { path: self.path.clone(), difference });
        self.identity.difference(identity).map_or(Ok(()), other)
    }

    /// Returns the value of the next block and the data behind it; none at the end, or if the block is not complete.
    pub(super) fn next<T: DeserializeOwned, B: DeserializeOwned>(
        &mut self,
    ) -> Result<Option<(T, Tail<B>)>, JournalError> {
        let io = |error| JournalError::Io(self.path.clone(), error);
        match read_block(&mut self.file, &mut self.whole).map_err(io)? {
            // The checksum is right: only another version of the program writes what this one cannot read.
            Block::Whole(bytes) => split(&bytes).map(Some).map_err(|_| self.foreign()),
            Block::Short => self.file.seek(SeekFrom::Start(self.whole)).map(|_| None).map_err(io),
            Block::Wrong => {
                self.damaged = true;
                Ok(None)
            }
        }
    }

    /// Returns the error of a file that no run wrote.
    pub(super) fn foreign(&self) -> JournalError {
        JournalError::Foreign(self.path.clone())
    }
}

/// A journal of rows that is being read, block by block.
#[derive(Debug)]
pub struct Rows {
    blocks: Blocks,
    walk: Walk,
}

impl Rows {
    /// Opens a journal and reads its header.
    pub fn open(path: &Path) -> Result<Self, JournalError> {
        let blocks = Blocks::open(path, ROWS)?;
        Ok(Self { walk: Walk::new(&blocks.identity), blocks })
    }

    /// Returns the identity of the run.
    pub fn identity(&self) -> &Identity {
        &self.blocks.identity
    }

    /// Returns the next rows with their points; none at the end, or if a block is not complete. A journal that is being
    /// written may give more rows later.
    pub fn block(&mut self) -> Result<Option<Vec<(usize, Row)>>, JournalError> {
        let Some((mut rows, behind)) = self.blocks.next::<Vec<Row>, f64>()? else { return Ok(None) };
        let count = rows.len().max(1);
        for (number, value) in behind {
            let row = rows.get_mut(number % count).map(Row::behind);
            let to = row.and_then(|row| row.into_iter().nth(number / count));
            *to.ok_or_else(|| self.blocks.foreign())? = Some(value);
        }
        let place = |row: Row| Some((self.walk.take(&row)?, row));
        let placed = rows.into_iter().map(place).collect::<Option<_>>();
        placed.map(Some).ok_or_else(|| self.blocks.foreign())
    }

    /// Returns whether the last whole block is followed by a damaged one; a block that is only cut short is not
    /// damaged.
    pub fn is_damaged(&self) -> bool {
        self.blocks.damaged
    }

    /// Progress of the run after the blocks so far.
    pub fn walk(&self) -> &Walk {
        &self.walk
    }
}

#[cfg(test)]
mod tests;
