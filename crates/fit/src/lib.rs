//! Identifies a motor from scope traces: the parameters of the plant with which recorded pulses are the most likely.
//!
//! ```text
//!   records ─► pieces from rest ─► start: the best of a grid of angles ─► scoring on the simulator's own plant
//!                                                             └─► what the readings tell, and what they do not
//! ```
//! The legs' requests in the records are replayed on plants with other parameters; their currents, through channels with gains,
//! offsets and a delay, are compared with the readings. The information of the readings (`fit/reading.rs`) is also that of the
//! parameters: with the bounds of edges between two rows (`fit/between_rows.rs`) it gives the 95 % intervals. A parameter whose
//! interval is wider than prior knowledge of it is fixed at its initial value and reported as not identified.
//!
//! Currents at standstill do not determine three things: a gain that all channels have in common, which scales R, L_d, L_q and
//! the devices' slopes equally; the magnet's flux; and the pole, unless it is assumed which pole saturates the iron.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod advice;
mod axes;
mod between_rows;
mod covariance;
mod discrepancy;
mod eddies;
mod error;
mod exchanged;
mod far_off;
mod found;
mod identifiability;
mod link;
mod misfit;
mod parameters;
mod pieces;
mod plant;
mod pole;
mod predict;
mod probe;
mod reached;
mod reading;
pub mod record;
mod result;
mod sheet;
mod shunt;
mod slopes;
mod solve;
mod start;
mod stated;
mod steep;
mod truncated;
mod wiring;

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::DMatrix;
use standstill_plant::Motor;

use covariance::{Spread, covariance, scale_of, scaled};
use parameters::{Begin, Parameter, Point, loose_edges};
use reading::Scatter;
use record::{CHANNELS, Record};
use solve::{Problem, Sum};

pub use advice::Pulse;
pub use discrepancy::Discrepancy;
pub use error::FitError;
pub use exchanged::{Exchanged, Mislabelled};
pub use identifiability::{FixedBias, NonIdentifiable};
pub use link::Swing;
pub use misfit::Misfit;
pub use plant::Plant;
pub use predict::{Basis, Prediction, is_like};
pub use result::{Estimate, Fit, Pole, Trace};
pub use standstill_inverter::{DeviceKind, Devices};
pub use wiring::Wiring;

/// Initial values of a fit.
#[derive(Clone, Debug)]
pub struct Start {
    /// A motor similar to the measured one; none: nothing is known of the motor.
    pub motor: Option<Motor>,
    /// Characteristics of switches and diodes.
    pub devices: Devices,
    /// Dead time in s.
    pub dead_time: f64,
    /// Parameters of the drive that were stated, by the names of their estimates; the others are guesses. A guessed
    /// `switch_resistance` may be anything up to twice the value here.
    pub stated: Vec<String>,
    /// Time in s that the amplifier of a shunt in the DC link takes after a change of the legs: its readings until then are left out.
    pub settle: f64,
    /// Approximate largest number of rows that are used, such as [`MOST_USED`]: of more rows, each second, third and so on is used.
    pub most_used: usize,
}

impl Start {
    /// Returns true if the drive's parameter of this name was stated.
    fn is_stated(&self, name: &str) -> bool {
        self.stated.iter().any(|stated| stated == name)
    }
}

/// Largest number of edges (changes of the legs' requests) whose times between rows are estimated as unknowns.
const MOST_EDGES: usize = 150;

/// 97.5 % quantile of the standard normal distribution.
const TWO_SIDED_95: f64 = 1.959_963_984_540_054;

/// Standard deviations by which saturation along +d and along −d must differ to identify the pole: a wrong pole in a thousand.
const POLE_DEVIATIONS: f64 = 3.3;

/// Newey–West widening of the intervals above which the simulation does not describe the readings.
pub const MISFIT: f64 = 2.0;

/// Ratio of the residuals' rms to what the channels scatter at rest above which the simulation does not describe the readings. Fits that
/// describe records of eight motors have 1.0 to 1.1.
pub const ABOVE_REST: f64 = 2.0;

/// Default of [`Start::most_used`].
pub const MOST_USED: usize = 50_000;

/// Largest number of steps of all searches of a fit, each with two simulations of all pulses per parameter. A fit that needs more
/// does not converge, because legs or currents are not those of one motor at standstill; the result then states that it did not
/// converge.
const MOST_STEPS: usize = 250;

/// Largest number of rounds in which the identifiable parameters are chosen anew.
const MOST_ROUNDS: usize = 8;

/// State of a fit.
struct Work<'a> {
    problem: Problem,
    scatter: [Scatter; CHANNELS],
    begin: Begin,
    /// Number of steps of the search that are left.
    steps: usize,
    reach: f64,
    link: f64,
    swing: Swing,
    /// Angle in rad of the first record, if the records state angles.
    origin: Option<f64>,
    /// Function that is called before each step; it returns true to stop the fit.
    did: &'a (dyn Fn() -> bool + Sync),
}

/// A solution with its information, and the parameters that were fixed.
struct Solved {
    point: Point,
    sum: Sum,
    free: Vec<Parameter>,
    scatter: [Scatter; CHANNELS],
    /// True if no point nearby is more likely.
    converged: bool,
}

/// Fits a motor to records. `did` is called before each step and returns true to stop the fit.
pub fn fit(records: &[Record], start: &Start, did: &(dyn Fn() -> bool + Sync)) -> Result<Fit, FitError> {
    let rows: usize = records.iter().map(|record| record.rows.len()).sum();
    if rows > record::MOST_ROWS {
        return Err(FitError::TooManyRows(rows));
    }
    let records = &*shunt::readable(records, start);
    let origin = stated::origin(records)?;
    let (pieces, every) = pieces::used(records, origin, start.most_used);
    let swing = Swing::largest(&pieces);
    let channels = std::array::from_fn(|k| records.iter().any(|record| record.channels[k]));
    shunt::check(records, &pieces, start)?;
    if let Some(wiring) = wiring::miswired(&pieces, channels, &pieces::resting(&records[0])) {
        return Err(FitError::Wiring(wiring));
    }
    // Inductances are the same in pulses at one angle.
    for alike in pieces.chunk_by(|a, b| a.turn == b.turn) {
        if let Some(legs) = exchanged::exchanged(records, alike, &pieces::resting(&records[0])) {
            return Err(FitError::Legs(legs));
        }
    }
    let (frame, point, scatter) =
        start::begin(records, &pieces, channels, start).ok_or(FitError::NoCurrent)?;
    let swing = swing.ok_or(FitError::NoCurrent)?;
    let reach = start::reach(&pieces, &point);
    let link = pieces.iter().map(|piece| piece.link).sum::<f64>() / pieces.len() as f64;
    let slope = link / point.plant.inductance[0].min(point.plant.inductance[1]);
    let problem = Problem { frame, pieces, channels, free: Vec::new(), edges: Vec::new() };
    let begin = Begin {
        plant: point.plant.clone(),
        switch_is_stated: start.is_stated("switch_resistance"),
        winding_is_stated: start.motor.is_some(),
        angle_is_stated: origin.is_some(),
    };
    let work = Work { problem, scatter, begin, steps: MOST_STEPS, reach, link, swing, origin, did };
    let fitted =
        work.fitted(&point, slope, records, start).map_err(|error| error.beside(Some(swing), records))?;
    Ok(Fit { every, ..fitted })
}

impl Work<'_> {
    /// Searches the motor, from a point whose currents rise by at most `slope` in A/s.
    fn fitted(
        mut self,
        point: &Point,
        slope: f64,
        records: &[Record],
        start: &Start,
    ) -> Result<Fit, FitError> {
        // The axis, by straight cores, from several angles.
        self.problem.free = vec![Parameter::DAxisInductance, Parameter::QAxisInductance, Parameter::Angle];
        let observable = Parameter::observable(self.problem.channels, point).into_iter();
        self.problem.free.extend(observable.filter(|p| matches!(p, Parameter::Offset(_))));
        let straight = self.straight(point)?;
        self.is_near(&straight.point, records)?;

        // All that can be identified, and the edges.
        let noise = straight
            .scatter
            .iter()
            .map(|s| s.noise.max(s.step.unwrap_or(0.0) * 0.29))
            .fold(f64::INFINITY, |a, b| if b > 0.0 { a.min(b) } else { a });
        self.problem.edges = loose_edges(&self.problem.pieces, noise, slope);
        if self.problem.edges.len() > MOST_EDGES {
            return Err(FitError::TooManyEdges(self.problem.edges.len()));
        }
        self.scatter.clone_from(&straight.scatter);
        let point = self.bent_as(straight.point, start);
        let solved = self.either_axis(&point, start)?;
        let solved = self.behind_a_probe(solved)?;
        let solved = self.with_eddy_currents(solved, records)?;
        result::conclude(self, solved, records, start)
    }

    fn solve(&mut self, point: &Point, most: usize) -> Result<Solved, FitError> {
        let mut scatter = self.scatter.clone();
        let (did, count) = (self.did, AtomicUsize::new(0));
        let solved = self.problem.solve(point.clone(), &mut scatter, most.min(self.steps), &|| {
            count.fetch_add(1, Ordering::Relaxed);
            did()
        });
        self.steps -= count.into_inner();
        match solved {
            Some((point, sum, converged)) => {
                Ok(Solved { point, sum, free: self.problem.free.clone(), scatter, converged })
            }
            None if (self.did)() => Err(FitError::Stopped),
            None => Err(FitError::NoPlant),
        }
    }

    /// Sets the saturation of the initial values, as far as it is equal on both sides of the magnet; it stays if the readings do
    /// not determine it. The difference between both sides is left to the readings.
    fn bent_as(&self, point: Point, start: &Start) -> Point {
        let current = self.problem.frame.current;
        let falls = start.motor.as_ref().and_then(|motor| start::falls_of(motor, current));
        let Some([_, along_d, along_q]) = falls.and_then(start::series_of) else { return point };
        let mut bent = point.clone();
        bent.plant.saturation = [0.0, along_d, along_q];
        // A series that bends the wrong way has no flux for a current far beyond the one that it was stated at.
        if self.problem.sum(&bent, &self.scatter, false).is_some() { bent } else { point }
    }

    /// Solves for all parameters that the readings identify; the others stay at their values.
    fn solved_for_identifiable(&mut self, point: &Point) -> Result<Solved, FitError> {
        let all = Parameter::observable(self.problem.channels, point);
        self.solved_for(&all, point)
    }

    /// Solves for those of these parameters that the readings identify. A better fit has less residual noise and identifies more
    /// parameters, so the free parameters are chosen anew after each solution; in later rounds their number only falls.
    fn solved_for(&mut self, all: &[Parameter], point: &Point) -> Result<Solved, FitError> {
        let begin = point;
        let mut point = begin.clone();
        let mut solved: Option<Solved> = None;
        for round in 0..MOST_ROUNDS {
            let before = solved.as_ref().map(|solved| solved.free.clone());
            self.problem.free = match &before {
                Some(before) if round > MOST_ROUNDS / 2 => before.clone(),
                _ => all.to_vec(),
            };
            let mut sum = self.problem.sum(&point, &self.scatter, true).ok_or(FitError::NoPlant)?;
            if round == 0 {
                // Residuals follow each other as long as what is free is too little: a core that saturates looks like that.
                sum.newey_west = 1.0;
            }
            self.problem.free = self.identified(&sum, &point);
            if let (Some(solved), true) = (solved.take(), before.as_ref() == Some(&self.problem.free)) {
                return Ok(solved);
            }
            // A parameter that the readings do not identify gets back the value that the search began with.
            for parameter in all.iter().filter(|p| !self.problem.free.contains(p)) {
                let back = parameter.get(begin) - parameter.get(&point);
                parameter.add(&mut point, back, self.problem.channels);
            }
            if self.problem.sum(&point, &self.scatter, false).is_none() {
                // No plant has these beside the values found for the others: the search begins anew.
                point = begin.clone();
            }
            let next = self.solve(&point, 40)?;
            (point, self.scatter) = (next.point.clone(), next.scatter.clone());
            solved = Some(next);
        }
        solved.ok_or(FitError::NoPlant)
    }

    /// Returns the free parameters that are identified. Starting from the last one, parameters whose interval is wider than prior
    /// knowledge of them are taken out one by one.
    fn identified(&self, sum: &Sum, point: &Point) -> Vec<Parameter> {
        let free = &self.problem.free;
        let mut keep: Vec<usize> = (0..free.len()).collect();
        loop {
            let fixed: Vec<usize> = (0..free.len()).filter(|k| !keep.contains(k)).collect();
            let wide = match self.spread(sum, point, &keep, &fixed) {
                Some(spread) => (0..keep.len()).rev().find(|k| {
                    spread.half(&[(*k, 1.0)], free[keep[*k]]) > self.plausible(free[keep[*k]], point)
                }),
                None => self.least_identified(sum, &keep),
            };
            match wide {
                Some(k) => drop(keep.remove(k)),
                None => return keep.into_iter().map(|k| free[k]).collect(),
            }
        }
    }

    /// Returns the last parameter that takes part in a null direction of the information matrix of the free parameters; none if
    /// the matrix is regular.
    fn least_identified(&self, sum: &Sum, keep: &[usize]) -> Option<usize> {
        let places = self.places(sum, keep);
        let scale = scale_of(&sum.information, &places);
        if let Some(k) = (0..keep.len()).rev().find(|k| scale[*k].is_nan() || scale[*k] <= 0.0) {
            return Some(k);
        }
        let eigen = scaled(&sum.information, &places, &scale).symmetric_eigen();
        let direction = eigen.eigenvectors.column(eigen.eigenvalues.imin());
        let most = direction.rows(0, keep.len()).amax();
        (0..keep.len()).rev().find(|k| direction[*k].abs() >= 0.3 * most)
    }

    /// Returns the indices of these free parameters and of all edges among the unknowns.
    fn places(&self, sum: &Sum, keep: &[usize]) -> Vec<usize> {
        keep.iter().copied().chain(self.problem.free.len()..sum.information.nrows()).collect()
    }

    /// Returns [`Parameter::plausible`] for this fit.
    fn plausible(&self, parameter: Parameter, point: &Point) -> f64 {
        parameter.plausible(point, &self.begin, self.reach, self.link)
    }

    /// Returns how well some of the free parameters are known while others are fixed, which may deviate by their plausible range.
    fn spread(&self, sum: &Sum, point: &Point, keep: &[usize], fixed: &[usize]) -> Option<Spread> {
        let places = self.places(sum, keep);
        let covariance = covariance(&sum.information, &places, sum.newey_west)?;
        let n = places.len();
        // −J⁻¹ c: what the others become if a fixed one is off by one.
        let shifts = DMatrix::from_fn(n, fixed.len(), |x, f| {
            let along = |y: usize| covariance[(x, y)] * sum.information[(places[y], fixed[f])];
            -(0..n).map(along).sum::<f64>() / sum.newey_west
        });
        let off = fixed.iter().map(|f| self.plausible(self.problem.free[*f], point)).collect();
        let interval = self.problem.pieces.iter().flat_map(|piece| &piece.edges).map(|edge| edge.deviation);
        let interval = interval.fold(0.0, f64::max) * 12.0_f64.sqrt();
        Some(Spread { covariance, shifts, off, interval })
    }
}
