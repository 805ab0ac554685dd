//! Another way to take the same step: the method of Dormand and Prince over the same equations, one machine at a time.
//!
//! It shares neither the quadrature nor the prediction nor the error estimate of the engine's own step, so it can tell
//! whether that step is right. It evaluates the core seven times a step.

use standstill_numeric::Wide;
use standstill_plant::MOST_CELLS;

use super::corrections::{Ends, settle};
use super::error::Accuracy;
use super::ringing::{End, Ringing, Start};
use super::two_derivative::{Here, Tried};
use crate::effect::Begin;
use crate::effect::link::LinkStep;
use crate::physics::bounds::Bounds;
use crate::physics::legs::Conducting;
use crate::physics::machine::Machine;
use crate::physics::memory::Away;
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::dormand_prince::Attempt;

/// Numbers of a state.
const NUMBERS: usize = 16;

/// A speed in rad/s, and a link voltage in V, that are off by this many times the tolerance of the angle or the flux matter as
/// much within a tenth of a millisecond.
const PER_SECOND: f64 = 1e4;

fn numbers<V: Wide>(state: &State<V>, pinned: &Away<V>) -> [V; NUMBERS] {
    let State { flux, turned, speed, link, lagging, potential: [a, b, c] } = *state;
    let [p, q, r] = pinned;
    [flux.x, flux.y, turned, speed, link, lagging.d, lagging.q, a, b, c, p.x, p.y, q.x, q.y, r.x, r.y]
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
        let mut pinned = [Plane::new(zero, zero); MOST_CELLS];
        if let Some(memory) = &machine.memory {
            pinned = memory.away_at(here.state.flux, None).map(|away| here.state.flux - away);
        }
        let attempt = Attempt::new(numbers(&here.state, &pinned), h).take(
            |time, y| {
                let (slope, pinned) = slope(machine, legs, time, &state_of(machine, time, y), &pinned_of(y));
                numbers(&slope, &pinned)
            },
            begin,
        );
        let mut state = state_of(machine, until * 1e-9, &attempt.end);
        let elastic = pinned_of(&attempt.end).map(|pinned| state.flux - pinned);
        let iron = machine.memory.as_ref().map(|memory| memory.iron(&elastic));
        let away = iron.map(|iron| (elastic, iron.tangent));
        let mut at = machine.operating(&state, iron.as_ref());
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
            let pinned = pinned_of(&attempt.end);
            let rise = |time, state| slope(machine, legs, time, state, &pinned).0.link;
            ends.link_rise = [rise(begin, &here.state), rise(until * 1e-9, &state)];
        }
        if let Some(rotors) = &machine.rotors {
            let core = |at: Plane<V>, current: Plane<V>| {
                [at, iron.as_ref().map_or(current, |iron| iron.core(current, at - flux))]
            };
            let change = [core(flux, current), core(state.flux, at.current)];
            at.torque = at.torque + rotors.torque_change(&at, change[0], change[1]);
            let first = machine.memory.as_ref().map(|memory| memory.iron_here(here.state.flux));
            ends.acceleration = [
                rotors.acceleration(here.at.torque, here.state.speed),
                rotors.acceleration(at.torque, state.speed),
            ];
            ends.torque_rise = [
                rotors.torque_rise(&here.state, &here.at, &ends.change[0], first.as_ref()),
                rotors.torque_rise(&state, &at, &ends.change[1], iron.as_ref()),
            ];
        }
        let (flux, angle) = (1.0 / accuracy.per_flux.get(0), 1.0 / accuracy.per_angle.get(0));
        let volt = flux * PER_SECOND;
        let [a, b] = [angle, volt];
        let tolerance =
            [flux, flux, a, a * PER_SECOND, b, flux, flux, b, b, b, flux, flux, flux, flux, flux, flux];
        let error = attempt.error(&tolerance);
        let mut ringing = None;
        if machine.legs.elastance.is_some() {
            state.potential = machine.legs.potentials(legs, state.potential, state.link, at.current);
        }
        let end = Here { time: until, state, at, source };
        let rises =
            if machine.links.storage.is_some() { ends.link_rise } else { [here.source.rise, source.rise] };
        ends.link_rise = rises;
        let area = machine.links.area(h, here.source, source);
        let link = LinkStep::between([here.state.link, state.link], rises, area);
        let memory = machine.memory.as_ref();
        let from = Begin { h, machine, memory, legs, here, change: &ends.change[0] };
        if let Some(start) = Start::of(&from, &link) {
            let way = state.flux - here.state.flux;
            let last = End::of(&legs.terminals, &at, &ends.change[1], link.end(), way);
            ringing = Some(Ringing::between(start.modes, h, start.floating, [&start.end, &last]));
        }
        Self::between::<true>(machine, bounds, legs, here, end, h, ends, ringing, away, error)
    }
}

/// The state that the numbers are at a time in s. Without a capacitor the link follows its source.
fn state_of<V: Wide>(machine: &Machine<V>, time: V, y: &[V; NUMBERS]) -> State<V> {
    let [x, y, turned, speed, mut link, d, q, a, b, c, ..] = *y;
    if machine.links.storage.is_none() {
        link = machine.links.source(time).voltage;
    }
    let lagging = standstill_interface::Dq::new(d, q);
    State { flux: Plane::new(x, y), turned, speed, link, lagging, potential: [a, b, c] }
}

/// What is pinned of the iron's fluxes, in Wb.
fn pinned_of<V: Wide>(y: &[V; NUMBERS]) -> Away<V> {
    [0, 1, 2].map(|k: usize| Plane::new(y[10 + 2 * k], y[11 + 2 * k]))
}

/// How a state, and what is pinned of the iron's fluxes, change at a time in s.
fn slope<V: Wide>(
    machine: &Machine<V>,
    legs: &Conducting<V>,
    time: V,
    state: &State<V>,
    pinned: &Away<V>,
) -> (State<V>, Away<V>) {
    let zero = V::of(0.0);
    let away = pinned.map(|pinned| state.flux - pinned);
    let iron = machine.memory.as_ref().map(|memory| memory.iron(&away));
    let at = machine.operating(state, iron.as_ref());
    let rise = machine.change::<true>(legs, &at, state).flux;
    let none = [Plane::new(zero, zero); MOST_CELLS];
    let moves = machine.memory.as_ref().map_or(none, |memory| memory.pinned_rise(&away, rise));
    let mut slope = State {
        flux: rise,
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
        let source = machine.links.source(time).voltage;
        slope.link = storage.rise(&legs.terminals.rail, state.link, source, at.current);
    }
    if let Some(eddies) = machine.circuits.eddies() {
        slope.lagging = at.lag * eddies.rate;
    }
    (slope, moves)
}
