//! `standstill compare`: all methods on one motor.

mod cache;
mod cells;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Serialize;
use standstill_analysis::{Bound, Entry, informative, mean_energy};
use standstill_campaign::{Campaign, Estimate, Occurrence, Statistics};
use standstill_detect::MethodName;
use standstill_plant::Motor;
use standstill_quantity::{decimals, number as rounded};
use standstill_report::figure::rounded as rounded_to;
use standstill_report::page::Tone;
use standstill_sim::RunError;

use self::cells::{Cell, Comparison};
use crate::arguments::Compare;
use crate::columns;
use crate::doubts;
use crate::error::Error;
use crate::figures;
use crate::shell::Report;
use crate::shell::asked::Asked;
use crate::shell::interrupt::{self, INTERRUPTED};
use crate::shell::output::Output;
use crate::shell::output::file_list;
use crate::shell::progress;
use crate::shell::table::{Column, Table};
use crate::shell::terminal::paragraph;
use crate::summary::{good_heading, good_interval, right};

/// Angles at which the Cramér–Rao limit is computed. Their steps of 22.5° meet no harmonic of the winding twice.
const ANGLES: usize = 16;

/// The same where a detection is long and the limit costs as many seconds as the trials.
const FEW_ANGLES: usize = 8;

const FILES: [&str; 3] = ["comparison.csv", "comparison.svg", "comparison.png"];

/// A row of `comparison.csv` and of the JSON list. What does not exist is empty, or null.
#[derive(Debug, Serialize)]
struct Row {
    method: String,
    rotor: &'static str,
    errors: &'static str,
    trials: u64,
    /// Share of starts that were answered rightly: with an angle and the right pole; none where the motor's data do not tell the
    /// poles. All figures of errors are of starts with an axis alone.
    right: Option<f64>,
    /// The same, or the share of starts with an axis, as it is printed.
    #[serde(skip)]
    good_percent: String,
    rms_deg: Option<f64>,
    rms_low_deg: Option<f64>,
    rms_high_deg: Option<f64>,
    bias_deg: Option<f64>,
    p95_deg: Option<f64>,
    #[serde(skip)]
    rms: Estimate,
    #[serde(skip)]
    p95: Estimate,
    max_deg: Option<f64>,
    /// None where they are not judged.
    wrong_poles: Option<u64>,
    /// Upper end of the 95 % interval of their probability.
    wrong_poles_at_most: Option<f64>,
    undetermined: u64,
    failed: u64,
    simulation_errors: u64,
    duration_ms: f64,
    #[serde(rename = "peak_current_A")]
    peak_current: f64,
    #[serde(rename = "energy_J")]
    energy: Option<f64>,
    moved_deg: f64,
    /// Cramér–Rao limit from the scheme's samples, from all samples at 100 kHz, and on a specimen with its own gains,
    /// offsets and delays.
    bound_deg: Option<f64>,
    bound_all_deg: Option<f64>,
    bound_hybrid_deg: Option<f64>,
    efficiency: Option<f64>,
    /// Why there was no angle, or no pole, and how often; and why there is no limit.
    reasons: String,
    /// What must be said of wrong poles, and of a map that is too coarse.
    #[serde(skip_serializing_if = "Option::is_none")]
    pole_note: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    map_note: Option<String>,
}

/// Whether the motor's data do not tell its poles.
fn is_open(motor: &Motor) -> bool {
    motor.has_magnet() && motor.pole_knowledge().is_open()
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

impl Row {
    fn new(entry: &Entry, motor: &Motor) -> Self {
        let s = &entry.summary;
        let open = is_open(motor);
        Self {
            method: entry.method.clone(),
            rotor: entry.rotor.name(),
            errors: entry.errors.name(),
            trials: s.trials,
            right: (!open).then(|| right(s)),
            good_percent: good_interval(s, open),
            rms_deg: finite(s.rms_deg.value),
            rms_low_deg: finite(s.rms_deg.low),
            rms_high_deg: finite(s.rms_deg.high),
            bias_deg: finite(s.bias_deg.value),
            p95_deg: finite(s.p95_deg.value),
            rms: s.rms_deg,
            p95: s.p95_deg,
            max_deg: finite(s.max_deg),
            wrong_poles: (!open).then_some(s.wrong_poles),
            wrong_poles_at_most: (!open).then_some(s.wrong_pole_probability.high),
            undetermined: s.undetermined,
            failed: s.failed,
            simulation_errors: s.errors,
            duration_ms: s.mean_duration_s * 1e3,
            peak_current: s.peak_current_a,
            energy: finite(entry.energy_j),
            moved_deg: s.max_moved_deg,
            bound_deg: entry.bound.and_then(|bound| informative(bound.scheme_deg)),
            bound_all_deg: entry.bound.and_then(|bound| informative(bound.all_deg)),
            bound_hybrid_deg: entry.bound.and_then(|bound| bound.hybrid_deg).and_then(informative),
            efficiency: entry.efficiency(),
            reasons: reasons(&s.reasons, entry.no_bound),
            pole_note: motor.pole_knowledge().note().filter(|_| motor.has_magnet()),
            map_note: motor.map_note(),
        }
    }

    /// Of the table, with so many decimals of currents and energies. The method is named where it is another one than in
    /// the row before.
    fn cells(&self, before: Option<&Self>, digits: [usize; 2]) -> Vec<String> {
        let number = |value: Option<f64>, digits: usize| {
            value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
        };
        let Estimate { value, low, high } = self.rms;
        // Of the limit, which is computed, and the rms, which is as sure as its interval is narrow.
        let limit = self.efficiency.unwrap_or(f64::NAN) * value;
        let efficiency = Estimate { value: limit / value, low: limit / high, high: limit / low };
        vec![
            if before.is_some_and(|row| row.method == self.method) {
                String::new()
            } else {
                self.method.clone()
            },
            self.rotor.to_owned(),
            self.errors.to_owned(),
            self.trials.to_string(),
            self.good_percent.clone(),
            self.rms.to_string(),
            self.p95.to_string(),
            number(self.max_deg, 2),
            self.wrong_poles.map_or_else(|| "–".to_owned(), |count| count.to_string()),
            self.undetermined.to_string(),
            (self.failed + self.simulation_errors).to_string(),
            rounded(1, self.duration_ms),
            number(Some(self.peak_current), digits[0]),
            number(self.energy, digits[1]),
            number(Some(self.moved_deg), 2),
            self.bound_deg.map_or_else(|| "–".to_owned(), |limit| rounded_to(limit, 3)),
            efficiency.alone(),
        ]
    }
}

/// The columns; where there is no room, the method stands above its rows, and what tells methods apart the least goes first.
fn columns(rows: &[Row], open: bool) -> [Column; 17] {
    let number = |title: &str, rank: u8| Column::number(title).rank(rank);
    // What happened anywhere keeps its column; what did not, `right %` says as well.
    let count = |title: &str, rank: u8, of: fn(&Row) -> u64| {
        number(title, if rows.iter().all(|row| of(row) == 0) { rank } else { 0 })
    };
    let limits = if rows.iter().any(|row| row.bound_deg.is_some()) { 0 } else { 8 };
    [
        Column::word("method"),
        Column::word("rotor"),
        Column::word("errors"),
        number("trials", 7),
        number(good_heading(open), 0).bracket(11),
        number("rms °", 0).bracket(9),
        number("p95 °", 2).bracket(10),
        number("max °", 6),
        count("wrong", 1, |row| row.wrong_poles.unwrap_or(0)).judged(),
        count("undet.", 6, |row| row.undetermined),
        count("failed", 6, |row| row.failed + row.simulation_errors),
        number("ms", 0),
        number("peak A", 3),
        number("J", 8),
        number("moved °", 1),
        number("limit °", 4 + limits),
        number("eff.", 5 + limits),
    ]
}

fn reasons(counts: &BTreeMap<String, Occurrence>, no_bound: Option<RunError>) -> String {
    let counted = counts.iter().map(|(reason, times)| format!("{} × {reason}", times.count));
    let all: Vec<String> = counted.chain(no_bound.map(|reason| format!("no limit: {reason}"))).collect();
    all.join("; ")
}

/// The cells one after the other, as far as nobody interrupts.
fn entries(cells: &[Cell], limits: bool, threads: Option<usize>) -> Result<Vec<Entry>, Error> {
    let stop = interrupt::flag();
    let bar = progress::bar(cells.iter().map(|cell| cell.trials).sum());
    let mut entries = Vec::new();
    for cell in cells {
        bar.set_message(format!("{}, {}, {}", cell.method, cell.rotor.name(), cell.errors.name()));
        let mut statistics = Statistics::default();
        let campaign = Campaign { scenario: &cell.scenario, trials: cell.trials, threads };
        let done = campaign.run(&stop, |record| {
            statistics.add(record);
            bar.inc(1);
            Ok::<(), Error>(())
        })?;
        // A row whose trials are all done is kept even if the interruption came with its last ones.
        if done < cell.trials {
            break;
        }
        let angles = if cell.scenario.detector.has_line_pulses() { ANGLES } else { FEW_ANGLES };
        let (bound, no_bound) = if limits {
            let compute = || Bound::or_reason(&cell.scenario, angles, threads);
            // What a library would do with the pulses, its name does not tell.
            let known = MethodName::ALL.iter().any(|method| method.name() == cell.method);
            if known { cache::limit(&cell.scenario, angles, compute)? } else { compute()? }
        } else {
            (None, None)
        };
        let entry = Entry {
            method: cell.method.clone(),
            rotor: cell.rotor,
            errors: cell.errors,
            summary: statistics.summary(),
            energy_j: mean_energy(&cell.scenario, cell.trials)?,
            bound,
            no_bound,
        };
        entries.push(entry);
    }
    bar.finish_and_clear();
    Ok(entries)
}

pub fn run(options: &Compare) -> Result<Report, Error> {
    let Comparison { motor, seed, cells, .. } = Comparison::new(options)?;
    if let Some(cell) = cells.first() {
        doubts::warn(&cell.scenario);
    }
    let asked = || {
        let each: Vec<_> = cells
            .iter()
            .map(|cell| (&cell.method, cell.rotor, cell.errors, cell.trials, &cell.scenario))
            .collect();
        let said = format!("{}, seed {seed}", motor.name);
        Asked::new("compare", said, &(options.no_limit, each), options.force.force)
    };
    let output = if options.json { None } else { Some(Output::answering(asked(), &options.out, &FILES)?) };
    let entries = entries(&cells, !options.no_limit, options.threads.map(usize::from))?;
    let interrupted = entries.len() < cells.len();
    let rows: Vec<Row> = entries.iter().map(|entry| Row::new(entry, &motor)).collect();
    let failed = rows.iter().any(|row| row.simulation_errors > 0);
    let code = if interrupted { INTERRUPTED } else { u8::from(failed) };
    let Some(mut output) = output else {
        let json = serde_json::to_string_pretty(&rows);
        let json = json.map_err(|error| Error::Write("standard output".into(), error.into()))?;
        return Ok(Report { text: json + "\n", code });
    };
    if rows.is_empty() {
        let text = "Interrupted before the first method was done.\n".to_owned();
        return Ok(Report { text, code });
    }
    let csv = columns::csv(&rows).map_err(|error| Error::Write("comparison.csv".into(), error))?;
    output.file("comparison.csv", &csv)?;
    let open = is_open(&motor);
    let judged = if open { ", poles not judged" } else { "" };
    let subtitle = format!("{}, seed {seed}{judged}", motor.name);
    let figure = figures::comparison(&entries, subtitle, open);
    output.file("comparison.svg", figure.svg()?.as_bytes())?;
    output.file("comparison.png", &figure.png()?)?;
    let files = output.finish()?;
    let mut text = format!("Methods on {}, seed {seed}\n\n", motor.name);
    let largest = |of: fn(&Row) -> f64| rows.iter().map(of).fold(0.0, f64::max);
    let digits = [
        decimals(1, largest(|row| row.peak_current)),
        decimals(2, largest(|row| row.energy.unwrap_or_default())),
    ];
    let lines = rows.iter().enumerate().map(|(k, row)| {
        let tone = if row.wrong_poles.is_some_and(|count| count > 0) { Tone::Bad } else { Tone::Neutral };
        (tone, row.cells(k.checked_sub(1).map(|before| &rows[before]), digits))
    });
    text += &Table::new(columns(&rows, open)).judged(lines).headed().text();
    let good =
        if open { "axis: starts with an axis." } else { "right: starts with an angle and the right pole." };
    let _ = write!(text, "\n{}", paragraph("", &format!("{good} {LEGEND}")));
    if let Some(note) = rows[0].pole_note {
        let _ = writeln!(text, "wrong, undet.: {note}.");
    }
    if let Some(note) = &rows[0].map_note {
        let _ = write!(text, "{}", paragraph("", &format!("Map: {note}.")));
    }
    for row in rows.iter().filter(|row| !row.reasons.is_empty()) {
        text += &paragraph("  ", &format!("{}, {}, {}: {}", row.method, row.rotor, row.errors, row.reasons));
    }
    let _ = write!(text, "\n{}", file_list(&options.out, &files));
    if interrupted {
        let _ = writeln!(text, "\nInterrupted: {} of {} rows are in these files.", rows.len(), cells.len());
    }
    Ok(Report { text, code })
}

const LEGEND: &str = "rms, p95, max: error of the axis, of starts that have one. wrong: wrong poles; undet.: axis without pole; failed: no angle. ms, peak A, J: \
     time, largest current and mean energy of a detection. moved: furthest that a rotor moved. limit: Cramér–Rao, from the \
     method's samples (line pulses without the polarity test that follows); eff.: limit / rms.";
