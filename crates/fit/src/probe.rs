//! Current probes of low bandwidth: tests whether the currents lag as behind a low-pass filter rather than with a pure delay.

use super::{FitError, Solved, Work};

/// Delay in rows that may be due to the drive; a low-pass filter is tried only above it.
const LATE_ROWS: f64 = 2.0;

/// Least advantage of a low-pass filter over a delay in ln P, divided by the Newey–West ratio, to be chosen.
const MORE_LIKELY: f64 = 8.0;

impl Work<'_> {
    /// Returns the solution with first-order probes if they make the readings more likely than a delay alone: a low-pass filter
    /// resembles a delay of its time constant, but rounds the corners of the currents.
    pub(super) fn behind_a_probe(&mut self, solved: Solved) -> Result<Solved, FitError> {
        let rows = self.problem.pieces.iter().flat_map(|piece| piece.rows.windows(2));
        let mut intervals: Vec<f64> = rows.map(|pair| pair[1].time - pair[0].time).collect();
        intervals.sort_unstable_by(f64::total_cmp);
        let interval = intervals.get(intervals.len() / 2).copied().unwrap_or(0.0);
        if solved.point.delay < LATE_ROWS * interval {
            return Ok(solved);
        }
        let scatter = self.scatter.clone();
        let mut from = solved.point.clone();
        (from.lag, from.delay) = (from.delay, 0.0);
        match self.solved_for_identifiable(&from) {
            Ok(lagging)
                if lagging.sum.likelihood > solved.sum.likelihood + MORE_LIKELY * lagging.sum.newey_west =>
            {
                Ok(lagging)
            }
            Err(FitError::Stopped) => Err(FitError::Stopped),
            _ => {
                self.scatter = scatter;
                self.problem.free.clone_from(&solved.free);
                Ok(solved)
            }
        }
    }
}
