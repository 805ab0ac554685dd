//! Terminals with a capacitance within a step: they ring with the winding while no device of their leg conducts.
//!
//! Winding and terminals then form two oscillators, whose solution replaces the quadrature of other steps. `modes.rs` finds
//! the oscillators, `ringing.rs` solves them, and `floating.rs` decides whether an oscillation may end a leg's mode.

pub mod floating;
pub mod modes;
pub mod ringing;
mod stumpff;
pub mod swing;

use standstill_interface::Dq;
use standstill_numeric::{Symmetric, Wide};

use self::modes::Modes;
use self::ringing::{End, Ringing};
use super::link::{LinkStep, stored};
use super::{Begin, Effect, Moment, Span, keep};
use crate::case::Case;
use crate::ledger::Ledger;
use crate::physics::legs::{Conducting, Legs};
use crate::physics::machine::Machine;
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::error::{Accuracy, ringing_error};
use crate::step::two_derivative::{Here, Tried};

/// Legs and terminals as an effect; their part of a step is [`TerminalStep`].
impl<V: Wide> Effect<V> for Legs<V> {
    type Step = ();

    /// Sets the potentials to half the link's voltage, at which equal leakages of both switches hold them, or with dividers to zero,
    /// the potential of the negative rail.
    fn rest(&self, lane: usize, case: &Case<'_>, _: Dq<f64>, state: &mut State<V>) {
        let held = if self.leak.is_some() { 0.0 } else { case.inverter.link.source(0.0) / 2.0 };
        state.potential.iter_mut().for_each(|potential| potential.put(lane, held));
    }

    #[inline(always)]
    fn keep(&self, of: V::Mask, from: &Here<V>, to: &mut Here<V>) {
        if self.elastance.is_some() {
            for k in 0..3 {
                keep(of, from.state.potential[k], &mut to.state.potential[k]);
            }
        }
    }

    fn slope(&self, legs: &Conducting<V>, here: &Here<V>, slope: &mut State<V>) {
        slope.potential = self.rise(legs, here, V::of(1.0));
    }

    fn energy(&self, moment: &Moment<'_, '_, V>, stored: &mut Ledger) {
        let squares: f64 = moment.here.state.potential.iter().map(|v| moment.one(v) * moment.one(v)).sum();
        stored.terminal_change += moment.case.inverter.bridge.terminal_capacitance * squares / 2.0;
    }

    /// Adds the losses of devices, of the ringing and of the dividers. The voltage drop of a conducting leg is −offset + resistance · i.
    /// The current of a leg in which no device conducts is zero, or charges the terminal through the ringing resistance.
    fn power(&self, moment: &Moment<'_, '_, V>, span: &Span<'_, '_, V>, powers: &mut Ledger) {
        let (legs, current) = (&span.step.legs.leg, moment.phases());
        let drop = |k: usize| {
            (moment.one(&legs[k].resistance) * current[k] - moment.one(&legs[k].offset)) * current[k]
        };
        powers.device_loss += (0..3).map(drop).sum::<f64>();
        let floats = (0..3).filter(|k| moment.one(&legs[*k].direction) == 0.0);
        let squares: f64 = floats.map(|k| current[k] * current[k]).sum();
        powers.copper_loss += moment.case.inverter.bridge.terminal_resistance * squares;
        let potential = &moment.here.state.potential;
        let Some(taken) = self.taken(potential) else { return };
        for k in 0..3 {
            let (taken, potential) = (moment.one(&taken[k]), moment.one(&potential[k]));
            powers.divider_loss += taken * potential;
            if moment.one(&legs[k].direction) != 0.0 {
                // The device carries the divider's current from its rail; the link's capacitor neglects so small a current.
                let rail = moment.one(&legs[k].rail) * moment.one(&moment.here.state.link);
                powers.charge(rail * taken, potential * taken);
            }
        }
    }

    /// Adds the energies of charging the terminals of conducting legs, whose potentials follow those of their devices. Elsewhere these
    /// small currents are neglected.
    fn work(&self, moment: &Moment<'_, '_, V>, span: &Span<'_, '_, V>, spent: &mut Ledger) {
        let capacitance = moment.case.inverter.bridge.terminal_capacitance;
        if capacitance == 0.0 {
            return;
        }
        let ends = [span.from, &span.step.end];
        let link = (moment.one(&ends[0].state.link) + moment.one(&ends[1].state.link)) / 2.0;
        for (k, leg) in span.step.legs.leg.iter().enumerate() {
            if moment.one(&leg.direction) != 0.0 {
                let [from, to] = ends.map(|here| moment.one(&here.state.potential[k]));
                let charge = capacitance * (to - from);
                spent.charge(charge * moment.one(&leg.rail) * link, charge * (to + from) / 2.0);
            }
        }
    }
}

/// Quantities of the terminals over a step.
#[derive(Clone, Copy)]
pub struct TerminalStep<V> {
    /// Force and current at the beginning of the step.
    begin: End<V>,
    /// Voltage in V that the floating terminals put on the winding at the beginning.
    floating: Plane<V>,
    /// Predicted integral of the link's voltage over the step less the integral of its tangent at the beginning, in V·s.
    surplus: V,
    /// Solution of the oscillators: first extrapolated from the beginning, after the correction between both ends.
    pub ringing: Ringing<V>,
}

/// Returns the terminals' potentials in V after the winding's currents have carried this charge in A·s. `fallen` is the share by which
/// dividers have lowered the common potential of three floating terminals, on which the winding has no effect.
#[inline(always)]
fn later<V: Wide>(
    machine: &Machine<V>,
    legs: &Conducting<V>,
    from: &Here<V>,
    charge: Plane<V>,
    fallen: Option<V>,
) -> [V; 3] {
    let (before, change) = (&from.state.potential, machine.legs.charged(legs, charge));
    let mut potential = three!(k => before[k] + change[k]);
    if let Some(fallen) = fallen {
        let all_float = !(legs.flows[0] | legs.flows[1] | legs.flows[2]);
        let lost = V::only(all_float, (before[0] + before[1] + before[2]) * (1.0 / 3.0) * fallen);
        potential = three!(k => potential[k] - lost);
    }
    potential
}

impl<V: Wide> TerminalStep<V> {
    /// Returns the oscillators extrapolated from the beginning, and writes the predicted state into `there`. None if terminals have no
    /// capacitance; none in code for machines without rare effects.
    #[inline(always)]
    pub fn predicted<const RARE: bool>(
        begin: &Begin<'_, '_, V>,
        link: &LinkStep<V>,
        there: &mut Here<V>,
    ) -> Option<Self> {
        let terminals = if RARE { Self::of(begin, link) } else { None };
        if let Some(terminals) = &terminals {
            terminals.predict(begin, there);
        }
        terminals
    }

    /// Returns the oscillators extrapolated from the beginning; none if terminals have no capacitance.
    #[inline(always)]
    pub fn of(begin: &Begin<'_, '_, V>, link: &LinkStep<V>) -> Option<Self> {
        let Begin { h, machine, legs, here, change, .. } = *begin;
        machine.legs.elastance?;
        let terminals = &legs.terminals;
        let none = Plane::new(V::of(0.0), V::of(0.0));
        let modes = Modes::of(here.at.inverse_inductance, machine.legs.charging(legs), &terminals.resistance);
        let floating = machine.legs.floating(legs, &here.state.potential);
        let pull = some!(begin.short, short => short.pulling(&here.state, &here.at, change));
        let end = End::of(terminals, &here.at, change, link.at(0), pull, none);
        let ringing = Ringing::ahead(modes, h, floating, machine.legs.leak, &end);
        Some(Self { begin: end, floating, surplus: link.over_tangent(h), ringing })
    }

    /// Writes predicted flux in Wb and potentials in V at the end into `there`.
    #[inline(always)]
    fn predict(&self, begin: &Begin<'_, '_, V>, there: &mut Here<V>) {
        let Begin { h, machine, legs, here, .. } = *begin;
        let [moved, mean] = self.ringing.after(V::of(1.0));
        there.state.flux = here.state.flux + moved + legs.terminals.rail * self.surplus;
        there.state.potential = later(machine, legs, here, mean * h, self.ringing.fallen(V::of(1.0)));
    }

    /// Solves the oscillators between both ends, with the slopes at the end, and corrects the potentials. Returns the correction
    /// of the predicted flux in Wb, and the part of the resistance in Ω that the solution does not contain: the winding's
    /// correction must account for its drop.
    #[inline(always)]
    pub fn correct(
        &mut self,
        end: &super::End<'_, '_, V>,
        link: &LinkStep<V>,
        predicted: Plane<V>,
        there: &mut Here<V>,
    ) -> (Plane<V>, Symmetric<V>) {
        let (looked, change) = (end.looked, end.change);
        let Begin { h, machine, legs, here, short, .. } = *end.begin;
        let terminals = &legs.terminals;
        // The slope of a capacitor's voltage at the end is known only after the correction.
        let surplus = terminals.rail * link.over_cubic(h);
        let way = predicted - here.state.flux - surplus;
        let pull = some!(short, short => short.pulling(&there.state, &there.at, change));
        let end = End::of(terminals, &there.at, change, link.at(1), pull, way);
        // The mean inductance of both ends makes the frequency of the oscillation right to the next order.
        let [from, to] = [here.at.inverse_inductance, looked.gamma];
        let mean = Symmetric::new((from.xx + to.xx) * 0.5, (from.xy + to.xy) * 0.5, (from.yy + to.yy) * 0.5);
        let modes = Modes::of(mean, machine.legs.charging(legs), &terminals.resistance);
        self.ringing = Ringing::between(modes, h, self.floating, machine.legs.leak, [&self.begin, &end]);
        let [moved, mean] = self.ringing.at_end();
        there.state.potential = later(machine, legs, here, mean * h, self.ringing.fallen(V::of(1.0)));
        let missing = here.state.flux + moved + surplus - predicted;
        (missing, self.ringing.left_to_cubics(&terminals.resistance, h))
    }

    /// Returns the solution between two known ends, with the eigenmodes found at the beginning.
    pub fn between(&self, end: &super::End<'_, '_, V>, link: &LinkStep<V>, there: &Here<V>) -> Ringing<V> {
        let begin = end.begin;
        let way = there.state.flux - begin.here.state.flux;
        let pull = some!(begin.short, short => short.pulling(&there.state, &there.at, end.change));
        let last = End::of(&begin.legs.terminals, &there.at, end.change, link.at(1), pull, way);
        let leak = begin.machine.legs.leak;
        Ringing::between(self.ringing.modes, begin.h, self.floating, leak, [&self.begin, &last])
    }

    /// Returns the terminals' contribution to the step's error, relative to the tolerance. `off` is the distance in Wb between the end and
    /// the point at which the core was evaluated.
    #[inline(always)]
    pub fn error(&self, off: Plane<V>, accuracy: &Accuracy<V>) -> V {
        ringing_error(accuracy, &self.ringing, off)
    }
}

/// Writes flux and potentials at a point within a step into `there`. `area` is the integral of the link's voltage up to that point, in V·s.
#[inline(always)]
pub fn within<V: Wide>(span: &Span<'_, '_, V>, ringing: &Ringing<V>, area: V, there: &mut Here<V>) {
    let Span { machine, from, step: Tried { h, legs, .. }, share, .. } = *span;
    let [moved, mean] = ringing.after(share);
    let known = stored(span).area(share) * *h;
    there.state.flux = from.state.flux + moved + legs.terminals.rail * (area - known);
    there.state.potential = later(machine, legs, from, mean * (*h * share), ringing.fallen(share));
}

/// Sets the potentials of conducting legs to the potentials of their devices.
#[inline(always)]
pub fn clamp<V: Wide>(machine: &Machine<V>, legs: &Conducting<V>, there: &mut Here<V>) {
    let state = &mut there.state;
    state.potential = machine.legs.potentials(legs, state.potential, state.link, there.at.current);
}
