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

/// Required accuracy of a step. All values are given per machine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Accuracy<V: Wide> {
    /// Reciprocal of the largest allowed flux error of a step, in 1/Wb.
    pub per_flux: V,
    /// Reciprocal of the largest allowed error of the angle, in 1/rad.
    pub per_angle: V,
    /// Reciprocal in 1/Wb of a change of flux over which saturation changes considerably.
    pub per_flux_scale: V,
    /// Inductance of the winding in H if filters follow the currents, so that the currents within steps must be accurate, too. Zero
    /// without filters.
    pub filtered: V,
    /// Time in ns during which an input of a filter still affects a later sample.
    pub remembered: V,
}

impl<V: Wide> Accuracy<V> {
    /// Returns the required accuracy of a step that ends at the time `until` in ns. `sample` is the time of the next sample in ns. The
    /// currents within the step must be accurate only if this sample still depends on them.
    #[inline(always)]
    pub fn of_step(&self, until: V, sample: V) -> Self {
        let shown = (until + self.remembered).above(sample);
        Self { filtered: V::only(shown, self.filtered), ..*self }
    }
}

/// Number of time constants after which a past input of a filter is neglected. Its weight is then e^−4, 2 %.
pub const REMEMBERED: f64 = 4.0;

/// Error of the quadrature of the resistive drop, per ohm and per ampere of the currents' fourth-order term. For a current that decays
/// with x = h/τ, the fourth-order term is x⁴/18, and the quadrature errs by x⁴/720, a fortieth of the term. The constant is eight times
/// that ratio, to allow for currents that are not a single exponential. The error estimate doubles it again, because it multiplies by the
/// sum of two resistances.
const QUADRATURE: f64 = 0.2;

/// Error of the force on ringing terminals, per weber of the fourth-order term. If the force is e^(−x s), its cubic errs by x⁴/24 s²(1 −
/// s)² within a step. This error moves the flux by at most x⁴/720, a fortieth of the fourth-order term, and by less if the oscillation
/// turns meanwhile. In an undamped oscillation the errors of successive steps add up: after 80 steps with the same error, their sum
/// reaches the tolerance.
const RINGING: f64 = 2.0;

/// Error of the linear correction of the core, per squared distance in Wb² and per reciprocal of the flux over which saturation changes
/// considerably. The distance is that between the end and the flux at which the core was evaluated. The error is half of the curvature.
/// In a core with cusps, the curvature is up to eight times the reciprocal of that flux.
const CURVATURE: f64 = 4.0;

/// Share of the currents' fourth-order term that reaches a filter. The error of a cubic is at most h⁴ i⁗/384, a twentieth of the term h⁴
/// i⁗/18. The constant is twice that share.
const FILTERED: f64 = 0.1;

/// Error of the rule for the lagging flux χ over a step of x time constants, per x⁵ and per weber of the lag. For a decay e^−x the rule
/// errs by x⁵/720. If the winding's flux also changes, as e^(−k x s), the rule errs by about (k + 1/2)⁵ times this. For k = 2 that is a
/// hundred times, relative to the winding's flux change, which is never much larger than the lag. The constant is 72 times the first
/// error. For all k up to 2 the error is below the estimate.
const RELAXING: f64 = 0.1;

/// Returns the error in Wb of the lagging flux over a step of `x` time constants. `most` is the largest lag in Wb.
#[inline(always)]
pub(crate) fn relaxing_error<V: Wide>(most: V, x: V) -> V {
    most * (x * x) * (x * x) * x * RELAXING
}

/// Returns the error in Wb of a lagging flux over a step of `x` time constants, if its lag tends to a steady state. `most` is the largest
/// distance in Wb of the lag from this steady state. A steady lag has no error, and the rule never amplifies the distance.
#[inline(always)]
pub(crate) fn settling_error<V: Wide>(most: V, x: V) -> V {
    let square = x * x;
    most * (square * square * x * RELAXING).least(V::of(2.0))
}

/// Returns the error of a step with ringing terminals, relative to the tolerance. The error has three parts. The first is the error of
/// the step's cubics in Wb. The second comes from the distance `off` in Wb between the end and the flux at which the core was evaluated.
/// The third is the error of the currents within the step, if filters follow them.
#[inline(always)]
pub(crate) fn ringing_error<V: Wide>(accuracy: &Accuracy<V>, ringing: &Ringing<V>, off: Plane<V>) -> V {
    let nonlinear = off.dot(off) * accuracy.per_flux_scale * CURVATURE;
    let between = V::only(accuracy.filtered.above(V::of(0.0)), ringing.error_between()) * FILTERED;
    (ringing.error() * RINGING + between + nonlinear) * accuracy.per_flux
}

/// Returns the error of a step without ringing terminals, relative to the tolerance. Its parts are the quadrature of the resistive drop,
/// the linear correction of the core and, if filters follow the currents, the currents within the step. `off` is the distance in Wb
/// between the end and the flux at which the core was evaluated.
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
