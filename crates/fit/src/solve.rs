//! Finds the most likely parameters by Fisher's scoring method, damped after Levenberg and Marquardt.
//!
//! Each step solves `(J + λ diag J) δ = s` with the score s and the information J of all readings ([`Scatter::terms`]), as the
//! Gauss–Newton method does with residuals and their squares, with which it agrees for a fine converter. A library for least
//! squares (`levenberg-marquardt` 0.15) takes residuals, which a reading of a coarse converter does not have, and needs a second
//! version of nalgebra.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::parameters::{Parameter, Point};
use super::pieces::Piece;
use super::plant::{Frame, Sampled};
use super::reading::Scatter;
use super::record::CHANNELS;

/// Data and free parameters of a fit.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Quantities that the fit leaves unchanged.
    pub frame: Frame,
    /// Pieces of all records.
    pub pieces: Vec<Piece>,
    /// True for each channel that has readings.
    pub channels: [bool; CHANNELS],
    /// Parameters that are free.
    pub free: Vec<Parameter>,
    /// Edges whose times are free: index of the piece, and index of the edge in it.
    pub edges: Vec<(usize, usize)>,
}

/// Score and information of all readings; the free parameters come first, then the edges.
pub struct Sum {
    /// Logarithm of the probability of all readings and of the edges' times.
    pub likelihood: f64,
    /// Score s.
    pub score: DVector<f64>,
    /// Information matrix J.
    pub information: DMatrix<f64>,
    /// Residuals of each channel (readings less currents) in A.
    pub residuals: [Vec<f64>; CHANNELS],
    /// Newey–West ratio: the variance of the scores with their autocovariances (Bartlett weights), divided by J; at least 1.
    pub newey_west: f64,
}

/// Number of neighbouring scores whose autocovariance counts.
const NEIGHBOURS: usize = 40;

/// Squared length of the remaining step, in standard deviations of all unknowns together, up to which a step need not increase
/// the likelihood: waveforms are straight between their points and edges are rounded to nanoseconds, which changes ln P by some
/// tenths, and the remaining step with it. Fits of the saturated motor in the tests that end in this way have 0.02 to 1.01 left.
const INTEGRATORS_ERROR: f64 = 2.0;

/// Damping of a step that is hardly damped.
const LEAST_DAMPING: f64 = 1e-9;

/// Index of an unknown, and the derivative of each row's currents with respect to it.
pub type Derivative = (usize, Vec<[f64; CHANNELS]>);

/// Score and information of one piece's readings.
struct Part {
    likelihood: f64,
    score: DVector<f64>,
    information: DMatrix<f64>,
    residuals: [Vec<f64>; CHANNELS],
    /// Scores divided by their standard deviation, in order of time, for each channel.
    scores: [Vec<f64>; CHANNELS],
}

impl Problem {
    /// Returns the number of unknowns.
    fn count(&self) -> usize {
        self.free.len() + self.edges.len()
    }

    /// Computes score and information of all readings at a point; none if the plant's parameters are invalid.
    pub fn sum(&self, point: &Point, scatter: &[Scatter; CHANNELS], slopes: bool) -> Option<Sum> {
        let parts: Option<Vec<Part>> = (0..self.pieces.len())
            .into_par_iter()
            .map(|number| self.part(number, point, scatter, slopes))
            .collect();
        let n = self.count();
        let mut sum = Sum {
            likelihood: 0.0,
            score: DVector::zeros(n),
            information: DMatrix::zeros(n, n),
            residuals: [const { Vec::new() }; CHANNELS],
            newey_west: 1.0,
        };
        let (mut squares, mut alike, mut count) = (0.0, 0.0, 0.0);
        for part in parts? {
            sum.likelihood += part.likelihood;
            sum.score += part.score;
            sum.information += part.information;
            for (all, own) in sum.residuals.iter_mut().zip(part.residuals) {
                all.extend(own);
            }
            for scores in &part.scores {
                count += scores.len() as f64;
                squares += scores.iter().map(|z| z * z).sum::<f64>();
                for lag in 1..=NEIGHBOURS.min(scores.len().saturating_sub(1)) {
                    let weight = 2.0 * (1.0 - lag as f64 / (NEIGHBOURS as f64 + 1.0));
                    alike += weight * scores.iter().zip(&scores[lag..]).map(|(a, b)| a * b).sum::<f64>();
                }
            }
        }
        sum.newey_west = ((squares + alike) / f64::max(count, 1.0)).max(1.0);
        for (k, (piece, edge)) in self.edges.iter().enumerate() {
            let (shift, deviation) =
                (point.shifts[*piece][*edge], self.pieces[*piece].edges[*edge].deviation);
            let (z, place) = (shift / deviation, self.free.len() + k);
            sum.likelihood -= 0.5 * z * z;
            sum.score[place] -= z / deviation;
            sum.information[(place, place)] += 1.0 / (deviation * deviation);
        }
        Some(sum)
    }

    fn part(
        &self,
        number: usize,
        point: &Point,
        scatter: &[Scatter; CHANNELS],
        slopes: bool,
    ) -> Option<Part> {
        let (piece, shifts) = (&self.pieces[number], &point.shifts[number]);
        let begin = piece.rows[0].time - super::plant::MARGIN;
        let sampled = |point: &Point, shifts: &[f64]| {
            let waveform = point.plant.waveform(&self.frame, piece, shifts)?;
            Some(waveform.behind(point.lag, piece.rows.iter().map(|row| row.time - begin - point.delay)))
        };
        let nominal = sampled(point, shifts)?;
        let n = self.count();
        let mut part = Part {
            likelihood: 0.0,
            score: DVector::zeros(n),
            information: DMatrix::zeros(n, n),
            residuals: [const { Vec::new() }; CHANNELS],
            scores: [const { Vec::new() }; CHANNELS],
        };
        // ∂i/∂p of the unknowns that ask for another simulation.
        let mut columns: Vec<Derivative> = Vec::new();
        let mut difference = |place: usize, step: f64, at: &dyn Fn(f64) -> Option<Vec<Sampled>>| {
            // One-sided where the other side is no plant: drops are not negative.
            let (high, low) = (at(step), at(-step));
            let (high, low, step) = match (high, low) {
                (Some(high), Some(low)) => (high, low, 2.0 * step),
                (Some(high), None) => (high, nominal.clone(), step),
                (None, Some(low)) => (nominal.clone(), low, step),
                (None, None) => return None,
            };
            let slope = high.iter().zip(&low).map(|(h, l)| std::array::from_fn(|k| (h.0[k] - l.0[k]) / step));
            columns.push((place, slope.collect()));
            Some(())
        };
        if slopes {
            let turns_on = self.turning_on(number);
            let by_edges = |p: &Parameter| *p == Parameter::DeadTime && turns_on.is_some();
            let of_others = self.has_switch_by_others(point);
            let by_others = |p: &Parameter| *p == Parameter::SwitchResistance && of_others;
            let simulated = |p: &Parameter| p.is_of_plant() && !by_edges(p) && !by_others(p);
            for (place, parameter) in self.free.iter().enumerate().filter(|(_, p)| simulated(p)) {
                let step = parameter.step(point, &self.frame, piece.link);
                difference(place, step, &|change| {
                    let mut point = point.clone();
                    parameter.add(&mut point, change, self.channels);
                    sampled(&point, shifts)
                })?;
            }
            for (k, (_, edge)) in self.edges.iter().enumerate().filter(|(_, (piece, _))| *piece == number) {
                let deviation = piece.edges[*edge].deviation;
                difference(self.free.len() + k, (0.2 * deviation).max(2e-9), &|change| {
                    let mut shifts = shifts.clone();
                    shifts[*edge] += change;
                    sampled(point, &shifts)
                })?;
            }
            let delayed = self.of_edges(Parameter::Delay, piece, &columns, |_| true);
            let dead =
                turns_on.and_then(|on| self.of_edges(Parameter::DeadTime, piece, &columns, |edge| on[edge]));
            let switch = of_others.then(|| self.of_switch(&columns)).flatten();
            columns.extend(delayed);
            columns.extend(dead);
            columns.extend(switch);
        }
        self.read(piece, point, scatter, &nominal, &columns, &mut part);
        Some(part)
    }

    /// Adds the terms of a piece's rows.
    fn read(
        &self,
        piece: &Piece,
        point: &Point,
        scatter: &[Scatter; CHANNELS],
        nominal: &[Sampled],
        columns: &[Derivative],
        part: &mut Part,
    ) {
        let last = super::parameters::last(self.channels);
        let mut along: Vec<(usize, f64)> = Vec::new();
        let known = |place: usize| columns.iter().any(|(known, _)| *known == place);
        let others: Vec<(usize, Parameter)> =
            self.free.iter().copied().enumerate().filter(|(place, _)| !known(*place)).collect();
        // The information below its diagonal, row by row: a slice is several times as fast to add to as a matrix.
        let n = self.count();
        let mut information = vec![0.0; n * n];
        for (row, reading) in piece.rows.iter().enumerate() {
            for k in (0..CHANNELS).filter(|k| self.channels[*k] && !reading.current[*k].is_nan()) {
                let gain = 1.0 + point.gain[k];
                let (current, slope) = (nominal[row].0[k], nominal[row].1[k]);
                let mean = gain * current + point.offset[k];
                let terms = scatter[k].terms(reading.current[k], mean);
                part.likelihood += terms.likelihood;
                if !scatter[k].is_clipped(reading.current[k]) {
                    part.residuals[k].push(reading.current[k] - mean);
                }
                if columns.is_empty() {
                    continue;
                }
                part.scores[k]
                    .push(terms.score / terms.information.max(1e-30).sqrt().max(1e-3 / scatter[k].noise));
                along.clear();
                along.extend(columns.iter().map(|(place, column)| (*place, gain * column[row][k])));
                for (place, parameter) in others.iter().copied() {
                    let value = match parameter {
                        Parameter::Delay => -gain * slope,
                        Parameter::Offset(own) if own == k => 1.0,
                        Parameter::Gain(own) if own == k => current,
                        Parameter::Gain(_) if k == last => -current,
                        _ => continue,
                    };
                    along.push((place, value));
                }
                along.sort_unstable_by_key(|(place, _)| *place);
                for (k, (x, a)) in along.iter().enumerate() {
                    part.score[*x] += a * terms.score;
                    let weighted = a * terms.information;
                    let line = &mut information[x * n..(x + 1) * n];
                    for (y, b) in &along[..=k] {
                        line[*y] += weighted * b;
                    }
                }
            }
        }
        part.information = DMatrix::from_fn(n, n, |x, y| information[x.max(y) * n + x.min(y)]);
    }

    /// Returns the damped step from a point. Parameters that the step would make negative end at zero, and the step of the others
    /// is computed with that.
    fn step(&self, point: &Point, sum: &Sum, damping: f64) -> Option<DVector<f64>> {
        let n = sum.score.len();
        let mut damped = sum.information.clone();
        for k in 0..n {
            damped[(k, k)] = damped[(k, k)] * (1.0 + damping) + f64::MIN_POSITIVE;
        }
        let mut step = DVector::zeros(n);
        let mut go: Vec<usize> = (0..n).collect();
        loop {
            for k in &go {
                step[*k] = 0.0;
            }
            let score = &sum.score - &damped * &step;
            let matrix = DMatrix::from_fn(go.len(), go.len(), |x, y| damped[(go[x], go[y])]);
            let solved = matrix.cholesky()?.solve(&DVector::from_fn(go.len(), |x, _| score[go[x]]));
            for (k, change) in go.iter().zip(solved.iter()) {
                step[*k] = *change;
            }
            let before = go.len();
            go.retain(|k| {
                let Some(bounded) = self.free.get(*k).filter(|p| p.is_never_negative()) else { return true };
                let least = -bounded.get(point);
                let stays = step[*k] >= least;
                if !stays {
                    step[*k] = least;
                }
                stays
            });
            if go.len() == before {
                return Some(step);
            }
        }
    }

    /// Returns the squared length of a step in standard deviations, δᵀ J δ; infinite if there is no step.
    fn length(&self, point: &Point, sum: &Sum, damping: f64) -> f64 {
        self.step(point, sum, damping)
            .map_or(f64::INFINITY, |step| (step.transpose() * &sum.information * &step)[(0, 0)])
    }

    /// Returns the point moved by a step.
    pub fn moved(&self, point: &Point, step: &DVector<f64>) -> Point {
        let mut moved = point.clone();
        for (parameter, change) in self.free.iter().zip(step.iter()) {
            parameter.add(&mut moved, *change, self.channels);
        }
        for ((piece, edge), change) in self.edges.iter().zip(step.iter().skip(self.free.len())) {
            moved.shifts[*piece][*edge] += change;
        }
        moved
    }

    /// Returns the point after a step and its likelihood, if it is no less likely than before.
    fn better(
        &self,
        point: &Point,
        before: &Sum,
        step: &DVector<f64>,
        scatter: &[Scatter; CHANNELS],
    ) -> Option<(Point, Sum)> {
        let next = self.moved(point, step);
        let there = self.sum(&next, scatter, false)?;
        (there.likelihood >= before.likelihood).then_some((next, there))
    }

    /// Returns a likelier point by the least damping from `damping` on with which there is one; the next step begins with a tenth of it.
    fn damped(
        &self,
        point: &Point,
        sum: &Sum,
        scatter: &[Scatter; CHANNELS],
        damping: &mut f64,
    ) -> Option<(Point, Sum)> {
        while *damping < 1e8 {
            let found =
                self.step(point, sum, *damping).and_then(|step| self.better(point, sum, &step, scatter));
            if found.is_some() {
                *damping = (*damping * 0.1).max(LEAST_DAMPING);
                return found;
            }
            *damping *= 10.0;
        }
        None
    }

    /// Returns a likelier point on the way of the step without damping. In a direction of which the readings tell little, damping leaves
    /// nearly nothing of a step: with an eigenvalue of J of 1e-4 of its diagonal, λ = 1e-3 leaves a tenth, whose gain is below the
    /// integrator's error. A resistance beside the slope of a diode is such a direction behind one shunt.
    fn undamped(
        &self,
        point: &Point,
        sum: &Sum,
        scatter: &[Scatter; CHANNELS],
        damping: &mut f64,
    ) -> Option<(Point, Sum)> {
        let step = self.step(point, sum, LEAST_DAMPING)?;
        let found =
            [1.0, 0.5, 0.25].iter().find_map(|share| self.better(point, sum, &(&step * *share), scatter))?;
        *damping = LEAST_DAMPING;
        Some(found)
    }

    /// Searches the most likely point, with the noise that is most likely there. The search converges if an undamped step would
    /// change no parameter by more than a hundredth of its standard deviation; otherwise it ends after `most` steps. The result
    /// states which.
    pub fn solve(
        &self,
        mut point: Point,
        scatter: &mut [Scatter; CHANNELS],
        most: usize,
        did: &(dyn Fn() -> bool + Sync),
    ) -> Option<(Point, Sum, bool)> {
        let mut damping = 1e-3;
        let mut here = self.sum(&point, scatter, false)?;
        let mut converged = false;
        for _ in 0..most {
            if did() {
                return None;
            }
            for (scatter, residuals) in scatter.iter_mut().zip(&here.residuals) {
                if !residuals.is_empty() {
                    *scatter = scatter.fitted(residuals);
                }
            }
            let sum = self.sum(&point, scatter, true)?;
            // What is left to go without any damping: a small step that large damping made says nothing.
            let left = self.length(&point, &sum, LEAST_DAMPING);
            if left < 1e-4 {
                converged = true;
                break;
            }
            let damped = self.damped(&point, &sum, scatter, &mut damping);
            let Some(next) = damped.or_else(|| self.undamped(&point, &sum, scatter, &mut damping)) else {
                converged = left < INTEGRATORS_ERROR;
                break;
            };
            (point, here) = next;
        }
        let sum = self.sum(&point, scatter, true)?;
        Some((point, sum, converged))
    }
}
