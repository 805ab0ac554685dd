//! Another way to take the same step: the method of Dormand and Prince over the same equations, one machine at a time.
//!
//! It shares neither the quadrature nor the prediction nor the error estimate of the engine's own step, so it can tell
//! whether that step is right. It evaluates the core seven times a step.

use standstill_interface::Dq;
use standstill_numeric::Wide;
use standstill_plant::MOST_CELLS;

use super::error::Accuracy;
use super::two_derivative::{Here, Parts, Tried};
use crate::effect::play::Elastic;
use crate::effect::rotor::RotorStep;
use crate::effect::terminals::{TerminalStep, clamp};
use crate::effect::{Begin, Effect, Looked};
use crate::guard::Bounds;
use crate::physics::legs::Conducting;
use crate::physics::machine::Machine;
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::dormand_prince::Attempt;

/// Numbers of a state.
const NUMBERS: usize = 16;

/// A speed in rad/s, and a link voltage in V, that are off by this many times the tolerance of the angle or the flux matter as
/// much within a tenth of a millisecond.
const PER_SECOND: f64 = 1e4;

fn numbers<V: Wide>(state: &State<V>, pinned: &Elastic<V>) -> [V; NUMBERS] {
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
        let h = (until - here.time) * 1e-9;
        let begin = here.time * 1e-9;
        let mut pinned = [Plane::new(V::of(0.0), V::of(0.0)); MOST_CELLS];
        if let Some(cells) = &machine.cells {
            pinned = cells.away_at(here.state.flux, None).map(|away| here.state.flux - away);
        }
        let attempt = Attempt::new(numbers(&here.state, &pinned), h).take(
            |time, y| {
                let (slope, pinned) = slope(machine, legs, time, &state_of(machine, time, y), &pinned_of(y));
                numbers(&slope, &pinned)
            },
            begin,
        );
        let state = state_of(machine, until * 1e-9, &attempt.end);
        let elastic = pinned_of(&attempt.end).map(|pinned| state.flux - pinned);
        let iron = machine.cells.as_ref().map(|cells| cells.iron(&elastic));
        let at = machine.operating(&state, iron.as_ref());
        let mut end = Here { time: until, state, at, source: machine.links.source(until * 1e-9) };
        let looked = Looked::at(&end, iron, legs);
        looked.settle(legs, &mut end);
        let change = [
            machine.change::<true>(legs, &here.at, &here.state),
            machine.change::<true>(legs, &end.at, &end.state),
        ];
        let mut rotor = None;
        if let Some(rotors) = &machine.rotors {
            rotors.follow(&looked, [looked.flux, looked.current], &mut end);
            let first = machine.cells.as_ref().map(|cells| cells.iron_here(here.state.flux));
            rotor = Some(RotorStep::between(
                [here, &end].map(|here| rotors.acceleration(here.at.torque, here.state.speed)),
                [
                    rotors.torque_rise(&here.state, &here.at, &change[0], first.as_ref()),
                    rotors.torque_rise(&end.state, &end.at, &change[1], iron.as_ref()),
                ],
            ));
        }
        if machine.legs.elastance.is_some() {
            clamp(machine, legs, &mut end);
        }
        let link = machine.links.between(h, legs, [here, &end]);
        let cells = machine.cells.as_ref();
        let from = Begin { h, machine, cells, legs, here, change: &change[0] };
        let terminals = TerminalStep::of(&from, &link);
        let ringing = terminals.map(|terminals| terminals.between(&from, &change[1], &link, &end).ringing);
        let elastic = iron.map(|iron| (elastic, iron.tangent));
        let parts = Parts { change, link, rotor, ringing, elastic };
        let error = attempt.error(&tolerances(accuracy));
        Self::between::<true>(machine, bounds, legs, here, end, h, parts, error)
    }
}

/// How far each number of a state may be off.
fn tolerances<V: Wide>(accuracy: &Accuracy<V>) -> [f64; NUMBERS] {
    let (flux, angle) = (1.0 / accuracy.per_flux.get(0), 1.0 / accuracy.per_angle.get(0));
    let (speed, volt) = (angle * PER_SECOND, flux * PER_SECOND);
    [flux, flux, angle, speed, volt, flux, flux, volt, volt, volt, flux, flux, flux, flux, flux, flux]
}

/// The state that the numbers are at a time in s. Without a capacitor the link follows its source.
fn state_of<V: Wide>(machine: &Machine<V>, time: V, y: &[V; NUMBERS]) -> State<V> {
    let [x, y, turned, speed, mut link, d, q, a, b, c, ..] = *y;
    if machine.links.storage.is_none() {
        link = machine.links.source(time).voltage;
    }
    let lagging = Dq::new(d, q);
    State { flux: Plane::new(x, y), turned, speed, link, lagging, potential: [a, b, c] }
}

/// What is pinned of the iron's fluxes, in Wb.
fn pinned_of<V: Wide>(y: &[V; NUMBERS]) -> Elastic<V> {
    [0, 1, 2].map(|k: usize| Plane::new(y[10 + 2 * k], y[11 + 2 * k]))
}

/// How a state, and what is pinned of the iron's fluxes, change at a time in s.
fn slope<V: Wide>(
    machine: &Machine<V>,
    legs: &Conducting<V>,
    time: V,
    state: &State<V>,
    pinned: &Elastic<V>,
) -> (State<V>, Elastic<V>) {
    let zero = V::of(0.0);
    let away = pinned.map(|pinned| state.flux - pinned);
    let iron = machine.cells.as_ref().map(|cells| cells.iron(&away));
    let at = machine.operating(state, iron.as_ref());
    let here = Here { time, state: *state, at, source: machine.links.source(time) };
    let rise = machine.change::<true>(legs, &at, state).flux;
    let mut slope = State {
        flux: rise,
        turned: zero,
        speed: zero,
        link: zero,
        lagging: Dq::new(zero, zero),
        potential: machine.legs.charged(legs, at.current),
    };
    machine.rotors.as_ref().slope(legs, &here, &mut slope);
    machine.links.slope(legs, &here, &mut slope);
    machine.circuits.eddies().slope(legs, &here, &mut slope);
    let none = [Plane::new(zero, zero); MOST_CELLS];
    let moves = machine.cells.as_ref().map_or(none, |cells| cells.pinned_rise(&away, rise));
    (slope, moves)
}
