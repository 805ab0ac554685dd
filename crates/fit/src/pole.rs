//! Identifies the pole from the readings, and checks whether the core saturates as iron does.

use std::f64::consts::PI;

use super::found::Found;
use super::parameters::{Parameter, Point};
use super::plant::Law;
use super::result::Pole;
use super::start::falls_of;
use super::steep;
use super::{FitError, POLE_DEVIATIONS, Solved, Start, TWO_SIDED_95, Work};

/// Applicability of the law of iron.
pub(super) enum Iron {
    /// The readings do not show that the core saturates.
    Unknown,
    /// The initial motor's falls are used.
    OfStart,
    /// The readings show saturation. Other laws are given too if they make the readings about as likely: then it is not known which law
    /// is the core's.
    Seen(Vec<Found>),
}

/// Least advantage of one law over another in ln P, divided by the Newey–West ratio, to be chosen.
const MORE_LIKELY: f64 = 8.0;

/// Reverses the direction of d: the other pole.
fn turn(point: &mut Point) {
    point.plant.angle += PI;
    point.plant.saturation[0] = -point.plant.saturation[0];
}

/// Solves with the law of iron and determines the pole, if the readings or the initial values have one.
pub(super) fn with_iron(
    work: &mut Work,
    solved: Solved,
    start: &Start,
) -> Result<(Solved, Pole, Iron), FitError> {
    let Solved { mut point, sum, free, scatter, converged } = solved;
    let known = start.motor.as_ref().and_then(|motor| falls_of(motor, work.problem.frame.current));
    let stated = work.origin.is_some();
    let falls_less = known.is_some_and(|[d, minus_d, _]| d < minus_d);
    let way = if falls_less || stated && point.plant.saturation[0] < 0.0 { -1.0 } else { 1.0 };
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
    let pole = Pole { deviations, identified: both_ways && deviations > POLE_DEVIATIONS, both_ways, stated };
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
    if !stated && point.plant.saturation[0] * way < 0.0 {
        turn(&mut point);
    }
    let mut iron = point.clone();
    iron.plant.law = Law::Iron;
    let falls = point.plant.falls(&work.problem.frame);
    let is_free = |p: Parameter| free.contains(&p);
    let (against, across) = (is_free(Parameter::SaturationAgainst), is_free(Parameter::SaturationAcross));
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
    let Some(bent) = candidate(work.solved_for(&free, &iron))? else {
        return Ok((Solved { point, sum, free, scatter, converged }, pole, Iron::Unknown));
    };
    let enough = MORE_LIKELY * sum.newey_west;
    let more = bent.sum.likelihood - sum.likelihood;
    let is_whole = against && across && is_free(Parameter::SaturationAlong);
    let of_series = Solved { point, sum, free, scatter, converged };
    // The series has the shape of this core, iron's law has not.
    let is_series = is_whole && (more < -enough || converged && !bent.converged);
    let (best, mut others) = match (is_series, more > enough) {
        (true, _) => (of_series, Vec::new()),
        (false, true) => (bent, Vec::new()),
        (false, false) => {
            let series = candidate(work.found(&of_series))?;
            (bent, series.into_iter().collect())
        }
    };
    if is_whole && best.converged {
        others.extend(of_steep_iron(work, &best)?);
    }
    work.scatter.clone_from(&best.scatter);
    work.problem.free.clone_from(&best.free);
    Ok((best, pole, Iron::Seen(others)))
}

/// Solves with the law of steep iron, which begins with the best solution's falls. Returns none if that law makes the readings clearly less
/// likely, or is none of this core.
fn of_steep_iron(work: &mut Work, best: &Solved) -> Result<Option<Found>, FitError> {
    let Some(falls) = best.point.plant.falls(&work.problem.frame) else { return Ok(None) };
    let mut from = best.point.clone();
    from.plant.law = Law::Steep;
    let [along, _, across] = falls.map(|fall| fall / (1.0 - fall));
    from.plant.saturation = [along, steep::BEGIN, across.max(0.0)];
    if from.plant.core(&work.problem.frame).is_none() {
        return Ok(None);
    }
    work.scatter.clone_from(&best.scatter);
    let Some(solved) = candidate(work.solved_for(&best.free, &from))? else { return Ok(None) };
    let less = best.sum.likelihood - solved.sum.likelihood;
    if less > MORE_LIKELY * best.sum.newey_west || !solved.converged {
        return Ok(None);
    }
    candidate(work.found(&solved))
}

/// Solves with the initial motor's falls, which these currents do not determine, and takes the more likely pole. None if no iron
/// has these falls.
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
    let here = candidate(work.solved_for(&all, &from))?;
    from.plant.angle += PI;
    let there = candidate(work.solved_for(&all, &from))?;
    let stated = work.origin.is_some();
    // Readings whose neighbours have similar residuals count as fewer readings. A pole that no search reaches tells nothing of the other.
    let (best, deviations) = match (here, there) {
        (Some(here), Some(there)) => {
            let more = (here.sum.likelihood - there.sum.likelihood).abs();
            let best = if stated || here.sum.likelihood >= there.sum.likelihood { here } else { there };
            let deviations = (2.0 * more / best.sum.newey_west).sqrt();
            (best, deviations)
        }
        (Some(one), None) => (one, 0.0),
        (None, Some(one)) if !stated => (one, 0.0),
        (None, _) => return Ok(None),
    };
    let both_ways = work.drives_both_ways(&best.point);
    let pole = Pole { deviations, identified: both_ways && deviations > POLE_DEVIATIONS, both_ways, stated };
    Ok(Some((best, pole, Iron::OfStart)))
}

/// Returns one of several candidates, or none where it has no solution; only an interruption ends the fit.
fn candidate<T>(result: Result<T, FitError>) -> Result<Option<T>, FitError> {
    match result {
        Ok(one) => Ok(Some(one)),
        Err(FitError::Stopped) => Err(FitError::Stopped),
        Err(_) => Ok(None),
    }
}
