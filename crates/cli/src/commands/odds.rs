//! `standstill odds`: the probability of a rare event, and what it looks like.

use std::fmt::Write as _;

use serde::Serialize;
use serde_json::json;
use standstill_analysis::subset::{End, Run, Settings};
use standstill_analysis::{Anatomy, Answer as By, Draw, Event, Odds, RUNS, Sector, Trials};
use standstill_report::figure::Figure;
use standstill_report::page::{Block, Page, Section, Table, TableColumn, Tone};
use standstill_scenario::Plan;
use standstill_scenario::Record;
use standstill_sim::{NoProbe, Tape, Trace, run as simulate};

use super::question::{
    self, Answer, Identity, folder, interrupted, json as with_setup, on_threads, plan, probability,
    probability_interval, setting, unless_stopped,
};
use crate::Report;
use crate::arguments::Odds as Options;
use crate::columns;
use crate::error::Error;
use crate::figures;
use crate::output::Output;
use crate::table::{Column, Table as Printed};

/// Time in s between two points of a waveform at most.
const RESOLUTION: f64 = 5e-6;

/// Draws of a sector that are told.
const TOLD: usize = 6;

/// A run's row in `odds.csv`.
#[derive(Debug, Serialize)]
struct Row {
    run: usize,
    probability: f64,
    own_variation: f64,
    levels: u32,
    trials: u64,
    acceptance: f64,
    ancestors: u32,
    end: &'static str,
}

impl Row {
    fn new((number, run): (usize, &Run)) -> Self {
        let end = match run.end {
            End::Reached => "reached",
            End::Flat => "flat",
            End::TooRare => "too rare",
            End::Constant => "constant",
        };
        Self {
            run: number + 1,
            probability: run.probability,
            own_variation: run.variation,
            levels: run.levels,
            trials: run.trials,
            acceptance: run.acceptance,
            ancestors: run.ancestors,
            end,
        }
    }
}

pub fn run(options: &Options) -> Result<Report, Error> {
    let question = &options.question;
    let plan = plan(question)?;
    let trials = Trials::new(&plan)?;
    if let Some(folder) = folder(question, "odds") {
        // Made and removed again: what cannot be written shows before the first trial.
        drop(Output::create(&folder, &["odds.csv", "odds.json", "odds.html", "odds.svg", "odds.png"])?);
    }
    let asked = Identity::new(&plan, [("--event", Some(options.event.to_string()))])?;
    let settings = Settings { seed: plan.file().seed, ..Settings::default() };
    let watched = question::watched(question, "odds", &asked, expected(&settings, &[]))?;
    let (mut done, mut found) = (Vec::new(), Vec::new());
    let answered = on_threads(question, || {
        watched.bar.set_message(format!("run 1 of {RUNS}"));
        let hear = |run: &Run| {
            done.push((run.levels, run.probability));
            watched.bar.set_length(expected(&settings, &done));
            found.push((run.end, run.probability));
            watched.bar.set_message(progress(&found));
        };
        let odds = trials.odds(options.event, &settings, &watched, hear)?;
        let anatomy = Anatomy::of(&trials, options.event, &odds.failures, &watched)?;
        Ok((odds, anatomy))
    })?;
    watched.bar.finish_and_clear();
    let Some((odds, anatomy)) = unless_stopped(answered)? else {
        return Ok(interrupted(
            question,
            "odds",
            &watched,
            &format!("{} of {RUNS} runs were done", done.len()),
        ));
    };
    answer(&plan, &trials, options.event, &odds, &anatomy)?.report(question, &asked)
}

/// What is known after these runs: the event's probability once one reached it, before that only how far down the last one came.
fn progress(done: &[(End, f64)]) -> String {
    let next = (done.len() + 1).min(RUNS as usize);
    let reached = done.iter().filter(|(end, _)| *end == End::Reached);
    let sum: f64 = reached.clone().map(|(_, found)| found).sum();
    match done.last() {
        _ if reached.count() > 0 => {
            format!("run {next} of {RUNS}, so far {}", probability(sum / done.len() as f64))
        }
        Some((End::TooRare, level)) => format!("run {next} of {RUNS}, level at {}", probability(*level)),
        Some((End::Flat, _)) => "nothing leads to the event: plain trials".to_owned(),
        _ => format!("run {next} of {RUNS}"),
    }
}

/// About how many trials there will be, from the runs that are done.
fn expected(settings: &Settings, done: &[(u32, f64)]) -> u64 {
    /// Where nothing is known yet.
    const LEVELS: f64 = 6.0;
    let levels = if done.is_empty() {
        LEVELS
    } else {
        done.iter().map(|(levels, _)| f64::from(*levels)).sum::<f64>() / done.len() as f64
    };
    let states = f64::from(settings.states);
    // Three moves for each state but the seeds.
    let level = 3.0 * states * (1.0 - 1.0 / f64::from(settings.chain));
    // Some millions.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let trials = (f64::from(RUNS) * (states + (levels - 1.0).max(0.0) * level)) as u64;
    trials
}

fn answer(
    plan: &Plan,
    trials: &Trials<'_>,
    event: Event,
    odds: &Odds,
    anatomy: &Anatomy,
) -> Result<Answer, Error> {
    let setting = setting(plan.file(), trials.scenario());
    let found = odds.probability;
    let rows: Vec<Row> = odds.runs.iter().enumerate().map(Row::new).collect();
    let alarms: Vec<String> = odds.alarms.iter().map(ToString::to_string).collect();
    let answer = json!({
        "event": event.to_string(),
        "probability": found.value,
        "low": found.low,
        "high": found.high,
        "trials": odds.trials,
        "levels": odds.levels,
        "by": by(odds.answer),
        "runs": rows,
        "alarms": alarms,
        "remarks": odds.remarks.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "sectors": anatomy.sectors.iter().map(sector_json).collect::<Vec<_>>(),
    });
    let mut figures = Vec::new();
    if !odds.runs.is_empty() {
        let caption =
            "Each run goes down by levels of a tenth; where they meet the event, their mean counts.";
        figures.push(("odds".to_owned(), figures::odds(odds, event, setting.clone()), caption.to_owned()));
    }
    if let Some(tape) = &anatomy.typical {
        let (figure, caption) = typical(trials, tape)?;
        figures.push(("typical".to_owned(), figure, caption));
    }
    Ok(Answer {
        name: "odds",
        text: text(&setting, event, odds, &alarms, anatomy),
        json: with_setup(plan.file(), trials.scenario(), answer),
        csv: columns::csv(&rows).map_err(|error| Error::Write("odds.csv".into(), error))?,
        figures,
        page: page(setting, event, odds, alarms, anatomy, &rows),
        code: 0,
    })
}

const fn by(answer: By) -> &'static str {
    match answer {
        By::Subset => "subset simulation",
        By::Plain => "plain trials",
    }
}

fn sector_json(sector: &Sector) -> serde_json::Value {
    let draw = |draw: &Draw| json!({ "draw": draw.name, "mean": draw.mean, "deviation": draw.deviation });
    json!({
        "angles_deg": [sector.angles_deg.0, sector.angles_deg.1],
        "positive_error": sector.positive,
        "share": sector.share,
        "draws": sector.draws.iter().map(draw).collect::<Vec<_>>(),
    })
}

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
    if odds.probability.value > 0.0 { format!("[95 % interval], {how}") } else { how }
}

/// One in so many starts.
fn one_in(value: f64) -> Option<String> {
    (value > 0.0).then(|| format!("one in {:.0} starts", 1.0 / value))
}

fn headline(event: Event, odds: &Odds) -> String {
    if let Some(often) = one_in(odds.probability.value) {
        return format!("{event}: {}, {often}", probability_interval(&odds.probability));
    }
    let how = match odds.answer {
        By::Subset => "reached",
        By::Plain => "seen",
    };
    let (most, plain) = (probability(odds.probability.high), odds.plain);
    format!("{event}: not {how}, at most {most} (97.5 %, none in {plain} plain trials)")
}

fn text(setting: &str, event: Event, odds: &Odds, alarms: &[String], anatomy: &Anatomy) -> String {
    let mut text = format!("{setting}\n{}\n  {}\n", headline(event, odds), method(odds));
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

fn page(
    setting: String,
    event: Event,
    odds: &Odds,
    alarms: Vec<String>,
    anatomy: &Anatomy,
    rows: &[Row],
) -> Page {
    let mut details = vec![method(odds)];
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
                    format!("{:.3e}", row.probability),
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

/// The waveforms of a start with the event.
fn typical(trials: &Trials<'_>, tape: &Tape) -> Result<(Figure, String), Error> {
    let scenario = trials.plan().scenario_taped(0, trials.scenario(), tape)?;
    let case = scenario.case_taped(tape);
    let run = simulate(&case, &mut scenario.detector_for(&case)?, false, &mut NoProbe);
    let mut trace = Trace::new(RESOLUTION);
    let _ = simulate(&case, &mut scenario.detector_for(&case)?, true, &mut trace);
    let record = Record { trial: 0, run };
    let outcome = match (record.estimated_angle_deg(), record.error_deg()) {
        (Some(angle), Some(error)) => format!("found {angle:.2}°, error {error:+.2}°"),
        _ => format!("{}: {}", record.verdict().name(), record.reason()),
    };
    let title = format!("a start with the event, rotor at {:.1}°", record.true_angle_deg());
    Ok((
        figures::detection(&trace, &title, super::found(&record)),
        format!("Of the likeliest sector the start nearest to its means: {outcome}."),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn regress_progress_does_not_show_a_level_as_the_event() {
        let (reached, rare) = ((End::Reached, 2e-6), (End::TooRare, 1e-16));
        assert_eq!(progress(&[]), "run 1 of 8");
        assert_eq!(progress(&[rare]), "run 2 of 8, level at 1.00e-16");
        assert_eq!(progress(&[rare, reached]), "run 3 of 8, so far 1.00e-6");
        assert_eq!(progress(&[reached; 8]), "run 8 of 8, so far 2.00e-6");
        assert!(!progress(&[(End::Flat, 1.0)]).contains("1.0"));
    }
}
