//! `standstill report A B`: two finished runs side by side.
//!
//! A trial's angle, drive and sensors follow from the seed and its number alone. Where two runs share the seed, they are
//! compared trial by trial: what the random numbers do to both alike makes no difference.

mod difference;
mod row;
mod shown;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use standstill_campaign::Summary;
use standstill_report::page::Tone;
use standstill_report::table::{Column, Kind, Value};
use toml::Value as Toml;

use self::difference::{Rates, independent, paired_rms};
use self::row::{RMS, Row};
use self::shown::{figure, page};
use super::Run;
use super::page::NOTHING;
use super::study::setting;
use super::verdict::range;
use crate::Report as Said;
use crate::columns;
use crate::commands::reproduce::file_list;
use crate::commands::require::shown as shown_value;
use crate::error::Error;
use crate::output::Output;
use crate::summary::{GOOD, right};
use crate::table::{self, Table};
use crate::terminal::paragraph;
use crate::units::Shown;

const FILES: [&str; 4] = ["comparison.csv", "comparison.html", "comparison.svg", "comparison.png"];

/// A trial as far as it is compared.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Trial {
    start_deg: f64,
    /// Of the axis.
    error_deg: Option<f64>,
    /// Wrong pole, undetermined, no angle at all.
    cases: [bool; 3],
}

const CASES: [&str; 3] = ["wrong poles", "undetermined", "failed"];

/// Both runs.
struct Two<'a> {
    runs: [&'a Run; 2],
    /// Names of the points that they share, with the summaries of each.
    points: Vec<(String, [&'a Summary; 2])>,
    /// Trials of each point of each run; none where they cannot be compared one by one, and why.
    trials: Result<[Vec<Vec<Trial>>; 2], String>,
}

/// Compares two finished runs; the files go to `out`.
pub fn run(folders: [&Path; 2], out: &Path) -> Result<Said, Error> {
    let runs = [Run::open(folders[0])?, Run::open(folders[1])?];
    let two = Two::of([&runs[0], &runs[1]])?;
    let (rows, settings) = (two.rows(), two.settings());
    let names = folders.map(|folder| folder.display().to_string());
    let about: Vec<String> = names
        .iter()
        .zip(&runs)
        .zip(["A", "B"])
        .map(|((name, run), letter)| format!("{letter}: {name} ({})", setting(&run.file)))
        .collect();
    let notes = two.notes();
    let table = Table::new([
        table::Column::prose(""),
        table::Column::prose(""),
        table::Column::number("A"),
        table::Column::number("B"),
        table::Column::number("B less A"),
        table::Column::word(""),
    ])
    .headed()
    .rows(rows.iter().map(Row::cells))
    .text();
    let differ =
        Table::new([table::Column::prose("setting"), table::Column::prose("A"), table::Column::prose("B")])
            .rows(settings.iter().map(|row| row.to_vec()))
            .text();
    let (tone, headline) = headline(&rows, &two.points);
    let figure = figure(&rows, &two.points, &names);
    let mut text = about.iter().map(|line| paragraph("", line)).collect::<String>();
    let _ = write!(text, "\n{}", paragraph("", &headline));
    for note in &notes {
        text += &paragraph("  ", note);
    }
    let _ = write!(text, "\n{table}");
    if settings.is_empty() {
        text += "\nNo setting differs.\n";
    } else {
        let about = "Settings that differ (– is what the error set, or what suits the motor, makes of it)";
        let _ = write!(text, "\n{}{differ}", paragraph("", about));
    }
    let mut output = Output::create(out, &FILES)?;
    let csv = columns::csv(&rows).map_err(|error| Error::Write(out.join(FILES[0]), error))?;
    output.file(FILES[0], &csv)?;
    let html = page(&about, (tone, headline), notes, &rows, settings, &figure).html().map_err(Error::Page)?;
    output.file(FILES[1], html.as_bytes())?;
    output.file(FILES[2], figure.svg()?.as_bytes())?;
    output.file(FILES[3], &figure.png()?)?;
    let _ = write!(text, "\n{}", file_list(out, &output.finish()?));
    Ok(Said { text, code: 0 })
}

impl<'a> Two<'a> {
    fn of(runs: [&'a Run; 2]) -> Result<Self, Error> {
        let [a, b] = runs.map(|run| &run.summary);
        let points = if a.points.is_empty() && b.points.is_empty() {
            vec![("all starts".to_owned(), [&a.summary, &b.summary])]
        } else if a.points.len() == b.points.len()
            && a.points.iter().zip(&b.points).all(|(a, b)| a.values == b.values)
        {
            let shown = Shown::of(&a.points);
            let name = |point: &super::super::run::results::PointSummary| {
                let each = shown.iter().zip(point.values.values());
                each.map(|(axis, value)| {
                    format!("{} = {} {}", axis.key, axis.text(value), axis.scale.unit).trim_end().to_owned()
                })
                .collect::<Vec<_>>()
                .join(", ")
            };
            a.points.iter().zip(&b.points).map(|(a, b)| (name(a), [&a.summary, &b.summary])).collect()
        } else {
            return Err(Error::Results {
                path: runs[1].folder.clone(),
                found: "axes with other points".to_owned(),
                needed: format!(
                    "a run with the points of {}, or two runs without axes",
                    runs[0].folder.display()
                ),
            });
        };
        let trials = Self::trials(runs);
        Ok(Self { runs, points, trials })
    }

    /// The trials of both, if they can be compared one by one.
    fn trials(runs: [&Run; 2]) -> Result<[Vec<Vec<Trial>>; 2], String> {
        let [a, b] = runs.map(|run| &run.summary.run);
        if a.seed != b.seed {
            return Err(format!("their seeds are {} and {}", a.seed, b.seed));
        }
        let read = |run: &Run| trials(run).map_err(|error| error.to_string());
        let both = [read(runs[0])?, read(runs[1])?];
        let [a, b] = &both;
        let same =
            |(a, b): (&Vec<Trial>, &Vec<Trial>)| a.iter().zip(b).all(|(a, b)| a.start_deg == b.start_deg);
        if !a.iter().zip(b).all(same) {
            return Err("their trials of one number start at other angles".to_owned());
        }
        Ok(both)
    }

    /// All measures at all points.
    fn rows(&self) -> Vec<Row> {
        let mut rows = Vec::new();
        for (number, (point, summaries)) in self.points.iter().enumerate() {
            let pairs: Option<Vec<(Trial, Trial)>> = self.trials.as_ref().ok().and_then(|[a, b]| {
                Some(a.get(number)?.iter().copied().zip(b.get(number)?.iter().copied()).collect())
            });
            let rms = summaries.map(|summary| summary.rms_deg);
            let errors = |pairs: &Vec<(Trial, Trial)>| -> Vec<(f64, f64)> {
                pairs.iter().filter_map(|(a, b)| Some((a.error_deg?, b.error_deg?))).collect()
            };
            let both = pairs.as_ref().map(errors).filter(|both| both.len() > 1);
            let apart = both.as_ref().map_or_else(|| independent(rms), |both| paired_rms(both));
            rows.push(Row::new(point, RMS, rms, apart, both.map(|both| both.len() as u64)));
            for (case, name) in CASES.into_iter().enumerate() {
                let of = |s: &Summary| match case {
                    0 => s.wrong_pole_probability,
                    1 => s.undetermined_probability,
                    _ => s.failed_probability,
                };
                // Of a run that named no pole, nothing is known of wrong ones.
                let asked = summaries.map(|s| case > 0 || s.found > 0);
                let mut rates = summaries.map(of);
                for (rate, asked) in rates.iter_mut().zip(asked) {
                    *rate = if asked { *rate } else { NOTHING };
                }
                let usable = pairs.as_ref().filter(|pairs| !pairs.is_empty() && asked == [true; 2]);
                let counted = usable.map(|pairs| Rates {
                    only_a: pairs.iter().filter(|(a, b)| a.cases[case] && !b.cases[case]).count() as u64,
                    only_b: pairs.iter().filter(|(a, b)| !a.cases[case] && b.cases[case]).count() as u64,
                    pairs: pairs.len() as u64,
                });
                let apart = counted.map_or_else(|| independent(rates), Rates::difference);
                rows.push(Row::new(point, name, rates, apart, counted.map(|rates| rates.pairs)));
            }
        }
        rows
    }

    /// What else there is to say.
    fn notes(&self) -> Vec<String> {
        let mut notes = vec![match &self.trials {
            Ok([a, b]) => {
                let pairs: usize = a.iter().zip(b).map(|(a, b)| a.len().min(b.len())).sum();
                format!(
                    "[95 % interval]; differences trial by trial over the same random numbers, {pairs} pairs"
                )
            }
            Err(why) => format!("[95 % interval]; differences of independent runs: {why}"),
        }];
        let [a, b] = self.runs.map(|run| &run.summary.run);
        if a.version != b.version || a.numerics != b.numerics {
            notes.push(format!(
                "computed by different programs: version {} with numerics {}, and version {} with numerics {}",
                a.version, a.numerics, b.version, b.numerics
            ));
        }
        if a.files != b.files {
            notes.push("files that the scenarios read differ".to_owned());
        }
        notes
    }

    /// Keys of the scenarios whose values differ: key, A, B.
    fn settings(&self) -> Vec<[String; 3]> {
        let [a, b] = self.runs.map(|run| {
            let table: toml::Table = toml::from_str(&run.summary.run.scenario).unwrap_or_default();
            let mut keys = BTreeMap::new();
            flatten("", &Toml::Table(table), &mut keys);
            keys
        });
        let all: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
        let of = |keys: &BTreeMap<String, String>, key: &String| {
            keys.get(key).cloned().unwrap_or_else(|| "–".to_owned())
        };
        all.into_iter()
            .filter(|key| a.get(*key) != b.get(*key))
            .map(|key| [key.clone(), of(&a, key), of(&b, key)])
            .collect()
    }
}

/// Values by their keys, those of tables within tables too.
fn flatten(before: &str, value: &Toml, into: &mut BTreeMap<String, String>) {
    match value {
        Toml::Table(table) => {
            for (key, value) in table {
                let key = if before.is_empty() { key.clone() } else { format!("{before}.{key}") };
                flatten(&key, value, into);
            }
        }
        Toml::String(text) => {
            into.insert(before.to_owned(), text.clone());
        }
        Toml::Float(number) => {
            into.insert(before.to_owned(), shown_value(before, *number));
        }
        value => {
            into.insert(before.to_owned(), value.to_string());
        }
    }
}

/// All trials of a run, point by point.
fn trials(run: &Run) -> Result<Vec<Vec<Trial>>, Error> {
    let columns = [
        ("trial", Kind::Whole),
        ("start_angle_deg", Kind::Number),
        ("axis_error_deg", Kind::Number),
        ("outcome", Kind::Text),
        ("pole_correct", Kind::Flag),
    ]
    .map(|(name, kind)| Column::new(name, kind));
    let (reader, []) = run.columns([])?;
    let mut points: Vec<Vec<Trial>> = Vec::new();
    let number = |value: &Value<'_>| if let Value::Number(number) = value { Some(*number) } else { None };
    let read = reader.values(&columns, |row| {
        // Each point begins with trial 0.
        if points.is_empty() || row[0] == Value::Whole(0) {
            points.push(Vec::new());
        }
        let outcome = if let Value::Text(outcome) = &row[3] { outcome.as_ref() } else { "" };
        let trial = Trial {
            start_deg: number(&row[1]).unwrap_or(f64::NAN),
            error_deg: number(&row[2]),
            cases: [row[4] == Value::Flag(false), outcome == "undetermined", outcome == "failed"],
        };
        if let Some(point) = points.last_mut() {
            point.push(trial);
        }
    });
    read.map_err(Error::Table)?;
    Ok(points)
}

/// What is different, in a line; first how many starts were answered rightly, where that is not nearly all.
fn headline(rows: &[Row], points: &[(String, [&Summary; 2])]) -> (Tone, String) {
    let apart = difference(rows, points.len());
    let shares = |run: usize| points.iter().map(move |(_, both)| right(both[run]));
    if shares(0).chain(shares(1)).all(|share| share >= GOOD) {
        return (Tone::Neutral, apart);
    }
    let by = if points.len() > 1 { ", by point" } else { "" };
    let [a, b] = [0, 1].map(|run| range(shares(run)).unwrap_or_else(|| "–".to_owned()));
    (Tone::Warning, format!("Answered rightly: {a} at A, {b} at B{by}; {apart}"))
}

fn difference(rows: &[Row], points: usize) -> String {
    let rms: Vec<&Row> = rows.iter().filter(|row| row.is_rms()).collect();
    if let [one] = rms[..] {
        if one.a.is_nan() || one.b.is_nan() {
            let said = |rms: f64| if rms.is_nan() { "no axis".to_owned() } else { format!("rms {rms:.3}°") };
            return format!("{} at A, {} at B", said(one.a), said(one.b));
        }
        return format!(
            "{}: rms {:.3}° at A, {:.3}° at B, {:+.3}° [{:+.3}, {:+.3}]",
            one.verdict(),
            one.a,
            one.b,
            one.difference,
            one.difference_low,
            one.difference_high
        );
    }
    let count = |verdict: &str| rms.iter().filter(|row| row.verdict() == verdict).count();
    format!(
        "rms of B is surely smaller at {} of {points} points, larger at {}",
        count("B is better"),
        count("B is worse")
    )
}
