//! One detection with all its waveforms, in a binary format, so that a page need not parse text.
//!
//! ```text
//!   length of the header │ header (JSON, padded to 8 bytes) │ times (f64) │ a column (f32) after the other │ modes (bytes)
//! ```
//! The samples follow in the same layout: times, then columns. All numbers are little-endian.

use serde::Deserialize;
use serde_json::{Value, json};
use standstill_interface::{Outcome, Phase, Sensed};
use standstill_inverter::Conduction;
use standstill_scenario::{Record, Specimen, doubts, specimen};
use standstill_sim::{Ended, Event, Snapshot, Trace};

use crate::bench::Bench;
use crate::error::LabError;
use crate::setting::Setting;

/// Request of one trial, at its drawn angle or at another.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectionRequest {
    /// The scenario.
    pub setting: Setting,
    /// Number of the trial, which determines the draws of drive, sensors and noise.
    pub trial: u64,
    /// Electrical angle at the start in degrees; none: as the trial draws it.
    pub angle: Option<f64>,
}

/// Rows of a long detection: more than a screen has points.
const MOST_ROWS: f64 = 30e3;

/// Columns of the waveforms beside the time.
const COLUMNS: [&str; 11] =
    ["i_a", "i_b", "i_c", "v_a", "v_b", "v_c", "u_dc", "theta", "omega", "torque", "i_link"];

/// Columns of the samples: readings, and their errors.
const SAMPLES: [&str; 8] = ["i_a", "i_b", "i_c", "u_dc", "e_a", "e_b", "e_c", "i_link"];

pub(crate) fn answer(bench: &Bench, request: &DetectionRequest) -> Result<Vec<u8>, LabError> {
    let ready = bench.ready(&request.setting)?;
    let single = ready.single(request.trial)?;
    let scenario = &single.scenario;
    let case = match request.angle {
        Some(angle) if angle.is_finite() => {
            let specimen = Specimen { drive: request.trial, noise: request.trial };
            scenario.case_at(angle.to_radians(), specimen)
        }
        Some(_) => return Err(LabError::request("an angle that is no number")),
        None => single.case(),
    };
    let (record, _, trace) = scenario.watched(&case, false, MOST_ROWS).map_err(LabError::of)?;
    let samples = samples(&trace);
    let words = specimen(&case, &single.drawn);
    let mut header = header(&record, &trace, samples.len(), &words);
    let doubts: Vec<String> = doubts::of(scenario).into_iter().chain(doubts::standing(scenario)).collect();
    header["doubts"] = doubts.into();
    Ok(bytes(&header, &trace, &samples))
}

/// A sample: its readings and their errors.
struct Sample {
    time: f64,
    columns: [f64; SAMPLES.len()],
}

fn samples(trace: &Trace) -> Vec<Sample> {
    let read = trace.events.iter().filter_map(|(time, event)| match event {
        Event::Sample(reading) => Some((*time, reading)),
        _ => None,
    });
    read.map(|(time, reading)| {
        let there = current_at(&trace.snapshots, time);
        // A page draws nothing of what no sensor sees.
        let seen = |value: f64, sensed: Sensed| if sensed == Sensed::Hidden { f64::NAN } else { value };
        let [a, b, c] = Phase::ALL.map(|phase| seen(reading.current[phase], reading.sensed[phase]));
        let link = seen(reading.link_current, reading.link_sensed);
        Sample { time, columns: [a, b, c, reading.dc_link, a - there[0], b - there[1], c - there[2], link] }
    })
    .collect()
}

/// Returns the currents at a time, interpolated between the snapshots before and after.
fn current_at(snapshots: &[Snapshot], time: f64) -> [f64; 3] {
    let after = snapshots.partition_point(|snapshot| snapshot.time < time);
    let Some(next) = snapshots.get(after).or(snapshots.last()) else { return [f64::NAN; 3] };
    let before = snapshots.get(after.wrapping_sub(1)).unwrap_or(next);
    let span = next.time - before.time;
    let share = if span > 0.0 { ((time - before.time) / span).clamp(0.0, 1.0) } else { 0.0 };
    std::array::from_fn(|k| before.current[k] + share * (next.current[k] - before.current[k]))
}

fn header(record: &Record, trace: &Trace, samples: usize, words: &[(String, String)]) -> Value {
    let findings = record.findings();
    let commands: Vec<f64> = trace
        .events
        .iter()
        .filter_map(|(time, event)| matches!(event, Event::Command).then_some(*time))
        .collect();
    let estimate = match &record.run.ended {
        Ended::Outcome(Outcome::Found { angle, .. } | Outcome::Axis { angle, .. }) => Some(angle.degrees()),
        _ => None,
    };
    json!({
        "rows": trace.snapshots.len(),
        "columns": COLUMNS,
        "modes": Conduction::ALL.map(|mode| mode.to_string().replace('_', " ")),
        "samples": samples,
        "sample_columns": SAMPLES,
        "commands": commands,
        "trial": record.trial,
        "outcome": record.verdict().name(),
        "reason": record.reason(),
        "start_angle": record.start_angle_deg(),
        "true_angle": record.true_angle_deg(),
        "estimate": estimate,
        "error": record.error_deg(),
        "axis_error": record.axis_error_deg(),
        "pole_correct": record.pole_correct(),
        "moved": record.rotor_moved_deg(),
        "duration": record.run.duration.seconds(),
        "peak_current": record.run.peak_current,
        "mean_inductance": findings.mean_inductance,
        "saliency": findings.saliency,
        "age": findings.age,
        "angle_deviation": findings.angle_deviation.map(f64::to_degrees),
        "pole_error": findings.pole_error,
        "pole_evidence": findings.pole_evidence.map(|e| [e.deviations, e.needed]),
        "specimen": words,
    })
}

fn bytes(header: &Value, trace: &Trace, samples: &[Sample]) -> Vec<u8> {
    let mut text = header.to_string().into_bytes();
    // Times are numbers of eight bytes, which must lie at multiples of eight for a page to see them as such.
    while !(text.len() + 4).is_multiple_of(8) {
        text.push(b' ');
    }
    let rows = &trace.snapshots;
    let mut out =
        Vec::with_capacity(text.len() + rows.len() * (8 + 4 * COLUMNS.len() + 4) + samples.len() * 40 + 64);
    // A header has some kilobytes.
    out.extend(u32::try_from(text.len()).unwrap_or(0).to_le_bytes());
    out.extend(text);
    out.extend(rows.iter().flat_map(|row| row.time.to_le_bytes()));
    out.extend(samples.iter().flat_map(|sample| sample.time.to_le_bytes()));
    for column in 0..COLUMNS.len() {
        out.extend(rows.iter().flat_map(|row| single(cell(row, column)).to_le_bytes()));
    }
    for column in 0..SAMPLES.len() {
        out.extend(samples.iter().flat_map(|sample| single(sample.columns[column]).to_le_bytes()));
    }
    for leg in 0..3 {
        let number = |mode: Conduction| Conduction::ALL.iter().position(|known| *known == mode).unwrap_or(6);
        out.extend(rows.iter().map(|row| u8::try_from(number(row.modes[leg])).unwrap_or(6)));
    }
    out
}

/// Returns a number in single precision, whose seven digits suffice for drawing.
#[expect(clippy::cast_possible_truncation, reason = "what is drawn")]
const fn single(value: f64) -> f32 {
    value as f32
}

fn cell(row: &Snapshot, column: usize) -> f64 {
    match column {
        0..=2 => row.current[column],
        3..=5 => row.potential[column - 3],
        6 => row.dc_link,
        7 => row.angle.to_degrees(),
        8 => row.speed,
        9 => row.torque,
        _ => row.link_current(),
    }
}
