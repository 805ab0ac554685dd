//! A progress bar on a terminal; nothing in a pipe.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use standstill_analysis::Watch;
use standstill_campaign::store::Notes;

use crate::{host, interrupt};

/// A bar for this many trials, on standard error.
pub fn bar(trials: u64) -> ProgressBar {
    let bar = new(trials);
    let template = "{bar:16} {pos}/{len} trials, {rate}/s, {eta} left, {msg}";
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let rate = |state: &ProgressState, to: &mut dyn std::fmt::Write| {
        // A bar that cannot be written is no reason to stop.
        let _ = write!(to, "{:.0}", state.per_sec());
    };
    bar.set_style(style.with_key("rate", rate));
    bar
}

/// A bar of this length, which a host watches.
fn new(length: u64) -> ProgressBar {
    let bar = ProgressBar::new(length);
    if let Some(host) = host::current() {
        host.watch(&bar);
    }
    bar
}

/// Trials of an analysis: shown on a bar, and ended by a flag.
pub struct Watched {
    pub bar: ProgressBar,
    stop: Arc<AtomicBool>,
    /// What is kept of a question, should it be interrupted.
    notes: Option<Mutex<Notes>>,
}

impl Watched {
    /// A bar for about this many trials, and an interrupt's flag.
    pub fn new(trials: u64) -> Self {
        Self { bar: bar(trials), stop: interrupt::flag(), notes: None }
    }

    /// The same, with notes.
    pub fn noting(trials: u64, notes: Option<Notes>) -> Self {
        Self { notes: notes.map(Mutex::new), ..Self::new(trials) }
    }

    /// Whether an interrupted question can go on from its notes.
    pub fn has_notes(&self) -> bool {
        self.notes.as_ref().is_some_and(|notes| locked(notes).is_begun())
    }
}

impl Watch for Watched {
    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn did(&self, trials: u64) {
        self.bar.inc(trials);
        // An estimate is no promise.
        if self.bar.length().is_some_and(|length| self.bar.position() > length) {
            self.bar.set_length(self.bar.position());
        }
    }

    fn recall(&self, key: &str) -> Option<Vec<u8>> {
        locked(self.notes.as_ref()?).get(key).map(<[u8]>::to_vec)
    }

    fn keep(&self, key: &str, bytes: &[u8]) {
        // What cannot be noted costs the time to compute it again, not the answer.
        let _ = self.notes.as_ref().map(|notes| locked(notes).add(key, bytes));
    }
}

fn locked(notes: &Mutex<Notes>) -> MutexGuard<'_, Notes> {
    notes.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A bar for this many rows that are written, at most.
pub fn writing(rows: u64) -> ProgressBar {
    let bar = new(rows);
    let style = ProgressStyle::with_template("{bar:16} {pos}/{len} rows written, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// A bar for this many rows that are read.
pub fn reading(rows: u64) -> ProgressBar {
    let bar = new(rows);
    let style = ProgressStyle::with_template("{bar:16} {pos}/{len} rows read, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// A bar for this many steps of unequal length, on standard error.
pub fn steps(count: u64) -> ProgressBar {
    let bar = new(count);
    let style = ProgressStyle::with_template("{bar:16} {pos}/{len} {msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// For work whose length nobody knows.
pub fn spinner(what: &'static str) -> ProgressBar {
    let spinner = ProgressBar::new_spinner();
    let style = ProgressStyle::with_template("{spinner} {msg}: step {pos}");
    spinner.set_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
    if let Some(host) = host::current() {
        host.watch(&spinner);
    }
    spinner.with_message(what)
}
