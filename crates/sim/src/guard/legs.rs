//! Guards of the legs: a current reaches zero, or the potential of a blocked or floating leg reaches a rail.

use standstill_numeric::{Mask, Wide};

use super::{Bounds, First, Guard, Margins, straight};
use crate::effect::terminals::floating::Floating;
use crate::lanes::bank::Bank;
use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine};
use crate::physics::state::State;
use crate::step::hermite::Cubic;
use crate::step::two_derivative::Tried;

/// Lower limit of the share of a step at which a blocked leg's potential is estimated to reach its bound. The slope of the
/// potential is unknown, and a straight line that begins close to the bound is a poor estimate. With this limit, repeated
/// attempts still shorten the step fast enough.
const LEAST_SHARE: f64 = 0.05;

/// Multiple of the slack (2e-9 of the link's voltage) by which the potential of a blocked leg may have passed its bound
/// when the leg begins to conduct. The error caused by this late beginning grows with the square of the distance.
pub const POTENTIAL_DEEP: f64 = 2e3;

impl<V: Wide> Bounds<V> {
    /// Sets the margins of the legs at a state.
    #[inline(always)]
    pub(super) fn set_leg_margins<const RARE: bool>(
        margins: &mut Margins<V>,
        machine: &Machine<V>,
        legs: &Conducting<V>,
        state: &State<V>,
        change: &Change<V>,
        current: &[V; 3],
    ) {
        let far = V::of(f64::INFINITY);
        for k in 0..3 {
            margins.leg[k] = V::choose(legs.flows[k], legs.leg[k].direction * current[k], far);
        }
        let capacitive = machine.legs.elastance_if::<RARE>().is_some();
        if capacitive {
            for k in 0..3 {
                let [low, high] = machine.legs.range(k, &legs.on[k]).at(state.link);
                let room = (state.potential[k] - low).least(high - state.potential[k]);
                margins.leg[k] = V::choose(legs.flows[k], margins.leg[k], room);
            }
        }
        let [low, high] = machine.legs.range_of_blocked(legs).at(state.link);
        let potential = change.blocked_potential;
        let none_is_blocked = V::Mask::of_bits(if capacitive { u32::MAX } else { 0 });
        let all_flow = none_is_blocked | legs.flows[0] & legs.flows[1] & legs.flows[2];
        // Idle legs stay idle unless the link's voltage or an induced voltage changes.
        let blocked = V::choose(legs.idle | all_flow, far, (potential - low).least(high - potential));
        margins.blocked = blocked;
        if (machine.drifts_if::<RARE>() || machine.links.vary()) && V::any(legs.idle) {
            let idle = room_of_idle::<RARE, _>(machine, legs, state, change);
            margins.blocked = V::choose(legs.idle, idle, blocked);
        }
    }
}

/// Returns the margin in V of machines whose legs are all blocked. The induced voltages determine the differences of the
/// potentials; the common part of the potentials is unknown and taken halfway between the bounds.
#[inline(always)]
fn room_of_idle<const RARE: bool, V: Wide>(
    machine: &Machine<V>,
    legs: &Conducting<V>,
    state: &State<V>,
    change: &Change<V>,
) -> V {
    let mut induced = change.flux;
    if let Some(short) = machine.shorted_if::<RARE>() {
        induced = induced - short.pull(state);
    }
    let held = machine.legs.phases(induced);
    let (mut down, mut up) = (V::of(f64::INFINITY), V::of(f64::INFINITY));
    for (k, held) in held.into_iter().enumerate() {
        let [low, high] = machine.legs.range(k, &legs.on[k]).at(state.link);
        down = down.least(held - low);
        up = up.least(high - held);
    }
    (up + down) * 0.5
}

impl<V: Wide> Tried<V> {
    /// Returns three margins of the legs with the slack added. The first is the smallest of `least` and of all margins within the step and
    /// at its end. The second is the smallest margin at the end, with the larger slack for a step that was cut at the end of a mode. The
    /// third is the margin of the blocked leg at the beginning.
    #[inline(always)]
    pub fn room_of_legs<const RARE: bool>(&self, mut least: V, bounds: &Bounds<V>) -> [V; 3] {
        let (mut slack, mut ended) = (bounds.slack.leg, [bounds.ended; 3]);
        if RARE && self.floating.is_some() {
            for k in 0..3 {
                slack[k] = V::choose(self.legs.flows[k], slack[k], bounds.slack.blocked);
                ended[k] = V::choose(self.legs.flows[k], ended[k], bounds.slack.blocked * POTENTIAL_DEEP);
            }
        }
        for k in 0..3 {
            least = least.least(self.margins[1].leg[k] + slack[k]);
        }
        let blocked = self.margins[1].blocked;
        least = least.least(blocked + bounds.slack.blocked);
        let at_begin = self.margins[0].blocked + bounds.slack.blocked;
        let mut at_mode_end = blocked + bounds.slack.blocked * POTENTIAL_DEEP;
        for k in 0..3 {
            at_mode_end = at_mode_end.least(self.margins[1].leg[k] + ended[k]);
        }
        if RARE && let Some(floating) = &self.floating {
            least = least.least(self.dips_or_swings(floating, bounds));
        } else if V::any(self.may_dip()) {
            least = least.least(self.dips(bounds));
        }
        [least, at_mode_end, at_begin]
    }

    /// Returns the lanes in which a leg's current falls at the beginning of the step and rises at its end, so that it
    /// may dip to zero between.
    #[inline(always)]
    fn may_dip(&self) -> V::Mask {
        let mut turns = V::of(f64::NEG_INFINITY);
        for k in 0..3 {
            let cubic = self.leg_current(k);
            // Positive only if the first slope is negative and the second positive.
            turns = turns.greatest((-cubic.slope[0]).least(cubic.slope[1]));
        }
        turns.above(V::of(0.0))
    }

    /// Returns the smallest of the legs' currents in A at their minima within the step, with the slack added.
    #[inline(always)]
    fn dips(&self, bounds: &Bounds<V>) -> V {
        let mut least = V::of(f64::INFINITY);
        for k in 0..3 {
            let dip = self.leg_current(k).dip();
            least = least.least(dip + bounds.slack.leg[k]);
        }
        least
    }

    /// Returns the smallest margin within the step of legs with ringing terminals, with the slack added: currents in A of conducting
    /// legs, and distances in V of the other legs' potentials from their bounds. Legs whose mode certainly lasts are left out.
    #[inline(always)]
    fn dips_or_swings(&self, floating: &Floating<V>, bounds: &Bounds<V>) -> V {
        let far = V::of(f64::INFINITY);
        let mut least = far;
        for k in 0..3 {
            let flows = self.legs.flows[k];
            let dip = self.leg_current(k).dip() + bounds.slack.leg[k];
            let sides = floating.sides(k);
            let [low, high] = pair!(of => sides[of].dip() + bounds.slack.blocked);
            let both = V::choose(flows, dip, low.least(high));
            least = least.least(V::choose(floating.safe[k], far, both));
        }
        least
    }

    /// Returns the current of a leg in A over the step, positive in the direction of its mode.
    #[inline(always)]
    pub fn leg_current(&self, leg: usize) -> Cubic<V> {
        let direction = self.legs.leg[leg].direction;
        Cubic {
            value: [direction * self.phases[0][leg], direction * self.phases[1][leg]],
            slope: [direction * self.phase_rise[0][leg], direction * self.phase_rise[1][leg]],
        }
    }
}

impl<V: Wide> Bank<'_, V> {
    /// Replaces `first`, the mode that ends first in the step of a lane, if a conducting leg's current reaches zero or another leg's
    /// potential reaches a bound earlier.
    pub fn legs_end(&self, lane: usize, first: &mut First) {
        let (tried, one) = (&self.outcome.tried, |pack: &V| pack.get(lane));
        // If exactly two legs conduct, both currents reach zero at the same time: one guard suffices.
        let legs = &self.machine.legs;
        let safe = |k: usize| tried.floating.is_some_and(|floating| floating.safe[k].bits() >> lane & 1 == 1);
        let conduct = (0..3).filter(|k| legs.direction(lane, *k) != 0.0 && !safe(*k));
        let both = conduct.clone().count() == 2 && tried.floating.is_none();
        for k in conduct.take(if both { 1 } else { 3 }) {
            let direction = legs.direction(lane, k);
            let value = [0, 1].map(|end: usize| direction * one(&tried.phases[end][k]));
            let slope = [0, 1].map(|end: usize| direction * one(&tried.phase_rise[end][k]));
            first.ends(Guard::Leg(k), Cubic { value, slope }, self.bounds.slack.leg[k].get(lane));
        }
        if let Some(floating) = &tried.floating {
            for k in (0..3).filter(|k| legs.direction(lane, *k) == 0.0 && !safe(*k)) {
                for side in floating.sides_of(k, lane) {
                    first.ends(Guard::Leg(k), side, self.bounds.slack.blocked.get(lane));
                }
            }
        }
        let margin = straight(one(&tried.margins[0].blocked), one(&tried.margins[1].blocked));
        let slack_of_blocked = self.bounds.slack.blocked.get(lane);
        if margin.value[1] < -slack_of_blocked {
            let share = margin.falls_to(-0.5 * slack_of_blocked, 0.0, 1.0).max(LEAST_SHARE);
            first.take(share, Guard::Blocked);
        }
    }
}
