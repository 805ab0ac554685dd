//! `standstill budget`: where the error comes from.

use std::fmt::Write as _;

use serde::Serialize;
use serde_json::json;
use standstill_analysis::{Budget, PAIRS, Source, Trials, trials_of_budget};
use standstill_campaign::Estimate;
use standstill_report::page::{Block, Page, Section, Table, TableColumn, Tone};

use super::question::{
    self, Answer, Identity, folder, interrupted, json as with_setup, on_threads, plan, setting,
    unless_stopped,
};
use crate::Report;
use crate::arguments::Budget as Options;
use crate::columns;
use crate::error::Error;
use crate::figures::{self, Bar};
use crate::output::Output;
use crate::summary::fixed;
use crate::table::{Column, Table as Printed};

/// Pairs of starts with an axis that shares can be told from.
const FEWEST: u64 = 10;

const FILES: [&str; 7] = [
    "budget.csv",
    "budget.json",
    "budget.html",
    "budget.svg",
    "budget.png",
    "over_angle.svg",
    "over_angle.png",
];

/// A row of the table and of the JSON list. What does not exist is empty, or null.
#[derive(Debug, Serialize)]
struct Row {
    source: String,
    alone_rms_deg: Option<f64>,
    without_rms_deg: Option<f64>,
    share: f64,
    share_low: f64,
    share_high: f64,
    total: Option<f64>,
}

impl Row {
    fn new(source: &str, rms: [Option<f64>; 2], share: Estimate, total: Option<f64>) -> Self {
        let [alone_rms_deg, without_rms_deg] = rms;
        let Estimate { value, low, high } = share;
        let source = source.to_owned();
        Self { source, alone_rms_deg, without_rms_deg, share: value, share_low: low, share_high: high, total }
    }

    fn cells(&self) -> Vec<String> {
        let number = |value: Option<f64>, digits| {
            value.map_or_else(|| "–".to_owned(), |value: f64| fixed(value, digits))
        };
        vec![
            self.source.clone(),
            number(self.alone_rms_deg, 3),
            number(self.without_rms_deg, 3),
            fixed(100.0 * self.share, 1),
            [self.share_low, self.share_high].map(|share| fixed(100.0 * share, 1)).join(" to "),
            number(self.total.map(|total| 100.0 * total), 1),
        ]
    }
}

/// The sources, the largest share first; then the method's own bias among them, and the interaction last.
fn rows(budget: &Budget) -> Vec<Row> {
    let (own, share) = budget.method;
    let rms = budget.rms_deg.value;
    let rest = (rms * rms - own * own).max(0.0).sqrt();
    let mut rows = vec![Row::new("method", [Some(own), Some(rest)], share, Some(share.value))];
    rows.extend(budget.items.iter().map(|item| {
        let rms = [item.alone_deg, item.without_deg].map(|rms| Some(rms.value));
        Row::new(&item.source.key, rms, item.share, Some(item.total.value))
    }));
    rows.sort_by(|a, b| b.share.total_cmp(&a.share));
    rows.push(Row::new("interaction", [None, None], budget.interaction, None));
    rows
}

pub fn run(options: &Options) -> Result<Report, Error> {
    let question = &options.question;
    let plan = plan(question)?;
    let trials = Trials::new(&plan)?;
    let sources = Source::all(&trials);
    if let Some(folder) = folder(question, "budget") {
        drop(Output::create(&folder, &FILES)?);
    }
    let pairs = options.pairs.map_or(PAIRS, u64::from);
    let asked = Identity::new(&plan, [("--pairs", Some(pairs.to_string()))])?;
    let watched = question::watched(question, "budget", &asked, trials_of_budget(pairs, sources.len()))?;
    watched.bar.set_message(format!("{} sources", sources.len()));
    let found = on_threads(question, || Budget::of(&trials, &sources, pairs, &watched))?;
    watched.bar.finish_and_clear();
    let Some(budget) = unless_stopped(found)? else {
        return Ok(interrupted(question, "budget", &watched, "the samples were not complete"));
    };
    if budget.pairs < budget.dropped + FEWEST {
        return Err(Error::Arguments(format!(
            "of {} pairs of starts {} have an axis in all that was tried: too few to share an error out, needed {FEWEST}",
            budget.pairs,
            budget.pairs - budget.dropped
        )));
    }
    let setting = setting(plan.file(), trials.scenario());
    let rows = rows(&budget);
    let answer = json!({
        "rms_deg": budget.rms_deg.value,
        "rms_low_deg": budget.rms_deg.low,
        "rms_high_deg": budget.rms_deg.high,
        "sources": rows,
        "trials": budget.trials,
        "pairs": budget.pairs,
        "dropped": budget.dropped,
    });
    let bars: Vec<Bar> = rows
        .iter()
        .map(|row| Bar {
            name: row.source.clone(),
            share: [row.share, row.share_low, row.share_high],
            total: row.total,
        })
        .collect();
    let caption = "Shares sum to one. Totals count an interaction with each source that has a part in it.";
    let angle = "Mean squares, which add up: of the sources by themselves, the largest four, with 95 % intervals. Where a source has next to no part, an estimate may lie below zero.";
    let answer = Answer {
        name: "budget",
        text: text(&setting, &budget, &rows),
        json: with_setup(plan.file(), trials.scenario(), answer),
        csv: columns::csv(&rows).map_err(|error| Error::Write("budget.csv".into(), error))?,
        figures: vec![
            ("budget".to_owned(), figures::shares(&bars, setting.clone()), caption.to_owned()),
            ("over_angle".to_owned(), figures::over_angle(&budget, &setting), angle.to_owned()),
        ],
        page: page(setting, &budget, &rows),
        code: u8::from(budget.dropped == budget.pairs),
    };
    answer.report(question, &asked)
}

fn headline(budget: &Budget) -> String {
    let Estimate { value, low, high } = budget.rms_deg;
    format!("rms error of the axis {value:.3}° [{low:.3}, {high:.3}]")
}

/// What else there is to say.
fn notes(budget: &Budget) -> Vec<String> {
    let mut notes = vec![format!(
        "[95 % interval], Sobol' indices at each angle, averaged over it; {} trials",
        budget.trials
    )];
    if budget.dropped > 0 {
        notes.push(format!(
            "{} of {} samples left out: one of their starts had no axis. The odds of that are no part of a budget",
            budget.dropped, budget.pairs
        ));
    }
    notes
}

fn text(setting: &str, budget: &Budget, rows: &[Row]) -> String {
    let mut text = format!("{setting}\n{}\n", headline(budget));
    for note in notes(budget) {
        let _ = writeln!(text, "  {note}");
    }
    let numbers = ["alone °", "without °", "share %", "interval", "total %"].map(Column::number);
    let columns = std::iter::once(Column::word("source")).chain(numbers);
    let _ = write!(text, "\n{}", Printed::new(columns).rows(rows.iter().map(Row::cells)).text());
    text + LEGEND
}

const LEGEND: &str = "
alone: rms with this source, all others at their means; without: rms of all others.
share: of the mean square, by the source itself; total: with all in which it has a part.
method: its own error at each angle, which no better part removes. interaction: what sources make only together.
";

fn page(setting: String, budget: &Budget, rows: &[Row]) -> Page {
    let table = Table {
        caption: "Sources by their share of the mean square".to_owned(),
        columns: vec![
            TableColumn::text("source"),
            TableColumn::number("rms alone", "°"),
            TableColumn::number("rms without", "°"),
            TableColumn::number("share", "%"),
            TableColumn::text("95 % interval"),
            TableColumn::number("total", "%"),
        ],
        rows: rows
            .iter()
            .map(|row| row.cells().into_iter().map(|cell| cell.replace('–', "")).collect())
            .collect(),
    };
    let verdict = Block::Verdict { tone: Tone::Neutral, headline: headline(budget), details: notes(budget) };
    let section = |title: &str, blocks: Vec<Block>| Section { title: title.to_owned(), blocks };
    Page {
        title: "Where the error comes from".to_owned(),
        subtitle: setting,
        sections: vec![section(
            "Answer",
            vec![verdict, Block::Table(table), Block::Text(LEGEND.trim().to_owned())],
        )],
        footer: String::new(),
    }
}
