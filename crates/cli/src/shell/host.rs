//! A program that carries out commands itself, in a thread of its own, instead of starting `standstill`.
//!
//! Commands learn of it by the thread in which they run: there they put no handler of interrupts in place, take the text
//! of their scenario from it, and leave the tables of their results with it.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use indicatif::{ProgressBar, ProgressDrawTarget};
use standstill_table::Columns;

thread_local! {
    static CURRENT: RefCell<Option<Arc<Host>>> = const { RefCell::new(None) };
}

/// Who carries out one command.
///
/// ```
/// use std::{path::PathBuf, sync::Arc};
/// use standstill_cli::Host;
///
/// let text = "trials = 20\n[detector]\nmethod = \"bipolar\"\n".to_owned();
/// let mut host = Host::default();
/// host.scenario = Some((PathBuf::from("mine"), text));
/// let host = Arc::new(host);
/// let folder = tempfile::tempdir().expect("a folder");
/// let report = host.command(["run", "mine", "--json", "--out"].map(Into::into).into_iter().chain([folder.path().into()]))?;
/// let tables = host.tables();
/// assert_eq!((report.code, tables[0].1.rows()), (0, 20));
///
/// let host = Arc::new(Host::default());
/// let error = host.command(["run".into(), "nowhere.toml".into()]).unwrap_err();
/// assert!(error.contains("nowhere.toml"));
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Default)]
pub struct Host {
    /// A scenario by the name that the command line has for it, in place of a file.
    pub scenario: Option<(PathBuf, String)>,
    /// Whether `run`, `sweep` and `trace` write their results into files too, and not only into [`Host::tables`]; `trace`
    /// always has its result as JSON for its report.
    pub files: bool,
    /// Whether progress is shown on a terminal.
    pub bars: bool,
    stop: Arc<AtomicBool>,
    bar: Mutex<Option<ProgressBar>>,
    tables: Mutex<Vec<(String, Columns)>>,
}

/// The host of this thread.
pub(crate) fn current() -> Option<Arc<Host>> {
    CURRENT.with_borrow(Clone::clone)
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Host {
    /// Does something as this host's.
    pub(crate) fn run<T>(self: &Arc<Self>, work: impl FnOnce() -> T) -> T {
        /// Leaves the thread to whose it was before, also if the work panics.
        struct Back(Option<Arc<Host>>);
        impl Drop for Back {
            fn drop(&mut self) {
                CURRENT.set(self.0.take());
            }
        }
        let _back = Back(CURRENT.replace(Some(Arc::clone(self))));
        work()
    }

    /// Asks the command to end; what can be kept of it is.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::SeqCst);
    }

    /// How much of how much is done, in trials or steps; none before the command knows.
    pub fn progress(&self) -> Option<(u64, u64)> {
        let bar = locked(&self.bar).clone()?;
        Some((bar.position(), bar.length()?))
    }

    /// The tables of the results by their names, which are handed over once.
    pub fn tables(&self) -> Vec<(String, Columns)> {
        std::mem::take(&mut locked(&self.tables))
    }

    pub(crate) fn flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.stop)
    }

    /// The text of the scenario of this name.
    pub(crate) fn text(&self, name: &Path) -> Option<&str> {
        self.scenario.as_ref().filter(|(own, _)| own == name).map(|(_, text)| text.as_str())
    }

    pub(crate) fn keep(&self, name: &str, table: Columns) {
        locked(&self.tables).push((name.to_owned(), table));
    }

    /// Watches a bar, and hides it unless it is to be seen.
    pub(crate) fn watch(&self, bar: &ProgressBar) {
        if !self.bars {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        *locked(&self.bar) = Some(bar.clone());
    }
}
