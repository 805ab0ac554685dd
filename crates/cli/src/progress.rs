//! A progress bar on a terminal; nothing in a pipe.

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

/// A bar for this many trials, on standard error.
pub fn bar(trials: u64) -> ProgressBar {
    let bar = ProgressBar::new(trials);
    let template = "{bar:16} {pos}/{len} trials, {rate}/s, {eta} left, {msg}";
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let rate = |state: &ProgressState, to: &mut dyn std::fmt::Write| {
        // A bar that cannot be written is no reason to stop.
        let _ = write!(to, "{:.0}", state.per_sec());
    };
    bar.set_style(style.with_key("rate", rate));
    bar
}

/// A bar for this many rows that are written, at most.
pub fn writing(rows: u64) -> ProgressBar {
    let bar = ProgressBar::new(rows);
    let style = ProgressStyle::with_template("{bar:16} {pos}/{len} rows written, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// A bar for this many rows that are read.
pub fn reading(rows: u64) -> ProgressBar {
    let bar = ProgressBar::new(rows);
    let style = ProgressStyle::with_template("{bar:16} {pos}/{len} rows read, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// A bar for this many steps of unequal length, on standard error.
pub fn steps(count: u64) -> ProgressBar {
    let bar = ProgressBar::new(count);
    let style = ProgressStyle::with_template("{bar:16} {pos}/{len} {msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}
