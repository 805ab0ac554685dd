//! The energy within one cell: a polynomial in both fluxes.
//!
//! 36 coefficients that lie side by side are quicker than the 36 of splines from six rows of a table, with the splines to
//! be computed first.

use standstill_interface::Dq;
use standstill_numeric::Symmetric;

use super::cells::{Powers, Spot, WIDTH};

/// Coefficients of each power of the place along q (rows) and along d.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Piece([[f64; WIDTH]; WIDTH]);

impl Piece {
    /// Makes the polynomial of a cell from its spline functions along d and q and the coefficients of their products.
    pub(super) fn of(d: &Powers, q: &Powers, coefficient: impl Fn(usize, usize) -> f64) -> Self {
        let mut along = [[0.0; WIDTH]; WIDTH];
        for (n, along) in along.iter_mut().enumerate() {
            for (power, along) in along.iter_mut().enumerate() {
                *along = (0..WIDTH).map(|m| d[power][m] * coefficient(m, n)).sum();
            }
        }
        Self(std::array::from_fn(|power_q| {
            std::array::from_fn(|power_d| (0..WIDTH).map(|n| q[power_q][n] * along[n][power_d]).sum())
        }))
    }

    /// Returns W in J per 3/2, its gradient in A and its Hessian in 1/H, by Horner's rule: first along q for all powers
    /// of d at once, then along d.
    #[inline]
    pub(super) fn at(&self, d: Spot, q: Spot) -> (f64, Dq<f64>, Symmetric) {
        let [c0, c1, c2, c3, c4, c5] = &self.0;
        let (x, y) = (d.t, q.t);
        // Value, slope and half the second derivative along q.
        let (mut value, mut slope, mut bend) = (*c5, *c5, *c5);
        for k in 0..WIDTH {
            value[k] = value[k] * y + c4[k];
            slope[k] = slope[k] * y + value[k];
            value[k] = value[k] * y + c3[k];
        }
        for row in [c2, c1, c0] {
            for k in 0..WIDTH {
                bend[k] = bend[k] * y + slope[k];
                slope[k] = slope[k] * y + value[k];
                value[k] = value[k] * y + row[k];
            }
        }
        let [v0, v1, v2, v3, v4, v5] = value;
        let (mut w, mut w_d, mut w_dd) = (v5 * x + v4, v5, v5);
        w_d = w_d * x + w;
        w = w * x + v3;
        for v in [v2, v1, v0] {
            w_dd = w_dd * x + w_d;
            w_d = w_d * x + w;
            w = w * x + v;
        }
        let [s0, s1, s2, s3, s4, s5] = slope;
        let (mut w_q, mut w_dq) = (s5 * x + s4, s5);
        for s in [s3, s2, s1, s0] {
            w_dq = w_dq * x + w_q;
            w_q = w_q * x + s;
        }
        let w_qq = bend[..WIDTH - 1].iter().rev().fold(bend[WIDTH - 1], |sum, b| sum * x + b);
        let (hd, hq) = (d.per_width, q.per_width);
        let gamma = Symmetric::new(2.0 * w_dd * hd * hd, w_dq * hd * hq, 2.0 * w_qq * hq * hq);
        (w, Dq::new(w_d * hd, w_q * hq), gamma)
    }
}
