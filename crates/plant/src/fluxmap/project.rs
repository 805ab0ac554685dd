//! The nearest map that has an energy.
//!
//! A map is free of curl exactly if its fluxes are the gradient of a co-energy `W'(i)`. W' is a tensor product of
//! splines over the currents, and the fluxes at the grid are to be as close to the data as possible:
//! ```text
//! |D₁ C B₂ᵀ − Ψ_d|² + |B₁ C D₂ᵀ − Ψ_q|² → min
//! ```
//! C are the splines' coefficients, B and D their values and slopes at the grid along either axis. The normal equations
//! `D₁ᵀD₁ C B₂ᵀB₂ + B₁ᵀB₁ C D₂ᵀD₂ = D₁ᵀΨ_d B₂ + B₁ᵀΨ_q D₂` are diagonal in modes V of each axis with `Vᵀ BᵀB V = 1`
//! and `Vᵀ DᵀD V = α`; no large system is ever built. A mode's share of the coefficients is that of the right side over
//! `α + β`, and independent noise of 1 Wb in the data makes a variance of `1/(α + β)` of it.
//!
//! How many splines there are is a question of the data's noise, see [`super::noise`].

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use standstill_interface::Dq;
use standstill_numeric::{Symmetric, hypot};

use super::grid::Grid;
use super::noise;
use super::spline::{Basis, Local};

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
    d: Axis,
    q: Axis,
    coefficients: DMatrix<f64>,
    /// By how much the next finer splines differ in L_d and L_q without current, in H.
    bias: [f64; 2],
}

/// Splines along one axis, and their modes.
#[derive(Clone)]
pub(super) struct Axis {
    basis: Basis,
    /// Values and slopes at the grid.
    values: DMatrix<f64>,
    slopes: DMatrix<f64>,
    /// V and α.
    modes: DMatrix<f64>,
    squares: DVector<f64>,
}

impl Axis {
    /// So many splines, at most one per site.
    pub(super) fn new(sites: &[f64], count: usize) -> Self {
        let last = (sites.len() - 1) as f64;
        // In proportion, so that knots are closer together where sites are.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let chosen = (0..count).map(|k| sites[(last * k as f64 / (count as f64 - 1.0)).round() as usize]);
        let basis = Basis::on(&chosen.collect::<Vec<_>>());
        let (values, slopes) = (basis.matrix(sites, 0), basis.matrix(sites, 1));
        // Splines with their sites among the rows are independent (Schoenberg and Whitney): R is regular.
        let back = values.clone().qr().r().try_inverse().unwrap_or_else(|| DMatrix::identity(count, count));
        let slopes_back = &slopes * &back;
        let along = SymmetricEigen::new(slopes_back.transpose() * slopes_back);
        Self { basis, values, slopes, modes: back * along.eigenvectors, squares: along.eigenvalues }
    }

    pub(super) fn count(&self) -> usize {
        self.squares.len()
    }

    /// The values at the grid of the splines closest to data along the axis, and their slopes: both times the data.
    fn smoothing(&self) -> [DMatrix<f64>; 2] {
        let coefficients = &self.modes * self.modes.transpose() * self.values.transpose();
        [&self.values * &coefficients, &self.slopes * coefficients]
    }
}

/// The fit in the modes of two axes.
pub(super) struct Modes {
    /// The right side, and α + β.
    right: DMatrix<f64>,
    sums: DMatrix<f64>,
}

impl Modes {
    pub(super) fn of(grid: &Grid, d: &Axis, q: &Axis) -> Self {
        let right =
            d.slopes.transpose() * &grid.psi_d * &q.values + d.values.transpose() * &grid.psi_q * &q.slopes;
        Self { right: d.modes.transpose() * right * &q.modes, sums: sums(d, q) }
    }

    /// Coefficients in the modes.
    fn coefficients(&self) -> DMatrix<f64> {
        self.right.zip_map(&self.sums, |right, sum| right / sum)
    }

    /// By how much the fit is closer to the data than nothing, as a sum of squares in Wb².
    pub(super) fn explained(&self) -> f64 {
        self.right.zip_fold(&self.sums, 0.0, |explained, right, sum| explained + right * right / sum)
    }
}

/// α + β; infinite for the constant, which has no slope either way and does not matter.
fn sums(d: &Axis, q: &Axis) -> DMatrix<f64> {
    let largest = d.squares.amax() + q.squares.amax();
    DMatrix::from_fn(d.count(), q.count(), |a, b| {
        let sum = d.squares[a] + q.squares[b];
        if sum > 1e-12 * largest { sum } else { f64::INFINITY }
    })
}

impl CoEnergy {
    /// For data with this rms noise in Wb.
    pub(super) fn nearest(grid: &Grid, noise: f64) -> Self {
        let (axes, finer) = noise::axes(grid, noise);
        let fit = Self::fit(grid, axes);
        let own = fit.without_current();
        let finer = finer.map(|axes| Self::fit(grid, axes).without_current());
        let bias = finer.map_or([0.0; 2], |l| [l.xx - own.xx, l.yy - own.yy]);
        Self { bias, ..fit }
    }

    fn fit(grid: &Grid, [d, q]: [Axis; 2]) -> Self {
        let coefficients = &d.modes * Modes::of(grid, &d, &q).coefficients() * q.modes.transpose();
        Self { d, q, coefficients, bias: [0.0; 2] }
    }

    /// Incremental inductances in H.
    fn without_current(&self) -> Symmetric {
        self.at(Dq::new(0.0, 0.0), &self.d.basis.at(0.0), &self.q.basis.at(0.0)).inductance
    }

    /// Splines along i_d and i_q.
    pub(super) fn splines(&self) -> [usize; 2] {
        [self.d.count(), self.q.count()]
    }

    /// Standard deviations in H of L_d and L_q without current, where each flux of the data has independent noise in Wb:
    /// what passes through the fit, and by how much the next finer splines differ, which would follow a sharper bend.
    pub(super) fn uncertainty(&self, noise: f64) -> [f64; 2] {
        let (d, q) = (self.d.basis.at(0.0), self.q.basis.at(0.0));
        let sums = sums(&self.d, &self.q);
        let along = |axis: &Axis, local: &Local, order: usize| {
            axis.modes
                .rows(local.first, local.values[order].len())
                .tr_mul(&DVector::from_column_slice(&local.values[order]))
        };
        [([2, 0], self.bias[0]), ([0, 2], self.bias[1])].map(|([order_d, order_q], bias)| {
            let (d, q) = (along(&self.d, &d, order_d), along(&self.q, &q, order_q));
            let shares = d * q.transpose();
            let variance = shares.zip_fold(&sums, 0.0, |variance, share, sum| variance + share * share / sum);
            hypot(variance.sqrt() * noise, bias)
        })
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
        let along_q: Vec<(f64, Local)> = q.iter().map(|i_q| (*i_q, self.q.basis.at(*i_q))).collect();
        let row = |i_d: f64| {
            let along_d = self.d.basis.at(i_d);
            let point = |(i_q, local): &(f64, Local)| self.at(Dq::new(i_d, *i_q), &along_d, local);
            along_q.iter().map(point).collect::<Vec<_>>()
        };
        d.iter().flat_map(|i_d| row(*i_d)).collect()
    }

    /// Of the data, rms over all points in H: of ∂ψ_d/∂i_q − ∂ψ_q/∂i_d, of their mean, and of the axes' own inductances.
    pub(super) fn reciprocity(&self, grid: &Grid) -> [f64; 3] {
        let ([smooth_d, slope_d], [smooth_q, slope_q]) = (self.d.smoothing(), self.q.smoothing());
        let along_d = |psi: &DMatrix<f64>| &slope_d * psi * smooth_q.transpose();
        let along_q = |psi: &DMatrix<f64>| &smooth_d * psi * slope_q.transpose();
        let (dq, qd) = (along_q(&grid.psi_d), along_d(&grid.psi_q));
        let (dd, qq) = (along_d(&grid.psi_d), along_q(&grid.psi_q));
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
