//! The error at the instant for which the found angle holds. It differs from the error at the end of the detection if the rotor turns.

use std::f64::consts::TAU;

use standstill_scenario::Record;
use standstill_sim::Trace;

/// Smallest movement of the rotor, in electrical degrees, that the answer mentions.
const MOVED_DEG: f64 = 0.1;

/// Returns the rotor's angle in rad at a time in s, by linear interpolation between snapshots. None without snapshots.
fn angle_at(trace: &Trace, time: f64) -> Option<f64> {
    let after = trace.snapshots.partition_point(|snapshot| snapshot.time < time);
    let before = trace.snapshots.get(after.saturating_sub(1))?;
    let Some(next) = trace.snapshots.get(after).filter(|next| next.time > before.time) else {
        return Some(before.angle);
    };
    let share = (time - before.time) / (next.time - before.time);
    Some(before.angle + (next.angle - before.angle) * share)
}

/// Returns the error in degrees at the instant for which the found angle holds, in (−180, 180]. None if the detector found no angle or does
/// not state the instant.
pub fn error_deg(record: &Record, trace: &Trace) -> Option<f64> {
    let instant = record.run.duration.seconds() - record.findings().age?;
    let turned = record.run.end_angle - angle_at(trace, instant)?;
    let error = (record.error_deg()? + turned.to_degrees()).rem_euclid(TAU.to_degrees());
    Some(if error > 180.0 { error - 360.0 } else { error })
}

/// Returns the line about the instant. None if the rotor hardly moved.
pub fn detail(record: &Record, trace: &Trace) -> Option<String> {
    let error = error_deg(record, trace).filter(|_| record.rotor_moved_deg() >= MOVED_DEG)?;
    let age = record.findings().age?;
    Some(format!(
        "the angle holds {:.2} ms before the end of the detection: its error then {error:+.3}°",
        age * 1e3
    ))
}
