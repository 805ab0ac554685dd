//! Terminals with a capacitance within a step: the winding rings with them while no device of a leg conducts.
//!
//! The two oscillators take the place of the winding's quadrature. `ringing.rs` solves them, `modes.rs` finds them, and
//! `floating.rs` says whether a swing may end a leg's mode.

pub mod floating;
pub mod modes;
pub mod ringing;
mod stumpff;
pub mod swing;

use standstill_numeric::{Symmetric, Wide};

use self::modes::Modes;
use self::ringing::{End, Ringing};
use super::link::{LinkStep, stored};
use super::{Begin, Looked, Span};
use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine};
use crate::physics::plane::Plane;
use crate::step::error::{Accuracy, ringing_error};
use crate::step::two_derivative::{Here, Tried};

/// Terminals over a step.
#[derive(Clone, Copy)]
pub struct TerminalStep<V> {
    begin: End<V>,
    /// Voltage in V that the terminals put on the winding at the beginning.
    floating: Plane<V>,
    /// Integral of the link's voltage in V·s less those of a line and of a cubic: [`LinkStep::surplus`].
    surplus: [V; 2],
    /// The oscillators: as they begin, then between both ends.
    pub ringing: Ringing<V>,
}

#[inline(always)]
fn add<V: Wide>(a: [V; 3], b: [V; 3]) -> [V; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

impl<V: Wide> TerminalStep<V> {
    /// Where terminals have a capacitance: the oscillators as they begin.
    #[inline(always)]
    pub fn of(begin: &Begin<'_, '_, V>, link: &LinkStep<V>) -> Option<Self> {
        let Begin { h, machine, legs, here, change, .. } = *begin;
        machine.legs.elastance?;
        let terminals = &legs.terminals;
        let none = Plane::new(V::of(0.0), V::of(0.0));
        let modes = Modes::of(here.at.inverse_inductance, machine.legs.charging(legs), &terminals.resistance);
        let floating = machine.legs.floating(legs, &here.state.potential);
        let end = End::of(terminals, &here.at, change, link.begin(), none);
        let ringing = Ringing::ahead(modes, h, floating, &end);
        Some(Self { begin: end, floating, surplus: link.surplus(h), ringing })
    }

    /// Writes predicted flux and potentials at the end into `there`.
    #[inline(always)]
    pub fn predict(&self, begin: &Begin<'_, '_, V>, there: &mut Here<V>) {
        let Begin { h, machine, legs, here, .. } = *begin;
        let [moved, mean] = self.ringing.after(V::of(1.0));
        there.state.flux = here.state.flux + moved + legs.terminals.rail * self.surplus[0];
        there.state.potential = add(here.state.potential, machine.legs.charged(legs, mean * h));
    }

    /// Solves the oscillators between both ends, where the machines change so at the end; corrects the potentials. The flux in Wb that
    /// the prediction misses, and the resistance in Ω that its feedback is left with.
    #[inline(always)]
    pub fn correct(
        &mut self,
        begin: &Begin<'_, '_, V>,
        looked: &Looked<V>,
        change: &Change<V>,
        link: &LinkStep<V>,
        predicted: Plane<V>,
        there: &mut Here<V>,
    ) -> (Plane<V>, Symmetric<V>) {
        let Begin { h, machine, legs, here, .. } = *begin;
        let terminals = &legs.terminals;
        let surplus = terminals.rail * self.surplus[1];
        let way = predicted - here.state.flux - surplus;
        let end = End::of(terminals, &there.at, change, link.end(), way);
        // The mean of both ends: what turns faster and slower by turns is then right to the next order.
        let [from, to] = [here.at.inverse_inductance, looked.gamma];
        let mean = Symmetric::new((from.xx + to.xx) * 0.5, (from.xy + to.xy) * 0.5, (from.yy + to.yy) * 0.5);
        let modes = Modes::of(mean, machine.legs.charging(legs), &terminals.resistance);
        self.ringing = Ringing::between(modes, h, self.floating, [&self.begin, &end]);
        let [moved, mean] = self.ringing.at_end();
        there.state.potential = add(here.state.potential, machine.legs.charged(legs, mean * h));
        let missing = here.state.flux + moved + surplus - predicted;
        (missing, self.ringing.left_to_cubics(&terminals.resistance, h))
    }

    /// Between two ends that are known, with the oscillators of the beginning.
    pub fn between(
        mut self,
        begin: &Begin<'_, '_, V>,
        change: &Change<V>,
        link: &LinkStep<V>,
        end: &Here<V>,
    ) -> Self {
        let way = end.state.flux - begin.here.state.flux;
        let last = End::of(&begin.legs.terminals, &end.at, change, link.end(), way);
        self.ringing = Ringing::between(self.ringing.modes, begin.h, self.floating, [&self.begin, &last]);
        self
    }

    /// Its share of the step's error, relative to the tolerance; the core was evaluated `off` in Wb from the end.
    #[inline(always)]
    pub fn error(&self, off: Plane<V>, accuracy: &Accuracy<V>) -> V {
        ringing_error(accuracy, &self.ringing, off)
    }
}

/// Writes flux and potentials within a step into `there`, where the integral of the link's voltage up to there is `area` in V·s.
#[inline(always)]
pub fn within<V: Wide>(span: &Span<'_, '_, V>, ringing: &Ringing<V>, area: V, there: &mut Here<V>) {
    let Span { machine, from, step: Tried { h, legs, .. }, share, .. } = *span;
    let [moved, mean] = ringing.after(share);
    let known = stored(span).area(share) * *h;
    there.state.flux = from.state.flux + moved + legs.terminals.rail * (area - known);
    there.state.potential = add(from.state.potential, machine.legs.charged(legs, mean * (*h * share)));
}

/// Puts potentials of conducting legs where their devices have them.
#[inline(always)]
pub fn clamp<V: Wide>(machine: &Machine<V>, legs: &Conducting<V>, there: &mut Here<V>) {
    let state = &mut there.state;
    state.potential = machine.legs.potentials(legs, state.potential, state.link, there.at.current);
}
