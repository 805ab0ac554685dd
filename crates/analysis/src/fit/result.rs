//! What a fit ends with: estimates with intervals, biases from fixed parameters, and what is not identifiable.

use std::f64::consts::PI;

use super::between_rows::Between;
use super::identifiability::{FixedBias, NonIdentifiable, fixed_biases};
use super::parameters::{Parameter, Point, last, letter};
use super::plant::{Frame, Law, Plant};
use super::pole::{Iron, with_iron};
use super::reached::traces;
use super::reading::Scatter;
use super::solve::Sum;
use super::{FitError, Solved, Spread, Start, Work};

/// One parameter's estimate.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Its name, that of its key in a data sheet if it has one.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// In its unit.
    pub value: f64,
    /// The ends of its 95 % interval; those of what is known beforehand where it is not identified, none where that is
    /// nothing.
    pub interval: Option<[f64; 2]>,
    /// Whether the readings tell it. If not, it stayed at its start value.
    pub identified: bool,
    /// Of a fall of an inductance, the current in A along its axis at which this is it: that at which saturation is stated
    /// ([`Fit::current`]), or the largest that the pulses drove there.
    pub at: Option<f64>,
}

/// Whether the readings tell north from south.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pole {
    /// Deviations by which one pole's iron saturates more.
    pub deviations: f64,
    /// Whether that is enough.
    pub identified: bool,
    /// Whether the pulses drive currents along +d and along −d. With one of them alone, iron that saturates alike to both
    /// sides looks like iron that does not.
    pub both_ways: bool,
}

/// A piece, measured and simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// In s, of the rows.
    pub time: Vec<f64>,
    /// Readings in A; not-a-number without a channel.
    pub measured: Vec<[f64; 3]>,
    /// What the channels would read without noise, in A.
    pub simulated: Vec<[f64; 3]>,
}

/// The motor that was found.
#[derive(Clone, Debug)]
pub struct Fit {
    /// In the order of their names above.
    pub parameters: Vec<Estimate>,
    /// The plant.
    pub plant: Plant,
    /// Falls of L_d along +d and −d and of L_q at `current`, where the iron is seen to saturate or was known to.
    pub falls: Option<[f64; 3]>,
    /// Rated current in A of the motor it began with, or the largest that was measured.
    pub current: f64,
    /// Magnet flux in Wb of the motor it began with, or a guess.
    pub magnet_flux: f64,
    /// Mean voltage in V of the DC link.
    pub link: f64,
    /// Largest deviation of the link's voltage from its mean within a pulse, as a share.
    pub link_spread: f64,
    /// Largest current in A that was measured.
    pub reach: f64,
    /// Largest currents in A that the pulses drove along +d, along −d and along q, either way.
    pub reached: [f64; 3],
    /// The pole.
    pub pole: Pole,
    /// What fixed parameters move.
    pub fixed_biases: Vec<FixedBias>,
    /// Combinations of parameters that the readings hardly determine, the least determined first.
    pub non_identifiable: Vec<NonIdentifiable>,
    /// Root mean square of readings less simulation, in A.
    pub residual_rms: f64,
    /// The same in A as noise and converters alone would have it.
    pub expected_rms: f64,
    /// By what factor intervals are wider because neighbouring residuals are alike.
    pub widened: f64,
    /// Whether the most likely parameters were reached; if not, their intervals are not to be believed.
    pub converged: bool,
    /// Each row is used, each second, or each third and so on.
    pub every: usize,
    /// Readings that are used and not cut off.
    pub readings: usize,
    /// Readings at the ends of the channels' ranges, which say only how large the current was at least.
    pub clipped: usize,
    /// Pulses, or trains of them, that began at rest.
    pub traces: Vec<Trace>,
}

/// How well everything is known at a point.
pub(super) struct Known {
    pub(super) sum: Sum,
    pub(super) spread: Spread,
    /// Parameters that are not free.
    pub(super) fixed: Vec<Parameter>,
}

impl Work<'_> {
    /// How well the free parameters are known, with what the fixed ones may be off by.
    pub(super) fn known(
        &mut self,
        point: &Point,
        free: &[Parameter],
        scatter: &[Scatter; 3],
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

/// Share of the current at which saturation is stated from which on pulses count as having reached it.
const NEARLY_REACHED: f64 = 0.9;

/// Share of it below which an axis counts as not driven at all.
const NOT_DRIVEN: f64 = 0.1;

/// The result of what was solved.
pub(super) fn conclude(mut work: Work, solved: Solved, start: &Start) -> Result<Fit, FitError> {
    let (mut solved, pole, iron) = with_iron(&mut work, solved, start)?;
    let tau = 2.0 * PI;
    let angle = &mut solved.point.plant.angle;
    *angle -= tau * (*angle / tau).floor();
    let free = solved.free.clone();
    let frame = work.problem.frame.clone();
    let Known { sum, spread, .. } = work.known(&solved.point, &free, &solved.scatter)?;
    let between = work.between(&sum, &solved.point, free.len(), &spread.off).ok_or(FitError::NoPlant)?;
    work.problem.free.clone_from(&free);
    solved.point = work.problem.moved(&solved.point, &between.mean);
    for parameter in free.iter().filter(|p| p.is_never_negative()) {
        // Rounding.
        let least = -parameter.get(&solved.point).min(0.0);
        parameter.add(&mut solved.point, least, work.problem.channels);
    }
    let Known { sum, spread, fixed } = work.known(&solved.point, &free, &solved.scatter)?;
    let falls = solved.point.plant.falls(&frame);
    let reached = work.reached(&solved.point);
    let channels = work.problem.channels;
    let mut parameters =
        estimates(&work, &solved.point, [&free, &fixed], &between, &spread.off, &iron, reached);
    parameters.push(with_switch(&between, &free, &fixed, &spread.off, &solved.point));
    let after = parameters.iter().rposition(|p| p.name.starts_with("gain")).map_or(0, |k| k + 1);
    parameters.splice(after..after, last_gains(&between, &free, &solved.point, channels));
    let fixed_biases = fixed_biases(&spread, &free, &fixed, &parameters);
    let non_identifiable = work.non_identifiable(&sum, &solved.point);
    let traces = traces(&work, &solved.point).ok_or(FitError::NoPlant)?;
    let residuals: Vec<f64> = sum.residuals.iter().flatten().copied().collect();
    let expected =
        |scatter: &Scatter| scatter.noise * scatter.noise + scatter.step.map_or(0.0, |q| q * q / 12.0);
    let weighted: f64 = sum
        .residuals
        .iter()
        .zip(&solved.scatter)
        .map(|(r, scatter)| r.len() as f64 * expected(scatter))
        .sum();
    Ok(Fit {
        parameters,
        falls: falls.filter(|_| !matches!(iron, Iron::Unknown)),
        plant: solved.point.plant,
        current: frame.current,
        magnet_flux: frame.magnet_flux,
        link: work.link,
        link_spread: work.problem.pieces.iter().map(|piece| piece.spread).fold(0.0, f64::max),
        reach: work.reach,
        reached,
        pole,
        fixed_biases,
        non_identifiable,
        residual_rms: (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64).sqrt(),
        expected_rms: (weighted / residuals.len() as f64).sqrt(),
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
                (0..3).filter(|k| channels[*k] && solved.scatter[*k].is_clipped(row.current[*k])).count()
            })
            .sum(),
        traces,
    })
}

/// The estimates of all parameters, free and fixed ones.
fn estimates(
    work: &Work,
    point: &Point,
    [free, fixed]: [&[Parameter]; 2],
    between: &Between,
    off_of_fixed: &[f64],
    iron: &Iron,
    reached: [f64; 3],
) -> Vec<Estimate> {
    let frame = &work.problem.frame;
    let shares = reached.map(|i| i / frame.current);
    let is_identified = |fall: usize| {
        let of_series = point.plant.law == Law::Series;
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
        let place = free.iter().position(|p| *p == parameter);
        let mut value = parameter.get(point);
        let mut terms: Vec<(usize, f64)> = place.map(|k| (k, 1.0)).into_iter().collect();
        if let Some(fall) = parameter.fall() {
            value = shown.map_or(0.0, |falls| falls[fall]);
            terms = fall_terms(fall, free, point, frame, at);
        }
        let of_series = parameter.fall().filter(|_| point.plant.law == Law::Series);
        let mut off = if place.is_some() || of_series.is_some() {
            let of_fixed = of_series.map_or_else(Vec::new, |fall| {
                let terms = fall_terms(fall, fixed, point, frame, at);
                spread_of_fixed(&terms, off_of_fixed)
            });
            let off = between.interval(&terms, &of_fixed);
            match (iron, parameter.fall()) {
                (Iron::Seen(Some(series)), Some(fall)) => {
                    // Both intervals: either law may be the nearer one.
                    let other =
                        series.point.plant.falls_at(frame, at).map_or(0.0, |falls| falls[fall] - value);
                    let terms = fall_terms(fall, &series.free, &series.point, frame, at);
                    let half = series.spread.half(&terms, parameter);
                    [off[0].min(other - half), off[1].max(other + half)]
                }
                _ => off,
            }
        } else {
            let half = work.plausible(parameter, point);
            [-half, half]
        };
        if parameter.is_never_negative() {
            off[0] = off[0].max(-value);
        }
        let one = if matches!(parameter, Parameter::Gain(_)) { 1.0 } else { 0.0 };
        let value = value + one;
        parameters.push(Estimate {
            name: parameter.name(),
            unit,
            value: value / factor,
            interval: Some(off.map(|off| (value + off) / factor)),
            identified: parameter.fall().map_or(place.is_some(), |fall| identified[fall]),
            at: parameter.fall().map(|fall| at[fall]),
        });
    }
    parameters
}

/// The gain of the last channel, which follows from the others', and that which all channels have in common, which nothing
/// tells.
fn last_gains(between: &Between, free: &[Parameter], point: &Point, channels: [bool; 3]) -> [Estimate; 2] {
    let are_gains = |(k, p): (usize, &Parameter)| matches!(p, Parameter::Gain(_)).then_some((k, -1.0));
    let gains: Vec<(usize, f64)> = free.iter().enumerate().filter_map(are_gains).collect();
    let value = 1.0 + point.gain[last(channels)];
    // It follows from the others' only if all of them are identified.
    let identified = gains.len() + 1 == channels.iter().filter(|present| **present).count();
    let off = if identified { between.interval(&gains, &[]) } else { [-0.03, 0.03] };
    let channel = Estimate {
        name: format!("gain_{}", letter(last(channels))),
        unit: "",
        value,
        interval: Some(off.map(|off| value + off)),
        identified,
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
    [channel, common]
}

/// The resistance of a phase with the switch that its current passes, which the readings tell as long as they tell any resistance.
fn with_switch(
    between: &Between,
    free: &[Parameter],
    fixed: &[Parameter],
    off: &[f64],
    point: &Point,
) -> Estimate {
    let place = free.iter().position(|p| *p == Parameter::Resistance);
    let value = point.plant.resistance + point.plant.devices.switch_resistance;
    let switch = |(parameter, off): (&Parameter, &f64)| match parameter {
        Parameter::SwitchResistance => *off,
        _ => 0.0,
    };
    let of_fixed: Vec<f64> = fixed.iter().zip(off).map(switch).collect();
    let off = place.map(|k| between.interval(&[(k, 1.0)], &of_fixed));
    Estimate {
        name: "resistance_with_switch".to_owned(),
        unit: "ohm",
        value,
        interval: off.map(|off| off.map(|off| value + off)),
        identified: place.is_some(),
        at: None,
    }
}

/// Whether the readings identify a fall of the series, of whose coefficients these are free: the two falls along d follow from β and γ.
fn is_fall_identified(fall: usize, free: &[Parameter]) -> bool {
    let along_d = [Parameter::SaturationAlong, Parameter::SaturationAgainst];
    fall == 2 || along_d.iter().all(|parameter| free.contains(parameter))
}

/// By how much a sum of fixed parameters moves with half an interval of each.
fn spread_of_fixed(terms: &[(usize, f64)], off: &[f64]) -> Vec<f64> {
    let mut spread = vec![0.0; off.len()];
    for (f, slope) in terms {
        spread[*f] = slope * off[*f];
    }
    spread
}

/// How a fall depends on these parameters: their places, and its slopes.
fn fall_terms(
    fall: usize,
    free: &[Parameter],
    point: &Point,
    frame: &Frame,
    currents: [f64; 3],
) -> Vec<(usize, f64)> {
    let mut terms = Vec::new();
    for (k, parameter) in free.iter().enumerate() {
        let Some(of) = parameter.fall() else { continue };
        let at = |change: f64| {
            let mut plant = point.plant.clone();
            plant.saturation[of] += change;
            Some(plant.falls_at(frame, currents)?[fall])
        };
        if let (Some(high), Some(low)) = (at(1e-4), at(-1e-4)) {
            terms.push((k, (high - low) / 2e-4));
        }
    }
    terms
}
