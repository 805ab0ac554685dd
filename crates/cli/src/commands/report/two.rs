//! `standstill report A B`: two finished runs side by side.
//!
//! A trial's angle, drive and sensors follow from the seed and its number alone. Where two runs share the seed, they are
//! compared trial by trial, over the trials that both have: what the random numbers do to both alike makes no difference.

mod difference;
mod row;
mod shown;
mod trials;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use standstill_campaign::Summary;
use standstill_report::page::Tone;
use toml::Value as Toml;

use self::difference::{Rates, independent, paired_rms};
use self::row::{RMS, Row};
use self::shown::{figure, page};
use self::trials::{Trial, of_run, summary};
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
use crate::summary::{GOOD, right, sure_decimals};
use crate::table::{self, Table};
use crate::terminal::paragraph;
use crate::units::Shown;

const FILES: [&str; 4] = ["comparison.csv", "comparison.html", "comparison.svg", "comparison.png"];

const CASES: [&str; 3] = ["wrong poles", "undetermined", "failed"];

/// Both runs.
struct Two<'a> {
    runs: [&'a Run; 2],
    /// Names of the points that they share, with the summaries of what is compared of each.
    points: Vec<(String, [Summary; 2])>,
    /// How many trials each has of each point.
    counts: Vec<[u64; 2]>,
    /// Trials of each point of each run, those that both have; none where they cannot be compared one by one, and why.
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
        table::Column::number("A").bracket(1),
        table::Column::number("B").bracket(1),
        table::Column::number("B less A"),
        table::Column::word(""),
    ])
    .headed()
    .rows(rows.iter().enumerate().map(|(k, row)| {
        let mut cells = row.cells();
        // A point is named where another one begins.
        if k.checked_sub(1).is_some_and(|before| rows[before].point == row.point) {
            cells[0].clear();
        }
        cells
    }))
    .text();
    let differ =
        Table::new([table::Column::prose("setting"), table::Column::prose("A"), table::Column::prose("B")])
            .rows(settings.iter().map(|row| row.to_vec()))
            .text();
    let (tone, headline) = headline(&rows, &two.points);
    let figure = figure(&rows, &two.points, &names, &two.conditions());
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
        let mut points = if a.points.is_empty() && b.points.is_empty() {
            vec![("all starts".to_owned(), [a.summary.clone(), b.summary.clone()])]
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
            let both = a.points.iter().zip(&b.points);
            both.map(|(a, b)| (name(a), [a.summary.clone(), b.summary.clone()])).collect()
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
        let counts: Vec<[u64; 2]> =
            points.iter().map(|(_, both)| [0, 1].map(|run| both[run].trials)).collect();
        let mut trials = Self::trials(runs);
        if let Ok([a, b]) = &mut trials {
            // The figures beside a difference are those of the trials that it is of.
            for (((_, both), a), b) in points.iter_mut().zip(a).zip(b) {
                let common = a.len().min(b.len());
                for (own, all) in both.iter_mut().zip([a, b]) {
                    if all.len() > common {
                        all.truncate(common);
                        *own = summary(all, own.limit_deg);
                    }
                }
            }
        }
        Ok(Self { runs, points, counts, trials })
    }

    /// What both were made under, in a line.
    fn conditions(&self) -> String {
        let [a, b] = self.runs.map(|run| setting(&run.file));
        if a == b { a } else { format!("A: {a}; B: {b}") }
    }

    /// The trials of both, if they can be compared one by one.
    fn trials(runs: [&Run; 2]) -> Result<[Vec<Vec<Trial>>; 2], String> {
        let [a, b] = runs.map(|run| &run.summary.run);
        if a.seed != b.seed {
            return Err(format!("their seeds are {} and {}", a.seed, b.seed));
        }
        let read = |run: &Run| of_run(run).map_err(|error| error.to_string());
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
            rows.push(Row::trials(
                point,
                self.counts[number],
                pairs.as_ref().map(|pairs| pairs.len() as u64),
            ));
            let rms = [&summaries[0], &summaries[1]].map(|summary| summary.rms_deg);
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
                let summaries = [&summaries[0], &summaries[1]];
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
                    "[95 % interval]; paired: differences trial by trial over the same random numbers, {pairs} pairs"
                )
            }
            Err(why) => format!("[95 % interval]; unpaired: differences of independent runs: {why}"),
        }];
        let unlike = self.counts.iter().filter(|[a, b]| a != b).count();
        if unlike > 0 {
            let of = match &self.counts[..] {
                [[a, b]] => format!("A has {a} trials, B {b}"),
                all => format!("A and B have other numbers of trials at {unlike} of {} points", all.len()),
            };
            notes.push(if self.trials.is_ok() {
                format!("{of}: every figure is of the trials that both have, by seed and number")
            } else {
                format!("{of}: each figure is of its own run's")
            });
        }
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

/// What is different, in a line; first how many starts were answered rightly, where that is not nearly all.
fn headline(rows: &[Row], points: &[(String, [Summary; 2])]) -> (Tone, String) {
    let apart = difference(rows, points.len());
    let shares = |run: usize| points.iter().map(move |(_, both)| (right(&both[run]), both[run].trials));
    if shares(0).chain(shares(1)).all(|(share, _)| share >= GOOD) {
        return (Tone::Neutral, apart);
    }
    let by = if points.len() > 1 { ", by point" } else { "" };
    let [a, b] = [0, 1].map(|run| range(shares(run)).unwrap_or_else(|| "–".to_owned()));
    (Tone::Warning, format!("Answered rightly: {a} at A, {b} at B{by}; {apart}"))
}

fn difference(rows: &[Row], points: usize) -> String {
    let rms: Vec<&Row> = rows.iter().filter(|row| row.is_rms()).collect();
    if let [one] = rms[..] {
        let cells = one.cells();
        let value = |of: usize| cells[2 + of].split(" [").next().unwrap_or_default().to_owned();
        if one.a.is_nan() || one.b.is_nan() {
            let said = |of: usize| match value(of) {
                none if none == "–" => "no axis".to_owned(),
                value => format!("rms {value}°"),
            };
            return format!("{} at A, {} at B", said(0), said(1));
        }
        let [a, b] = [value(0), value(1)];
        let apart = [one.difference, one.difference_low, one.difference_high];
        let decimals = sure_decimals(apart);
        let [value, low, high] = apart.map(|x| format!("{x:+.decimals$}"));
        return format!("{}: rms {a}° at A, {b}° at B, {value}° [{low}, {high}]", one.verdict());
    }
    let count = |verdict: &str| rms.iter().filter(|row| row.verdict() == verdict).count();
    format!(
        "rms of B is surely smaller at {} of {points} points, larger at {}",
        count("B is better"),
        count("B is worse")
    )
}
