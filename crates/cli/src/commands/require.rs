//! `standstill require`: what a part must do for limits to hold.

mod tradeoff;
mod unanswered;

pub use tradeoff::{EVERYWHERE, Point};
pub use unanswered::{Unanswered, percent};

use serde::Serialize;
use serde_json::json;
use standstill_analysis::Halt;
use standstill_analysis::bracket::{Edge, Found, Search, Side};
use standstill_analysis::limit::Limits;
use standstill_analysis::require::{Bench, Judgement};
use standstill_campaign::Estimate;
use standstill_quantity::{Scale, listed};
use standstill_report::page::{Block, Page, Section, Tone};
use standstill_scenario::{FileError, Plan};

use super::question::{
    self, Answer, Identity, Key, document, folder, interrupted, json as with_setup, on_threads, plan,
    setting, unless_stopped,
};
use crate::Report;
use crate::arguments::Require as Options;
use crate::columns;
use crate::error::Error;
use crate::figures::{self, Judged};
use crate::output::Output;
use crate::progress::Watched;
use crate::summary::{decimals_of, fixed};

const FILES: [&str; 5] = ["require.csv", "require.json", "require.html", "require.svg", "require.png"];

/// How far from the scenario's value is looked, as a factor either way.
const FACTOR: f64 = 30.0;

/// Values of the scan, trials at each, and at most at one.
const POINTS: usize = 17;
const TRIALS: u64 = 1000;
const MOST: u64 = 300_000;

/// A row of `require.csv`: a value that was judged.
#[derive(Clone, Debug, Serialize)]
struct Row {
    value: f64,
    trials: u64,
    holds: bool,
    measures: String,
}

/// What is asked.
struct Question<'a> {
    bench: Bench<'a>,
    limits: Limits,
    search: Search,
    identity: Identity,
    watched: &'a Watched,
    judged: Vec<Judged>,
    rows: Vec<Row>,
}

impl Question<'_> {
    /// The edge over the last key, with these values of the keys before it.
    fn find(&mut self, before: &[f64]) -> Result<Found, Halt<FileError>> {
        let Self { bench, search, watched, judged, rows, .. } = self;
        search.find(&mut |value, trials| {
            let values: Vec<f64> = before.iter().copied().chain([value]).collect();
            if before.is_empty() {
                watched.bar.set_message(format!("{trials} trials at {}", shown(&bench.keys[0].0, value)));
            }
            let Some(judgement) = bench.judge(&values, trials, *watched)? else { return Ok(None) };
            let Judgement { measures, verdict, without_answer } = judgement;
            let measures_text: Vec<String> = measures.iter().map(measure).collect();
            let measures_text = measures_text.join("; ");
            rows.push(Row { value, trials, holds: verdict.holds, measures: measures_text });
            judged.push(Judged { value, trials, measures, without_answer });
            Ok(Some(verdict))
        })
    }
}

fn measure(estimate: &Estimate) -> String {
    let Estimate { value, low, high } = estimate;
    format!("{value:.4e} [{low:.4e}, {high:.4e}]")
}

pub fn run(options: &Options) -> Result<Report, Error> {
    let question = &options.question;
    let document = document(question)?;
    // What is wrong with the scenario itself shows first.
    let plan = plan(question)?;
    if options.key.len() > 2 {
        return Err(Error::Arguments("--key: one, or two for a trade-off curve".to_owned()));
    }
    if let [first, second] = &options.key[..]
        && first == second
    {
        return Err(Error::Arguments(format!(
            "--key: {first} is there twice; a trade-off curve needs two keys"
        )));
    }
    let bench = Bench::new(&document, &options.limit, &options.key)?;
    if let Some(folder) = folder(question, "require") {
        drop(Output::create(&folder, &FILES)?);
    }
    let ranges =
        (0..options.key.len()).map(|key| range(options, &bench, key)).collect::<Result<Vec<_>, _>>()?;
    let last = ranges.len() - 1;
    let search = Search {
        range: ranges[last],
        points: POINTS,
        trials: TRIALS,
        most: options.most.map_or(MOST, u64::from),
        sure_from: options.limit.least_trials(),
        width: 0.05,
        whole: bench.keys[last].1,
    };
    let identity = Identity::new(
        &plan,
        [
            ("--key", Some(options.key.join(", "))),
            ("--limit", Some(options.limit.to_string())),
            ("--between", (!options.between.is_empty()).then(|| options.between.join(", "))),
            ("--most", Some(search.most.to_string())),
        ],
    )?;
    let watched = question::watched(question, "require", &identity, 0)?;
    let limits = options.limit.clone();
    let mut asked =
        Question { bench, limits, search, identity, watched: &watched, judged: Vec::new(), rows: Vec::new() };
    if last == 1 {
        return tradeoff::run(options, &plan, &mut asked, ranges[0]);
    }
    let found = on_threads(question, || asked.find(&[]))?;
    watched.bar.finish_and_clear();
    let Some(found) = unless_stopped(found)? else {
        return Ok(interrupted(
            question,
            "require",
            &watched,
            &format!("{} values were judged", asked.rows.len()),
        ));
    };
    answer(options, &plan, &asked, &found)?.report(question, &asked.identity)
}

/// The range of a key: what is asked for, or about the scenario's value.
fn range(options: &Options, bench: &Bench<'_>, number: usize) -> Result<(f64, f64), Error> {
    let (key, whole) = &bench.keys[number];
    if let Some(text) = options.between.get(number) {
        let needed = "FROM:TO with FROM below TO, such as \"1 mA:50 mA\"";
        let option = format!("--between {text}");
        return Key { option, name: key, whole: *whole, needed }.ends(text, bench.document);
    }
    match bench.nominal(number) {
        Some(value) if *whole && value > 0.0 => Ok((1.0, (4.0 * value).max(8.0))),
        Some(value) if value > 0.0 => Ok((value / FACTOR, value * FACTOR)),
        _ => Err(Error::Arguments(format!(
            "--key {key}: the scenario has no value above zero of it to look about; needed --between FROM:TO"
        ))),
    }
}

/// A key's value in its unit.
pub fn shown(key: &str, value: f64) -> String {
    if standstill_scenario::is_share(key) {
        return format!("{} %", listed(&[100.0 * value], "").trim_end());
    }
    listed(&[value], &standstill_scenario::unit(key).unwrap_or_default()).trim_end().to_owned()
}

/// A key's value with its interval, in the unit that suits it, in no more digits than two of half the interval's width; of whole
/// numbers all.
fn shown_interval((key, whole): (&str, bool), [value, low, high]: [f64; 3]) -> String {
    let scale = if standstill_scenario::is_share(key) {
        Scale::percent()
    } else {
        Scale::suiting(&standstill_scenario::unit(key).unwrap_or_default(), value.abs())
    };
    let all = [value, low, high].map(|x| scale.number(x));
    let decimals = if whole { 0 } else { decimals_of(all) };
    let gap = if scale.unit.is_empty() || scale.unit == "°" { "" } else { " " };
    let [value, low, high] = all.map(|x| fixed(x, decimals) + gap + &scale.unit);
    format!("{value} [{low}, {high}]")
}

fn sentence(key: &str, whole: bool, limits: &Limits, edge: &Edge) -> String {
    let side = match edge.side {
        Side::Largest => "at most",
        Side::Smallest => "at least",
    };
    let value = shown_interval((key, whole), [edge.value, edge.interval.0, edge.interval.1]);
    format!("{key} {side} {value} for {limits}")
}

/// What else there is to say of an edge.
fn notes(key: &str, search: &Search, edge: &Edge, needed: Option<u64>) -> Vec<String> {
    let mut notes = vec![format!(
        "[95 % interval], {} trials at the last values, the same random numbers at each",
        edge.trials
    )];
    if !edge.is_monotone(search) {
        let stretches: Vec<String> = edge
            .stretches
            .iter()
            .map(|(from, to)| format!("{} to {}", shown(key, *from), shown(key, *to)))
            .collect();
        notes.push(format!(
            "not monotone: of the values looked at it holds from {}",
            stretches.join(", and from ")
        ));
    }
    if !edge.narrow {
        notes.push(unanswered::wide(search.width, needed));
    }
    notes
}

fn answer(options: &Options, plan: &Plan, asked: &Question<'_>, found: &Found) -> Result<Answer, Error> {
    let key = &asked.bench.keys[0].0;
    let scenario = plan.scenario(0)?;
    let setting = setting(plan.file(), &scenario);
    let (from, to) = asked.search.range;
    let looked = format!("from {} to {}", shown(key, from), shown(key, to));
    let limits = &options.limit;
    let mut json = json!({
        "key": key, "value": null, "low": null, "high": null, "limit": limits.to_string(),
        "searched": [from, to],
        "trials": asked.rows.iter().map(|row| row.trials).sum::<u64>(),
    });
    let (headline, details, tone) = match found {
        Found::Nowhere => {
            json["answer"] = "no value meets it".into();
            (format!("No value of {key} {looked} meets {limits}"), Vec::new(), Tone::Bad)
        }
        Found::Everywhere => {
            json["answer"] = "every value meets it".into();
            (format!("Every value of {key} {looked} meets {limits}"), Vec::new(), Tone::Good)
        }
        Found::Edge(edge) => {
            json["answer"] = match edge.side {
                Side::Largest => "at most",
                Side::Smallest => "at least",
            }
            .into();
            json["value"] = edge.value.into();
            json["low"] = edge.interval.0.into();
            json["high"] = edge.interval.1.into();
            json["monotone"] = edge.is_monotone(&asked.search).into();
            json["narrow"] = edge.narrow.into();
            let needed = (!edge.narrow)
                .then(|| unanswered::trials_needed(limits, &asked.judged, edge, asked.search.width))
                .flatten();
            json["trials_needed"] = json!(needed);
            let mut details = notes(key, &asked.search, edge, needed);
            let unanswered = Unanswered::of(limits, &asked.judged, edge);
            details.extend(unanswered.iter().map(ToString::to_string));
            details.extend(unanswered::too_few(limits, edge));
            json["without_answer"] = json!(unanswered);
            let sure = edge.narrow && edge.is_monotone(&asked.search);
            (
                sentence(key, asked.bench.keys[0].1, limits, edge),
                details,
                if sure { Tone::Neutral } else { Tone::Warning },
            )
        }
    };
    let lines: Vec<String> = details.iter().map(|note| format!("  {note}\n")).collect();
    let figure = figures::require(key, limits, &asked.judged, found, setting.clone());
    let caption = "Each measure over its limit, at each value that was judged, with its 95 % interval.";
    let blocks = vec![Block::Verdict { tone, headline: headline.clone(), details }];
    Ok(Answer {
        name: "require",
        text: format!("{setting}\n{headline}\n{}", lines.concat()),
        json: with_setup(plan.file(), &scenario, json),
        csv: columns::csv(&asked.rows).map_err(|error| Error::Write("require.csv".into(), error))?,
        figures: vec![("require".to_owned(), figure, caption.to_owned())],
        page: Page {
            title: format!("What {key} must be"),
            subtitle: setting,
            sections: vec![Section { title: "Answer".to_owned(), blocks }],
            footer: String::new(),
        },
        code: u8::from(!matches!(found, Found::Edge(_))),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_values_have_no_digits_beyond_their_intervals() {
        let said = |key: &str, all: [f64; 3]| shown_interval((key, false), all);
        let noise = said("sensors.noise", [0.014_483, 0.014_221, 0.014_744]);
        assert_eq!(noise, "14.48 mA [14.22 mA, 14.74 mA]");
        assert_eq!(said("sensors.noise", [0.0145, 0.0108, 0.0161]), "14.5 mA [10.8 mA, 16.1 mA]");
        assert_eq!(said("sensors.gain_error", [0.0051, 0.0048, 0.0054]), "0.510 % [0.480 %, 0.540 %]");
        assert_eq!(shown_interval(("detector.rounds", true), [3.0, 3.0, 4.0]), "3 [3, 4]");
    }
}
