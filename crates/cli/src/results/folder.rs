//! The folder of a finished run, and errors for folders that are not one.

use std::path::{Path, PathBuf};

use standstill_campaign::store::{Identity, Journal, Row, Rows, Shard};
use standstill_interface::Choice as _;
use standstill_report::study::ErrorCloud;
use standstill_scenario::{Document, Rotor, ScenarioFile, Verdict};
use standstill_table::{Cell, Column, Format, Reader, TableError};

use super::begun::Begun;
use super::intact;
use super::names::{STATISTICS, SUMMARY, trials_name};
use super::summary::SummaryFile;
use crate::columns::{AGE, HALF_SECTOR, needed_columns, trial_columns};
use crate::error::Error;
use crate::shell::command_line::quoted;
use crate::shell::progress;
use crate::shell::terminal::tell;

/// A finished run in its folder.
pub struct FinishedRun {
    pub folder: PathBuf,
    pub trials: PathBuf,
    pub summary: SummaryFile,
    pub file: ScenarioFile,
    /// The only folder whose files the scenario may read. None allows all folders.
    pub fence: Option<PathBuf>,
}

impl FinishedRun {
    /// Returns the rated current of the motor in A. None if the run varies the motor, or if the files of the motor are not here as the run
    /// read them.
    pub fn rated_current(&self) -> Option<f64> {
        let file = &self.file;
        if file.axes.keys().chain(file.tolerances.keys()).any(|key| key.starts_with("motor")) {
            return None;
        }
        let run = &self.summary.run;
        let mut document = Document::parse(Path::new("scenario"), &run.scenario).ok()?;
        if let Some(fence) = &self.fence {
            document.fence(Some(fence)).ok()?;
        }
        let sheet = document.data_sheet().ok()?;
        let here = document.files().digests();
        let is_same = here
            .iter()
            .all(|(path, digest)| run.files.get(path).is_some_and(|there| *there == digest.to_string()));
        is_same.then(|| sheet.rated_current())
    }

    /// Returns the scenario's name from the run's command line, which a note in the folder contains. Without this note, returns the
    /// placeholder `scenario.toml` and a remark that explains the placeholder.
    pub fn begun(&self) -> (Begun, &'static str) {
        const STAND_IN: &str = "scenario.toml";
        if let Some(begun) = Begun::of(&self.folder) {
            return (begun, "");
        }
        let file = &self.file;
        let is_judged =
            file.detector.library.is_none() && file.faults.is_empty() && file.rotor.state() != Rotor::Driven;
        let check = is_judged.then(|| format!("standstill check {STAND_IN}"));
        let [scenario, line, typed] = [STAND_IN, STAND_IN, ""].map(str::to_owned);
        let begun = Begun { scenario, line, typed, check };
        (begun, " (scenario.toml: the run's own file, or the scenario on its page)")
    }

    /// Returns the option of `run` for the format of the table of trials, with a leading space. Returns an empty text for the default
    /// format.
    pub fn format_option(&self) -> &'static str {
        let is_parquet = self.trials.extension().is_some_and(|ending| ending == "parquet");
        if is_parquet { " --format parquet" } else { "" }
    }
}

/// Returns the error of a folder without readable trials, with advice on how to get them.
fn no_trials(folder: &Path, needed: &[&str]) -> Error {
    let other = [Format::Npz, Format::Mat].map(trials_name);
    let found = if let Some(other) = other.into_iter().find(|name| folder.join(name).exists()) {
        format!("{other}, which is not read back")
    } else if folder.join(STATISTICS).exists() {
        "statistics alone (--rows none), whose answers are in summary.json".to_owned()
    } else {
        "no trials".to_owned()
    };
    let needed = needed.join(" or ");
    let needed =
        format!("{needed}, as `standstill run` writes them with --format csv or parquet and --rows all");
    Error::results(folder, found, needed)
}

/// Commands whose results are not a run. Each entry contains the name of the command, a file that identifies the results, and the page of
/// the results.
const OTHERS: [(&str, &str, Option<&str>); 10] = [
    ("compare", "comparison.csv", Some("comparison.html")),
    ("faults", "faults.json", Some("faults.html")),
    ("qualify", "qualify.json", Some("qualify.html")),
    ("budget", "budget.json", Some("budget.html")),
    ("odds", "odds.json", Some("odds.html")),
    ("require", "require.json", Some("require.html")),
    ("tune", "tune.json", Some("tune.html")),
    ("explain", "explain.json", Some("explain.html")),
    ("trace", "overlay.html", Some("overlay.html")),
    ("trace", "waveform.csv", None),
];

/// Returns the command whose results a folder contains, and the page of these results.
fn answered(folder: &Path) -> Option<(&'static str, Option<PathBuf>)> {
    let (command, _, page) = OTHERS.into_iter().find(|(_, file, _)| folder.join(file).exists())?;
    Some((command, page.map(|page| folder.join(page)).filter(|page| page.exists())))
}

/// Returns an error with the next step if the run in this folder is not finished.
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
        let begun = Begun::of(folder);
        let needed = match begun {
            Some(begun) => format!("its end: `{} --resume` goes on", begun.typed),
            None => format!(
                "its end: `standstill run SCENARIO --resume --out {}` goes on, with the options that it began with",
                quoted(&folder.display().to_string())
            ),
        };
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

/// Prints a note if the results of this folder are being extended by new trials, or replaced by another run.
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

/// Returns the run to which a journal belongs, and a text with the number of its finished trials.
fn done(journal: &Path) -> Option<(Identity, String)> {
    let mut rows = Rows::open(journal).ok()?;
    while rows.block().ok()?.is_some() {}
    let all = rows.identity().rows();
    let done = format!(", {} of {all} trials are done", all - rows.walk().left());
    Some((rows.identity().clone(), done))
}

impl FinishedRun {
    /// Opens a finished run's folder.
    pub fn open(folder: &Path) -> Result<Self, Error> {
        unfinished(folder)?;
        let summary = SummaryFile::read(folder)?;
        if summary.digest.is_none() {
            intact::say_unsealed(folder);
        }
        let names = [Format::Csv, Format::Parquet].map(trials_name);
        let Some(trials) = names.map(|name| folder.join(name)).into_iter().find(|path| path.exists()) else {
            return Err(no_trials(folder, &names));
        };
        summary.check(&trials)?;
        let file = Document::parse(Path::new("scenario"), &summary.run.scenario)?.load()?;
        Ok(Self { folder: folder.to_owned(), trials, summary, file, fence: None })
    }

    /// Returns the error that the table of trials belongs to another run. `found` describes the evidence.
    pub fn foreign(&self, found: String) -> Error {
        Error::results(&self.trials, found, "the trials that summary.json beside it is of")
    }

    /// Reads all trials, point by point.
    ///
    /// # Errors
    /// The table cannot be read, or belongs to another run.
    pub fn trials(&self, mut each: impl FnMut(usize, Row)) -> Result<(), Error> {
        let reader = Reader::open(&self.trials).map_err(Error::Table)?;
        for (key, needed) in self.summary.run.metadata() {
            if reader.metadata.get(&key) != Some(&needed) {
                return Err(self.foreign(format!("another {key}, or none")));
            }
        }
        if let Some(name) = needed_columns(false).find(|column| !reader.columns.contains(&column.name)) {
            return Err(self.foreign(format!("no column {}", name.name)));
        }
        let bar = progress::reading(self.summary.trials());
        let half: Vec<_> =
            self.summary.each().map(|of| of.sectors.map(|sectors| sectors.half_width_deg)).collect();
        let of_trial = reader.columns.iter().any(|name| name == HALF_SECTOR);
        let read = rows(reader, |point, row| {
            bar.inc(1);
            // Tables of earlier versions have the middle of a sector alone, and the summary its width.
            let of_point = || half.get(point).copied().flatten();
            let half_sector_deg = if of_trial { row.half_sector_deg } else { of_point() };
            each(point, Row { half_sector_deg, ..row });
        });
        bar.finish_and_clear();
        read.map_err(Error::Table)
    }

    /// Reads the errors of all trials, and keeps only as many as a figure can show.
    pub fn cloud(&self) -> Result<ErrorCloud, Error> {
        let (mut cloud, mut complete) = (ErrorCloud::default(), true);
        let open = self.summary.run.pole_is_open;
        self.trials(|_, row| {
            complete &= !row.true_angle_deg.is_nan();
            // Where poles are not judged, none is wrong.
            let error = if open { row.axis_error_deg } else { row.error_deg };
            cloud.add(row.true_angle_deg, row.axis_error_deg, error);
        })?;
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

/// Reads the rows of a table of trials with the indices of their points. Missing numbers become not-a-number or none. Reasons have no kind,
/// because the table contains only their text.
///
/// # Errors
/// The table cannot be read to its end.
pub fn rows(reader: Reader, mut each: impl FnMut(usize, Row)) -> Result<(), TableError> {
    let in_sectors = reader.columns.iter().any(|name| name == HALF_SECTOR);
    let columns: Vec<Column> = if reader.columns.iter().any(|name| name == AGE) {
        trial_columns(in_sectors).collect()
    } else {
        needed_columns(in_sectors).collect()
    };
    let (mut point, mut last) = (0, None);
    reader.values(&columns, |values| {
        let Some(row) = row(values, in_sectors) else { return };
        // Each point begins at its first trial.
        point += usize::from(last.is_some_and(|last| row.trial <= last));
        last = Some(row.trial);
        each(point, row);
    })
}

fn row(values: &[Cell<'_>], in_sectors: bool) -> Option<Row> {
    let &[Cell::Whole(trial), ref values @ ..] = values else { return None };
    let number =
        |place: usize| if let Some(Cell::Number(number)) = values.get(place) { Some(*number) } else { None };
    let known = |place: usize| number(place).unwrap_or(f64::NAN);
    let text = |place: usize| if let Cell::Text(text) = &values[place] { text.as_ref() } else { "" };
    let behind = 12 + usize::from(in_sectors);
    Some(Row {
        trial,
        true_angle_deg: known(0),
        estimated_angle_deg: number(1),
        error_deg: number(2),
        half_sector_deg: number(12).filter(|_| in_sectors),
        age_s: number(behind),
        error_at_instant_deg: number(behind + 1),
        verdict: Verdict::named(text(3))?,
        pole_correct: if let Cell::Flag(correct) = values[4] { Some(correct) } else { None },
        rotor_moved_deg: known(5),
        duration_s: known(6),
        axis_deg: number(7),
        axis_error_deg: number(8),
        start_angle_deg: known(9),
        peak_current_a: known(10),
        reason: text(11).to_owned(),
        kind: String::new(),
    })
}
