//! The nearest map that has an energy.
//!
//! A map is free of curl if and only if its fluxes are the gradient of a co-energy `W'(i)`. W' is a tensor product of
//! splines over the currents, see [`super::spline`]. Its coefficients c make the fluxes at the grid, `A c`, as close to
//! the data y as possible, and as smooth as the noise of the data demands:
//! ```text
//! |A c − y|² + λ cᵀP c → min,   (AᵀA + λ P) c = Aᵀy
//! ```
//! P measures the third derivatives of W', the second ones of the fluxes, over currents scaled to the map's half
//! widths. AᵀA and P are sums of products of one banded matrix per axis, so the system has a band and its size does not
//! depend on how many points the map has.
//!
//! λ minimises the generalised cross-validation (Craven and Wahba 1979, doi 10.1007/BF01404567), which estimates the
//! distance of a point from a fit without this point. `(AᵀA + λ P)⁻¹ σ²` is the covariance of the coefficients (Wahba
//! 1983, doi 10.1111/j.2517-6161.1983.tb01239.x) for a noise σ; σ² is the part of the data that no energy explains.

use nalgebra::DMatrix;
use standstill_interface::Dq;
use standstill_numeric::{exp, whole};

use super::banded::{Banded, Factor};
use super::co_energy::CoEnergy;
use super::grid::Grid;
use super::spline::{Basis, DEGREE};

/// Most sites of the splines along an axis: the surface that is simulated follows no more.
pub(super) const MOST_SITES: usize = 64;

/// And for the choice of λ, which is a question of the data and not of the splines.
const CHOICE_SITES: usize = 32;

/// The range of λ in decades, over the ratio of the traces of AᵀA and P. At its lower end only the mode that no
/// flux shows is smoothed.
const DECADES: [i32; 2] = [-9, 2];

/// Splines along one axis, at the grid.
struct Axis {
    basis: Basis,
    /// Values, slopes and their slopes at the sites.
    values: [DMatrix<f64>; 3],
    /// Half the range in A.
    half: f64,
}

impl Axis {
    fn new(sites: &[f64], most: usize) -> Self {
        let basis = Basis::on(&spread(sites, sites.len().min(most)));
        let values = [0, 1, 2].map(|order| basis.matrix(sites, order));
        Self { basis, values, half: (sites[sites.len() - 1] - sites[0]) / 2.0 }
    }

    fn squares(&self, order: usize) -> DMatrix<f64> {
        self.values[order].tr_mul(&self.values[order])
    }
}

/// Returns `count` currents, spaced in proportion to the sites; the sites themselves if `count` equals their number.
pub(super) fn spread(sites: &[f64], count: usize) -> Vec<f64> {
    if count == sites.len() {
        return sites.to_vec();
    }
    let last = sites.len() - 1;
    let at = |k: usize| {
        let place = (last * k) as f64 / (count as f64 - 1.0);
        // Between zero and the last site.
        let site = whole::<usize>(place).min(last - 1);
        sites[site] + (sites[site + 1] - sites[site]) * (place - site as f64)
    };
    (0..count).map(at).collect()
}

/// Returns the sum of products of matrices along d and q as a banded matrix over pairs of functions, q running
/// faster.
fn product(terms: &[(f64, &DMatrix<f64>, &DMatrix<f64>)]) -> Banded {
    let (n, m) = (terms[0].1.nrows(), terms[0].2.nrows());
    let mut sum = Banded::new(n * m, DEGREE * m + DEGREE);
    for a in 0..n {
        for b in 0..m {
            for e in a.saturating_sub(DEGREE)..=a {
                for f in b.saturating_sub(DEGREE)..=(b + DEGREE).min(m - 1) {
                    if e * m + f <= a * m + b {
                        let value = terms.iter().map(|(share, d, q)| share * d[(a, e)] * q[(b, f)]).sum();
                        sum.add(a * m + b, e * m + f, value);
                    }
                }
            }
        }
    }
    sum
}

/// The fit of a grid, ready for any λ.
pub(super) struct Fit<'a> {
    grid: &'a Grid,
    d: Axis,
    q: Axis,
    /// AᵀA, and with one coefficient tied to zero: a constant makes no flux.
    plain: Banded,
    tied: Banded,
    penalty: Banded,
    /// Aᵀy.
    right: DMatrix<f64>,
}

/// A choice of λ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Smoothing {
    pub(super) lambda: f64,
    /// Effective number of parameters: the trace of the matrix from data to fit.
    pub(super) free: f64,
    /// Noise σ in Wb: the part of the data that no energy explains, even a rough one.
    pub(super) noise: f64,
}

impl<'a> Fit<'a> {
    pub(super) fn new(grid: &'a Grid, most_sites: usize) -> Self {
        let (d, q) = (Axis::new(&grid.d, most_sites), Axis::new(&grid.q, most_sites));
        let [values_d, slopes_d] = [0, 1].map(|order| d.squares(order));
        let [values_q, slopes_q] = [0, 1].map(|order| q.squares(order));
        let plain = product(&[(1.0, &slopes_d, &values_q), (1.0, &values_d, &slopes_q)]);
        let (grams_d, grams_q) =
            ([0, 1, 2, 3].map(|k| d.basis.gram(k)), [0, 1, 2, 3].map(|k| q.basis.gram(k)));
        let weight = |k: usize| power_of(d.half * d.half, k) * power_of(q.half * q.half, 3 - k);
        let penalty = product(&[
            (weight(0), &grams_d[0], &grams_q[3]),
            (3.0 * weight(1), &grams_d[1], &grams_q[2]),
            (3.0 * weight(2), &grams_d[2], &grams_q[1]),
            (weight(3), &grams_d[3], &grams_q[0]),
        ]);
        let count = d.basis.count() * q.basis.count();
        let mut tied = plain.clone();
        tied.add(count / 2, count / 2, plain.trace() / count as f64);
        let right =
            d.values[1].tr_mul(&grid.psi_d) * &q.values[0] + d.values[0].tr_mul(&grid.psi_q) * &q.values[1];
        Self { grid, d, q, plain, tied, penalty, right }
    }

    fn data(&self) -> f64 {
        (2 * self.grid.d.len() * self.grid.q.len()) as f64
    }

    pub(super) fn functions(&self) -> [usize; 2] {
        [self.d.basis.count(), self.q.basis.count()]
    }

    fn factor(&self, lambda: f64) -> Option<Factor> {
        self.tied.plus(&self.penalty, lambda).factor()
    }

    fn coefficients(&self, factor: &Factor) -> DMatrix<f64> {
        let [n, m] = self.functions();
        // By rows, as the band runs.
        let right = self.right.transpose().as_slice().to_vec();
        DMatrix::from_row_slice(n, m, &factor.solve(right))
    }

    /// Returns the sum of squares of the residuals, `|A c − y|²`, in Wb².
    fn residual(&self, c: &DMatrix<f64>) -> f64 {
        let flux =
            |order_d: usize, order_q: usize| &self.d.values[order_d] * c * self.q.values[order_q].transpose();
        (flux(1, 0) - &self.grid.psi_d).norm_squared() + (flux(0, 1) - &self.grid.psi_q).norm_squared()
    }

    /// Returns the λ with the least generalised cross-validation; none if sums of squares overflow or vanish.
    fn smoothing(&self) -> Option<Smoothing> {
        let unit = self.plain.trace() / self.penalty.trace();
        let [low, high] = DECADES;
        let (values_d, slopes_d) = (self.d.squares(0), self.d.squares(1));
        let (values_q, slopes_q) = (self.q.squares(0), self.q.squares(1));
        let times = |c: &DMatrix<f64>| &slopes_d * c * &values_q + &values_d * c * &slopes_q;
        let roughest = self.coefficients(&self.factor(unit * decades(f64::from(low)))?);
        let least = self.residual(&roughest);
        let left = times(&roughest) - &self.right;
        // From the roughest fit on by differences: the sums of the data's squares would drown what is left of them.
        let at = |decade: f64| -> Option<(f64, Smoothing)> {
            let lambda = unit * decades(decade);
            let factor = self.factor(lambda)?;
            let change = self.coefficients(&factor) - &roughest;
            let residual = (least + 2.0 * change.dot(&left) + change.dot(&times(&change))).max(0.0);
            let free = factor.trace_of_inverse_times(&self.plain);
            let rest = (self.data() - free).max(1.0);
            Some((residual / (rest * rest), Smoothing { lambda, free, noise: (residual / rest).sqrt() }))
        };
        let decades = (low..=high).map(|decade| Some((f64::from(decade), at(f64::from(decade))?)));
        let coarse: Vec<(f64, (f64, Smoothing))> = decades.collect::<Option<_>>()?;
        let noise = coarse.first()?.1.1.noise;
        let by_value = |a: &(f64, (f64, Smoothing)), b: &(f64, (f64, Smoothing))| a.1.0.total_cmp(&b.1.0);
        let mut best = *coarse.iter().min_by(|a, b| by_value(a, b))?;
        for step in [0.5, 0.25, 0.125] {
            for decade in [best.0 - step, best.0 + step] {
                if (f64::from(low)..=f64::from(high)).contains(&decade)
                    && let Some(found) = at(decade)
                    && found.0 < best.1.0
                {
                    best = (decade, found);
                }
            }
        }
        Some(Smoothing { noise, ..best.1.1 })
    }

    /// Returns the co-energy for this λ, with the factor that its errors follow from.
    pub(super) fn co_energy(&self, lambda: f64) -> Option<(CoEnergy, Factor)> {
        let factor = self.factor(lambda)?;
        let (d, q) = (self.d.basis.clone(), self.q.basis.clone());
        Some((CoEnergy { d, q, coefficients: self.coefficients(&factor) }, factor))
    }

    /// Returns three rms values in H over all points of the data: of ∂ψ_d/∂i_q − ∂ψ_q/∂i_d, of the mean of these two
    /// slopes, and of the self-inductances of the axes. Slopes are those of cubic splines along each axis.
    pub(super) fn reciprocity(&self) -> [f64; 3] {
        let (d, q) = (slopes(&self.d), slopes(&self.q));
        let along_d = |psi: &DMatrix<f64>| &d[1] * (&d[0] * psi);
        let along_q = |psi: &DMatrix<f64>| (psi * q[0].transpose()) * q[1].transpose();
        let (psi_d, psi_q) = (&self.grid.psi_d, &self.grid.psi_q);
        let (dq, qd) = (along_q(psi_d), along_d(psi_q));
        let own = along_d(psi_d).norm_squared() + along_q(psi_q).norm_squared();
        let rms = |squares: f64| (2.0 * squares / self.data()).sqrt();
        [rms((&dq - &qd).norm_squared()), rms(((dq + qd) / 2.0).norm_squared()), rms(own)]
    }
}

/// Returns ten to this power.
fn decades(power: f64) -> f64 {
    exp(power * std::f64::consts::LN_10)
}

/// Returns a whole power.
fn power_of(x: f64, exponent: usize) -> f64 {
    (0..exponent).map(|_| x).product()
}

/// Splines at more places than there are functions, for their Hessians.
pub(super) struct Scaled {
    /// Values, slopes and their slopes along d (rows are places), over currents in units of half the range.
    pub(super) d: [DMatrix<f64>; 3],
    /// Matrices along q.
    pub(super) q: [DMatrix<f64>; 3],
}

impl Axis {
    fn scaled(&self, sites: &[f64]) -> [DMatrix<f64>; 3] {
        let places = spread(sites, 2 * self.basis.count() + 1);
        [0, 1, 2].map(|order| self.basis.matrix(&places, order) * power_of(self.half, order))
    }
}

impl Fit<'_> {
    pub(super) fn scaled(&self) -> Scaled {
        Scaled { d: self.d.scaled(&self.grid.d), q: self.q.scaled(&self.grid.q) }
    }

    /// Returns the sum of squares of the Hessians as a matrix, see [`super::convex`].
    fn hessian_squares(scaled: &Scaled) -> Banded {
        let [d, q] =
            [&scaled.d, &scaled.q].map(|axis| [0, 1, 2].map(|order: usize| axis[order].tr_mul(&axis[order])));
        product(&[(1.0, &d[2], &q[0]), (2.0, &d[1], &q[1]), (1.0, &d[0], &q[2])])
    }

    /// Returns the weight of the data relative to that of the Hessians.
    pub(super) fn weight_of(&self, scaled: &Scaled) -> f64 {
        self.plain.trace() / Self::hessian_squares(scaled).trace()
    }

    /// Returns the fit's system with the Hessians' squares on top.
    pub(super) fn with_hessians(&self, lambda: f64, scaled: &Scaled, weight: f64) -> Option<Factor> {
        self.tied.plus(&self.penalty, lambda).plus(&Self::hessian_squares(scaled), weight).factor()
    }

    /// Coefficients for the data and more on the right side.
    pub(super) fn solve_with(&self, factor: &Factor, more: &DMatrix<f64>) -> DMatrix<f64> {
        let [n, m] = self.functions();
        let right = (&self.right + more).transpose().as_slice().to_vec();
        DMatrix::from_row_slice(n, m, &factor.solve(right))
    }

    /// Returns a current in A at which the inductances are not positive definite; none if there is none among four
    /// points per spline function.
    pub(super) fn bent_at(&self, co_energy: &CoEnergy) -> Option<Dq<f64>> {
        let places = |axis: &[f64], count: usize| spread(axis, 4 * count + 1);
        let d = places(&self.grid.d, self.d.basis.count());
        let q = places(&self.grid.q, self.q.basis.count());
        let samples = co_energy.samples(&d, &q);
        let bent = samples.iter().find(|sample| !sample.inductance.is_positive_definite());
        bent.map(|sample| sample.current)
    }

    /// Returns the rms noise in Wb of the data about a co-energy; none if there are not many more points than
    /// functions.
    pub(super) fn noise(&self, co_energy: &CoEnergy) -> Option<f64> {
        let [n, m] = self.functions();
        let rest = self.data() - (n * m) as f64;
        let known = self.grid.d.len().max(self.grid.q.len()) > CHOICE_SITES && 2.0 * rest > self.data();
        known.then(|| (self.residual(&co_energy.coefficients) / rest).sqrt())
    }
}

/// Returns the matrices from the fluxes along an axis to their slopes, by splines, and from them to the slopes' slopes.
fn slopes(axis: &Axis) -> [DMatrix<f64>; 2] {
    let mut squares = axis.squares(1);
    let middle = squares.nrows() / 2;
    squares[(middle, middle)] += squares.trace() / squares.nrows() as f64;
    let solved = squares.cholesky().map(|cholesky| cholesky.solve(&axis.values[1].transpose()));
    let back = solved.unwrap_or_else(|| DMatrix::zeros(axis.basis.count(), axis.values[1].nrows()));
    [back, axis.values[2].clone()]
}

/// Returns the noise of a grid's data and the smoothing that suits it.
pub(super) fn smoothing(grid: &Grid) -> Option<Smoothing> {
    Fit::new(grid, CHOICE_SITES).smoothing()
}

/// Returns the standard errors in H of L_dd, L_dq and L_qq at a current in A, for a noise in Wb.
pub(super) fn errors(co_energy: &CoEnergy, factor: &Factor, noise: f64, current: Dq<f64>) -> [f64; 3] {
    let (d, q) = (co_energy.d.at(current.d), co_energy.q.at(current.q));
    let m = co_energy.q.count();
    [(2, 0), (1, 1), (0, 2)].map(|(order_d, order_q)| {
        let mut row = vec![0.0; co_energy.d.count() * m];
        for (a, along_d) in d.values[order_d].iter().enumerate() {
            for (b, along_q) in q.values[order_q].iter().enumerate() {
                row[(d.first + a) * m + q.first + b] = along_d * along_q;
            }
        }
        noise * factor.forwards(row).iter().map(|x| x * x).sum::<f64>().sqrt()
    })
}
