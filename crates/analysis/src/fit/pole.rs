//! Which pole the readings name, and whether the core saturates as iron does.

use std::f64::consts::PI;

use super::parameters::{Parameter, Point};
use super::plant::{Law, Plant};
use super::result::Pole;
use super::start::falls_of;
use super::{FitError, POLE_DEVIATIONS, Solved, Start, TWO_SIDED_95, Work};

/// Whether the law of iron holds.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Iron {
    /// The readings do not show that the core saturates.
    Unknown,
    /// As the start has it.
    OfStart,
    /// They do. This is the plant with the series, which has no iron's shape; which of the two laws is nearer is not known.
    Seen(Box<Plant>),
}

/// Turns d around: the other pole.
fn turn(point: &mut Point) {
    point.plant.angle += PI;
    point.plant.saturation[0] = -point.plant.saturation[0];
}

/// The pole, and with it the law of iron, if the readings or the start have one.
pub(super) fn with_iron(
    work: &mut Work,
    solved: Solved,
    start: &Start,
) -> Result<(Solved, Pole, Iron), FitError> {
    let Solved { mut point, sum, free, scatter, converged } = solved;
    let known = start.motor.as_ref().and_then(|motor| falls_of(motor, work.problem.frame.current));
    let way = if known.is_some_and(|[d, minus_d, _]| d < minus_d) { -1.0 } else { 1.0 };
    let place = free.iter().position(|p| *p == Parameter::SaturationAlong);
    let both_ways = work.drives_both_ways(&point);
    let deviations = match place {
        Some(k) => {
            let known = work.known(&point, &free, &scatter)?;
            let half = known.spread.half(&[(k, 1.0)], Parameter::SaturationAlong);
            (point.plant.saturation[0] / half).abs() * TWO_SIDED_95
        }
        None => 0.0,
    };
    let pole = Pole { deviations, identified: both_ways && deviations > POLE_DEVIATIONS, both_ways };
    work.scatter.clone_from(&scatter);
    if !pole.identified {
        if let (None, Some(falls)) = (place, known)
            && let Some(of_start) = with_known_falls(work, &point, falls)?
        {
            return Ok(of_start);
        }
        work.problem.free.clone_from(&free);
        return Ok((Solved { point, sum, free, scatter, converged }, pole, Iron::Unknown));
    }
    if point.plant.saturation[0] * way < 0.0 {
        turn(&mut point);
    }
    let mut iron = point.clone();
    iron.plant.law = Law::Iron;
    let falls = point.plant.falls(&work.problem.frame);
    let told = |p: Parameter| free.contains(&p);
    let (against, across) = (told(Parameter::SaturationAgainst), told(Parameter::SaturationAcross));
    let series = Box::new(point.plant.clone());
    let Some([d, minus_d, q]) = falls else {
        return Ok((Solved { point, sum, free, scatter, converged }, pole, Iron::Unknown));
    };
    // What the readings do not tell is as the start has it; without one, the fall along −d follows from that along +d.
    let minus_d = match known {
        Some([_, known, _]) if !against => known,
        None if !against && way > 0.0 => f64::NAN,
        _ => minus_d,
    };
    iron.plant.saturation = [d, minus_d, known.filter(|_| !across).map_or(q, |[_, _, q]| q)];
    if iron.plant.core(&work.problem.frame).is_none() {
        return Ok((Solved { point, sum, free, scatter, converged }, pole, Iron::Unknown));
    }
    match work.told_of(&free, &iron) {
        Ok(solved) => Ok((solved, pole, Iron::Seen(series))),
        Err(FitError::Stopped) => Err(FitError::Stopped),
        Err(_) => Ok((Solved { point, sum, free, scatter, converged }, pole, Iron::Unknown)),
    }
}

/// With the start's falls, which these currents do not tell: the more likely pole. None: no iron falls so.
fn with_known_falls(
    work: &mut Work,
    point: &Point,
    falls: [f64; 3],
) -> Result<Option<(Solved, Pole, Iron)>, FitError> {
    let all: Vec<Parameter> = Parameter::observable(work.problem.channels, point)
        .into_iter()
        .filter(|p| p.fall().is_none())
        .collect();
    let mut from = point.clone();
    (from.plant.law, from.plant.saturation) = (Law::Iron, falls);
    if from.plant.core(&work.problem.frame).is_none() {
        return Ok(None);
    }
    let here = work.told_of(&all, &from)?;
    from.plant.angle += PI;
    let there = work.told_of(&all, &from)?;
    let more = (here.sum.likelihood - there.sum.likelihood).abs();
    let best = if here.sum.likelihood >= there.sum.likelihood { here } else { there };
    // Readings whose neighbours have similar residuals count as fewer readings.
    let deviations = (2.0 * more / best.sum.inflation).sqrt();
    let both_ways = work.drives_both_ways(&best.point);
    let pole = Pole { deviations, identified: both_ways && deviations > POLE_DEVIATIONS, both_ways };
    Ok(Some((best, pole, Iron::OfStart)))
}
