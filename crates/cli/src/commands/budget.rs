//! `standstill budget`: where the error comes from.

use std::fmt::Write as _;

use serde::Serialize;
use serde_json::json;
use standstill_analysis::{Budget, PAIRS, Source, TooFew, Trials, trials_of_budget};
use standstill_campaign::Estimate;
use standstill_report::page::{Block, Page, Section, Table, TableColumn, Tone};

use super::question::{
    self, Answer, Identity, folder, interrupted, json as with_setup, on_threads, plan, setting,
    unless_stopped,
};
use crate::arguments::Budget as Options;
use crate::columns;
use crate::error::Error;
use crate::figures::{self, Bar};
use crate::shell::Report;
use crate::shell::command_line::quoted;
use crate::shell::output::Output;
use crate::shell::table::{Column, Table as Printed};
use crate::shell::terminal::paragraph;
use crate::summary::with_interval;

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
    alone_rms_low_deg: Option<f64>,
    alone_rms_high_deg: Option<f64>,
    without_rms_deg: Option<f64>,
    without_rms_low_deg: Option<f64>,
    without_rms_high_deg: Option<f64>,
    share: f64,
    share_low: f64,
    share_high: f64,
    total: Option<f64>,
    total_low: Option<f64>,
    total_high: Option<f64>,
}

impl Row {
    fn new(source: &str, rms: Option<[Estimate; 2]>, share: Estimate, total: Option<Estimate>) -> Self {
        let (alone, without) = (rms.map(|[alone, _]| alone), rms.map(|[_, without]| without));
        Self {
            source: source.to_owned(),
            alone_rms_deg: alone.map(|e| e.value),
            alone_rms_low_deg: alone.map(|e| e.low),
            alone_rms_high_deg: alone.map(|e| e.high),
            without_rms_deg: without.map(|e| e.value),
            without_rms_low_deg: without.map(|e| e.low),
            without_rms_high_deg: without.map(|e| e.high),
            share: share.value,
            share_low: share.low,
            share_high: share.high,
            total: total.map(|e| e.value),
            total_low: total.map(|e| e.low),
            total_high: total.map(|e| e.high),
        }
    }

    /// Each number with its interval, in the digits that the interval allows.
    fn cells(&self) -> Vec<String> {
        let cell = |factor: f64, all: [Option<f64>; 3]| match all {
            [Some(value), Some(low), Some(high)] => {
                let [value, low, high] = with_interval([value, low, high].map(|x| factor * x));
                format!("{value} [{low}, {high}]")
            }
            _ => "–".to_owned(),
        };
        vec![
            self.source.clone(),
            cell(100.0, [self.share, self.share_low, self.share_high].map(Some)),
            cell(1.0, [self.alone_rms_deg, self.alone_rms_low_deg, self.alone_rms_high_deg]),
            cell(1.0, [self.without_rms_deg, self.without_rms_low_deg, self.without_rms_high_deg]),
            cell(100.0, [self.total, self.total_low, self.total_high]),
        ]
    }
}

/// The sources, the largest share first; then the method's own bias among them, and the interaction last.
fn rows(budget: &Budget) -> Vec<Row> {
    let own = &budget.method;
    let mut rows =
        vec![Row::new("method", Some([own.alone_deg, own.without_deg]), own.share, Some(own.share))];
    rows.extend(budget.items.iter().map(|item| {
        let rms = [item.alone_deg, item.without_deg];
        Row::new(&item.source.key, Some(rms), item.share, Some(item.total))
    }));
    rows.sort_by(|a, b| b.share.total_cmp(&a.share));
    rows.push(Row::new("interaction", None, budget.interaction, None));
    rows
}

pub fn run(options: &Options) -> Result<Report, Error> {
    let question = &options.question;
    let plan = plan(question)?;
    let trials = Trials::new(&plan)?;
    let sources = Source::all(&trials);
    if sources.is_empty() {
        let scenario = quoted(&question.scenario.to_string_lossy());
        return Err(Error::Arguments(format!(
            "{scenario}: found no error that starts draw (`errors` is \"{}\"), so the whole error is the method's own, which \
             `standstill run {scenario}` measures; needed errors to share it out among, such as -s errors=default, a key such as \
             -s 'sensors.noise=5 mA', or a table [tolerances]",
            plan.file().errors.0.name()
        )));
    }
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
    let budget = match budget {
        Ok(budget) => budget,
        Err(TooFew { pairs, whole, needed }) => {
            question::forget(question, "budget")?;
            return Err(Error::Arguments(format!(
                "of {pairs} pairs of starts {whole} have an axis in all that was tried: too few to share an error out, needed {needed}"
            )));
        }
    };
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
            total: row.total.zip(row.total_low.zip(row.total_high)).map(|(t, (low, high))| [t, low, high]),
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
        code: 0,
    };
    answer.report(question, &asked)
}

fn headline(budget: &Budget) -> String {
    let Estimate { value, low, high } = budget.rms_deg;
    let [value, low, high] = with_interval([value, low, high]);
    format!("rms error of the axis {value}° [{low}, {high}]")
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

/// For the terminal.
fn table(rows: &[Row]) -> Printed {
    let columns = [
        Column::word("source"),
        // Intervals go before any of the columns does.
        Column::number("share %").bracket(4),
        Column::number("alone °").rank(1).bracket(5),
        Column::number("without °").rank(2).bracket(5),
        Column::number("total %").rank(3).bracket(5),
    ];
    Printed::new(columns).rows(rows.iter().map(Row::cells))
}

fn text(setting: &str, budget: &Budget, rows: &[Row]) -> String {
    let mut text = format!("{setting}\n{}\n", headline(budget));
    for note in notes(budget) {
        let _ = writeln!(text, "  {note}");
    }
    let _ = write!(text, "\n{}", table(rows).text());
    text.push('\n');
    text + &legend(budget).iter().map(|line| paragraph("", line)).collect::<String>()
}

/// What the columns and rows are, a paragraph each.
fn legend(budget: &Budget) -> Vec<String> {
    let mut legend = [
        "share: of the mean square, by the source itself; total: with all in which it has a part.",
        "alone: rms with this source, all others at their means; without: rms of all others.",
        "method: its own error at each angle, which no better part removes. interaction: what sources make only together.",
    ]
    .map(str::to_owned)
    .to_vec();
    legend.extend(budget.items.iter().filter(|item| item.source.is_rounding()).map(|item| {
        format!(
            "{}: what converters round, by the place of their codes. Where noise moves readings by more than a code, it has \
             no share by itself: its total is interaction with whatever moves readings. The others alone are without it.",
            item.source.key
        )
    }));
    legend
}

fn page(setting: String, budget: &Budget, rows: &[Row]) -> Page {
    let table = Table {
        caption: "Sources by their share of the mean square, each number with its 95 % interval".to_owned(),
        columns: vec![
            TableColumn::text("source"),
            TableColumn::text("share, %"),
            TableColumn::text("rms alone, °"),
            TableColumn::text("rms without, °"),
            TableColumn::text("total, %"),
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
            vec![verdict, Block::Table(table), Block::Text(legend(budget).join(" "))],
        )],
        footer: String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_eighty_columns_have_all_columns_of_a_budget_and_its_shares_have_their_intervals() {
        let estimate = |value: f64| Estimate { value, low: value - 0.0213, high: value + 0.0213 };
        let row = |source| {
            Row::new(source, Some([estimate(0.645), estimate(0.638)]), estimate(0.408), Some(estimate(0.459)))
        };
        let rows = [row("sensors.gain_error"), row("tolerances.motor.winding.resistance")];
        let text = table(&rows).within(80, false);
        for title in ["share %", "alone °", "without °", "total %"] {
            assert!(text.contains(title), "{title} in\n{text}");
        }
        assert!(text.contains("the brackets of alone °, without °, total %"), "{text}");
        let first = text.lines().find(|line| line.contains("sensors.gain_error")).expect("a row");
        assert!(first.contains("40.8 [") && text.lines().all(|line| line.chars().count() <= 80), "{text}");
    }
}
