//! Guards of the comparators: the distances of the currents from the levels at which the comparators trip.

use standstill_numeric::Wide;

use super::{First, Guard};
use crate::lanes::bank::Bank;
use crate::sensing::Input;
use crate::step::hermite::Cubic;
use crate::step::two_derivative::Tried;

/// Currents in A at which the comparators trip; infinite for comparators that are absent or disabled.
#[derive(Clone, Copy, Debug)]
pub struct Levels<V> {
    /// Level of the current in the DC link.
    pub link: V,
    /// Levels of each phase's current into the motor and out of it.
    pub phase: [[V; 3]; 2],
    /// 1 if the comparators of the phases measure at low-side shunts, else 0. A low-side shunt carries a leg's current only
    /// while the lower device conducts.
    pub below: V,
}

/// Returns the sum of `of` over the legs at the positive rail: the rail's current in A, or the slope of this current.
/// `rail` is 1 for a leg at the positive rail, else 0.
#[inline(always)]
fn drawn<V: Wide>(rail: [V; 3], of: [V; 3]) -> V {
    rail[0] * of[0] + rail[1] * of[1] + rail[2] * of[2]
}

impl<V: Wide> Levels<V> {
    /// Returns the margins in A of all comparators over a step, as cubics: link, phases into the motor, phases out of it. `phases` contains
    /// the legs' currents in A at both ends. `rise` contains the slopes of these currents per step. `rail` is 1 for a leg at the positive
    /// rail, else 0. `lower` is 1 for a leg whose lower device conducts, else 0.
    #[inline(always)]
    pub fn margins(
        &self,
        phases: &[[V; 3]; 2],
        rise: &[[V; 3]; 2],
        [rail, lower]: [[V; 3]; 2],
    ) -> [Cubic<V>; 7] {
        let current = [drawn(rail, phases[0]), drawn(rail, phases[1])];
        let link = Cubic {
            value: [self.link - current[0], self.link - current[1]],
            slope: [-drawn(rail, rise[0]), -drawn(rail, rise[1])],
        };
        let mut margins = [link; 7];
        for k in 0..3 {
            let [into, out] = [self.phase[0][k], self.phase[1][k]];
            let hidden = self.below * (V::of(1.0) - lower[k]);
            let seen = V::of(1.0) - hidden;
            let (value, slope) = (pair!(end => phases[end][k] * seen), pair!(end => rise[end][k] * seen));
            margins[1 + k] =
                Cubic { value: [into - value[0], into - value[1]], slope: [-slope[0], -slope[1]] };
            margins[4 + k] = Cubic { value: [out + value[0], out + value[1]], slope };
        }
        margins
    }

    /// The comparators in the order of [`Self::margins`].
    pub const INPUTS: [Input; 7] = [
        Input::Link,
        Input::Into(0),
        Input::Into(1),
        Input::Into(2),
        Input::Out(0),
        Input::Out(1),
        Input::Out(2),
    ];

    /// Sets the level of each comparator of a lane. `below` is true if the comparators of the phases measure at low-side
    /// shunts.
    pub fn put(&mut self, lane: usize, below: bool, level: impl Fn(Input) -> f64) {
        self.below.put(lane, f64::from(u8::from(below)));
        self.link.put(lane, level(Input::Link));
        for k in 0..3 {
            self.phase[0][k].put(lane, level(Input::Into(k)));
            self.phase[1][k].put(lane, level(Input::Out(k)));
        }
    }
}

impl<V: Wide> Tried<V> {
    /// Returns two margins in A: the smallest of all comparators within the step and at its end, and the smallest at its end
    /// of the comparators whose level the current had not passed at the beginning. (A comparator whose current jumps past
    /// its level at a gate edge trips at the beginning of the step.)
    #[inline(always)]
    pub fn room_to_trip(&self, levels: &Levels<V>) -> [V; 2] {
        let (zero, far) = (V::of(0.0), V::of(f64::INFINITY));
        let (legs, half, one) = (&self.legs, V::of(0.5), V::of(1.0));
        let rail = [legs.leg[0].rail, legs.leg[1].rail, legs.leg[2].rail];
        let lower = three!(k => V::only(legs.flows[k] & !rail[k].above(half), one));
        let (mut within, mut at_end) = (far, far);
        for margin in &levels.margins(&self.phases, &self.phase_rise, [rail, lower]) {
            let [begin, end] = margin.value;
            within = within.least(end.least(margin.dip()));
            at_end = at_end.least(V::choose(begin.above(zero), end, far));
        }
        [within, at_end]
    }
}

impl<V: Wide> Bank<'_, V> {
    /// Replaces `first`, the mode that ends first in the step of a lane, if a comparator trips earlier.
    pub fn trips(&self, lane: usize, first: &mut First) {
        let (Some(levels), tried) = (&self.bounds.levels, &self.outcome.tried) else { return };
        // With scalars of this machine alone, because this function is not compiled for wide registers.
        let alone = |of: &[[V; 3]; 2]| of.map(|each| each.map(|pack| pack.get(lane)));
        let levels = Levels {
            link: levels.link.get(lane),
            phase: alone(&levels.phase),
            below: levels.below.get(lane),
        };
        let legs = tried.legs.leg.each_ref().map(|leg| [leg.rail.get(lane), leg.direction.get(lane)]);
        let lower = legs.map(|[rail, direction]| if rail < 0.5 && direction != 0.0 { 1.0 } else { 0.0 });
        let rail = legs.map(|[rail, _]| rail);
        let margins = levels.margins(&alone(&tried.phases), &alone(&tried.phase_rise), [rail, lower]);
        for (input, margin) in Levels::<f64>::INPUTS.into_iter().zip(margins) {
            first.ends(Guard::Trip(input), margin, self.bounds.slack.leg[0].get(lane));
        }
    }
}
