//! The table of `faults` for terminal and page, and its legend.

use standstill_analysis::faults::Counts;
use standstill_report::page::{Column, Table, Tone};

use super::row::{Row, percent};

/// Paragraphs that explain the columns.
pub const LEGEND: [&str; 6] = [
    "during: the fault begins at an instant of the detection that each trial draws, and stays; 50 µs: a contact that opens then for so long. The others \
     are there before the detection.",
    "detected: starts without an answer. An answer with the wrong pole or beyond the limit is dangerous.",
    "dangerous: starts whose answer would be wrong without the method's checks (`detector.checks = false`); coverage ≥: the share of these that has \
     no answer with them, the lower end of the exact one-sided 95 % interval; –: no start is dangerous.",
    "refused ≥: the share without an answer of all starts that have none or a dangerous one, with the checks on, the lower end of its interval: also of \
     faults that a method refuses even with its checks off. rightly: starts whose reason for no answer names the faulty part; –: no reason does.",
    "moved, current: starts with more movement or current than is said above; they may have any answer, or none.",
    "Sizes, places and signs are drawn by each trial; the table of the file has the keys that set them (`settings`).",
];

/// Returns the table with a line for each row.
pub fn of(rows: &[Row]) -> Table {
    let share = |title: &str, count: fn(&Counts) -> u64| {
        Column::number(title).unit("%").of(move |row: &Row| percent(count(&row.counts), row.counts.trials))
    };
    let effect = |title: &str, count: fn(&Counts) -> u64| {
        let column = Column::number(title).unit("%").rank(3);
        column.of(move |row: &Row| percent(count(&row.counts), row.counts.trials))
    };
    let number = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.1}"));
    let columns = [
        Column::word("method").of(|row: &Row| row.method.clone()),
        Column::word("fault").of(Row::fault),
        (Column::number("right").unit("%").rank(2))
            .of(|row: &Row| percent(row.counts.right, row.counts.trials)),
        share("wrong pole", |of| of.wrong_pole),
        share("beyond", |of| of.beyond),
        share("detected", Counts::detected),
        // The number of dangerous starts, which is the denominator of the coverage.
        (Column::number("dangerous").rank(3)).of(|row: &Row| {
            if row.has_checks { row.counts.dangerous.to_string() } else { "no checks".to_owned() }
        }),
        Column::number("coverage ≥")
            .unit("%")
            .of(move |row: &Row| number(row.counts.coverage().map(|of| of.low * 100.0))),
        (Column::number("refused ≥").unit("%").rank(1))
            .of(move |row: &Row| number(row.counts.refused_share().map(|of| of.low * 100.0))),
        (Column::number("rightly").unit("%").rank(2)).of(|row: &Row| {
            row.rightly().map_or_else(|| "–".to_owned(), |of| percent(of, row.counts.trials))
        }),
        effect("moved", |of| of.moved),
        effect("current", |of| of.overcurrent),
        (Column::number("worst").unit("°").rank(3))
            .of(move |row: &Row| number(row.counts.worst.map(|worst| worst.error_deg))),
        Column::word("detected by").rank(1).of(|row: &Row| row.reason().unwrap_or_default()),
    ];
    Table::of(rows, |_| Tone::Neutral, columns)
}
