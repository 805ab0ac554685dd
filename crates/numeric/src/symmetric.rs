//! Symmetric 2×2 matrices: symmetric by type, so that reciprocity cannot be broken by a typing error.

use standstill_interface::{AlphaBeta, Arithmetic, Dq};

use crate::hypot;

/// A symmetric 2×2 matrix `[xx, xy; xy, yy]` in any plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Symmetric<T = f64> {
    /// First diagonal element.
    pub xx: T,
    /// Off-diagonal element.
    pub xy: T,
    /// Second diagonal element.
    pub yy: T,
}

// Not derived, for what is derived is no part of code for wide registers.
impl<T: Default> Default for Symmetric<T> {
    #[inline(always)]
    fn default() -> Self {
        Self { xx: T::default(), xy: T::default(), yy: T::default() }
    }
}

impl<T: Arithmetic> Symmetric<T> {
    /// Makes the matrix from its three elements.
    #[inline(always)]
    pub const fn new(xx: T, xy: T, yy: T) -> Self {
        Self { xx, xy, yy }
    }

    /// Returns the determinant.
    #[inline(always)]
    pub fn determinant(self) -> T {
        self.xx * self.yy - self.xy * self.xy
    }

    /// Returns the inverse; the matrix must not be singular.
    #[inline(always)]
    #[must_use]
    pub fn inverse(self) -> Self {
        let det = self.determinant();
        Self::new(self.yy / det, -self.xy / det, self.xx / det)
    }

    /// Transforms an operator in the rotor's plane to the stator's plane.
    #[inline(always)]
    #[must_use]
    pub fn unpark_by(self, sin: T, cos: T) -> Self {
        let (cc, ss, cs) = (cos * cos, sin * sin, cos * sin);
        let twice = (cs + cs) * self.xy;
        Self {
            xx: cc * self.xx - twice + ss * self.yy,
            xy: cs * (self.xx - self.yy) + (cc - ss) * self.xy,
            yy: ss * self.xx + twice + cc * self.yy,
        }
    }

    /// Returns the product of the matrix and a vector in the stator's plane.
    #[inline(always)]
    pub fn times(self, v: AlphaBeta<T>) -> AlphaBeta<T> {
        AlphaBeta::new(self.xx * v.alpha + self.xy * v.beta, self.xy * v.alpha + self.yy * v.beta)
    }

    /// Returns the product of the matrix and a vector in the rotor's plane.
    #[inline(always)]
    pub fn times_dq(self, v: Dq<T>) -> Dq<T> {
        Dq::new(self.xx * v.d + self.xy * v.q, self.xy * v.d + self.yy * v.q)
    }
}

impl Symmetric {
    /// Returns whether both eigenvalues are positive.
    pub fn is_positive_definite(self) -> bool {
        self.xx > 0.0 && self.determinant() > 0.0
    }

    /// Returns the smaller eigenvalue.
    pub fn smaller_eigenvalue(self) -> f64 {
        let (mean, half) = ((self.xx + self.yy) / 2.0, (self.xx - self.yy) / 2.0);
        mean - hypot(half, self.xy)
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
