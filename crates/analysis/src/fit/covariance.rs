//! How well parameters are known: covariances, and what fixed parameters may move.

use nalgebra::DMatrix;

use super::TWO_SIDED_95;
use super::parameters::Parameter;

/// How well parameters are known.
pub(super) struct Spread {
    /// The covariance that follows from the readings' noise.
    pub(super) covariance: DMatrix<f64>,
    /// By how much each free parameter (row) moves when a fixed one (column) changes by 1.
    pub(super) shifts: DMatrix<f64>,
    /// By how much fixed parameters may be off: half the width of their 95 % intervals.
    pub(super) off: Vec<f64>,
    /// Between two rows, in s.
    pub(super) interval: f64,
}

impl Spread {
    /// Half the width of the 95 % interval of a sum of parameters, each with a factor; `parameter` is what it stands for.
    pub(super) fn half(&self, terms: &[(usize, f64)], parameter: Parameter) -> f64 {
        let mut square = 0.0;
        for (x, a) in terms {
            for (y, b) in terms {
                square += a * b * self.covariance[(*x, *y)];
            }
        }
        let mut half = TWO_SIDED_95 * TWO_SIDED_95 * square.max(0.0);
        for (f, off) in self.off.iter().enumerate() {
            let shift = terms.iter().map(|(x, a)| a * self.shifts[(*x, f)]).sum::<f64>() * off;
            half += shift * shift;
        }
        if parameter == Parameter::Delay {
            // All edges may lie alike between their rows, as they do where drive and scope count by the same beat: anywhere.
            half += (0.475 * self.interval) * (0.475 * self.interval);
        }
        half.sqrt()
    }
}

/// The root of each of these unknowns' information.
pub(super) fn scale_of(information: &DMatrix<f64>, places: &[usize]) -> Vec<f64> {
    places.iter().map(|k| information[(*k, *k)].sqrt()).collect()
}

/// Their information in units of these scales.
pub(super) fn scaled(information: &DMatrix<f64>, places: &[usize], scale: &[f64]) -> DMatrix<f64> {
    let n = places.len();
    DMatrix::from_fn(n, n, |x, y| information[(places[x], places[y])] / (scale[x] * scale[y]))
}

/// Covariance of these unknowns while the others stay: the inverse of their information. None where that is singular.
pub(super) fn covariance(
    information: &DMatrix<f64>,
    places: &[usize],
    newey_west: f64,
) -> Option<DMatrix<f64>> {
    let scale = scale_of(information, places);
    let n = places.len();
    if n == 0 {
        return Some(DMatrix::zeros(0, 0));
    }
    if !scale.iter().all(|scale| *scale > 0.0) {
        return None;
    }
    let scaled = scaled(information, places, &scale);
    if scaled.clone().symmetric_eigenvalues().min() < 1e-10 {
        return None;
    }
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(n, n, |x, y| newey_west * inverse[(x, y)] / (scale[x] * scale[y])))
}
