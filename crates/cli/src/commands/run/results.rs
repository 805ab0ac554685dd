//! The files of a finished run: `trials.csv` or `trials.parquet`, and `summary.json`.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use standstill_campaign::store::{Identity, JournalError, Shards};
use standstill_campaign::{Estimate, Statistics, Summary};
use standstill_quantity::Quantity;
use standstill_report::table::{Column, Format, TableError, Writer};
use standstill_scenario::{Document, Point, StopTable};

use crate::Report;
use crate::arguments::{FormatName, Results as Options};
use crate::columns::{AxisColumn, trial_columns, trial_values};
use crate::commands::reproduce::file_list;
use crate::error::Error;
use crate::output::Output;
use crate::summary::{self, share};
use crate::text::wide_table;
use crate::units::Shown;
use crate::{progress, summary::interval};

/// Name of the file of summaries.
pub const SUMMARY: &str = "summary.json";

/// Points that are printed; of more, only the best and the worst.
const MOST_LINES: usize = 30;

/// Content of `summary.json`.
#[derive(Debug, Serialize, Deserialize)]
pub struct SummaryFile {
    /// What was run.
    pub run: Identity,
    /// All trials together.
    pub summary: Summary,
    /// Each point of the axes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<PointSummary>,
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
        let text = std::fs::read_to_string(&path).map_err(|error| Error::Read(path.clone(), error))?;
        serde_json::from_str(&text).map_err(|error| Error::Results {
            path,
            found: error.to_string(),
            needed: "the summary of a run, as `standstill run` writes it".to_owned(),
        })
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
        let all: Vec<&Summary> = match &self.points[..] {
            [] => vec![&self.summary],
            points => points.iter().map(|point| &point.summary).collect(),
        };
        let missed = all.iter().filter(|s| !met(s)).count();
        let of = if all.len() == 1 { String::new() } else { format!(" at {missed} of {} points", all.len()) };
        (missed > 0).then(|| {
            format!(
                "stop_at was not reached{of} in {} trials: the intervals are wider than was asked for",
                self.run.trials
            )
        })
    }
}

/// Names of the files.
pub fn names(format: FormatName) -> [&'static str; 2] {
    [trials_name(format.into()), SUMMARY]
}

/// Name of the file of trials.
pub const fn trials_name(format: Format) -> &'static str {
    match format {
        Format::Csv => "trials.csv",
        Format::Parquet => "trials.parquet",
    }
}

/// Files that are in place.
pub struct Results {
    summary: SummaryFile,
    json: String,
    files: Vec<String>,
}

/// Statistics of the points, one after the other.
struct Points {
    axes: Vec<AxisColumn>,
    coordinates: Vec<Point>,
    limit: f64,
    current: Option<(usize, Statistics)>,
    done: Vec<PointSummary>,
}

impl Points {
    fn add(&mut self, point: usize, row: &standstill_campaign::store::Row) {
        if self.current.as_ref().is_none_or(|(current, _)| *current != point) {
            self.close();
            self.current = Some((point, Statistics::with_limit(self.limit)));
        }
        if let Some((_, statistics)) = &mut self.current {
            statistics.add_row(row);
        }
    }

    fn close(&mut self) {
        if let Some((point, statistics)) = self.current.take() {
            let values = &self.coordinates[point].values;
            let values =
                self.axes.iter().zip(values).map(|(axis, (key, value))| (key.clone(), axis.json(value)));
            self.done.push(PointSummary { values: values.collect(), summary: statistics.summary() });
        }
    }
}

impl Results {
    /// Writes the files of a run whose journals are complete; none if interrupted.
    pub fn write(options: &Options, shards: &Shards, stop: &AtomicBool) -> Result<Option<Self>, Error> {
        let identity = shards.identity();
        let file = Document::parse(Path::new("scenario"), &identity.scenario)?.load()?;
        let coordinates = file.points()?;
        let axes = AxisColumn::of(&coordinates);
        let limit = file.limit.map_or(Statistics::LIMIT_DEG, Quantity::value);
        let format = Format::from(options.format);
        let name = trials_name(format);
        let path = options.out.join(name);
        let mut output = Output::create(&options.out, &names(options.format))?;
        let columns: Vec<Column> =
            axes.iter().map(|axis| axis.column.clone()).chain(trial_columns()).collect();
        let failed = |error: TableError| Error::table(&path, error);
        let mut trials =
            Writer::new(output.begin(name)?, format, columns, &identity.metadata()).map_err(failed)?;
        let mut all = Statistics::with_limit(limit).of_points(identity.points);
        let mut points = Points { axes, coordinates, limit, current: None, done: Vec::new() };
        let bar = progress::writing(identity.rows());
        let written = shards.rows(|point, row| {
            if stop.load(Ordering::Relaxed) {
                return Err(Stopped::Interrupted);
            }
            let values = &points.coordinates[point].values;
            let mut cells: Vec<_> =
                points.axes.iter().zip(values).map(|(axis, (_, value))| axis.value(value)).collect();
            cells.extend(trial_values(row));
            trials.row(&cells).map_err(|error| Stopped::Failed(failed(error)))?;
            all.add_row(row);
            if !points.axes.is_empty() {
                points.add(point, row);
            }
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
        output.close(name, trials.finish().map_err(failed)?)?;
        let summary = SummaryFile { run: identity.clone(), summary: all.summary(), points: points.done };
        let json = serde_json::to_string_pretty(&summary)
            .map_err(|error| Error::Write(options.out.join(SUMMARY), error.into()))?
            + "\n";
        output.file(SUMMARY, json.as_bytes())?;
        let files = output.finish()?;
        // An earlier run's trials in the other format would be beside this run's summary.
        let other = [Format::Csv, Format::Parquet].into_iter().find(|other| *other != format);
        if let Some(other) = other {
            let _ = std::fs::remove_file(options.out.join(trials_name(other)));
        }
        Ok(Some(Self { summary, json, files }))
    }

    /// What there is to say.
    pub fn report(self, options: &Options) -> Report {
        let Self { summary: file, json, files } = self;
        let code = u8::from(file.summary.errors > 0);
        if options.json {
            return Report { text: json, code };
        }
        let mut text = String::new();
        if file.points.is_empty() {
            text += &summary::text(&file.summary);
        } else {
            text += &points_text(&file.points);
        }
        if let Some(note) = file.unreached() {
            let _ = write!(text, "\n{note}\n");
        }
        text += "\n";
        text += &file_list(&options.out, &files);
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

/// A line each; of many points, the best and the worst.
fn points_text(points: &[PointSummary]) -> String {
    let mut order: Vec<&PointSummary> = points.iter().collect();
    let mut heading = format!("{} points, [95 % intervals]\n\n", points.len());
    if points.len() > MOST_LINES {
        order.sort_by(|a, b| summary::rank(&a.summary, &b.summary));
        order.drain(MOST_LINES / 2..points.len() - MOST_LINES / 2);
        heading = format!(
            "{} points: the best {} and the worst {}, by the share of starts answered rightly, then by the rms error, [95 % \
             intervals]\n\n",
            points.len(),
            MOST_LINES / 2,
            MOST_LINES / 2
        );
    }
    let shown = Shown::of(points);
    let titles: Vec<String> = shown.iter().map(Shown::title).collect();
    let results = ["trials", "right %", "rms °", "p95 °", "wrong poles", "undetermined", "failed"];
    let header: Vec<&str> = titles.iter().map(String::as_str).chain(results).collect();
    let rows = order.iter().map(|point| {
        let s = &point.summary;
        let values = shown.iter().zip(point.values.values()).map(|(axis, value)| axis.text(value));
        values
            .chain([
                s.trials.to_string(),
                format!("{:.2}", 100.0 * summary::right(s)),
                interval(&s.rms_deg, 1.0, 3),
                summary::number(s.p95_deg.value, 3),
                share(s.wrong_poles, &s.wrong_pole_probability),
                share(s.undetermined, &s.undetermined_probability),
                share(s.failed, &s.failed_probability),
            ])
            .collect()
    });
    heading + &wide_table(&header, rows)
}
