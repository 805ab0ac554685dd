//! Finds the axes of the magnet: their angle, and which of the two is d.

use std::f64::consts::{FRAC_PI_2, PI};

use super::parameters::{Parameter, Point};
use super::{FitError, Solved, Start, Work};

impl Work<'_> {
    /// Returns the most likely solution without saturation, from initial angles all around, or near the one that is stated.
    pub(super) fn straight(&mut self, point: &Point) -> Result<Solved, FitError> {
        if self.origin.is_some() {
            // Pulses along a known axis need not tell the other axis's inductance. What the stated angle is off shows later, beside all else.
            let all: Vec<_> = self.problem.free.iter().copied().filter(|p| *p != Parameter::Angle).collect();
            return self.solved_for(&all, point);
        }
        let mut best: Option<Solved> = None;
        for k in 0..4 {
            let mut from = point.clone();
            from.plant.angle = PI * f64::from(k) / 4.0;
            match self.solve(&from, 12) {
                Ok(solved) => {
                    if best.as_ref().is_none_or(|best| solved.sum.likelihood > best.sum.likelihood) {
                        best = Some(solved);
                    }
                }
                Err(FitError::NoPlant) => {}
                Err(error) => return Err(error),
            }
        }
        let mut best = best.ok_or(FitError::NoPlant)?;
        // In a straight core the axes are alike but for their inductances: d is the one that the start has.
        let [l_d, l_q] = best.point.plant.inductance;
        let [d, q] = point.plant.inductance;
        if (l_d < l_q) != (d < q) {
            swap_axes(&mut best.point);
        }
        Ok(best)
    }

    /// Solves for all identifiable parameters, with the d-axis as it is and with d and q exchanged: the axis that saturates
    /// unsymmetrically is d. Without evidence the axes stay.
    pub(super) fn either_axis(&mut self, point: &Point, start: &Start) -> Result<Solved, FitError> {
        let here = self.solved_for_identifiable(point)?;
        if start.motor.is_some() || self.origin.is_some() {
            return Ok(here);
        }
        let mut other = point.clone();
        swap_axes(&mut other);
        match self.solved_for_identifiable(&other) {
            // Readings whose neighbours have similar residuals count as fewer readings.
            Ok(there) if there.sum.likelihood > here.sum.likelihood + 8.0 * there.sum.newey_west => Ok(there),
            Err(FitError::Stopped) => Err(FitError::Stopped),
            _ => {
                self.problem.free.clone_from(&here.free);
                Ok(here)
            }
        }
    }
}

/// Exchanges the d- and q-axes.
fn swap_axes(point: &mut Point) {
    point.plant.inductance.swap(0, 1);
    point.plant.angle += FRAC_PI_2;
}
