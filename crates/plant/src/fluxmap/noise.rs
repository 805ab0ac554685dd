//! How much of a map is noise, and how many splines it bears.
//!
//! As many splines as points follow every point, and with it its noise: an inductance is a slope, to which the noise of
//! two neighbours contributes, over the small current between them. A thousandth of the flux then moves L_d by several
//! per cent. Fewer splines than points share the points' noise between them.

use nalgebra::DMatrix;

use super::grid::Grid;
use super::project::{Axis, Modes};

/// Least splines along an axis: one polynomial of degree 5.
const LEAST: usize = 6;

/// And most: no more than the surface that is simulated can follow.
const MOST: usize = 72;

/// Price of a spline in variances of the noise. Mallows' is 2; twice that, and chance seldom buys any.
const PRICE: f64 = 4.0;

/// Noise below this share of the largest flux is the rounding of its numbers; then every point is followed.
const NO_NOISE: f64 = 1e-6;

/// rms noise in Wb of a flux at a point: what third differences along both axes leave of the fluxes, where a surface that
/// is smooth between neighbours leaves next to nothing, whether or not it comes from an energy.
pub(super) fn of(grid: &Grid) -> f64 {
    let (d, q) = (third_differences(&grid.d), third_differences(&grid.q).transpose());
    let left = [&grid.psi_d, &grid.psi_q].map(|psi| (&d * psi * &q).norm_squared());
    ((left[0] + left[1]) / (2 * d.nrows() * q.ncols()) as f64).sqrt()
}

/// Differences of third order along an axis, in rows of length one so that noise keeps its size.
fn third_differences(sites: &[f64]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(sites.len().saturating_sub(3), sites.len());
    for (k, four) in sites.windows(4).enumerate() {
        // A divided difference: 1 / ∏ (x_i − x_j), here without unit.
        let weights = [0, 1, 2, 3].map(|i: usize| -> f64 {
            (0..4).filter(|j| *j != i).map(|j| (four[3] - four[0]) / (four[i] - four[j])).product()
        });
        let length = weights.iter().map(|w| w * w).sum::<f64>().sqrt();
        for (i, w) in weights.iter().enumerate() {
            matrix[(k, k + i)] = w / length;
        }
    }
    matrix
}

/// The splines along i_d and i_q that a map with this noise in Wb bears, and the next finer ones, if it is not exact. They
/// are those with the least expected distance from the fluxes without noise, by Mallows' C_p. A curl does not count, it
/// is as far from all.
pub(super) fn axes(grid: &Grid, noise: f64) -> ([Axis; 2], Option<[Axis; 2]>) {
    if noise < NO_NOISE * grid.largest_flux() {
        return ([&grid.d, &grid.q].map(|sites| Axis::new(sites, sites.len())), None);
    }
    let [along_d, along_q] = [&grid.d, &grid.q].map(|sites| {
        counts(sites.len()).into_iter().map(|count| Axis::new(sites, count)).collect::<Vec<_>>()
    });
    let mut best = (f64::INFINITY, [0, 0]);
    for (a, d) in along_d.iter().enumerate() {
        for (b, q) in along_q.iter().enumerate() {
            // The squares of the data are the same for all, and left out.
            let free = (d.count() * q.count()) as f64;
            let cp = PRICE * noise * noise * free - Modes::of(grid, d, q).explained();
            if cp < best.0 {
                best = (cp, [a, b]);
            }
        }
    }
    let [a, b] = best.1;
    let finer = [along_d[a.saturating_sub(1)].clone(), along_q[b.saturating_sub(1)].clone()];
    ([along_d[a].clone(), along_q[b].clone()], Some(finer))
}

/// Numbers of splines to choose from, most first.
fn counts(sites: usize) -> Vec<usize> {
    let mut counts = vec![sites.min(MOST)];
    while let Some(last) = counts.last().copied().filter(|last| *last > LEAST) {
        counts.push((last * 3 / 4).max(LEAST));
    }
    counts
}
