//! Conduction of legs whose terminals have a capacitance: each terminal's own potential and current decide which device
//! conducts.

mod joined;
mod terminal;

use standstill_inverter::{Conduction, Gate, Modes};
use standstill_numeric::Wide;

pub use self::joined::{Joined, Settled};
pub(super) use self::terminal::Terminal;
use super::conduction::{NO_CURRENT, One};
use super::run::Control;
use crate::case::RunError;
use crate::lanes::bank::Bank;
use crate::physics::plane::Plane;

/// Distance between the two bounds of a terminal's potential, as a share of the link's voltage, up to which they count as one
/// bound. A leg at such a bound conducts for either sign of its current.
const ONE_BOUND: f64 = 1e-9;

/// A leg whose current is zero begins to conduct only if the slope of the current takes it beyond [`NO_CURRENT`] within this time in s.
const SOON: f64 = 1e-6;

/// Slopes of the currents at an instant, and what they follow from.
pub(super) struct Slopes {
    /// The machine's quantities.
    pub(super) one: One,
    /// Magnetic axes of the legs' phases in the run's plane.
    pub(super) axes: [Plane; 3],
    /// Time derivative of the current in A/s.
    pub(super) rise: Plane,
}

impl<'a> Control<'a> {
    /// Returns whether a leg whose terminal has a capacitance is at the end of its mode: the current of a conducting leg is within a
    /// step's error of zero, or the potential of another leg is near a bound.
    pub(super) fn is_at_end<V: Wide>(&self, bank: &Bank<'a, V>, leg: usize, terminal: &Terminal) -> bool {
        let direction = bank.machine.legs.direction(self.lane, leg);
        if direction != 0.0 {
            let carried = terminal.carried[usize::from(direction < 0.0)];
            return direction * carried <= bank.bounds.ended.get(self.lane);
        }
        let [low, high] = terminal.band;
        let potential = bank.here.state.potential[leg].get(self.lane);
        (potential - low).min(high - potential) <= terminal.near
    }

    /// Returns the distance in s to the next representable time, 4e-6 ns after 17 s, if the modes were found at the
    /// present time already; zero otherwise. No step is shorter, so the changes of currents and potentials within this
    /// time decide the mode.
    pub(super) fn shortest<V: Wide>(&self, bank: &Bank<'a, V>) -> f64 {
        let time = self.time(bank);
        if self.found == time { (time.next_up() - time) * 1e-9 } else { 0.0 }
    }

    /// Finds the conduction modes from gates, potentials and currents. A potential beyond its bounds, as after a switch has
    /// turned on, moves to the nearer bound at once. A current that flows out of the leg at the lower bound, or into the
    /// leg at the upper bound, flows through a device; all other currents charge their terminals.
    ///
    /// A current that passes through zero within `shortest` in s counts as zero: the sign of its slope decides, not the
    /// sign of the current. `terminals` are those of [`Self::terminals`] with the same `shortest`.
    pub(super) fn settle_terminals<V: Wide>(
        &mut self,
        bank: &mut Bank<'a, V>,
        shortest: f64,
        terminals: &[Terminal; 3],
    ) -> Result<(), RunError> {
        let (lane, time) = (self.lane, self.time(bank));
        self.found = time;
        let current = terminals.each_ref().map(|of| of.current);
        if !current.iter().all(|current| current.is_finite()) {
            return Err(RunError::NotFinite(bank.place(self.lane)));
        }
        let link = bank.here.state.link.get(lane);
        let bridge = &self.case.inverter.bridge;
        let kind = bridge.devices.kind;
        let again = shortest > 0.0;
        let slack: [f64; 3] = std::array::from_fn(|k| bank.bounds.slack.leg[k].get(lane));
        let is_one = |of: &Terminal| of.band[1] - of.band[0] <= ONE_BOUND * link;
        // The current of the leg's device decides: phase current, capacitive current and divider's current. If it is zero, its slope
        // decides. A mode against the direction of the current would end before it began, over and over up to the next edge.
        let is_none = |k: usize, way: usize, slope: f64| {
            terminals[k].carried[way].abs() <= slack[k] + slope.abs() * shortest
        };
        let damped = bridge.terminal_resistance > 0.0;
        let least = NO_CURRENT * self.case.motor.rated_current;
        // `slopes`: slopes of the device's current in A/s, for current out of the leg and into it.
        let mode = |k: usize, slopes: [f64; 2]| {
            let of = &terminals[k];
            if is_one(of) {
                // With one bound only, the leg conducts for either direction of its current.
                let way = if again && is_none(k, 0, slopes[0]) { slopes[0] } else { of.carried[0] };
                return if way < 0.0 { kind.inflow(of.gate) } else { kind.outflow(of.gate) };
            }
            // So small a slope is a rounding error times the resistance: it makes no device conduct.
            let rises = slopes.map(|slope| if damped && slope.abs() * SOON <= least { 0.0 } else { slope });
            let way = |way: usize| if is_none(k, way, slopes[way]) { rises[way] } else { of.carried[way] };
            let [low, high] = of.band;
            if way(0) > 0.0 && of.held <= low + of.near {
                kind.outflow(of.gate)
            } else if way(1) < 0.0 && of.held >= high - of.near {
                kind.inflow(of.gate)
            } else {
                Conduction::Blocked
            }
        };
        // The modes of legs with a current do not depend on the slopes of the currents, so they are found first; the slopes depend on
        // these modes. The ringing resistance acts only in legs that certainly have no conducting device. In an undecided leg, the slope
        // with that resistance would let a device begin to conduct at once, and the slope without it would end this at once.
        let undecided =
            [0, 1, 2].map(|k| !is_one(&terminals[k]) && (is_none(k, 0, 0.0) || is_none(k, 1, 0.0)));
        let first: Modes = std::array::from_fn(|k| mode(k, [0.0; 2]));
        let slopes = |bank: &Bank<'a, V>| {
            let behind = std::array::from_fn(|k| {
                let rings = first[k] == Conduction::Blocked && !undecided[k];
                let met = if rings { bridge.terminal_resistance * current[k] } else { 0.0 };
                let of = bridge.devices.clamp(first[k]);
                of.map_or(terminals[k].held, |clamp| clamp.potential(link, current[k])) - met
            });
            let one = One::of(bank, &bank.here, lane);
            let axes = self.axes(bank);
            let rise = one.rise(&axes, behind);
            Slopes { one, axes, rise }
        };
        let (mut modes, mut known) = (first, None);
        if again || undecided.contains(&true) {
            let found = slopes(bank);
            let rises = found.axes.map(|axis| axis.dot(found.rise));
            let following = self.following_slope(bank, current, rises);
            modes = std::array::from_fn(|k| {
                let of = [kind.outflow(terminals[k].gate), kind.inflow(terminals[k].gate)];
                mode(k, of.map(|mode| rises[k] + if mode.is_upper() { following } else { 0.0 }))
            });
            known = Some(found);
        }
        let legs = &bank.machine.legs;
        let changes = (0..3).any(|k| legs.direction(lane, k) != modes[k].direction());
        let known = if changes && known.is_none() { Some(slopes(bank)) } else { known };
        self.join(bank, modes, terminals);
        if changes && let Some(known) = &known {
            self.expect(bank, modes, terminals, known);
        }
        bank.machine.legs.put(lane, modes);
        Ok(())
    }

    /// Charges terminals through their devices at this instant. A conducting leg's terminal takes the potential of its device. Another
    /// terminal moves to a bound if it is beyond this bound.
    fn join<V: Wide>(&mut self, bank: &mut Bank<'a, V>, modes: Modes, terminals: &[Terminal; 3]) {
        let lane = self.lane;
        let (bridge, storage) = (&self.case.inverter.bridge, self.case.inverter.link.storage);
        let capacitance = bridge.terminal_capacitance;
        let share = storage.map_or(0.0, |of| capacitance / of.capacitance);
        let potential = bank.here.state.potential.each_ref().map(|of| of.get(lane));
        let before = Joined { potential, link: bank.here.state.link.get(lane), share };
        let after = before.settle(|k, link| {
            if let Some(clamp) = bridge.devices.clamp(modes[k]) {
                return (clamp.potential(link, terminals[k].current), modes[k].is_upper());
            }
            let gate = terminals[k].gate;
            let (low, high) = bridge.bounds_of(k, gate, link);
            let held = potential[k].max(low).min(high);
            (held, if held >= high { gate != Gate::Low } else { held <= low && gate == Gate::High })
        });
        if after.potential == potential {
            return;
        }
        let picked_up = bank.sensed.as_mut().and_then(|sensed| sensed.picked_up.as_mut());
        if let Some(picked_up) = picked_up {
            for (to, from) in after.potential.into_iter().zip(potential) {
                if to != from {
                    picked_up.jump(lane, (to - from) / before.link);
                }
            }
        }
        for k in 0..3 {
            bank.here.state.potential[k].put(lane, after.potential[k]);
        }
        if storage.is_some() {
            bank.here.state.link.put(lane, after.link);
        }
        if let Some(accounts) = &mut self.accounts {
            accounts.spent.join(&before, &after, capacitance);
        }
    }
}
