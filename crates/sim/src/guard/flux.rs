//! Guards of the core: the end of its flux map, its kinks at zero flux, and the modes of the parallel play cells.

use standstill_numeric::Wide;

use super::{Bounds, First, Guard, Margins, straight};
use crate::lanes::bank::Bank;
use crate::physics::machine::Machine;
use crate::step::hermite::Cubic;
use crate::step::two_derivative::{Here, Tried};

impl<V: Wide> Bounds<V> {
    /// Sets the margins of the core at a state.
    #[inline(always)]
    pub(super) fn set_core_margins(
        &self,
        margins: &mut Margins<V>,
        machine: &Machine<V>,
        Here { at, .. }: &Here<V>,
    ) {
        if machine.circuits.have_ends() {
            margins.domain = machine.circuits.room(at.core_current, &machine.cores);
        }
        if let Some([d, q]) = &self.sides {
            margins.kink[0] = d[0] * at.core_flux.d + d[1];
            margins.kink[1] = q[0] * at.core_flux.q + q[1];
        }
    }
}

impl<V: Wide> Tried<V> {
    /// Returns the smallest of `least` and of the margins of flux map and kinks at the end of the step, with the slack added.
    #[inline(always)]
    pub fn room_of_core(&self, mut least: V, machine: &Machine<V>, bounds: &Bounds<V>) -> V {
        if machine.circuits.have_ends() {
            least = least.least(self.margins[1].domain + bounds.slack.domain);
        }
        if bounds.sides.is_some() {
            for axis in 0..2 {
                least = least.least(self.margins[1].kink[axis] + bounds.slack.kink[axis]);
            }
        }
        least
    }
}

impl<V: Wide> Bank<'_, V> {
    /// Copies the values of a step that [`Self::core_ends`] needs later.
    #[inline(always)]
    pub fn keep_core(&mut self, tried: &Tried<V>) {
        let to = &mut self.outcome.tried;
        if self.machine.circuits.have_ends() {
            for end in 0..2 {
                to.margins[end].domain = tried.margins[end].domain;
            }
        }
        if self.bounds.sides.is_some() {
            to.change = tried.change;
            for end in 0..2 {
                to.margins[end].kink[0] = tried.margins[end].kink[0];
                to.margins[end].kink[1] = tried.margins[end].kink[1];
            }
        }
    }

    /// Replaces `first`, the mode that ends first in the step of a lane, if the end of the flux map, a kink of the core or the end of a
    /// play cell's mode is reached earlier.
    pub fn core_ends(&self, lane: usize, first: &mut First) {
        let (tried, slack, one) = (&self.outcome.tried, &self.bounds.slack, |pack: &V| pack.get(lane));
        let [begin, end] = tried.margins.each_ref().map(|margins| one(&margins.domain));
        if end < -one(&slack.domain) {
            first.ends(Guard::Domain, straight(begin, end), one(&slack.domain));
        }
        if let Some(sides) = &self.bounds.sides {
            // While the rotor stands still, the slope of the core's flux is that of the winding's.
            let rise = [0, 1].map(|end: usize| {
                let flux = &tried.change[end].flux;
                [one(&flux.x), one(&flux.y)].map(|rise| rise * one(&tried.h))
            });
            for axis in 0..2 {
                let value = tried.margins.each_ref().map(|margins| one(&margins.kink[axis]));
                let slack = one(&slack.kink[axis]);
                if value[1] < -slack {
                    let side = one(&sides[axis][0]);
                    let slope = rise.map(|rise| side * rise[axis]);
                    let mut cubic = Cubic { value: [value[0].max(0.0), value[1]], slope };
                    if self.machine.rotors.is_some() {
                        cubic = straight(value[0], value[1]);
                    }
                    first.ends(Guard::Kink(axis), cubic, slack);
                }
            }
        }
        if let (Some(branch), Some(step)) = (&self.machine.branch, &tried.branch) {
            branch.ends(step, lane, first);
        }
    }
}
