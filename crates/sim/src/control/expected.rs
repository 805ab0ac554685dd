//! Prediction for the first step after a change of conduction: its length, and the time at which a current will have
//! charged a terminal from one bound to the other.

use standstill_inverter::Modes;
use standstill_numeric::{Symmetric, Wide};

use super::run::Control;
use super::terminals::{Slopes, Terminal};
use crate::effect::terminals::floating::{LAGGED, SEEN};
use crate::lanes::bank::Bank;
use crate::physics::gates::NEVER;
use crate::physics::plane::Plane;
use crate::physics::terminals::of_legs;

/// Ratio of the next trial step to the time in which a constant current charges a terminal to its bound.
const CARRIED: f64 = 1.2;

/// Factor that keeps the angle of a step below the largest one at which cubics can locate the end of a leg's mode in an
/// oscillation ([`SEEN`], [`LAGGED`]).
const NEARLY: f64 = 0.95;

/// Angle x in rad up to which a sixth-order polynomial of time approximates the charge carried by an oscillating
/// current: the neglected term, x⁷/5040, is 3e-6 of the charge that the current carries in a radian.
const EXACT: f64 = 0.55;

/// If a current reverses before it has moved a terminal by this share of the way from bound to bound, the terminal counts as unmoved.
const TURNS: f64 = 1e-6;

/// Number of Newton iterations that find the time in which the current carries a charge. They begin at the time for a constant current.
const NEWTON: usize = 6;

impl<'a> Control<'a> {
    /// Returns the magnetic axes of the phases in the run's plane.
    pub(super) fn axes<V: Wide>(&self, bank: &Bank<'a, V>) -> [Plane; 3] {
        bank.machine.legs.axes.each_ref().map(|axis| axis.get(self.lane))
    }

    /// Sets the length of the next step after a change of conduction. Starts from the last step length used with the same
    /// number of floating terminals. Limits it so that cubics can locate the end of a leg's mode in an oscillation, and to
    /// little more than the time in which a current charges a terminal to its bound.
    pub(super) fn expect<V: Wide>(
        &self,
        bank: &mut Bank<'a, V>,
        modes: Modes,
        terminals: &[Terminal; 3],
        slopes: &Slopes,
    ) {
        let lane = self.lane;
        let legs = &bank.machine.legs;
        let before: [f64; 3] = std::array::from_fn(|k| legs.direction(lane, k));
        // A step that charges a terminal from bound to bound has a length that does not suit later steps of an oscillation.
        if bank.schedule.expected.get(lane) == NEVER && bank.schedule.swept >> lane & 1 == 0 {
            let floated = before.iter().filter(|direction| **direction == 0.0).count();
            bank.control.next_by_floating[floated].put(lane, bank.control.next.get(lane));
        }
        bank.schedule.expected.put(lane, NEVER);
        bank.schedule.swept &= !(1 << lane);
        let floats = modes.map(|mode| mode.direction() == 0.0);
        let count = floats.iter().filter(|floats| **floats).count();
        let mut next = bank.control.next_by_floating[count].get(lane);
        if count > 0 {
            let way = Way::of(self, bank, floats, slopes);
            let most = if bank.machine.lags() { LAGGED } else { SEEN };
            next = next.min((most / way.square).sqrt() * NEARLY * 1e9);
            let mut first = (f64::INFINITY, 0);
            for k in (0..3).filter(|k| floats[*k]) {
                let potential = bank.here.state.potential[k].get(lane);
                let (time, exact) = way.carries(k, potential, terminals[k].band);
                next = next.min((time * CARRIED * 1e9).max(1.0));
                if exact < first.0 {
                    first = (exact, k);
                }
            }
            let (exact, leg) = first;
            if exact < f64::INFINITY {
                let time = bank.here.time.get(lane) + exact * 1e9;
                bank.schedule.expected.put(lane, time);
                bank.schedule.carried[lane] = leg;
                bank.schedule.swept |= 1 << lane;
                next = next.max(exact * (1e9 * CARRIED));
            }
        }
        bank.control.next.put(lane, next);
    }
}

/// Number of terms of a current's Taylor series.
const TERMS: usize = 6;

/// Reciprocals of the integers from 1 on, with which the terms of a Taylor series are scaled (1/n!).
const PER: [f64; TERMS] = [1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0, 1.0 / 5.0, 1.0 / 6.0];

/// Taylor series of the currents in time, after a change of conduction.
struct Way {
    axes: [Plane; 3],
    /// The current in A and its time derivatives of order 1 to 5, in A/sⁿ.
    current: [Plane; TERMS],
    /// Lower limit of the square of the frequency at which terminals ring, in 1/s².
    square: f64,
    /// Capacitance of a terminal in F.
    capacitance: f64,
    /// Rate in 1/s at which dividers discharge the terminals.
    leak: f64,
}

impl Way {
    /// Makes the series of a run's currents at its present state. `floats` is true for each floating terminal.
    fn of<'a, V: Wide>(
        control: &Control<'a>,
        bank: &Bank<'a, V>,
        floats: [bool; 3],
        slopes: &Slopes,
    ) -> Self {
        let bridge = &control.case.inverter.bridge;
        let Slopes { one, axes, rise } = slopes;
        let capacitance = bridge.terminal_capacitance;
        let each = |value: f64| floats.map(|floats| if floats { value } else { 0.0 });
        let charging = of_legs(axes, &each(1.0 / capacitance), Symmetric::new(0.0, 0.0, 0.0));
        let met = of_legs(axes, &each(bridge.terminal_resistance), one.resistance);
        let gamma = one.inverse_inductance;
        // i″ = −Γ (K i + R i′ + γ w), w′ = −K i − γ w.
        let bend = |current: Plane, rise: Plane, leaks: Plane| {
            (current.through(charging) + rise.through(met) + leaks).through(gamma) * -1.0
        };
        let leak = bank.machine.legs.leak.map_or(0.0, |leak| leak.get(control.lane));
        let mut floating = Plane::default();
        for k in (0..3).filter(|k| floats[*k]) {
            floating = floating + axes[k] * (bank.here.state.potential[k].get(control.lane) * (2.0 / 3.0));
        }
        let mut current = [one.current; TERMS];
        current[1] = *rise;
        let mut leaks = floating * leak;
        for n in 0..TERMS - 2 {
            current[n + 2] = bend(current[n], current[n + 1], leaks);
            leaks = (current[n].through(charging) + leaks) * -leak;
        }
        let mut square = 0.0;
        for k in (0..3).filter(|k| floats[*k]) {
            square += axes[k].through(gamma).dot(axes[k]) * (2.0 / 3.0) / capacitance;
        }
        Self { axes: *axes, current, square, capacitance, leak }
    }

    /// Returns the times in s in which the current charges terminal `k` from a potential in V to a bound. The first
    /// time assumes a constant current; the second follows from the Taylor series and is infinite if the series is too inexact.
    fn carries(&self, k: usize, potential: f64, [low, high]: [f64; 2]) -> (f64, f64) {
        let mut terms = self.current.map(|of| self.axes[k].dot(of));
        if self.leak > 0.0 {
            // The series of the whole current that discharges the terminal, including its divider's: j = i + C γ v, C v′ = −j.
            terms[0] += potential * self.capacitance * self.leak;
            for n in 1..TERMS {
                terms[n] -= self.leak * terms[n - 1];
            }
        }
        let mut room = (potential - low) * self.capacitance;
        if terms[0] < 0.0 {
            terms = terms.map(|term| -term);
            room = (high - potential) * self.capacitance;
        }
        let [current, rise, ..] = terms;
        if rise < 0.0 && current * current < -rise * room.abs().max((high - low) * self.capacitance * TURNS) {
            // The current reverses before the terminal reaches its bound, or before it has moved the terminal noticeably.
            return (f64::INFINITY, f64::INFINITY);
        }
        let constant = room / terms[0];
        let most = EXACT / self.square.sqrt();
        let mut time = constant;
        if !(time > 0.0 && time < most) {
            return (constant, f64::INFINITY);
        }
        for _ in 0..NEWTON {
            let [mut flows, mut charge] = [terms[TERMS - 1]; 2];
            for n in (0..TERMS - 1).rev() {
                flows = terms[n] + flows * (time * PER[n]);
                charge = terms[n] + charge * (time * PER[n + 1]);
            }
            time -= (charge * time - room) / flows;
        }
        let exact = time > 0.0 && time < most;
        (constant, if exact { time } else { f64::INFINITY })
    }
}

#[cfg(test)]
mod tests;
