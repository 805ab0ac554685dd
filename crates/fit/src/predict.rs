//! Currents of records that a fit has not seen, predicted by the motor that it found.

use super::parameters::{Point, loose_edges};
use super::reached::traces;
use super::reading::Scatter;
use super::record::{CHANNELS, COLUMNS, Record};
use super::result::{Trace, rms, rms_of_currents};
use super::solve::Problem;
use super::{Fit, FitError, MOST_EDGES, Start, pieces, shunt, wiring};

/// Plant, drive and channels that a fit found, as a simulation of other records needs them ([`Fit::predict`]).
#[derive(Clone, Debug)]
pub struct Basis {
    pub(super) problem: Problem,
    pub(super) point: Point,
    pub(super) scatter: [Scatter; CHANNELS],
    /// Angle in rad of the fit's first record, if its records state angles.
    pub(super) origin: Option<f64>,
}

/// Measured currents of a record beside those that a fit predicts for it.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// File of the record.
    pub file: String,
    /// Rms of what the currents differ by (readings less simulation) in A.
    pub residual_rms: f64,
    /// Rms of the simulated currents in A without the channels' offsets.
    pub current_rms: f64,
    /// Currents of all pieces, each a pulse or a train of pulses from rest.
    pub traces: Vec<Trace>,
}

impl Fit {
    /// Returns the angle in rad that the first record states; none if the records state none.
    pub const fn stated_angle(&self) -> Option<f64> {
        self.basis.origin
    }

    /// Predicts the currents of a record that the fit has not seen: motor, drive and channels are those that it found. Only when the
    /// legs change between two rows, of which no row says anything, is taken from the record itself.
    ///
    /// # Errors
    /// The record has a channel that the fit's records do not have, states no angle although they do, or has currents of other phases.
    pub fn predict(&self, record: &Record, start: &Start) -> Result<Prediction, FitError> {
        let Basis { problem, point, scatter, origin } = &self.basis;
        is_like(record, origin.is_some(), problem.channels)?;
        let records = &*shunt::readable(std::slice::from_ref(record), start);
        let (pieces, _) = pieces::used(records, *origin, start.most_used);
        if let Some(wiring) = wiring::miswired(&pieces, record.channels, &pieces::resting(record)) {
            return Err(FitError::Wiring(wiring));
        }
        let mut problem = Problem { pieces, channels: record.channels, free: Vec::new(), ..problem.clone() };
        let noise = scatter.iter().map(Scatter::rms).filter(|rms| *rms > 0.0).fold(f64::INFINITY, f64::min);
        let [l_d, l_q] = point.plant.inductance;
        problem.edges = loose_edges(&problem.pieces, noise, self.link / l_d.min(l_q));
        if problem.edges.len() > MOST_EDGES {
            return Err(FitError::TooManyEdges(problem.edges.len()));
        }
        let mut point = point.clone();
        point.shifts = problem.pieces.iter().map(|piece| vec![0.0; piece.edges.len()]).collect();
        let (point, sum, _) =
            problem.solve(point, &mut scatter.clone(), MOST_STEPS, &|| false).ok_or(FitError::NoPlant)?;
        let traces = traces(&problem, &point).ok_or(FitError::NoPlant)?;
        let residuals: Vec<f64> = sum.residuals.into_iter().flatten().collect();
        Ok(Prediction {
            file: record.file.clone(),
            residual_rms: rms(&residuals),
            current_rms: rms_of_currents(&traces, &point),
            traces,
        })
    }
}

/// Checks that a record has the columns that a fit of other records can predict.
///
/// # Errors
/// It has a channel that the fit's records do not have, or states an angle where they do not, or the other way round.
pub fn is_like(record: &Record, has_angle: bool, channels: [bool; CHANNELS]) -> Result<(), FitError> {
    match (has_angle, record.angle) {
        (true, None) => return Err(FitError::NoAngle(record.file.clone())),
        (false, Some(_)) => return Err(FitError::NewAngle(record.file.clone())),
        _ => {}
    }
    match (0..CHANNELS).find(|k| record.channels[*k] && !channels[*k]) {
        Some(k) => Err(FitError::NewChannel { file: record.file.clone(), channel: COLUMNS[1 + k] }),
        None => Ok(()),
    }
}

/// Largest number of steps of the search for the places of a record's edges.
const MOST_STEPS: usize = 40;
