//! Limits of identifiability: directions in the space of parameters, and the bias that fixed parameters may cause.

use nalgebra::DMatrix;

use super::parameters::{Parameter, Point};
use super::result::Estimate;
use super::solve::Sum;
use super::{Spread, TWO_SIDED_95, Work};

/// The bias of estimates that a fixed parameter causes if it is off by half the width of its prior interval.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedBias {
    /// Name of the fixed parameter, and half the width of its prior interval.
    pub fixed: (String, f64),
    /// Estimates that the bias moves by more than half of their interval's half width, with the amount.
    pub moves: Vec<(String, f64)>,
}

/// A non-identifiable direction: a combination of parameters of which the readings have less information than the prior.
#[derive(Clone, Debug, PartialEq)]
pub struct NonIdentifiable {
    /// Ratio of the readings' information about this direction to that of the prior, from 0 to 1.
    pub information: f64,
    /// Parameters that move together, with the amount of each in its unit if the combination deviates by its prior uncertainty;
    /// the parameter that moves most relative to its prior comes first.
    pub parts: Vec<(String, f64)>,
}

impl Work<'_> {
    /// Returns the non-identifiable directions: eigenvectors of the information in units of the priors, with the edges marginalised.
    pub(super) fn non_identifiable(&self, sum: &Sum, point: &Point) -> Vec<NonIdentifiable> {
        let (n, all) = (self.problem.free.len(), sum.information.nrows());
        let edges = sum.information.view((n, n), (all - n, all - n)).into_owned();
        let cross = sum.information.view((0, n), (n, all - n)).into_owned();
        let mut readings = sum.information.view((0, 0), (n, n)).into_owned();
        if let Some(factor) = edges.cholesky() {
            readings -= &cross * factor.solve(&cross.transpose());
        }
        let known: Vec<f64> = self.problem.free.iter().map(|p| self.plausible(*p, point)).collect();
        let unit = TWO_SIDED_95 * TWO_SIDED_95 * sum.newey_west;
        let scaled = DMatrix::from_fn(n, n, |x, y| readings[(x, y)] * known[x] * known[y] / unit);
        let eigen = scaled.symmetric_eigen();
        let mut found = Vec::new();
        for (direction, information) in eigen.eigenvectors.column_iter().zip(eigen.eigenvalues.iter()) {
            if *information >= 1.0 {
                continue;
            }
            let most = direction.amax();
            let mut parts: Vec<usize> = (0..n).filter(|k| direction[*k].abs() >= 0.3 * most).collect();
            parts.sort_by(|x, y| direction[*y].abs().total_cmp(&direction[*x].abs()));
            let part = |k: usize| {
                let parameter = self.problem.free[k];
                (parameter.name(), direction[k] * known[k] / parameter.unit().1)
            };
            found.push(NonIdentifiable {
                information: information.max(0.0),
                parts: parts.into_iter().map(part).collect(),
            });
        }
        found.sort_by(|a, b| a.information.total_cmp(&b.information));
        found
    }
}

/// Returns the biases that fixed parameters may cause.
pub(super) fn fixed_biases(
    spread: &Spread,
    free: &[Parameter],
    fixed: &[Parameter],
    parameters: &[Estimate],
) -> Vec<FixedBias> {
    let mut biases = Vec::new();
    for (f, (parameter, off)) in fixed.iter().zip(&spread.off).enumerate() {
        let moves = free.iter().enumerate().filter_map(|(k, moved)| {
            let name = moved.name();
            let [low, high] = parameters.iter().find(|estimate| estimate.name == name)?.interval?;
            let shift = spread.shifts[(k, f)] * off / moved.unit().1;
            (moved.fall().is_none() && shift.abs() > 0.25 * (high - low)).then_some((name, shift))
        });
        let moves: Vec<(String, f64)> = moves.collect();
        if !moves.is_empty() {
            biases.push(FixedBias { fixed: (parameter.name(), off / parameter.unit().1), moves });
        }
    }
    biases
}
