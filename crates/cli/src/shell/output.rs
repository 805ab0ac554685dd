//! The folder of results. A command's files appear in it all complete, or none of them does.
//!
//! The files are written into a hidden folder inside the target and renamed into place when all are complete, so that a
//! failure leaves the previous contents unchanged. The note of their question is renamed first: if a process is killed
//! between two renames, the same question may replace the files that it left.

mod single;

use std::fmt::Write as _;
use std::fs::{self, File, TryLockError};
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use standstill_files::Digest;
use standstill_report::figure::Figure;

pub use self::single::{beside, create_new, folder_of, replace};
use crate::error::Error;
use crate::shell::asked::{NOTE, NotedQuestion};
use crate::shell::locked;

/// Prefix of the names of hidden folders for unfinished files. The id of the process that made the folder follows the prefix.
const PREFIX: &str = ".standstill-";

/// Number of attempts to remove a folder at an interrupt, because another thread may still write files into it.
const AGAIN: u32 = 100;

/// The folders that an interrupt removes.
static UNFINISHED: Mutex<Option<Unfinished>> = Mutex::new(None);

/// Folders that exist only because of an unfinished run.
#[derive(Clone)]
struct Unfinished {
    staging: PathBuf,
    target: PathBuf,
    /// Topmost folder that this command created.
    made: Option<PathBuf>,
}

impl Unfinished {
    fn remove(&self) {
        // `remove_dir` comes first because it needs no free file descriptor, unlike `remove_dir_all`.
        let _ = fs::remove_dir(&self.staging).or_else(|_| fs::remove_dir_all(&self.staging));
        // Removes only folders that were created here and are empty: files of others stay.
        let Some(made) = &self.made else { return };
        for folder in self.target.ancestors().take_while(|folder| folder.starts_with(made)) {
            if fs::remove_dir(folder).is_err() {
                return;
            }
        }
    }
}

/// Removes unfinished files, before the process ends.
pub fn abandon() {
    if let Some(unfinished) = locked(&UNFINISHED).take() {
        // Another thread may be creating files in the folder meanwhile.
        for _ in 0..AGAIN {
            unfinished.remove();
            if !unfinished.staging.exists() {
                return;
            }
        }
    }
}

/// An output folder whose files are not complete yet.
pub struct Output {
    target: PathBuf,
    unfinished: Unfinished,
    names: Vec<String>,
    asked: Option<NotedQuestion>,
}

impl Output {
    /// Makes an output like [`Output::create`], and adds a note of the question to the folder. Files of another question are replaced only
    /// if `asked` allows this.
    pub fn answering(asked: NotedQuestion, target: &Path, names: &[&str]) -> Result<Self, Error> {
        asked.guard(target, names)?;
        let mut output = Self::create(target, names)?;
        output.asked = Some(asked);
        Ok(output)
    }

    /// Creates the folder if it is missing, and checks that files with these names can be written into it.
    pub fn create(target: &Path, names: &[&str]) -> Result<Self, Error> {
        // The nearest existing ancestor must be a folder: all folders created below it can be removed again.
        let nearest = target.ancestors().find(|path| path.symlink_metadata().is_ok());
        if let Some(nearest) = nearest
            && !nearest.is_dir()
        {
            return Err(Error::InTheWay { path: nearest.to_owned(), is: "not a folder", needed: "one" });
        }
        for name in names {
            let path = target.join(name);
            if path.is_dir() {
                return Err(Error::InTheWay { path, is: "a folder", needed: "free for a file" });
            }
        }
        let made = target
            .ancestors()
            .take_while(|path| !path.as_os_str().is_empty() && !path.exists())
            .last()
            .map(Path::to_owned);
        let mut unfinished = Unfinished { staging: PathBuf::new(), target: target.to_owned(), made };
        let staging = fs::create_dir_all(target).and_then(|()| {
            remove_stale(target);
            staging(target)
        });
        match staging {
            Ok(staging) => {
                unfinished.staging = staging;
                *locked(&UNFINISHED) = Some(unfinished.clone());
                Ok(Self { target: target.to_owned(), unfinished, names: Vec::new(), asked: None })
            }
            Err(error) => {
                unfinished.remove();
                Err(Error::Write(target.to_owned(), error))
            }
        }
    }

    fn staged(&self, name: &str) -> PathBuf {
        self.unfinished.staging.join(name)
    }

    /// Begins a file, which must be closed with [`Output::close`].
    pub fn begin(&mut self, name: &str) -> Result<BufWriter<File>, Error> {
        let file = File::create(self.staged(name)).map_err(Error::writing(&self.target.join(name)))?;
        self.names.push(name.to_owned());
        Ok(BufWriter::new(file))
    }

    /// Closes a file and synchronises it with the disk. Only then, a full disk is sure to cause an error.
    pub fn close(&self, name: &str, mut file: BufWriter<File>) -> Result<(), Error> {
        let synced = file.flush().and_then(|()| file.get_ref().sync_all());
        synced.map_err(Error::writing(&self.target.join(name)))
    }

    /// Returns size and checksum of a complete file.
    ///
    /// # Errors
    /// The file cannot be read back.
    pub fn digest(&self, name: &str) -> Result<String, Error> {
        let digest = Digest::of_file(&self.staged(name));
        digest.map(|digest| digest.to_string()).map_err(|error| Error::Read(self.target.join(name), error))
    }

    /// Writes a whole file at once.
    pub fn file(&mut self, name: &str, content: &[u8]) -> Result<(), Error> {
        let mut file = self.begin(name)?;
        file.write_all(content).map_err(Error::writing(&self.target.join(name)))?;
        self.close(name, file)
    }

    /// Writes a figure in two formats: `NAME.svg` and `NAME.png`.
    pub fn figure(&mut self, name: &str, figure: &Figure) -> Result<(), Error> {
        #[cfg(test)]
        crate::figures::tests::seen(name, figure);
        self.file(&format!("{name}.svg"), figure.svg()?.as_bytes())?;
        self.file(&format!("{name}.png"), &figure.png()?)
    }

    /// Moves all files into place. Returns their names.
    pub fn finish(mut self) -> Result<Vec<String>, Error> {
        // Holds the folder's lock until this function returns, so that processes take turns.
        let _turn = turn(&self.target);
        if let Some(asked) = self.asked.take() {
            let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
            // Another process may have answered another question here meanwhile.
            asked.guard(&self.target, &names)?;
            let note = asked.note(&self.target, &self.names, |name| self.staged(name));
            let note = note.map_err(|(name, error)| Error::Read(self.target.join(name), error))?;
            self.file(NOTE, &note)?;
            self.names.rotate_right(1);
        }
        self.place()
    }

    /// Renames all files into place, in the order in which they were begun. Returns their names without the note's.
    fn place(mut self) -> Result<Vec<String>, Error> {
        for name in &self.names {
            let path = self.target.join(name);
            fs::rename(self.staged(name), &path).map_err(Error::writing(&path))?;
        }
        // After a power cut, too, the files have their names. Not every system can synchronise a folder.
        let _ = File::open(&self.target).and_then(|folder| folder.sync_all());
        let names = std::mem::take(&mut self.names);
        Ok(names.into_iter().filter(|name| name != NOTE).collect())
    }
}

/// Longest wait until another process has moved its files into a folder. This usually takes milliseconds.
const PATIENCE: Duration = Duration::from_secs(10);

/// Locks a folder for this process until the returned value is dropped. Returns none if the system cannot lock folders, or if another
/// process holds the lock for longer than [`PATIENCE`], for example `flock` when it runs this program.
pub fn turn(folder: &Path) -> Option<File> {
    let folder = File::open(folder).ok()?;
    let begun = Instant::now();
    loop {
        match folder.try_lock() {
            Ok(()) => return Some(folder),
            Err(TryLockError::WouldBlock) if begun.elapsed() < PATIENCE => {
                std::thread::sleep(Duration::from_millis(5));
            }
            Err(_) => return None,
        }
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        // After a success the folder is not empty and stays.
        self.unfinished.remove();
        *locked(&UNFINISHED) = None;
    }
}

/// Returns the prefix of the names of this process's unfinished files and folders. After the end of the process, [`remove_stale`] removes
/// these files and folders.
pub fn unfinished_prefix() -> String {
    format!("{PREFIX}{}-", std::process::id())
}

/// Makes a folder for unfinished files.
fn staging(target: &Path) -> std::io::Result<PathBuf> {
    let mut number = 0;
    loop {
        let path = target.join(format!("{}{number}", unfinished_prefix()));
        match fs::create_dir(&path) {
            // The name is in use by another thread, or by a process with the same number on another machine.
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => number += 1,
            made => return made.map(|()| path),
        }
    }
}

/// Formats the list of written files.
pub fn file_list(folder: &Path, files: &[String]) -> String {
    let mut text = format!("Files in {}:\n", folder.display());
    for name in files {
        let _ = writeln!(text, "  {name}");
    }
    text
}

/// Removes unfinished files that killed processes left in this folder.
pub fn remove_stale(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let process =
            name.to_str().and_then(|name| name.strip_prefix(PREFIX)?.split('-').next()?.parse::<u32>().ok());
        // Without /proc the state of the process is unknown: its files stay.
        let dead = process.is_some_and(|id| {
            Path::new("/proc/self").exists() && !Path::new(&format!("/proc/{id}")).exists()
        });
        if dead {
            let path = entry.path();
            let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exists(path: &Path) -> bool {
        path.symlink_metadata().is_ok()
    }

    /// promise: whole-files
    #[test]
    fn law_a_failed_run_leaves_nothing_but_what_others_put_there() {
        let root = tempfile::tempdir().expect("a folder");
        let target = root.path().join("new/deep");
        let mut output = Output::create(&target, &["a.csv"]).expect("writable");
        output.file("a.csv", b"1").expect("written");
        drop(output);
        assert!(!exists(&root.path().join("new")), "made for nothing, gone again");

        let mut output = Output::create(&target, &["a.csv"]).expect("writable");
        output.file("a.csv", b"1").expect("written");
        fs::write(target.join("notes.txt"), "mine").expect("written");
        drop(output);
        assert_eq!(fs::read_dir(&target).expect("kept").count(), 1);
        assert!(exists(&target.join("notes.txt")));
    }

    /// promise: whole-files
    #[test]
    fn law_a_finished_run_replaces_its_own_files_only() {
        let root = tempfile::tempdir().expect("a folder");
        fs::write(root.path().join("a.csv"), "old").expect("written");
        fs::write(root.path().join("notes.txt"), "mine").expect("written");
        let mut output = Output::create(root.path(), &["a.csv"]).expect("writable");
        output.file("a.csv", b"new").expect("written");
        assert_eq!(fs::read(root.path().join("a.csv")).expect("there"), b"old", "not before all is complete");
        output.finish().expect("renamed");
        assert_eq!(fs::read(root.path().join("a.csv")).expect("there"), b"new");
        assert_eq!(fs::read_dir(root.path()).expect("a folder").count(), 2);
    }

    #[test]
    fn regress_what_a_killed_run_left_is_removed_by_the_next() {
        let root = tempfile::tempdir().expect("a folder");
        // No process has this number: Linux stops at 2^22.
        let stale = root.path().join(".standstill-4294967295-abcdef");
        fs::create_dir(&stale).expect("made");
        fs::write(stale.join("trials.csv"), "half").expect("written");
        drop(Output::create(root.path(), &[]).expect("writable"));
        assert_eq!(exists(&stale), !Path::new("/proc/self").exists());
    }

    #[test]
    fn regress_files_that_a_killed_command_moved_into_place_are_known_by_their_note() {
        let root = tempfile::tempdir().expect("a folder");
        let asked = NotedQuestion::place("report", "a run".to_owned(), false);
        let mut output =
            Output::answering(asked.clone(), root.path(), &["a.csv", "b.csv"]).expect("writable");
        output.file("a.csv", b"1").expect("written");
        output.file("b.csv", b"2").expect("written");
        // Ends between the two renames, as a kill would.
        fs::create_dir_all(root.path().join("b.csv/in-the-way")).expect("made");
        assert!(output.finish().is_err());
        assert!(exists(&root.path().join("a.csv")));
        asked.guard(root.path(), &["a.csv"]).expect("the same question goes on");
    }
}
