//! `standstill report`: a finished run as one page to mail, and its figures.

mod page;
pub mod setup;
pub mod stale;
mod study;
mod two;
mod verdict;

use std::path::{Path, PathBuf};

pub use self::study::{conditions, setting};
pub use self::verdict::range;

use serde_json::json;
use standstill_campaign::store::{Identity, Journal, Rows, Shard};
use standstill_report::figure::Figure;
use standstill_report::study::{ErrorCloud, figures};
use standstill_scenario::{Document, ScenarioFile};
use standstill_table::{Format, Reader};

use super::reproduce::file_list;

use super::run::quoted;
use super::run::results::{STATISTICS, SUMMARY, SummaryFile, trials_name};
use crate::Report as Said;
use crate::arguments::Report;
use crate::asked::Asked;
use crate::error::Error;
use crate::interrupt;
use crate::output::Output;
use crate::progress;
use crate::terminal::tell;

/// What a run's folder holds.
pub struct Run {
    pub folder: PathBuf,
    pub trials: PathBuf,
    pub summary: SummaryFile,
    pub file: ScenarioFile,
    /// The folder that no file of the scenario may be outside of.
    fence: Option<PathBuf>,
}

pub fn run(options: &Report) -> Result<Said, Error> {
    interrupt::at_once();
    if let Some(second) = &options.second {
        return two::run(options, second);
    }
    let run = Run::open(&options.folder)?;
    say_extension(&options.folder);
    let (_, headline, details) = verdict::verdict(&run.summary);
    let mut text = format!("{headline}\n  {}\n", details.join("\n  "));
    if options.json {
        let json = json!({ "headline": headline, "details": details, "run": run.summary.run });
        text = format!("{json:#}\n");
    }
    let Some(out) = folder(options) else { return Ok(Said { text, code: 0 }) };
    let (html, figures) = made(&run)?;
    let names: Vec<String> =
        figures.iter().flat_map(|(name, _)| ["svg", "png"].map(|kind| format!("{name}.{kind}"))).collect();
    let all: Vec<&str> = names.iter().map(String::as_str).chain(["report.html"]).collect();
    let mut output = Output::answering(asked(options, &out), &out, &all)?;
    output.file("report.html", html.as_bytes())?;
    for (name, figure) in &figures {
        output.file(&format!("{name}.svg"), figure.svg()?.as_bytes())?;
        output.file(&format!("{name}.png"), &figure.png()?)?;
    }
    let files = output.finish()?;
    remove_stale(&out, &files);
    if !options.json {
        text += "\n";
        text += &file_list(&out, &files);
    }
    Ok(Said { text, code: 0 })
}

/// The folder for the files, if any are wanted.
fn folder(options: &Report) -> Option<PathBuf> {
    let default = || (!options.json).then(|| options.folder.join("report"));
    options.out.clone().or_else(default)
}

/// What these files answer: of which folders they are. What stands in these may have become more since, or another run: then it is for
/// `report` to make the page anew.
fn asked(options: &Report, out: &Path) -> Asked {
    let real = |folder: &Path| folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let first = real(&options.folder);
    // Beside its own run a page stays that run's, wherever both are moved to.
    let beside = out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let own = real(beside) == first;
    let first = if own { "the run beside it".to_owned() } else { first.display().to_string() };
    let (command, said) = match &options.second {
        None => ("report", first),
        Some(second) => ("report A B", format!("{first} and {}", real(second).display())),
    };
    Asked::place(command, said, options.force.force)
}

/// The page of a finished run, with nothing written and no file read that is not below `fence`.
pub fn html(folder: &Path, fence: &Path) -> Result<String, Error> {
    let run = Run { fence: Some(fence.to_owned()), ..Run::open(folder)? };
    made(&run).map(|(html, _)| html)
}

/// The page and its figures.
fn made(run: &Run) -> Result<(String, Vec<(String, Figure)>), Error> {
    let cloud = run.cloud()?;
    let study = study::study(run, cloud);
    let figures = figures(&study);
    let html = page::page(run, &figures).html().map_err(Error::Page)?;
    Ok((html, figures))
}

/// Figures of an earlier report that this one does not have would be taken for its own.
fn remove_stale(folder: &Path, files: &[String]) {
    let ours =
        ["error_over_angle.", "distribution.", "sweep_", "wrong_poles_", "heat_", "methods.", "scatter."];
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let figure = [".svg", ".png"].iter().any(|end| name.ends_with(end));
        if figure && ours.iter().any(|ours| name.starts_with(ours)) && !files.contains(&name) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// What is there instead of trials that can be read, and the way out.
fn no_trials(folder: &Path, needed: &[&str]) -> Error {
    let other = [Format::Npz, Format::Mat].map(trials_name);
    let found = if let Some(other) = other.into_iter().find(|name| folder.join(name).exists()) {
        format!("{other}, which is not read back")
    } else if folder.join(STATISTICS).exists() {
        "statistics alone (--rows none), whose answers are in summary.json".to_owned()
    } else {
        "no trials".to_owned()
    };
    Error::Results {
        path: folder.to_owned(),
        found,
        needed: format!(
            "{}, as `standstill run` writes them with --format csv or parquet and --rows all",
            needed.join(" or ")
        ),
    }
}

/// Commands that write other results than a run's, the file that tells each, and its page.
const OTHERS: [(&str, &str, Option<&str>); 8] = [
    ("compare", "comparison.csv", None),
    ("budget", "budget.json", Some("budget.html")),
    ("odds", "odds.json", Some("odds.html")),
    ("require", "require.json", Some("require.html")),
    ("tune", "tune.json", Some("tune.html")),
    ("explain", "explain.json", Some("explain.html")),
    ("trace", "overlay.html", Some("overlay.html")),
    ("trace", "waveform.csv", None),
];

/// The command whose results a folder has, and their page.
fn answered(folder: &Path) -> Option<(&'static str, Option<PathBuf>)> {
    let (command, _, page) = OTHERS.into_iter().find(|(_, file, _)| folder.join(file).exists())?;
    Some((command, page.map(|page| folder.join(page)).filter(|page| page.exists())))
}

/// A folder without results, but with what is to become some: how to go on.
fn unfinished(folder: &Path) -> Result<(), Error> {
    let error = |path: &Path, found: String, needed: String| {
        Err(Error::Results { path: path.to_owned(), found, needed })
    };
    if folder.is_file() {
        let needed = "the folder of a finished run, as `standstill run SCENARIO --out DIR` writes it";
        return error(folder, "a file".to_owned(), needed.to_owned());
    }
    if folder.join(SUMMARY).exists() {
        return Ok(());
    }
    if let Some((command, page)) = answered(folder) {
        let found = format!("the results of `standstill {command}`");
        let needed = match page {
            Some(page) => format!("those of `standstill run`; the page of these is {}", page.display()),
            None => "those of `standstill run`; these have no page".to_owned(),
        };
        return error(folder, found, needed);
    }
    let journal = folder.join(Shard::WHOLE.file_name());
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let name = |entry: std::fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
    let shards = entries.map(name).filter(|name| name.starts_with("shard-") && name.ends_with(".journal"));
    if journal.exists() {
        let found = if Journal::is_busy(&journal) {
            "a run that is under way".to_owned()
        } else {
            format!("a run that is not finished{}", done(&journal).map(|(_, done)| done).unwrap_or_default())
        };
        let folder = quoted(&folder.display().to_string());
        let needed = format!(
            "its end: `standstill run SCENARIO --resume --out {folder}` goes on, with the options that it began with"
        );
        return error(&journal, found, needed);
    }
    match shards.count() {
        0 => {
            let found = if folder.exists() { "no results" } else { "no such folder" };
            let needed = "the folder of a finished run, as `standstill run SCENARIO --out DIR` writes it";
            error(folder, found.to_owned(), needed.to_owned())
        }
        count => {
            let needed = format!(
                "all of them put together: `standstill status {0}` says which are missing, `standstill merge {0} --out DIR` makes the results",
                quoted(&folder.display().to_string())
            );
            error(folder, format!("{count} shards of a run, and no results"), needed)
        }
    }
}

/// Says that there is more than the results of this folder: trials that are to extend them, or those of a run that takes their place.
pub fn say_extension(folder: &Path) {
    let path = folder.join(Shard::WHOLE.file_name());
    let Some((coming, done)) = path.exists().then(|| done(&path)).flatten() else { return };
    let extends = SummaryFile::read(folder).is_ok_and(|summary| summary.run.begins(&coming));
    let (what, trials, more) = if extends {
        ("extended", "the new trials", "--trials N --resume")
    } else {
        ("replaced by another run", "its trials", "--force --resume")
    };
    tell(&format!(
        "these results are being {what}{done}: {} has {trials}, and `standstill run SCENARIO {more} --out {}` goes on",
        path.display(),
        quoted(&folder.display().to_string())
    ));
}

/// Of which run a journal is, and how many of its trials it has.
fn done(journal: &Path) -> Option<(Identity, String)> {
    let mut rows = Rows::open(journal).ok()?;
    while rows.block().ok()?.is_some() {}
    let all = rows.identity().rows();
    let done = format!(", {} of {all} trials are done", all - rows.left());
    Some((rows.identity().clone(), done))
}

impl Run {
    /// Opens a finished run's folder.
    pub fn open(folder: &Path) -> Result<Self, Error> {
        unfinished(folder)?;
        let summary = SummaryFile::read(folder)?;
        let names = [Format::Csv, Format::Parquet].map(trials_name);
        let Some(trials) = names.map(|name| folder.join(name)).into_iter().find(|path| path.exists()) else {
            return Err(no_trials(folder, &names));
        };
        summary.check(&trials)?;
        let file = Document::parse(Path::new("scenario"), &summary.run.scenario)?.load()?;
        Ok(Self { folder: folder.to_owned(), trials, summary, file, fence: None })
    }

    /// What is wrong with a table of trials that is not this run's.
    pub fn foreign(&self, found: String) -> Error {
        Error::Results {
            path: self.trials.clone(),
            found,
            needed: "the trials that summary.json beside it is of".to_owned(),
        }
    }

    /// The trials, and the places of columns.
    pub fn columns<const N: usize>(&self, names: [&str; N]) -> Result<(Reader, [usize; N]), Error> {
        let reader = Reader::open(&self.trials).map_err(Error::Table)?;
        for (key, needed) in self.summary.run.metadata() {
            if reader.metadata.get(&key) != Some(&needed) {
                return Err(self.foreign(format!("another {key}, or none")));
            }
        }
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(names) {
            let found = reader.columns.iter().position(|column| column == name);
            *place = found.ok_or_else(|| self.foreign(format!("no column {name}")))?;
        }
        Ok((reader, places))
    }

    /// The errors of all trials, of which only as much is kept as can be drawn.
    fn cloud(&self) -> Result<ErrorCloud, Error> {
        let (reader, places) = self.columns(["true_angle_deg", "axis_error_deg", "error_deg"])?;
        let (mut cloud, mut complete) = (ErrorCloud::new(), true);
        let open = self.summary.run.pole_is_open;
        let bar = progress::reading(self.summary.trials());
        let read = reader.numbers(places, |[angle, axis_error, error]| {
            complete &= angle.is_some();
            // Where poles are not judged, none is wrong.
            cloud.add(angle.unwrap_or(f64::NAN), axis_error, if open { axis_error } else { error });
            bar.inc(1);
        });
        bar.finish_and_clear();
        read.map_err(Error::Table)?;
        if !complete {
            return Err(self.foreign("a trial without its angle".to_owned()));
        }
        let found = cloud.trials();
        if found != self.summary.trials() {
            return Err(self.foreign(format!("{found} trials instead of {}", self.summary.trials())));
        }
        Ok(cloud)
    }
}
