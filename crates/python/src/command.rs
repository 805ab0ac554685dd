//! Commands, carried out beside the interpreter.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use standstill_cli::{Host, Report};

use crate::Error;
use crate::detector::{Class, Maker};
use crate::given::Takes;
use crate::table::Table;

/// How often Python may raise what a signal asks for, and how often progress is reported.
const LOOK: Duration = Duration::from_millis(50);

/// How long an interrupted command has to end by itself, which it does after the block of trials at hand.
const GRACE: Duration = Duration::from_millis(600);

/// Stack of the thread, as large as a program's own.
const STACK: usize = 8 << 20;

/// Carries out a command line without the program's name. `scenario` is a name in it and the text that stands for it.
/// `detector`: what makes the detectors of all trials, its name in the record of the run, and which arguments it takes.
/// `progress`: `None` for a bar on a terminal, `False` for none, or what is called with how much of how much is done.
#[pyfunction]
#[pyo3(signature = (words, scenario=None, files=false, progress=None, detector=None))]
pub fn command(
    py: Python<'_>,
    words: Vec<OsString>,
    scenario: Option<(PathBuf, String)>,
    files: bool,
    progress: Option<Py<PyAny>>,
    detector: Option<(Py<PyAny>, String, Vec<String>)>,
) -> PyResult<(u8, String, Vec<(String, Table)>)> {
    let mut host = Host::default();
    (host.scenario, host.files, host.bars) = (scenario, files, progress.is_none());
    let mut class = None;
    if let Some((make, name, takes)) = detector {
        let own = Arc::new(Class::new(py, make, Takes(takes))?);
        class = Some(Arc::clone(&own));
        host.detector = Some((name, Arc::new(Maker(own))));
    }
    let host = Arc::new(host);
    let own = Arc::clone(&host);
    let report = beside(py, &host, progress, move || own.command(words))?;
    if let Some(raised) = class.and_then(|class| class.raised(py)) {
        return Err(raised);
    }
    let Report { text, code } = report.map_err(Error::new_err)?;
    let tables = host.tables().into_iter().map(|(name, columns)| (name, Table::new(columns)));
    Ok((code, text, tables.collect()))
}

/// Does something in a thread of its own, and meanwhile what Python wants: signals, and calls of `progress`.
fn beside<T: Send + 'static>(
    py: Python<'_>,
    host: &Arc<Host>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let progress = progress.filter(|progress| progress.bind(py).is_callable());
    let (to, from) = mpsc::channel();
    let thread = std::thread::Builder::new().name("standstill".to_owned()).stack_size(STACK);
    let thread = thread.spawn(move || {
        // Whoever waited may have been interrupted.
        let _ = to.send(work());
    })?;
    // Shared with the calls without the interpreter, of which there is one at a time.
    let from = Mutex::new(from);
    let wait = |most| from.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(most);
    let mut reported: Option<(u64, u64)> = None;
    loop {
        match py.detach(|| wait(LOOK)) {
            Ok(done) => return Ok(done),
            Err(RecvTimeoutError::Disconnected) => {
                let panic = thread.join().err();
                let text = panic.as_ref().and_then(|panic| {
                    panic
                        .downcast_ref::<String>()
                        .cloned()
                        .or_else(|| panic.downcast_ref::<&str>().map(ToString::to_string))
                });
                return Err(Error::new_err(format!("a defect of the program: {}", text.unwrap_or_default())));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        let heard = py.check_signals().and_then(|()| {
            // Threads tell the bar how far they are in no order.
            let further = |now: &(u64, u64)| reported.is_none_or(|(done, of)| now.1 != of || now.0 > done);
            let now = host.progress().filter(further);
            if let (Some(progress), Some(now)) = (&progress, now) {
                reported = Some(now);
                progress.call1(py, now)?;
            }
            Ok(())
        });
        if let Err(error) = heard {
            host.stop();
            let begun = Instant::now();
            // What takes longer goes on by itself until it looks at the flag; nobody waits for it.
            py.detach(|| wait(GRACE.saturating_sub(begun.elapsed()))).ok();
            return Err(error);
        }
    }
}
