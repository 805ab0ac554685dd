//! Initial values of a fit: rough estimates from the data, and the properties of a similar motor.

use standstill_plant::{Motor, built_in};

use super::parameters::Point;
use super::pieces::{self, Piece};
use super::plant::{Frame, Law, NO_EDDIES, Plant};
use super::reading::{Scatter, clip_of, steps_of};
use super::record::{CHANNELS, LINK, Record, Request};
use super::{Start, shunt};

/// Returns the falls along +d and −d and along q of a motor's core at a current in A; none if its saturation is unknown.
pub fn falls_of(motor: &Motor, current: f64) -> Option<[f64; 3]> {
    if !motor.saturation_is_known() {
        return None;
    }
    let heading = standstill_numeric::Heading::ZERO;
    let at = |d: f64, q: f64| {
        let flux = motor.magnetics.flux_at(standstill_interface::Dq::new(d, q), heading).ok()?;
        Some(motor.magnetics.state(flux, heading).inverse_inductance.inverse())
    };
    let rest = at(0.0, 0.0)?;
    let share = |l: f64, rest: f64| 1.0 - l / rest;
    Some([
        share(at(current, 0.0)?.xx, rest.xx),
        share(at(-current, 0.0)?.xx, rest.xx),
        share(at(0.0, current)?.yy, rest.yy),
    ])
}

/// Returns β, γ and γ_q of the series ([`super::plant::Law::Series`]) with these falls along +d and −d and along q; none if no
/// series has them.
pub fn series_of(falls: [f64; 3]) -> Option<[f64; 3]> {
    let rise = falls.map(|fall| fall / (1.0 - fall));
    // y + γ_q y³ = 1 and 3 γ_q y² = rise.
    let along_q = 1.0 / (1.0 + rise[2] / 3.0);
    // x and −z are the fluxes at ±1: x + β x² + γ x³ = 1, 2βx + 3γx² = rise along +d; −z likewise along −d.
    let (mut x, mut z, mut beta, mut gamma) = (1.0, 1.0, 0.0, 0.0);
    for _ in 0..60 {
        gamma = (rise[0] / x + rise[1] / z) / (3.0 * (x + z));
        beta = (rise[0] / x - 3.0 * gamma * x) / 2.0;
        x = 1.0 / (1.0 + x * (beta + gamma * x));
        z = 1.0 / (1.0 + z * (gamma * z - beta));
    }
    let reached = x * (1.0 + x * (beta + gamma * x)) + z * (1.0 + z * (gamma * z - beta));
    let series = [beta, gamma, rise[2] / (3.0 * along_q * along_q)];
    (series.iter().all(|x| x.is_finite()) && (reached - 2.0).abs() < 1e-9).then_some(series)
}

/// Returns the largest magnitude of a current in A, offsets removed.
pub fn reach(pieces: &[Piece], point: &Point) -> f64 {
    let rows = pieces.iter().flat_map(|piece| &piece.rows);
    rows.flat_map(|row| (0..CHANNELS).map(|k| (row.current[k] - point.offset[k]).abs()))
        .filter(|i| i.is_finite())
        .fold(0.0, f64::max)
}

/// Returns the mean inductance in H of a phase from a piece's first pulse: its volt-seconds divided by the rise of current.
fn glance(piece: &Piece, offset: [f64; CHANNELS], dead_time: f64) -> Option<f64> {
    let (edge, row) = piece.first_pulse()?;
    let time = row.time - edge.at - dead_time;
    let line = edge.legs.contains(&Request::Off);
    let raised = (0..CHANNELS)
        .map(|k| (row.current[k] - offset[k]).abs())
        .filter(|i| i.is_finite())
        .fold(0.0, f64::max);
    // Across a line two phases share the voltage; with all legs on, one phase has two thirds of it.
    let share = if line { 0.5 } else { 2.0 / 3.0 };
    (time > 0.0 && raised > 0.0).then(|| share * piece.link * time / raised)
}

/// Returns the frame, the initial point and the channels of a fit.
pub fn begin(
    records: &[Record],
    pieces: &[Piece],
    channels: [bool; CHANNELS],
    start: &Start,
) -> Option<(Frame, Point, [Scatter; CHANNELS])> {
    let offset = pieces::resting(&records[0]).map(|rest| if rest.mean.is_nan() { 0.0 } else { rest.mean });
    let readings: [Vec<f64>; CHANNELS] = std::array::from_fn(|k| {
        let readings = pieces.iter().flat_map(|piece| &piece.rows).map(|row| row.current[k]);
        if channels[k] { readings.filter(|i| !i.is_nan()).collect() } else { Vec::new() }
    });
    let steps = steps_of(&readings);
    let mut inductances: Vec<f64> =
        pieces.iter().filter_map(|piece| glance(piece, offset, start.dead_time)).collect();
    inductances.sort_unstable_by(f64::total_cmp);
    let inductance = *inductances.get(inductances.len() / 2)?;
    let mut point = Point {
        plant: Plant {
            resistance: 0.0,
            inductance: [inductance; 2],
            angle: records[0].angle.unwrap_or(0.0),
            law: Law::Series,
            saturation: [0.0; 3],
            eddy: NO_EDDIES,
            devices: start.devices,
            dead_time: start.dead_time,
        },
        delay: 0.0,
        lag: 0.0,
        gain: [0.0; CHANNELS],
        offset,
        shifts: pieces.iter().map(|piece| vec![0.0; piece.edges.len()]).collect(),
    };
    let reach = reach(pieces, &point);
    let resolved = steps.iter().flatten().fold(0.0_f64, |most, step| most.max(*step));
    if reach.is_nan() || reach <= 10.0 * resolved || reach == 0.0 {
        return None;
    }
    let link = pieces[0].link;
    let (motor, ratio) = if let Some(motor) = &start.motor {
        let winding = &motor.winding;
        let [l_d, l_q] = [winding.d_axis_inductance(), winding.q_axis_inductance()];
        point.plant.resistance = motor.resistance;
        (motor.clone(), l_d / (0.5 * (l_d + l_q)))
    } else {
        let longest = pieces::longest_pulse(pieces);
        // Time constants of motors are tens of the pulses that raise their rated current.
        point.plant.resistance = inductance / (40.0 * longest.max(1e-6));
        (built_in("paper-5k5")?, 0.8)
    };
    let ratio = if (0.97..1.03).contains(&ratio) { if ratio > 1.0 { 1.1 } else { 0.9 } } else { ratio };
    point.plant.inductance = [inductance * ratio, inductance * (2.0 - ratio)];
    // To two digits: people will read it in a data sheet.
    let round = |value: f64| standstill_quantity::significant(value, 2);
    let (current, magnet_flux) = match &start.motor {
        Some(motor) => (motor.rated_current, motor.magnet_flux),
        None => (round(reach), round(3.0 * inductance * reach)),
    };
    let mut motor = Motor { magnet_flux, rated_current: current, ..motor };
    motor.winding =
        standstill_plant::Winding { mean_inductance: inductance / 1.5, saliency: 0.0, leakage: 0.0 };
    let shortest = inductance / point.plant.resistance;
    let frame = Frame {
        tolerance: 1e-9 * inductance * current,
        // A straight line is off by r²/8 of the bend U R/L²: 1e-6 of the current of a pulse.
        resolution: (8e-6 * shortest * (reach * inductance / link)).sqrt().max(1e-7),
        motor,
        current,
        magnet_flux,
    };
    let scatter = std::array::from_fn(|k| {
        let clip = match clip_of(&readings[k], steps[k], offset[k]) {
            [low, high] if k == LINK => [low.max(shunt::floor(records)), high],
            clip => clip,
        };
        Scatter::new(steps[k], 0.05 * reach).clipped(clip).at_least(1e-6 * reach)
    });
    Some((frame, point, scatter))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_a_series_has_the_falls_that_it_was_made_of() {
        for falls in [[0.063, -0.034, 0.035], [0.3, 0.25, 0.5], [-0.02, -0.03, -0.04], [0.0; 3]] {
            let [beta, gamma, across] = series_of(falls).expect("a series");
            // Where i(x) = x + βx² + γx³ is ±1, by halving; there L/L₀ = 1/i′.
            let fall = |beta: f64, gamma: f64| {
                let (mut low, mut high): (f64, f64) = (0.0, 1.2);
                for _ in 0..60 {
                    let x = f64::midpoint(low, high);
                    if x * (1.0 + x * (beta + gamma * x)) < 1.0 { low = x } else { high = x }
                }
                1.0 - 1.0 / (1.0 + low * (2.0 * beta + 3.0 * gamma * low))
            };
            let found = [fall(beta, gamma), fall(-beta, gamma), fall(0.0, across)];
            for (found, stated) in found.iter().zip(falls) {
                assert!((found - stated).abs() < 1e-9, "{found}, not {stated}");
            }
        }
    }
}
