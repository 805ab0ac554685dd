//! `standstill report A B`: two finished runs side by side.
//!
//! A trial's angle, drive and sensors depend only on the seed and its number. Two runs with the same seed are therefore compared trial by
//! trial, at their common points and over their common trials; errors are compared if both runs found an axis. Random effects that both
//! runs have in common cancel in the differences.

mod difference;
mod judged;
mod row;
mod settings;
mod shown;
mod trials;

use std::path::{Path, PathBuf};

use serde_json::json;
use standstill_campaign::{Estimate, Summary};
use standstill_report::page::{Block, Column, Section, Table};

use self::difference::{Rates, independent, paired_percentile, paired_rms};
use self::judged::headline;
use self::row::{Compared, P95, RMS};
use self::settings::settings;
use self::shown::figure;
use self::trials::{Trial, of_run, summary};
use crate::answer::{Answer, Made, Records, verdict};
use crate::arguments::Report;
use crate::error::Error;
use crate::results::{FinishedRun, PointSummary};
use crate::shell::Report as Said;
use crate::shell::asked::NotedQuestion;
use crate::shell::output::Output;
use crate::shell::setup::setting;
use crate::shell::values::{Shown, describe};

const CASES: [&str; 3] = ["wrong poles", "undetermined", "failed"];

/// The two compared runs and the sweep points that both contain.
struct Two<'a> {
    runs: [&'a FinishedRun; 2],
    points: Vec<Common>,
    /// Reason why trials of equal number cannot be compared in pairs. None if they can be compared.
    unpaired: Option<String>,
}

/// A sweep point that both runs have.
struct Common {
    name: String,
    /// Index of the point in each run.
    places: [usize; 2],
    /// Number of trials of each run at this point.
    counts: [u64; 2],
    /// Summaries of the compared trials of each run.
    summaries: [Summary; 2],
    /// Pairs of trials with equal number, one from each run. None if trials are not compared in pairs.
    pairs: Option<Vec<(Trial, Trial)>>,
}

/// Compares two finished runs and writes the files to `out`.
pub fn run(
    options: &Report,
    second: &Path,
    out: Option<PathBuf>,
    asked: Option<NotedQuestion>,
) -> Result<Said, Error> {
    let folders = [options.folder.as_path(), second];
    let runs = [FinishedRun::open(folders[0])?, FinishedRun::open(folders[1])?];
    if let (Some(out), Some(asked)) = (&out, &asked) {
        drop(Output::answering(asked.clone(), out, &["comparison.csv", "comparison.html"])?);
    }
    let answer = Two::of([&runs[0], &runs[1]])?.answer(folders);
    answer.report(out, options.json, &Made { asked, ..Made::default() })
}

/// Returns the indices, in each run, of the sweep points that both runs contain. A run without sweep axes has a single point. Returns none
/// if no point is common.
fn common([a, b]: [&FinishedRun; 2]) -> Option<Vec<[usize; 2]>> {
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
    fn of(runs: [&'a FinishedRun; 2]) -> Result<Self, Error> {
        let Some(places) = common(runs) else {
            let first = runs[0].folder.display();
            let needed = format!("a run that has points of {first}, or two runs without axes");
            return Err(Error::results(&runs[1].folder, "axes with other points", needed));
        };
        let shown = Shown::of(&runs[0].summary.points);
        let name = |place: usize| {
            let point = runs[0].summary.points.get(place);
            point.map_or_else(|| "all starts".to_owned(), |point| describe(point, &shown))
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

    fn answer(&self, folders: [&Path; 2]) -> Answer {
        let (rows, settings, notes) = (self.rows(), settings(self.runs), self.notes());
        let names = folders.map(|folder| folder.display().to_string());
        let each = || names.iter().zip(self.runs);
        let about = each().zip(["A", "B"]);
        let about = about.map(|((name, run), letter)| format!("{letter}: {name} ({})", setting(&run.file)));
        let (tone, headline) = headline(&rows, &self.points);
        let records: Records = rows.iter().map(Compared::record).collect();
        let json = json!({
            "runs": each().map(|(name, run)| json!({ "folder": name, "run": run.summary.run })).collect::<Vec<_>>(),
            "headline": headline,
            "notes": notes,
            "rows": records,
            "settings": settings.iter().map(|[key, a, b]| json!({ "key": key, "a": a, "b": b })).collect::<Vec<_>>(),
        });
        let columns = [
            Column::prose("point"),
            Column::prose("measure"),
            Column::number("A").bracket(1),
            Column::number("B").bracket(1),
            Column::number("B less A"),
            Column::word(""),
        ];
        let table = Table::new(columns).headed().rows(rows.iter().map(Compared::cells));
        let differ = if settings.is_empty() {
            Block::Text("No setting differs.".to_owned())
        } else {
            let columns = ["setting", "A", "B"].map(Column::prose);
            let caption =
                "Settings that differ (– is what the error set, or what suits the motor, makes of it)";
            Block::Table(Table::new(columns).captioned(caption).rows(settings.into_iter().map(Vec::from)))
        };
        let figure = figure(&rows, &self.points, &names, &self.conditions());
        let blocks = vec![Block::Table(table)];
        let (title, setting) = ("Two runs compared".to_owned(), about.collect::<Vec<_>>().join("\n"));
        let caption =
            "Error bars are 95 % intervals. A difference is seen where its bar does not cross zero.";
        let mut answer = Answer::new("comparison", title, setting, verdict(tone, headline, notes), blocks)
            .with("comparison", figure, caption);
        answer.sections.push(Section::new("Settings", [differ]));
        Answer { json, csv: Some(records), ..answer }
    }

    /// Returns one line with the conditions of both runs and the note from [`Self::fewer`].
    fn conditions(&self) -> String {
        let [a, b] = self.runs.map(|run| setting(&run.file));
        let made = if a == b { a } else { format!("A: {a}; B: {b}") };
        std::iter::once(made).chain(self.fewer()).collect::<Vec<_>>().join("; ")
    }

    /// Returns a note if errors are computed over only some of the trials, or if the runs have sectors of different widths. Returns none
    /// otherwise.
    fn fewer(&self) -> Option<String> {
        let pairs: usize = self.points.iter().flat_map(|point| &point.pairs).map(Vec::len).sum();
        let axes: usize = self.points.iter().filter_map(Common::errors).map(|both| both.len()).sum();
        let is_apart = self.points.iter().filter_map(Common::errors).any(|both| both.is_empty());
        let else_of = if is_apart { "; where there is none, of each run's own" } else { "" };
        let said =
            format!("rms and p95 are of the {axes} of {pairs} trials in which both found an axis{else_of}");
        let widths =
            |point: &Common| point.summaries.each_ref().map(|s| s.sectors.map(|of| of.half_width_deg));
        if self.points.iter().map(widths).any(|[a, b]| a != b) {
            let apart = "answers of one run are sectors, or of another width: its errors are those beyond them, so rms and p95 are not compared";
            return Some(apart.to_owned());
        }
        (self.unpaired.is_none() && axes < pairs).then_some(said)
    }

    /// Returns the pairs of trials with equal number at each point. If trials cannot be compared in pairs, the error states the reason.
    fn pairs(runs: [&FinishedRun; 2], points: &[Common]) -> Result<Vec<Vec<(Trial, Trial)>>, String> {
        let [a, b] = runs.map(|run| &run.summary.run);
        if a.seed != b.seed {
            return Err(format!("their seeds are {} and {}", a.seed, b.seed));
        }
        let read = |run: &FinishedRun| of_run(run).map_err(|error| error.to_string());
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

    /// Returns the table's rows: all measures at all points.
    fn rows(&self) -> Vec<Compared> {
        self.points.iter().flat_map(Common::rows).collect()
    }

    /// Returns the notes on pairing, trials and programs of both runs.
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
    /// Returns the pairs of errors, in degrees, of those trials in which both runs found an axis. Returns none if trials are not compared
    /// in pairs.
    fn errors(&self) -> Option<Vec<(f64, f64)>> {
        let error = |(a, b): &(Trial, Trial)| Some((a.error_deg?, b.error_deg?));
        self.pairs.as_ref().map(|pairs| pairs.iter().filter_map(error).collect())
    }

    fn rows(&self) -> Vec<Compared> {
        let all = self.pairs.as_ref().map(|pairs| pairs.len() as u64);
        let mut rows = vec![Compared::trials(&self.name, self.counts, all)];
        let errors = self.errors();
        // The errors of both runs are computed over the same trials: those in which both runs have an axis.
        let of_both = self.pairs.as_ref().map(|pairs| {
            let both = || pairs.iter().filter(|(a, b)| a.error_deg.is_some() && b.error_deg.is_some());
            [
                summary(both().map(|pair| &pair.0), self.summaries[0].limit_deg),
                summary(both().map(|pair| &pair.1), self.summaries[1].limit_deg),
            ]
        });
        // If no trial has an axis in both runs, the table shows the errors over each run's own trials.
        let measured = of_both.as_ref().filter(|both| both[0].axes > 0).unwrap_or(&self.summaries);
        let both = errors.as_deref().filter(|both| both.len() > 1);
        let [rms, p95] = [measured.each_ref().map(|s| s.rms_deg), measured.each_ref().map(|s| s.p95_deg)];
        // Errors beyond sectors of different widths, or of a sector and an angle, cannot be compared.
        let [a, b] = self.summaries.each_ref().map(|s| s.sectors.map(|of| of.half_width_deg));
        let [rms_apart, p95_apart] = match (both, &errors) {
            _ if a != b => [Estimate::UNKNOWN; 2],
            (Some(both), _) => [paired_rms(both), paired_percentile(both, p95)],
            (None, Some(_)) => [Estimate::UNKNOWN; 2],
            (None, None) => [independent(rms), independent(p95)],
        };
        let pairs = both.map(|both| both.len() as u64);
        rows.push(Compared::new(&self.name, RMS, rms, rms_apart, pairs));
        rows.push(Compared::new(&self.name, P95, p95, p95_apart, pairs));
        for (case, name) in CASES.into_iter().enumerate() {
            let of = |s: &Summary| match case {
                // A run that named no pole has no known rate of wrong poles.
                0 if s.found == 0 => Estimate::UNKNOWN,
                0 => s.wrong_pole_probability,
                1 => s.undetermined_probability,
                _ => s.failed_probability,
            };
            let rates = self.summaries.each_ref().map(of);
            let known = rates.iter().all(|rate| !rate.value.is_nan());
            let counted = self.pairs.as_ref().filter(|pairs| !pairs.is_empty() && known).map(|pairs| Rates {
                only_a: pairs.iter().filter(|(a, b)| a.cases()[case] && !b.cases()[case]).count() as u64,
                only_b: pairs.iter().filter(|(a, b)| !a.cases()[case] && b.cases()[case]).count() as u64,
                pairs: pairs.len() as u64,
            });
            let apart = counted.map_or_else(|| independent(rates), Rates::difference);
            rows.push(Compared::new(&self.name, name, rates, apart, counted.map(|rates| rates.pairs)));
        }
        rows
    }
}
