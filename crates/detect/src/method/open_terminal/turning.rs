//! Whether the rotor turns, judged by the voltage that its magnet induces during the pulses.
//!
//! The first pulse of a pair turns a light rotor, and the second one, with the opposite torque, stops it again. While
//! either is sampled, the rotor turns at the speed `Ω sin x/(1 + k cos 2x)`, where Ω is the impulse of a pulse across
//! the magnet divided by the inertia. This adds a part proportional to sin 2x to `r⁺ − r⁻`. In three lines, 120° apart,
//! that part is `sin 3x cos x_k − cos 3x sin x_k`: it looks like a constant speed together with saturation, possibly of
//! the other pole, and no limit can tell them apart. In a second round, each pair begins with the other pulse, so that
//! Ω changes its sign and cancels in the sum of both rounds. The second round is given only if the first one shows a
//! rotor that turns.

use standstill_interface::{Angle, Dq, Fault, Real};

use super::{OpenTerminal, Solution};
use crate::checks::Check;
use crate::parts::lines::line_angles;
use crate::parts::polarity::Pointer;
use crate::parts::turning::Standing;

/// Quantities of the least-squares estimate of the pole: the solution for the axis with k = L_B/L_A; the sum of
/// products of the lines' differences with the template of saturation; the sum of the template's squares; the variance
/// of a line's difference.
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
    /// Returns the templates of `r⁺ − r⁻` in a line at angle x from the magnet: that of a turning magnet, as a multiple
    /// of `−3 ωψ/U`, and that of saturation, as a multiple of its effect on L_d.
    pub(super) fn templates(&self, k: T, x: T) -> [T; 2] {
        let (one, two) = (T::one(), T::of(2.0));
        let rho = (one - k) / (one + k);
        let (sin, cos) = x.sin_cos();
        let lines = one + k * (two * cos * cos - one);
        let along = cos * cos;
        let cross = self.settings.cross_saturation * rho * (rho * sin * sin - two * along);
        [(one + k) * cos / lines, -sin * (along + cross) / (lines * lines * lines)]
    }

    /// Checks that the rotor stands still.
    pub(super) fn check_standing(&mut self, pulses: &Pulses<'_, T>, axis: Angle<T>) -> Result<(), Fault<T>> {
        let s = &self.settings;
        if !s.checks.has(Check::Turning) {
            return Ok(());
        }
        // Saturation and speed are fitted by least squares. The estimate of saturation is scaled so that noise is equal
        // in both.
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
