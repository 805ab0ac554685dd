//! What the commands have in common that answer one question of a scenario: `odds`, `budget`, `require`, `tune`.

mod ends;
mod identity;

pub use ends::{Key, allowed};
pub use identity::Identity;

use std::path::PathBuf;

use serde_json::json;
use standstill_analysis::Halt;
use standstill_campaign::store::Notes;
use standstill_detect::Method;
use standstill_report::figure::Figure;
use standstill_report::page::{Block, Chart, Page, Section};
use standstill_scenario::Scenario;
use standstill_scenario::{Document, FileError, Plan, ScenarioFile};

use crate::arguments::{Question, default_folder};
use crate::doubts;
use crate::error::Error;
use crate::scenario::{self, Shorthands};
use crate::shell::Report;
use crate::shell::asked::Asked;
use crate::shell::command_line::to_resume;
use crate::shell::interrupt::INTERRUPTED;
use crate::shell::output::Output;
use crate::shell::output::file_list;
use crate::shell::progress::Watched;
use crate::shell::setup::Setup;

/// The document with what the command line sets in it.
pub fn document(question: &Question) -> Result<Document, Error> {
    let shorthands = Shorthands::default().seed(question.seed);
    scenario::changed(scenario::read(&question.scenario)?, &question.keys, shorthands)
}

/// The plan of one scenario.
pub fn plan(question: &Question) -> Result<Plan, Error> {
    let document = document(question)?;
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

/// Runs on as many threads as asked for.
pub fn on_threads<T: Send>(question: &Question, work: impl FnOnce() -> T + Send) -> Result<T, Error> {
    let threads = question.threads.map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| Error::Threads(format!("no worker threads: {error}")))?;
    Ok(pool.install(work))
}

/// The result, or none if it was interrupted.
pub fn unless_stopped<T>(result: Result<T, Halt<FileError>>) -> Result<Option<T>, Error> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(Halt::Stopped) => Ok(None),
        Err(Halt::Failed(error)) => Err(error.into()),
    }
}

/// Where a question that may be interrupted keeps what it has computed; nowhere if no files are wanted.
fn notes_of(question: &Question, name: &str) -> Option<PathBuf> {
    Some(folder(question, name)?.join(format!("{name}.journal")))
}

/// Who looks on: a bar for about this many trials, an interrupt's flag, and notes from which `--resume` goes on.
///
/// # Errors
/// Notes that are in the way, or of another scenario; the answer to another question.
pub fn watched(question: &Question, name: &str, asked: &Identity, trials: u64) -> Result<Watched, Error> {
    let Some(path) = notes_of(question, name) else { return Ok(Watched::new(trials)) };
    if let Some(folder) = path.parent() {
        crate::shell::output::remove_stale(folder);
    }
    if !question.force {
        asked.guard(&path.with_extension("json"))?;
    }
    let notes = if question.resume {
        Notes::resume(&path, &asked.of)?
    } else if path.exists() && question.force {
        let notes = Notes::new(&path, &asked.of);
        notes.replace()?;
        notes
    } else if path.exists() {
        return Err(Error::Results {
            path,
            found: "what a question has computed that was interrupted".to_owned(),
            needed: "--resume to go on with it, another --out, or --force to throw it away".to_owned(),
        });
    } else {
        Notes::new(&path, &asked.of)
    };
    Ok(Watched::noting(trials, Some(notes)))
}

/// Removes what was computed of a question that has no answer.
pub fn forget(question: &Question, name: &str) -> Result<(), Error> {
    match notes_of(question, name).filter(|notes| notes.exists()) {
        Some(notes) => std::fs::remove_file(&notes).map_err(Error::writing(&notes)),
        None => Ok(()),
    }
}

/// What there is to say of a question that was not answered.
pub fn interrupted(question: &Question, name: &str, watched: &Watched, done: &str) -> Report {
    let kept = notes_of(question, name).filter(|_| watched.has_notes());
    let command = to_resume();
    let text = match (question.json, kept) {
        (true, None) => format!("{:#}\n", serde_json::json!({ "interrupted": true, "done": done })),
        (true, Some(path)) => {
            let json =
                serde_json::json!({ "interrupted": true, "done": done, "journal": path, "resume": command });
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

/// Motor, method and errors that an answer speaks of, in a line.
pub fn setting(file: &ScenarioFile, scenario: &Scenario<Method<f64>>) -> String {
    let notes = pole_note(scenario).map(str::to_owned).into_iter().chain(scenario.motor.map_note());
    let note = notes.fold(String::new(), |all, note| all + "\n(" + &note + ")");
    format!(
        "{}, {}, {} errors, {} rotor, seed {}{note}",
        scenario.motor.name,
        file.detector.name(),
        file.errors.0.name(),
        file.rotor.state().name(),
        file.seed
    )
}

/// What must be said of poles that the motor's data do not tell.
fn pole_note(scenario: &Scenario<Method<f64>>) -> Option<&'static str> {
    scenario.motor.pole_knowledge().note().filter(|_| scenario.motor.has_magnet())
}

/// The same for JSON, together with what is answered.
pub fn json(
    file: &ScenarioFile,
    scenario: &Scenario<Method<f64>>,
    answer: serde_json::Value,
) -> serde_json::Value {
    let mut json = answer;
    json["setup"] = super::setup_json(file, &scenario.motor);
    json["method"] = file.detector.name().into();
    if let Some(note) = pole_note(scenario) {
        json["pole_note"] = note.into();
    }
    if let Some(note) = scenario.motor.map_note() {
        json["map_note"] = note.into();
    }
    json
}

/// Where files go; none if none are wanted.
pub fn folder(question: &Question, name: &str) -> Option<PathBuf> {
    let default = || (!question.json).then(|| default_folder(Some(&question.scenario), name));
    question.out.clone().or_else(default)
}

/// An answer as it is written.
pub struct Answer {
    /// Of the files and the page's title.
    pub name: &'static str,
    /// In words.
    pub text: String,
    pub json: serde_json::Value,
    /// The table.
    pub csv: Vec<u8>,
    /// Names, figures and captions.
    pub figures: Vec<(String, Figure, String)>,
    /// The page but for its figures.
    pub page: Page,
    pub code: u8,
}

/// What an answer was made from, and by which command.
pub struct Made<'a> {
    pub setup: Setup<'a>,
    pub command: String,
    /// What the note beside the files says, where their JSON does not say it itself.
    pub asked: Option<Asked>,
}

impl Answer {
    fn names(&self) -> Vec<String> {
        let mut names = ["csv", "json", "html"].map(|kind| format!("{}.{kind}", self.name)).to_vec();
        for (name, ..) in &self.figures {
            names.extend(["svg", "png"].map(|kind| format!("{name}.{kind}")));
        }
        names
    }

    /// Writes the files that are wanted; what is printed.
    pub fn report(mut self, question: &Question, asked: &Identity) -> Result<Report, Error> {
        self.json[identity::KEY] = json!(asked);
        let folder = folder(question, self.name);
        let name = self.name;
        let place = question.scenario.with_file_name("scenario");
        let made = Made {
            setup: Setup {
                place: &place,
                text: &asked.of.scenario,
                files: &asked.of.files,
                fence: None,
                varied: Vec::new(),
                others: Vec::new(),
            },
            command: crate::shell::command_line::command(self.name, &asked.options),
            asked: None,
        };
        let report = self.written(folder, question.json, &made)?;
        // Only now that the files are in place.
        forget(question, name)?;
        Ok(report)
    }

    /// The same into a folder.
    pub fn written(
        mut self,
        folder: Option<PathBuf>,
        as_json: bool,
        made: &Made<'_>,
    ) -> Result<Report, Error> {
        let json = format!("{:#}\n", self.json);
        let mut files = String::new();
        if let Some(folder) = folder {
            let names = self.names();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let mut output = match &made.asked {
                Some(asked) => Output::answering(asked.clone(), &folder, &names)?,
                None => Output::create(&folder, &names)?,
            };
            output.file(names[0], &self.csv)?;
            output.file(names[1], json.as_bytes())?;
            for (name, figure, _) in &self.figures {
                output.file(&format!("{name}.svg"), figure.svg()?.as_bytes())?;
                output.file(&format!("{name}.png"), &figure.png()?)?;
            }
            let charts = self.figures.drain(..).map(|(name, figure, caption)| {
                Block::Chart(Chart { id: format!("chart-{name}"), figure, caption })
            });
            let charts = Section { title: "Figures".to_owned(), blocks: charts.collect() };
            self.page.sections.insert(1.min(self.page.sections.len()), charts);
            if let (Some(first), Some(heading)) = (self.page.sections.first_mut(), made.setup.heading()) {
                first.blocks.push(heading);
            }
            self.page.sections.extend([made.setup.section(), made.setup.reproduce(&made.command)]);
            self.page.footer = format!("Standstill {}", env!("CARGO_PKG_VERSION"));
            let html = self.page.html().map_err(Error::Page)?;
            output.file(names[2], html.as_bytes())?;
            files = format!("\n{}", file_list(&folder, &output.finish()?));
        }
        let text = if as_json { json } else { self.text + &files };
        Ok(Report { text, code: self.code })
    }
}
