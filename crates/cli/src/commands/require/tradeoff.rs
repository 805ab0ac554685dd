//! Two keys: how much of one buys how much of the other.

use serde_json::json;
use standstill_analysis::Halt;
use standstill_analysis::bracket::Search;
use standstill_analysis::require::Point;
use standstill_report::page::{Block, Page, Section, Tone};
use standstill_scenario::Plan;

use super::Question;
use crate::arguments::Require as Options;
use crate::columns;
use crate::commands::question::{
    Answer, interrupted, json as with_setup, on_threads, setting, unless_stopped,
};
use crate::error::Error;
use crate::figures;
use crate::shell::Report;
use crate::shell::table::{Column, Table};
use crate::shell::values::shown;
use crate::shell::values::shown_interval;

/// Values of the first key, and the width that the second key's interval may have: curves need less than single answers.
const VALUES: usize = 9;
const WIDTH: f64 = 0.1;

pub fn run(
    options: &Options,
    plan: &Plan,
    asked: &mut Question<'_>,
    range: (f64, f64),
) -> Result<Report, Error> {
    asked.search.width = WIDTH;
    let walk = Search { range, points: VALUES, whole: asked.bench.keys[0].1, ..asked.search };
    let mut points: Vec<Point> = Vec::new();
    let watched = asked.watched;
    let done = on_threads(&options.question, || {
        for value in walk.values() {
            let found = asked.find(&[value])?;
            points.push(Point::of(value, &found));
            watched.bar.set_message(format!("{} of {VALUES} points", points.len()));
        }
        Ok::<(), Halt<_>>(())
    })?;
    watched.bar.finish_and_clear();
    if unless_stopped(done)?.is_none() {
        return Ok(interrupted(
            &options.question,
            "require",
            watched,
            &format!("{} points were done", points.len()),
        ));
    }
    answer(options, plan, asked, &points)?.report(&options.question, &asked.identity)
}

fn answer(options: &Options, plan: &Plan, asked: &Question<'_>, points: &[Point]) -> Result<Answer, Error> {
    let [first, second] = [0, 1].map(|key| asked.bench.keys[key].0.as_str());
    let scenario = plan.scenario(0)?;
    let setting = setting(plan.file(), &scenario);
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
    let headline = format!("What {second} must be at each {first}, for {limits}");
    let json = json!({
        "keys": [first, second], "limit": limits, "curve": points,
        "trials": asked.rows.iter().map(|row| row.trials).sum::<u64>(),
    });
    let figure = figures::tradeoff([first, second], points, &limits, setting.clone());
    let caption = "The limits hold on the side of the curve where both parts are better.";
    let tone = if any { Tone::Neutral } else { Tone::Warning };
    Ok(Answer {
        name: "require",
        text: format!("{setting}\n{headline} [95 % interval]\n\n{}", table.text()),
        json: with_setup(plan.file(), &scenario, json),
        csv: columns::csv(points).map_err(|error| Error::Write("require.csv".into(), error))?,
        figures: vec![("require".to_owned(), figure, caption.to_owned())],
        page: Page {
            title: format!("{first} against {second}"),
            subtitle: setting,
            sections: vec![Section {
                title: "Answer".to_owned(),
                blocks: vec![
                    Block::Verdict { tone, headline, details: Vec::new() },
                    Block::Code { caption: "The curve".to_owned(), text: table.whole() },
                ],
            }],
            footer: String::new(),
        },
        // Options are checked before; what no value meets is an answer.
        code: u8::from(!any && !options.key.is_empty()),
    })
}
