//! One function for each reader of bytes that come from elsewhere: files, requests, commands of a library, calls of an
//! importer. Each function takes any bytes, gives them to the reader by its public door, and panics where a law of all
//! readers does not hold:
//!
//! * the reader ends with a value or an error, never with a panic;
//! * the text of an error is not empty and names the file (control characters in it, which are the file's, become visible where
//!   the command line prints it);
//! * every number of a value is finite;
//! * a value that is written and read again is equal.
//!
//! The limits of time and memory are those of the callers: the test `bounded`, which runs in `cargo test`, and
//! libFuzzer, by `scripts/fuzz.sh`.

mod calls;
mod commands;
mod journals;
mod lab;
mod maps;
mod tables;
mod texts;

use std::cell::OnceCell;
use std::fmt;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// A reader.
#[derive(Clone, Copy)]
pub struct Target {
    /// Name of the reader, which is also the folder of its inputs in `corpus/`.
    pub name: &'static str,
    /// The function that takes any bytes; it panics where the reader breaks a law.
    pub run: fn(&[u8]),
}

/// Bytes as fields, one after the other; zeros behind the last of them.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn next<const N: usize>(&mut self) -> [u8; N] {
        let mut field = [0; N];
        let count = N.min(self.0.len());
        field[..count].copy_from_slice(&self.0[..count]);
        self.0 = &self.0[count..];
        field
    }

    fn byte(&mut self) -> u8 {
        u8::from_le_bytes(self.next())
    }

    fn word(&mut self) -> u32 {
        u32::from_le_bytes(self.next())
    }

    fn long(&mut self) -> u64 {
        u64::from_le_bytes(self.next())
    }

    fn float(&mut self) -> f32 {
        f32::from_le_bytes(self.next())
    }
}

/// Returns the list of targets, each with the name of its function.
macro_rules! targets {
    ($($module:ident::$name:ident),* $(,)?) => {
        &[$(Target { name: stringify!($name), run: $module::$name }),*]
    };
}

/// All readers.
pub const TARGETS: &[Target] = targets![
    texts::units,
    texts::scenario,
    texts::sheet,
    texts::requirements,
    texts::record,
    maps::csv,
    maps::npz,
    maps::mat,
    tables::table_csv,
    tables::parquet,
    journals::journal,
    journals::tally,
    journals::notes,
    commands::command,
    commands::readings,
    commands::library,
    lab::question,
    lab::http,
    calls::fmu_resources,
    calls::fmu_calls,
    calls::fmu_state,
];

/// Returns the target of this name.
pub fn target(name: &str) -> Option<Target> {
    TARGETS.iter().copied().find(|target| target.name == name)
}

thread_local! {
    static FOLDER: OnceCell<TempDir> = const { OnceCell::new() };
}

/// Returns the path of a file of this name with these bytes, in a folder of the thread's own, in memory if there is one.
fn file(name: &str, bytes: &[u8]) -> PathBuf {
    FOLDER.with(|folder| {
        let memory = Path::new("/dev/shm");
        let made = || if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
        let path = folder.get_or_init(|| made().expect("a folder")).path().join(name);
        std::fs::write(&path, bytes).expect("a file");
        path
    })
}

/// Checks the text of an error, which must name the file `of`.
fn refused(error: impl fmt::Display, of: &str) {
    let text = error.to_string();
    assert!(text.len() > of.len() && text.contains(of), "an error that does not name {of}: {text:?}");
}

/// Returns the bytes as text, as readers take it that get text from a reader of files; none for bytes that are not UTF-8.
fn text(bytes: &[u8]) -> Option<&str> {
    std::str::from_utf8(bytes).ok()
}
