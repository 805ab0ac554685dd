//! The result of a fit: estimates with intervals, biases from fixed parameters, and non-identifiable directions.

use std::f64::consts::PI;

use super::discrepancy::{Discrepancy, discrepancies};
use super::found::{Either, Found};
use super::identifiability::{FixedBias, NonIdentifiable, fixed_biases};
use super::parameters::{Parameter, Point, channel, last};
use super::plant::{Law, Plant};
use super::pole::{Iron, with_iron};
use super::predict::Basis;
use super::reached::traces;
use super::reading::Scatter;
use super::record::{CHANNELS, Record};
use super::solve::{Problem, Sum};
use super::{ABOVE_REST, FitError, MISFIT, Solved, Spread, Start, Swing, Work, pieces};

/// Estimate of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Name of the parameter, which is that of its key in a data sheet if it has one.
    pub name: String,
    /// Unit of the parameter.
    pub unit: &'static str,
    /// Value in this unit.
    pub value: f64,
    /// Ends of the 95 % interval; for a parameter that is not identified, the prior interval, or none without prior knowledge.
    pub interval: Option<[f64; 2]>,
    /// True if the readings identify the parameter. If not, the value is the initial one.
    pub identified: bool,
    /// For the fall of an inductance, the current in A along its axis for which the value holds: the one at which saturation is
    /// stated ([`Fit::current`]), or the largest that the pulses drove there.
    pub at: Option<f64>,
}

/// Identification of the magnetic pole from the readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pole {
    /// Difference of saturation between both poles, in standard deviations.
    pub deviations: f64,
    /// True if the difference identifies the pole.
    pub identified: bool,
    /// True if the pulses drive currents along +d and along −d. With only one of them, iron that saturates equally on both sides
    /// cannot be distinguished from iron that does not saturate.
    pub both_ways: bool,
    /// True if the records state the angle, and with it the pole.
    pub stated: bool,
}

/// Measured and simulated currents of one piece.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Index of the record, in the order in which the records were given.
    pub record: usize,
    /// Times of the rows in s.
    pub time: Vec<f64>,
    /// Readings of the phases, then of the DC link, in A; NaN where a channel has none.
    pub measured: Vec<[f64; CHANNELS]>,
    /// Simulated readings without noise in A, of all channels.
    pub simulated: Vec<[f64; CHANNELS]>,
}

/// Result of a fit: the motor with its uncertainties.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Estimates of all parameters, free and fixed ones.
    pub parameters: Vec<Estimate>,
    /// Parameters of the plant that was found.
    pub plant: Plant,
    /// Falls of L_d along +d and −d and of L_q at `current`; none unless the readings show saturation or it was known.
    pub falls: Option<[f64; 3]>,
    /// Rated current in A of the initial motor, or the largest current that was measured.
    pub current: f64,
    /// Flux linkage of the magnet in Wb: that of the initial motor, or a guess.
    pub magnet_flux: f64,
    /// Mean voltage of the DC link in V.
    pub link: f64,
    /// Swing of the link's voltage in the pulse or train in which it is the largest.
    pub link_swing: Swing,
    /// Largest current in A that was measured.
    pub reach: f64,
    /// Largest currents in A that the pulses drove along +d, along −d and along q in either direction.
    pub reached: [f64; 3],
    /// Identification of the pole.
    pub pole: Pole,
    /// Parameters of the drive whose estimates contradict the initial values.
    pub discrepancies: Vec<Discrepancy>,
    /// Biases that fixed parameters may cause.
    pub fixed_biases: Vec<FixedBias>,
    /// Combinations of parameters that the readings hardly determine, the least determined first.
    pub non_identifiable: Vec<NonIdentifiable>,
    /// Rms of the residuals (readings less simulation) in A.
    pub residual_rms: f64,
    /// Rms of the residuals in A that noise and quantization alone would give.
    pub expected_rms: f64,
    /// Rms in A of noise and quantization before the first pulse, of the same channels; none if too few rows are there.
    pub rest_rms: Option<f64>,
    /// Rms of the simulated currents in A without the channels' offsets, of the same readings.
    pub current_rms: f64,
    /// Factor by which intervals are wider because neighbouring residuals are correlated.
    pub widened: f64,
    /// True if the most likely parameters were reached; if not, the intervals are not valid.
    pub converged: bool,
    /// Step between used rows: 1 if each row is used, 2 for each second, and so on.
    pub every: usize,
    /// Number of used readings that are not clipped.
    pub readings: usize,
    /// Number of readings at the ends of the channels' ranges, which give only a lower bound of the current's magnitude.
    pub clipped: usize,
    /// Ends of each channel's range in A if readings were clipped there; infinite if none were.
    pub clip: [[f64; 2]; CHANNELS],
    /// True for each channel that has readings: the phases, then the DC link.
    pub channels: [bool; CHANNELS],
    /// Currents of all pieces, each a pulse or a train of pulses from rest.
    pub traces: Vec<Trace>,
    /// Start of predictions of other records ([`Fit::predict`]).
    pub basis: Basis,
}

impl Fit {
    /// Returns the estimate of the parameter of this name; none if it was neither estimated nor fixed.
    pub fn estimate(&self, name: &str) -> Option<&Estimate> {
        self.parameters.iter().find(|estimate| estimate.name == name)
    }

    /// Returns the estimate of the parameter of this name; none if it was not identified.
    pub fn identified(&self, name: &str) -> Option<&Estimate> {
        self.estimate(name).filter(|estimate| estimate.identified)
    }

    /// Returns true if the simulation describes the currents: neighbouring residuals do not follow each other, and the residuals are not
    /// far above what the channels scatter at rest. Residuals at a few edges are large without following each other.
    pub fn describes(&self) -> bool {
        self.widened < MISFIT && !self.is_far_above_rest()
    }

    /// Returns true if the residuals are more than [`ABOVE_REST`] times what the channels scatter before the first pulse.
    pub fn is_far_above_rest(&self) -> bool {
        self.rest_rms.is_some_and(|rest| self.residual_rms > ABOVE_REST * rest)
    }
}

/// Information and uncertainty of the parameters at a point.
pub(super) struct Known {
    pub(super) sum: Sum,
    pub(super) spread: Spread,
    /// Parameters that are not free.
    pub(super) fixed: Vec<Parameter>,
}

impl Work<'_> {
    /// Computes how well the free parameters are known, with the possible deviations of the fixed ones.
    pub(super) fn known(
        &mut self,
        point: &Point,
        free: &[Parameter],
        scatter: &[Scatter; CHANNELS],
    ) -> Result<Known, FitError> {
        let missing = |p: &Parameter| !free.contains(p) && !p.get(point).is_nan();
        let all = Parameter::all(self.problem.channels, point);
        let fixed: Vec<Parameter> = all.into_iter().filter(missing).collect();
        self.problem.free = free.iter().chain(&fixed).copied().collect();
        let sum = self.problem.sum(point, scatter, true).ok_or(FitError::NoPlant)?;
        let kept: Vec<usize> = (0..free.len()).collect();
        let others: Vec<usize> = (free.len()..self.problem.free.len()).collect();
        let spread = self.spread(&sum, point, &kept, &others).ok_or(FitError::NoPlant)?;
        Ok(Known { sum, spread, fixed })
    }
}

/// Least share of the current at which saturation is stated that pulses must drive to count as having reached it.
const NEARLY_REACHED: f64 = 0.9;

/// Share of this current below which an axis counts as not driven.
const NOT_DRIVEN: f64 = 0.1;

/// Makes the result from a solution.
pub(super) fn conclude(
    mut work: Work,
    solved: Solved,
    records: &[Record],
    start: &Start,
) -> Result<Fit, FitError> {
    let (mut solved, pole, iron) = with_iron(&mut work, solved, start)?;
    let tau = 2.0 * PI;
    let angle = &mut solved.point.plant.angle;
    *angle -= tau * (*angle / tau).floor();
    let frame = work.problem.frame.clone();
    let one = work.found(&solved)?;
    solved.point = one.point.clone();
    let (is_known, others) = match iron {
        Iron::Seen(others) => (true, others),
        Iron::OfStart => (true, Vec::new()),
        Iron::Unknown => (false, Vec::new()),
    };
    let either = Either { one, others };
    let free = solved.free.clone();
    let Known { sum, spread, fixed } = work.known(&solved.point, &free, &solved.scatter)?;
    let falls = solved.point.plant.falls(&frame);
    let reached = work.reached(&solved.point);
    let channels = work.problem.channels;
    let mut parameters = estimates(&work, &either, reached);
    parameters.push(with_switch(&either));
    let after = parameters.iter().rposition(|p| p.name.starts_with("gain")).map_or(0, |k| k + 1);
    parameters.splice(after..after, last_gains(&either, channels));
    let known_before = |parameter: Parameter| work.plausible(parameter, &solved.point);
    let discrepancies = discrepancies(&parameters, start, known_before);
    let fixed_biases = fixed_biases(&spread, &free, &fixed, &parameters);
    let non_identifiable = work.non_identifiable(&sum, &solved.point);
    let traces = traces(&work.problem, &solved.point).ok_or(FitError::NoPlant)?;
    let residuals: Vec<f64> = sum.residuals.iter().flatten().copied().collect();
    let expected = |scatter: &Scatter| scatter.rms() * scatter.rms();
    let weighted: f64 = sum
        .residuals
        .iter()
        .zip(&solved.scatter)
        .map(|(r, scatter)| r.len() as f64 * expected(scatter))
        .sum();
    let current_rms = rms_of_currents(&traces, &solved.point);
    let basis = Basis {
        problem: Problem { pieces: Vec::new(), free: Vec::new(), edges: Vec::new(), ..work.problem.clone() },
        point: solved.point.clone(),
        scatter: solved.scatter.clone(),
        origin: work.origin,
    };
    Ok(Fit {
        parameters,
        falls: falls.filter(|_| is_known),
        plant: solved.point.plant,
        current: frame.current,
        magnet_flux: frame.magnet_flux,
        link: work.link,
        link_swing: work.swing,
        reach: work.reach,
        reached,
        pole,
        discrepancies,
        fixed_biases,
        non_identifiable,
        residual_rms: rms(&residuals),
        expected_rms: (weighted / residuals.len() as f64).sqrt(),
        rest_rms: rest_rms(records, &solved.scatter),
        current_rms,
        widened: sum.newey_west.sqrt(),
        converged: solved.converged,
        every: 1,
        readings: residuals.len(),
        clipped: work
            .problem
            .pieces
            .iter()
            .flat_map(|piece| &piece.rows)
            .map(|row| {
                (0..CHANNELS)
                    .filter(|k| channels[*k] && solved.scatter[*k].is_clipped(row.current[*k]))
                    .count()
            })
            .sum(),
        clip: solved.scatter.map(|scatter| scatter.clip),
        channels,
        traces,
        basis,
    })
}

/// Least number of readings before the first pulse whose noise counts.
const LEAST_AT_REST: f64 = 12.0;

/// Returns the rms in A of what the channels scatter before the first pulse, by their steps at least; none if too few readings are there.
pub(super) fn rest_rms(records: &[Record], scatter: &[Scatter; CHANNELS]) -> Option<f64> {
    let (mut square, mut count) = (0.0, 0.0);
    for record in records {
        for (rest, scatter) in pieces::resting(record).iter().zip(scatter) {
            if rest.count >= LEAST_AT_REST {
                let step = scatter.step.map_or(0.0, |q| q * q / 12.0);
                square += rest.count * (rest.noise * rest.noise).max(step);
                count += rest.count;
            }
        }
    }
    // Readings that a drive sets to zero show no noise.
    (square > 0.0).then(|| (square / count).sqrt())
}

/// Returns the root of the mean square of values.
pub(super) fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|r| r * r).sum::<f64>() / values.len() as f64).sqrt()
}

/// Returns the rms in A of the simulated currents without the channels' offsets, at all readings.
pub(super) fn rms_of_currents(traces: &[Trace], point: &Point) -> f64 {
    let (mut square, mut count) = (0.0, 0_u32);
    for (read, simulated) in traces.iter().flat_map(|trace| trace.measured.iter().zip(&trace.simulated)) {
        for k in (0..CHANNELS).filter(|k| !read[*k].is_nan()) {
            let current = simulated[k] - point.offset[k];
            (square, count) = (square + current * current, count + 1);
        }
    }
    (square / f64::from(count.max(1))).sqrt()
}

/// Returns the estimates of all parameters, free and fixed ones.
fn estimates(work: &Work, either: &Either, reached: [f64; 3]) -> Vec<Estimate> {
    let frame = &work.problem.frame;
    let Found { point, free, .. } = &either.one;
    let shares = reached.map(|i| i / frame.current);
    let of_series = point.plant.law == Law::Series;
    let is_identified = |fall: usize| {
        let own = free.iter().any(|p| p.fall() == Some(fall));
        own && shares[fall] >= NOT_DRIVEN && (!of_series || is_fall_identified(fall, free))
    };
    let identified: [bool; 3] = std::array::from_fn(is_identified);
    // What was not measured stays as it was stated, at the current that it was stated at.
    let is_short = |k: usize| identified[k] && shares[k] < NEARLY_REACHED;
    let at = std::array::from_fn(|k| if is_short(k) { reached[k] } else { frame.current });
    let shown = point.plant.falls_at(frame, at);
    let mut parameters = Vec::new();
    for parameter in Parameter::all(work.problem.channels, point) {
        let (unit, factor) = parameter.unit();
        let is_free = free.contains(&parameter);
        let value = match parameter.fall() {
            Some(fall) => shown.map_or(0.0, |falls| falls[fall]),
            None => parameter.get(point),
        };
        // A fall of the series depends on two coefficients.
        let measured = is_free || parameter.fall().is_some() && of_series;
        let [mut low, high] = match either.of(parameter, frame, at).filter(|_| measured) {
            Some(interval) => interval.ends,
            None => [-1.0, 1.0].map(|sign| value + sign * work.plausible(parameter, point)),
        };
        if parameter.is_never_negative() {
            low = low.max(0.0);
        }
        let one = if matches!(parameter, Parameter::Gain(_)) { 1.0 } else { 0.0 };
        parameters.push(Estimate {
            name: parameter.name(),
            unit,
            value: (one + value) / factor,
            interval: Some([low, high].map(|end| (one + end) / factor)),
            identified: parameter.fall().map_or(is_free, |fall| identified[fall]),
            at: parameter.fall().map(|fall| at[fall]),
        });
    }
    parameters
}

/// Returns the gain of the last of several channels, which follows from the others, and the gain that all channels have in common, which
/// the readings do not determine.
fn last_gains(either: &Either, channels: [bool; CHANNELS]) -> Vec<Estimate> {
    let value = 1.0 + either.one.point.gain[last(channels)];
    let found = either.last_gain(channels);
    let own = Estimate {
        name: format!("gain_{}", channel(last(channels))),
        unit: "",
        value,
        interval: Some(found.map_or([value - 0.03, value + 0.03], |gain| gain.ends.map(|end| 1.0 + end))),
        identified: found.is_some(),
        at: None,
    };
    let common = Estimate {
        name: "common_gain".to_owned(),
        unit: "",
        value: 1.0,
        interval: None,
        identified: false,
        at: None,
    };
    // That of a single one is the common gain.
    let is_alone = channels.iter().filter(|present| **present).count() == 1;
    if is_alone { vec![common] } else { vec![own, common] }
}

/// Returns the resistance of a phase with the switch in its current path.
fn with_switch(either: &Either) -> Estimate {
    let plant = &either.one.point.plant;
    let found = either.with_switch();
    Estimate {
        name: "resistance_with_switch".to_owned(),
        unit: "ohm",
        value: plant.resistance + plant.devices.switch_resistance,
        interval: found.map(|resistance| resistance.ends),
        identified: found.is_some(),
        at: None,
    }
}

/// Returns true if the readings identify a fall of the series, given the free coefficients: the two falls along d follow from β
/// and γ.
fn is_fall_identified(fall: usize, free: &[Parameter]) -> bool {
    let along_d = [Parameter::SaturationAlong, Parameter::SaturationAgainst];
    fall == 2 || along_d.iter().all(|parameter| free.contains(parameter))
}
