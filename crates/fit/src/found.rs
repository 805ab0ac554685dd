//! Values and intervals that a solution gives with one law of the core, and their union over several laws.

use std::f64::consts::TAU;

use nalgebra::DVector;

use super::between_rows::Between;
use super::parameters::{Parameter, Point, last};
use super::plant::Frame;
use super::reading::Scatter;
use super::record::CHANNELS;
use super::result::Known;
use super::solve::Problem;
use super::{FitError, Solved, Work};

/// Solution with one law of the core.
pub(super) struct Found {
    /// Mean of the distribution of the parameters, or the point next to it that has a plant.
    pub(super) point: Point,
    /// Parameters that are free.
    pub(super) free: Vec<Parameter>,
    /// Parameters that are not free.
    pub(super) fixed: Vec<Parameter>,
    /// Half the widths of the prior intervals of the fixed parameters.
    pub(super) off: Vec<f64>,
    /// Distribution of the free parameters.
    between: Between,
    /// Share of the way to the mean that the point has not gone: zero unless no plant has the mean's parameters.
    short: f64,
}

/// Value with the ends of its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Interval {
    pub(super) value: f64,
    pub(super) ends: [f64; 2],
}

impl Interval {
    /// Returns the value with the hull of both intervals.
    fn or(self, other: Self) -> Self {
        let [low, high] = self.ends;
        Self { ends: [low.min(other.ends[0]), high.max(other.ends[1])], ..self }
    }

    /// Returns the interval shifted by whole turns so that the value lies next to an angle in rad.
    fn beside(self, angle: f64) -> Self {
        let turns = TAU * ((angle - self.value) / TAU).round();
        Self { value: self.value + turns, ends: self.ends.map(|end| end + turns) }
    }
}

impl Work<'_> {
    /// Computes the distribution about a solution and moves the solution to its mean.
    pub(super) fn found(&mut self, solved: &Solved) -> Result<Found, FitError> {
        let free = solved.free.clone();
        let Known { sum, spread, fixed } = self.known(&solved.point, &free, &solved.scatter)?;
        let between = self.between(&sum, &solved.point, free.len(), &spread.off).ok_or(FitError::NoPlant)?;
        self.problem.free.clone_from(&free);
        let (point, share) = within(&self.problem, &solved.point, &between.mean, &solved.scatter);
        Ok(Found { point, free, fixed, off: spread.off, between, short: 1.0 - share })
    }
}

/// Returns the point moved towards the mean by as much of the way as has a plant, by halves, and that share: 1 as a rule. The mean of a
/// distribution may lie where no iron has its falls of inductance, although the most likely point does not. All parameters go the same share,
/// because without the falls the others do not fit.
fn within(
    problem: &Problem,
    point: &Point,
    mean: &DVector<f64>,
    scatter: &[Scatter; CHANNELS],
) -> (Point, f64) {
    let at = |share: &f64| {
        let mut moved = problem.moved(point, &(mean * *share));
        for parameter in problem.free.iter().filter(|p| p.is_never_negative()) {
            // Rounding.
            let least = -parameter.get(&moved).min(0.0);
            parameter.add(&mut moved, least, problem.channels);
        }
        problem.sum(&moved, scatter, false).is_some().then_some((moved, *share))
    };
    [1.0, 0.5, 0.25, 0.125, 0.0].iter().find_map(at).unwrap_or_else(|| (point.clone(), 0.0))
}

impl Found {
    /// Returns the interval of a linear combination of free parameters about its value; `of_fixed` as in [`Between::interval`].
    fn about(&self, value: f64, terms: &[(usize, f64)], of_fixed: &[f64]) -> Interval {
        let rest = self.short * terms.iter().map(|(k, a)| a * self.between.mean[*k]).sum::<f64>();
        let [low, high] = self.between.interval(terms, of_fixed).map(|off| value + rest + off);
        // A point that is short of the mean may lie beyond its interval.
        let ends = if self.short > 0.0 { [low.min(value), high.max(value)] } else { [low, high] };
        Interval { value, ends }
    }

    /// Returns the value and the interval of a parameter, for a fall at its current in A of `at`; none if it is fixed. Of a fall that
    /// depends on fixed parameters alone the interval has what these may be off.
    pub(super) fn of(&self, parameter: Parameter, frame: &Frame, at: [f64; 3]) -> Option<Interval> {
        let Some(fall) = parameter.fall() else {
            let place = self.free.iter().position(|p| *p == parameter)?;
            return Some(self.about(parameter.get(&self.point), &[(place, 1.0)], &[]));
        };
        let terms = fall_terms(fall, &self.free, &self.point, frame, at);
        let mut of_fixed = vec![0.0; self.off.len()];
        for (f, slope) in fall_terms(fall, &self.fixed, &self.point, frame, at) {
            of_fixed[f] = slope * self.off[f];
        }
        let value = self.point.plant.falls_at(frame, at).map_or(0.0, |falls| falls[fall]);
        Some(self.about(value, &terms, &of_fixed))
    }

    /// Returns the gain less 1 of the last of several channels, which follows from the others' if all of these are free.
    pub(super) fn last_gain(&self, channels: [bool; CHANNELS]) -> Option<Interval> {
        let are_gains = |(k, p): (usize, &Parameter)| matches!(p, Parameter::Gain(_)).then_some((k, -1.0));
        let gains: Vec<(usize, f64)> = self.free.iter().enumerate().filter_map(are_gains).collect();
        let all = gains.len() + 1 == channels.iter().filter(|present| **present).count();
        all.then(|| self.about(self.point.gain[last(channels)], &gains, &[]))
    }

    /// Returns the resistance in Ω of a phase with the switch in its current path, which the readings determine if they
    /// determine any resistance.
    pub(super) fn with_switch(&self) -> Option<Interval> {
        let place = self.free.iter().position(|p| *p == Parameter::Resistance)?;
        let value = self.point.plant.resistance + self.point.plant.devices.switch_resistance;
        let switch = |(parameter, off): (&Parameter, &f64)| match parameter {
            Parameter::SwitchResistance => *off,
            _ => 0.0,
        };
        let of_fixed: Vec<f64> = self.fixed.iter().zip(&self.off).map(switch).collect();
        Some(self.about(value, &[(place, 1.0)], &of_fixed))
    }
}

/// Solution of a fit, and those with other laws of the core that make the readings about as likely: which law is the core's is then not
/// known, and an interval is the hull of all laws'. The values are those of the first.
pub(super) struct Either {
    pub(super) one: Found,
    pub(super) others: Vec<Found>,
}

impl Either {
    /// Returns the hull of the first interval and those that the other solutions have.
    fn hull(
        &self,
        one: Option<Interval>,
        of: impl Fn(&Found, Interval) -> Option<Interval>,
    ) -> Option<Interval> {
        let one = one?;
        Some(self.others.iter().filter_map(|found| of(found, one)).fold(one, Interval::or))
    }

    /// Returns the hull of all solutions' intervals by [`Found::of`].
    pub(super) fn of(&self, parameter: Parameter, frame: &Frame, at: [f64; 3]) -> Option<Interval> {
        self.hull(self.one.of(parameter, frame, at), |found, one| {
            let tells = parameter.fall().is_none() || found.free.contains(&parameter);
            let other = found.of(parameter, frame, at).filter(|_| tells)?;
            Some(if parameter == Parameter::Angle { other.beside(one.value) } else { other })
        })
    }

    /// Returns the hull of all solutions' intervals by [`Found::last_gain`].
    pub(super) fn last_gain(&self, channels: [bool; CHANNELS]) -> Option<Interval> {
        self.hull(self.one.last_gain(channels), |found, _| found.last_gain(channels))
    }

    /// Returns the hull of all solutions' intervals by [`Found::with_switch`].
    pub(super) fn with_switch(&self) -> Option<Interval> {
        self.hull(self.one.with_switch(), |found, _| found.with_switch())
    }
}

/// Returns the dependence of a fall on these parameters: their indices, and the slopes.
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

#[cfg(test)]
mod tests {
    use standstill_inverter::{DeviceKind, Devices};

    use super::super::plant::Law;
    use super::super::record::Record;
    use super::super::{MOST_USED, Start, pieces, start};
    use super::*;

    /// A triangle of current in phase a, of 20 A in 20 µs, simulated again with iron.
    fn problem() -> (Problem, Point, [Scatter; CHANNELS]) {
        let row = |k: i32| {
            let i = f64::from((k - 10).min(50 - k).max(0));
            let legs = match k {
                10..30 => "high,low,low",
                30..50 => "low,high,high",
                _ => "off,off,off",
            };
            format!("{k}e-6,{i},{0},{0},12,{legs}\n", -i / 2.0)
        };
        let header = "t_s,i_a_A,i_b_A,i_c_A,u_dc_V,leg_a,leg_b,leg_c\n".to_owned();
        let text = header + &(0..60).map(row).collect::<String>();
        let record = Record::parse("p.csv", &text).expect("a record");
        let kind = DeviceKind::Mosfet;
        let devices = Devices {
            kind,
            switch_drop: 0.0,
            switch_resistance: 4e-3,
            diode_drop: 0.8,
            diode_resistance: 5e-3,
        };
        let start = Start {
            motor: None,
            devices,
            dead_time: 0.0,
            stated: Vec::new(),
            settle: 0.0,
            most_used: MOST_USED,
        };
        let (pieces, channels) = (pieces::pieces(0, &record), record.channels);
        let (frame, mut point, scatter) =
            start::begin(&[record], &pieces, channels, &start).expect("a current");
        (point.plant.law, point.plant.saturation) = (Law::Iron, [0.06, -0.02, 0.03]);
        let free = vec![Parameter::Resistance, Parameter::SaturationAlong, Parameter::SaturationAgainst];
        (Problem { frame, pieces, channels, free, edges: Vec::new() }, point, scatter)
    }

    /// A data sheet's iron saturates along +d at least as much as along −d: a mean on the other side has no plant, and did end the fit.
    #[test]
    fn regress_a_mean_that_no_iron_has_is_approached_as_far_as_there_is_a_plant() {
        let (problem, point, scatter) = problem();
        assert!(point.plant.core(&problem.frame).is_some());
        let moved = |mean: [f64; 3]| within(&problem, &point, &DVector::from_row_slice(&mean), &scatter);
        let (near, share) = moved([-point.plant.resistance * (1.0 + 1e-15), -0.01, 0.0]);
        assert!(
            share >= 1.0 && near.plant.resistance >= 0.0 && (near.plant.saturation[0] - 0.05).abs() < 1e-12
        );
        let beyond = [0.0, -0.061, -0.0375];
        let whole = Point {
            plant: super::super::Plant { saturation: [-0.001, -0.0575, 0.03], ..point.plant.clone() },
            ..point.clone()
        };
        assert!(whole.plant.core(&problem.frame).is_none());
        let (part, share) = moved(beyond);
        assert!(share > 0.0 && share < 1.0 && part.plant.core(&problem.frame).is_some(), "{share}");
    }
}
