//! `standstill report A B`: two finished runs side by side.
//!
//! A trial's angle, drive and sensors follow from the seed and its number alone. Where two runs share the seed, they are compared
//! trial by trial: at the points that both have, over the trials that both have, and errors where both found an axis. What the random
//! numbers do to both alike makes no difference.

mod difference;
mod judged;
mod row;
mod settings;
mod shown;
mod trials;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde_json::json;
use standstill_campaign::{Estimate, Summary};

use self::difference::{Rates, independent, paired_percentile, paired_rms};
use self::judged::headline;
use self::row::{P95, RMS, Row};
use self::settings::settings;
use self::shown::{figure, page};
use self::trials::{Trial, of_run, summary};

use crate::arguments::Report;
use crate::shell::asked::Asked;
use crate::columns;
use crate::error::Error;
use crate::results::PointSummary;
use crate::results::Run;
use crate::shell::Report as Said;
use crate::shell::output::Output;
use crate::shell::output::file_list;
use crate::shell::setup::setting;
use crate::shell::table::{self, Table};
use crate::shell::terminal::paragraph;
use crate::shell::values::Shown;

const FILES: [&str; 5] =
    ["comparison.csv", "comparison.json", "comparison.html", "comparison.svg", "comparison.png"];

const CASES: [&str; 3] = ["wrong poles", "undetermined", "failed"];

/// Both runs.
struct Two<'a> {
    runs: [&'a Run; 2],
    points: Vec<Common>,
    /// Why their trials cannot be compared one by one, if they cannot.
    unpaired: Option<String>,
}

/// A point that both have.
struct Common {
    name: String,
    /// Its place in each run.
    places: [usize; 2],
    /// How many trials each has.
    counts: [u64; 2],
    /// Of the trials that are compared.
    summaries: [Summary; 2],
    /// The trials that both have, if they are compared one by one.
    pairs: Option<Vec<(Trial, Trial)>>,
}

/// Compares two finished runs; the files go to `out`.
pub fn run(options: &Report, second: &Path, out: Option<(PathBuf, Asked)>) -> Result<Said, Error> {
    let folders = [options.folder.as_path(), second];
    let runs = [Run::open(folders[0])?, Run::open(folders[1])?];
    let output = match out {
        Some((out, asked)) => Some((Output::answering(asked, &out, &FILES)?, out)),
        None => None,
    };
    let two = Two::of([&runs[0], &runs[1]])?;
    let (rows, settings) = (two.rows(), settings(two.runs));
    let names = folders.map(|folder| folder.display().to_string());
    let about: Vec<String> = names
        .iter()
        .zip(&runs)
        .zip(["A", "B"])
        .map(|((name, run), letter)| format!("{letter}: {name} ({})", setting(&run.file)))
        .collect();
    let notes = two.notes();
    let (tone, headline) = headline(&rows, &two.points);
    let json = json!({
        "runs": names.iter().zip(&runs).map(|(name, run)| json!({ "folder": name, "run": run.summary.run })).collect::<Vec<_>>(),
        "headline": headline,
        "notes": notes,
        "rows": rows,
        "settings": settings.iter().map(|[key, a, b]| json!({ "key": key, "a": a, "b": b })).collect::<Vec<_>>(),
    });
    let json = format!("{json:#}\n");
    let mut text = text(&about, &headline, &notes, &rows, &settings);
    if let Some((mut output, out)) = output {
        let figure = figure(&rows, &two.points, &names, &two.conditions());
        let csv = columns::csv(&rows).map_err(|error| Error::Write(out.join(FILES[0]), error))?;
        output.file(FILES[0], &csv)?;
        output.file(FILES[1], json.as_bytes())?;
        let html =
            page(&about, (tone, headline), notes, &rows, settings, &figure).html().map_err(Error::Page)?;
        output.file(FILES[2], html.as_bytes())?;
        output.file(FILES[3], figure.svg()?.as_bytes())?;
        output.file(FILES[4], &figure.png()?)?;
        let _ = write!(text, "\n{}", file_list(&out, &output.finish()?));
    }
    Ok(Said { text: if options.json { json } else { text }, code: 0 })
}

/// For the terminal.
fn text(
    about: &[String],
    headline: &str,
    notes: &[String],
    rows: &[Row],
    settings: &[[String; 3]],
) -> String {
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
    let mut text = about.iter().map(|line| paragraph("", line)).collect::<String>();
    let _ = write!(text, "\n{}", paragraph("", headline));
    for note in notes {
        text += &paragraph("  ", note);
    }
    let _ = write!(text, "\n{table}");
    if settings.is_empty() {
        text += "\nNo setting differs.\n";
    } else {
        let about = "Settings that differ (– is what the error set, or what suits the motor, makes of it)";
        let differ = Table::new([
            table::Column::prose("setting"),
            table::Column::prose("A"),
            table::Column::prose("B"),
        ])
        .rows(settings.iter().map(|row| row.to_vec()))
        .text();
        let _ = write!(text, "\n{}{differ}", paragraph("", about));
    }
    text
}

/// The points that both runs have, by their places; of runs without axes the one there is. None: they have none in common.
fn common([a, b]: [&Run; 2]) -> Option<Vec<[usize; 2]>> {
    let [a, b] = [a, b].map(|run| &run.summary.points);
    if a.is_empty() && b.is_empty() {
        return Some(vec![[0, 0]]);
    }
    let place = |point: &PointSummary| b.iter().position(|other| other.values == point.values);
    let places: Vec<[usize; 2]> =
        a.iter().enumerate().filter_map(|(k, point)| Some([k, place(point)?])).collect();
    (!places.is_empty()).then_some(places)
}

impl<'a> Two<'a> {
    fn of(runs: [&'a Run; 2]) -> Result<Self, Error> {
        let Some(places) = common(runs) else {
            return Err(Error::Results {
                path: runs[1].folder.clone(),
                found: "axes with other points".to_owned(),
                needed: format!(
                    "a run that has points of {}, or two runs without axes",
                    runs[0].folder.display()
                ),
            });
        };
        let shown = Shown::of(&runs[0].summary.points);
        let name = |place: usize| match runs[0].summary.points.get(place) {
            None => "all starts".to_owned(),
            Some(point) => {
                let each = shown.iter().map(|axis| {
                    let value =
                        point.values.get(&axis.key).map_or_else(String::new, |value| axis.text(value));
                    format!("{} = {value} {}", axis.key, axis.scale.unit).trim_end().to_owned()
                });
                each.collect::<Vec<_>>().join(", ")
            }
        };
        let mut points: Vec<Common> = places
            .into_iter()
            .map(|places| {
                let of = |run: usize| runs[run].summary.each().nth(places[run]).expect("its place").clone();
                let summaries = [of(0), of(1)];
                let counts = summaries.each_ref().map(|summary| summary.trials);
                Common { name: name(places[0]), places, counts, summaries, pairs: None }
            })
            .collect();
        let unpaired = match Self::pairs(runs, &points) {
            Err(why) => Some(why),
            Ok(all) => {
                for (point, pairs) in points.iter_mut().zip(all) {
                    let limits = point.summaries.each_ref().map(|summary| summary.limit_deg);
                    point.summaries = [
                        summary(pairs.iter().map(|pair| &pair.0), limits[0]),
                        summary(pairs.iter().map(|pair| &pair.1), limits[1]),
                    ];
                    point.pairs = Some(pairs);
                }
                None
            }
        };
        Ok(Self { runs, points, unpaired })
    }

    /// What both were made under, and of which trials their errors are, in a line.
    fn conditions(&self) -> String {
        let [a, b] = self.runs.map(|run| setting(&run.file));
        let made = if a == b { a } else { format!("A: {a}; B: {b}") };
        std::iter::once(made).chain(self.fewer()).collect::<Vec<_>>().join("; ")
    }

    /// Of which trials errors are, where these are not all.
    fn fewer(&self) -> Option<String> {
        let pairs: usize = self.points.iter().flat_map(|point| &point.pairs).map(Vec::len).sum();
        let axes: usize = self.points.iter().filter_map(Common::errors).map(|both| both.len()).sum();
        let is_apart = self.points.iter().filter_map(Common::errors).any(|both| both.is_empty());
        let else_of = if is_apart { "; where there is none, of each run's own" } else { "" };
        let said =
            format!("rms and p95 are of the {axes} of {pairs} trials in which both found an axis{else_of}");
        (self.unpaired.is_none() && axes < pairs).then_some(said)
    }

    /// The trials that both have of each point, if they can be compared one by one.
    fn pairs(runs: [&Run; 2], points: &[Common]) -> Result<Vec<Vec<(Trial, Trial)>>, String> {
        let [a, b] = runs.map(|run| &run.summary.run);
        if a.seed != b.seed {
            return Err(format!("their seeds are {} and {}", a.seed, b.seed));
        }
        let read = |run: &Run| of_run(run).map_err(|error| error.to_string());
        let [a, b] = [read(runs[0])?, read(runs[1])?];
        let at = |of: &[Vec<Trial>], place: usize| of.get(place).cloned().unwrap_or_default();
        let pairs: Vec<Vec<(Trial, Trial)>> = points
            .iter()
            .map(|point| at(&a, point.places[0]).into_iter().zip(at(&b, point.places[1])).collect())
            .collect();
        if !pairs.iter().flatten().all(|(a, b)| a.start_deg == b.start_deg) {
            return Err("their trials of one number start at other angles".to_owned());
        }
        Ok(pairs)
    }

    /// All measures at all points.
    fn rows(&self) -> Vec<Row> {
        self.points.iter().flat_map(Common::rows).collect()
    }

    /// What else there is to say.
    fn notes(&self) -> Vec<String> {
        let pairs: usize = self.points.iter().flat_map(|point| &point.pairs).map(Vec::len).sum();
        let mut notes = vec![match &self.unpaired {
            None => {
                format!(
                    "[95 % interval]; paired: differences trial by trial over the same random numbers, {pairs} pairs"
                )
            }
            Some(why) => format!("[95 % interval]; unpaired: differences of independent runs: {why}"),
        }];
        let [a, b] = self.runs.map(|run| run.summary.points.len().max(1));
        let both = self.points.len();
        if a != both || b != both {
            notes.push(format!("A has {a} points, B {b}: compared are the {both} that both have"));
        }
        let unlike = self.points.iter().filter(|point| point.counts[0] != point.counts[1]).count();
        if unlike > 0 {
            let of = match &self.points[..] {
                [Common { counts: [a, b], .. }] => format!("A has {a} trials, B {b}"),
                all => format!("A and B have other numbers of trials at {unlike} of {} points", all.len()),
            };
            notes.push(match &self.unpaired {
                None => format!("{of}: every figure is of the trials that both have, by seed and number"),
                Some(_) => format!("{of}: each figure is of its own run's"),
            });
        }
        notes.extend(self.fewer());
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
}

impl Common {
    /// The errors of the trials in which both found an axis; none where they are not compared one by one.
    fn errors(&self) -> Option<Vec<(f64, f64)>> {
        let error = |(a, b): &(Trial, Trial)| Some((a.error_deg?, b.error_deg?));
        self.pairs.as_ref().map(|pairs| pairs.iter().filter_map(error).collect())
    }

    fn rows(&self) -> Vec<Row> {
        let all = self.pairs.as_ref().map(|pairs| pairs.len() as u64);
        let mut rows = vec![Row::trials(&self.name, self.counts, all)];
        let errors = self.errors();
        // An error of trials in which only one run has one would be of other trials than the other's.
        let of_both = self.pairs.as_ref().map(|pairs| {
            let both = || pairs.iter().filter(|(a, b)| a.error_deg.is_some() && b.error_deg.is_some());
            [
                summary(both().map(|pair| &pair.0), self.summaries[0].limit_deg),
                summary(both().map(|pair| &pair.1), self.summaries[1].limit_deg),
            ]
        });
        // Where no trial has an axis in both, each run's own errors say at least what it did.
        let measured = of_both.as_ref().filter(|both| both[0].axes > 0).unwrap_or(&self.summaries);
        let both = errors.as_deref().filter(|both| both.len() > 1);
        let [rms, p95] = [measured.each_ref().map(|s| s.rms_deg), measured.each_ref().map(|s| s.p95_deg)];
        let [rms_apart, p95_apart] = match (both, &errors) {
            (Some(both), _) => [paired_rms(both), paired_percentile(both, p95)],
            (None, Some(_)) => [Estimate::UNKNOWN; 2],
            (None, None) => [independent(rms), independent(p95)],
        };
        let pairs = both.map(|both| both.len() as u64);
        rows.push(Row::new(&self.name, RMS, rms, rms_apart, pairs));
        rows.push(Row::new(&self.name, P95, p95, p95_apart, pairs));
        for (case, name) in CASES.into_iter().enumerate() {
            let of = |s: &Summary| match case {
                // Of a run that named no pole, nothing is known of wrong ones.
                0 if s.found == 0 => Estimate::UNKNOWN,
                0 => s.wrong_pole_probability,
                1 => s.undetermined_probability,
                _ => s.failed_probability,
            };
            let rates = self.summaries.each_ref().map(of);
            let known = rates.iter().all(|rate| !rate.value.is_nan());
            let counted = self.pairs.as_ref().filter(|pairs| !pairs.is_empty() && known).map(|pairs| Rates {
                only_a: pairs.iter().filter(|(a, b)| a.cases[case] && !b.cases[case]).count() as u64,
                only_b: pairs.iter().filter(|(a, b)| !a.cases[case] && b.cases[case]).count() as u64,
                pairs: pairs.len() as u64,
            });
            let apart = counted.map_or_else(|| independent(rates), Rates::difference);
            rows.push(Row::new(&self.name, name, rates, apart, counted.map(|rates| rates.pairs)));
        }
        rows
    }
}
