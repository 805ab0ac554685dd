//! The end of a run, and past angles of a rotor that can move: where it was at the instant for which a detector's angle holds.

use standstill_interface::Nanos;
use standstill_numeric::Wide;

use super::motion::can_move;
use super::run::Control;
use crate::case::{Finished, RunError, RunOf, Work};
use crate::lanes::bank::Bank;

/// Position of a rotor at a time.
#[derive(Clone, Copy, Debug)]
struct Point {
    /// Time in s since the start of the run.
    time: f64,
    /// Electrical angle in rad from the initial position.
    turned: f64,
    /// Electrical speed in rad/s.
    speed: f64,
}

/// Number of points for which memory is taken at first; most methods give fewer commands.
const USUAL: usize = 256;

/// Positions of a rotor at the beginnings of commands and at the end of the run, in ascending order of time. Empty for a rotor that cannot
/// move.
#[derive(Debug, Default)]
pub struct Past(Vec<Point>);

impl Past {
    /// Forgets all points, and keeps their memory.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Returns the electrical angle in rad by which the rotor had turned at a time in s. Between two commands it is the cubic with the
    /// angles and speeds at both ends, which is exact for a constant acceleration. Before the first point and after the last one, returns
    /// the angle there. None if nothing was noted.
    pub fn turned(&self, time: f64) -> Option<f64> {
        let after = self.0.partition_point(|point| point.time < time);
        let (Some(a), Some(b)) = (self.0.get(after.saturating_sub(1)), self.0.get(after)) else {
            return self.0.last().map(|last| last.turned);
        };
        let h = b.time - a.time;
        if h <= 0.0 {
            return Some(b.turned);
        }
        let s = ((time - a.time) / h).max(0.0);
        let r = 1.0 - s;
        let ends = r * r * (1.0 + 2.0 * s) * a.turned + s * s * (1.0 + 2.0 * r) * b.turned;
        Some(ends + h * s * r * (r * a.speed - s * b.speed))
    }
}

impl<'a> Control<'a> {
    /// Takes back the memory that [`Self::finish`] gave away, for the next run.
    pub fn take_back(&mut self, past: Past) {
        self.past = past;
    }

    /// Notes the present position of a rotor that can move.
    pub fn note<V: Wide>(&mut self, bank: &Bank<'a, V>) {
        if can_move(self.case.rotor) {
            let state = &bank.here.state;
            let [turned, speed] = [&state.turned, &state.speed].map(|pack| pack.get(self.lane));
            if self.past.0.capacity() == 0 {
                self.past.0.reserve(USUAL);
            }
            self.past.0.push(Point { time: self.time(bank) * 1e-9, turned, speed });
        }
    }

    /// Ends the run and returns its result.
    pub fn finish<V: Wide>(&mut self, bank: &mut Bank<'a, V>, error: Option<RunError>) -> Finished {
        let lane = self.lane;
        let turned = bank.here.state.turned.get(lane);
        let end_angle = self.case.start_angle + turned;
        let mut ledger = None;
        if V::ALONE {
            ledger = self.accounts.take().map(|accounts| accounts.close(self, bank));
        }
        let duration = match error {
            Some(_) => Nanos::from_seconds(self.time(bank) * 1e-9),
            None => self.course.end,
        };
        // Counts are small and whole.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let count = |pack: &V| pack.get(lane) as u64;
        self.note(bank);
        let run = RunOf {
            ended: error,
            duration,
            start_angle: self.case.start_angle,
            end_angle,
            instant_angle: None,
            has_pole: self.case.motor.has_magnet(),
            resolver_angle: end_angle + self.case.sensors.resolver_error,
            moved: bank.outcome.moved.get(lane),
            peak_current: bank.outcome.peak.get(lane),
            ledger,
            work: Work {
                derivatives: count(&bank.outcome.evaluations),
                steps: count(&bank.outcome.steps),
                segments: self.segments,
                events: self.all_events,
            },
        };
        Finished { run, past: std::mem::take(&mut self.past) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_a_constant_acceleration_is_found_between_two_points() {
        let at =
            |time: f64| Point { time, turned: 3.0 * time - 20.0 * time * time, speed: 3.0 - 40.0 * time };
        let past = Past([0.0, 0.01, 0.1].map(at).to_vec());
        for time in [0.0, 0.003, 0.01, 0.06, 0.1] {
            let turned = past.turned(time).expect("points");
            assert!((turned - at(time).turned).abs() < 1e-15, "{time}: {turned}");
        }
        assert_eq!([-1.0, 1.0].map(|time| past.turned(time)), [0.0, 0.1].map(|time| Some(at(time).turned)));
        assert_eq!(Past::default().turned(0.0), None);
    }
}
