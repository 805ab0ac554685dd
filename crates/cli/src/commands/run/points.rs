//! The points of a sweep in a table.

use standstill_campaign::Summary;
use standstill_report::page::Tone;

use crate::results::PointSummary;
use crate::shell::table::{Column, Table};
use crate::shell::terminal::paragraph;
use crate::shell::values::Shown;
use crate::summary::{self, share};

/// Points that are printed; of more, only the best and the worst.
const MOST_LINES: usize = 30;

/// A line each; of many points, the best and the worst.
pub fn text(points: &[PointSummary], open: bool) -> String {
    let mut order: Vec<&PointSummary> = points.iter().collect();
    let mut heading = format!("{} points, [95 % intervals]\n\n", points.len());
    if points.len() > MOST_LINES {
        order.sort_by(|a, b| summary::rank(&a.summary, &b.summary, open));
        order.drain(MOST_LINES / 2..points.len() - MOST_LINES / 2);
        heading = format!(
            "{} points: the best {} and the worst {}, by the share of starts {}, then by the rms error, [95 % intervals]",
            points.len(),
            MOST_LINES / 2,
            MOST_LINES / 2,
            if open { "with an axis" } else { "answered rightly" }
        );
        heading = paragraph("", &heading) + "\n";
    }
    heading + &table(points, &order, open).text()
}

fn table(points: &[PointSummary], order: &[&PointSummary], open: bool) -> Table {
    let shown = Shown::of(points);
    let number = |title: &str, rank: u8| Column::number(title).rank(rank);
    // What did not happen at any point goes early: `right %` alone says as much. What did keeps its column, without its share if
    // need be.
    let count = |title: &str, rank: u8, of: fn(&Summary) -> u64| {
        let none = points.iter().all(|point| of(&point.summary) == 0);
        number(title, if none { rank } else { 0 }).bracket(5)
    };
    let results = [
        number("trials", 10),
        number(summary::good_heading(open), 0).bracket(8),
        number("rms °", 0).bracket(4),
        number("p95 °", 9).bracket(9),
        count("wrong poles", 6, |s| s.wrong_poles).judged(),
        count("undetermined", 8, |s| s.undetermined),
        count("failed", 7, |s| s.failed),
    ];
    let axes = shown.iter().map(|axis| Column::number(axis.title()));
    let rows = order.iter().map(|point| {
        let s = &point.summary;
        let values = shown.iter().zip(point.values.values()).map(|(axis, value)| axis.text(value));
        let tone = if s.wrong_poles > 0 && !open { Tone::Bad } else { Tone::Neutral };
        let cells = values
            .chain([
                s.trials.to_string(),
                summary::good_interval(s, open),
                s.rms_deg.to_string(),
                s.p95_deg.to_string(),
                if open { "–".to_owned() } else { share(s.wrong_poles, &s.wrong_pole_probability) },
                share(s.undetermined, &s.undetermined_probability),
                share(s.failed, &s.failed_probability),
            ])
            .collect();
        (tone, cells)
    });
    Table::new(axes.chain(results)).judged(rows)
}

#[cfg(test)]
mod tests {
    use standstill_campaign::{Estimate, Statistics, binomial_interval};

    use super::*;

    #[test]
    fn regress_what_happened_at_a_point_has_its_column_however_narrow_the_terminal() {
        let point = |noise: f64, errors: &str, wrong: u64, undetermined: u64, failed: u64| {
            let mut s = Statistics::default().summary();
            (s.trials, s.found) = (2000, 2000 - undetermined - failed);
            (s.wrong_poles, s.undetermined, s.failed) = (wrong, undetermined, failed);
            s.wrong_pole_probability = binomial_interval(wrong, 2000);
            s.undetermined_probability = binomial_interval(undetermined, 2000);
            s.failed_probability = binomial_interval(failed, 2000);
            s.rms_deg = Estimate { value: 12.34, low: 12.11, high: 12.58 };
            s.p95_deg = s.rms_deg;
            let values = [("sensors.noise", noise.into()), ("errors", errors.into())];
            let values = values.map(|(key, value)| (key.to_owned(), value)).into_iter().collect();
            PointSummary { values, summary: s }
        };
        let points = [point(0.2, "default", 0, 0, 0), point(0.4, "harsh", 11, 523, 1024)];
        let order: Vec<&PointSummary> = points.iter().collect();
        for width in [60, 80, 100, 120] {
            let text = table(&points, &order, false).within(width, false);
            assert!(text.lines().all(|line| line.chars().count() <= width), "{width}:\n{text}");
            let table = text.split("No room").next().unwrap_or_default();
            for cell in ["harsh", "12.3", "11", "523", "1024"] {
                assert!(table.contains(cell), "{width}: {cell} in\n{text}");
            }
        }
        // What happened at none goes first.
        let none = [point(0.2, "default", 0, 0, 0), point(0.4, "harsh", 0, 0, 1024)];
        let order: Vec<&PointSummary> = none.iter().collect();
        let text = table(&none, &order, false).within(80, false);
        assert!(
            !text.split("──").next().expect("titles").contains("undetermined") && text.contains("1024"),
            "{text}"
        );
    }
}
