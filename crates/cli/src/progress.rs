//! A progress bar on a terminal; nothing in a pipe.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar for this many trials, on standard error.
pub fn bar(trials: u64) -> ProgressBar {
    let bar = ProgressBar::new(trials);
    let template = "{bar:30} {human_pos}/{human_len} trials, {per_sec}, {eta} left, {msg}";
    bar.set_style(ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}
