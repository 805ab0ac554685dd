//! A host: a program that carries out commands itself, in one of its threads, instead of starting `standstill`.
//!
//! Commands find their host by the thread in which they run. With a host they install no interrupt handler, read the
//! text of their scenario from the host, and store the tables of their results in it.

pub mod keywords;

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use indicatif::{ProgressBar, ProgressDrawTarget};
use standstill_scenario::Provider;
use standstill_table::Columns;

use crate::shell::locked;

thread_local! {
    static CURRENT: RefCell<Option<Arc<Host>>> = const { RefCell::new(None) };
}

/// The host of one command.
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
    /// Name and text of the scenario. The text is used instead of a file if the command line has this name.
    pub scenario: Option<(PathBuf, String)>,
    /// Whether `run`, `sweep` and `trace` write their results into files in addition to [`Host::tables`]. The report of
    /// `trace` always contains its result as JSON.
    pub files: bool,
    /// Whether progress is shown on a terminal.
    pub bars: bool,
    /// Detector that replaces the methods of all scenarios. The text names its class, as recorded with a run (`module.Class@digest`). The
    /// function makes objects of the class.
    pub detector: Option<(String, Arc<dyn Provider>)>,
    stop: Arc<AtomicBool>,
    bar: Mutex<Option<ProgressBar>>,
    tables: Mutex<Vec<(String, Columns)>>,
}

/// Returns the host of this thread, if there is one.
pub(crate) fn current() -> Option<Arc<Host>> {
    CURRENT.with_borrow(Clone::clone)
}

impl Host {
    /// Runs a closure with this host as the thread's host.
    pub(crate) fn run<T>(self: &Arc<Self>, work: impl FnOnce() -> T) -> T {
        /// Restores the thread's previous host, even if the work panics.
        struct Back(Option<Arc<Host>>);
        impl Drop for Back {
            fn drop(&mut self) {
                CURRENT.set(self.0.take());
            }
        }
        let _back = Back(CURRENT.replace(Some(Arc::clone(self))));
        work()
    }

    /// Asks the command to end early. The command keeps its results so far if possible.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::SeqCst);
    }

    /// Returns the finished and the total number of trials or steps. Returns none until the command knows these numbers.
    pub fn progress(&self) -> Option<(u64, u64)> {
        let bar = locked(&self.bar).clone()?;
        Some((bar.position(), bar.length()?))
    }

    /// Takes the tables of the results with their names. A second call returns an empty list.
    pub fn tables(&self) -> Vec<(String, Columns)> {
        std::mem::take(&mut locked(&self.tables))
    }

    pub(crate) fn flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.stop)
    }

    /// Returns the text of the scenario of this name.
    pub(crate) fn text(&self, name: &Path) -> Option<&str> {
        self.scenario.as_ref().filter(|(own, _)| own == name).map(|(_, text)| text.as_str())
    }

    pub(crate) fn keep(&self, name: &str, table: Columns) {
        locked(&self.tables).push((name.to_owned(), table));
    }

    /// Stores a progress bar for [`Host::progress`]. Hides the bar if progress is not shown on a terminal.
    pub(crate) fn watch(&self, bar: &ProgressBar) {
        if !self.bars {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        *locked(&self.bar) = Some(bar.clone());
    }
}
