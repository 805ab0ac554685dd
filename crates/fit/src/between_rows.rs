//! Distribution of the parameters if edges lie between rows.
//!
//! A row states when it was read, not when the legs changed: an edge was anywhere between two rows. A shift of all edges is
//! equivalent to a delay of the channels, a shift of some of them to a dead time, so both are known no better than the edges'
//! times. The edges' times are bounded, which a normal distribution does not describe: the likelihood is
//! ```text
//!   L(θ, s) ∝ exp(gᵀx − ½ xᵀJx),  x = (θ, s),   −½ ≤ s ≤ ½ in intervals between rows
//! ```
//! with the score g and the information J of the readings alone. The estimates are the mean and the 2.5 and 97.5 % quantiles of
//! this distribution.
//!
//! The edges lie in one of three ways; their evidence (the integral of L over all unknowns) decides between these cases:
//!
//! - each edge independently, anywhere between its rows;
//! - all edges of a record equally, if drive and scope count by the same clock: a whole number of rows apart;
//! - the edges that begin the pulses of a record equally, and those that end them: pulses a whole number of rows apart that do not
//!   last a whole number of rows.
//!
//! The last two make the readings equally likely where a dead time can take up the difference, so the dead time is then known
//! no better than to within an interval. The estimates are those of all cases, weighted by their evidence.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use nalgebra::{Cholesky, DMatrix, DVector};
use standstill_numeric::{erfc, exp, ln, root};

use super::parameters::Point;
use super::solve::Sum;
use super::truncated::{Drawn, draw};
use super::{TWO_SIDED_95, Work};

/// Information about an edge's time, in units of its interval, that is added to that of the readings, so that the time of all
/// edges together, which is equivalent to the channels' delay, has a finite variance: a deviation of a hundred intervals,
/// negligible within the bounds.
const NEXT_TO_NOTHING: f64 = 1e-4;

/// Relative difference up to which intervals between rows count as equal.
const ALIKE: f64 = 0.05;

/// Standard deviations from zero above which the bound of a non-negative parameter is ignored.
const FAR: f64 = 6.0;

/// One of the three cases of edges, with draws from its distribution.
struct Case {
    /// ln ∫ L, up to a constant that all cases share.
    evidence: f64,
    /// Weight of each draw, with the mean of the free parameters given that draw.
    means: Vec<(f64, DVector<f64>)>,
    /// Shifts of the edges in s, draw by draw.
    edges: Vec<DVector<f64>>,
    /// Covariance of the free parameters given a draw.
    covariance: DMatrix<f64>,
    /// Change of each free parameter (row) with one half interval of a fixed parameter (column).
    shifts: DMatrix<f64>,
}

/// Distribution of the free parameters, as differences from the point at which it was computed.
pub struct Between {
    cases: Vec<Case>,
    /// Mean of the free parameters, then of the edges' shifts.
    pub mean: DVector<f64>,
}

/// Score and information of the readings at a point: free parameters first, then edges without a shift.
struct Terms {
    score: DVector<f64>,
    information: DMatrix<f64>,
    /// Information between unknowns (rows) and fixed parameters (columns), each times half the width of its interval.
    fixed: DMatrix<f64>,
}

impl Work<'_> {
    /// Computes the distribution at a point. `sum` has `free` free parameters first, then fixed ones, whose possible deviations
    /// are `off`. None if the information matrix is singular.
    pub(super) fn between(&self, sum: &Sum, point: &Point, free: usize, off: &[f64]) -> Option<Between> {
        let terms = self.terms_between(sum, point, free, off);
        let edges = &self.problem.edges;
        let interval = |k: usize| {
            let (piece, edge) = edges[k];
            self.problem.pieces[piece].edges[edge].deviation * 12.0_f64.sqrt()
        };
        let intervals: Vec<f64> = (0..edges.len()).map(interval).collect();
        let groups = self.ways_to_lie(&intervals);
        let bound: Vec<f64> = (0..free)
            .map(|k| {
                let parameter = self.problem.free[k];
                if parameter.is_never_negative() { -parameter.get(point) } else { f64::NEG_INFINITY }
            })
            .collect();
        let cases: Option<Vec<Case>> =
            groups.iter().map(|groups| terms.case(groups, &intervals, &bound)).collect();
        let mut cases = cases?;
        let most = cases.iter().map(|case| case.evidence).fold(f64::NEG_INFINITY, f64::max);
        if !most.is_finite() {
            return None;
        }
        let total: f64 = cases.iter().map(|case| exp(case.evidence - most)).sum();
        let mut mean = DVector::zeros(free + edges.len());
        for case in &mut cases {
            let share = exp(case.evidence - most) / total;
            for ((weight, means), places) in case.means.iter_mut().zip(&case.edges) {
                *weight *= share;
                for (k, value) in means.iter().chain(places.iter()).enumerate() {
                    mean[k] += *weight * value;
                }
            }
        }
        // As shifts of the point: it has some already.
        for (k, (piece, edge)) in edges.iter().enumerate() {
            mean[free + k] -= point.shifts[*piece][*edge];
        }
        Some(Between { cases, mean })
    }

    /// Returns the cases of edges: the group of each edge, whose edges shift equally. `intervals` has those between the edges'
    /// rows in s; where they differ within a record, edges are alike by chance alone.
    fn ways_to_lie(&self, intervals: &[f64]) -> Vec<Vec<usize>> {
        let edges = &self.problem.edges;
        let record = |k: usize| self.problem.pieces[edges[k].0].record;
        let mut ways = vec![(0..edges.len()).collect()];
        let is_even = |k: usize| {
            let own = || (0..edges.len()).filter(|other| record(*other) == record(k)).map(|k| intervals[k]);
            let (low, high) = own().fold((f64::INFINITY, 0.0), |(l, h): (f64, f64), x| (l.min(x), h.max(x)));
            high <= (1.0 + ALIKE) * low
        };
        if !(0..edges.len()).all(is_even) {
            return ways;
        }
        for by_place in [false, true] {
            let mut keys = Vec::new();
            let mut group = |k: usize| {
                let key = (record(k), if by_place { edges[k].1 } else { 0 });
                keys.iter().position(|known| *known == key).unwrap_or_else(|| {
                    keys.push(key);
                    keys.len() - 1
                })
            };
            let way: Vec<usize> = (0..edges.len()).map(&mut group).collect();
            if !ways.contains(&way) {
                ways.push(way);
            }
        }
        ways
    }

    fn terms_between(&self, sum: &Sum, point: &Point, free: usize, off: &[f64]) -> Terms {
        let all = self.problem.free.len();
        let edges = self.problem.edges.len();
        let place = |k: usize| if k < free { k } else { all - free + k };
        let n = free + edges;
        let mut score = DVector::from_fn(n, |k, _| sum.score[place(k)]);
        let mut information = DMatrix::from_fn(n, n, |x, y| sum.information[(place(x), place(y))]);
        let mut shifted = DVector::zeros(n);
        for (k, (piece, edge)) in self.problem.edges.iter().enumerate() {
            let deviation = self.problem.pieces[*piece].edges[*edge].deviation;
            let (shift, known) = (point.shifts[*piece][*edge], 1.0 / (deviation * deviation));
            // What is known of the edges beforehand is in both.
            score[free + k] += shift * known;
            information[(free + k, free + k)] -= known;
            shifted[free + k] = shift;
        }
        score += &information * shifted;
        let fixed = DMatrix::from_fn(n, off.len(), |x, f| sum.information[(place(x), free + f)] * off[f]);
        Terms {
            score: score / sum.newey_west,
            information: information / sum.newey_west,
            fixed: fixed / sum.newey_west,
        }
    }
}

impl Terms {
    /// Computes a case in which the edges of each group shift equally. `bound` has the least change of each free parameter.
    fn case(&self, groups: &[usize], intervals: &[f64], bound: &[f64]) -> Option<Case> {
        let free = bound.len();
        let count = groups.iter().max().map_or(0, |last| last + 1);
        let n = free + count;
        // Units in which all unknowns are about as large: their deviation, or the interval.
        let mut unite = DMatrix::zeros(self.score.len(), n);
        for k in 0..free {
            unite[(k, k)] = 1.0 / self.information[(k, k)].sqrt();
        }
        for (k, (group, interval)) in groups.iter().zip(intervals).enumerate() {
            unite[(free + k, free + group)] = *interval;
        }
        let turned = unite.transpose();
        let score = &turned * &self.score;
        let mut information = &turned * &self.information * &unite;
        let fixed = &turned * &self.fixed;
        for k in free..n {
            information[(k, k)] += NEXT_TO_NOTHING;
        }
        let covariance = Cholesky::new(information.clone())?.inverse();
        let centre = &covariance * &score;
        let least = |k: usize| bound[k] / unite[(k, k)];
        let is_held = |k: &usize| *k >= free || least(*k) > centre[*k] - FAR * covariance[(*k, *k)].sqrt();
        let (held, loose): (Vec<usize>, Vec<usize>) = (0..n).partition(is_held);
        let part = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |x, y| information[(rows[x], columns[y])])
        };
        let bounds: Vec<[f64; 2]> =
            held.iter().map(|k| if *k >= free { [-0.5, 0.5] } else { [least(*k), f64::INFINITY] }).collect();
        let of_held = DMatrix::from_fn(held.len(), held.len(), |x, y| covariance[(held[x], held[y])]);
        let centre_held = DVector::from_fn(held.len(), |k, _| centre[held[k]]);
        let Drawn { ln_probability, draws } = draw(&centre_held, &of_held, &bounds)?;
        let root = Cholesky::new(information.clone())?;
        let evidence = 0.5 * (score.dot(&centre) + n as f64 * ln(TAU)) + ln_probability
            - root.l_dirty().diagonal().iter().map(|x| ln(*x)).sum::<f64>();
        // The loose ones given the held ones.
        let inverse = Cholesky::new(part(&loose, &loose))?.inverse();
        let gain = &inverse * part(&loose, &held);
        let mut means = Vec::with_capacity(draws.len());
        let mut edges = Vec::with_capacity(draws.len());
        for (weight, held_at) in draws {
            let off = &gain * (&held_at - &centre_held);
            let mut all = centre.clone();
            for (k, place) in held.iter().enumerate() {
                all[*place] = held_at[k];
            }
            for (k, place) in loose.iter().enumerate() {
                all[*place] -= off[k];
            }
            means.push((weight, DVector::from_fn(free, |k, _| all[k] * unite[(k, k)])));
            edges.push(DVector::from_fn(groups.len(), |k, _| all[free + groups[k]] * intervals[k]));
        }
        let mut of_loose = DMatrix::zeros(free, free);
        for (x, a) in loose.iter().enumerate() {
            for (y, b) in loose.iter().enumerate() {
                of_loose[(*a, *b)] = inverse[(x, y)] * unite[(*a, *a)] * unite[(*b, *b)];
            }
        }
        // Edges' places as if they were normal: 1/12 of an interval's square.
        for k in free..n {
            information[(k, k)] += 12.0;
        }
        let moved = Cholesky::new(information)?.solve(&fixed);
        let shifts = DMatrix::from_fn(free, fixed.ncols(), |k, f| -moved[(k, f)] * unite[(k, k)]);
        Some(Case { evidence, means, edges, covariance: of_loose, shifts })
    }
}

/// Gathers weighted values in bins of this width, each with its weight and its mean; values themselves if the width is zero.
fn gathered(mut values: Vec<(f64, f64)>, width: f64) -> Vec<(f64, f64)> {
    values.sort_unstable_by(|(_, a), (_, b)| a.total_cmp(b));
    let bins = values.chunk_by(|(_, a), (_, b)| width > 0.0 && (a / width).floor() == (b / width).floor());
    let of_bin = |bin: &[(f64, f64)]| {
        let weight: f64 = bin.iter().map(|(weight, _)| weight).sum();
        let mean = bin.iter().map(|(weight, value)| weight * value).sum::<f64>() / weight;
        (weight, if weight > 0.0 { mean } else { bin[0].1 })
    };
    bins.map(of_bin).collect()
}

impl Between {
    /// Returns the 95 % interval of a linear combination of free parameters, relative to its mean. `of_fixed` has the change of
    /// the combination with one half interval of each fixed parameter; empty if it depends on free parameters alone.
    pub fn interval(&self, terms: &[(usize, f64)], of_fixed: &[f64]) -> [f64; 2] {
        // A normal distribution about each draw.
        let mut parts: Vec<(f64, f64, f64)> = Vec::new();
        for case in &self.cases {
            let along =
                |column: nalgebra::DVectorView<f64>| terms.iter().map(|(k, a)| a * column[*k]).sum::<f64>();
            let mut square = 0.0;
            for (x, a) in terms {
                for (y, b) in terms {
                    square += a * b * case.covariance[(*x, *y)];
                }
            }
            for (f, column) in case.shifts.column_iter().enumerate() {
                let shift = (along(column) + of_fixed.get(f).unwrap_or(&0.0)) / TWO_SIDED_95;
                square += shift * shift;
            }
            let deviation = square.max(0.0).sqrt();
            let drawn = case.means.iter().map(|(weight, means)| (*weight, along(means.column(0))));
            let gathered = gathered(drawn.collect(), deviation / 32.0);
            parts.extend(gathered.into_iter().map(|(weight, middle)| (weight, middle, deviation)));
        }
        let mean: f64 = terms.iter().map(|(k, a)| a * self.mean[*k]).sum();
        let reach = |sign: f64| {
            let ends = parts.iter().map(|(_, middle, deviation)| sign * (middle - mean) + 9.0 * deviation);
            sign * ends.fold(0.0, f64::max)
        };
        let (lowest, highest) = (reach(-1.0), reach(1.0));
        let below = |x: f64| -> f64 {
            let part = |(weight, middle, deviation): &(f64, f64, f64)| {
                let off = x + mean - middle;
                let share = if *deviation > 0.0 {
                    0.5 * erfc(-off / deviation * FRAC_1_SQRT_2)
                } else {
                    f64::from(u8::from(off >= 0.0))
                };
                weight * share
            };
            parts.iter().map(part).sum()
        };
        [0.025, 0.975].map(|share| root(lowest, highest, |x| Some(below(x) - share)).unwrap_or(f64::NAN))
    }
}
