//! The three-phase winding: equations (1)–(7) of the paper.

use std::f64::consts::PI;

use nalgebra::Matrix3;
use standstill_interface::{Abc, Dq, Phase};
use standstill_numeric::{atan2, cos};

use crate::{FluxMap, Magnetics};

/// A star-connected three-phase winding over a salient rotor, without saturation.
///
/// In dq: `L_d = 3/2 (L_A + L_B) + L_σ`, `L_q = 3/2 (L_A − L_B) + L_σ`, `L_0 = L_σ`. Motors with interior
/// magnets have `L_d < L_q`, so `L_B < 0` in the convention of equation (1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Winding {
    /// L_A in H: self-inductance from the mean air-gap flux.
    pub mean_inductance: f64,
    /// L_B in H: amplitude of its variation with twice the rotor angle, with its sign.
    pub saliency: f64,
    /// L_σ in H: leakage of a phase.
    pub leakage: f64,
}

impl Winding {
    /// Returns the winding without leakage that a map looks like without current, and its magnet's flux in Wb:
    /// exactly zero if it has none.
    pub fn of_map(map: &FluxMap) -> (Self, f64) {
        let rest = map.flux_at(Dq::new(0.0, 0.0)).unwrap_or(Dq::new(0.0, 0.0));
        let l = map.current_and_inverse_inductance(rest).1.inverse();
        let winding =
            Self { mean_inductance: (l.xx + l.yy) / 3.0, saliency: (l.xx - l.yy) / 3.0, leakage: 0.0 };
        (winding, if map.has_magnet() { rest.d } else { 0.0 })
    }

    /// Returns the 3×3 inductance matrix in H at electrical angle θ in rad, equations (1) and (2), with the leakage
    /// on the diagonal.
    ///
    /// Without leakage, as printed in the paper, it is singular: equal currents in all phases make no air-gap flux.
    /// Nothing here inverts it; the star connection leaves only the αβ plane, where [`Winding::d_axis_inductance`]
    /// and [`Winding::q_axis_inductance`] are positive.
    ///
    /// ```
    /// use standstill_plant::Winding;
    ///
    /// let winding = Winding { mean_inductance: 9.2e-3, saliency: -2.1e-3, leakage: 0.0 };
    /// let matrix = winding.inductance_matrix(0.0);
    /// // The magnet's axis lies along phase a, whose inductance is least with interior magnets.
    /// assert!((matrix[(0, 0)] - 7.1e-3).abs() < 1e-12);
    /// assert!(matrix[(0, 0)] < matrix[(1, 1)]);
    /// ```
    pub fn inductance_matrix(&self, angle: f64) -> Matrix3<f64> {
        let self_inductance =
            |shift: f64| self.mean_inductance + self.leakage + self.saliency * cos(2.0 * angle + shift);
        let mutual = |shift: f64| -self.mean_inductance / 2.0 + self.saliency * cos(2.0 * angle + shift);
        let third = 2.0 * PI / 3.0;
        let (ab, bc, ac) = (mutual(-third), mutual(0.0), mutual(third));
        Matrix3::new(
            self_inductance(0.0),
            ab,
            ac,
            ab,
            self_inductance(-2.0 * third),
            bc,
            ac,
            bc,
            self_inductance(2.0 * third),
        )
    }

    /// Returns the inductance in H between two terminals with the third open, equation (3): L_xx + L_yy − 2 M_xy.
    pub fn line_inductance(&self, from: Phase, to: Phase, angle: f64) -> f64 {
        let l = self.inductance_matrix(angle);
        let (x, y) = (from as usize, to as usize);
        l[(x, x)] + l[(y, y)] - 2.0 * l[(x, y)]
    }

    /// Returns L_AB, L_BC and L_CA in H at electrical angle θ in rad, by equation (4) with the leakage of two phases:
    /// `3 L_A + 2 L_σ − 3 L_B cos(2θ + shift)`.
    ///
    /// ```
    /// use standstill_plant::{Winding, rotor_angle_from_lines};
    ///
    /// let winding = Winding { mean_inductance: 9.2e-3, saliency: -2.1e-3, leakage: 0.0 };
    /// let lines = winding.line_inductances(70_f64.to_radians());
    /// // Equation (5): their sum is nine times L_A, wherever the rotor is.
    /// assert!((lines.0.iter().sum::<f64>() - 9.0 * 9.2e-3).abs() < 1e-12);
    /// // Equation (7) leads back to the axis.
    /// assert!((rotor_angle_from_lines(lines, -1.0).to_degrees() - 70.0).abs() < 1e-9);
    /// ```
    pub fn line_inductances(&self, angle: f64) -> Abc<f64> {
        let third = 2.0 * PI / 3.0;
        Abc::new(-third, 0.0, third).map(|shift| {
            3.0 * self.mean_inductance + 2.0 * self.leakage - 3.0 * self.saliency * cos(2.0 * angle + shift)
        })
    }

    /// Returns L_d in H.
    ///
    /// ```
    /// use standstill_plant::Winding;
    ///
    /// let winding = Winding { mean_inductance: 9.2e-3, saliency: -2.1e-3, leakage: 0.0 };
    /// assert!((winding.d_axis_inductance() - 10.65e-3).abs() < 1e-12);
    /// assert!((winding.q_axis_inductance() - 16.95e-3).abs() < 1e-12);
    /// ```
    pub fn d_axis_inductance(&self) -> f64 {
        1.5 * (self.mean_inductance + self.saliency) + self.leakage
    }

    /// Returns L_q in H.
    pub fn q_axis_inductance(&self) -> f64 {
        1.5 * (self.mean_inductance - self.saliency) + self.leakage
    }
}

/// Returns the rotor angle in rad, modulo π, from the three line inductances: equation (7) read as a four-quadrant
/// arctangent, for a motor whose L_B has the sign of `saliency_sign`.
///
/// Equation (7) as printed takes L_B > 0; for a motor with interior magnets (L_B < 0) both components of (6) change
/// sign, and the printed formula would give the q-axis.
pub fn rotor_angle_from_lines(lines: Abc<f64>, saliency_sign: f64) -> f64 {
    let Abc([ab, bc, ca]) = lines;
    let sine = 3.0_f64.sqrt() * (ca - ab) * saliency_sign.signum();
    let cosine = (ca + ab - 2.0 * bc) * saliency_sign.signum();
    (atan2(sine, cosine) / 2.0).rem_euclid(PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    const PAPER: Winding = Winding { mean_inductance: 9.2e-3, saliency: -2.1e-3, leakage: 0.0 };

    fn axis_error_deg(estimate: f64, truth: f64) -> f64 {
        ((estimate - truth + PI / 2.0).rem_euclid(PI) - PI / 2.0).to_degrees().abs()
    }

    #[test]
    fn analytic_equation_3_gives_equation_4() {
        let winding = Winding { leakage: 0.4e-3, ..PAPER };
        for degree in 0..360 {
            let angle = f64::from(degree).to_radians();
            let Abc([ab, bc, ca]) = winding.line_inductances(angle);
            assert!((winding.line_inductance(Phase::A, Phase::B, angle) - ab).abs() < 1e-15);
            assert!((winding.line_inductance(Phase::B, Phase::C, angle) - bc).abs() < 1e-15);
            assert!((winding.line_inductance(Phase::C, Phase::A, angle) - ca).abs() < 1e-15);
            // Equation (5).
            assert!(((ab + bc + ca) / 9.0 - 9.2e-3 - 2.0 / 3.0 * 0.4e-3).abs() < 1e-15);
        }
    }

    #[test]
    fn analytic_equation_7_on_exact_inductances_is_exact() {
        for saliency in [-2.1e-3, 2.1e-3, -0.1e-3] {
            let winding = Winding { saliency, ..PAPER };
            for degree in 0..360 {
                let angle = f64::from(degree).to_radians();
                let estimate = rotor_angle_from_lines(winding.line_inductances(angle), saliency);
                assert!(axis_error_deg(estimate, angle) < 1e-9, "{degree}° with L_B = {saliency}");
            }
        }
    }

    #[test]
    fn analytic_the_printed_sign_gives_the_q_axis_of_an_interior_magnet_motor() {
        let angle = 0.3;
        let estimate = rotor_angle_from_lines(PAPER.line_inductances(angle), 1.0);
        assert!(axis_error_deg(estimate, angle + PI / 2.0) < 1e-9);
    }

    #[test]
    fn analytic_row_1_of_table_1_from_its_own_inductances() {
        let twice = 2.0 * rotor_angle_from_lines(Abc::new(33.6, 27.6, 18.8), -1.0).to_degrees();
        assert!((twice - 83.8).abs() < 0.05, "{twice}");
    }

    #[test]
    fn law_the_matrix_is_symmetric_and_its_dq_values_are_the_stated_ones() {
        for leakage in [0.0, 0.5e-3] {
            let winding = Winding { leakage, ..PAPER };
            for degree in (0..360).step_by(7) {
                let angle = f64::from(degree).to_radians();
                let l = winding.inductance_matrix(angle);
                assert!((l - l.transpose()).norm() < 1e-18);
                // A current vector along d makes flux along d only, with L_d.
                let along =
                    |shift: f64| Vector3::from_fn(|k, _| (angle + shift - 2.0 * PI / 3.0 * k as f64).cos());
                assert!((l * along(0.0) - along(0.0) * winding.d_axis_inductance()).norm() < 1e-15);
                let q = PI / 2.0;
                assert!((l * along(q) - along(q) * winding.q_axis_inductance()).norm() < 1e-15);
                // Zero sequence: singular without leakage, L_σ with it.
                let zero = Vector3::new(1.0, 1.0, 1.0);
                assert!((l * zero - zero * leakage).norm() < 1e-15);
            }
        }
    }
}
