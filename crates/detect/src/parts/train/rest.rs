//! The rest after a pulse, and rests as shares of a pulse.

use standstill_interface::Nanos;

/// Returns the rest that a pulse of this length needs: 1.6 times as long.
pub(crate) fn rest_after(pulse: Nanos) -> Nanos {
    Nanos(pulse.0 / 10) * 16
}

/// Returns a rest as a share of the pulse, rounded to a thousandth: as it was set, although times are whole
/// nanoseconds.
pub(crate) fn share_of(pulse: Nanos, rest: Nanos) -> f64 {
    let pulse = pulse.0.max(1);
    (rest.0.saturating_mul(1000).saturating_add(pulse / 2) / pulse) as f64 / 1e3
}
