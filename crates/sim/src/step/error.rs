//! Error estimate of a step, relative to the tolerance.
//!
//! The reason for each factor stands beside it; `tests` compares the factors with closed forms. All factors are also checked
//! against the referee, on eight motors and with larger and smaller tolerances
//! (`tests/suite/{referee,convergence,accuracy}.rs`).

#[cfg(test)]
mod tests;

use standstill_numeric::{Symmetric, Wide};

use super::two_derivative::Here;
use crate::effect::terminals::ringing::Ringing;
use crate::physics::machine::Change;
use crate::physics::plane::Plane;

/// Required accuracy of a step, one value per machine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Accuracy<V: Wide> {
    /// Reciprocal of the largest allowed flux error of a step, in 1/Wb.
    pub per_flux: V,
    /// Reciprocal of the largest allowed error of the angle, in 1/rad.
    pub per_angle: V,
    /// Reciprocal of a flux over which saturation changes considerably, in 1/Wb.
    pub per_flux_scale: V,
    /// Inductance of the winding in H if the currents within steps must be accurate too, because filters follow them;
    /// else 0.
    pub filtered: V,
    /// Time in ns over which a filter's past input still affects a sample.
    pub remembered: V,
}

impl<V: Wide> Accuracy<V> {
    /// Returns the accuracy of a step that ends at a time in ns. The currents within it must be accurate only if the
    /// next sample, at `sample` in ns, still depends on them.
    #[inline(always)]
    pub fn of_step(&self, until: V, sample: V) -> Self {
        let shown = (until + self.remembered).above(sample);
        Self { filtered: V::only(shown, self.filtered), ..*self }
    }
}

/// Number of time constants after which a filter's past input is neglected: its weight is then e^−4, 2 %.
pub const REMEMBERED: f64 = 4.0;

/// Error of the quadrature of the resistive drop, per ohm and ampere of the fourth-order term below. For a current that
/// decays with x = h/τ that term is x⁴/18, and the quadrature errs by x⁴/720, a fortieth of the term. The constant is
/// eight times that ratio, for currents that are not a single exponential. The error estimate doubles it once more,
/// because it multiplies by the sum of two resistances.
const QUADRATURE: f64 = 0.2;

/// Error of the force on ringing terminals, per weber. For a force e^(−x s) a cubic errs by x⁴/24 s²(1 − s)² within a
/// step. This error moves the flux by at most x⁴/720, a fortieth of the fourth-order term, and by less where the
/// oscillation turns meanwhile. In an undamped oscillation the errors add up: 80 successive steps may have the same
/// error before their sum reaches the tolerance.
const RINGING: f64 = 2.0;

/// Error of the linear correction from the point at which the core was evaluated, per squared distance in Wb² divided by the
/// flux over which saturation changes considerably. It is half of the curvature; in a core with cusps, the curvature is up
/// to eight times the reciprocal of that flux.
const CURVATURE: f64 = 4.0;

/// Share of the currents' fourth-order term within a step that reaches a filter. The error of a cubic is at most h⁴
/// i⁗/384, a twentieth of the term h⁴ i⁗/18; the constant is twice that.
const FILTERED: f64 = 0.1;

/// Error of the rule for the lagging flux χ over a step of x time constants, per x⁵ and weber of the lag. For a decay e^−x the
/// rule errs by x⁵/720. If the winding's flux changes, too, as e^(−k x s), the rule errs by about (k + 1/2)⁵ times this:
/// for k = 2 a hundred times, relative to the winding's flux change, which is never much larger than the lag. The constant
/// is 72 times the first error; the error is below the estimate for all k up to 2.
const RELAXING: f64 = 0.1;

/// Returns the error in Wb of the lagging flux over a step of `x` time constants; `most`: largest lag in Wb.
#[inline(always)]
pub(crate) fn relaxing_error<V: Wide>(most: V, x: V) -> V {
    most * (x * x) * (x * x) * x * RELAXING
}

/// Returns the error in Wb of a lagging flux over a step of `x` time constants, if its lag tends to a steady state; `most`: largest
/// distance in Wb of the lag from this steady state. A steady lag has no error, and the rule amplifies no distance.
#[inline(always)]
pub(crate) fn settling_error<V: Wide>(most: V, x: V) -> V {
    let square = x * x;
    most * (square * square * x * RELAXING).least(V::of(2.0))
}

/// Returns the error of a step with ringing terminals, relative to the tolerance. It has three parts: the error of the
/// step's cubics in Wb; the distance `off` in Wb between the end and the point at which the core was evaluated; and, if
/// filters follow the currents, the error of the currents within the step.
#[inline(always)]
pub(crate) fn ringing_error<V: Wide>(accuracy: &Accuracy<V>, ringing: &Ringing<V>, off: Plane<V>) -> V {
    let nonlinear = off.dot(off) * accuracy.per_flux_scale * CURVATURE;
    let between = V::only(accuracy.filtered.above(V::of(0.0)), ringing.error_between()) * FILTERED;
    (ringing.error() * RINGING + between + nonlinear) * accuracy.per_flux
}

/// Returns the error of a step without ringing terminals, relative to the tolerance: quadrature of the drop, linear correction of the
/// core, and, if filters follow the currents, the currents within the step. `off`: distance in Wb between the end and the point at
/// which the core was evaluated.
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
    // With A = i₁ − i₀ − h i₀′ and B = h (i₁′ − i₀′), B − 2 A is h³ i‴/6 plus higher terms. Its ratio to A estimates the next term.
    let first = end.at.current - begin.at.current - change.current * h;
    let twice = (end_change.current - change.current) * h;
    let third = twice - first - first;
    let second = first.x.abs() + first.y.abs();
    let third = third.x.abs() + third.y.abs();
    let fourth = third * third / (second + third + 1e-30);
    let loop_resistance = resistance.xx + resistance.yy;
    let quadrature = loop_resistance * h * fourth * QUADRATURE;
    let nonlinear = off.dot(off) * accuracy.per_flux_scale * CURVATURE;
    // Between the ends the currents err by h⁴ i⁗/384. The part that reaches a filter counts as the flux that causes such a current.
    let between = accuracy.filtered * fourth * FILTERED;
    (quadrature + nonlinear + between) * accuracy.per_flux
}
