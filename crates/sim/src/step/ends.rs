//! Ends of modes within a step: margins that fall below zero at its end or between its ends.

use standstill_numeric::Wide;

use super::hermite::Cubic;
use super::two_derivative::{Here, Tried};
use crate::effect::CoreBranch;
use crate::effect::link::LinkStep;
use crate::effect::terminals::floating::Floating;
use crate::guard::{Bounds, Levels, PerGuard};
use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine};

/// Multiple of the slack of a blocked leg's potential (2e-9 of the link's voltage) by which the potential may be
/// beyond its bound where the leg is taken to conduct: the error of conducting late grows with the square.
pub const POTENTIAL_DEEP: f64 = 2e3;

impl<V: Wide> Tried<V> {
    /// Makes an empty record of a step. Trying a step here would compile the whole of it once more.
    pub fn none(here: &Here<V>) -> Self {
        let zero = V::of(0.0);
        Self {
            h: zero,
            legs: Conducting::default(),
            end: *here,
            change: [Change::default(); 2],
            link: LinkStep::default(),
            rotor: None,
            floating: None,
            branch: None,
            phases: [[zero; 3]; 2],
            margins: [PerGuard::all(zero); 2],
            phase_rise: [[zero; 3]; 2],
            torque: [zero; 2],
            motion: Cubic::default(),
            error: zero,
            blocked_at_begin: zero,
            least_margin: zero,
            least_at_mode_end: zero,
        }
    }

    /// Finds the smallest margins within the step and before it, by which modes end.
    #[inline(always)]
    pub(super) fn look_for_ends<const RARE: bool>(&mut self, machine: &Machine<V>, bounds: &Bounds<V>) {
        let mut least = V::of(f64::INFINITY);
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
        if machine.rotors.is_some() {
            self.motion = self.torque_margin(machine, bounds);
            let motion = self.margins[1].motion.least(self.motion.dip());
            least = least.least(motion + bounds.slack.motion);
            least = least.least(self.margins[1].stop + bounds.slack.stop);
        }
        if machine.circuits.have_ends() {
            least = least.least(self.margins[1].domain + bounds.slack.domain);
        }
        if bounds.sides.is_some() {
            for axis in 0..2 {
                least = least.least(self.margins[1].kink[axis] + bounds.slack.kink[axis]);
            }
        }
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

    /// Returns the lanes where a leg's current falls at the beginning of the step and rises at its end.
    #[inline(always)]
    fn may_dip(&self) -> V::Mask {
        let mut turns = V::of(f64::NEG_INFINITY);
        for k in 0..3 {
            let cubic = self.leg_current(k);
            // Positive only where the first slope is negative and the second positive.
            turns = turns.greatest((-cubic.slope[0]).least(cubic.slope[1]));
        }
        turns.above(V::of(0.0))
    }

    /// Returns the smallest of the legs' currents in A at their minima, with the slack added.
    #[inline(always)]
    fn dips(&self, bounds: &Bounds<V>) -> V {
        let mut least = V::of(f64::INFINITY);
        for k in 0..3 {
            let dip = self.leg_current(k).dip();
            least = least.least(dip + bounds.slack.leg[k]);
        }
        least
    }

    /// Returns the smallest of the legs' margins with ringing terminals: of conducting legs the smallest current in
    /// A, of others the smallest distance in V to a bound, where they may reach it.
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

    /// Returns the smallest margin in A of the comparators within the step and at its end, and the smallest at its end of those
    /// that the current had not passed before: a level that an edge jumps over trips where the step begins.
    #[inline(always)]
    fn room_to_trip(&self, levels: &Levels<V>) -> [V; 2] {
        let (zero, far) = (V::of(0.0), V::of(f64::INFINITY));
        let rail = [self.legs.leg[0].rail, self.legs.leg[1].rail, self.legs.leg[2].rail];
        let (mut within, mut at_end) = (far, far);
        for margin in &levels.margins(&self.phases, &self.phase_rise, rail) {
            let [begin, end] = margin.value;
            within = within.least(end.least(margin.dip()));
            at_end = at_end.least(V::choose(begin.above(zero), end, far));
        }
        [within, at_end]
    }

    /// Returns the largest angle in rad by which the ringing modes of a lane turn in the step.
    pub fn turned(&self, lane: usize) -> f64 {
        let squares = self.floating.as_ref().map(|floating| floating.ringing.turned);
        let squares = squares.map_or([0.0; 2], |squares| squares.map(|square| square.get(lane)));
        squares[0].max(squares[1]).sqrt()
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

    /// Returns the margin of the rotor's motion over the step, as far as it follows from the torque.
    #[inline(always)]
    fn torque_margin(&self, machine: &Machine<V>, bounds: &Bounds<V>) -> Cubic<V> {
        let [_, by_speed, by_torque, by_size] = bounds.motion;
        let value = [self.margins[0].motion, self.margins[1].motion];
        // The magnitude's slope has the sign of the torque beside the load, where that is larger.
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let load = machine.rotors.as_ref().map_or(zero, |rotors| rotors.load);
        let [begin, end] = [self.torque[0] - load, self.torque[1] - load];
        let larger = V::choose(begin.abs().above(end.abs()), begin, end);
        let sign = V::choose(larger.above(zero), one, -one);
        let Some(rotor) = &self.rotor else { return Cubic { value, slope: [zero; 2] } };
        let slope = pair!(end => {
            let rise = rotor.torque_rise[end] * self.h;
            by_torque * rise + by_size * sign * rise + by_speed * rotor.acceleration[end] * self.h
        });
        Cubic { value, slope }
    }
}
