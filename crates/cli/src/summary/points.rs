//! The table of a sweep's points, and the table of reasons of starts without an answer.

use standstill_campaign::{Occurrence, Summary};
use standstill_report::page::{Column, Table, Tone};

use super::{Ranking, good_heading, good_interval, percent, share};
use crate::results::{PointSummary, SummaryFile};
use crate::shell::values::Shown;

/// Largest number of points that a terminal shows; if there are more, it shows only the best and the worst.
const MOST_LINES: usize = 30;

/// Formats a point's values on the sweep axes.
fn values(shown: &[Shown], point: &PointSummary) -> Vec<String> {
    shown.iter().zip(point.values.values()).map(|(axis, value)| axis.text(value)).collect()
}

/// Makes the column of a sweep axis.
fn column(axis: &Shown, points: &[PointSummary]) -> Column {
    let numeric =
        |point: &PointSummary| point.values.get(&axis.key).is_some_and(serde_json::Value::is_number);
    let column = if points.iter().all(numeric) { Column::number } else { Column::word };
    column(axis.key.clone()).unit(axis.scale.unit.clone())
}

/// Makes the table with one row for each point. If there are many points, a terminal shows only the best and the worst.
/// `open`: poles are not judged.
pub fn table(points: &[PointSummary], open: bool) -> Table {
    let shown = Shown::of(points);
    let number = |title: &str, rank: u8| Column::number(title).rank(rank);
    // Counts that are zero at all points are left out early: `right %` alone says as much. Other counts keep their
    // column, without the share in brackets if room is short.
    let count = |title: &str, rank: u8, of: fn(&Summary) -> u64| {
        let none = points.iter().all(|point| of(&point.summary) == 0);
        number(title, if none { rank } else { 0 }).bracket(5)
    };
    let results = [
        number("trials", 10),
        number(good_heading(open), 0).unit("%").bracket(8),
        number("rms", 0).unit("°").bracket(4),
        number("p95", 9).unit("°").bracket(9),
        count("wrong poles", 6, |s| s.wrong_poles).judged(),
        count("undetermined", 8, |s| s.undetermined),
        count("failed", 7, |s| s.failed),
    ];
    let axes = shown.iter().map(|axis| column(axis, points));
    let rows = points.iter().map(|point| {
        let s = &point.summary;
        let tone = if s.wrong_poles > 0 && !open { Tone::Bad } else { Tone::Neutral };
        let unjudged = open || s.found == 0;
        let results = [
            s.trials.to_string(),
            good_interval(s, open),
            s.rms_deg.to_string(),
            s.p95_deg.to_string(),
            if unjudged { "–".to_owned() } else { share(s.wrong_poles, &s.wrong_pole_probability) },
            share(s.undetermined, &s.undetermined_probability),
            share(s.failed + s.errors, &s.failed_probability),
        ];
        (tone, values(&shown, point).into_iter().chain(results).collect())
    });
    let in_sectors = points.iter().any(|point| point.summary.sectors.is_some());
    let of_sectors = if in_sectors { "; rms and p95 of sectors: what is beyond them" } else { "" };
    let table = Table::new(axes.chain(results))
        .captioned(format!("{} points, [95 % intervals]{of_sectors}", points.len()))
        .judged(rows);
    if points.len() <= MOST_LINES {
        return table;
    }
    let half = MOST_LINES / 2;
    let mut order: Vec<usize> = (0..points.len()).collect();
    let ranking = Ranking::of(points.iter().map(|point| &point.summary), open);
    order.sort_by(|a, b| ranking.compare(&points[*a].summary, &points[*b].summary));
    order.drain(half..points.len() - half);
    let limit = points[0].summary.limit_deg;
    let sentence = format!("The best {half} and the worst {half}, {}.", ranking.in_words(limit));
    table.excerpt(order, sentence)
}

/// Makes the table of reasons of starts without an answer. For a sweep, the table lists the reasons at each point, because sums over all
/// points would depend on the user's choice of points.
pub fn reasons(summary: &SummaryFile) -> Table {
    let points = &summary.points;
    let shown = Shown::of(points);
    let row = |(reason, times): (&String, &Occurrence)| {
        vec![reason.clone(), times.count.to_string(), percent(&times.probability)]
    };
    let at = |point: &PointSummary| {
        let values = values(&shown, point);
        let rows = point.summary.reasons.iter().map(row);
        rows.map(|row| [values.clone(), row].concat()).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<String>> = match summary.whole() {
        Some(whole) => whole.reasons.iter().map(row).collect(),
        None => points.iter().flat_map(at).collect(),
    };
    let results = [Column::prose("reason"), Column::number("count"), Column::number("probability").unit("%")];
    Table::new(shown.iter().map(|axis| column(axis, points)).chain(results))
        .captioned("Why starts were not answered")
        .rows(rows)
}

#[cfg(test)]
mod tests {
    use standstill_campaign::{Estimate, Statistics, binomial_interval};

    use super::*;
    use crate::shell::table::Print as _;

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
        for width in [60, 80, 100, 120] {
            let text = super::table(&points, false).within(width, false);
            assert!(text.lines().all(|line| line.chars().count() <= width), "{width}:\n{text}");
            let table = text.split("No room").next().unwrap_or_default();
            for cell in ["harsh", "12.3", "11", "523", "1024"] {
                assert!(table.contains(cell), "{width}: {cell} in\n{text}");
            }
        }
        // Columns of counts that are zero at all points are left out first.
        let none = [point(0.2, "default", 0, 0, 0), point(0.4, "harsh", 0, 0, 1024)];
        let text = super::table(&none, false).within(80, false);
        assert!(
            !text.split("──").next().expect("titles").contains("undetermined") && text.contains("1024"),
            "{text}"
        );
    }
}
