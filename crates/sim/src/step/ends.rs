//! Search for the ends of modes within a step: margins that are negative at its end or between its ends.

use standstill_numeric::Wide;

use super::two_derivative::{Here, Tried};
use crate::guard::Bounds;
use crate::physics::machine::Machine;

impl<V: Wide> Tried<V> {
    /// Makes an empty record of a step. A call of [`Self::new`] with zero length would compile the code of a step a second time.
    pub fn none(here: &Here<V>) -> Self {
        Self { end: *here, ..Self::default() }
    }

    /// Computes the smallest margins of the modes within the step, at its beginning and at its end.
    #[inline(always)]
    pub(super) fn look_for_ends<const RARE: bool>(&mut self, machine: &Machine<V>, bounds: &Bounds<V>) {
        let [least, mut at_mode_end, at_begin] = self.room_of_legs::<RARE>(V::of(f64::INFINITY), bounds);
        let least = self.room_of_rotor(least, machine, bounds);
        let mut least = self.room_of_core(least, machine, bounds);
        if let Some(levels) = &bounds.levels {
            let [within, at_end] = self.room_to_trip(levels);
            least = least.least(within + bounds.slack.leg[0]);
            at_mode_end = at_mode_end.least(at_end + bounds.ended);
        }
        if let (Some(branch), Some(step)) = (machine.branch_if::<RARE>(), &self.branch) {
            let [within, at_end] = branch.room(step);
            least = least.least(within);
            at_mode_end = at_mode_end.least(at_end);
        }
        (self.least_margin, self.blocked_at_begin, self.least_at_mode_end) = (least, at_begin, at_mode_end);
    }

    /// Returns the largest angle in rad by which an oscillation of a lane turns during the step.
    pub fn turned(&self, lane: usize) -> f64 {
        let squares = self.floating.as_ref().map(|floating| floating.ringing.turned);
        let squares = squares.map_or([0.0; 2], |squares| squares.map(|square| square.get(lane)));
        squares[0].max(squares[1]).sqrt()
    }
}
