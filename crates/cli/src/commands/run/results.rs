//! The files of a finished run: `trials.csv` or `trials.parquet`, and `summary.json`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use standstill_campaign::store::{Identity, JournalError, Row, Shards};
use standstill_campaign::{Estimate, Statistics, Summary};
use standstill_files::read_text;
use standstill_quantity::Quantity;
use standstill_scenario::{Document, Point, StopTable};
use standstill_table::{Column, Columns, Format, TableError, Value, Writer};

use super::tables::Tables;
use super::{points, quoted};
use crate::Report;
use crate::arguments::{Results as Options, Rows, Run};
use crate::columns::{AxisColumn, trial_columns, trial_values};
use crate::commands::report::stale;
use crate::commands::reproduce::file_list;
use crate::error::Error;
use crate::output::Output;
use crate::terminal::paragraph;
use crate::{host, progress, summary};

/// Name of the file of summaries.
pub const SUMMARY: &str = "summary.json";

/// Name of what a run without rows leaves, so that it can be extended.
pub const STATISTICS: &str = "run.statistics";

/// Content of `summary.json`.
#[derive(Debug, Serialize, Deserialize)]
pub struct SummaryFile {
    /// What was run.
    pub run: Identity,
    /// All trials; none of a run with axes, whose points were chosen: what they say together depends on the choice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    summary: Option<Summary>,
    /// Each point of the axes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<PointSummary>,
    /// What the tables beside it are; none of a run by a version that did not say it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    tables: Option<Tables>,
}

/// One point of the axes.
#[derive(Debug, Serialize, Deserialize)]
pub struct PointSummary {
    /// Its values by the axes' keys; numbers in SI, angles in degrees.
    pub values: IndexMap<String, serde_json::Value>,
    /// Its trials.
    pub summary: Summary,
}

impl SummaryFile {
    /// That of a folder of results.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(SUMMARY);
        let text = read_text(&path).map_err(|error| Error::Read(path.clone(), error))?;
        let error = |found: String| Error::Results {
            path: path.clone(),
            found,
            needed: "the summary of a run, as `standstill run` writes it".to_owned(),
        };
        let file: Self = serde_json::from_str(&text).map_err(|e| error(e.to_string()))?;
        if file.points.is_empty() && file.summary.is_none() {
            return Err(error("neither a summary nor points".to_owned()));
        }
        Ok(file)
    }

    /// Refuses a table beside this summary that is not as it was written.
    ///
    /// # Errors
    /// As [`Tables::check`].
    pub fn check(&self, table: &Path) -> Result<(), Error> {
        Tables::check(self.tables.as_ref(), table)
    }

    /// The summary of a run without axes.
    pub fn whole(&self) -> Option<&Summary> {
        self.summary.as_ref().filter(|_| self.points.is_empty())
    }

    /// The summary of each point; of a run without axes that of the run.
    pub fn each(&self) -> impl Iterator<Item = &Summary> {
        self.whole().into_iter().chain(self.points.iter().map(|point| &point.summary))
    }

    /// Trials in all.
    pub fn trials(&self) -> u64 {
        self.each().map(|s| s.trials).sum()
    }

    /// Trials that could not be simulated.
    pub fn errors(&self) -> u64 {
        self.each().map(|s| s.errors).sum()
    }
}

impl SummaryFile {
    /// What there is to say of a rule that was to end points early, where the trials ran out before it was met.
    pub fn unreached(&self) -> Option<String> {
        let StopTable { rms, wrong_poles } = self.run.stop_at;
        let half = |e: &Estimate| (e.high - e.low) / 2.0;
        // What is not a number is not narrow either.
        let narrow = |half: f64, most: Option<f64>| most.is_none_or(|most| half <= most);
        let met = |s: &Summary| {
            narrow(half(&s.rms_deg) / s.rms_deg.value, rms.map(Quantity::value))
                && narrow(half(&s.wrong_pole_probability), wrong_poles.map(Quantity::value))
        };
        let (all, missed) = (self.each().count(), self.each().filter(|s| !met(s)).count());
        let of = if all == 1 { String::new() } else { format!(" at {missed} of {all} points") };
        (missed > 0).then(|| {
            format!(
                "stop_at was not reached{of} in {} trials: the intervals are wider than was asked for",
                self.run.trials
            )
        })
    }
}

/// Names of the files.
pub fn names(options: &Run) -> Vec<&'static str> {
    let trials = (options.rows == Rows::All).then(|| trials_name(options.results.format.into()));
    trials.into_iter().chain([SUMMARY]).filter(|_| files_wanted()).collect()
}

/// Refuses to replace the results of another run, or what is none of a run, unless that is asked for. The same run may be
/// repeated: it writes the same again. Where it `extends` results, more trials of the same run may take their place: all of them are
/// in it.
///
/// # Errors
/// What is in the way.
pub fn guard(options: &Options, identity: &Identity, extends: bool) -> Result<(), Error> {
    let path = options.out.join(SUMMARY);
    if options.force || !files_wanted() || !path.exists() {
        return Ok(());
    }
    match SummaryFile::read(&options.out) {
        Ok(summary) if extends && summary.run.begins(identity) => Ok(()),
        Ok(summary) => summary
            .run
            .difference(identity)
            .map_or(Ok(()), |difference| Err(of_another_run(path, &difference))),
        Err(_) => Err(of_another_run(path, "this file is not of `standstill run`")),
    }
}

/// Results that are not replaced.
pub fn of_another_run(path: PathBuf, difference: &str) -> Error {
    Error::Results {
        path,
        found: format!("the results of another run: {difference}"),
        needed: "another --out, or --force to replace them".to_owned(),
    }
}

/// Whether results go into files: a host may want them in memory alone.
pub fn files_wanted() -> bool {
    host::current().is_none_or(|host| host.files)
}

/// Name of the file of trials.
pub const fn trials_name(format: Format) -> &'static str {
    match format {
        Format::Csv => "trials.csv",
        Format::Parquet => "trials.parquet",
        Format::Npz => "trials.npz",
        Format::Mat => "trials.mat",
    }
}

/// Files that are in place.
pub struct Results {
    summary: SummaryFile,
    pub json: String,
    files: Vec<String>,
}

/// Statistics of the points, one after the other.
pub struct Points {
    pub axes: Vec<AxisColumn>,
    pub coordinates: Vec<Point>,
    limit: f64,
    /// Without axes.
    all: Statistics,
    current: Option<(usize, Statistics)>,
    done: Vec<PointSummary>,
}

impl Points {
    /// Of nothing yet.
    pub fn of(identity: &Identity) -> Result<Self, Error> {
        let file = Document::parse(Path::new("scenario"), &identity.scenario)?.load()?;
        let coordinates = file.points()?;
        let limit = file.limit.map_or(Statistics::LIMIT_DEG, Quantity::value);
        Ok(Self {
            axes: AxisColumn::of(&coordinates),
            coordinates,
            limit,
            all: Statistics::with_limit(limit),
            current: None,
            done: Vec::new(),
        })
    }

    /// Adds a row.
    pub fn add(&mut self, point: usize, row: &Row) {
        if self.axes.is_empty() {
            self.all.add_row(row);
            return;
        }
        if self.current.as_ref().is_none_or(|(current, _)| *current != point) {
            self.close();
            self.current = Some((point, Statistics::with_limit(self.limit)));
        }
        if let Some((_, statistics)) = &mut self.current {
            statistics.add_row(row);
        }
    }

    /// Ends the point at hand.
    pub fn close(&mut self) {
        if let Some((point, statistics)) = self.current.take() {
            self.done(point, &statistics);
        }
    }

    fn done(&mut self, point: usize, statistics: &Statistics) {
        if self.axes.is_empty() {
            return;
        }
        let values = &self.coordinates[point].values;
        let values = self.axes.iter().zip(values).map(|(axis, (key, value))| (key.clone(), axis.json(value)));
        self.done.push(PointSummary { values: values.collect(), summary: statistics.summary() });
    }
}

impl Results {
    /// Writes the files of a run whose journals are complete; none if interrupted.
    pub fn write(options: &Options, shards: &Shards, stop: &AtomicBool) -> Result<Option<Self>, Error> {
        let identity = shards.identity();
        let mut points = Points::of(identity)?;
        if let Some(tallies) = shards.tallies(points.limit)? {
            for (point, statistics) in &tallies {
                if points.axes.is_empty() {
                    points.all.merge(statistics);
                }
                points.done(*point, statistics);
            }
            let output = files_wanted().then(|| Output::create(&options.out, &[SUMMARY])).transpose()?;
            return Self::finish(options, output, identity, points, None).map(Some);
        }
        let format = Format::from(options.format);
        let name = trials_name(format);
        let path = options.out.join(name);
        let failed = |error: TableError| Error::table(&path, error);
        let columns: Vec<Column> =
            points.axes.iter().map(|axis| axis.column.clone()).chain(trial_columns()).collect();
        let mut output =
            files_wanted().then(|| Output::create(&options.out, &[name, SUMMARY])).transpose()?;
        let mut file = output.as_mut().map(|output| output.begin(name)).transpose()?;
        let begin = |file| Writer::new(file, format, columns.clone(), &identity.metadata()).map_err(failed);
        let mut trials = file.as_mut().map(|file| begin(file)).transpose()?;
        let host = host::current();
        let mut table = host.as_ref().map(|_| Columns::new(columns.clone()));
        let bar = progress::writing(identity.rows());
        let written = shards.rows(|point, row| {
            if stop.load(Ordering::Relaxed) {
                return Err(Stopped::Interrupted);
            }
            let values = &points.coordinates[point].values;
            let mut cells: Vec<Value<'_>> =
                points.axes.iter().zip(values).map(|(axis, (_, value))| axis.value(value)).collect();
            cells.extend(trial_values(row));
            let of_file = trials.as_mut().map_or(Ok(()), |trials| trials.row(&cells));
            let of_memory = table.as_mut().map_or(Ok(()), |table| table.row(&cells));
            of_file.and(of_memory).map_err(|error| Stopped::Failed(failed(error)))?;
            points.add(point, row);
            bar.inc(1);
            Ok(())
        });
        bar.finish_and_clear();
        match written {
            Ok(()) => {}
            Err(Stopped::Interrupted) => return Ok(None),
            Err(Stopped::Failed(error)) => return Err(error),
        }
        points.close();
        trials.map_or(Ok(()), Writer::finish).map_err(failed)?;
        if let (Some(output), Some(file)) = (&output, file) {
            output.close(name, file)?;
        }
        let results = Self::finish(options, output, identity, points, Some(format))?;
        if let (Some(host), Some(table)) = (host, table) {
            host.keep("trials", table);
        }
        Ok(Some(results))
    }

    /// Writes the summary beside the trials, if there are any, and moves the files into place.
    pub fn finish(
        options: &Options,
        output: Option<Output>,
        identity: &Identity,
        points: Points,
        format: Option<Format>,
    ) -> Result<Self, Error> {
        let whole = points.axes.is_empty().then(|| points.all.summary());
        let tables = output.as_ref().map(|output| Tables::of(output, format.map(trials_name))).transpose()?;
        let summary = SummaryFile { run: identity.clone(), summary: whole, points: points.done, tables };
        let json = serde_json::to_string_pretty(&summary)
            .map_err(|error| Error::Write(options.out.join(SUMMARY), error.into()))?
            + "\n";
        let Some(mut output) = output else { return Ok(Self { summary, json, files: Vec::new() }) };
        output.file(SUMMARY, json.as_bytes())?;
        let other = SummaryFile::read(&options.out).map_or(true, |old| old.run != *identity);
        let mut files = output.finish()?;
        if other {
            files.extend(stale::mark(&options.out)?);
        }
        // An earlier run's trials in another format would be beside this run's summary.
        for other in Format::ALL.into_iter().filter(|other| Some(*other) != format) {
            let _ = std::fs::remove_file(options.out.join(trials_name(other)));
        }
        if format.is_some() {
            let _ = std::fs::remove_file(options.out.join(STATISTICS));
        }
        Ok(Self { summary, json, files })
    }

    /// What there is to say.
    pub fn report(self, options: &Options) -> Report {
        let Self { summary: file, json, files } = self;
        let code = u8::from(file.errors() > 0);
        if options.json {
            return Report { text: json, code };
        }
        let mut text = String::new();
        let open = file.run.pole_is_open;
        text += &file.whole().map_or_else(|| points::text(&file.points, open), |s| summary::text(s, open));
        if let Some(note) = file.unreached() {
            text += "\n";
            text += &paragraph("", &note);
        }
        if let Some(note) = &file.run.pole_note {
            text += "\n";
            text += &paragraph("", &format!("Poles: {note}."));
        }
        if let Some(note) = &file.run.map_note {
            text += "\n";
            text += &paragraph("", &format!("Map: {note}."));
        }
        if let Some(note) = &file.run.library_note {
            text += "\n";
            text += &paragraph("", &format!("Library: {note}."));
        }
        text += "\n";
        text += &file_list(&options.out, &files);
        if [trials_name(Format::Csv), trials_name(Format::Parquet)]
            .iter()
            .any(|name| files.iter().any(|file| file == name))
        {
            let folder = quoted(&options.out.to_string_lossy());
            let _ = writeln!(text, "A page of them:\n  standstill report {folder}");
        }
        Report { text, code }
    }
}

/// Why rows are no longer written.
enum Stopped {
    Interrupted,
    Failed(Error),
}

impl From<JournalError> for Stopped {
    fn from(error: JournalError) -> Self {
        Self::Failed(error.into())
    }
}
