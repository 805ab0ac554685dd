//! The files of a finished run: `trials.csv` or `trials.parquet`, and `summary.json`.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use standstill_campaign::Statistics;
use standstill_campaign::store::{Identity, JournalError, Row, Shards};
use standstill_quantity::Quantity;
use standstill_scenario::{Document, Point};
use standstill_table::{Cell, Column, Columns, Format, TableError, Writer};

use crate::arguments::{Results as Options, Rows, Run};
use crate::columns::{AxisColumn, si, trial_columns, trial_values};
use crate::error::Error;
use crate::results::{
    Begun, PointSummary, STATISTICS, SUMMARY, SummaryFile, Tables, files_wanted, trials_name,
};
use crate::shell::command_line::quoted;
use crate::shell::output::{Output, file_list};
use crate::shell::terminal::paragraph;
use crate::shell::{Report, host, progress};
use crate::{answer, results, summary};

/// Returns the names of the files that a run with these options writes.
pub fn names(options: &Run) -> Vec<&'static str> {
    let trials = (options.rows == Rows::All).then(|| trials_name(options.results.format));
    trials.into_iter().chain([SUMMARY]).filter(|_| files_wanted()).collect()
}

/// The files of a run that were written, and its summary.
pub struct Results {
    summary: SummaryFile,
    pub json: String,
    files: Vec<String>,
}

/// Key of the width of a detector's sectors. With the default 0, answers are angles instead of sectors.
const SECTOR: &str = "detector.sector";

/// Statistics of all sweep points. Rows are added point by point.
pub struct Points {
    axes: Vec<AxisColumn>,
    coordinates: Vec<Point>,
    /// True if answers are sectors at any point.
    in_sectors: bool,
    limit: f64,
    /// Statistics of a run without axes.
    all: Statistics,
    current: Option<(usize, Statistics)>,
    done: Vec<PointSummary>,
}

impl Points {
    /// Makes empty statistics of a run.
    pub fn of(identity: &Identity) -> Result<Self, Error> {
        let document = Document::parse(Path::new("scenario"), &identity.scenario)?;
        let file = document.load()?;
        let coordinates = file.points()?;
        let of_axes = coordinates.iter().flat_map(|point| &point.values);
        let widths = of_axes.filter(|(key, _)| key == SECTOR).map(|(_, width)| width);
        let in_sectors = widths.chain(document.get(SECTOR)).filter_map(si).any(|width| width > 0.0);
        let limit = file.limit.map_or(Statistics::LIMIT_DEG, Quantity::value);
        Ok(Self {
            axes: AxisColumn::of(&coordinates),
            coordinates,
            in_sectors,
            limit,
            all: Statistics::with_limit(limit),
            current: None,
            done: Vec::new(),
        })
    }

    /// Returns the columns of the table of trials.
    pub fn columns(&self) -> impl Iterator<Item = Column> {
        self.axes.iter().map(|AxisColumn(column)| column.clone()).chain(trial_columns(self.in_sectors))
    }

    /// Returns the cells of a row, in the order of `columns`. `point` is the index of the row's sweep point.
    pub fn cells<'r>(&self, point: usize, row: &'r Row) -> Vec<Cell<'r>> {
        let values = self.axes.iter().zip(&self.coordinates[point].values);
        let axes = values.map(|(axis, (_, value))| axis.value(value));
        axes.chain(trial_values(row, self.in_sectors)).collect()
    }

    /// Adds a row to the statistics of a sweep point. All rows of one point must be added before the rows of the next point.
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

    /// Completes the statistics of the last sweep point. Call this function after the last row.
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
    /// Writes the files of a run from its complete journals. Returns none if interrupted.
    pub fn write(options: &Options, shards: &Shards, stop: &AtomicBool) -> Result<Option<Self>, Error> {
        let identity = &shards.identity;
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
        let format = options.format;
        let name = trials_name(format);
        let path = options.out.join(name);
        let failed = |error: TableError| Error::table(&path, error);
        let columns: Vec<Column> = points.columns().collect();
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
            let cells = points.cells(point, row);
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

    /// Writes the summary and moves it into place, together with the table of trials if one was written.
    pub fn finish(
        options: &Options,
        output: Option<Output>,
        identity: &Identity,
        points: Points,
        format: Option<Format>,
    ) -> Result<Self, Error> {
        let whole = points.axes.is_empty().then(|| points.all.summary());
        let tables = output.as_ref().map(|output| Tables::of(output, format.map(trials_name))).transpose()?;
        let run = identity.clone();
        let mut summary = SummaryFile { run, summary: whole, points: points.done, tables, digest: None };
        let json = summary.sealed().map_err(|error| Error::Write(options.out.join(SUMMARY), error.into()))?;
        let Some(mut output) = output else { return Ok(Self { summary, json, files: Vec::new() }) };
        output.file(SUMMARY, json.as_bytes())?;
        let other = SummaryFile::read(&options.out).map_or(true, |old| old.run != *identity);
        let mut files = output.finish()?;
        if other {
            files.extend(results::mark(&options.out)?);
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

    /// Returns in words the number of starts without an answer and the most frequent reason. Returns none for a sweep, and if at most 1 %
    /// of the starts have no answer.
    fn unanswered(&self) -> Option<String> {
        let all = self.summary.summary.as_ref()?;
        let without = all.undetermined + all.failed;
        if without * 100 <= all.trials {
            return None;
        }
        let (reason, most) = all.reasons.iter().max_by_key(|(_, of)| of.count)?;
        let most = if most.count == without { String::new() } else { format!(" in {}", most.count) };
        Some(format!("{without} of {} starts have no answer ({reason}{most}).", all.trials))
    }

    /// Returns the report as text or as JSON. `begun`: how the command line named the scenario, for the commands that go on.
    pub fn report(self, options: &Options, begun: Option<&Begun>) -> Report {
        let unanswered = self.unanswered();
        let Self { summary: file, json, files } = self;
        let code = u8::from(file.errors() > 0);
        if options.json {
            return Report { text: json, code };
        }
        let run = &file.run;
        let notes = [
            ("Poles", &run.pole_note),
            ("Map", &run.map_note),
            ("Motor", &run.motor_note),
            ("Library", &run.library_note),
        ];
        let notes = notes.into_iter().filter_map(|(of, note)| Some(format!("{of}: {}.", note.as_ref()?)));
        let mut text = answer::sections(&summary::sections(&file));
        for note in file.unreached().into_iter().chain(notes) {
            text += "\n";
            text += &paragraph("", &note);
        }
        text += "\n";
        text += &file_list(&options.out, &files);
        let has_rows = [trials_name(Format::Csv), trials_name(Format::Parquet)]
            .iter()
            .any(|name| files.iter().any(|file| file == name));
        let folder = quoted(&options.out.to_string_lossy());
        if has_rows {
            let _ = writeln!(text, "A page of them:\n  standstill report {folder}");
        }
        match (unanswered, begun.and_then(|begun| begun.check.as_deref())) {
            (None, _) if !has_rows && file.whole().is_some() => {
                if let Some(Begun { line, .. }) = begun {
                    let _ = writeln!(
                        text,
                        "\nWhich errors of drive and sensors make the error:\n  standstill budget {line}"
                    );
                }
            }
            (Some(said), Some(check)) => {
                text += &paragraph("", &format!("{said} Whether other settings answer:"));
                let _ = writeln!(text, "  {check}");
            }
            (Some(said), None) if has_rows => {
                text += &paragraph("", &format!("{said} Why:"));
                let _ = writeln!(text, "  standstill explain {folder} --unanswered");
            }
            _ => {}
        }
        if let Some(said) = file.wrong_poles().filter(|_| has_rows) {
            text += &paragraph("", &format!("{said} Why:"));
            let _ = writeln!(text, "  standstill explain {folder} --wrong-poles");
        }
        Report { text, code }
    }
}

/// Reason why writing rows ended early.
enum Stopped {
    Interrupted,
    Failed(Error),
}

impl From<JournalError> for Stopped {
    fn from(error: JournalError) -> Self {
        Self::Failed(error.into())
    }
}
