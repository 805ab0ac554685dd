//! Currents that the pulses reached, from the simulation.

use std::f64::consts::PI;

use super::Work;
use super::parameters::Point;
use super::result::Trace;
use super::solve::Problem;

/// Least ratio of the smaller to the larger of the currents along +d and −d at which pulses count as driving both ways.
const BOTH_WAYS: f64 = 0.3;

impl Work<'_> {
    /// Returns the largest simulated currents in A along +d, along −d and along q in either direction.
    pub(super) fn reached(&self, point: &Point) -> [f64; 3] {
        let mut reached = [0.0_f64; 3];
        for (piece, trace) in self.problem.pieces.iter().zip(traces(&self.problem, point).unwrap_or_default())
        {
            let axes: [(f64, f64); 3] = std::array::from_fn(|k| {
                standstill_numeric::sin_cos(2.0 * PI / 3.0 * k as f64 - point.plant.angle - piece.turn)
            });
            for current in &trace.simulated {
                let (mut d, mut q) = (0.0, 0.0);
                for (k, (sin, cos)) in axes.iter().enumerate() {
                    let i = 2.0 / 3.0 * (current[k] - point.offset[k]) / (1.0 + point.gain[k]);
                    (d, q) = (d + i * cos, q + i * sin);
                }
                for (most, i) in reached.iter_mut().zip([d, -d, q.abs()]) {
                    *most = most.max(i);
                }
            }
        }
        reached
    }

    /// Returns true if the simulated currents flow to both sides of the magnet.
    pub(super) fn drives_both_ways(&self, point: &Point) -> bool {
        let [along, against, _] = self.reached(point);
        along.min(against) > BOTH_WAYS * along.max(against)
    }
}

/// Returns the measured and simulated currents of all pieces.
pub(super) fn traces(problem: &Problem, point: &Point) -> Option<Vec<Trace>> {
    let pieces = &problem.pieces;
    let trace = |(piece, shifts): (&super::pieces::Piece, &Vec<f64>)| {
        let begin = piece.rows[0].time - super::plant::MARGIN;
        let waveform = point.plant.waveform(&problem.frame, piece, shifts)?;
        let currents =
            waveform.behind(point.lag, piece.rows.iter().map(|row| row.time - begin - point.delay));
        Some(Trace {
            record: piece.record,
            time: piece.rows.iter().map(|row| row.time).collect(),
            measured: piece.rows.iter().map(|row| row.current).collect(),
            simulated: currents
                .into_iter()
                .map(|(i, _)| std::array::from_fn(|k| (1.0 + point.gain[k]) * i[k] + point.offset[k]))
                .collect(),
        })
    };
    pieces.iter().zip(&point.shifts).map(trace).collect()
}
