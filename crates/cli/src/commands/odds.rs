//! `standstill odds`: the probability of a rare event, and the errors of drive and sensors that typically cause it.

mod words;

use std::sync::Mutex;

use standstill_analysis::subset::{Effort, End, Run, Settings};
use standstill_analysis::{Alarm, Anatomy, Event, GIVEN_UP, Odds, RUNS, Trials, Watch};
use standstill_detect::Method;
use standstill_report::figure::Figure;
use standstill_scenario::{Plan, Scenario};
use standstill_sim::{RotorState, Tape};

use super::question::silence::{self, Needs, STARTS};
use super::question::{Asked, Silence, again, plan, setting};
use crate::arguments::Odds as Options;
use crate::error::Error;
use crate::figures;
use crate::shell::progress::Watched;
use crate::shell::values::probability;
use crate::shell::{Report, locked};

/// Largest number of plain trials that the answer proposes for finding a few starts with the event. They take some minutes.
const MOST_PLAIN: f64 = 100_000.0;

pub fn run(options: &Options) -> Result<Report, Error> {
    let question = &options.question;
    let plan = plan(question)?;
    let trials = Trials::new(&plan)?;
    can_happen(options.event, &plan, trials.scenario())?;
    let effort = (options.effort != Effort::default()).then(|| options.effort.name().to_owned());
    let settings = Settings::of(options.effort, plan.file().seed);
    let named = [("--event", Some(options.event.to_string())), ("--effort", effort)];
    let asked = match Asked::new(question, "odds", &plan, named, STARTS + expected(&settings, &[]))? {
        Ok(asked) => asked,
        Err(finished) => return Ok(finished),
    };
    let bar = &asked.watched.bar;
    let listening = Listening { watched: &asked.watched, found: Mutex::default() };
    let mut done = Vec::new();
    let answered = asked.run(|| {
        bar.set_message("plain starts");
        let starts = Silence { needs: needs(options.event), ..Silence::of_angles(&plan, &asked.watched)? };
        if is_empty(options.event, &starts) {
            return Ok((starts, None));
        }
        bar.set_message(progress(&SoFar::default()));
        let hear = |run: &Run| {
            done.push((run.end, run.levels));
            bar.set_length(STARTS + expected(&settings, &done));
            listening.hear(|so_far| {
                so_far.runs.push((run.end, run.probability));
                so_far.level = None;
            });
        };
        let odds = trials.odds(options.event, &settings, &listening, hear)?;
        let anatomy = Anatomy::of(&trials, options.event, &odds.failures, &asked.watched)?;
        Ok((starts, Some((odds, anatomy))))
    })?;
    let Some((starts, found)) = answered else {
        return Ok(asked.interrupted(&listening.interrupted()));
    };
    let setting = setting(plan.file(), trials.scenario());
    let Some((odds, anatomy)) = found else {
        let answer = words::unanswered(setting, options.event, &starts);
        return asked.answer(trials.scenario(), silence::lead(answer, question, plan.file()));
    };
    let in_sectors = trials.scenario().detector.half_sector().is_some();
    let mut answer = words::answer(setting.clone(), options.event, in_sectors, &odds, &anatomy, &starts);
    if !odds.runs.is_empty() {
        let caption =
            "Each run goes down by levels of a tenth; where they meet the event, their mean counts.";
        let figure = figures::odds(&odds, options.event, in_sectors, setting.clone());
        answer = answer.with("odds", figure, caption);
    }
    if let Some(tape) = &anatomy.typical {
        let (figure, caption) = typical(&trials, tape, options.event, &setting)?;
        answer = answer.with("typical", figure, caption);
    }
    let again = again(question);
    let likely = odds.probability.value;
    let needed = (10.0 / likely).ceil().max(1000.0);
    let answer = if needed <= MOST_PLAIN {
        answer.next(
            "some ten such starts among plain trials, to be explained one by one",
            // The folder of a run of the same scenario has another number of trials.
            format!("standstill run {again} --trials {needed} --out plain-{needed}"),
        )
    } else if likely > 0.0 {
        answer.next(
            format!(
                "which part of the drive makes the error (ten such starts would need {} plain trials, {} as many as were run here)",
                words::about(needed),
                words::times(needed / odds.trials as f64)
            ),
            format!("standstill budget {again}"),
        )
    } else {
        // If none of n trials has the event, its probability is at most 3.7/n.
        let times = words::times(1e6 / odds.trials as f64);
        answer.next(
            format!("plain trials bound it by 3.7 over their number ({times} as many trials as here)"),
            format!("standstill run {again} --rows none --trials 1000000 --out plain-1000000"),
        )
    };
    let answer = match deeper(options.effort, &odds) {
        Some((depth, deeper)) => answer.next(
            format!("levels down to {depth:.0e}"),
            format!("standstill odds {again} --event \"{}\" --effort {deeper}", options.event),
        ),
        None => answer,
    };
    let is_silent = is_about_answers(options.event) && starts.is_frequent();
    let answer = if is_silent { silence::lead(answer, question, plan.file()) } else { answer };
    asked.answer(trials.scenario(), answer)
}

/// Refuses an event that cannot happen in any start of the scenario.
fn can_happen(event: Event, plan: &Plan, scenario: &Scenario<Method<f64>>) -> Result<(), Error> {
    let motor = &scenario.motor;
    let (found, needed) = match event {
        _ if event.is_of_poles() && !motor.has_magnet() => (
            format!("the motor {}, which has no magnet and so no poles", motor.name),
            "`failed`, `|e| > 3 deg`, `moved > 1 deg` or `peak_current > 8 A`",
        ),
        Event::WrongPole | Event::WrongEvidence if plan.pole_is_open() => (
            format!(
                "the motor {}, whose data leave its poles open, so that no start judges them",
                motor.name
            ),
            "`failed`, `|e| > 3 deg`, or data of which pole draws more current (`standstill magnetics`)",
        ),
        Event::Moved(_) if scenario.rotor == RotorState::Locked => {
            ("a rotor that is held, which never moves".to_owned(), "another event, or `-s rotor.state=free`")
        }
        _ => return Ok(()),
    };
    Err(Error::Arguments(format!("`--event {event}`: found {found}, needed {needed}")))
}

/// Returns the result, an axis or an angle, without which the event is not defined for a start.
const fn needs(event: Event) -> Needs {
    match event {
        Event::Error(_) | Event::WrongEvidence => Needs::Axis,
        _ => Needs::Angle,
    }
}

/// Returns true if the event is possible only in starts with an answer. Starts without an answer then make the event rarer.
const fn is_about_answers(event: Event) -> bool {
    matches!(event, Event::WrongPole | Event::WrongEvidence | Event::Error(_))
}

/// Returns true if the event is possible only in starts with an answer, but no start has one. The probability of the event would then say
/// nothing about the detector.
fn is_empty(event: Event, starts: &Silence) -> bool {
    is_about_answers(event) && starts.answered() == 0
}

/// Returns the smallest probability that the next higher effort can estimate, and the name of this effort. None if no run stopped because
/// the event was too rare, or if there is no higher effort.
fn deeper(effort: Effort, odds: &Odds) -> Option<(f64, &'static str)> {
    let gave_up = odds.alarms.iter().any(|alarm| matches!(alarm, Alarm::TooRare { .. }));
    let next = effort.deeper()?;
    gave_up.then_some((next.least(), next.name()))
}

/// Intermediate results of subset simulation, which estimates the probability of a rare event by levels of increasing rarity.
#[derive(Default)]
struct SoFar {
    /// Results of the finished runs: the reason why the run ended, and a probability. This is the probability of the event, or that of the
    /// last level if the run did not reach the event.
    runs: Vec<(End, f64)>,
    /// Probability of the level that the current run has reached. None before the first level.
    level: Option<f64>,
}

/// Observer that prints the progress of the runs on the terminal.
struct Listening<'a> {
    watched: &'a Watched,
    found: Mutex<SoFar>,
}

impl Listening<'_> {
    fn hear(&self, of: impl FnOnce(&mut SoFar)) {
        let mut found = locked(&self.found);
        of(&mut found);
        self.watched.bar.set_message(progress(&found));
    }

    fn interrupted(&self) -> String {
        let found = locked(&self.found);
        let known = known(&found).map_or_else(String::new, |known| format!(", {known}"));
        format!("{} of {RUNS} runs were done{known}", found.runs.len())
    }
}

impl Watch for Listening<'_> {
    fn stopped(&self) -> bool {
        self.watched.stopped()
    }

    fn did(&self, trials: u64) {
        self.watched.did(trials);
    }

    fn came_to(&self, _level: u32, probability: f64) {
        self.hear(|so_far| so_far.level = Some(probability));
    }

    fn recall(&self, key: &str) -> Option<Vec<u8>> {
        self.watched.recall(key)
    }

    fn keep(&self, key: &str, bytes: &[u8]) {
        self.watched.keep(key, bytes);
    }
}

/// Returns the intermediate result as text. Once a run has reached the event, this is the probability of the event. Before, it is an upper
/// limit from the levels that were reached.
fn known(so_far: &SoFar) -> Option<String> {
    let reached = so_far.runs.iter().filter(|(end, _)| *end == End::Reached);
    let sum: f64 = reached.clone().map(|(_, found)| found).sum();
    if reached.count() > 0 {
        return Some(format!("so far {}", probability(sum / so_far.runs.len() as f64)));
    }
    let levels = so_far.runs.iter().filter(|(end, _)| *end == End::TooRare).map(|(_, level)| *level);
    // Of the runs that gave up, the one with the most probable last level gives the upper limit.
    let lowest =
        levels.fold(None, |most: Option<f64>, level| Some(most.map_or(level, |most| most.max(level))));
    let level = lowest.or(so_far.level)?;
    Some(format!("at most {level:.0e} so far, if the levels lead to all of it"))
}

fn progress(so_far: &SoFar) -> String {
    if let Some((End::Flat, _)) = so_far.runs.last() {
        return "nothing leads to the event: plain trials".to_owned();
    }
    let run = format!("run {} of {RUNS}", (so_far.runs.len() + 1).min(RUNS as usize));
    known(so_far).map_or_else(|| run.clone(), |known| format!("{run}, {known}"))
}

/// Estimates the total number of trials. `done` has the reason for the end and the number of levels of each finished run.
fn expected(settings: &Settings, done: &[(End, u32)]) -> u64 {
    /// Number of levels assumed before any run has finished.
    const LEVELS: f64 = 6.0;
    let levels = if done.is_empty() {
        LEVELS
    } else {
        done.iter().map(|(_, levels)| f64::from(*levels)).sum::<f64>() / done.len() as f64
    };
    let states = f64::from(settings.states);
    // Each state except the seeds of the chains takes three moves.
    let level = 3.0 * states * (1.0 - 1.0 / f64::from(settings.chain));
    // If the first runs all give up, the later runs consist of their plain trials only.
    let is_given_up = !done.is_empty() && done.iter().all(|(end, _)| *end == End::TooRare);
    let runs = if is_given_up { GIVEN_UP } else { RUNS as usize };
    // The number is some millions, so the conversion is exact enough.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let mut trials = (f64::from(RUNS) * states + runs as f64 * (levels - 1.0).max(0.0) * level) as u64;
    if levels > 1.0 {
        trials += settings.sampled();
    }
    // If most runs find no direction toward the event, plain trials follow. If the first run finds none at its first level, they follow at
    // once.
    match done {
        [(End::Flat, 1)] => u64::from(settings.states + settings.counted()),
        _ if done.iter().filter(|(end, _)| *end == End::Flat).count() * 2 > RUNS as usize => {
            trials + u64::from(settings.counted())
        }
        _ => trials,
    }
}

/// Plots the waveforms of a typical start with the event. `tape` has the random numbers of the start. Returns the figure and its caption.
fn typical(trials: &Trials<'_>, tape: &Tape, event: Event, setting: &str) -> Result<(Figure, String), Error> {
    let scenario = trials.plan().scenario_taped(0, trials.scenario(), tape)?;
    let case = scenario.case_taped(tape);
    let (record, _, trace) = scenario.watched(&case, true, f64::INFINITY)?;
    let title = format!("a typical start with {event}, rotor at {:.1}°", record.true_angle_deg());
    let outcome = record.in_words(2);
    let conditions = format!("{setting}; {outcome}");
    let figure = super::waveforms(&trace, &title, &conditions, &scenario, &record);
    Ok((figure, format!("Of the likeliest sector the start nearest to its means: {outcome}.")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_progress_does_not_show_a_level_as_the_event() {
        let (reached, rare) = ((End::Reached, 2e-6), (End::TooRare, 1e-16));
        let of = |runs: &[(End, f64)], level| progress(&SoFar { runs: runs.to_vec(), level });
        assert_eq!(of(&[], None), "run 1 of 8");
        let bound = "if the levels lead to all of it";
        assert_eq!(of(&[], Some(1.02e-3)), format!("run 1 of 8, at most 1e-3 so far, {bound}"));
        assert_eq!(of(&[rare], Some(1e-2)), format!("run 2 of 8, at most 1e-16 so far, {bound}"));
        assert_eq!(of(&[rare, reached], Some(1e-2)), "run 3 of 8, so far 1.00e-6");
        assert_eq!(of(&[reached; 8], None), "run 8 of 8, so far 2.00e-6");
        assert!(!of(&[(End::Flat, 1.0)], None).contains("1.0"));
    }

    #[test]
    fn law_the_expected_work_is_that_of_three_runs_once_the_first_gave_up() {
        let settings = Settings::default();
        // 4,000 trials a run, and 10,800 a level of those that go down.
        assert_eq!(expected(&settings, &[(End::Reached, 5)]), 8 * (4000 + 4 * 10_800) + 40_000);
        assert_eq!(expected(&settings, &[(End::TooRare, 13)]), 8 * 4000 + 3 * 12 * 10_800 + 40_000);
        assert_eq!(
            expected(&settings, &[(End::TooRare, 13), (End::Reached, 13)]),
            8 * (4000 + 12 * 10_800) + 40_000
        );
    }

    #[test]
    fn law_the_expected_trials_include_the_plain_ones_where_nothing_leads_to_the_event() {
        let settings = Settings::of(Effort::Quick, 1);
        // One run's first level of 1,000 states, then the count.
        assert_eq!(expected(&settings, &[(End::Flat, 1)]), 101_000);
        let runs = |flat: usize| [vec![(End::Flat, 2); flat], vec![(End::Reached, 2); 8 - flat]].concat();
        assert_eq!(expected(&settings, &runs(5)), expected(&settings, &runs(4)) + 100_000);
    }
}
