//! The points of a sweep in a table.

use standstill_campaign::Summary;
use standstill_report::page::Tone;

use super::results::PointSummary;
use crate::summary::{self, share};
use crate::table::{Column, Table};
use crate::terminal::paragraph;
use crate::units::Shown;

/// Points that are printed; of more, only the best and the worst.
const MOST_LINES: usize = 30;

/// A line each; of many points, the best and the worst.
pub fn text(points: &[PointSummary]) -> String {
    let mut order: Vec<&PointSummary> = points.iter().collect();
    let mut heading = format!("{} points, [95 % intervals]\n\n", points.len());
    if points.len() > MOST_LINES {
        order.sort_by(|a, b| summary::rank(&a.summary, &b.summary));
        order.drain(MOST_LINES / 2..points.len() - MOST_LINES / 2);
        heading = format!(
            "{} points: the best {} and the worst {}, by the share of starts answered rightly, then by the rms error, [95 % intervals]",
            points.len(),
            MOST_LINES / 2,
            MOST_LINES / 2
        );
        heading = paragraph("", &heading) + "\n";
    }
    let shown = Shown::of(points);
    let number = |title: &str, rank: u8| Column::number(title).rank(rank);
    // What did not happen at any point goes before what did: `right %` alone says as much. What did goes without its share first.
    let count = |title: &str, rank: u8, of: fn(&Summary) -> u64| {
        let none = order.iter().all(|point| of(&point.summary) == 0);
        number(title, if none { rank + 5 } else { rank }).bracket(5)
    };
    let results = [
        number("trials", 10),
        number("right %", 0).bracket(8),
        number("rms °", 0).bracket(4),
        number("p95 °", 9).bracket(9),
        count("wrong poles", 1, |s| s.wrong_poles).judged(),
        count("undetermined", 3, |s| s.undetermined),
        count("failed", 2, |s| s.failed),
    ];
    let axes = shown.iter().map(|axis| Column::number(axis.title()));
    let rows = order.iter().map(|point| {
        let s = &point.summary;
        let values = shown.iter().zip(point.values.values()).map(|(axis, value)| axis.text(value));
        let tone = if s.wrong_poles > 0 { Tone::Bad } else { Tone::Neutral };
        let cells = values
            .chain([
                s.trials.to_string(),
                summary::right_interval(s),
                s.rms_deg.to_string(),
                s.p95_deg.to_string(),
                share(s.wrong_poles, &s.wrong_pole_probability),
                share(s.undetermined, &s.undetermined_probability),
                share(s.failed, &s.failed_probability),
            ])
            .collect();
        (tone, cells)
    });
    heading + &Table::new(axes.chain(results)).judged(rows).text()
}
