//! `standstill odds`: the probability of a rare event, and what it looks like.

mod words;

use serde::Serialize;
use serde_json::json;
use standstill_analysis::subset::{End, Run, Settings};
use standstill_analysis::{Anatomy, Answer as By, Draw, Event, Odds, RUNS, Sector, Trials};
use standstill_report::figure::Figure;
use standstill_scenario::Plan;
use standstill_scenario::Record;
use standstill_sim::{NoProbe, Tape, Trace, run as simulate};

use self::words::{page, text};
use super::question::{
    self, Answer, Identity, folder, interrupted, json as with_setup, on_threads, plan, probability, setting,
    unless_stopped,
};
use crate::Report;
use crate::arguments::Odds as Options;
use crate::columns;
use crate::error::Error;
use crate::figures;
use crate::output::Output;

/// Time in s between two points of a waveform at most.
const RESOLUTION: f64 = 5e-6;

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
        "share_of": words::share_of(event),
        "probability": found.value,
        "low": found.low,
        "high": found.high,
        "widened": odds.widened,
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
        let (figure, caption) = typical(trials, tape, event, &setting)?;
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

/// The waveforms of a start with the event.
fn typical(trials: &Trials<'_>, tape: &Tape, event: Event, setting: &str) -> Result<(Figure, String), Error> {
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
    let title = format!("a typical start with {event}, rotor at {:.1}°", record.true_angle_deg());
    let conditions = format!("{setting}; {outcome}");
    Ok((
        figures::detection(&trace, &title, &conditions, super::found(&record)),
        format!("Of the likeliest sector the start nearest to its means: {outcome}."),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

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
