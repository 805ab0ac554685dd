//! Progress: a bar on a terminal; elsewhere a line every ten seconds, so that logs show that work continues.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use console::Term;
use indicatif::{ProgressBar, ProgressFinish, ProgressState, ProgressStyle, WeakProgressBar};
use standstill_analysis::Watch;
use standstill_campaign::store::Notes;
use standstill_scenario::{Document, FileError, Plan};

use crate::shell::terminal::tell;
use crate::shell::{host, interrupt, locked};

/// Time between two progress messages without a terminal.
const EVERY: Duration = Duration::from_secs(10);

/// Makes a progress bar for this many trials on standard error. 0 stands for an unknown number.
pub fn bar(trials: u64) -> ProgressBar {
    let rate = |state: &ProgressState, to: &mut dyn std::fmt::Write| {
        // The bar is decoration: a failure to write it is ignored.
        let _ = write!(to, "{:.0}", state.per_sec());
    };
    let (bar, template) = if trials == 0 {
        (watched(ProgressBar::no_length(), " trials"), "{spinner} {pos} trials, {rate}/s, {msg}")
    } else {
        (new(trials, " trials"), "{bar:16} {pos}/{len} trials, {rate}/s, {eta} left, {msg}")
    };
    bar.set_style(style(template).with_key("rate", rate));
    bar
}

/// Makes the plan of a document. Shows a bar while its points are checked, if they take more than a moment.
pub fn plan(document: Document) -> Result<Plan, FileError> {
    let mut bar: Option<ProgressBar> = None;
    Plan::watched(document, None, &mut |checked, all| {
        if all >= MANY_POINTS {
            let bar = bar.get_or_insert_with(|| {
                let bar = new(all as u64, " points checked");
                bar.set_style(style("{bar:16} {pos}/{len} points checked, {eta} left"));
                bar
            });
            bar.set_position(checked as u64);
        }
        Ok(())
    })
}

/// Least number of points of a plan that has a bar: their check takes about a second, with a flux map that an axis changes minutes.
const MANY_POINTS: usize = 500;

/// Makes a style from its template.
fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// Makes a progress bar of this length.
fn new(length: u64, what: &'static str) -> ProgressBar {
    watched(ProgressBar::new(length), what)
}

/// Registers a progress bar with the host program. Without a host program and a terminal, prints the bar's state as lines. On a terminal,
/// the bar disappears when the work ends, even after an interrupt or an error.
fn watched(bar: ProgressBar, what: &'static str) -> ProgressBar {
    let bar = bar.with_finish(ProgressFinish::AndClear);
    if let Some(host) = host::current() {
        host.watch(&bar);
    } else if !Term::stderr().is_term() {
        report(&bar, EVERY, move |bar| tell(&line(bar, what)));
    }
    bar
}

/// Prints a bar's progress at this interval until the bar ends.
fn report(bar: &ProgressBar, every: Duration, say: impl Fn(&ProgressBar) + Send + 'static) {
    let bar: WeakProgressBar = bar.downgrade();
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(every);
            match bar.upgrade() {
                Some(bar) if !bar.is_finished() => say(&bar),
                _ => return,
            }
        }
    });
}

/// Formats a bar's progress in a line.
fn line(bar: &ProgressBar, what: &str) -> String {
    let (done, message) = (bar.position(), bar.message());
    let mut line = match bar.length().filter(|length| *length > 0) {
        Some(length) => format!("{done} of {length}{what} ({:.0} %)", 100.0 * done as f64 / length as f64),
        None if done == 1 => format!("1{}", what.strip_suffix('s').unwrap_or(what)),
        None => format!("{done}{what}"),
    };
    let _ = write!(line, " after {} s", bar.elapsed().as_secs());
    if let (left @ 1.., Some(_)) = (bar.eta().as_secs(), bar.length()) {
        let _ = write!(line, ", about {left} s left");
    }
    if message.is_empty() { line } else { line + ", " + &message }
}

/// Observer of an analysis. It shows the progress of the trials on a bar, and can end the analysis by a flag.
pub struct Watched {
    pub bar: ProgressBar,
    stop: Arc<AtomicBool>,
    /// Intermediate results of a question, from which `--resume` continues.
    notes: Option<Mutex<Notes>>,
    /// True after the message was printed that an intermediate result could not be stored.
    said: AtomicBool,
}

impl Watched {
    /// Makes an observer with an interrupt flag and a bar for about this many trials. 0 stands for an unknown number.
    pub fn new(trials: u64) -> Self {
        Self { bar: bar(trials), stop: interrupt::flag(), notes: None, said: AtomicBool::new(false) }
    }

    /// Makes an observer like [`Watched::new`] that also stores intermediate results in `notes`.
    pub fn noting(trials: u64, notes: Option<Notes>) -> Self {
        Self { notes: notes.map(Mutex::new), ..Self::new(trials) }
    }

    /// Returns the flag that an interrupt sets.
    pub fn flag(&self) -> &AtomicBool {
        &self.stop
    }

    /// Returns true if an interrupted question can continue from stored intermediate results.
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
        // The number of trials was an estimate: a longer run extends the bar.
        if self.bar.length().is_some_and(|length| self.bar.position() > length) {
            self.bar.set_length(self.bar.position());
        }
    }

    fn recall(&self, key: &str) -> Option<Vec<u8>> {
        locked(self.notes.as_ref()?).get(key).map(<[u8]>::to_vec)
    }

    fn keep(&self, key: &str, bytes: &[u8]) {
        // An intermediate result that cannot be stored would have to be computed again after an interrupt; the answer
        // is the same.
        if let Some(Err(error)) = self.notes.as_ref().map(|notes| locked(notes).add(key, bytes))
            && !self.said.swap(true, Ordering::Relaxed)
        {
            tell(&format!("not kept for --resume: {error}; the answer is computed all the same"));
        }
    }
}

/// Makes a bar for at most this many rows to be written.
pub fn writing(rows: u64) -> ProgressBar {
    of_rows(rows, " rows written", "{bar:16} {pos}/{len} rows written, {eta} left")
}

/// Makes a bar for this many rows to be read.
pub fn reading(rows: u64) -> ProgressBar {
    of_rows(rows, " rows read", "{bar:16} {pos}/{len} rows read, {eta} left")
}

fn of_rows(rows: u64, what: &'static str, template: &str) -> ProgressBar {
    new(rows, what).with_style(style(template))
}

/// Makes a spinner for work that reports its present step.
pub fn working(what: &'static str) -> ProgressBar {
    spinning(" groups", "{spinner} {msg}, {elapsed}").with_message(what)
}

/// Makes a spinner for work of unknown length.
pub fn spinner(what: &'static str) -> ProgressBar {
    spinning(" steps", "{spinner} {msg}: step {pos}").with_message(what)
}

fn spinning(what: &'static str, template: &str) -> ProgressBar {
    watched(ProgressBar::new_spinner(), what).with_style(style(template))
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::sync::mpsc;

    use indicatif::{ProgressDrawTarget, TermLike};

    use super::*;

    /// A terminal of one line, and what stands in it.
    #[derive(Clone, Debug, Default)]
    struct Line(Arc<Mutex<String>>);

    impl Line {
        fn text(&self) -> String {
            self.0.lock().expect("not poisoned").trim().to_owned()
        }
    }

    impl TermLike for Line {
        fn width(&self) -> u16 {
            80
        }

        fn move_cursor_up(&self, _: usize) -> io::Result<()> {
            Ok(())
        }

        fn move_cursor_down(&self, _: usize) -> io::Result<()> {
            Ok(())
        }

        fn move_cursor_right(&self, _: usize) -> io::Result<()> {
            Ok(())
        }

        fn move_cursor_left(&self, _: usize) -> io::Result<()> {
            Ok(())
        }

        fn write_line(&self, text: &str) -> io::Result<()> {
            self.write_str(text)
        }

        fn write_str(&self, text: &str) -> io::Result<()> {
            self.0.lock().expect("not poisoned").push_str(text);
            Ok(())
        }

        fn clear_line(&self) -> io::Result<()> {
            self.0.lock().expect("not poisoned").clear();
            Ok(())
        }

        fn flush(&self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn regress_a_bar_whose_work_was_interrupted_leaves_nothing() {
        let terminal = Line::default();
        let bar = bar(200);
        bar.set_draw_target(ProgressDrawTarget::term_like(Box::new(terminal.clone())));
        bar.set_position(50);
        bar.tick();
        assert!(terminal.text().contains("50/200 trials"), "{}", terminal.text());
        drop(bar);
        assert_eq!(terminal.text(), "");
    }

    #[test]
    fn regress_work_of_unknown_length_has_no_share_and_no_time_left() {
        let watched = Watched::new(0);
        watched.did(17_000);
        watched.bar.set_message("noise at 3 mA");
        assert_eq!(line(&watched.bar, " trials"), "17000 trials after 0 s, noise at 3 mA");
    }

    #[test]
    fn law_lines_come_while_a_bar_lives_and_end_with_it() {
        let bar = ProgressBar::hidden();
        bar.set_length(200);
        bar.set_position(50);
        bar.set_message("rms 0.040°");
        let (said, heard) = mpsc::channel();
        report(&bar, Duration::from_millis(5), move |bar| said.send(line(bar, " trials")).expect("heard"));
        let first = heard.recv().expect("a line");
        assert!(first.starts_with("50 of 200 trials (25 %) after 0 s"), "{first}");
        assert!(first.ends_with(", rms 0.040°"), "{first}");
        bar.set_position(100);
        assert!(heard.iter().any(|line| line.starts_with("100 of 200 trials (50 %)")));
        bar.finish_and_clear();
        // The reporter goes, and with it its end of the channel.
        while heard.recv().is_ok() {}
    }
}
