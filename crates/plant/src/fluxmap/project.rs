//! The nearest map that has an energy.
//!
//! A map is free of curl exactly if its fluxes are the gradient of a co-energy `W'(i)`. W' is a tensor product of
//! splines over the grid of currents, and the fluxes at the grid are to be as close to the data as possible:
//! ```text
//! |D₁ G − Ψ_d|² + |G D₂ᵀ − Ψ_q|² → min
//! ```
//! G are the values of W' at the grid, D₁ and D₂ differentiate splines along either axis. The normal equations
//! `D₁ᵀD₁ G + G D₂ᵀD₂ = D₁ᵀΨ_d + Ψ_q D₂` are diagonal in the eigenvectors of the two symmetric matrices; no large
//! system is ever built.

use nalgebra::{DMatrix, SymmetricEigen};
use standstill_interface::Dq;

use super::grid::Grid;
use super::spline::{Basis, Local};
use crate::Symmetric;

/// A point of the projected map.
pub(super) struct Sample {
    /// In A.
    pub(super) current: Dq<f64>,
    /// In Wb.
    pub(super) flux: Dq<f64>,
    /// In H.
    pub(super) inductance: Symmetric,
}

/// A co-energy in J per 3/2 over the currents.
pub(super) struct CoEnergy {
    d: Basis,
    q: Basis,
    coefficients: DMatrix<f64>,
    /// D₁ and D₂.
    slopes: [DMatrix<f64>; 2],
}

impl CoEnergy {
    pub(super) fn nearest(grid: &Grid) -> Self {
        let (d, q) = (Basis::on(&grid.d), Basis::on(&grid.q));
        // Spline collocation at its own knots is regular (Schoenberg and Whitney).
        let inverse = |basis: &Basis, sites: &[f64]| {
            let matrix = basis.matrix(sites, 0);
            let size = matrix.nrows();
            matrix.try_inverse().unwrap_or_else(|| DMatrix::identity(size, size))
        };
        let (back_d, back_q) = (inverse(&d, &grid.d), inverse(&q, &grid.q));
        let slope_d = d.matrix(&grid.d, 1) * &back_d;
        let slope_q = q.matrix(&grid.q, 1) * &back_q;
        let right = slope_d.transpose() * &grid.psi_d + &grid.psi_q * &slope_q;
        let along_d = SymmetricEigen::new(slope_d.transpose() * &slope_d);
        let along_q = SymmetricEigen::new(slope_q.transpose() * &slope_q);
        let mut modes = along_d.eigenvectors.transpose() * right * &along_q.eigenvectors;
        let largest = along_d.eigenvalues.amax() + along_q.eigenvalues.amax();
        for a in 0..modes.nrows() {
            for b in 0..modes.ncols() {
                let sum = along_d.eigenvalues[a] + along_q.eigenvalues[b];
                // Only the constant has no slope either way, and it does not matter.
                modes[(a, b)] = if sum > 1e-12 * largest { modes[(a, b)] / sum } else { 0.0 };
            }
        }
        let values = &along_d.eigenvectors * modes * along_q.eigenvectors.transpose();
        Self { coefficients: back_d * values * back_q.transpose(), d, q, slopes: [slope_d, slope_q] }
    }

    /// Flux and incremental inductance at one current, with the splines of either axis there.
    fn at(&self, current: Dq<f64>, d: &Local, q: &Local) -> Sample {
        let sum = |order_d: usize, order_q: usize| -> f64 {
            let row = |a: usize| -> f64 {
                let along = q.values[order_q].iter().enumerate();
                along.map(|(b, value)| value * self.coefficients[(d.first + a, q.first + b)]).sum()
            };
            d.values[order_d].iter().enumerate().map(|(a, value)| value * row(a)).sum()
        };
        let inductance = Symmetric::new(sum(2, 0), sum(1, 1), sum(0, 2));
        Sample { current, flux: Dq::new(sum(1, 0), sum(0, 1)), inductance }
    }

    /// The map at all pairs of these currents in A, i_q running faster.
    pub(super) fn samples(&self, d: &[f64], q: &[f64]) -> Vec<Sample> {
        let along_q: Vec<(f64, Local)> = q.iter().map(|i_q| (*i_q, self.q.at(*i_q))).collect();
        let row = |i_d: f64| {
            let along_d = self.d.at(i_d);
            let point = |(i_q, local): &(f64, Local)| self.at(Dq::new(i_d, *i_q), &along_d, local);
            along_q.iter().map(point).collect::<Vec<_>>()
        };
        d.iter().flat_map(|i_d| row(*i_d)).collect()
    }

    /// Of the data, rms over all points in H: of ∂ψ_d/∂i_q − ∂ψ_q/∂i_d, of their mean, and of the axes' own inductances.
    pub(super) fn reciprocity(&self, grid: &Grid) -> [f64; 3] {
        let [along_d, along_q] = &self.slopes;
        let (dq, qd) = (&grid.psi_d * along_q.transpose(), along_d * &grid.psi_q);
        let (dd, qq) = (along_d * &grid.psi_d, &grid.psi_q * along_q.transpose());
        let rms = |squares: f64| (squares / (grid.d.len() * grid.q.len()) as f64).sqrt();
        let own = dd.norm_squared() + qq.norm_squared();
        [rms((&dq - &qd).norm_squared()), rms(((dq + qd) / 2.0).norm_squared()), rms(own)]
    }

    /// rms and largest distance in Wb from the data, and the current in A at which it is largest.
    pub(super) fn distance(&self, grid: &Grid) -> ([f64; 2], [f64; 2]) {
        let (mut sum, mut worst, mut furthest) = (0.0, 0.0, [0.0; 2]);
        for (k, sample) in self.samples(&grid.d, &grid.q).iter().enumerate() {
            let cell = (k / grid.q.len(), k % grid.q.len());
            let away = (sample.flux - Dq::new(grid.psi_d[cell], grid.psi_q[cell])).norm();
            sum += away * away;
            if away > worst {
                (worst, furthest) = (away, [sample.current.d, sample.current.q]);
            }
        }
        let points = (grid.d.len() * grid.q.len()) as f64;
        ([(sum / points).sqrt(), worst], furthest)
    }
}
