//! Whether the poles of a motor draw the same current.

use standstill_detect::Signature;
use standstill_plant::PoleKnowledge;
use standstill_scenario::pole_signature;

use super::bench::Bench;

/// Returns the largest compared current in A, if both poles draw the same current at all compared currents. `None` if they differ at a
/// compared current, or if their currents are not known.
pub(super) fn alike_up_to(bench: &Bench<'_>) -> Option<f64> {
    let (motor, most) = (bench.motor, bench.most_current);
    if !motor.has_magnet() || motor.pole_knowledge() != PoleKnowledge::Known {
        return None;
    }
    let mut alike = None;
    for current in [0.5 * motor.rated_current, motor.rated_current, most, 2.0 * most, 3.0 * most] {
        // No result if a flux map ends below this current.
        match pole_signature(motor, current) {
            Some((Signature::None, _)) => {
                alike = Some(alike.map_or(current, |before: f64| before.max(current)));
            }
            Some(_) => return None,
            None => {}
        }
    }
    alike
}
