//! What a report says.

use std::path::Path;

use standstill_campaign::{Estimate, Occurrence, Summary};
use standstill_quantity::at_most;
use standstill_report::figure::{Figure, Layer};
use standstill_report::page::{Block, Chart, Page, Section, Table, TableColumn};

use super::verdict::verdict;
use crate::results::Run;
use crate::results::{PointSummary, SummaryFile};
use crate::shell::command_line::quoted;
use crate::shell::setup;
use crate::shell::setup::setting;
use crate::shell::values::Shown;
use crate::summary::{good, number, share_of};

pub fn page(run: &Run, figures: &[(String, Figure)]) -> Page {
    let summary = &run.summary;
    let open = summary.run.pole_is_open;
    let mut results = Vec::new();
    // Axes are varied on purpose: what they say together depends on how they were chosen.
    results.push(Block::Table(
        summary.whole().map_or_else(|| points(&summary.points, open), |s| statistics(s, open)),
    ));
    if summary.each().any(|s| !s.reasons.is_empty()) {
        results.push(Block::Table(reasons(summary)));
    }
    let chart = |(name, figure): &(String, Figure)| {
        // Ids have no dots, keys do; keys have no dashes of this kind twice.
        let id = format!("chart-{}", name.replace(|c: char| !c.is_ascii_alphanumeric() && c != '_', "-"));
        Block::Chart(Chart { id, figure: figure.clone(), caption: caption(name, figure) })
    };
    let (tone, headline, details) = verdict(summary);
    let section = |title: &str, blocks: Vec<Block>| Section { title: title.to_owned(), blocks };
    let setup = setup::Setup {
        place: Path::new("scenario"),
        text: &summary.run.scenario,
        files: &summary.run.files,
        fence: run.fence.as_deref(),
        varied: run.file.axes.keys().cloned().collect(),
        others: Vec::new(),
    };
    Page {
        title: "Initial rotor position: Monte Carlo".to_owned(),
        subtitle: setting(&run.file),
        sections: [
            section("Verdict", vec![Block::Verdict { tone, headline, details }, Block::Facts(facts(run))]),
            section("Results", results),
            section("Figures", figures.iter().map(chart).collect()),
            setup.section(),
            setup.reproduce(&commands(run)),
        ]
        .into_iter()
        .filter(|section| !section.blocks.is_empty())
        .collect(),
        footer: format!("Standstill {}", summary.run.version),
    }
}

fn facts(run: &Run) -> Vec<(String, String)> {
    let (file, identity) = (&run.file, &run.summary.run);
    let mut facts = vec![
        ("Trials", trials(&run.summary)),
        ("Seed", identity.seed.to_string()),
        ("Program", format!("Standstill {}", identity.version)),
        ("Folder", run.folder.display().to_string()),
    ];
    if !run.summary.points.is_empty() {
        let keys: Vec<&str> = file.axes.keys().map(String::as_str).collect();
        facts.insert(0, ("Axes", keys.join(", ")));
        facts.insert(1, ("Points", run.summary.points.len().to_string()));
    }
    let axes: Vec<String> = file.axes.keys().cloned().collect();
    let facts = facts.into_iter().map(|(name, value)| (name.to_owned(), value));
    setup::heading(file, &axes).into_iter().chain(facts).collect()
}

/// How many trials there are, of a sweep at each point.
fn trials(summary: &SummaryFile) -> String {
    let all = summary.trials();
    let each = || summary.points.iter().map(|point| point.summary.trials);
    match (each().min(), each().max()) {
        (Some(least), Some(most)) if least == most => format!("{least} at each point, {all} in all"),
        (Some(least), Some(most)) => format!("{least} to {most} at a point, {all} in all"),
        _ => all.to_string(),
    }
}

/// What is not known.
pub const NOTHING: Estimate = Estimate { value: f64::NAN, low: f64::NAN, high: f64::NAN };

/// Every figure with its interval.
fn statistics(s: &Summary, open: bool) -> Table {
    let degrees = |name: &str, e: &Estimate| {
        let [value, low, high] = e.texts();
        vec![name.to_owned(), "°".to_owned(), value, low, high, String::new()]
    };
    let share = |name: &str, count: Option<u64>, e: &Estimate| {
        let [value, low, high] = e.times(100.0).texts();
        vec![
            name.to_owned(),
            "%".to_owned(),
            value,
            low,
            high,
            count.map_or_else(String::new, |count| count.to_string()),
        ]
    };
    let single = |name: &str, unit: &str, value: String| {
        vec![name.to_owned(), unit.to_owned(), value, String::new(), String::new(), String::new()]
    };
    let beyond = format!("Angle off by more than {}°, of the starts with an angle", s.limit_deg);
    // Of what was never asked nothing is known.
    let (wrong, wrong_probability, beyond_limit) = match s.found {
        0 => (None, &NOTHING, &NOTHING),
        _ if open => (None, &NOTHING, &s.beyond_limit),
        _ => (Some(s.wrong_poles), &s.wrong_pole_probability, &s.beyond_limit),
    };
    Table {
        caption: format!("All {} trials; intervals at 95 %, exact for counts", s.trials),
        columns: vec![
            TableColumn::text("quantity"),
            TableColumn::text("unit"),
            TableColumn::number("value", ""),
            TableColumn::number("from", ""),
            TableColumn::number("to", ""),
            TableColumn::number("count", ""),
        ],
        rows: vec![
            degrees("Rms error of the axis", &s.rms_deg),
            degrees("Mean error of the axis", &s.bias_deg),
            degrees("Median of its magnitude", &s.p50_deg),
            degrees("95th percentile", &s.p95_deg),
            degrees("99th percentile", &s.p99_deg),
            single("Largest", "°", if s.max_deg.is_nan() { String::new() } else { number(s.max_deg, 4) }),
            share(&beyond, None, beyond_limit),
            share("Wrong pole", wrong, wrong_probability),
            share("Pole undetermined", Some(s.undetermined), &s.undetermined_probability),
            share("Failed", Some(s.failed), &s.failed_probability),
            single("Furthest movement of the rotor, electrical", "°", number(s.max_moved_deg, 3)),
            single("Mean duration", "ms", number(1e3 * s.mean_duration_s, 3)),
            single("Largest current", "A", number(s.peak_current_a, 3)),
        ],
    }
}

/// Why starts were not answered: of a sweep at each point, since its points were chosen.
fn reasons(summary: &SummaryFile) -> Table {
    let points = &summary.points;
    let shown = Shown::of(points);
    let row = |(reason, times): (&String, &Occurrence)| {
        let p = &times.probability;
        let shares = p.times(100.0).texts();
        [vec![reason.clone(), times.count.to_string()], shares.to_vec()].concat()
    };
    let rows = if let Some(s) = summary.whole() {
        s.reasons.iter().map(row).collect()
    } else {
        let at = |point: &PointSummary| {
            let values: Vec<String> =
                shown.iter().zip(point.values.values()).map(|(axis, value)| axis.text(value)).collect();
            point
                .summary
                .reasons
                .iter()
                .map(row)
                .map(|row| [values.clone(), row].concat())
                .collect::<Vec<_>>()
        };
        points.iter().flat_map(at).collect()
    };
    let results = [
        TableColumn::text("reason"),
        TableColumn::number("count", ""),
        TableColumn::number("probability", "%"),
        TableColumn::number("from", "%"),
        TableColumn::number("to", "%"),
    ];
    Table {
        caption: "Why starts were not answered".to_owned(),
        columns: shown.iter().map(|axis| column(axis, points)).chain(results).collect(),
        rows,
    }
}

/// The column of an axis.
fn column(axis: &Shown, points: &[PointSummary]) -> TableColumn {
    let numeric =
        |point: &PointSummary| point.values.get(&axis.key).is_some_and(serde_json::Value::is_number);
    if points.iter().all(numeric) {
        TableColumn::number(axis.key.as_str(), axis.scale.unit.as_str())
    } else {
        TableColumn::text(axis.key.as_str())
    }
}

fn points(points: &[PointSummary], open: bool) -> Table {
    let shown = Shown::of(points);
    let results = [
        ("trials", ""),
        (if open { "axis" } else { "right" }, "%"),
        ("rms", "°"),
        ("from", "°"),
        ("to", "°"),
        ("95 %", "°"),
        ("wrong poles", ""),
        ("at most", "%"),
        ("undetermined", ""),
        ("failed", ""),
    ];
    let results = results.map(|(name, unit)| TableColumn::number(name, unit));
    let columns: Vec<TableColumn> = shown.iter().map(|axis| column(axis, points)).chain(results).collect();
    let unjudged = |s: &Summary| open || s.found == 0;
    let row = |point: &PointSummary| {
        let s = &point.summary;
        let [rms, low, high] = s.rms_deg.texts();
        let [p95, ..] = s.p95_deg.texts();
        let values = shown.iter().zip(point.values.values()).map(|(axis, value)| axis.text(value));
        values
            .chain([
                s.trials.to_string(),
                share_of(good(s, open), s.trials),
                rms,
                low,
                high,
                p95,
                if unjudged(s) { String::new() } else { s.wrong_poles.to_string() },
                if unjudged(s) { String::new() } else { at_most(s.wrong_pole_probability.high) },
                s.undetermined.to_string(),
                (s.failed + s.errors).to_string(),
            ])
            .collect()
    };
    Table {
        caption:
            "Points of the axes; rms with its 95 % interval, wrong poles with their upper limit (97.5 %)"
                .to_owned(),
        columns,
        rows: points.iter().map(row).collect(),
    }
}

fn caption(name: &str, figure: &Figure) -> String {
    let mut layers = figure.panels.iter().flat_map(|panel| &panel.layers);
    let text = match name.split('_').next() {
        // Few starts have no band.
        Some("error") if layers.any(|layer| matches!(layer, Layer::Band { .. })) => {
            "The band holds 90 % of the errors at each angle. Wrong poles are marked at the edge."
        }
        Some("error") => "Wrong poles are marked at the edge.",
        Some("distribution") => "Wrong poles are not in it: they are counted by themselves.",
        Some("heat") => {
            "Rms error at each point. Hatched cells are not to be chosen, whatever the error of the starts that had an answer."
        }
        Some("sweep") => "Each mark is a point of the sweep with its 95 % interval.",
        _ => "Bars are 95 % intervals. What never happened is shown as its upper limit.",
    };
    text.to_owned()
}

/// The commands that make the run and this page.
fn commands(run: &Run) -> String {
    let trials = run.trials.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let format = if trials.ends_with("parquet") { " --format parquet" } else { "" };
    let out = quoted(&run.folder.display().to_string());
    format!("standstill run scenario.toml --out {out}{format}\nstandstill report {out}")
}
