//! Notes: intermediate results of a question about a scenario. Each is stored under a key that states what the result
//! depends on.
//!
//! ```text
//!   magic  length  header (JSON)  crc │ length  key, bytes  crc │ …
//! ```
//! A process that is killed leaves at most one incomplete block; opening the notes again cuts it off. So does the next note
//! after one that could not be written.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::block::{Tail, encoded};
use super::identity::Identity;
use super::journal::{self, Blocks, JournalError};

/// Magic bytes of a journal of notes.
const NOTES: [u8; 8] = *b"stdstilN";

/// Notes that are read back, in bytes: all of them are kept in memory.
const MOST_BYTES: u64 = 256 << 20;

/// Notes that are being written, by this process alone. The file is made with the first of them.
#[derive(Debug)]
pub struct Notes {
    path: PathBuf,
    identity: Identity,
    file: Option<File>,
    /// Bytes of the file up to the end of its last whole block.
    whole: u64,
    known: HashMap<String, Vec<u8>>,
}

impl Notes {
    /// Makes new notes.
    pub fn new(path: &Path, identity: &Identity) -> Self {
        Self {
            path: path.to_owned(),
            identity: identity.clone(),
            file: None,
            whole: 0,
            known: HashMap::new(),
        }
    }

    /// Opens the notes of this scenario to append to them, after their last whole block; without a file, new notes.
    ///
    /// # Errors
    /// Notes of another scenario, of another program, or that another process is writing.
    pub fn resume(path: &Path, identity: &Identity) -> Result<Self, JournalError> {
        let io = |error| JournalError::Io(path.to_owned(), error);
        let mut notes = Self::new(path, identity);
        if !path.exists() {
            return Ok(notes);
        }
        let mut file = journal::locked(path, OpenOptions::new().read(true).write(true))?;
        // Killed before even the header was whole: nothing was noted yet.
        if journal::is_beginning(&file, NOTES, identity).map_err(io)? {
            return Ok(notes);
        }
        let mut blocks = Blocks::open(path, NOTES)?;
        blocks.check(identity)?;
        while let Some(((key, note), _)) = blocks.next::<(String, Vec<u8>), f64>()? {
            if blocks.whole > MOST_BYTES {
                let found = format!("it has more than {} MiB of notes", MOST_BYTES >> 20);
                return Err(io(std::io::Error::other(found)));
            }
            notes.known.insert(key, note);
        }
        file.set_len(blocks.whole).and_then(|()| file.seek(SeekFrom::End(0))).map_err(io)?;
        notes.file = Some(file);
        notes.whole = blocks.whole;
        Ok(notes)
    }

    /// Removes the file in their place, unless another process is writing it.
    ///
    /// # Errors
    /// The file is being written, or cannot be removed.
    pub fn replace(&self) -> Result<(), JournalError> {
        let io = |error| JournalError::Io(self.path.clone(), error);
        let _taken = journal::locked(&self.path, OpenOptions::new().write(true))?;
        std::fs::remove_file(&self.path).map_err(io)
    }

    /// Returns the note of a key.
    pub fn get(&self, key: &str) -> Option<&[u8]> {
        self.known.get(key).map(Vec::as_slice)
    }

    /// Returns whether anything is kept in the file.
    pub fn is_begun(&self) -> bool {
        self.file.is_some()
    }

    /// Returns the notes something; it is with the operating system when this returns.
    ///
    /// # Errors
    /// A file that cannot be written, or that another process is writing.
    pub fn add(&mut self, key: &str, bytes: &[u8]) -> Result<(), JournalError> {
        let path = self.path.clone();
        let io = |error| JournalError::Io(path.clone(), error);
        let block = encoded(&(key, bytes), &Tail::<f64>::new()).map_err(io)?;
        if self.file.is_none() {
            self.begin()?;
        }
        let Some(file) = &mut self.file else { return Ok(()) };
        // Half a block, which a full disk leaves, would hide all that follow it.
        let place = file.set_len(self.whole).and_then(|()| file.seek(SeekFrom::Start(self.whole)));
        place.and_then(|_| file.write_all(&block)).map_err(io)?;
        self.whole += block.len() as u64;
        Ok(())
    }

    fn begin(&mut self) -> Result<(), JournalError> {
        let io = |error| JournalError::Io(self.path.clone(), error);
        if let Some(folder) = self.path.parent() {
            std::fs::create_dir_all(folder).map_err(io)?;
        }
        let file = journal::begun(&self.path, NOTES, &self.identity)?;
        self.whole = file.metadata().map_err(io)?.len();
        self.file = Some(file);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::Shard;
    use super::super::walk::tests::identity;
    use super::*;

    #[test]
    fn law_notes_survive_a_kill_and_are_of_one_scenario() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("new/tune.journal");
        let scenario = identity("{}", Shard::WHOLE);
        let mut notes = Notes::new(&path, &scenario);
        assert!(!path.exists() && !notes.is_begun(), "nothing was noted yet");
        notes.add("a", b"one").expect("written");
        notes.add("b", b"two").expect("written");
        assert!(matches!(Notes::resume(&path, &scenario), Err(JournalError::Busy(_))));
        drop(notes);
        // Killed within the last block.
        let file = OpenOptions::new().write(true).open(&path).expect("there");
        file.set_len(file.metadata().expect("there").len() - 2).expect("cut");
        let mut notes = Notes::resume(&path, &scenario).expect("the same");
        assert_eq!((notes.get("a"), notes.get("b")), (Some(&b"one"[..]), None));
        notes.add("b", b"three").expect("written");
        drop(notes);
        let notes = Notes::resume(&path, &scenario).expect("the same");
        assert_eq!((notes.get("a"), notes.get("b")), (Some(&b"one"[..]), Some(&b"three"[..])));
        assert!(matches!(Notes::new(&path, &scenario).replace(), Err(JournalError::Busy(_))));
        drop(notes);
        let other = Identity { seed: 2, ..scenario };
        assert!(matches!(Notes::resume(&path, &other), Err(JournalError::Other { .. })));
        Notes::new(&path, &other).replace().expect("nobody writes it");
        assert!(!path.exists());
    }

    #[test]
    fn regress_half_a_header_is_no_note_and_half_a_note_hides_none() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("odds.journal");
        let scenario = identity("{}", Shard::WHOLE);
        let header = journal::beginning(NOTES, &scenario).expect("encoded");
        for cut in [0, 5, 40, header.len() - 1] {
            std::fs::write(&path, &header[..cut]).expect("written");
            let mut notes = Notes::resume(&path, &scenario).expect("nothing was noted yet");
            assert!(!notes.is_begun());
            notes.add("a", b"one").expect("written");
            // A full disk leaves a part of the note that it had no room for.
            let mut file = OpenOptions::new().append(true).open(&path).expect("there");
            file.write_all(&[40, 0, 0, 0, 1, 2]).expect("written");
            notes.add("b", b"two").expect("written");
            drop(notes);
            let notes = Notes::resume(&path, &scenario).expect("whole");
            assert_eq!((notes.get("a"), notes.get("b")), (Some(&b"one"[..]), Some(&b"two"[..])));
        }
    }
}
