//! `--isolate`: trials of a detector library in separate processes (*workers*), each with simulator and library.
//!
//! ```text
//!   a thread of the run ── scenario, once ──► standstill worker       point and trial, a line each
//!                       ── "2 815" ─────────►  simulator + library
//!                       ◄── record, a line ──
//! ```
//! If a worker ends before its answer, its trial is lost, and a new process runs the next trial. Before the first trial a worker describes
//! the library and makes a detector at each point. A crash there is reported like any other mistake of the scenario. The process of the run
//! itself never loads the library.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::json;
use standstill_files::{MOST_BYTES, read_at_most};
use standstill_foreign::{Description, Library, LoadError, load_elsewhere};
use standstill_scenario::{Document, FileError, Lost, Plan, Record, Remote};

use crate::error::Error;
use crate::shell::command_line::one_line;
use crate::shell::{Report, host, locked, progress};

/// Mark at the beginning of a line that a worker writes, to distinguish the line from the library's output.
const MARK: &str = "\u{1}standstill ";

/// A pool of processes that run trials.
#[derive(Debug)]
pub struct Workers {
    /// First line of each worker's input: the path of the scenario's file, and its text with all changes.
    scenario: String,
    /// Digests of all files that the run reads, by path. A worker that reads a file with another digest is refused.
    files: BTreeMap<String, String>,
    free: Mutex<Vec<Worker>>,
}

/// A process that runs trials.
#[derive(Debug)]
struct Worker {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

/// Makes the plan of a document whose trials run in separate processes.
pub fn plan(document: &Document) -> Result<Plan, Error> {
    let mut workers = Workers::of(document)?;
    let limit = document.load()?.detector.call_limit()?;
    load_elsewhere(move |path| inspected(path, limit));
    let plan = progress::plan(document.clone())?;
    workers.files = digests(&plan);
    workers.check().map_err(|error| Error::Scenario(document.locate(error)))?;
    Ok(plan.with_remote(Arc::new(workers)))
}

impl Workers {
    /// Makes the pool for the trials of a document with a library.
    fn of(document: &Document) -> Result<Self, Error> {
        let refused = |found: &str, needed: &str| {
            Err(Error::Arguments(format!("--isolate: found {found}; needed {needed}")))
        };
        if host::current().is_some() {
            return refused(
                "a program that carries out commands itself",
                "`standstill run`, which starts workers",
            );
        }
        let file = document.load()?;
        if file.detector.library.is_none() && !file.axes.contains_key("detector.library") {
            return refused(
                "a scenario without `detector.library`",
                "one: methods need no process of their own",
            );
        }
        let folder = std::path::absolute(document.files().folder()).or_else(|_| std::env::current_dir());
        let path = folder.map_err(Error::writing(Path::new("scenario")))?.join("scenario.toml");
        let scenario = line(&Request::Run { path, text: file.text()? });
        Ok(Self { scenario, files: BTreeMap::new(), free: Mutex::default() })
    }

    fn worker(&self) -> std::io::Result<Worker> {
        let free = locked(&self.free).pop();
        free.map_or_else(|| Worker::new(&self.scenario), Ok)
    }

    /// Has a worker check that a detector can be made at each sweep point. Returns the error that the worker reports.
    fn check(&self) -> Result<(), FileError> {
        let refused = |key: &str, message: String| FileError::Key {
            place: String::new(),
            key: key.to_owned(),
            message,
        };
        let of_library = |message: String| refused("detector.library", message);
        let mut worker = self.worker().map_err(|error| of_library(format!("no worker process: {error}")))?;
        match worker.answer() {
            Some(Reply::Ready(digests)) => {
                Worker::begin(&digests, &self.files).map_err(of_library)?;
                locked(&self.free).push(worker);
                Ok(())
            }
            Some(Reply::Key { key, message }) => Err(refused(&key, message)),
            Some(other) => Err(of_library(other.text())),
            None => Err(of_library(format!(
                "found one of which no detector can be made: {}, needed one whose create() returns",
                worker.ending()
            ))),
        }
    }
}

/// Starts a worker that loads the library at a path, and returns its description.
fn inspected(path: &Path, limit: Duration) -> Result<Description, LoadError> {
    let failed = |found: String| LoadError::new(found, "one that can be loaded".to_owned());
    let request = Request::Inspect { path: path.to_owned(), limit };
    let mut worker =
        Worker::new(&line(&request)).map_err(|error| failed(format!("no process that loads it: {error}")))?;
    let Some(answer) = worker.answer() else {
        return Err(failed(format!("a library that cannot be loaded: {}", worker.ending())));
    };
    // The worker ends when its input is closed.
    let _ = worker.ending();
    match answer {
        Reply::Described(described) => described,
        other => Err(failed(other.text())),
    }
}

/// Loads the library at a path in this process, which is a worker, and describes it.
fn described(path: &Path) -> Result<Description, LoadError> {
    let bytes = read_at_most(path, MOST_BYTES).map_err(|error| {
        LoadError::new(format!("a file that cannot be read: {error}"), "a shared library".to_owned())
    })?;
    let further = |path: &Path| read_at_most(path, MOST_BYTES).map(Into::into);
    Ok(Library::of(path, &bytes.into(), &further)?.description.clone())
}

/// Request to a worker: the first line of its input.
#[derive(Serialize, Deserialize)]
enum Request {
    /// Describe the library at a path. `limit` is the longest allowed time of a call.
    Inspect { path: PathBuf, limit: Duration },
    /// Run trials of a scenario: the path of its file, and its text with all changes.
    Run { path: PathBuf, text: String },
}

/// Reply of a worker.
#[derive(Debug, Serialize, Deserialize)]
enum Reply {
    /// The scenario is loaded, and a detector could be made. The reply contains the digests of the files that the worker reads, by path.
    Ready(BTreeMap<String, String>),
    /// Description of the library, or the reason why the file cannot be the detector.
    Described(Result<Description, LoadError>),
    /// The scenario has a wrong key.
    Key { key: String, message: String },
    /// The scenario or a trial of it cannot be run.
    Error(String),
    /// The record of a trial.
    Record(String),
}

impl Reply {
    /// Returns the text of an error reply. Any other reply is unexpected and is converted to an error text.
    fn text(self) -> String {
        if let Self::Error(text) = self { text } else { format!("an answer out of turn: {self:?}") }
    }
}

/// Formats a message as a line of JSON.
fn line(message: &impl Serialize) -> String {
    json!(message).to_string()
}

impl Worker {
    /// Starts a worker. `first` is the first line of the worker's input.
    fn new(first: &str) -> std::io::Result<Self> {
        let mut child = Command::new(std::env::current_exe()?)
            .arg("worker")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let (Some(mut input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(std::io::Error::other("a process without pipes"));
        };
        // If the worker has ended already, writing fails, and `answer` returns none later.
        let _ = writeln!(input, "{first}");
        Ok(Self { child, input, output: BufReader::new(output) })
    }

    /// Reads the worker's next reply. Returns none if the process ends first.
    fn answer(&mut self) -> Option<Reply> {
        let mut line = Vec::new();
        loop {
            line.clear();
            if self.output.read_until(b'\n', &mut line).ok()? == 0 {
                return None;
            }
            // Output of the library may precede the mark on its line.
            let text = String::from_utf8_lossy(&line);
            let answer = text.split_once(MARK).and_then(|(_, answer)| serde_json::from_str(answer).ok());
            if answer.is_some() {
                return answer;
            }
        }
    }

    /// Checks that the worker reads the same files as the run.
    fn begin(own: &BTreeMap<String, String>, files: &BTreeMap<String, String>) -> Result<(), String> {
        let other = files.iter().chain(own).find(|(path, _)| files.get(*path) != own.get(*path));
        if let Some((path, _)) = other {
            return Err(format!("the file {path} is another than when the run began"));
        }
        Ok(())
    }

    /// Requests a trial from the worker and returns the reply. Returns none if the process ends first.
    fn ask(
        &mut self,
        files: &BTreeMap<String, String>,
        point: usize,
        trial: u64,
    ) -> Option<Result<Record, Lost>> {
        // If the worker has ended already, writing fails, and `answer` returns none.
        let _ = writeln!(self.input, "{point} {trial}");
        loop {
            return Some(match self.answer()? {
                Reply::Ready(digests) => match Self::begin(&digests, files) {
                    Ok(()) => continue,
                    Err(other) => Err(Lost::All(other)),
                },
                Reply::Record(text) => Record::from_line(&text)
                    .ok_or_else(|| Lost::All(format!("a record that is none: {text}"))),
                other => Err(Lost::All(other.text())),
            });
        }
    }

    /// Waits for the process to end, and returns the reason of its end.
    fn ending(self) -> String {
        let Self { mut child, input, .. } = self;
        drop(input);
        child.wait().map_or_else(|error| error.to_string(), ending)
    }
}

/// Returns the reason of a process's end.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn ending(status: std::process::ExitStatus) -> String {
    use std::os::unix::process::ExitStatusExt as _;
    standstill_foreign::ending(status.code(), status.signal())
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn ending(status: std::process::ExitStatus) -> String {
    status.to_string()
}

impl Remote for Workers {
    fn trial(&self, point: usize, trial: u64) -> Result<Record, Lost> {
        let mut worker = self.worker().map_err(|error| Lost::All(format!("no worker process: {error}")))?;
        if let Some(answer) = worker.ask(&self.files, point, trial) {
            locked(&self.free).push(worker);
            return answer;
        }
        Err(Lost::Trial(worker.ending()))
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        for worker in std::mem::take(self.free.get_mut().unwrap_or_else(PoisonError::into_inner)) {
            // A worker ends when its input is closed.
            let _ = worker.ending();
        }
    }
}

/// Runs the worker process.
pub fn worker() -> Result<Report, Error> {
    // The parent process handles interruptions. A worker ends when its input is closed.
    let _ = ctrlc::set_handler(|| ());
    let failed = |error: std::io::Error| Error::Read("standard input".into(), error);
    let mut lines = std::io::stdin().lines();
    let first = lines.next().transpose().map_err(failed)?.unwrap_or_default();
    let first = serde_json::from_str(&first).map_err(|error| Error::Arguments(format!("worker: {error}")))?;
    let done = || Ok(Report { text: String::new(), code: 0 });
    let plan = match first {
        Request::Inspect { path, limit } => {
            isolate(limit);
            let _ = say(&Reply::Described(described(&path)));
            // The parent closes the input after it has read the reply.
            while lines.next().is_some() {}
            return done();
        }
        Request::Run { path, text } => plan_of(&path, &text),
    };
    let said = match &plan {
        Ok(plan) => say(&Reply::Ready(digests(plan))),
        Err(Error::Scenario(FileError::Key { key, message, .. })) => {
            say(&Reply::Key { key: key.clone(), message: message.clone() })
        }
        Err(error) => say(&Reply::Error(one_line(&error.to_string()))),
    };
    if said.is_err() {
        return done();
    }
    let mut point_at_hand = None;
    for line in lines {
        let line = line.map_err(failed)?;
        let answer = (|| {
            let plan = plan.as_ref().map_err(ToString::to_string)?;
            let numbers = line.split_once(' ').and_then(|(p, t)| Some((p.parse().ok()?, t.parse().ok()?)));
            let (point, trial): (usize, u64) = numbers.ok_or("no point and trial")?;
            if point_at_hand.as_ref().is_none_or(|(known, _)| *known != point) {
                let scenario = plan.scenario(point).map_err(|error| error.to_string())?;
                point_at_hand = Some((point, scenario));
            }
            let (_, scenario) = point_at_hand.as_ref().ok_or("no point")?;
            plan.trial(point, scenario, trial).map_err(|error| error.to_string())
        })();
        let answer = match answer {
            Ok(record) => Reply::Record(record.to_line()),
            Err(error) => Reply::Error(one_line(&error)),
        };
        if say(&answer).is_err() {
            break;
        }
    }
    done()
}

/// Writes a reply to the parent process.
fn say(answer: &Reply) -> std::io::Result<()> {
    crate::shell::terminal::write(&format!("{MARK}{}\n", line(answer)))
}

/// Returns the digests of all files that a plan reads, by their paths.
fn digests(plan: &Plan) -> BTreeMap<String, String> {
    plan.files().into_iter().map(|(path, digest)| (path, digest.to_string())).collect()
}

/// Makes this process end if a call of the library crashes or takes longer than `limit`.
fn isolate(limit: Duration) {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    standstill_foreign::isolate(limit);
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    let _ = limit;
}

fn plan_of(path: &Path, text: &str) -> Result<Plan, Error> {
    let document = Document::parse(path, text)?;
    isolate(document.load()?.detector.call_limit()?);
    Ok(Plan::new(document)?)
}
