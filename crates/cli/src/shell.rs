//! Facilities that commands share: terminal, folders of results, command lines, formatting of values.

pub mod asked;
pub mod command_line;
pub mod host;
pub mod interrupt;
pub mod output;
pub mod progress;
pub mod setup;
pub mod table;
pub mod terminal;
pub mod values;
pub mod wrap;

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::Error;

/// Locks a mutex, even if a thread panicked while it held the lock.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes a pool of this many worker threads. None stands for the number of processors.
pub fn workers(threads: Option<usize>) -> Result<rayon::ThreadPool, Error> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build();
    pool.map_err(|error| Error::Threads(format!("no worker threads: {error}")))
}

/// Exit code if the answer is neither yes nor no. Either the number of trials did not suffice to show a requirement, or the question needs
/// starts with an answer and there were none.
pub const NOT_SHOWN: u8 = 3;

/// The text that a command prints, with its exit code.
#[derive(Debug)]
pub struct Report {
    /// Text for standard output.
    pub text: String,
    /// Exit code. 0 means success. 1 means that the answer is no, or that a trial could not be simulated. 3 means that the answer is
    /// neither yes nor no. 130 means an interruption.
    pub code: u8,
}
