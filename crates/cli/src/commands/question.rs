//! Common parts of the commands that answer a question about a scenario (`odds`, `budget`, `require`, `tune`):
//! document, plan, progress, files.

mod ends;
mod finished;
mod identity;
pub mod silence;

pub use ends::{Key, allowed};
pub use identity::Identity;
pub use silence::{Silence, check_command};

use std::fmt::Write as _;
use std::path::PathBuf;

use serde_json::json;
use standstill_analysis::Halt;
use standstill_campaign::store::{Journal, JournalError, Notes};
use standstill_detect::Method;
use standstill_scenario::{Document, FileError, Plan, Scenario, ScenarioFile};

use crate::answer::{Answer, Made};
use crate::arguments::{Keys, Question, Seed, default_folder};
use crate::doubts;
use crate::error::Error;
use crate::scenario::{self, Shorthands};
use crate::shell::command_line::{command, quoted, set, to_resume};
use crate::shell::interrupt::INTERRUPTED;
use crate::shell::output::{Output, remove_stale};
use crate::shell::progress::Watched;
use crate::shell::setup::{Setup, in_words};
use crate::shell::{Report, workers};

/// Returns the scenario document of a question, with the keys that the command line sets.
pub fn document(question: &Question) -> Result<Document, Error> {
    let shorthands = Shorthands::default().seed(question.seed);
    scenario::changed(scenario::read(&question.scenario)?, &question.keys, shorthands)
}

/// Returns the plan of a question. Fails if its scenario has sweep axes or `stop_at`.
pub fn plan(question: &Question) -> Result<Plan, Error> {
    plan_of(document(question)?)
}

/// Returns the plan of a scenario document. Fails if the document has sweep axes or `stop_at`.
pub fn plan_of(document: Document) -> Result<Plan, Error> {
    let file = document.load()?;
    if !file.axes.is_empty() {
        let needed = "a scenario without; `-s` sets their keys";
        return Err(document.refuse("axes", "axes", needed).into());
    }
    if !file.stop_at.is_empty() {
        let needed = "a scenario without; `standstill run` has a use for it";
        return Err(document.refuse("stop_at", "stop_at", needed).into());
    }
    let plan = Plan::new(document)?;
    doubts::warn(&plan.scenario(0)?);
    Ok(plan)
}

/// Returns the arguments that ask a question again: scenario, keys and seed, formatted for a command line.
pub fn again(question: &Question) -> String {
    given(&question.scenario.to_string_lossy(), &question.keys, question.seed)
}

/// Formats a scenario or a motor, with keys and a seed, for a command line.
pub fn given(scenario: &str, keys: &Keys, seed: Seed) -> String {
    let mut line = quoted(scenario);
    line.extend(keys.set.iter().map(|(key, value)| set(key, value)));
    if let Some(library) = &keys.detector {
        let _ = write!(line, " --detector {}", quoted(&library.to_string_lossy()));
    }
    if let Some(seed) = seed.seed {
        let _ = write!(line, " --seed {seed}");
    }
    line
}

/// A question during its computation.
pub struct Asked<'a> {
    question: &'a Question,
    /// Name of the command. The output files have the same name.
    name: &'static str,
    plan: &'a Plan,
    identity: Identity,
    /// Progress bar, interrupt flag, and the intermediate results from which `--resume` continues.
    pub watched: Watched,
}

impl<'a> Asked<'a> {
    /// Begins a question. `options` has the command's options and their values. `trials` is the approximate number of trials, or 0 if it is
    /// unknown. If `--resume` is given and the answer is already finished, returns the report of this answer instead.
    ///
    /// # Errors
    /// Files cannot be written; notes exist, but `--resume` is not given or they belong to another scenario; or the folder has the answer
    /// to another question.
    pub fn new<const N: usize>(
        question: &'a Question,
        name: &'static str,
        plan: &'a Plan,
        options: [(&str, Option<String>); N],
        trials: u64,
    ) -> Result<Result<Self, Report>, Error> {
        let folder = folder(question, name);
        if let Some(folder) = &folder {
            let names = ["csv", "json", "html", "svg", "png"].map(|kind| format!("{name}.{kind}"));
            // The output is made and removed again, so that files that cannot be written are reported before the first trial.
            drop(Output::create(folder, &names.each_ref().map(String::as_str))?);
        }
        let identity = Identity::new(plan, options)?;
        if let Some(folder) = folder.filter(|_| question.resume && !question.force)
            && notes_of(question, name).is_some_and(|notes| !notes.exists())
        {
            identity.guard(&folder.join(format!("{name}.json")))?;
            if let Some(report) = finished::report(&folder, name, question.json)? {
                return Ok(Err(report));
            }
        }
        let watched = match notes_of(question, name) {
            Some(path) => Watched::noting(trials, Some(notes(question, path, &identity)?)),
            None => Watched::new(trials),
        };
        Ok(Ok(Self { question, name, plan, identity, watched }))
    }

    /// Runs `work` on the requested number of threads and returns its result. None if it was interrupted.
    pub fn run<T: Send>(
        &self,
        work: impl FnOnce() -> Result<T, Halt<FileError>> + Send,
    ) -> Result<Option<T>, Error> {
        let found = workers(self.question.threads.map(usize::from))?.install(work);
        self.watched.bar.finish_and_clear();
        match found {
            Ok(value) => Ok(Some(value)),
            Err(Halt::Stopped) => Ok(None),
            Err(Halt::Failed(error)) => Err(error.into()),
        }
    }

    /// Returns the identity of the question, which determines its answer.
    pub const fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Removes the intermediate results that this process stored for `--resume`. Those of another process stay.
    pub fn forget(&self) -> Result<(), Error> {
        let own = notes_of(self.question, self.name).filter(|_| self.watched.has_notes());
        match own.filter(|notes| notes.exists()) {
            Some(notes) => std::fs::remove_file(&notes).map_err(Error::writing(&notes)),
            None => Ok(()),
        }
    }

    /// Returns the report of an interrupted question. `done` describes the part that was completed.
    pub fn interrupted(&self, done: &str) -> Report {
        let kept = notes_of(self.question, self.name).filter(|_| self.watched.has_notes());
        let command = to_resume();
        let text = match (self.question.json, kept) {
            (true, None) => format!("{:#}\n", json!({ "interrupted": true, "done": done })),
            (true, Some(path)) => {
                let json = json!({ "interrupted": true, "done": done, "journal": path, "resume": command });
                format!("{json:#}\n")
            }
            (false, None) => format!("Interrupted: {done}; no files were written.\n"),
            (false, Some(path)) => format!(
                "Interrupted: {done}; what was computed is kept in {}. Go on with\n  {command}\n",
                path.display()
            ),
        };
        Report { text, code: INTERRUPTED }
    }

    /// Adds setup and identity to the answer's JSON, writes the files, and returns the report.
    pub fn answer(&self, scenario: &Scenario<Method<f64>>, mut answer: Answer) -> Result<Report, Error> {
        let said = json!(finished::Said::of(&answer));
        let (file, json) = (self.plan.file(), &mut answer.json);
        json["setup"] = super::setup_json(file, &scenario.motor);
        json["method"] = file.detector.name().into();
        if let Some(note) = pole_note(scenario) {
            json["pole_note"] = note.into();
        }
        if let Some(note) = scenario.motor.map_note() {
            json["map_note"] = note.into();
        }
        json[identity::KEY] = json!(self.identity);
        json[finished::KEY] = said;
        let place = self.question.scenario.with_file_name("scenario");
        let Identity { of, options } = &self.identity;
        let setup = Some(Setup::of(&place, &of.scenario, &of.files, Vec::new()));
        let made = Made { setup, command: command(self.name, options), ..Made::default() };
        let report = answer.report(folder(self.question, self.name), self.question.json, &made)?;
        // The notes are removed only now that the files are in place.
        self.forget()?;
        Ok(report)
    }
}

/// Returns the path of the intermediate results of a question. None if no files are written.
fn notes_of(question: &Question, name: &str) -> Option<PathBuf> {
    Some(folder(question, name)?.join(format!("{name}.journal")))
}

/// Opens the file of intermediate results at this path. With `--resume` it continues those of the same question, otherwise it begins with
/// none.
fn notes(question: &Question, path: PathBuf, asked: &Identity) -> Result<Notes, Error> {
    if let Some(folder) = path.parent() {
        remove_stale(folder);
    }
    if !question.force {
        asked.guard(&path.with_extension("json"))?;
    }
    if question.resume {
        return Ok(Notes::resume(&path, &asked.of)?);
    }
    let notes = Notes::new(&path, &asked.of);
    if Journal::is_busy(&path) {
        return Err(JournalError::Busy(path).into());
    }
    match (path.exists(), question.force) {
        (false, _) => {}
        (true, true) => notes.replace()?,
        (true, false) => {
            return Err(Error::unfinished(path, "what a question has computed that was interrupted"));
        }
    }
    Ok(notes)
}

/// Returns the output folder. None if no files are written.
fn folder(question: &Question, name: &str) -> Option<PathBuf> {
    let default = || (!question.json).then(|| default_folder(Some(&question.scenario), name));
    question.out.clone().or_else(default)
}

/// Returns motor, method and errors of an answer in one line. Notes follow on separate lines.
pub fn setting(file: &ScenarioFile, scenario: &Scenario<Method<f64>>) -> String {
    let sectors = scenario.detector.half_sector().filter(|_| scenario.foreign.is_none());
    let sectors =
        sectors.map(|_| "answers are sectors: an error is what lies beyond the sector named".to_owned());
    let notes = pole_note(scenario).map(str::to_owned).into_iter().chain(scenario.motor.map_note());
    let notes = notes.chain(sectors);
    let note = notes.fold(String::new(), |all, note| all + "\n(" + &note + ")");
    format!(
        "{}, {}, {}, {} rotor, seed {}{note}",
        scenario.motor.name,
        file.detector.name(),
        in_words(file.errors.0),
        file.rotor.state().name(),
        file.seed
    )
}

/// Returns the note for a motor whose data do not show which pole is which. None for other motors.
fn pole_note(scenario: &Scenario<Method<f64>>) -> Option<&'static str> {
    scenario.motor.pole_knowledge().note().filter(|_| scenario.motor.has_magnet())
}
