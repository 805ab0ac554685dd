//! Eddy currents: tests whether short pulses meet less inductance than slow ones.

use super::parameters::Parameter;
use super::pieces::longest_pulse;
use super::record::Record;
use super::result::{rest_rms, rms};
use super::{ABOVE_REST, FitError, MISFIT, Solved, Work};
use standstill_plant::EddyBranch;

/// Share of the longest pulse that the search for the time constant begins with.
const BEGIN_TIME: f64 = 0.25;

/// Share of the inductances that the search begins with.
const BEGIN_DEPTH: f64 = 0.1;

/// Largest ratio of the residuals' rms with eddy currents to that without at which they explain the currents: a core of another law than
/// the fit's leaves most of the residuals with eddy currents, too.
const EXPLAINED: f64 = 0.6;

impl Work<'_> {
    /// Returns the solution with eddy currents if the readings are not described without them, and eddy currents explain what is left.
    pub(super) fn with_eddy_currents(
        &mut self,
        solved: Solved,
        records: &[Record],
    ) -> Result<Solved, FitError> {
        let residual = rms_of(&solved);
        let far_above = rest_rms(records, &solved.scatter).is_some_and(|rest| residual > ABOVE_REST * rest);
        if solved.sum.newey_west < MISFIT * MISFIT && !far_above {
            return Ok(solved);
        }
        let scatter = self.scatter.clone();
        let mut from = solved.point.clone();
        // Without eddy currents a delay and the places of edges stand for them.
        (from.delay, from.lag) = (0.0, 0.0);
        from.shifts.iter_mut().flatten().for_each(|shift| *shift = 0.0);
        let depth = BEGIN_DEPTH;
        from.plant.eddy = EddyBranch {
            time_constant: BEGIN_TIME * longest_pulse(&self.problem.pieces).max(1e-6),
            d_depth: depth,
            q_depth: depth,
        };
        let lagging = match self.solved_for_identifiable(&from) {
            Err(FitError::Stopped) => return Err(FitError::Stopped),
            lagging => lagging.ok(),
        };
        let explains = |lagging: &Solved| {
            lagging.free.contains(&Parameter::EddyTime) && rms_of(lagging) < EXPLAINED * residual
        };
        if let Some(lagging) = lagging.filter(explains) {
            return Ok(lagging);
        }
        self.scatter = scatter;
        self.problem.free.clone_from(&solved.free);
        Ok(solved)
    }
}

/// Returns the rms of a solution's residuals in A.
fn rms_of(solved: &Solved) -> f64 {
    rms(&solved.sum.residuals.iter().flatten().copied().collect::<Vec<_>>())
}
