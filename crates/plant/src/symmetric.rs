//! Symmetric 2×2 matrices: symmetric by type, so that reciprocity cannot be broken by a typing error.

use standstill_interface::{AlphaBeta, Dq};

/// A symmetric 2×2 matrix `[xx, xy; xy, yy]`, in whichever plane its user works.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Symmetric {
    /// First diagonal element.
    pub xx: f64,
    /// Off-diagonal element.
    pub xy: f64,
    /// Second diagonal element.
    pub yy: f64,
}

impl Symmetric {
    /// From its three elements.
    pub const fn new(xx: f64, xy: f64, yy: f64) -> Self {
        Self { xx, xy, yy }
    }

    /// Determinant.
    pub fn determinant(self) -> f64 {
        self.xx * self.yy - self.xy * self.xy
    }

    /// Inverse; the matrix must not be singular.
    #[must_use]
    pub fn inverse(self) -> Self {
        let det = self.determinant();
        Self::new(self.yy / det, -self.xy / det, self.xx / det)
    }

    /// Whether both eigenvalues are positive.
    pub fn is_positive_definite(self) -> bool {
        self.xx > 0.0 && self.determinant() > 0.0
    }

    /// The smaller eigenvalue.
    pub fn smaller_eigenvalue(self) -> f64 {
        let (mean, half) = ((self.xx + self.yy) / 2.0, (self.xx - self.yy) / 2.0);
        mean - half.hypot(self.xy)
    }

    /// The same operator, given in the rotor's plane, in the stator's plane.
    #[must_use]
    pub fn unpark_by(self, sin: f64, cos: f64) -> Self {
        let (cc, ss, cs) = (cos * cos, sin * sin, cos * sin);
        Self {
            xx: cc * self.xx - 2.0 * cs * self.xy + ss * self.yy,
            xy: cs * (self.xx - self.yy) + (cc - ss) * self.xy,
            yy: ss * self.xx + 2.0 * cs * self.xy + cc * self.yy,
        }
    }

    /// Matrix times vector in the stator's plane.
    pub fn times(self, v: AlphaBeta<f64>) -> AlphaBeta<f64> {
        AlphaBeta::new(self.xx * v.alpha + self.xy * v.beta, self.xy * v.alpha + self.yy * v.beta)
    }

    /// Matrix times vector in the rotor's plane.
    pub fn times_dq(self, v: Dq<f64>) -> Dq<f64> {
        Dq::new(self.xx * v.d + self.xy * v.q, self.xy * v.d + self.yy * v.q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_inverse_and_rotation() {
        let m = Symmetric::new(3.0, 0.7, 2.0);
        let v = AlphaBeta::new(0.3, -1.1);
        assert!((m.inverse().times(m.times(v)) - v).norm() < 1e-15);
        // M in the stator's plane is park, M, unpark.
        let (sin, cos) = 0.9_f64.sin_cos();
        let expected = m.times_dq(v.park_by(sin, cos)).unpark_by(sin, cos);
        assert!((m.unpark_by(sin, cos).times(v) - expected).norm() < 1e-15);
    }
}
