//! Another way to take the same step: the method of Dormand and Prince over the same equations, one machine at a time.
//!
//! It shares neither the quadrature nor the prediction nor the error estimate of the engine's own step, so it can tell
//! whether that step is right. It evaluates the core seven times a step.

use standstill_numeric::Wide;

use super::corrections::{Ends, settle};
use super::ringing::{End, Ringing, Start};
use super::two_derivative::{Accuracy, Here, Tried};
use crate::physics::bounds::Bounds;
use crate::physics::legs::Conducting;
use crate::physics::machine::Machine;
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::dormand_prince::Attempt;

/// Numbers of a state.
const NUMBERS: usize = 10;

/// A speed in rad/s, and a link voltage in V, that are off by this many times the tolerance of the angle or the flux matter as
/// much within a tenth of a millisecond.
const PER_SECOND: f64 = 1e4;

fn numbers<V: Wide>(state: &State<V>) -> [V; NUMBERS] {
    let State { flux, turned, speed, link, lagging, potential: [a, b, c] } = *state;
    [flux.x, flux.y, turned, speed, link, lagging.d, lagging.q, a, b, c]
}

impl<V: Wide> Tried<V> {
    /// Tries a step to times in ns.
    pub fn refereed(
        machine: &Machine<V>,
        bounds: &Bounds<V>,
        legs: &Conducting<V>,
        here: &Here<V>,
        until: V,
        accuracy: &Accuracy<V>,
    ) -> Self {
        let zero = V::of(0.0);
        let h = (until - here.time) * 1e-9;
        let begin = here.time * 1e-9;
        let attempt = Attempt::new(numbers(&here.state), h)
            .take(|time, y| numbers(&slope(machine, legs, time, &state_of(machine, time, y))), begin);
        let mut state = state_of(machine, until * 1e-9, &attempt.end);
        let mut at = machine.operating(&state);
        let (flux, current) = (state.flux, at.current);
        settle(legs, &mut state.flux, &mut at);
        let mut ends = Ends {
            change: [machine.change::<true>(legs, &here.at, &here.state); 2],
            link_rise: [zero; 2],
            acceleration: [zero; 2],
            torque_rise: [zero; 2],
        };
        ends.change[1] = machine.change::<true>(legs, &at, &state);
        let source = machine.links.source(until * 1e-9);
        if machine.links.storage.is_some() {
            let rise = |time, state| slope(machine, legs, time, state).link;
            ends.link_rise = [rise(begin, &here.state), rise(until * 1e-9, &state)];
        }
        if let Some(rotors) = &machine.rotors {
            at.torque = at.torque + rotors.torque_change(&at, [flux, current], [state.flux, at.current]);
            ends.acceleration = [
                rotors.acceleration(here.at.torque, here.state.speed),
                rotors.acceleration(at.torque, state.speed),
            ];
            ends.torque_rise = [
                rotors.torque_rise(&here.state, &here.at, &ends.change[0]),
                rotors.torque_rise(&state, &at, &ends.change[1]),
            ];
        }
        let (flux, angle) = (1.0 / accuracy.per_flux.get(0), 1.0 / accuracy.per_angle.get(0));
        let volt = flux * PER_SECOND;
        let tolerance = [flux, flux, angle, angle * PER_SECOND, volt, flux, flux, volt, volt, volt];
        let error = attempt.error(&tolerance);
        let mut ringing = None;
        if machine.legs.elastance.is_some() {
            state.potential = machine.legs.potentials(legs, state.potential, state.link, at.current);
        }
        let end = Here { time: until, state, at, source };
        let rises =
            if machine.links.storage.is_some() { ends.link_rise } else { [here.source.rise, source.rise] };
        ends.link_rise = rises;
        let links = [here.state.link, state.link];
        let area = machine.links.area(h, here.source, source);
        if let Some(start) = Start::of(machine, legs, here, &ends.change[0], links, rises, area, h) {
            let terminals = &legs.terminals;
            let [force, force_rise] = [
                terminals.rail * state.link + terminals.offset - at.current.through(terminals.resistance),
                terminals.rail * rises[1] - ends.change[1].current.through(terminals.resistance),
            ];
            let last = End {
                force,
                force_rise,
                current: at.current,
                current_rise: ends.change[1].current,
                flux_rise: ends.change[1].flux,
                flux: state.flux - here.state.flux,
            };
            ringing = Some(Ringing::between(start.modes, h, start.floating, [&start.end, &last]));
        }
        Self::between::<true>(machine, bounds, legs, here, end, h, ends, ringing, error)
    }
}

/// The state that the numbers are at a time in s. Without a capacitor the link follows its source.
fn state_of<V: Wide>(machine: &Machine<V>, time: V, y: &[V; NUMBERS]) -> State<V> {
    let [x, y, turned, speed, mut link, d, q, a, b, c] = *y;
    if machine.links.storage.is_none() {
        link = machine.links.source(time).voltage;
    }
    let lagging = standstill_interface::Dq::new(d, q);
    State { flux: Plane::new(x, y), turned, speed, link, lagging, potential: [a, b, c] }
}

/// How a state changes at a time in s.
fn slope<V: Wide>(machine: &Machine<V>, legs: &Conducting<V>, time: V, state: &State<V>) -> State<V> {
    let zero = V::of(0.0);
    let at = machine.operating(state);
    let mut slope = State {
        flux: machine.change::<true>(legs, &at, state).flux,
        turned: zero,
        speed: zero,
        link: zero,
        lagging: standstill_interface::Dq::new(zero, zero),
        potential: machine.legs.charged(legs, at.current),
    };
    if let Some(rotors) = &machine.rotors {
        slope.turned = state.speed * rotors.moving;
        slope.speed = rotors.acceleration(at.torque, state.speed);
    }
    if let Some(storage) = &machine.links.storage {
        let taken = legs.terminals.rail.dot(at.current) * storage.elastance * 1.5;
        slope.link = (machine.links.source(time).voltage - state.link) * storage.rate - taken;
    }
    if let Some(eddies) = machine.circuits.eddies() {
        slope.lagging = at.lag * eddies.rate;
    }
    slope
}
