//! Guards of the rotor: it starts, stops, or reaches an end of the brake's play.

use standstill_numeric::Wide;

use super::{Bounds, First, Guard, Margins};
use crate::lanes::bank::Bank;
use crate::physics::machine::Machine;
use crate::step::hermite::Cubic;
use crate::step::two_derivative::{Here, Tried};

impl<V: Wide> Bounds<V> {
    /// Sets the margins of the rotor at a state.
    #[inline(always)]
    pub(super) fn set_rotor_margins(
        &self,
        margins: &mut Margins<V>,
        machine: &Machine<V>,
        Here { state, at, .. }: &Here<V>,
    ) {
        if let Some(rotors) = &machine.rotors {
            let [constant, by_speed, by_torque, by_size] = self.motion;
            let (speed, torque) = (state.speed, at.torque);
            margins.motion =
                constant + by_speed * speed + by_torque * torque + by_size * (torque - rotors.load).abs();
            margins.stop = (self.stops[1] - state.turned).least(state.turned - self.stops[0]);
        }
    }
}

impl<V: Wide> Tried<V> {
    /// Returns the smallest of `least` and of the rotor's margins within the step, with the slack added. Stores the margin of the
    /// motion in [`Self::motion`].
    #[inline(always)]
    pub fn room_of_rotor(&mut self, mut least: V, machine: &Machine<V>, bounds: &Bounds<V>) -> V {
        if machine.rotors.is_some() {
            self.motion = self.torque_margin(machine, bounds);
            let motion = self.margins[1].motion.least(self.motion.dip());
            least = least.least(motion + bounds.slack.motion);
            least = least.least(self.margins[1].stop + bounds.slack.stop);
        }
        least
    }

    /// Returns the margin of the rotor's motion over the step, with a slope computed from that of the torque.
    #[inline(always)]
    fn torque_margin(&self, machine: &Machine<V>, bounds: &Bounds<V>) -> Cubic<V> {
        let [_, by_speed, by_torque, by_size] = bounds.motion;
        let value = [self.margins[0].motion, self.margins[1].motion];
        // The slope of |torque − load| has the sign of torque − load at the end of the step at which this is larger.
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

impl<V: Wide> Bank<'_, V> {
    /// Copies the values of a step that [`Self::motion_ends`] needs later.
    #[inline(always)]
    pub fn keep_motion(&mut self, tried: &Tried<V>) {
        let (begin, to) = (&mut self.outcome.begin, &mut self.outcome.tried);
        if self.machine.rotors.is_some() {
            begin.state.turned = self.here.state.turned;
            begin.state.speed = self.here.state.speed;
            to.end.state.turned = tried.end.state.turned;
            to.end.state.speed = tried.end.state.speed;
            to.motion = tried.motion;
        }
    }

    /// Replaces `first`, the mode that ends first in the step of a lane, if the rotor starts, stops or reaches an end of the brake's play
    /// earlier.
    pub fn motion_ends(&self, lane: usize, first: &mut First) {
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
}
