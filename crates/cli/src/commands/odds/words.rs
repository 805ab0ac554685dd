//! What is said of odds.

use std::fmt::Write as _;

use standstill_analysis::{Anatomy, Answer as By, Draw, Event, Odds, Sector};
use standstill_campaign::Estimate;
use standstill_quantity::{magnitude, rounded};
use standstill_report::page::{Block, Page, Section, Table, TableColumn, Tone};

use super::Row;

use crate::shell::table::{Column, Table as Printed};
use crate::shell::values::probability;
use crate::shell::values::probability_interval;

/// Draws of a sector that are told.
const TOLD: usize = 6;

/// Angles, sign, share and draws of a sector, in words.
fn cells(sector: &Sector) -> Vec<String> {
    let sign = match sector.positive {
        Some(true) => "+",
        Some(false) => "−",
        None => "",
    };
    let draw = |draw: &Draw| format!("{} {:+.1} ± {:.1} σ", draw.name, draw.mean, draw.deviation);
    let mut draws: Vec<String> = sector.draws.iter().take(TOLD).map(draw).collect();
    if sector.draws.len() > TOLD {
        draws.push(format!("{} more", sector.draws.len() - TOLD));
    }
    vec![
        format!("{:.0} to {:.0}", sector.angles_deg.0, sector.angles_deg.1),
        sign.to_owned(),
        format!("{:.1}", 100.0 * sector.share),
        if draws.is_empty() { "none away from zero".to_owned() } else { draws.join(", ") },
    ]
}

fn method(odds: &Odds) -> String {
    let how = match odds.answer {
        By::Subset => format!(
            "by subset simulation: {} runs of up to {} levels, {} trials",
            odds.runs.len(),
            odds.levels,
            odds.trials
        ),
        By::Plain => format!("by {} plain trials ({} trials in all)", odds.plain, odds.trials),
    };
    let interval = if odds.widened { "[interval widened, for it is doubtful]" } else { "[95 % interval]" };
    if odds.probability.value > 0.0 { format!("{interval}, {how}") } else { how }
}

/// One in so many starts, in the digits that the interval supports, three at most.
fn one_in(p: &Estimate) -> Option<String> {
    const NAMES: [(f64, &str); 3] = [(1e12, " million million"), (1e9, " billion"), (1e6, " million")];
    let often = Estimate { value: 1.0 / p.value, low: 1.0 / p.high, high: 1.0 / p.low };
    let behind = magnitude(often.value)? - often.last_place()?;
    let digits = usize::try_from(behind.clamp(0, 2)).unwrap_or(0);
    let often = (p.value > 0.0).then(|| format!("{:.digits$e}", 1.0 / p.value).parse::<f64>().ok())??;
    let (unit, name) = NAMES.into_iter().find(|(unit, _)| often >= *unit).unwrap_or((1.0, ""));
    Some(format!("one in {}{name} starts", rounded(often / unit, 0)))
}

/// Of which starts the probability is the share, where the event alone does not say it.
pub(super) fn share_of(event: Event) -> String {
    match event {
        Event::Error(bound) => format!(
            "of all starts those whose axis is off by more than {bound}°; one without an axis is not among them"
        ),
        _ => "of all starts".to_owned(),
    }
}

fn headline(event: Event, odds: &Odds) -> String {
    if let Some(often) = one_in(&odds.probability) {
        return format!("{event}: {}, {often}", probability_interval(&odds.probability));
    }
    let how = match odds.answer {
        By::Subset => "reached",
        By::Plain => "seen",
    };
    let (most, plain) = (probability(odds.probability.high), odds.plain);
    format!("{event}: not {how}, at most {most} (97.5 %, none in {plain} plain trials)")
}

/// On the terminal.
pub(super) fn text(setting: &str, event: Event, odds: &Odds, alarms: &[String], anatomy: &Anatomy) -> String {
    let mut text =
        format!("{setting}\n{}\n  {}\n  {}\n", headline(event, odds), share_of(event), method(odds));
    if odds.answer == By::Subset {
        let _ = writeln!(text, "  levels of {}", event.order_parameter());
    }
    for alarm in alarms {
        let _ = writeln!(text, "  doubtful: {alarm}");
    }
    for remark in &odds.remarks {
        let _ = writeln!(text, "  {remark}");
    }
    if !anatomy.sectors.is_empty() {
        text += "\nWhat it looks like: means of its draws, in standard deviations\n\n";
        let rows = anatomy.sectors.iter().map(cells);
        let columns = [
            Column::word("angle °"),
            Column::word("error"),
            Column::word("share %"),
            Column::prose("draws away from zero"),
        ];
        text += &Printed::new(columns).rows(rows).text();
    }
    text
}

/// As a page.
pub(super) fn page(
    setting: String,
    event: Event,
    odds: &Odds,
    alarms: Vec<String>,
    anatomy: &Anatomy,
    rows: &[Row],
) -> Page {
    let mut details = vec![share_of(event), method(odds)];
    if odds.answer == By::Subset {
        details.push(format!("Levels of {}", event.order_parameter()));
    }
    let tone = if alarms.is_empty() { Tone::Neutral } else { Tone::Warning };
    details.extend(alarms);
    details.extend(odds.remarks.iter().map(ToString::to_string));
    let runs = Table {
        caption: "The runs; own variation: the coefficient of variation that a run expects of itself"
            .to_owned(),
        columns: vec![
            TableColumn::number("run", ""),
            TableColumn::number("probability", ""),
            TableColumn::number("own variation", ""),
            TableColumn::number("levels", ""),
            TableColumn::number("trials", ""),
            TableColumn::number("moves taken", "%"),
            TableColumn::number("ancestors", ""),
        ],
        rows: rows
            .iter()
            .map(|row| {
                vec![
                    row.run.to_string(),
                    format!("{:.2e}", row.probability),
                    format!("{:.2}", row.own_variation),
                    row.levels.to_string(),
                    row.trials.to_string(),
                    format!("{:.0}", 100.0 * row.acceptance),
                    row.ancestors.to_string(),
                ]
            })
            .collect(),
    };
    let sectors = Table {
        caption: "Means of the draws of starts with the event, in standard deviations, by angle and sign of the error"
            .to_owned(),
        columns: vec![
            TableColumn::text("angle in °"),
            TableColumn::text("error"),
            TableColumn::number("share", "%"),
            TableColumn::text("draws away from zero"),
        ],
        rows: anatomy.sectors.iter().map(cells).collect(),
    };
    let section = |title: &str, blocks: Vec<Block>| Section { title: title.to_owned(), blocks };
    let headline = headline(event, odds);
    let mut sections = vec![section("Answer", vec![Block::Verdict { tone, headline, details }])];
    let tables = [("What it looks like", sectors), ("Runs", runs)];
    let filled = tables.into_iter().filter(|(_, table)| !table.rows.is_empty());
    sections.extend(filled.map(|(title, table)| section(title, vec![Block::Table(table)])));
    Page { title: format!("Odds of {event}"), subtitle: setting, sections, footer: String::new() }
}

#[cfg(test)]
mod tests {
    use standstill_analysis::subset::{End, Run, Settings};

    use super::*;

    #[test]
    fn law_one_in_so_many_has_few_digits() {
        let said = |value, half: f64| {
            one_in(&Estimate { value, low: value * (1.0 - half), high: value * (1.0 + half) })
        };
        let starts = |often: &str| Some(format!("one in {often} starts"));
        assert_eq!(said(2.27e-9, 0.3), starts("440 million"));
        assert_eq!(said(1.234e-10, 0.3), starts("8.1 billion"));
        assert_eq!(said(1.0 / 64.2, 0.06), starts("64"));
        assert_eq!(said(0.4, 0.01), starts("2.5"));
        assert_eq!(said(4.954e-5, 0.01), starts("20200"));
        assert_eq!(said(0.0, 0.0), None);
    }

    #[test]
    fn regress_what_no_run_reached_is_bounded_by_plain_trials_in_words_too() {
        let run = |end, probability| Run {
            end,
            probability,
            variation: 0.0,
            levels: 16,
            curve: Vec::new(),
            trials: 166_000,
            acceptance: 0.5,
            ancestors: 100,
            unread: [0.0; 8],
            failures: Vec::new(),
            plain_hits: 0,
        };
        let settings = Settings::default();
        let mut odds = Odds::of_runs(&settings, vec![run(End::TooRare, 1e-16); 8]);
        odds.remarks.push(standstill_analysis::Alarm::Unled(0.05));
        let none = Anatomy { sectors: Vec::new(), typical: None };
        let alarms: Vec<String> = odds.alarms.iter().map(ToString::to_string).collect();
        let text = text("setting", Event::Failed, &odds, &alarms, &none);
        let headline = "failed: not reached, at most 1.15e-4 (97.5 %, none in 32000 plain trials)\n";
        assert!(text.contains(headline) && text.contains("the runs gave up at 1e-16"), "{text}");
        assert!(!text.contains("interval"), "{text}");
        assert!(
            text.contains("\n  5 % of the failed starts ended with a fault that no margin tells"),
            "{text}"
        );
        let rows: Vec<Row> = odds.runs.iter().enumerate().map(Row::new).collect();
        let page = page("setting".to_owned(), Event::Failed, &odds, alarms, &none, &rows);
        let titles: Vec<&str> = page.sections.iter().map(|section| section.title.as_str()).collect();
        assert_eq!(titles, ["Answer", "Runs"]);
    }
}
