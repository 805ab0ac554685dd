//! Covariance of the parameters, and changes that fixed parameters may cause.

use nalgebra::DMatrix;

use super::TWO_SIDED_95;
use super::parameters::Parameter;

/// Uncertainty of the free parameters.
pub(super) struct Spread {
    /// Covariance of the free parameters from the noise of the readings.
    pub(super) covariance: DMatrix<f64>,
    /// Change of each free parameter (row) when a fixed one (column) changes by 1.
    pub(super) shifts: DMatrix<f64>,
    /// Possible deviations of the fixed parameters: half the width of their 95 % intervals.
    pub(super) off: Vec<f64>,
    /// Interval between two rows in s.
    pub(super) interval: f64,
}

impl Spread {
    /// Returns half the width of the 95 % interval of a linear combination of parameters; `parameter` is the parameter that the
    /// combination gives.
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

/// Returns the square root of the information of each of these unknowns.
pub(super) fn scale_of(information: &DMatrix<f64>, places: &[usize]) -> Vec<f64> {
    places.iter().map(|k| information[(*k, *k)].sqrt()).collect()
}

/// Returns the information matrix of these unknowns, scaled by these factors.
pub(super) fn scaled(information: &DMatrix<f64>, places: &[usize], scale: &[f64]) -> DMatrix<f64> {
    let n = places.len();
    DMatrix::from_fn(n, n, |x, y| information[(places[x], places[y])] / (scale[x] * scale[y]))
}

/// Returns the covariance of these unknowns with all others fixed: the inverse of their information matrix. None if that matrix
/// is singular.
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
