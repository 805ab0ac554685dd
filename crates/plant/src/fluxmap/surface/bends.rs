//! Curvature of the energy of a map, and from it the spacing of the surface's cells and points.

use standstill_numeric::{Symmetric, whole};

use super::cells::Cells;
use crate::fluxmap::co_energy::{CoEnergy, Sample};
use crate::fluxmap::grid::Grid;
use crate::fluxmap::project::spread;

/// Currents along an axis at which a map is looked at, at least.
const LOOKS: usize = 256;

/// Equal parts of the fluxes along an axis.
const PARTS: usize = 1024;

/// Parts on either side over which bends are averaged.
const BLUR: usize = 4;

/// Share of the cells that are spread evenly, whatever the bends.
const EVEN: f64 = 0.3;

/// A change of an inductance over the whole axis, relative, that counts as none.
const STRAIGHT: f64 = 0.1;

/// A map at many currents.
pub(super) struct Bends {
    /// Along d and q, in A.
    currents: [Vec<f64>; 2],
    /// Samples at all pairs of currents; i_q varies fastest.
    samples: Vec<Sample>,
    /// Lowest and highest ψ_d and ψ_q in Wb.
    bounds: [[f64; 2]; 2],
    /// Density of cells in equal parts of the ranges of ψ_d and ψ_q.
    densities: [Vec<f64>; 2],
}

fn flux(sample: &Sample, axis: usize) -> f64 {
    [sample.flux.d, sample.flux.q][axis]
}

fn bounds(samples: &[Sample], axis: usize) -> [f64; 2] {
    let values = samples.iter().map(|sample| flux(sample, axis));
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

/// Returns the relative difference of two inverse inductances.
fn change(one: Symmetric, other: Symmetric) -> f64 {
    let (xx, yy) = (one.xx.max(other.xx), one.yy.max(other.yy));
    (one.xx - other.xx).abs() / xx
        + (one.yy - other.yy).abs() / yy
        + (one.xy - other.xy).abs() / (xx * yy).sqrt()
}

impl Bends {
    pub(super) fn of(co_energy: &CoEnergy, grid: &Grid) -> Self {
        let currents = [&grid.d, &grid.q].map(|axis| finer(axis));
        let samples = co_energy.samples(&currents[0], &currents[1]);
        let bounds = [0, 1].map(|axis| bounds(&samples, axis));
        let mut found = Self { currents, samples, bounds, densities: [Vec::new(), Vec::new()] };
        found.densities = [0, 1].map(|axis| found.density(axis));
        found
    }

    /// Returns the index of the sample after sample k along an axis; none for the last one.
    fn next(&self, axis: usize, k: usize) -> Option<usize> {
        let [n, m] = [self.currents[0].len(), self.currents[1].len()];
        match axis {
            0 => (k / m + 1 < n).then_some(k + m),
            _ => (k % m + 1 < m).then_some(k + 1),
        }
    }

    /// Returns the density of cells along an axis: the fourth root of the curvature. For a spline of degree 5 the best
    /// density is in proportion to a root of the curvature, and the fourth root suits maps.
    fn density(&self, axis: usize) -> Vec<f64> {
        let [low, high] = self.bounds[axis];
        let mut bends = vec![0.0_f64; PARTS];
        for (k, one) in self.samples.iter().enumerate() {
            let Some(next) = self.next(axis, k) else { continue };
            let other = &self.samples[next];
            let shares = [one, other].map(|sample| (flux(sample, axis) - low) / (high - low));
            let rise = (shares[1] - shares[0]).abs().max(1e-6);
            let bend = change(one.inductance.inverse(), other.inductance.inverse()) / rise;
            let part = |share: f64| whole::<usize>(share * PARTS as f64).min(PARTS - 1);
            let (first, last) = (part(shares[0].min(shares[1])), part(shares[0].max(shares[1])));
            for most in &mut bends[first..=last] {
                *most = most.max(bend);
            }
        }
        let roots: Vec<f64> = bends.iter().map(|bend| (bend + STRAIGHT).sqrt().sqrt()).collect();
        let blurred = |k: usize| {
            let around = &roots[k.saturating_sub(BLUR)..(k + BLUR + 1).min(PARTS)];
            around.iter().sum::<f64>() / around.len() as f64
        };
        let blurred: Vec<f64> = (0..PARTS).map(blurred).collect();
        let mean = blurred.iter().sum::<f64>() / PARTS as f64;
        blurred.iter().map(|bend| EVEN + (1.0 - EVEN) * bend / mean).collect()
    }

    /// Returns `count` cells along each axis.
    pub(super) fn cells(&self, count: usize) -> [Cells; 2] {
        [0, 1].map(|axis| Cells::new(self.bounds[axis], &self.densities[axis], count))
    }

    /// Returns the currents in A along an axis, so many per cell wherever they are closest to each other in flux.
    pub(super) fn places(&self, axis: usize, cells: &Cells, per_cell: usize) -> Vec<f64> {
        let currents = &self.currents[axis];
        let (range, count) = (currents[currents.len() - 1] - currents[0], cells.functions());
        // Cells per ampere.
        let mut densities = vec![0.5 * count as f64 / range; currents.len()];
        let m = self.currents[1].len();
        for (k, sample) in self.samples.iter().enumerate() {
            let (at, own) = match axis {
                0 => (k / m, sample.inductance.xx),
                _ => (k % m, sample.inductance.yy),
            };
            densities[at] = densities[at].max(own * cells.find(flux(sample, axis)).per_width);
        }
        let mut sums = vec![0.0];
        for (ends, densities) in currents.windows(2).zip(densities.windows(2)) {
            let more = (ends[1] - ends[0]) * densities[0].max(densities[1]);
            sums.push(sums[sums.len() - 1] + more);
        }
        let all = sums[sums.len() - 1];
        let parts = whole::<usize>(all * per_cell as f64).clamp(per_cell * count, 2 * per_cell * count);
        let place = |k: usize| {
            let sum = all * k as f64 / parts as f64;
            let after = sums.partition_point(|x| *x < sum).clamp(1, sums.len() - 1);
            let share = ((sum - sums[after - 1]) / (sums[after] - sums[after - 1])).min(1.0);
            currents[after - 1] + share * (currents[after] - currents[after - 1])
        };
        (0..=parts).map(place).collect()
    }
}

/// Returns the values of an axis and values between them. Of an axis with very many values, returns fewer, evenly
/// chosen.
fn finer(axis: &[f64]) -> Vec<f64> {
    let parts = (LOOKS / (axis.len() - 1)).max(1);
    spread(axis, (parts * (axis.len() - 1)).min(2 * LOOKS) + 1)
}
