//! `standstill odds`: the probability of a rare event, and what it looks like.

use std::fmt::Write as _;

use serde::Serialize;
use serde_json::json;
use standstill_analysis::subset::{End, Run, Settings};
use standstill_analysis::{Anatomy, Answer as By, Draw, Event, Odds, PLAIN, RUNS, Sector, Trials};
use standstill_report::figure::Figure;
use standstill_report::page::{Block, Page, Section, Table, TableColumn, Tone};
use standstill_scenario::Plan;
use standstill_scenario::Record;
use standstill_sim::{NoProbe, Tape, Trace, run as simulate};

use super::question::{
    self, Answer, folder, interrupted, json as with_setup, on_threads, plan, probability,
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
    let settings = Settings { seed: plan.file().seed, ..Settings::default() };
    let watched = question::watched(question, "odds", &plan, expected(&settings, &[]))?;
    let mut done = Vec::new();
    let found = on_threads(question, || {
        watched.bar.set_message(format!("run 1 of {RUNS}"));
        let hear = |run: &Run| {
            done.push((run.levels, run.probability));
            watched.bar.set_length(expected(&settings, &done));
            let mean = done.iter().map(|(_, p)| p).sum::<f64>() / done.len() as f64;
            let next = (done.len() + 1).min(RUNS as usize);
            watched.bar.set_message(format!("run {next} of {RUNS}, so far {}", probability(mean)));
        };
        let odds = trials.odds(options.event, &settings, &watched, hear)?;
        let anatomy = Anatomy::of(&trials, options.event, &odds.failures, &watched)?;
        Ok((odds, anatomy))
    })?;
    watched.bar.finish_and_clear();
    let Some((odds, anatomy)) = unless_stopped(found)? else {
        return Ok(interrupted(
            question,
            "odds",
            &watched,
            &format!("{} of {RUNS} runs were done", done.len()),
        ));
    };
    answer(&plan, &trials, options.event, &odds, &anatomy)?.report(question)
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
    match odds.answer {
        By::Subset => format!(
            "by subset simulation: {} runs of up to {} levels, {} trials",
            odds.runs.len(),
            odds.levels,
            odds.trials
        ),
        By::Plain => format!("by {PLAIN} plain trials ({} trials in all)", odds.trials),
    }
}

/// One in so many starts.
fn one_in(value: f64) -> Option<String> {
    (value > 0.0).then(|| format!("one in {:.0} starts", 1.0 / value))
}

fn headline(event: Event, odds: &Odds) -> String {
    match one_in(odds.probability.value) {
        Some(often) => format!("{event}: {}, {often}", probability_interval(&odds.probability)),
        None => format!("{event}: not seen, at most {} (97.5 %)", probability(odds.probability.high)),
    }
}

fn text(setting: &str, event: Event, odds: &Odds, alarms: &[String], anatomy: &Anatomy) -> String {
    let mut text = format!("{setting}\n{}\n  [95 % interval], {}\n", headline(event, odds), method(odds));
    if odds.answer == By::Subset {
        let _ = writeln!(text, "  levels of {}", event.order_parameter());
    }
    for alarm in alarms {
        let _ = writeln!(text, "  doubtful: {alarm}");
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
    let mut details = vec![format!("[95 % interval], {}", method(odds))];
    if odds.answer == By::Subset {
        details.push(format!("Levels of {}", event.order_parameter()));
    }
    let tone = if alarms.is_empty() { Tone::Neutral } else { Tone::Warning };
    details.extend(alarms);
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
    Page {
        title: format!("Odds of {event}"),
        subtitle: setting,
        sections: vec![
            section("Answer", vec![Block::Verdict { tone, headline, details }]),
            section("What it looks like", vec![Block::Table(sectors)]),
            section("Runs", vec![Block::Table(runs)]),
        ],
        footer: String::new(),
    }
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
