//! `standstill require`: the values of a key (a property of a part) with which limits hold.

mod refused;
mod tradeoff;
mod unanswered;
mod words;

pub use unanswered::Unanswered;

use serde_json::json;
use standstill_analysis::Halt;
use standstill_analysis::bracket::{Bound, Edge, Found, Search, Side, Stretch};
use standstill_analysis::limit::{Limit, Limits};
use standstill_analysis::require::{Bench, Judged, Taken};
use standstill_campaign::Estimate;
use standstill_quantity::{count, short, significant};
use standstill_report::page::Tone;
use standstill_scenario::{FileError, Plan};

use self::refused::Refused;
use super::question::{self, Key, Silence, check_command, document, plan_of, setting, silence};
use crate::answer::{Answer, Record, Records, verdict};
use crate::arguments::{Question, Require as Options};
use crate::error::Error;
use crate::figures;
use crate::shell::Report;
use crate::shell::command_line::{quoted, set};
use crate::shell::values::{scale, shown};

/// Factor by which the default range extends above and below the scenario's value.
const FACTOR: f64 = 30.0;

/// Number of values in the first scan of a key's range.
const POINTS: usize = 17;
/// Number of trials at each value of the first scan.
const TRIALS: u64 = 1000;
/// Default of the largest number of trials at one value.
const MOST: u64 = 300_000;

/// The search for an edge, and all key values that it has judged so far. An edge is the largest or smallest value of a key at which the
/// limits hold.
struct EdgeSearch<'a> {
    bench: Bench<'a>,
    limits: Limits,
    search: Search,
    asked: &'a question::Asked<'a>,
    taken: Taken,
    judged: Vec<Judged>,
    rows: Records,
    refused: Refused,
}

impl EdgeSearch<'_> {
    /// Finds the edge of the last key. `before` contains the values of all other keys, in SI units.
    fn find(&mut self, before: &[f64]) -> Result<Found, Halt<FileError>> {
        let Self { bench, search, asked, taken, judged, rows, refused, .. } = self;
        let watched = &asked.watched;
        search.find(&mut |value, trials| {
            let values: Vec<f64> = before.iter().copied().chain([value]).collect();
            if before.is_empty() {
                watched.bar.set_message(format!(
                    "{} trials at {}",
                    count(trials),
                    shown(&bench.keys[0].0, value)
                ));
            }
            let (one, look) = match bench.judge(&values, trials, taken, watched)? {
                Ok(found) => found,
                Err(error) => {
                    refused.add(value, error);
                    return Ok(None);
                }
            };
            let measures: Vec<String> = one.measures.iter().map(measure).collect();
            rows.0.push(
                Record::default()
                    .with("value", value)
                    .with("trials", one.trials)
                    .with("holds", look.verdict().holds)
                    .with("measures", measures.join("; ")),
            );
            judged.push(one);
            Ok(Some(look))
        })
    }

    /// Returns the total number of trials, including those at values that were later judged again with more trials.
    fn trials(&self) -> u64 {
        self.judged.iter().map(|judged| judged.trials).sum()
    }
}

fn measure(estimate: &Estimate) -> String {
    let Estimate { value, low, high } = estimate;
    format!("{value:.4e} [{low:.4e}, {high:.4e}]")
}

pub fn run(options: &Options) -> Result<Report, Error> {
    let question = &options.question;
    let document = document(question)?;
    // Mistakes in the scenario itself are reported first.
    let plan = plan_of(document.clone())?;
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
    let ranges =
        (0..options.key.len()).map(|key| range(options, &bench, key)).collect::<Result<Vec<_>, _>>()?;
    let last = ranges.len() - 1;
    let most = options.most.map_or(MOST, u64::from);
    let search = Search {
        range: ranges[last],
        points: POINTS,
        trials: TRIALS.min(most),
        most,
        sure_from: options.limit.least_trials(),
        width: 0.05,
        whole: bench.keys[last].1,
    };
    let named = [
        ("--key", Some(options.key.join(", "))),
        ("--limit", Some(options.limit.to_string())),
        ("--between", (!options.between.is_empty()).then(|| options.between.join(", "))),
        ("--most", Some(search.most.to_string())),
    ];
    let asked = match question::Asked::new(question, "require", &plan, named, 0)? {
        Ok(asked) => asked,
        Err(finished) => return Ok(finished),
    };
    let limits = options.limit.clone();
    let mut found = EdgeSearch {
        bench,
        limits,
        search,
        asked: &asked,
        taken: Taken::default(),
        judged: Vec::new(),
        rows: Records::default(),
        refused: Refused::default(),
    };
    if last == 1 {
        return tradeoff::run(options, &plan, &mut found, ranges[0]);
    }
    let done = asked.run(|| {
        let edge = found.find(&[])?;
        let is_silent = matches!(edge, Found::Nowhere);
        let starts = is_silent.then(|| Silence::of_angles(&plan, &asked.watched)).transpose()?;
        Ok((edge, starts))
    })?;
    let Some((edge, starts)) = done else {
        return Ok(asked.interrupted(&format!("{} values were judged", found.judged.len())));
    };
    found.refused.check(&found.judged)?;
    let scenario = plan.scenario(0)?;
    let again = question::again(&options.question);
    let answer = answer(setting(plan.file(), &scenario), &again, &found, &edge, starts.as_ref());
    let answer = match &starts {
        Some(starts) => nowhere(answer, options, &plan, starts)?,
        None => answer,
    };
    asked.answer(&scenario, answer)
}

/// Adds the commands to continue with if no value meets the limits.
fn nowhere(answer: Answer, options: &Options, plan: &Plan, starts: &Silence) -> Result<Answer, FileError> {
    let answer = silence::or_budget(answer, &options.question, plan, starts)?;
    // Where starts have no answer, the command stands there already.
    if starts.is_mostly_silent() || starts.is_frequent() {
        return Ok(answer);
    }
    let Question { scenario, keys, seed, .. } = &options.question;
    let check = check_command(scenario, keys, *seed, plan.file());
    Ok(match check {
        Some(check) => answer.next("which method and settings have the smallest error", check),
        None => answer,
    })
}

/// Returns for each limit the smallest value of the limited measure, and the value of the key at which it occurred.
fn nearest(key: &str, limits: &Limits, judged: &[Judged]) -> Vec<String> {
    let of = |(number, limit): (usize, &Limit)| {
        let finite = |one: &&Judged| one.measures[number].value.is_finite();
        let by = |a: &&Judged, b: &&Judged| a.measures[number].value.total_cmp(&b.measures[number].value);
        let best = judged.iter().filter(finite).min_by(by)?;
        let Estimate { value, .. } = best.measures[number];
        let scale = scale(limit.measure, value);
        let gap = if scale.unit == "°" { "" } else { " " };
        Some(format!(
            "smallest {}: {}{gap}{}, at {key} = {}",
            limit.measure,
            short(significant(scale.number(value), 3)),
            scale.unit,
            shown(key, best.value)
        ))
    };
    limits.0.iter().enumerate().filter_map(of).collect()
}

/// Returns the range of a key in SI units. Without a requested range, the default range around the scenario's value is used.
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

const fn side(side: Side) -> &'static str {
    match side {
        Side::Largest => "at most",
        Side::Smallest => "at least",
    }
}

/// Returns the causes of an edge as texts for the JSON. The causes are limits that do not hold beyond the edge, starts without an answer,
/// or refused values.
fn bound(limits: &Limits, bound: &Bound) -> Vec<String> {
    match bound {
        Bound::Limits(numbers) => {
            numbers.iter().map(|number| Limits(vec![limits.0[*number]]).to_string()).collect()
        }
        Bound::Unanswered => vec!["starts without an answer".to_owned()],
        Bound::Refused => vec!["values that cannot be".to_owned()],
    }
}

fn edge_json(limits: &Limits, judged: &[Judged], edge: &Edge) -> serde_json::Value {
    json!({
        "side": side(edge.side),
        "value": edge.value,
        "low": edge.interval[0],
        "high": edge.interval[1],
        "narrow": edge.narrow,
        "trials": edge.trials,
        "trials_needed": edge.needed,
        "bound": bound(limits, &edge.bound),
        "without_answer": Unanswered::of(limits, judged, edge),
    })
}

/// Returns the headline, the details and the tone of the answer, and writes the numbers into the JSON. `found` is the stretch, the range of
/// key values over which the limits hold.
fn stretched(
    asked: &EdgeSearch<'_>,
    found: &Stretch,
    json: &mut serde_json::Value,
) -> (String, Vec<String>, Tone) {
    let (key, whole) = &asked.bench.keys[0];
    let limits = &asked.limits;
    let edges: Vec<_> = found.edges.iter().map(|edge| edge_json(limits, &asked.judged, edge)).collect();
    if let (Some(last), Some(edge)) = (edges.last(), found.last()) {
        for name in ["value", "low", "high", "trials_needed", "without_answer"] {
            json[name] = last[name].clone();
        }
        json["answer"] = if edges.len() > 1 { "between" } else { side(edge.side) }.into();
    }
    let narrow = found.edges.iter().all(|edge| edge.narrow);
    json["monotone"] = (found.is_one() && edges.len() == 1).into();
    json["narrow"] = narrow.into();
    json["stretches"] = json!(found.all);
    json["edges"] = edges.into();
    let details = words::details(asked, found);
    let sure = narrow && found.is_one();
    let headline = words::sentence(key, *whole, limits, &found.edges);
    (headline, details, if sure { Tone::Neutral } else { Tone::Warning })
}

fn answer(
    setting: String,
    again: &str,
    asked: &EdgeSearch<'_>,
    found: &Found,
    starts: Option<&Silence>,
) -> Answer {
    let key = &asked.bench.keys[0].0;
    let (from, to) = asked.search.range;
    let looked = format!("from {} to {}", shown(key, from), shown(key, to));
    let limits = &asked.limits;
    let refused = asked.refused.ranges(asked.bench.document, key, &asked.judged);
    let mut json = json!({
        "key": key, "value": null, "low": null, "high": null, "limit": limits.to_string(),
        "searched": [from, to],
        "refused": refused,
        "trials": asked.trials(),
    });
    let possible = if refused.is_empty() { "" } else { " that can be" };
    let (headline, mut details, tone) = match found {
        Found::Nowhere => {
            json["answer"] = "no value meets it".into();
            let nearest = nearest(key, limits, &asked.judged);
            (format!("No value of {key} {looked}{possible} meets {limits}"), nearest, Tone::Bad)
        }
        Found::Everywhere => {
            json["answer"] = "every value meets it".into();
            (format!("Every value of {key} {looked}{possible} meets {limits}"), Vec::new(), Tone::Good)
        }
        Found::Stretch(stretch) => stretched(asked, stretch, &mut json),
    };
    details.extend(refused.iter().map(ToString::to_string));
    let starts = starts.filter(|starts| starts.is_frequent());
    details.extend(starts.map(|starts| format!("as it is set: {}", starts.sentence())));
    json["plain_starts"] = json!(starts.map(Silence::json));
    let figure = figures::require(key, limits, &asked.judged, found, setting.clone());
    let caption = "Each measure over its limit at each value that was looked at, with its 95 % interval where trials were added \
                   until that was narrow; elsewhere a mark, where few trials made it clear. Hatched: there the limits do not hold.";
    let title = format!("What {key} must be");
    let answer = Answer::new("require", title, setting, verdict(tone, headline, details), Vec::new());
    let code = u8::from(!matches!(found, Found::Stretch(_)));
    let answer =
        Answer { json, csv: Some(asked.rows.clone()), code, ..answer.with("require", figure, caption) };
    match found {
        Found::Nowhere => answer,
        Found::Everywhere => answer.next(
            "where the limits end lies beyond the values that were tried",
            format!(
                "standstill require {again} --key {key} --limit {} --between {}",
                quoted(&limits.to_string()),
                quoted(&format!("{}:{}", shown(key, to), shown(key, 30.0 * to)))
            ),
        ),
        Found::Stretch(stretch) => match stretch.last() {
            Some(edge) => answer.next(
                "starts with this value",
                format!("standstill run {again}{}", set(key, &shown(key, edge.value))),
            ),
            None => answer,
        },
    }
}
