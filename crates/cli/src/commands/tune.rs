//! `standstill tune`: searches for the settings that minimise a measure while limits hold.

mod words;

use indexmap::IndexMap;
use serde_json::{Value, json};
use standstill_analysis::limit::{Limit, Limits, Measure, Tally};
use standstill_analysis::require::Bench;
use standstill_analysis::tune::{Effort, Goal, Judged, Question as Asked, Range, Tuned};
use standstill_campaign::Estimate;
use standstill_detect::keys as settings;
use standstill_quantity::{count, short};
use standstill_report::page::{Block, Tone};
use standstill_scenario::Document;

use super::question::{self, Key, Silence, document, plan_of, setting, silence};
use crate::answer::{Answer, Record, Records, verdict};
use crate::arguments::Tune as Options;
use crate::error::Error;
use crate::figures;
use crate::shell::command_line::{quoted, set};
use crate::shell::progress::Watched;
use crate::shell::values::shown;
use crate::shell::{NOT_SHOWN, Report};
use crate::summary::FAILING;

/// Keys that a user can change in a given drive. A timer's clock is one of them, because it has a prescaler. All other keys describe
/// hardware.
const DRIVE: [&str; 6] = [
    "inverter.carrier",
    "inverter.dc_link",
    "inverter.dead_time",
    "sensors.bandwidth",
    "sensors.range",
    "sensors.timer",
];

/// Default number of trials for the final settings.
const LAST: u64 = 20_000;
/// Largest number of trials for the final settings that `--trials` takes.
const MOST: u64 = 100_000_000;

pub fn run(options: &Options) -> Result<Report, Error> {
    let question = &options.question;
    let document = document(question)?;
    // Mistakes in the scenario itself are reported first.
    let plan = plan_of(document.clone())?;
    let ranges = ranges(options, &document)?;
    let minimise = options.minimise;
    let against = options.against.unwrap_or(match minimise {
        Measure::Duration => Measure::Rms,
        _ => Measure::Duration,
    });
    let last = options.trials.map_or(LAST, u64::from);
    let vary: Vec<String> = options.vary.iter().map(|(key, range)| format!("{key}={range}")).collect();
    let named = [
        ("--vary", Some(vary.join(", "))),
        ("--minimise", Some(minimise.to_string())),
        ("--subject-to", options.subject_to.as_ref().map(ToString::to_string)),
        ("--against", Some(against.to_string())),
        ("--trials", Some(last.to_string())),
        ("--starts", options.starts.map(|starts| starts.to_string())),
    ];
    let question = match question::Asked::new(question, "tune", &plan, named, 0)? {
        Ok(question) => question,
        Err(finished) => return Ok(finished),
    };
    let watched = &question.watched;
    let found = question.run(|| {
        let limits = limits(options, &document, plan.file().seed, last, watched)?;
        let effort = Effort::new(last, &limits);
        let starts = options.starts.map_or(effort.starts, usize::from);
        let wanted = options.subject_to.iter().flat_map(|subject| &subject.0);
        let relative = wanted.filter(|(measure, most)| most.is_none() && measure.unit().is_some());
        let asked = Asked {
            document: &document,
            relative: relative.map(|(measure, _)| *measure).collect(),
            ranges,
            goal: Goal { minimise, limits },
            against,
            effort: Effort { starts, ..effort },
            seed: plan.file().seed,
        };
        let mut hear = |stage: String| watched.bar.set_message(stage);
        let tuned = asked.tune(watched, &mut hear)?;
        let is_open = !tuned.is_found() || unanswered(&tuned) > FAILING;
        let starts = is_open.then(|| Silence::of_angles(&plan, watched)).transpose()?;
        Ok((asked, tuned, starts))
    })?;
    let Some((asked, tuned, starts)) = found else {
        return Ok(question.interrupted("the search was not complete"));
    };
    let scenario = plan.scenario(0)?;
    let again = question::again(&options.question);
    let rated = scenario.motor.rated_current;
    let answer = answer(setting(plan.file(), &scenario), &again, &asked, &tuned, starts.as_ref(), rated);
    let answer = match onward(options, &again, &asked, &tuned, rated) {
        Some((purpose, command)) => answer.next(purpose, command),
        None => answer,
    };
    let answer = match &starts {
        Some(starts) => silence::or_budget(answer, &options.question, &plan, starts)?,
        None => answer,
    };
    question.answer(&scenario, answer)
}

/// Returns the share of starts without an answer with the best settings.
fn unanswered(tuned: &Tuned) -> f64 {
    tuned.best.measured.get(Measure::Unanswered).value
}

/// Returns the keys of `--vary` with their ranges. The scenario must be valid at both ends.
fn ranges(options: &Options, document: &Document) -> Result<Vec<Range>, Error> {
    let keys: Vec<String> = options.vary.iter().map(|(key, _)| key.clone()).collect();
    if let Some(twice) = keys.iter().enumerate().find(|(k, key)| keys[..*k].contains(key)) {
        return Err(Error::Arguments(format!("--vary {}: twice", twice.1)));
    }
    let none = Limits(Vec::new());
    let bench = Bench::new(document, &none, &keys)?;
    let is_setting = |key: &str| key.starts_with("detector.") || DRIVE.contains(&key);
    if let Some(key) = keys.iter().find(|key| !is_setting(key)) {
        let scenario = document.scenario_of(&document.motor()?)?;
        let has = |key: &settings::Key| {
            matches!(key.kind, settings::Kind::Number { .. }) && scenario.detector.get(key).is_some()
        };
        let detector =
            settings::ALL.iter().filter(|key| has(key)).map(|key| format!("detector.{}", key.name));
        let names: Vec<String> = detector.chain(DRIVE.map(str::to_owned)).collect();
        return Err(Error::Arguments(format!(
            "--vary {key}: found a property of the motor or of a part, needed a setting of the detector or the drive: {}; what a part must do, \
             `standstill require --key {key}` answers",
            names.join(", ")
        )));
    }
    let mut ranges = Vec::new();
    for ((name, text), (_, whole)) in options.vary.iter().zip(&bench.keys) {
        let needed = "KEY=LOW:HIGH with LOW below HIGH, such as detector.pulse=50us:400us";
        let key = Key { option: format!("--vary {name}={text}"), name, whole: *whole, needed };
        let (low, high) = key.ends(text, document)?;
        ranges.push(Range { key: name.clone(), low, high, whole: *whole });
    }
    Ok(ranges)
}

/// Returns the limits. A limit without a number gets the value that trials with the initial settings have. If the measure is a share, the
/// limit is the upper end of the share's interval, but at least the smallest share that the search can resolve.
fn limits(
    options: &Options,
    document: &Document,
    seed: u64,
    trials: u64,
    watched: &Watched,
) -> Result<Limits, standstill_analysis::Halt<standstill_scenario::FileError>> {
    let wanted = options.subject_to.iter().flat_map(|subject| &subject.0);
    let open = |(measure, most): &(Measure, Option<f64>)| Limit {
        measure: *measure,
        most: most.unwrap_or(f64::INFINITY),
    };
    let mut limits = Limits(wanted.map(open).collect());
    if limits.0.iter().all(|limit| limit.most.is_finite()) {
        return Ok(limits);
    }
    let bench = Bench { document, limits: &limits, keys: Vec::new() };
    let tally: Option<Tally> = bench.tally(&[], seed, trials, watched)?;
    let estimates = tally.map(|tally| tally.estimates()).unwrap_or_default();
    for (limit, estimate) in limits.0.iter_mut().zip(estimates) {
        if limit.most.is_infinite() {
            let Estimate { value, high, .. } = estimate;
            let share = limit.measure.unit().is_none();
            limit.most = if share { high.max(Effort::least_share(trials)) } else { value * (1.0 + 1e-9) };
        }
    }
    Ok(limits)
}

/// Returns the search that is to come next, with its purpose: one that keeps rated current, if the settings found draw more, or one with
/// ten times the trials, if it is not sure that they are better. None if the settings are sure, or if the host has no command line.
fn onward(
    options: &Options,
    again: &str,
    asked: &Asked<'_>,
    tuned: &Tuned,
    rated: f64,
) -> Option<(&'static str, String)> {
    if !tuned.is_found() || unanswered(tuned) >= 1.0 {
        return None;
    }
    let (mut limits, mut trials) = (options.subject_to.as_ref().map(ToString::to_string), asked.effort.last);
    let purpose = if words::exceeding(rated, asked, tuned).is_some() {
        let current = format!("peak_current <= {} A", short(rated));
        limits = Some(limits.map_or_else(|| current.clone(), |limits| format!("{limits}, {current}")));
        "settings that draw no more than rated current"
    } else if tuned.surely_better(&asked.goal) || trials >= MOST / 10 {
        return None;
    } else {
        trials *= 10;
        "ten times the trials tell smaller differences"
    };
    let pairs = options.vary.iter().map(|(key, range)| quoted(&format!("{key}={range}")));
    let vary = pairs.fold(String::new(), |line, pair| line + " --vary " + &pair);
    let option = |name: &str, value: Option<String>| {
        value.map_or_else(String::new, |value| format!(" {name} {}", quoted(&value)))
    };
    let minimise = option("--minimise", Some(options.minimise.to_string()));
    let limits = option("--subject-to", limits);
    let against = option("--against", options.against.map(|against| against.to_string()));
    let starts = option("--starts", options.starts.map(|starts| starts.to_string()));
    let command =
        format!("standstill tune {again}{vary}{minimise}{limits}{against}{starts} --trials {trials}");
    Some((purpose, command))
}

/// Returns values and measures by name as JSON, in SI units and degrees.
fn json_of(asked: &Asked<'_>, judged: &Judged) -> Value {
    json!({ "settings": settings_json(asked, judged), "measures": measures_json(&judged.measured.0) })
}

fn settings_json(asked: &Asked<'_>, judged: &Judged) -> Value {
    let number = |value: &f64| if value.is_nan() { Value::Null } else { json!(value) };
    let pairs = asked.ranges.iter().zip(&judged.values);
    let values: IndexMap<&str, Value> =
        pairs.map(|(range, value)| (range.key.as_str(), number(value))).collect();
    json!(values)
}

fn measures_json(measures: &[(Measure, Estimate)]) -> Value {
    // JSON has no infinite numbers.
    let number = |value: f64| if value.is_finite() { json!(value) } else { Value::Null };
    let one = |(measure, e): &(Measure, Estimate)| {
        (
            measure.to_string(),
            json!({ "value": number(e.value), "low": number(e.low), "high": number(e.high) }),
        )
    };
    json!(measures.iter().map(one).collect::<IndexMap<String, Value>>())
}

fn answer(
    setting: String,
    again: &str,
    asked: &Asked<'_>,
    tuned: &Tuned,
    starts: Option<&Silence>,
    rated: f64,
) -> Answer {
    let (tone, headline) = words::within(rated, asked, tuned, words::headline(asked, tuned));
    let mut details = words::details(asked, tuned);
    let starts = starts.filter(|starts| starts.is_frequent());
    details.extend(starts.map(|starts| format!("as it is set: {}", starts.sentence())));
    // Settings that break a limit, or with which no start has an answer, are not offered for copying.
    let is_silent = unanswered(tuned) >= 1.0;
    let found = tuned.is_found() && !is_silent;
    let settings = found.then(|| words::toml(asked, &tuned.best));
    let mut json = json!({
        "minimise": asked.goal.minimise.to_string(),
        "limit": asked.goal.limits.to_string(),
        "settings": found.then(|| settings_json(asked, &tuned.best)),
        "start": json_of(asked, &tuned.start),
        "best": found.then(|| json_of(asked, &tuned.best)),
        "differences": measures_json(&tuned.differences.0),
        "surely_better": tuned.surely_better(&asked.goal),
        "unseen": tuned.unseen().map(|unseen| json!({ "share": unseen.share, "rms_deg": unseen.rms_deg })),
        "limits_hold": { "likely": tuned.limits.holds, "surely": tuned.limits.surely },
        "front": tuned.front.iter().map(|judged| json_of(asked, judged)).collect::<Vec<_>>(),
        "toml": settings,
        "looks": tuned.looks.len(),
        "trials": asked.effort.last,
        "judged_on_seed": asked.seed.wrapping_add(2),
    });
    if !found {
        json["nearest"] = json_of(asked, &tuned.best);
    }
    let look = |look: &standstill_analysis::tune::Look| {
        Record::default()
            .with("settings", words::settings(asked, &look.values))
            .with("trials", look.trials)
            .with("possible", look.measured.is_some())
            .with("measures", look.measured.as_ref().map_or_else(String::new, |m| words::measures(&m.0)))
    };
    let records: Records = tuned.looks.iter().map(look).collect();
    let figure = figures::tune(asked, tuned, setting.clone());
    let (trials, seed, last) = (count(asked.effort.last), asked.seed.wrapping_add(2), words::last(tuned));
    let line = if found {
        "The line joins the settings of which none is better in both. These, start and best"
    } else {
        "No settings that were looked at keep the limits. Start and nearest"
    };
    let caption = format!(
        "{line} are judged on the same {trials} trials of seed {seed}. Marks without intervals are settings that the search \
         looked at, on fewer trials of seed {}: they cannot be compared with the others, and may be better by chance.",
        asked.seed
    );
    let about = format!("Start and {last} on the same fresh trials");
    let table = Block::Table(words::table(asked, tuned).captioned(about));
    let copied = settings.map(|text| Block::Code { caption: "Settings to copy".to_owned(), text });
    let blocks = std::iter::once(table).chain(copied).collect();
    let title = format!("Settings with the smallest {}", asked.goal.minimise);
    let answer = Answer::new("tune", title, setting, verdict(tone, headline, details), blocks);
    let code = if is_silent { NOT_SHOWN } else { u8::from(!tuned.limits.holds || tone == Tone::Bad) };
    let answer = Answer { json, csv: Some(records), code, ..answer.with("tune", figure, caption) };
    if !found {
        return answer;
    }
    let pairs = asked.ranges.iter().zip(&tuned.best.values);
    let keys = pairs.map(|(range, value)| set(&range.key, &shown(&range.key, *value)));
    let label = if tuned.seems_better(&asked.goal) {
        "starts with these settings"
    } else {
        "starts with these settings, which are not surely better than the start"
    };
    answer.next(label, format!("standstill run {again}{}", keys.collect::<String>()))
}
