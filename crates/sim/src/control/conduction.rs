//! Conduction modes of a run's legs: how they are found, and the changes of the machine when a mode ends.

use standstill_interface::{AlphaBeta, Dq};
use standstill_inverter::{AXES, Conduction, Gate, Port};
use standstill_numeric::{Heading, Symmetric, Wide};

use super::motion::flux_slack;
use super::run::Control;
use crate::case::RunError;
use crate::guard::Guard;
use crate::lanes::bank::Bank;
use crate::physics::plane::Plane;
use crate::step::two_derivative::Here;
use crate::trace::Event;

/// Share of the rated current up to which a leg counts as currentless when its conduction mode is found: about 1,000
/// times the rounding error of the largest currents, and about 1/1,000 of the error of a step.
pub(super) const NO_CURRENT: f64 = 1.25e-10;

/// The quantities of one lane's machine that decide the conduction modes.
#[derive(Clone, Copy, Debug)]
pub struct One {
    /// Current in A in the run's plane.
    pub current: Plane,
    /// Inverse incremental inductance in 1/H in the run's plane.
    pub inverse_inductance: Symmetric,
    /// Slope of the currents in A/s at constant flux, caused by eddy currents and by the rotor's rotation.
    pub drift: Plane,
    /// For a winding with shorted turns: R i minus the actual resistive voltage drop in V, where i is the terminal current.
    pub pull: Plane,
    /// Voltage of the DC link in V.
    pub dc_link: f64,
    /// Heading of the run's plane in the stator's plane.
    pub start: Heading,
    /// Resistance in Ω of winding and contacts in the run's plane.
    pub resistance: Symmetric,
    /// Phase that each leg feeds.
    wires: [usize; 3],
}

impl One {
    /// Reads the quantities of a lane's machine from the bank and from its state `here`.
    pub fn of<V: Wide>(bank: &Bank<'_, V>, here: &Here<V>, lane: usize) -> Self {
        let one = |pack: &V| pack.get(lane);
        let gamma = &here.at.inverse_inductance;
        let mut drift = here.at.relaxing.get(lane);
        if bank.machine.rotors.is_some() {
            drift = drift + here.at.turning.get(lane) * one(&here.state.speed);
        }
        Self {
            current: here.at.current.get(lane),
            inverse_inductance: Symmetric::new(one(&gamma.xx), one(&gamma.xy), one(&gamma.yy)),
            drift,
            pull: bank.machine.pull(&here.state, lane),
            dc_link: one(&here.state.link),
            start: Heading { sin: one(&bank.machine.start.sin), cos: one(&bank.machine.start.cos) },
            resistance: bank.machine.legs.resistance(lane, one(&bank.machine.resistance)),
            wires: bank.machine.legs.wires(lane),
        }
    }

    /// Returns the time derivative of the current in A/s with these potentials in V at the winding's terminals. `axes` contains the
    /// magnetic axes of the legs' phases in the run's plane.
    pub(super) fn rise(&self, axes: &[Plane; 3], potential: [f64; 3]) -> Plane {
        let mut voltage = self.pull - self.current.through(self.resistance);
        for (axis, potential) in axes.iter().zip(potential) {
            voltage = voltage + *axis * (potential * (2.0 / 3.0));
        }
        voltage.through(self.inverse_inductance) + self.drift
    }

    /// Returns the machine's electrical state at its terminals, from which the bridge finds the conducting devices.
    /// `current` contains the currents of the legs in A.
    pub fn port(&self, current: [f64; 3]) -> Port {
        let held = self.current.through(self.resistance)
            - self.pull
            - self.drift.through(self.inverse_inductance.inverse());
        let holding: AlphaBeta<f64> = held.to_stator(self.start);
        let inverse_inductance = self.inverse_inductance.unpark_by(self.start.sin, self.start.cos);
        let port = Port { current, inverse_inductance, holding, dc_link: self.dc_link };
        if self.wires == [0, 1, 2] { port } else { as_wired(port, self.wires) }
    }
}

/// Transforms a port, given in the stator's plane, into a plane in which leg k has the axis of phase k. This plane is rotated or
/// mirrored against the stator's plane. `wires` contains the number of the phase that each leg is connected to.
fn as_wired(port: Port, wires: [usize; 3]) -> Port {
    // The matrix that takes the axis of each leg's phase to the leg's own: ⅔ Σ aₖ ⊗ p(k).
    let turned = |v: AlphaBeta<f64>| {
        let mut sum = AlphaBeta::new(0.0, 0.0);
        for (axis, phase) in AXES.into_iter().zip(wires) {
            sum = sum + axis * (AXES[phase].dot(v) * (2.0 / 3.0));
        }
        sum
    };
    let gamma = port.inverse_inductance;
    let [x, y] = [(1.0, 0.0), (0.0, 1.0)].map(|(alpha, beta)| turned(AlphaBeta::new(alpha, beta)));
    // M Γ Mᵀ, whose columns M eₓ and M e_y are x and y.
    let of = |row: [f64; 2], column: [f64; 2]| {
        row[0] * (gamma.xx * column[0] + gamma.xy * column[1])
            + row[1] * (gamma.xy * column[0] + gamma.yy * column[1])
    };
    let rows = [[x.alpha, y.alpha], [x.beta, y.beta]];
    Port {
        inverse_inductance: Symmetric::new(of(rows[0], rows[0]), of(rows[0], rows[1]), of(rows[1], rows[1])),
        holding: turned(port.holding),
        ..port
    }
}

impl<'a> Control<'a> {
    /// Returns the present phase currents in A.
    pub(super) fn currents<V: Wide>(&self, bank: &Bank<'a, V>) -> [f64; 3] {
        self.currents_at(bank, &bank.here)
    }

    /// Returns the phase currents in A for the state `here`.
    pub(super) fn currents_at<V: Wide>(&self, bank: &Bank<'a, V>, here: &Here<V>) -> [f64; 3] {
        let current = here.at.current.get(self.lane);
        self.axes(bank).map(|axis| axis.dot(current))
    }

    /// Returns the machine's electrical state at its terminals, from which the bridge finds the conducting devices.
    pub(super) fn port<V: Wide>(&self, bank: &Bank<'a, V>, here: &Here<V>) -> Port {
        One::of(bank, here, self.lane).port(self.currents_at(bank, here))
    }

    /// Returns the present state of each leg's gates.
    pub(super) fn gates<V: Wide>(&self, bank: &Bank<'a, V>) -> [Gate; 3] {
        let time = self.time(bank);
        let of = |k: usize| bank.machine.legs.gates[k].of(self.lane, time);
        [of(0), of(1), of(2)]
    }

    /// Finds the conduction modes that fit the gates and the machine.
    pub(super) fn resolve<V: Wide>(&mut self, bank: &mut Bank<'a, V>) -> Result<(), RunError> {
        // If an external source holds the terminals, no devices conduct.
        if bank.machine.legs.fed.is_some() {
            return Ok(());
        }
        if bank.machine.legs.elastance.is_some() {
            let terminals = self.terminals(bank, 0.0);
            return self.settle_terminals(bank, 0.0, &terminals);
        }
        let mut port = self.port(bank, &bank.here);
        if !port.current.iter().all(|current| current.is_finite()) {
            return Err(RunError::NotFinite(bank.place(self.lane)));
        }
        self.found = self.time(bank);
        let least = NO_CURRENT * self.case.motor.rated_current;
        port.current = port.current.map(|current| if current.abs() <= least { 0.0 } else { current });
        let modes = self.case.inverter.bridge.resolve(self.gates(bank), &port);
        bank.machine.legs.put(self.lane, modes);
        Ok(())
    }

    /// Returns whether legs conduct although all currents are zero, as when MOSFET channels connect all terminals to one rail. The
    /// sign of the current then does not determine which device of a leg conducts after an edge of its gate.
    pub(super) fn conducts_nothing<V: Wide>(&self, bank: &Bank<'a, V>) -> bool {
        let legs = &bank.machine.legs;
        let least = NO_CURRENT * self.case.motor.rated_current;
        let currents = self.currents(bank);
        currents.iter().all(|current| current.abs() <= least)
            && (0..3).any(|k| legs.direction(self.lane, k) != 0.0)
    }

    /// Ends the mode that `guard` limits after the guard's margin has reached zero, and finds the next modes.
    pub(super) fn end_mode<V: Wide>(&mut self, bank: &mut Bank<'a, V>, guard: Guard) -> Result<(), RunError> {
        let passed = self.time(bank);
        match guard {
            // Each step finds the modes of the play cells by itself.
            Guard::Branch => return Ok(()),
            Guard::Kink(axis) => {
                self.cross_kink(bank, axis);
                return Ok(());
            }
            Guard::Trip(input) => return self.trip(bank, input),
            Guard::Domain => {
                self.event(passed * 1e-9, Event::LeftMap);
                return Err(self.left_map(bank));
            }
            // With the speed, the voltage that the rotor induces may have jumped.
            Guard::Stop | Guard::Motion => self.change_motion(bank, guard == Guard::Stop),
            Guard::Blocked => {}
            Guard::Leg(leg) => {
                // Where it is not at its end, the end was located on the cubic of a longer step; the current has not yet reached it.
                if bank.machine.legs.elastance.is_some() {
                    let shortest = self.shortest(bank);
                    let terminals = self.terminals(bank, shortest);
                    let is_at_end = self.is_at_end(bank, leg, &terminals[leg]);
                    return if is_at_end {
                        self.settle_terminals(bank, shortest, &terminals)
                    } else {
                        Ok(())
                    };
                }
                let legs = &bank.machine.legs;
                let outflow = legs.direction(self.lane, leg) * self.currents(bank)[leg];
                let is_at_end = outflow <= bank.bounds.ended.get(self.lane);
                if !is_at_end {
                    return Ok(());
                }
                let ends: [bool; 3] =
                    std::array::from_fn(|k| k == leg || legs.direction(self.lane, k) == 0.0);
                self.make_zero(bank, ends);
                if ends.iter().filter(|ends| **ends).count() >= 2 {
                    bank.machine.legs.put(self.lane, [Conduction::Blocked; 3]);
                    return if self.drives_legs(bank) { self.resolve(bank) } else { Ok(()) };
                }
            }
        }
        self.resolve(bank)
    }

    /// Returns whether a voltage may start a current: the DC link's voltage between terminals, or a voltage induced by the rotor, eddy
    /// currents or shorted turns. If the result is true, updates the DC link's voltage to the present time.
    pub(super) fn drives_legs<V: Wide>(&mut self, bank: &mut Bank<'a, V>) -> bool {
        self.found = self.time(bank);
        let gates = self.gates(bank);
        let drives = gates.contains(&Gate::High) && gates.contains(&Gate::Low) || bank.machine.drifts();
        if drives && self.stale {
            self.look_at_link(bank);
        }
        drives
    }

    /// Sets the currents of these legs to exactly zero. They must be zero within the error of a step. The flux changes as
    /// by a voltage impulse at the legs' terminals.
    pub(super) fn make_zero<V: Wide>(&self, bank: &mut Bank<'a, V>, legs: [bool; 3]) {
        let lane = self.lane;
        let all = legs.iter().filter(|leg| **leg).count() >= 2;
        let one = One::of(bank, &bank.here, lane);
        let (impulse, change) = if all {
            (one.current.through(one.inverse_inductance.inverse()), one.current)
        } else {
            let k = legs.iter().position(|leg| *leg).unwrap_or(0);
            let axis = bank.machine.legs.axes[k].get(lane);
            let across = axis.through(one.inverse_inductance);
            let share = axis.dot(one.current) / across.dot(axis);
            (axis * share, across * share)
        };
        let here = &mut bank.here;
        here.state.flux.put(lane, here.state.flux.get(lane) - impulse);
        let left = if all { Plane::default() } else { one.current - change };
        here.at.current.put(lane, left);
    }

    /// Returns the error of a run whose currents have left the flux map.
    fn left_map<V: Wide>(&self, bank: &Bank<'a, V>) -> RunError {
        let Dq { d, q } = &bank.here.at.core_current;
        RunError::left_map([d.get(self.lane), q.get(self.lane)])
    }

    /// Handles a sign change of ψ_d (`axis` 0) or ψ_q (`axis` 1) at a kink of the core.
    fn cross_kink<V: Wide>(&mut self, bank: &mut Bank<'a, V>, axis: usize) {
        let flux = &bank.here.at.core_flux;
        let flux = [flux.d.get(self.lane), flux.q.get(self.lane)][axis];
        if self.sides[axis] * flux < flux_slack(self.case.motor) {
            self.sides[axis] = -self.sides[axis];
        }
        self.set_sides(bank);
    }

    /// Writes the signs of ψ_d and ψ_q, which select the sides of the core's kinks, into the bank's bounds.
    pub(super) fn set_sides<V: Wide>(&self, bank: &mut Bank<'a, V>) {
        if let Some(sides) = &mut bank.bounds.sides {
            for (to, side) in sides.iter_mut().zip(self.sides) {
                to[0].put(self.lane, side);
                to[1].put(self.lane, if side == 0.0 { f64::INFINITY } else { 0.0 });
            }
        }
    }
}
