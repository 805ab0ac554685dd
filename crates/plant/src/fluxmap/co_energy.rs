//! A co-energy over the currents: a tensor product of splines.

use nalgebra::DMatrix;
use standstill_interface::Dq;
use standstill_numeric::Symmetric;

use super::grid::Grid;
use super::spline::{Basis, Local};

/// A point of a map that has an energy.
pub(super) struct Sample {
    /// Current in A.
    pub(super) current: Dq<f64>,
    /// Flux linkage in Wb.
    pub(super) flux: Dq<f64>,
    /// Incremental inductance in H.
    pub(super) inductance: Symmetric,
}

/// W'(i) in J per 3/2; its gradient is the flux, its Hessian the inductance.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CoEnergy {
    pub(super) d: Basis,
    pub(super) q: Basis,
    /// Coefficients of the functions over i_d (rows) and i_q (columns).
    pub(super) coefficients: DMatrix<f64>,
}

impl CoEnergy {
    /// Returns the flux and incremental inductance at a current in A.
    pub(super) fn at(&self, current: Dq<f64>) -> Sample {
        self.between(current, &self.d.at(current.d), &self.q.at(current.q))
    }

    /// Returns the sample where the splines of both axes are known.
    fn between(&self, current: Dq<f64>, d: &Local, q: &Local) -> Sample {
        let mut sums = [[0.0; 3]; 3];
        for (a, order_d) in (0..).zip(0..d.values[0].len()) {
            let mut along = [0.0; 3];
            for b in 0..q.values[0].len() {
                let c = self.coefficients[(d.first + a, q.first + b)];
                for (sum, values) in along.iter_mut().zip(&q.values) {
                    *sum += c * values[b];
                }
            }
            for (sums, values) in sums.iter_mut().zip(&d.values) {
                for (sum, along) in sums.iter_mut().zip(along) {
                    *sum += values[order_d] * along;
                }
            }
        }
        Sample {
            current,
            flux: Dq::new(sums[1][0], sums[0][1]),
            inductance: Symmetric::new(sums[2][0], sums[1][1], sums[0][2]),
        }
    }

    /// Returns the map at all pairs of these currents in A, i_q running faster.
    pub(super) fn samples(&self, d: &[f64], q: &[f64]) -> Vec<Sample> {
        let along_q: Vec<(f64, Local)> = q.iter().map(|i_q| (*i_q, self.q.at(*i_q))).collect();
        let row = |i_d: &f64| {
            let along_d = self.d.at(*i_d);
            let point = |(i_q, local): &(f64, Local)| self.between(Dq::new(*i_d, *i_q), &along_d, local);
            along_q.iter().map(point).collect::<Vec<_>>()
        };
        d.iter().flat_map(row).collect()
    }

    /// Returns the rms distance in Wb from another map at the points of a grid.
    pub(super) fn apart(&self, other: &Self, grid: &Grid) -> f64 {
        let (one, other) = (self.samples(&grid.d, &grid.q), other.samples(&grid.d, &grid.q));
        let away = |(one, other): (&Sample, &Sample)| {
            let away = one.flux - other.flux;
            away.dot(away)
        };
        (one.iter().zip(&other).map(away).sum::<f64>() / one.len() as f64).sqrt()
    }

    /// Returns the rms and the largest distance in Wb from the data, and the current in A at the largest distance.
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
