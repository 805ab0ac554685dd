//! Advises on further measurements: the pulse that shows what the recorded pulses do not.

use std::f64::consts::PI;

use standstill_numeric::{cos, ln};

use super::Fit;

/// A pulse of a voltage vector that begins at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// Requests of the three legs.
    pub legs: [&'static str; 3],
    /// Duration in s.
    pub duration: f64,
    /// Current in A that the pulse drives along the axis at its end.
    pub current: f64,
}

/// The six voltage vectors, at 0°, 60° and so on from the axis of phase a.
const VECTORS: [[&str; 3]; 6] = [
    ["high", "low", "low"],
    ["high", "high", "low"],
    ["low", "high", "low"],
    ["low", "high", "high"],
    ["low", "low", "high"],
    ["high", "low", "high"],
];

impl Fit {
    /// Returns the axes whose falls of inductance are stated in the data sheet although the pulses did not reach the stated
    /// current: 0 for +d, 1 for −d, 2 for q.
    pub fn extrapolated(&self) -> Vec<usize> {
        let is_beyond = |name: &str| {
            self.estimate(name).is_some_and(|estimate| {
                !estimate.identified || estimate.at.is_some_and(|at| at < self.current)
            })
        };
        let names = ["saturation.d", "saturation.minus_d", "saturation.q"];
        (0..3).filter(|k| is_beyond(names[*k])).collect()
    }

    /// Returns the pulse that drives the current at which saturation is stated along +d (0), −d (1) or q (2), with the vector
    /// nearest to that axis. None if the resistance limits the current to less.
    pub fn pulse_along(&self, axis: usize) -> Option<Pulse> {
        // Along q both ways tell the same.
        let directions: &[f64] = [&[0.0][..], &[PI], &[PI / 2.0, -PI / 2.0]][axis];
        let beside =
            |vector: usize, direction: f64| cos(PI / 3.0 * vector as f64 - self.plant.angle - direction);
        let nearness = |vector: usize| {
            directions.iter().map(|direction| beside(vector, *direction)).fold(f64::NEG_INFINITY, f64::max)
        };
        let vector = (0..6).max_by(|a, b| nearness(*a).total_cmp(&nearness(*b)))?;
        let voltage = 2.0 / 3.0 * self.link * nearness(vector);
        let resistance = self.plant.resistance + self.plant.devices.switch_resistance;
        let inductance = self.plant.inductance[usize::from(axis == 2)];
        // u = R i + L di/dt from rest.
        let share = self.current * resistance / voltage;
        let duration = match share {
            0.9.. => return None,
            1e-6.. => -ln(1.0 - share) * inductance / resistance,
            _ => inductance * self.current / voltage,
        };
        Some(Pulse { legs: VECTORS[vector], duration, current: self.current })
    }
}
