//! `--isolate`: trials of a library in processes of their own, each with simulator and library.
//!
//! ```text
//!   a thread of the run ── scenario, once ──► standstill worker       point and trial, a line each
//!                       ── "2 815" ─────────►  simulator + library
//!                       ◄── record, a line ──
//! ```
//! A worker that ends before its answer has lost its trial: a new process runs the next one. Before the first trial a
//! worker describes the library and makes a detector at each point: a crash there is reported as any other mistake
//! is. The process of the run itself never loads the library.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use serde_json::{Value, json};
use standstill_files::{MOST_BYTES, read_at_most};
use standstill_foreign::{Description, Level, Library, LoadError, Timing, load_elsewhere};
use standstill_scenario::{Document, FileError, Lost, Plan, Record, Remote};

use crate::error::Error;
use crate::shell::{Report, host};

/// Mark at the begin of a worker's own lines, to distinguish them from the library's output.
const MARK: &str = "\u{1}standstill ";

/// The pool of processes that run trials.
#[derive(Debug)]
pub struct Workers {
    /// First line of input of each worker: the path of the scenario's file, and its text with all changes.
    scenario: String,
    /// Digests of all files that the run reads, by their paths: a worker that reads other files has another run.
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

/// Makes the plan of a document whose trials run in processes of their own.
pub fn plan(document: &Document) -> Result<Plan, Error> {
    let mut workers = Workers::of(document)?;
    let limit = document.load()?.detector.call_limit()?;
    load_elsewhere(move |path| inspected(path, limit));
    let plan = Plan::new(document.clone())?;
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
        let scenario = json!({ "path": path, "text": file.text()? }).to_string();
        Ok(Self { scenario, files: BTreeMap::new(), free: Mutex::default() })
    }

    fn worker(&self) -> std::io::Result<Worker> {
        let free = self.free.lock().unwrap_or_else(PoisonError::into_inner).pop();
        free.map_or_else(|| Worker::new(&self.scenario), Ok)
    }

    /// Checks with a worker that detectors can be made at all points. The error is the worker's.
    fn check(&self) -> Result<(), FileError> {
        let refused = |key: &str, message: String| FileError::Key {
            place: String::new(),
            key: key.to_owned(),
            message,
        };
        let of_library = |message: String| refused("detector.library", message);
        let mut worker = self.worker().map_err(|error| of_library(format!("no worker process: {error}")))?;
        match worker.answer() {
            Some((Answer::Ready, text)) => {
                Worker::begin(&text, &self.files).map_err(of_library)?;
                self.free.lock().unwrap_or_else(PoisonError::into_inner).push(worker);
                Ok(())
            }
            Some((_, text)) => Err(match serde_json::from_str::<[String; 2]>(&text) {
                Ok([key, message]) => refused(&key, message),
                Err(_) => of_library(text),
            }),
            None => Err(of_library(format!(
                "found one of which no detector can be made: {}, needed one whose create() returns",
                worker.ending()
            ))),
        }
    }
}

/// Returns a worker's description of the library at a path.
fn inspected(path: &Path, limit: Duration) -> Result<Description, LoadError> {
    let failed = |found: String| LoadError::new(found, "one that can be loaded".to_owned());
    let request = json!({ "inspect": path, "limit": limit.as_secs_f64() });
    let mut worker = Worker::new(&request.to_string())
        .map_err(|error| failed(format!("no process that loads it: {error}")))?;
    let Some((answer, text)) = worker.answer() else {
        return Err(failed(format!("a library that cannot be loaded: {}", worker.ending())));
    };
    // It ends at the end of its input.
    let _ = worker.ending();
    let said: Value = serde_json::from_str(&text).unwrap_or_default();
    let part = |key: &str| said[key].as_str().unwrap_or_default().to_owned();
    match (answer, level(&said["isr"])) {
        (Answer::Library, Some(level)) => Ok(Description { name: part("name"), level, loads: loads(&said) }),
        _ => Err(LoadError::new(part("found"), part("needed"))),
    }
}

/// Returns the libraries that a library has loaded itself, from the answer of [`described`].
fn loads(said: &Value) -> Vec<PathBuf> {
    said["loads"].as_array().into_iter().flatten().filter_map(Value::as_str).map(PathBuf::from).collect()
}

/// Parses a level as written by [`described`].
fn level(of: &Value) -> Option<Level> {
    #[allow(clippy::cast_possible_truncation, reason = "it was a single one")]
    match of.as_array().map(Vec::as_slice) {
        None => Some(Level::Command),
        Some([pwm, twice, at, delay]) => Some(Level::Interrupt(Timing {
            pwm_hz: u32::try_from(pwm.as_u64()?).ok()?,
            twice: twice.as_bool()?,
            sample_at: at.as_f64()? as f32,
            update_delay: u32::try_from(delay.as_u64()?).ok()?,
        })),
        Some(_) => None,
    }
}

/// Returns a worker's description of a library, as JSON.
fn described(path: &str) -> String {
    let path = PathBuf::from(path);
    let read = read_at_most(&path, MOST_BYTES).map_err(|error| {
        LoadError::new(format!("a file that cannot be read: {error}"), "a shared library".to_owned())
    });
    let further = |path: &Path| read_at_most(path, MOST_BYTES).map(Into::into);
    match read.and_then(|bytes| Library::of(&path, &bytes.into(), &further)) {
        Ok(library) => {
            let isr = match library.level() {
                Level::Command => Value::Null,
                Level::Interrupt(Timing { pwm_hz, twice, sample_at, update_delay }) => {
                    json!([pwm_hz, twice, sample_at, update_delay])
                }
            };
            let loads = &library.description().loads;
            format!("library {}", json!({ "name": library.name(), "isr": isr, "loads": loads }))
        }
        Err(LoadError { found, needed }) => {
            format!("refused {}", json!({ "found": found, "needed": needed }))
        }
    }
}

/// The kind of a worker's answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    /// The worker has its scenario, and a detector could be made.
    Ready,
    /// The worker has loaded a library.
    Library,
    /// The worker cannot do what was requested.
    Refused,
    /// No trial can be run.
    Error,
    /// A trial's record.
    Record,
}

impl Worker {
    /// Starts a process with this first line of input.
    fn new(first: &str) -> std::io::Result<Self> {
        let mut child = Command::new(std::env::current_exe()?)
            .arg("worker")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let (Some(mut input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(std::io::Error::other("a process without pipes"));
        };
        // One that has ended already has no answer either.
        let _ = writeln!(input, "{first}");
        Ok(Self { child, input, output: BufReader::new(output) })
    }

    /// Returns the worker's next answer; none if the process ends before.
    fn answer(&mut self) -> Option<(Answer, String)> {
        let mut line = Vec::new();
        loop {
            line.clear();
            if self.output.read_until(b'\n', &mut line).ok()? == 0 {
                return None;
            }
            let text = String::from_utf8_lossy(&line);
            // What a library prints may stand before it.
            let Some((_, answer)) = text.trim_end_matches('\n').split_once(MARK) else { continue };
            let (kind, text) = answer.split_once(' ').unwrap_or((answer, ""));
            let kind = match kind {
                "ready" => Answer::Ready,
                "library" => Answer::Library,
                "refused" => Answer::Refused,
                "record" => Answer::Record,
                _ => Answer::Error,
            };
            return Some((kind, text.to_owned()));
        }
    }

    /// Checks that the files read by the worker are those of the run.
    fn begin(digests: &str, files: &BTreeMap<String, String>) -> Result<(), String> {
        let own: BTreeMap<String, String> = serde_json::from_str(digests).unwrap_or_default();
        let other = files.iter().chain(&own).find(|(path, _)| files.get(*path) != own.get(*path));
        if let Some((path, _)) = other {
            return Err(format!("the file {path} is another than when the run began"));
        }
        Ok(())
    }

    /// Requests a trial; none if the process ends before it answers.
    fn ask(
        &mut self,
        files: &BTreeMap<String, String>,
        point: usize,
        trial: u64,
    ) -> Option<Result<Record, Lost>> {
        // One that ended while it began says so by its end.
        let _ = writeln!(self.input, "{point} {trial}");
        loop {
            let (answer, text) = self.answer()?;
            return Some(match answer {
                Answer::Ready => match Self::begin(&text, files) {
                    Ok(()) => continue,
                    Err(other) => Err(Lost::All(other)),
                },
                Answer::Record => Record::from_line(&text)
                    .ok_or_else(|| Lost::All(format!("a record that is none: {text}"))),
                _ => Err(Lost::All(text)),
            });
        }
    }

    /// Waits for the process to end, and returns the reason.
    fn ending(self) -> String {
        let Self { mut child, input, .. } = self;
        drop(input);
        child.wait().map_or_else(|error| error.to_string(), ending)
    }
}

/// Returns the reason of a process's end.
#[cfg(target_os = "linux")]
fn ending(status: std::process::ExitStatus) -> String {
    use std::os::unix::process::ExitStatusExt as _;
    standstill_foreign::ending(status.code(), status.signal())
}

#[cfg(not(target_os = "linux"))]
fn ending(status: std::process::ExitStatus) -> String {
    status.to_string()
}

impl Remote for Workers {
    fn trial(&self, point: usize, trial: u64) -> Result<Record, Lost> {
        let mut worker = self.worker().map_err(|error| Lost::All(format!("no worker process: {error}")))?;
        if let Some(answer) = worker.ask(&self.files, point, trial) {
            self.free.lock().unwrap_or_else(PoisonError::into_inner).push(worker);
            return answer;
        }
        Err(Lost::Trial(worker.ending()))
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        for worker in std::mem::take(self.free.get_mut().unwrap_or_else(PoisonError::into_inner)) {
            // At the end of its input a worker ends.
            let _ = worker.ending();
        }
    }
}

/// Runs the worker process.
pub fn worker() -> Result<Report, Error> {
    // An interruption is its parent's to answer: this one ends with its input.
    let _ = ctrlc::set_handler(|| ());
    let failed = |error: std::io::Error| Error::Read("standard input".into(), error);
    let mut lines = std::io::stdin().lines();
    let first = lines.next().transpose().map_err(failed)?.unwrap_or_default();
    let first: Value =
        serde_json::from_str(&first).map_err(|error| Error::Arguments(format!("worker: {error}")))?;
    if let Some(path) = first["inspect"].as_str() {
        isolate(Duration::from_secs_f64(first["limit"].as_f64().unwrap_or(1.0)));
        let _ = say(&described(path));
        // Whoever asked has read it when the input ends.
        while lines.next().is_some() {}
        return Ok(Report { text: String::new(), code: 0 });
    }
    let plan = plan_of(&first);
    let said = match &plan {
        Ok(plan) => say(&format!("ready {}", json!(digests(plan)))),
        Err(Error::Scenario(FileError::Key { key, message, .. })) => {
            say(&format!("refused {}", json!([key, message])))
        }
        Err(error) => say(&format!("refused {}", crate::shell::command_line::one_line(&error.to_string()))),
    };
    if said.is_err() {
        return Ok(Report { text: String::new(), code: 0 });
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
            Ok(record) => format!("record {}", record.to_line()),
            Err(error) => format!("error {}", crate::shell::command_line::one_line(&error)),
        };
        if say(&answer).is_err() {
            break;
        }
    }
    Ok(Report { text: String::new(), code: 0 })
}

/// Writes a line to the parent process.
fn say(answer: &str) -> std::io::Result<()> {
    crate::shell::terminal::write(&format!("{MARK}{answer}\n"))
}

/// Returns the digests of all files that a plan reads, by their paths.
fn digests(plan: &Plan) -> BTreeMap<String, String> {
    plan.files().into_iter().map(|(path, digest)| (path, digest.to_string())).collect()
}

/// Makes a misbehaving library end this process; `limit`: longest time of a call.
fn isolate(limit: Duration) {
    #[cfg(target_os = "linux")]
    standstill_foreign::isolate(limit);
    #[cfg(not(target_os = "linux"))]
    let _ = limit;
}

fn plan_of(given: &Value) -> Result<Plan, Error> {
    let text = |key: &str| given[key].as_str().unwrap_or_default().to_owned();
    let document = Document::parse(Path::new(&text("path")), &text("text"))?;
    isolate(document.load()?.detector.call_limit()?);
    Ok(Plan::new(document)?)
}
