//! The machines within a step.

use standstill_numeric::Wide;

use super::corrections::{RotorFlux, lag_behind};
use super::hermite::Cubic;
use super::two_derivative::{Here, Tried};
use crate::physics::machine::Machine;
use crate::physics::memory::Memory;
use crate::physics::plane::Plane;
use crate::physics::state::State;

impl<V: Wide> Tried<V> {
    /// The machines at a share of the step that began at `begin`, with what their iron remembered there, as exactly as at its end: the flux from the voltage and
    /// the integral of the currents' cubic, the currents from the core there.
    #[inline(always)]
    pub fn within(
        &self,
        machine: &Machine<V>,
        begin: &Here<V>,
        memory: Option<&Memory<V>>,
        share: V,
    ) -> Here<V> {
        let zero = V::of(0.0);
        let (h, end) = (self.h, &self.end);
        let (from, to) = (&begin.state, &end.state);
        let time = begin.time + (end.time - begin.time) * share;
        let source = machine.links.source(time * 1e-9);
        let (mut turned, mut speed) = (from.turned, from.speed);
        if let Some(rotors) = &machine.rotors {
            let speeds = over(h, [from.speed, to.speed], self.acceleration);
            speed = speeds.at(share);
            turned = from.turned + speeds.area(share) * h * rotors.moving;
        }
        let mut link = source.voltage;
        let area = if machine.links.storage.is_some() {
            let links = over(h, [from.link, to.link], self.link_rise);
            link = links.at(share);
            links.area(share) * h
        } else {
            machine.links.area(h * share, begin.source, source)
        };
        let terminals = &self.legs.terminals;
        let [first, last] = &self.change;
        let charge = Plane::new(
            over(h, [begin.at.current.x, end.at.current.x], [first.current.x, last.current.x]).area(share)
                * h,
            over(h, [begin.at.current.y, end.at.current.y], [first.current.y, last.current.y]).area(share)
                * h,
        );
        let potential =
            first.blocked_potential + (last.blocked_potential - first.blocked_potential) * share * 0.5;
        let driven = from.flux + terminals.rail * area + terminals.offset * (h * share)
            - charge.through(terminals.resistance)
            + terminals.blocked * (potential * (2.0 / 3.0) * h * share);
        let idle = self.legs.idle;
        let coasting = Plane::new(
            over(h, [from.flux.x, to.flux.x], [first.flux.x, last.flux.x]).at(share),
            over(h, [from.flux.y, to.flux.y], [first.flux.y, last.flux.y]).at(share),
        );
        let mut flux = Plane::choose(idle, coasting, driven);
        let mut potential = from.potential;
        if let Some(floating) = &self.floating {
            let [moved, mean] = floating.ringing.after(share);
            let rises = [self.link_rise[0] * h, self.link_rise[1] * h];
            let known = Cubic { value: [from.link, to.link], slope: rises }.area(share) * h;
            flux = from.flux + moved + terminals.rail * (area - known);
            let charged = machine.legs.charged(&self.legs, mean * (h * share));
            potential = three!(k => potential[k] + charged[k]);
        }
        let mut lagging = from.lagging;
        if let Some(eddies) = machine.circuits.eddies() {
            // By the step's own rule over its first part: a cubic would be off where the flux lags behind by much.
            let (part, x) = (h * share, share);
            let rise = Plane::new(
                over(h, [from.flux.x, to.flux.x], [first.flux.x, last.flux.x]).rise(x),
                over(h, [from.flux.y, to.flux.y], [first.flux.y, last.flux.y]).rise(x),
            );
            let begin_state = RotorFlux::of(machine, from, first.flux * part, from.speed * part);
            let there = State { flux, turned, speed, link, lagging, potential };
            let end_state = RotorFlux::of(machine, &there, rise * share, speed * part);
            lagging = lag_behind(part * eddies.rate, from.lagging, &begin_state, &end_state);
        }
        let iron =
            some!(memory, memory => memory.iron(&memory.away_at(flux, Some(first.flux * (h * share)))));
        let state = State { flux, turned, speed, link, lagging, potential };
        let mut at = machine.operating(&state, iron.as_ref());
        let gamma = at.inverse_inductance;
        let across = terminals.blocked.through(gamma);
        let impulse =
            terminals.blocked.dot(at.current) / (across.dot(terminals.blocked) + terminals.none_blocked);
        let all = at.current.through(gamma.inverse());
        let (looked_up_flux, looked_up_current) = (flux, at.current);
        flux = flux - Plane::choose(idle, all, terminals.blocked * impulse);
        let none = Plane::new(zero, zero);
        at.current = Plane::choose(idle, none, at.current - across * impulse);
        if let Some(rotors) = &machine.rotors {
            let core = |flux: Plane<V>, current: Plane<V>| {
                [flux, iron.as_ref().map_or(current, |iron| iron.core(current, flux - looked_up_flux))]
            };
            let change = [core(looked_up_flux, looked_up_current), core(flux, at.current)];
            at.torque = at.torque + rotors.torque_change(&at, change[0], change[1]);
        }
        if self.floating.is_some() {
            potential = machine.legs.potentials(&self.legs, potential, link, at.current);
        }
        Here { time, state: State { flux, turned, speed, link, lagging, potential }, at, source }
    }
}

/// The cubic over a step of `h` seconds with values at both ends and how fast they rise there.
#[inline(always)]
fn over<V: Wide>(h: V, value: [V; 2], rise: [V; 2]) -> Cubic<V> {
    Cubic { value, slope: [rise[0] * h, rise[1] * h] }
}
