//! Whether the rotor turns, by what its magnet induces in the pulses.
//!
//! The first pulse of a pair turns a light rotor, and the second one, with the opposite torque, stops it again. At the samples of both it turns by the
//! same speed `Ω sin x/(1 + k cos 2x)`, where Ω is the impulse of a pulse across the magnet over the inertia. What that leaves in `r⁺ − r⁻` goes
//! with sin 2x, which in three lines, 120° apart, is `sin 3x cos x_k − cos 3x sin x_k`: a speed that lasts, and saturation, which may be that
//! of the other pole. No limit tells them apart. A second round, in the opposite order, begins each pair with the other pulse: Ω has the other
//! sign, and cancels in the sum of both. It is given where a single round shows a rotor that turns.

use standstill_interface::{Angle, Dq, Fault, Real};

use super::{OpenTerminal, Solution};
use crate::checks::Check;
use crate::parts::lines::line_angles;
use crate::parts::polarity::Pointer;
use crate::parts::turning::Standing;

/// What the pulses tell of the pole, by least squares: the products of the lines' differences with saturation's template, its square, and the
/// variance of a line's difference.
pub(super) struct Pulses<'a, T> {
    pub solution: &'a Solution<T>,
    pub k: T,
    pub product: T,
    pub square: T,
    pub of_line: T,
    /// Mean voltage in V across the lines.
    pub across: T,
}

impl<T: Real> OpenTerminal<T> {
    /// What a magnet that turns leaves of both signs in the line at this angle x from it, as a multiple of `−3 ωψ/U`; and saturation,
    /// as a multiple of what it takes from L_d.
    pub(super) fn templates(&self, k: T, x: T) -> [T; 2] {
        let (one, two) = (T::one(), T::of(2.0));
        let rho = (one - k) / (one + k);
        let (sin, cos) = x.sin_cos();
        let lines = one + k * (two * cos * cos - one);
        let along = cos * cos;
        let cross = self.settings.cross_saturation * rho * (rho * sin * sin - two * along);
        [(one + k) * cos / lines, -sin * (along + cross) / (lines * lines * lines)]
    }

    /// Checks that the rotor stands.
    pub(super) fn check_standing(&mut self, pulses: &Pulses<'_, T>, axis: Angle<T>) -> Result<(), Fault<T>> {
        let s = &self.settings;
        if !s.checks.has(Check::Turning) {
            return Ok(());
        }
        // Saturation and speed by least squares; the former in what it leaves where the latter leaves as much, so that noise has as
        // much of each.
        let (mut turning, mut turning_square, mut mixed) = (T::zero(), T::zero(), T::zero());
        for (angle, difference) in line_angles::<T>().into_iter().zip(pulses.solution.differences) {
            let [induced, template] = self.templates(pulses.k, angle - axis.radians());
            turning = turning + induced * difference;
            turning_square = turning_square + induced * induced;
            mixed = mixed + induced * template;
        }
        let left = turning_square - mixed * mixed / pulses.square;
        let along = pulses.product / pulses.square;
        let across_axis = (turning - mixed * along) / left;
        let along_axis = (pulses.product - mixed * across_axis) / (pulses.square * left).sqrt();
        let shown = Dq::new(along_axis, across_axis);
        let deviation = (pulses.of_line / left).sqrt();
        let shown = Pointer { direction: shown.unpark(axis), deviation };
        let standing = Standing {
            by_volt: T::of(3.0) / pulses.across,
            flux: s.magnet_flux,
            signature: s.signature,
            pole_error: s.pole_error,
        };
        let of_axis = self.findings.angle_deviation.unwrap_or(T::zero());
        standing.check(&mut self.margin, &shown, axis, of_axis)
    }
}
