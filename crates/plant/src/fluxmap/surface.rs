//! The energy W(ψ) of a map, as splines over the fluxes. The simulation evaluates this surface.
//!
//! The splines are quintic B-splines: W is four times continuously differentiable, the current three times, and an
//! evaluation takes 36 coefficients for a map of any size. Cells are narrow where the energy bends. The coefficients
//! minimise the distance of the gradient from the currents of the projected map, at points spread over its whole
//! rectangle. In corners of the flux range that the rectangle does not reach, the surface continues as smoothly as
//! possible. No run enters such a corner, because a current that leaves the rectangle ends the run.

mod bends;
mod cells;
mod piece;

use std::sync::Arc;

use standstill_interface::Dq;
use standstill_numeric::Symmetric;

use self::bends::Bends;
use self::cells::{Cells, WIDTH};
use self::piece::Piece;
use super::banded::Banded;
use super::beyond::{Continuation, PoleKnowledge};
use super::co_energy::{CoEnergy, Sample};
use super::grid::Grid;
use crate::Magnetics;
use crate::magnetics::{NoConvergence, explicit_newton};

/// Cells along the axes to begin with and at most.
pub(super) const CELLS: [usize; 2] = [24, 72];

/// Points along an axis at which the surface is fitted, per cell.
const DENSITY: usize = 4;

/// A core known from a map.
#[derive(Clone, Debug, PartialEq)]
pub struct FluxMap {
    cells: Arc<[Cells; 2]>,
    /// The surface in each cell; cells along q follow each other.
    pieces: Arc<[Piece]>,
    /// The co-energy that the surface was fitted to; it gives the flux of a current without a search.
    co_energy: Arc<CoEnergy>,
    range: [[f64; 2]; 2],
    magnet: bool,
    /// How the map was continued beyond its file; none if it was not.
    continuation: Option<Arc<Continuation>>,
    /// Caveat for results with it.
    note: Option<Arc<str>>,
}

impl FluxMap {
    /// Returns the surface over a map that has a convex energy, and its largest error in A.
    ///
    /// # Errors
    /// The current in A at which the surface is not convex.
    pub(super) fn of(co_energy: CoEnergy, grid: &Grid, magnet: bool) -> Result<(Self, f64), Dq<f64>> {
        let co_energy = Arc::new(co_energy);
        let reach = reach(grid.range());
        let zero = Dq::new(0.0, 0.0);
        let bends = Bends::of(&co_energy, grid);
        let mut cells = CELLS[0].max(grid.d.len().max(grid.q.len())).min(CELLS[1]);
        loop {
            let along = bends.cells(cells);
            let [d, q] = [0, 1].map(|axis| bends.places(axis, &along[axis], DENSITY));
            let mut samples = co_energy.samples(&d, &q);
            let pieces = fit(&along, &samples).ok_or(zero)?;
            let map = Self {
                cells: along.into(),
                pieces: pieces.into(),
                co_energy: Arc::clone(&co_energy),
                range: grid.range(),
                magnet,
                continuation: None,
                note: None,
            };
            // Other points than those of the fit, so that the error is not flattered.
            let probes = co_energy.samples(&middles(&d), &middles(&q));
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

    /// Returns W, its gradient and its Hessian. Beyond the edge of the surface, the inductance is that of the edge.
    #[inline]
    fn evaluate(&self, flux: Dq<f64>) -> (f64, Dq<f64>, Symmetric) {
        let [along_d, along_q] = &*self.cells;
        let inside = Dq::new(along_d.inside(flux.d), along_q.inside(flux.q));
        let (d, q) = (along_d.find(inside.d), along_q.find(inside.q));
        let (energy, current, gamma) = self.pieces[d.cell * along_q.count() + q.cell].at(d, q);
        let beyond = flux - inside;
        if beyond == Dq::new(0.0, 0.0) {
            return (energy, current, gamma);
        }
        let more = gamma.times_dq(beyond);
        (energy + (current + more * 0.5).dot(beyond), current + more, gamma)
    }

    /// Returns the ranges of i_d and i_q in A of the map.
    pub const fn range(&self) -> [[f64; 2]; 2] {
        self.range
    }

    /// Returns whether there is a magnet: a flux without current of at least 2 % of the largest one. Less is a trace
    /// left by the measurement.
    pub const fn has_magnet(&self) -> bool {
        self.magnet
    }

    pub(super) fn continued_by(self, continuation: Option<Arc<Continuation>>) -> Self {
        Self { continuation, ..self }
    }

    pub(super) fn noted(self, note: Option<Arc<str>>) -> Self {
        Self { note, ..self }
    }

    /// Returns the caveat for all results with this map: it is too coarse for its saturation.
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    /// Returns the knowledge of which pole draws more current, up to a current in A along d.
    pub fn pole(&self, current: f64) -> PoleKnowledge {
        self.continuation.as_ref().map_or(PoleKnowledge::Known, |beyond| beyond.pole(self, current))
    }

    /// Returns the largest current in A on its axes.
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

    /// Finds the flux from the co-energy, with errors of microvolt-seconds, and then by a few steps of Newton's method.
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

    /// Returns the width of a cell in Wb: coefficients change over a cell, however large the flux is.
    fn flux_scale(&self) -> f64 {
        let [d, q] = &*self.cells;
        Dq::new(d.width(), q.width()).norm()
    }

    fn margin(&self, current: Dq<f64>) -> f64 {
        let [[d_low, d_high], [q_low, q_high]] = self.range;
        (current.d - d_low).min(d_high - current.d).min(current.q - q_low).min(q_high - current.q)
    }
}

/// A least-squares problem's normal equations.
struct Normal {
    matrix: Banded,
    right: Vec<f64>,
}

impl Normal {
    /// Adds an equation: the sum of the unknowns, each times its factor, is this value. They stand in runs of neighbours, each from
    /// its start on, and the starts ascend.
    fn add<const RUN: usize>(&mut self, starts: &[usize], factors: &[[f64; RUN]], value: f64) {
        for (number, (start, own)) in starts.iter().zip(factors).enumerate() {
            for (place, factor) in own.iter().enumerate() {
                let i = start + place;
                self.right[i] += factor * value;
                for (start, factors) in starts[..number].iter().zip(factors) {
                    self.matrix.add_run(i, *start, *factor, factors);
                }
                self.matrix.add_products(i, *start, *factor, &own[..=place]);
            }
        }
    }
}

/// Returns the surface by least squares of its gradient.
fn fit([along_d, along_q]: &[Cells; 2], samples: &[Sample]) -> Option<Vec<Piece>> {
    let (rows, row) = (along_d.functions(), along_q.functions());
    let count = rows * row;
    let matrix = Banded::new(count, (WIDTH - 1) * row + WIDTH - 1);
    let mut normal = Normal { matrix, right: vec![0.0; count] };
    for sample in samples {
        let (d, q) = (along_d.find(sample.flux.d), along_q.find(sample.flux.q));
        let (weights_d, weights_q) = (along_d.weights(d), along_q.weights(q));
        let starts: [usize; WIDTH] = std::array::from_fn(|m| (d.cell + m) * row + q.cell);
        let products = |d: [f64; WIDTH], q: [f64; WIDTH]| d.map(|d| q.map(|q| d * q));
        normal.add(&starts, &products(weights_d[1], weights_q[0]), sample.current.d);
        normal.add(&starts, &products(weights_d[0], weights_q[1]), sample.current.q);
    }
    // Where there are no samples: as little third difference as can be. And the energy of one point is zero.
    let width = along_d.width().min(along_q.width());
    let weight = 1e-8 * samples.len() as f64 / (count as f64).sqrt() / width;
    for a in 0..rows {
        for b in 0..row {
            if a >= 3 {
                let third = along_d.third_derivative(a - 3).map(|factor| [weight * factor]);
                normal.add(&[0, 1, 2, 3].map(|k| (a + k - 3) * row + b), &third, 0.0);
            }
            if b >= 3 {
                let third = along_q.third_derivative(b - 3).map(|factor| weight * factor);
                normal.add(&[a * row + b - 3], &[third], 0.0);
            }
        }
    }
    normal.add(&[count / 2], &[[1.0 / width]], 0.0);
    let coefficients = normal.matrix.factor()?.solve(normal.right);
    let piece = |cell: [usize; 2]| {
        let block = |m: usize, n: usize| coefficients[(cell[0] + m) * row + cell[1] + n];
        Piece::of(along_d.powers(cell[0]), along_q.powers(cell[1]), block)
    };
    let pieces = (0..along_d.count()).flat_map(|a| (0..along_q.count()).map(move |b| [a, b]));
    Some(pieces.map(piece).collect())
}

fn reach(range: [[f64; 2]; 2]) -> f64 {
    range.as_flattened().iter().fold(0.0, |reach, i| i.abs().max(reach))
}

/// Returns the middles between some places and the next.
fn middles(places: &[f64]) -> Vec<f64> {
    places.windows(2).step_by(DENSITY).map(|pair| (pair[0] + pair[1]) / 2.0).collect()
}
