//! What the readings do not tell: combinations of parameters, and what estimates lean on.

use nalgebra::DMatrix;

use super::parameters::{Parameter, Point};
use super::result::Estimate;
use super::solve::Sum;
use super::{Spread, TWO_SIDED_95, Work};

/// What a parameter that was fixed would move, if it is off by half the width of what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Lean {
    /// The fixed parameter, and by how much it may be off.
    pub fixed: (String, f64),
    /// Estimates that it moves by more than half of their interval's half width, and by how much.
    pub moves: Vec<(String, f64)>,
}

/// A combination of parameters of which the readings tell less than is known without measuring.
#[derive(Clone, Debug, PartialEq)]
pub struct Weak {
    /// The readings' information about this combination, divided by the information that is known beforehand: 0 to 1.
    pub told: f64,
    /// Parameters that move together, the one that moves most beside what is known of it first, and by how much, in their
    /// units, if the combination is off by what it may be off by beforehand.
    pub parts: Vec<(String, f64)>,
}

impl Work<'_> {
    /// Combinations of all parameters that the readings tell less of than is known beforehand: eigenvectors of the
    /// information in units of what is known, with edges anywhere they may be.
    pub(super) fn weak(&self, sum: &Sum, point: &Point) -> Vec<Weak> {
        let (n, all) = (self.problem.free.len(), sum.information.nrows());
        let edges = sum.information.view((n, n), (all - n, all - n)).into_owned();
        let cross = sum.information.view((0, n), (n, all - n)).into_owned();
        let mut told = sum.information.view((0, 0), (n, n)).into_owned();
        if let Some(factor) = edges.cholesky() {
            told -= &cross * factor.solve(&cross.transpose());
        }
        let known: Vec<f64> = self.problem.free.iter().map(|p| self.plausible(*p, point)).collect();
        let unit = TWO_SIDED_95 * TWO_SIDED_95 * sum.inflation;
        let scaled = DMatrix::from_fn(n, n, |x, y| told[(x, y)] * known[x] * known[y] / unit);
        let eigen = scaled.symmetric_eigen();
        let mut weak = Vec::new();
        for (direction, told) in eigen.eigenvectors.column_iter().zip(eigen.eigenvalues.iter()) {
            if *told >= 1.0 {
                continue;
            }
            let most = direction.amax();
            let mut parts: Vec<usize> = (0..n).filter(|k| direction[*k].abs() >= 0.3 * most).collect();
            parts.sort_by(|x, y| direction[*y].abs().total_cmp(&direction[*x].abs()));
            let part = |k: usize| {
                let parameter = self.problem.free[k];
                (parameter.name(), direction[k] * known[k] / parameter.unit().1)
            };
            weak.push(Weak { told: told.max(0.0), parts: parts.into_iter().map(part).collect() });
        }
        weak.sort_by(|a, b| a.told.total_cmp(&b.told));
        weak
    }
}

/// What the fixed parameters would move.
pub(super) fn leans(
    spread: &Spread,
    free: &[Parameter],
    fixed: &[Parameter],
    parameters: &[Estimate],
) -> Vec<Lean> {
    let mut leans = Vec::new();
    for (f, (parameter, off)) in fixed.iter().zip(&spread.off).enumerate() {
        let moves = free.iter().enumerate().filter_map(|(k, moved)| {
            let name = moved.name();
            let [low, high] = parameters.iter().find(|estimate| estimate.name == name)?.interval?;
            let shift = spread.shifts[(k, f)] * off / moved.unit().1;
            (moved.fall().is_none() && shift.abs() > 0.25 * (high - low)).then_some((name, shift))
        });
        let moves: Vec<(String, f64)> = moves.collect();
        if !moves.is_empty() {
            leans.push(Lean { fixed: (parameter.name(), off / parameter.unit().1), moves });
        }
    }
    leans
}
