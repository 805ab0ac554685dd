//! The energy W(ψ) of a map, as splines over the fluxes: what the simulation evaluates.
//!
//! Uniform quintic B-splines: W is four times continuously differentiable, the current three times, and one
//! evaluation is 36 coefficients wide whatever the size of the map. The coefficients are those whose gradient is
//! closest to the currents of the projected map, at points spread over its whole rectangle; where the rectangle's
//! image leaves a corner of the fluxes empty, the surface goes on as smoothly as it can. Nothing is simulated there:
//! a current that leaves the rectangle ends the run.

use std::sync::Arc;

use standstill_interface::Dq;
use standstill_numeric::Symmetric;

use super::banded::Banded;
use super::beyond::{Continuation, PoleKnowledge};
use super::co_energy::{CoEnergy, Sample};
use super::grid::Grid;
use super::project::spread;
use crate::Magnetics;
use crate::magnetics::{NoConvergence, explicit_newton};

/// Coefficients along an axis that one point depends on.
const WIDTH: usize = 6;

/// Cells along the axes to begin with and at most.
const CELLS: [usize; 2] = [24, 72];

/// Points along an axis at which the surface is fitted, per cell: enough that none is empty where a small current makes
/// much flux.
const DENSITY: usize = 4;

/// A core known from a map.
#[derive(Clone, Debug, PartialEq)]
pub struct FluxMap {
    origin: Dq<f64>,
    step: Dq<f64>,
    cells: [usize; 2],
    coefficients: Arc<[f64]>,
    /// What the surface was fitted to: it tells the flux of a current without a search.
    co_energy: Arc<CoEnergy>,
    range: [[f64; 2]; 2],
    rest: Dq<f64>,
    magnet: bool,
    /// How it goes on beyond its file, if it does.
    continuation: Option<Arc<Continuation>>,
}

/// The six uniform B-splines of degree 5 that differ from zero in a cell, at place `t` (0 to 1) in it, with their first
/// and second derivatives over t.
#[inline]
fn weights(t: f64) -> [[f64; WIDTH]; 3] {
    let (s, t2) = (1.0 - t, t * t);
    let (s2, t3) = (s * s, t2 * t);
    let t4 = t2 * t2;
    [
        [
            s2 * s2 * s / 120.0,
            (26.0 - 50.0 * t + 20.0 * t2 + 20.0 * t3 - 20.0 * t4 + 5.0 * t4 * t) / 120.0,
            (66.0 - 60.0 * t2 + 30.0 * t4 - 10.0 * t4 * t) / 120.0,
            (26.0 + 50.0 * t + 20.0 * t2 - 20.0 * t3 - 20.0 * t4 + 10.0 * t4 * t) / 120.0,
            (1.0 + 5.0 * t + 10.0 * t2 + 10.0 * t3 + 5.0 * t4 - 5.0 * t4 * t) / 120.0,
            t4 * t / 120.0,
        ],
        [
            -s2 * s2 / 24.0,
            (-10.0 + 8.0 * t + 12.0 * t2 - 16.0 * t3 + 5.0 * t4) / 24.0,
            (-24.0 * t + 24.0 * t3 - 10.0 * t4) / 24.0,
            (10.0 + 8.0 * t - 12.0 * t2 - 16.0 * t3 + 10.0 * t4) / 24.0,
            (1.0 + 4.0 * t + 6.0 * t2 + 4.0 * t3 - 5.0 * t4) / 24.0,
            t4 / 24.0,
        ],
        [
            s2 * s / 6.0,
            (2.0 + 6.0 * t - 12.0 * t2 + 5.0 * t3) / 6.0,
            (-6.0 + 18.0 * t2 - 10.0 * t3) / 6.0,
            (2.0 - 6.0 * t - 12.0 * t2 + 10.0 * t3) / 6.0,
            (1.0 + 3.0 * t + 3.0 * t2 - 5.0 * t3) / 6.0,
            t3 / 6.0,
        ],
    ]
}

impl FluxMap {
    /// The surface over a map that has a convex energy, and its largest error in A.
    ///
    /// # Errors
    /// The current in A at which the surface is not convex.
    pub(super) fn of(co_energy: CoEnergy, grid: &Grid, magnet: bool) -> Result<(Self, f64), Dq<f64>> {
        let co_energy = Arc::new(co_energy);
        let reach = reach(grid.range());
        let zero = Dq::new(0.0, 0.0);
        let mut cells = CELLS[0].max(grid.d.len().max(grid.q.len())).min(CELLS[1]);
        loop {
            let [d, q] = [&grid.d, &grid.q].map(|axis| finer(axis, DENSITY * cells));
            let mut samples = co_energy.samples(&d, &q);
            let mut map = Self { magnet, ..Self::around(&samples, &co_energy, grid.range(), [cells; 2]) };
            map.fit(&samples).ok_or(zero)?;
            map.rest = map.flux_at(zero).map_err(|_| zero)?;
            // Other points than those of the fit, so that the error is not flattered.
            let [d, q] = [&grid.d, &grid.q].map(|axis| middles(&finer(axis, cells)));
            let probes = co_energy.samples(&d, &q);
            let error = |sample: &Sample| (map.current(sample.flux) - sample.current).norm();
            let error = probes.iter().chain(&samples).map(error).fold(0.0, f64::max);
            if error < 1e-5 * reach || cells >= CELLS[1] {
                samples.extend(probes);
                let convex = |sample: &&Sample| {
                    !map.current_and_inverse_inductance(sample.flux).1.is_positive_definite()
                };
                return match samples.iter().find(convex) {
                    None => Ok((map, error)),
                    Some(sample) => Err(sample.current),
                };
            }
            cells = (cells * 3 / 2).min(CELLS[1]);
        }
    }

    fn around(
        samples: &[Sample],
        co_energy: &Arc<CoEnergy>,
        range: [[f64; 2]; 2],
        cells: [usize; 2],
    ) -> Self {
        let bounds = |of: fn(&Sample) -> f64| {
            let values = samples.iter().map(of);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
        };
        let (d, q) = (bounds(|s| s.flux.d), bounds(|s| s.flux.q));
        // A cell of room at each side.
        let step = |[low, high]: [f64; 2], cells: usize| (high - low) / (cells as f64 - 2.0);
        let step = Dq::new(step(d, cells[0]), step(q, cells[1]));
        let count = (cells[0] + WIDTH - 1) * (cells[1] + WIDTH - 1);
        Self {
            origin: Dq::new(d[0] - step.d, q[0] - step.q),
            step,
            cells,
            coefficients: vec![0.0; count].into(),
            co_energy: Arc::clone(co_energy),
            range,
            rest: Dq::new((d[0] + d[1]) / 2.0, (q[0] + q[1]) / 2.0),
            magnet: false,
            continuation: None,
        }
    }

    /// Coefficients by least squares of the gradient.
    fn fit(&mut self, samples: &[Sample]) -> Option<()> {
        let row = self.cells[1] + WIDTH - 1;
        let count = self.coefficients.len();
        let mut normal = Banded::new(count, (WIDTH - 1) * row + WIDTH - 1);
        let mut right = vec![0.0; count];
        let mut add = |indices: &[usize], factors: &[f64], value: f64| {
            for (a, i) in indices.iter().enumerate() {
                right[*i] += factors[a] * value;
                for (b, j) in indices.iter().enumerate().filter(|(_, j)| *j <= i) {
                    normal.add(*i, *j, factors[a] * factors[b]);
                }
            }
        };
        for sample in samples {
            let ([a, b], [x, y]) = self.cell(sample.flux);
            let (d, q) = (weights(x), weights(y));
            let mut indices = [0; WIDTH * WIDTH];
            let (mut along_d, mut along_q) = ([0.0; WIDTH * WIDTH], [0.0; WIDTH * WIDTH]);
            for k in 0..WIDTH * WIDTH {
                let (m, n) = (k / WIDTH, k % WIDTH);
                indices[k] = (a + m) * row + b + n;
                along_d[k] = d[1][m] * q[0][n] / self.step.d;
                along_q[k] = d[0][m] * q[1][n] / self.step.q;
            }
            add(&indices, &along_d, sample.current.d);
            add(&indices, &along_q, sample.current.q);
        }
        // Where there are no samples: as little third difference as can be. And the energy of one point is zero.
        let weight = 1e-8 * samples.len() as f64 / (count as f64).sqrt() / self.step.d.min(self.step.q);
        let third = [-weight, 3.0 * weight, -3.0 * weight, weight];
        for a in 0..self.cells[0] + WIDTH - 1 {
            for b in 0..row {
                if a >= 3 {
                    add(&[0, 1, 2, 3].map(|k| (a + k - 3) * row + b), &third, 0.0);
                }
                if b >= 3 {
                    add(&[0, 1, 2, 3].map(|k| a * row + b + k - 3), &third, 0.0);
                }
            }
        }
        add(&[count / 2], &[1.0 / self.step.d], 0.0);
        self.coefficients = normal.factor()?.solve(right).into();
        Some(())
    }

    /// The cell of a flux inside the surface and the place in it.
    #[inline]
    fn cell(&self, flux: Dq<f64>) -> ([usize; 2], [f64; 2]) {
        let one = |x: f64, cells: usize| {
            // Never negative, and below the number of cells.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let cell = (x as usize).min(cells - 1);
            (cell, x - cell as f64)
        };
        let x = ((flux.d - self.origin.d) / self.step.d).clamp(0.0, self.cells[0] as f64);
        let y = ((flux.q - self.origin.q) / self.step.q).clamp(0.0, self.cells[1] as f64);
        let ((a, x), (b, y)) = (one(x, self.cells[0]), one(y, self.cells[1]));
        ([a, b], [x, y])
    }

    /// W, its gradient and its Hessian. Beyond the surface's edge the inductance is that of the edge.
    #[inline]
    fn evaluate(&self, flux: Dq<f64>) -> (f64, Dq<f64>, Symmetric) {
        let ([a, b], [x, y]) = self.cell(flux);
        let (d, q) = (weights(x), weights(y));
        let row = self.cells[1] + WIDTH - 1;
        let mut sums = [[0.0; 3]; 3];
        for (m, weights_d) in (0..WIDTH).map(|m| (m, d.map(|order| order[m]))) {
            let start = (a + m) * row + b;
            let coefficients = &self.coefficients[start..start + WIDTH];
            let dot = |weights: &[f64; WIDTH]| -> f64 {
                weights.iter().zip(coefficients).map(|(weight, coefficient)| weight * coefficient).sum()
            };
            let along = [dot(&q[0]), dot(&q[1]), dot(&q[2])];
            for (sums, weight) in sums.iter_mut().zip(weights_d) {
                for (sum, along) in sums.iter_mut().zip(along) {
                    *sum += weight * along;
                }
            }
        }
        let (hd, hq) = (1.0 / self.step.d, 1.0 / self.step.q);
        let gamma = Symmetric::new(sums[2][0] * hd * hd, sums[1][1] * hd * hq, sums[0][2] * hq * hq);
        let gradient = Dq::new(sums[1][0] * hd, sums[0][1] * hq);
        let inside = Dq::new(
            self.origin.d + (a as f64 + x) * self.step.d,
            self.origin.q + (b as f64 + y) * self.step.q,
        );
        let beyond = flux - inside;
        // Rounding of a flux on the surface is far below this share of a cell.
        if beyond.d.abs() < 1e-9 * self.step.d && beyond.q.abs() < 1e-9 * self.step.q {
            return (sums[0][0], gradient, gamma);
        }
        let more = gamma.times_dq(beyond);
        (sums[0][0] + (gradient + more * 0.5).dot(beyond), gradient + more, gamma)
    }

    /// Range of i_d and of i_q in A that the map is known for.
    pub const fn range(&self) -> [[f64; 2]; 2] {
        self.range
    }

    /// Whether there is a magnet: a flux without current of at least 2 % of the largest one. Less is a trace left by
    /// the measurement.
    pub const fn has_magnet(&self) -> bool {
        self.magnet
    }

    pub(super) fn continued_by(self, continuation: Option<Arc<Continuation>>) -> Self {
        Self { continuation, ..self }
    }

    /// What it tells of which pole draws more current, up to a current in A along d.
    pub fn pole(&self, current: f64) -> PoleKnowledge {
        self.continuation.as_ref().map_or(PoleKnowledge::Known, |beyond| beyond.pole(self, current))
    }

    /// The largest current in A on its axes.
    pub fn reach(&self) -> f64 {
        reach(self.range)
    }
}

impl Magnetics for FluxMap {
    fn energy(&self, flux: Dq<f64>) -> f64 {
        self.evaluate(flux).0
    }

    #[inline]
    fn current_and_inverse_inductance(&self, flux: Dq<f64>) -> (Dq<f64>, Symmetric) {
        let (_, current, gamma) = self.evaluate(flux);
        (current, gamma)
    }

    /// By the co-energy, which gives the flux of a current within microvolt-seconds; a few steps do the rest.
    fn flux_at(&self, current: Dq<f64>) -> Result<Dq<f64>, NoConvergence> {
        explicit_newton(current, self.near(current), self.flux_scale(), |flux| {
            self.current_and_inverse_inductance(flux)
        })
    }

    fn near(&self, current: Dq<f64>) -> Dq<f64> {
        let [[d_low, d_high], [q_low, q_high]] = self.range;
        let inside = Dq::new(current.d.clamp(d_low, d_high), current.q.clamp(q_low, q_high));
        self.co_energy.at(inside).flux
    }

    /// Coefficients differ from cell to cell by what a cell is wide, whatever the flux is.
    fn flux_scale(&self) -> f64 {
        self.step.norm()
    }

    fn margin(&self, current: Dq<f64>) -> f64 {
        let [[d_low, d_high], [q_low, q_high]] = self.range;
        (current.d - d_low).min(d_high - current.d).min(current.q - q_low).min(q_high - current.q)
    }
}

fn reach(range: [[f64; 2]; 2]) -> f64 {
    range.as_flattened().iter().fold(0.0, |reach, i| i.abs().max(reach))
}

/// The values of an axis and some between them, at least so many in all; of a finer axis as many, evenly chosen.
fn finer(axis: &[f64], least: usize) -> Vec<f64> {
    let parts = (least / (axis.len() - 1)).max(1);
    spread(axis, (parts * (axis.len() - 1)).min(2 * least) + 1)
}

fn middles(axis: &[f64]) -> Vec<f64> {
    axis.windows(2).map(|pair| (pair[0] + pair[1]) / 2.0).collect()
}
