//! `--isolate`: trials of a library in processes of their own, each with simulator and library inside.
//!
//! ```text
//!   a thread of the run ── scenario, once ──► standstill worker       point and trial, a line each
//!                       ── "2 815" ─────────►  simulator + library
//!                       ◄── record, a line ──
//! ```
//! A worker that ends instead has lost its trial: the next one is another process.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Mutex, PoisonError};

use standstill_scenario::{Document, Lost, Plan, Record, Remote};

use crate::Report;
use crate::error::Error;

/// What stands before a line of a worker's own, among what its library prints.
const MARK: &str = "\u{1}standstill ";

/// Processes that run trials.
#[derive(Debug)]
pub struct Workers {
    /// What each reads first: the scenario's file, and its text with all that was changed of it.
    scenario: String,
    free: Mutex<Vec<Worker>>,
}

/// A process that runs trials.
#[derive(Debug)]
struct Worker {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Workers {
    /// For the trials of a document with a library.
    pub fn of(document: &Document) -> Result<Self, Error> {
        let file = document.load()?;
        if file.detector.library.is_none() {
            let found = "--isolate: found a scenario without `detector.library`";
            return Err(Error::Arguments(format!(
                "{found}; needed one: methods need no process of their own"
            )));
        }
        let folder = std::path::absolute(document.files().folder()).or_else(|_| std::env::current_dir());
        let path = folder.map_err(Error::writing(Path::new("scenario")))?.join("scenario.toml");
        let scenario = serde_json::json!({ "path": path, "text": file.text()? }).to_string();
        Ok(Self { scenario, free: Mutex::default() })
    }

    fn worker(&self) -> std::io::Result<Worker> {
        if let Some(worker) = self.free.lock().unwrap_or_else(PoisonError::into_inner).pop() {
            return Ok(worker);
        }
        let mut child = Command::new(std::env::current_exe()?)
            .arg("worker")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let (Some(mut input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(std::io::Error::other("a process without pipes"));
        };
        writeln!(input, "{}", self.scenario)?;
        Ok(Worker { child, input, output: BufReader::new(output) })
    }
}

impl Worker {
    /// Asks for a trial; nothing if the process ends before it answers.
    fn ask(&mut self, point: usize, trial: u64) -> Option<Result<Record, Lost>> {
        writeln!(self.input, "{point} {trial}").ok()?;
        let mut line = Vec::new();
        loop {
            line.clear();
            if self.output.read_until(b'\n', &mut line).ok()? == 0 {
                return None;
            }
            let text = String::from_utf8_lossy(&line);
            // What a library prints may stand before it.
            let Some((_, answer)) = text.trim_end_matches('\n').split_once(MARK) else { continue };
            return Some(match answer.split_once(' ') {
                Some(("error", text)) => Err(Lost::All(text.to_owned())),
                Some(("record", line)) => {
                    Record::from_line(line).ok_or_else(|| Lost::All(format!("a record that is none: {line}")))
                }
                _ => Err(Lost::All(format!("an answer that is none: {answer}"))),
            });
        }
    }
}

/// Why a process ended.
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
        if let Some(answer) = worker.ask(point, trial) {
            self.free.lock().unwrap_or_else(PoisonError::into_inner).push(worker);
            return answer;
        }
        drop(worker.input);
        let status = worker.child.wait().map_err(|error| Lost::All(error.to_string()))?;
        Err(Lost::Trial(ending(status)))
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        for worker in std::mem::take(self.free.get_mut().unwrap_or_else(PoisonError::into_inner)) {
            let Worker { mut child, input, .. } = worker;
            // At the end of its input a worker ends.
            drop(input);
            let _ = child.wait();
        }
    }
}

/// The process itself.
pub fn worker() -> Result<Report, Error> {
    // An interruption is its parent's to answer: this one ends with its input.
    let _ = ctrlc::set_handler(|| ());
    let failed = |error: std::io::Error| Error::Read("standard input".into(), error);
    let mut lines = std::io::stdin().lines();
    let first = lines.next().transpose().map_err(failed)?.unwrap_or_default();
    let plan = plan(&first);
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
            Err(error) => format!("error {}", crate::text::one_line(&error)),
        };
        let mut output = std::io::stdout();
        if writeln!(output, "{MARK}{answer}").and_then(|()| output.flush()).is_err() {
            break;
        }
    }
    Ok(Report { text: String::new(), code: 0 })
}

fn plan(first: &str) -> Result<Plan, Error> {
    let given: serde_json::Value =
        serde_json::from_str(first).map_err(|error| Error::Arguments(format!("worker: {error}")))?;
    let text = |key: &str| given[key].as_str().unwrap_or_default().to_owned();
    let document = Document::parse(Path::new(&text("path")), &text("text"))?;
    #[cfg(target_os = "linux")]
    standstill_foreign::isolate(document.load()?.detector.call_limit()?);
    Ok(Plan::new(document)?)
}
