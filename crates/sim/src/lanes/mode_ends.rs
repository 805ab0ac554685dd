//! Location of the end of a mode within an attempted step, and choice of the mode that ends first.

use standstill_numeric::Wide;

use super::bank::Bank;
use crate::guard::{First, Guard};
use crate::step::two_derivative::Tried;

impl<V: Wide> Bank<'_, V> {
    /// Copies the values of a step that [`Self::find_end`] needs later.
    #[inline(always)]
    pub(super) fn keep_for_ends<const RARE: bool>(&mut self, tried: &Tried<V>) {
        let (begin, to) = (&mut self.outcome.begin, &mut self.outcome.tried);
        begin.time = self.here.time;
        to.h = tried.h;
        to.end.time = tried.end.time;
        to.phases = tried.phases;
        to.phase_rise = tried.phase_rise;
        for end in 0..2 {
            to.margins[end].blocked = tried.margins[end].blocked;
        }
        if self.bounds.levels.is_some() {
            to.legs.leg = tried.legs.leg;
        }
        if RARE {
            to.floating = tried.floating;
            to.branch = tried.branch;
        }
        self.keep_motion(tried);
        self.keep_core(tried);
    }

    /// Finds which mode of a machine ends first within the last attempted step, and at what time.
    pub(super) fn find_end(&mut self, lane: usize) {
        let mut first = First::NONE;
        self.legs_end(lane, &mut first);
        if self.machine.rotors.is_some() {
            self.motion_ends(lane, &mut first);
        }
        self.core_ends(lane, &mut first);
        self.trips(lane, &mut first);
        let First { share, guard } = first;
        let share = if guard.is_some() { share } else { 1.0 };
        let (from, to) = (self.outcome.begin.time.get(lane), self.outcome.tried.end.time.get(lane));
        let end = (from + (to - from) * share).min(to);
        let plan = &mut self.schedule;
        plan.mode_end.put(lane, end);
        plan.to_mode_end |= 1 << lane;
        // Between two neighbouring representable times, a terminal's potential may pass its bound by more than the tolerance. A blocked
        // leg's potential jumps where a step evaluates the core anew, by the error of the previous step's prediction.
        let jumps = self.machine.legs.elastance.is_some() || guard == Some(Guard::Blocked);
        let nearest = end >= to && guard.is_some() && jumps;
        plan.nearest = plan.nearest & !(1 << lane) | u32::from(nearest) << lane;
        plan.ending_mode[lane] = guard;
    }
}
