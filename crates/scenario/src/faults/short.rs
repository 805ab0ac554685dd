//! Shorts of turns: the sizes that a winding allows, and the typical ones.

use standstill_plant::Motor;
use standstill_sim::Short;

use super::FaultSettings;
use crate::document::FileError;

/// Smallest time constant in s of shorted turns that is simulated. With a smaller time constant, the integrator would need more and shorter
/// steps.
const SHORTEST_CONSTANT: f64 = 2e-7;

/// Ratio between the smallest time constant of typical shorts and the smallest allowed time constant. The ratio is above 1, so that rounded
/// sizes are still allowed.
const ROOM: f64 = 1.05;

/// Smallest and largest typical share of shorted turns.
const SHARES: [f64; 2] = [0.05, 0.5];

/// Smallest and largest typical coupling. The square of the smallest coupling exceeds the largest typical share, as
/// [`check`] requires.
pub(super) const COUPLINGS: [f64; 2] = [0.71, 0.95];

/// Largest typical resistance of a short, as a share of the resistance of a phase.
const MOST_RESISTANCE: f64 = 0.5;

/// Returns the smallest and largest typical share of shorted turns. On some motors the current of shorted turns settles fast. For these
/// motors the smallest share is raised until the time constant without resistance is twice the smallest allowed time constant.
pub(super) fn shares(motor: &Motor) -> [f64; 2] {
    let [least, most] = SHARES;
    // The time constant is proportional to the share.
    let constant = Short { share: least, resistance: 0.0, coupling: COUPLINGS[1] }.time_constant(motor);
    [least * (2.0 * SHORTEST_CONSTANT / constant).max(1.0), most]
}

/// Returns the smallest and largest typical resistance in Ω. The largest resistance is limited so that the current still settles slowly
/// enough when the share of shorted turns is the smallest typical share.
pub(super) fn resistances(motor: &Motor) -> [f64; 2] {
    let least = Short { share: shares(motor)[0], resistance: 0.0, coupling: COUPLINGS[1] };
    let allowed = least.resistance_of(motor, ROOM * SHORTEST_CONSTANT);
    [0.0, allowed.min(MOST_RESISTANCE * motor.resistance)]
}

/// Returns whether all typical shorts of a motor's turns can be simulated.
pub(super) fn is_typical(motor: &Motor) -> bool {
    let [least, most] = shares(motor);
    least < most
}

/// Checks the sizes of a short of turns. `number` is the number of the fault, counted from 0; the error contains this number.
///
/// # Errors
/// The mutual inductance of the shorted turns and the other turns of their phase is negative, or the current of the
/// shorted turns settles too fast.
pub(super) fn check(fault: &FaultSettings, motor: &Motor, number: usize) -> Result<(), FileError> {
    let ([least, most], [[_, resistance], [weak, coupling]]) = (fault.size, fault.further);
    let refuse = |found: &str, needed: &str| {
        Err(FileError::key(&format!("faults[{number}].magnitude"), found, needed))
    };
    if most > weak * weak * (1.0 + 1e-9) {
        let found = format!("{} % of the turns with a `coupling` of {weak}", percent(most));
        let needed = format!(
            "at most {} %, the square of the smallest `coupling`: with more, the shorted turns and the others of their phase would oppose each other, M = k L (1 − k/c²) < 0",
            percent(weak * weak)
        );
        return refuse(&found, &needed);
    }
    // The drawn short that settles fastest.
    let short = Short { share: least, resistance, coupling };
    let constant = short.time_constant(motor);
    if constant >= SHORTEST_CONSTANT {
        return Ok(());
    }
    let allowed = short.resistance_of(motor, SHORTEST_CONSTANT);
    let way = if allowed > 0.0 {
        format!(
            "a `resistance` of at most {allowed:.3e} Ω with {} % of the turns and a `coupling` of {coupling}",
            percent(least)
        )
    } else {
        let without = Short { resistance: 0.0, ..short }.time_constant(motor);
        format!(
            "at least {} % of the turns with a `coupling` of {coupling}",
            percent(least * SHORTEST_CONSTANT / without)
        )
    };
    let found = format!("a short that settles within {:.3} µs", constant * 1e6);
    refuse(&found, &format!("at least 0.2 µs, for the engine's steps follow it: {way}"))
}

/// Formats a share in per cent.
fn percent(share: f64) -> String {
    let per_cent = (share * 1e4).round() / 100.0;
    per_cent.to_string()
}
