//! `standstill check`: is this motor suited?

use std::fmt::Write as _;

use serde_json::{Value, json};
use standstill_analysis::{Candidate, Demands, Suitability, informative};
use standstill_detect::{Method, PulseTrainSettings, SequentialSettings, Signature};
use standstill_interface::Choice;
use standstill_plant::{DataSheet, Entry, PoleKnowledge, Source};
use standstill_report::page::Tone;
use standstill_scenario::Document;
use standstill_scenario::ErrorSet;

use crate::Report;
use crate::arguments::Check;
use crate::doubts;
use crate::error::Error;
use crate::interrupt;
use crate::progress;
use crate::scenario::{self, Shorthands};
use crate::table::{Column, Table};
use crate::terminal::{painted, paragraph};

/// The scenario of what is named.
fn document(options: &Check) -> Result<Document, Error> {
    let shorthands = Shorthands::default()
        .with("--errors", "errors", options.errors.map(Choice::name))
        .temperatures(options.temperature)
        .seed(options.seed);
    scenario::of_motor(&options.motor, &options.keys, shorthands)
}

pub fn run(options: &Check) -> Result<Report, Error> {
    interrupt::at_once();
    let document = document(options)?;
    let file = document.load_single()?;
    if let Some(library) = &file.detector.library {
        let needed =
            "a scenario without: `check` looks for a method; `compare` sets a library beside the methods";
        return Err(document.refuse("detector.library", &format!("\"{library}\""), needed).into());
    }
    let errors = file.errors.0;
    let motor = document.motor()?;
    doubts::warn(&document.scenario_of(&motor)?);
    let demands =
        Demands { error_deg: options.tolerance, movement_deg: options.movement, ..Demands::default() };
    let spinner = progress::steps(standstill_analysis::CANDIDATES.len() as u64);
    let suitability = Suitability::of(&document, &demands, |method| {
        spinner.set_message(method.name());
        spinner.inc(1);
    })?;
    spinner.finish_and_clear();
    let recommended = suitability.recommended();
    let code = u8::from(recommended.is_none());
    let mut reasons = reasons(&suitability, &demands, errors);
    reasons.extend(motor.map_note().map(|note| format!("Map: {note}.")));
    if options.json {
        let json = json(&motor.name, errors, &suitability, &demands, &reasons);
        return Ok(Report { text: format!("{json:#}\n"), code });
    }
    let verdict = if recommended.is_some() { "suited" } else { "NOT suited" };
    let what = if suitability.pole_is_open() { "rotor's axis" } else { "rotor position" };
    let note = suitability.pole.note().filter(|_| suitability.has_magnet);
    let open = note.map_or_else(String::new, |note| format!("; {note}"));
    let tone = if recommended.is_some() { Tone::Good } else { Tone::Bad };
    let mut text = paragraph(
        "",
        &format!(
            "{}: {} to detection of the {what} at standstill (error set {}){open}",
            motor.name,
            painted(tone, verdict),
            errors.name()
        ),
    );
    text.push('\n');
    for reason in &reasons {
        text += &paragraph("  – ", reason);
    }
    for assumption in assumptions(&document.data_sheet()?) {
        text += &paragraph("  – ", &assumption);
    }
    text.push('\n');
    text += &Table::new(columns()).judged(suitability.candidates.iter().map(cells)).text();
    if let Some(candidate) = recommended {
        let margin = factor(candidate.margin);
        let said = format!(
            "Recommended: {}, {margin} times better than demanded in error and in movement",
            candidate.method
        );
        let _ = write!(text, "\n{}", paragraph("", &said));
        for (name, value) in
            settings(&candidate.settings, suitability.has_magnet && !suitability.pole_is_open())
        {
            let _ = writeln!(text, "  {name:<24} {value}");
        }
    }
    Ok(Report { text, code })
}

/// What the verdict rests on and nobody has measured: numbers that the sheet leaves out, and those that it calls assumed. A built-in
/// motor's are listed by `standstill motors`.
fn assumptions(sheet: &DataSheet) -> Vec<String> {
    let list = |head: &str, entries: &[Entry]| {
        let values: Vec<String> =
            entries.iter().map(|entry| format!("{} {}", entry.key, entry.value)).collect();
        (!values.is_empty()).then(|| format!("{head}: {}.", values.join(", ")))
    };
    let left_out = sheet.assumed();
    let is_written = |entry: &Entry| {
        let is_left_out = left_out.iter().any(|other| other.key == entry.key);
        // Saturation that is not given is nothing that was assumed: the verdict says what is open without.
        let is_open = entry.key == "nameplate.saturation";
        let is_built_in = DataSheet::built_in(sheet.name()).is_some();
        entry.source == Source::Assumed && !is_left_out && !is_open && !is_built_in
    };
    let written: Vec<Entry> = sheet.entries().into_iter().filter(is_written).collect();
    let said = [
        list("Assumed, as the data sheet does not say", left_out),
        list("Assumed, as the data sheet itself says", &written),
    ];
    said.into_iter().flatten().collect()
}

fn columns() -> [Column; 7] {
    [
        Column::word("method"),
        Column::number("p95 ° locked"),
        Column::number("p95 ° free").rank(3),
        Column::number("ms").rank(1),
        Column::number("peak A").rank(2),
        Column::number("moved °").rank(1),
        Column::prose("verdict").judged(),
    ]
}

fn number(value: f64, digits: usize) -> String {
    if value.is_finite() { format!("{value:.digits$}") } else { "–".to_owned() }
}

/// How many times, with a digit after the point where that matters.
fn factor(value: f64) -> String {
    if value < 9.95 { format!("{value:.1}") } else { format!("{value:.0}") }
}

/// A current in A, of motors of milliamperes as well.
fn amperes(value: f64) -> String {
    if value > 0.0 { standstill_quantity::number(1, value) } else { "–".to_owned() }
}

fn milliseconds(seconds: f64) -> String {
    if seconds.is_finite() { standstill_quantity::number(1, seconds * 1e3) } else { "–".to_owned() }
}

fn cells(candidate: &Candidate) -> (Tone, Vec<String>) {
    let (locked, free) = (&candidate.locked, &candidate.free);
    let verdict =
        if candidate.objections.is_empty() { "suited".to_owned() } else { candidate.objections.join("; ") };
    let tone = if candidate.objections.is_empty() { Tone::Good } else { Tone::Bad };
    let cells = vec![
        candidate.method.name().to_owned(),
        number(locked.p95_deg.value, 2),
        number(free.p95_deg.value, 2),
        milliseconds(free.mean_duration_s),
        amperes(locked.peak_current_a.max(free.peak_current_a)),
        if free.trials > 0 { number(free.max_moved_deg, 2) } else { "–".to_owned() },
        verdict,
    ];
    (tone, cells)
}

fn reasons(suitability: &Suitability, demands: &Demands, errors: ErrorSet) -> Vec<String> {
    let mut reasons = Vec::new();
    let ratio = suitability.saliency_ratio;
    let mut saliency = format!("Saliency: |L_B|/L_A = {ratio:.3}.");
    if let Some(bound) = suitability.limit {
        // What holds for this specimen too: its gains and offsets are known only as its sensors are made.
        let limit = bound.hybrid_deg.unwrap_or(bound.scheme_deg);
        if informative(limit).is_none() {
            saliency += " The currents of line pulses do not tell the rotor's angle.";
        } else if limit > 0.0 {
            let margin = demands.error_deg / (1.96 * limit);
            let _ = write!(
                saliency,
                " With error set {} no method can know the axis better than {limit:.3}° rms from these line pulses (Cramér–Rao), {} times {} than the {}° demanded in 95 of 100.",
                errors.name(),
                factor(if margin < 1.0 { 1.0 / margin } else { margin }),
                if margin < 1.0 { "worse" } else { "better" },
                demands.error_deg
            );
        }
    }
    reasons.push(saliency);
    let [rated, pulses] = suitability.signature;
    let difference = suitability.polarity_difference.abs();
    let floor = SequentialSettings::<f64>::new(difference).floor;
    reasons.push(if !suitability.has_magnet {
        "Poles: none, the motor has no magnet; its axis is all there is to find.".to_owned()
    } else if let (true, Some(note)) = (suitability.pole_is_open(), suitability.pole.note()) {
        let way_out = match suitability.pole {
            PoleKnowledge::NotDetermined => "Points of both sides would tell; `standstill magnetics` shows what each core says.",
            _ => "By how much L_d falls at rated current along +d would tell, such as `saturation = \"6 %\"` in [nameplate].",
        };
        format!("Poles: {note}. {way_out}")
    } else if rated == Signature::None && pulses == Signature::None {
        format!(
            "Poles: they draw the same current, to {:.1} % near rated current: no test at standstill can tell them apart.",
            100.0 * difference
        )
    } else {
        format!(
            "Poles{}: {} near rated current, by {:.1} %, {} times what drive and sensors get wrong between two vectors ({:.1} %); {} in pulses of half that current, by {:.1} %.",
            if suitability.pole == PoleKnowledge::Assumed {
                " (assumed: the map has one side of the d-axis only)"
            } else {
                ""
            },
            rated.in_words(),
            100.0 * difference,
            factor(difference / floor),
            100.0 * floor,
            pulses.in_words(),
            100.0 * suitability.pulse_difference.abs()
        )
    });
    let pulse = suitability
        .candidates
        .first()
        .filter(|candidate| candidate.free.trials > 0)
        .and_then(|candidate| train(&candidate.settings).map(|t| (candidate, t)));
    if let Some((candidate, train)) = pulse {
        reasons.push(format!(
            "Line pulses of {} µs raise {} A at most; they move a free rotor by {:.3}°.",
            standstill_quantity::number(0, train.pulse.seconds() * 1e6),
            amperes(candidate.locked.peak_current_a),
            candidate.free.max_moved_deg
        ));
    }
    reasons
}

fn train(settings: &Method<f64>) -> Option<&PulseTrainSettings<f64>> {
    match settings {
        Method::Bipolar(settings) => Some(&settings.0.train),
        Method::MaximumLikelihood(settings) => Some(&settings.pulses.train),
        _ => None,
    }
}

/// The settings that matter, by name; those of the poles where there are some that are known.
fn settings(method: &Method<f64>, has_poles: bool) -> Vec<(&'static str, String)> {
    let mut all = Vec::new();
    method.describe(&mut |name, value| all.push((name, value.to_string())));
    all.retain(|(name, _)| has_poles || !(name.starts_with("polarity") || *name == "signature"));
    all
}

fn json(
    motor: &str,
    errors: ErrorSet,
    suitability: &Suitability,
    demands: &Demands,
    reasons: &[String],
) -> Value {
    let candidates: Vec<Value> = suitability
        .candidates
        .iter()
        .map(|candidate| {
            json!({
                "method": candidate.method.name(),
                "suited": candidate.objections.is_empty(),
                "objections": candidate.objections,
                "margin": candidate.margin,
                "locked": candidate.locked,
                "free": candidate.free,
            })
        })
        .collect();
    let recommended = suitability.recommended().map(|candidate| {
        let settings: serde_json::Map<String, Value> =
            settings(&candidate.settings, suitability.has_magnet && !suitability.pole_is_open())
                .into_iter()
                .map(|(name, value)| (name.to_owned(), value.into()))
                .collect();
        json!({ "method": candidate.method.name(), "margin": candidate.margin, "settings": settings })
    });
    json!({
        "motor": motor,
        "errors": errors.name(),
        "suited": recommended.is_some(),
        "pole_judged": !suitability.pole_is_open(),
        "pole": suitability.pole,
        "reasons": reasons,
        "demands": { "error_deg": demands.error_deg, "movement_deg": demands.movement_deg, "without_angle": demands.without_angle },
        "saliency_ratio": suitability.saliency_ratio,
        "limit_deg": suitability.limit.map(|bound| bound.scheme_deg),
        "limit_on_a_specimen_deg": suitability.limit.and_then(|bound| bound.hybrid_deg),
        "polarity_difference": suitability.polarity_difference,
        "pulse_polarity_difference": suitability.pulse_difference,
        "candidates": candidates,
        "recommended": recommended,
    })
}
