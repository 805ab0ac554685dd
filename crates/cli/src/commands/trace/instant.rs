//! The error at the instant for which the found angle holds. It differs from the error at the end of the detection if the rotor turns.

use standstill_scenario::Record;

/// Smallest movement of the rotor, in electrical degrees, that the answer mentions.
const MOVED_DEG: f64 = 0.1;

/// Returns the line about the instant. None if the rotor hardly moved.
pub fn detail(record: &Record) -> Option<String> {
    let error = record.error_at_instant_deg().filter(|_| record.rotor_moved_deg() >= MOVED_DEG)?;
    let age = record.age_s()?;
    Some(format!(
        "the angle holds {:.2} ms before the end of the detection: its error then {error:+.3}°",
        age * 1e3
    ))
}
