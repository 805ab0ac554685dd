//! Location of the end of a mode within an attempted step, and choice of the mode that ends first.

use standstill_numeric::{Mask, Wide};

use super::bank::Bank;
use crate::effect::CoreBranch;
use crate::guard::{Guard, Levels};
use crate::step::hermite::Cubic;
use crate::step::two_derivative::Tried;

/// Smallest share of a step after which a blocked leg's potential is taken to reach its bound: its slope is not
/// known, and a straight line that begins close to the bound says little. A twentieth shortens a step fast enough.
const LEAST_SHARE: f64 = 0.05;

impl<V: Wide> Bank<'_, V> {
    /// Keeps the quantities of a step that [`Self::find_end`] uses.
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
        if self.machine.rotors.is_some() {
            begin.state.turned = self.here.state.turned;
            begin.state.speed = self.here.state.speed;
            to.end.state.turned = tried.end.state.turned;
            to.end.state.speed = tried.end.state.speed;
            to.motion = tried.motion;
        }
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

    /// Finds the mode of a machine that ends first within the step just tried, and the time of its end.
    pub(super) fn find_end(&mut self, lane: usize) {
        let mut first = First { share: f64::INFINITY, guard: None };
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
        // The potential of a terminal may rise by more than what is near to its bound in the shortest time that is a number.
        let nearest = end >= to && guard.is_some() && self.machine.legs.elastance.is_some();
        plan.nearest = plan.nearest & !(1 << lane) | u32::from(nearest) << lane;
        plan.ending_mode[lane] = guard;
    }

    /// Examines the currents of conducting legs and the potentials of the others.
    fn legs_end(&self, lane: usize, first: &mut First) {
        let (tried, one) = (&self.outcome.tried, |pack: &V| pack.get(lane));
        // Of two legs that conduct, both currents end at once.
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

    /// Examines whether the rotor starts, stops, or reaches the end of the brake's play.
    fn motion_ends(&self, lane: usize, first: &mut First) {
        let (tried, slack, one) = (&self.outcome.tried, &self.bounds.slack, |pack: &V| pack.get(lane));
        first.ends(Guard::Motion, tried.motion.get(lane), one(&slack.motion));
        let states = [&self.outcome.begin.state, &tried.end.state];
        let turned = states.map(|state| one(&state.turned));
        let rise = states.map(|state| one(&state.speed) * one(&tried.h));
        let [lower, upper] = self.bounds.stops.each_ref().map(one);
        let ahead = Cubic { value: turned.map(|a| upper - a), slope: rise.map(|s| -s) };
        first.ends(Guard::Stop, ahead, one(&slack.stop));
        first.ends(Guard::Stop, Cubic { value: turned.map(|a| a - lower), slope: rise }, one(&slack.stop));
    }

    /// Examines the comparators.
    fn trips(&self, lane: usize, first: &mut First) {
        let (Some(levels), tried) = (&self.bounds.levels, &self.outcome.tried) else { return };
        // Of this machine alone: code for wide registers belongs into the functions for them.
        let alone = |of: &[[V; 3]; 2]| of.map(|each| each.map(|pack| pack.get(lane)));
        let levels = Levels { link: levels.link.get(lane), phase: alone(&levels.phase) };
        let rail = tried.legs.leg.each_ref().map(|leg| leg.rail.get(lane));
        let margins = levels.margins(&alone(&tried.phases), &alone(&tried.phase_rise), rail);
        for (input, margin) in Levels::<f64>::INPUTS.into_iter().zip(margins) {
            first.ends(Guard::Trip(input), margin, self.bounds.slack.leg[0].get(lane));
        }
    }

    /// Examines the range of the core's flux map, its kinks, and the branch beside it.
    fn core_ends(&self, lane: usize, first: &mut First) {
        let (tried, slack, one) = (&self.outcome.tried, &self.bounds.slack, |pack: &V| pack.get(lane));
        let [begin, end] = tried.margins.each_ref().map(|margins| one(&margins.domain));
        if end < -one(&slack.domain) {
            first.ends(Guard::Domain, straight(begin, end), one(&slack.domain));
        }
        if let Some(sides) = &self.bounds.sides {
            // While the rotor stands, the core's flux changes as the winding's.
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

/// The mode that ends first among those examined so far.
pub struct First {
    /// Share of the step at which the mode ends.
    share: f64,
    guard: Option<Guard>,
}

impl First {
    fn take(&mut self, share: f64, guard: Guard) {
        if share < self.share {
            *self = Self { share, guard: Some(guard) };
        }
    }

    /// Takes the guard as first if its margin over the step is crossed earlier; `slack`: distance below zero at which
    /// it counts as crossed.
    pub fn ends(&mut self, guard: Guard, margin: Cubic<f64>, slack: f64) {
        let to = if margin.value[1] < -slack {
            1.0
        } else if margin.dip() < -slack {
            margin.slope[0] / (margin.slope[0] - margin.slope[1])
        } else {
            return;
        };
        self.take(margin.falls_to(-0.5 * slack, 0.0, to), guard);
    }
}

/// Returns a margin over the step as a straight line, where its slopes are not known.
fn straight(begin: f64, end: f64) -> Cubic<f64> {
    Cubic { value: [begin.max(0.0), end], slope: [end - begin.max(0.0); 2] }
}
