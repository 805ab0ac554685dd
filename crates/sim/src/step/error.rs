//! Error estimate of a step, relative to the tolerance.
//!
//! Each factor has a reason, which `tests` compares with closed forms; all factors are checked against the referee,
//! too, on eight motors and with larger and smaller tolerances (`tests/suite/{referee,convergence,accuracy}.rs`).

#[cfg(test)]
mod tests;

use standstill_numeric::{Symmetric, Wide};

use super::two_derivative::Here;
use crate::effect::terminals::ringing::Ringing;
use crate::physics::machine::Change;
use crate::physics::plane::Plane;

/// Required accuracy of a step, machine by machine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Accuracy<V: Wide> {
    /// 1 over the largest error of a step in Wb.
    pub per_flux: V,
    /// 1 over the largest error of the angle in rad.
    pub per_angle: V,
    /// 1 over a flux in Wb over which saturation changes much.
    pub per_flux_scale: V,
    /// Inductance of the winding in H where the currents between the ends matter too, as for filters; else 0.
    pub filtered: V,
    /// Time in ns over which a filter's past input still affects a sample.
    pub remembered: V,
}

impl<V: Wide> Accuracy<V> {
    /// Returns the accuracy of a step until a time in ns: currents between its ends matter only if the next sample,
    /// at `sample`, shows them.
    #[inline(always)]
    pub fn of_step(&self, until: V, sample: V) -> Self {
        let shown = (until + self.remembered).above(sample);
        Self { filtered: V::only(shown, self.filtered), ..*self }
    }
}

/// Number of time constants after which a filter's past input is neglected: e^−4, 2 % of it, is then left.
pub const REMEMBERED: f64 = 4.0;

/// Error of the drop's quadrature, per ohm and ampere of the fourth-order term below. For a current that decays with
/// x = h/τ that term is x⁴/18 and the quadrature misses x⁴/720, a fortieth of the term. Eight times that, for
/// currents that are no single exponential; the sum of two resistances doubles the factor once more.
const QUADRATURE: f64 = 0.2;

/// Error of the force on terminals that ring, per weber. Of a force e^(−x s) a cubic misses x⁴/24 s²(1 − s)² within a
/// step, which moves the flux by x⁴/720 at most, a fortieth of the fourth-order term, and by less where the
/// oscillation turns meanwhile. An undamped oscillation keeps its error: 80 steps in a row may have the same error
/// before the sum reaches the tolerance.
const RINGING: f64 = 2.0;

/// Error of a linear correction from the place where the core was evaluated, as a factor of the square of the flux
/// over the flux by which saturation changes much: half of the curvature, which is up to eight times 1 over that flux
/// in a core with cusps.
const CURVATURE: f64 = 4.0;

/// Share of the currents' fourth-order term between the ends of a step that reaches a filter: at most h⁴ i⁗/384 of h⁴
/// i⁗/18, a twentieth, and twice that.
const FILTERED: f64 = 0.1;

/// Error of the rule for the lagging flux: of e^−x it misses x⁵/720. If the winding's flux changes too, as e^(−k x
/// s), the rule misses some (k + 1/2)⁵ times that, at k = 2 a hundred times in units of that flux, which is never far
/// more than the lag: 72 times, and an error below the estimate for all k up to 2.
const RELAXING: f64 = 0.1;

/// Returns the error in Wb of a lagging flux, with a lag of at most `most` in Wb, over `x` of its time constants.
#[inline(always)]
pub(crate) fn relaxing_error<V: Wide>(most: V, x: V) -> V {
    most * (x * x) * (x * x) * x * RELAXING
}

/// Returns the error of a step in which terminals ring, relative to the tolerance: from the error of its cubics in
/// Wb, from the distance `off` in Wb of the core's evaluation to the end, and, where filters measure them, from the
/// error of the currents between its ends.
#[inline(always)]
pub(crate) fn ringing_error<V: Wide>(accuracy: &Accuracy<V>, ringing: &Ringing<V>, off: Plane<V>) -> V {
    let nonlinear = off.dot(off) * accuracy.per_flux_scale * CURVATURE;
    let between = V::only(accuracy.filtered.above(V::of(0.0)), ringing.error_between()) * FILTERED;
    (ringing.error() * RINGING + between + nonlinear) * accuracy.per_flux
}

/// Returns the error of a step, relative to the tolerance.
#[inline(always)]
pub(crate) fn error<V: Wide>(
    accuracy: &Accuracy<V>,
    h: V,
    resistance: &Symmetric<V>,
    begin: &Here<V>,
    end: &Here<V>,
    [change, end_change]: [&Change<V>; 2],
    off: Plane<V>,
) -> V {
    // A = i₁ − i₀ − h i₀′ and B = h (i₁′ − i₀′): B − 2 A is h³ i‴/6 and more; by its ratio to A follows the next order.
    let first = end.at.current - begin.at.current - change.current * h;
    let twice = (end_change.current - change.current) * h;
    let third = twice - first - first;
    let second = first.x.abs() + first.y.abs();
    let third = third.x.abs() + third.y.abs();
    let fourth = third * third / (second + third + 1e-30);
    let loop_resistance = resistance.xx + resistance.yy;
    let quadrature = loop_resistance * h * fourth * QUADRATURE;
    let nonlinear = off.dot(off) * accuracy.per_flux_scale * CURVATURE;
    // Between the ends the currents are off by h⁴ i⁗/384; what a filter sees of it counts as the flux that belongs to it.
    let between = accuracy.filtered * fourth * FILTERED;
    (quadrature + nonlinear + between) * accuracy.per_flux
}
