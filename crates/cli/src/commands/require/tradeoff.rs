//! The trade-off curve of two keys: for each value of the first key, the values of the second key with which the limits hold.

use serde_json::json;
use standstill_analysis::bracket::Search;
use standstill_analysis::require::{EVERYWHERE, Point};
use standstill_report::page::{Block, Column, Table, Tone};
use standstill_scenario::Plan;

use super::{EdgeSearch, nowhere};
use crate::answer::{Answer, Record, Records, verdict};
use crate::arguments::Require as Options;
use crate::commands::question::{self, Silence, setting};
use crate::error::Error;
use crate::figures;
use crate::shell::Report;
use crate::shell::command_line::set;
use crate::shell::values::{shown, shown_interval};

/// Number of values of the first key. The curve has one point for each of these values.
const VALUES: usize = 9;
/// Relative width of the interval of the second key's edge. It is larger than the width for a single edge.
const WIDTH: f64 = 0.1;

pub fn run(
    options: &Options,
    plan: &Plan,
    asked: &mut EdgeSearch<'_>,
    range: (f64, f64),
) -> Result<Report, Error> {
    asked.search.width = WIDTH;
    let walk = Search { range, points: VALUES, whole: asked.bench.keys[0].1, ..asked.search };
    let mut points: Vec<Point> = Vec::new();
    let question = asked.asked;
    let done = question.run(|| {
        for value in walk.values() {
            let found = asked.find(&[value])?;
            points.push(Point::of(value, &found));
            question.watched.bar.set_message(format!("{} of {VALUES} points", points.len()));
        }
        let is_nowhere = points.iter().all(|point| point.second.is_none() && point.answer != EVERYWHERE);
        is_nowhere.then(|| Silence::of_angles(plan, &question.watched)).transpose()
    })?;
    let Some(starts) = done else {
        return Ok(question.interrupted(&format!("{} points were done", points.len())));
    };
    let scenario = plan.scenario(0)?;
    let answer = answer(options, setting(plan.file(), &scenario), asked, &points, starts.as_ref());
    let answer = match &starts {
        Some(starts) => nowhere(answer, options, plan, starts)?,
        None => answer,
    };
    question.answer(&scenario, answer)
}

fn record(point: &Point) -> Record {
    Record::default()
        .with("first", point.first)
        .with("second", point.second)
        .with("low", point.low)
        .with("high", point.high)
        .with("from", point.from)
        .with("from_low", point.from_low)
        .with("from_high", point.from_high)
        .with("answer", point.answer)
}

fn answer(
    options: &Options,
    setting: String,
    asked: &EdgeSearch<'_>,
    points: &[Point],
    starts: Option<&Silence>,
) -> Answer {
    let [first, second] = [0, 1].map(|key| asked.bench.keys[key].0.as_str());
    let limits = asked.limits.to_string();
    let cells = |point: &Point| {
        let interval = |value, ends| shown_interval((second, asked.bench.keys[1].1), value, ends);
        let to = point.second.map(|value| interval(value, [point.low, point.high]));
        let from = point.from.map(|value| interval(value, [point.from_low, point.from_high]));
        let second_text = match (from, to) {
            (Some(from), Some(to)) => format!("{from} to {to}"),
            (_, Some(to)) => to,
            _ => point.answer.to_owned(),
        };
        vec![shown(first, point.first), second_text]
    };
    let table = Table::new([first, second].map(Column::number)).rows(points.iter().map(cells));
    let any = points.iter().any(|point| point.second.is_some());
    let headline = format!("What {second} must be at each {first}, for {limits} [95 % interval]");
    let records: Records = points.iter().map(record).collect();
    let starts = starts.filter(|starts| starts.is_frequent());
    let details = starts.map(|starts| format!("as it is set: {}", starts.sentence())).into_iter().collect();
    let json = json!({
        "plain_starts": starts.map(Silence::json),
        "keys": [first, second], "limit": limits, "curve": records, "trials": asked.trials(),
    });
    let figure = figures::tradeoff([first, second], points, &limits, setting.clone());
    let caption = "The limits hold on the side of the curve where both parts are better.";
    let verdict = verdict(if any { Tone::Neutral } else { Tone::Warning }, headline, details);
    let title = format!("{first} against {second}");
    let answer = Answer::new("require", title, setting, verdict, vec![Block::Table(table)]);
    // Exit code 1: no pair of values has an edge.
    let code = u8::from(!any && !options.key.is_empty());
    let answer = Answer { json, csv: Some(records), code, ..answer.with("require", figure, caption) };
    // The next command uses the middle one of the points with an edge.
    let with: Vec<(f64, f64)> =
        points.iter().filter_map(|point| Some((point.first, point.second?))).collect();
    match with.get(with.len() / 2) {
        Some((value, edge)) => {
            let keys = set(first, &shown(first, *value)) + &set(second, &shown(second, *edge));
            let again = question::again(&options.question);
            answer.next("starts with one pair of these values", format!("standstill run {again}{keys}"))
        }
        None => answer,
    }
}
