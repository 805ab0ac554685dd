//! Verdict on which of two runs is better, as one line.

use standstill_campaign::{Apart, Estimate, Judgement, Summary, binomial_interval};
use standstill_report::page::Tone;

use super::Common;
use super::difference::{Rates, independent};
use super::row::Compared;
use super::trials::Trial;
use crate::shell::values::range;
use crate::summary::{GOOD, right};

impl Common {
    /// Returns the differences, B minus A, that decide which run is better. `rows` contains the measures of all points.
    fn apart(&self, rows: &[Compared]) -> Apart {
        let of_starts = |case: fn(&Trial) -> bool, count: fn(&Summary) -> u64| {
            let Some(pairs) = self.pairs.as_ref().filter(|pairs| !pairs.is_empty()) else {
                let rate = |s: &Summary| binomial_interval(count(s), s.trials);
                return independent(self.summaries.each_ref().map(rate));
            };
            let only = |b: bool| pairs.iter().filter(|(x, y)| case(x) != b && case(y) == b).count() as u64;
            Rates { only_a: only(false), only_b: only(true), pairs: pairs.len() as u64 }.difference()
        };
        let rms = rows.iter().find(|row| row.is_rms() && row.point == self.name);
        Apart {
            wrong: of_starts(|trial| trial.cases()[0], |s| s.wrong_poles),
            unanswered: of_starts(
                |trial| trial.cases()[1] || trial.cases()[2],
                |s| s.undetermined + s.failed,
            ),
            error: rms.map_or(Estimate::UNKNOWN, |row| row.apart),
        }
    }
}

/// Returns the verdict as one line, and its tone. The line states the shares of right answers, unless nearly all answers are right, and
/// then the difference.
pub fn headline(rows: &[Compared], points: &[Common]) -> (Tone, String) {
    let apart = difference(rows, points);
    let shares = |run: usize| {
        points.iter().map(move |point| (right(&point.summaries[run]), point.summaries[run].trials))
    };
    if shares(0).chain(shares(1)).all(|(share, _)| share >= GOOD) {
        return (Tone::Neutral, apart);
    }
    let by = if points.len() > 1 { ", by point" } else { "" };
    let [a, b] = [0, 1].map(|run| range(shares(run)).unwrap_or_else(|| "–".to_owned()));
    (Tone::Warning, format!("Answered rightly: {a} at A, {b} at B{by}; {apart}"))
}

fn difference(rows: &[Compared], points: &[Common]) -> String {
    let judged: Vec<Apart> = points.iter().map(|point| point.apart(rows)).collect();
    if let ([apart], Some(one)) = (&judged[..], rows.iter().find(|row| row.is_rms())) {
        return format!("{}; {}", apart.in_words(), measured(one));
    }
    let all = judged.len();
    let said: Vec<String> = [
        (Judgement::Better, "better"),
        (Judgement::Worse, "worse"),
        (Judgement::Mixed, "better in one measure and worse in another"),
    ]
    .into_iter()
    .filter_map(|(judgement, word)| {
        let count = judged.iter().filter(|apart| apart.judgement() == judgement).count();
        (count > 0).then(|| format!("{word} at {count}"))
    })
    .collect();
    let open = judged.iter().filter(|apart| apart.judgement() == Judgement::Open).count();
    match (said.is_empty(), open) {
        (true, _) => format!("no difference shown at any of {all} points"),
        (_, 0) => format!("Of {all} points B is {}", said.join(", ")),
        _ => format!("Of {all} points B is {}; at {open} no difference is shown", said.join(", ")),
    }
}

/// Formats the errors of both runs, and their difference if both errors exist.
fn measured(one: &Compared) -> String {
    let cells = one.cells();
    let value = |of: usize| cells[2 + of].split(" [").next().unwrap_or_default().to_owned();
    if one.of.iter().any(|of| of.value.is_nan()) {
        let said = |of: usize| match value(of) {
            none if none == "–" => "no axis".to_owned(),
            value => format!("rms {value}°"),
        };
        return format!("{} at A, {} at B", said(0), said(1));
    }
    let [a, b] = [value(0), value(1)];
    let apart = one.apart;
    let decimals = apart.decimals();
    let [value, low, high] = [apart.value, apart.low, apart.high].map(|x| format!("{x:+.decimals$}"));
    format!("rms {a}° at A, {b}° at B, {value}° [{low}, {high}]")
}
