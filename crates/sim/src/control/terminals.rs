//! Conduction of legs whose terminals have a capacitance: each terminal's own potential and current decide which device
//! conducts.

mod joined;

use standstill_inverter::{Conduction, Gate, Modes};
use standstill_numeric::Wide;

pub use self::joined::{Joined, Settled};
use super::conduction::NO_CURRENT;
use super::run::Control;
use crate::case::RunError;
use crate::guard::POTENTIAL_DEEP;
use crate::lanes::bank::Bank;

/// Distance between the two bounds of a terminal's potential, as a share of the link's voltage, up to which they count as one
/// bound. A leg at such a bound conducts for either sign of its current.
const ONE_BOUND: f64 = 1e-9;

/// A leg whose current is zero begins to conduct only if the slope of the current takes it beyond [`NO_CURRENT`] within this time in s.
const SOON: f64 = 1e-6;

impl<'a> Control<'a> {
    /// Returns whether a leg is at the end of its mode: the current of a conducting leg is within a step's error of zero, or the
    /// potential of another leg is within [`Self::near`] of a bound.
    pub(super) fn is_at_end<V: Wide>(&self, bank: &Bank<'a, V>, leg: usize, shortest: f64) -> bool {
        let direction = bank.machine.legs.direction(self.lane, leg);
        if direction != 0.0 || bank.machine.legs.elastance.is_none() {
            let shift = self.beside(bank, direction, leg);
            return direction * (self.currents(bank)[leg] + shift) <= bank.bounds.ended.get(self.lane);
        }
        let [low, high] = self.band(bank, leg);
        let potential = bank.here.state.potential[leg].get(self.lane);
        (potential - low).min(high - potential) <= self.near(bank, leg, shortest)
    }

    /// Returns the distance in s to the next representable time, 4e-6 ns after 17 s, if the modes were found at the
    /// present time already; zero otherwise. No step is shorter, so the changes of currents and potentials within this
    /// time decide the mode.
    pub(super) fn shortest<V: Wide>(&self, bank: &Bank<'a, V>) -> f64 {
        let time = self.time(bank);
        if self.found == time { (time.next_up() - time) * 1e-9 } else { 0.0 }
    }

    /// Returns the current in A through the divider of a terminal with this potential in V; zero without a divider.
    fn taken(&self, potential: f64) -> f64 {
        self.case.sensors.settings.load().map_or(0.0, |resistance| potential / resistance)
    }

    /// Returns the current in A that a leg's device carries in addition to the phase current: the current that charges the terminal's
    /// capacitance as the link's voltage changes, and the divider's. `direction` is the sign of the phase current.
    fn beside<V: Wide>(&self, bank: &Bank<'a, V>, direction: f64, leg: usize) -> f64 {
        let following = self.following(bank, direction, leg);
        if bank.machine.legs.leak.is_none() {
            return following;
        }
        let devices = &self.case.inverter.bridge.devices;
        let gate = bank.machine.legs.gates[leg].of(self.lane, self.time(bank));
        let mode = if direction > 0.0 { devices.kind.outflow(gate) } else { devices.kind.inflow(gate) };
        let (link, current) = (bank.here.state.link.get(self.lane), self.currents(bank)[leg]);
        following + devices.clamp(mode).map_or(0.0, |clamp| self.taken(clamp.potential(link, current)))
    }

    /// Returns the current in A that charges a terminal's capacitance through a device at the upper rail as the link's voltage changes;
    /// zero for a device at the lower rail. The device is the one that carries a phase current of this direction.
    fn following<V: Wide>(&self, bank: &Bank<'a, V>, direction: f64, leg: usize) -> f64 {
        let bridge = &self.case.inverter.bridge;
        let gate = bank.machine.legs.gates[leg].of(self.lane, self.time(bank));
        let kind = bridge.devices.kind;
        let mode = if direction > 0.0 { kind.outflow(gate) } else { kind.inflow(gate) };
        if !mode.is_upper() || bridge.terminal_capacitance == 0.0 {
            return 0.0;
        }
        let here = &bank.here;
        let mut rise = here.source.rise.get(self.lane);
        let link = &self.case.inverter.link;
        if let Some(storage) = link.storage {
            let (current, time) = (self.currents(bank), self.time(bank));
            let modes = bank.machine.legs.modes(self.lane, time);
            let taken: f64 = (0..3).filter(|k| modes[*k].is_upper()).map(|k| current[k]).sum();
            let lack = here.source.voltage.get(self.lane) - here.state.link.get(self.lane);
            rise = (link.delivered(lack) - taken) / storage.capacitance;
        }
        bridge.terminal_capacitance * rise
    }

    /// Returns the time derivative in A/s of the current that [`Self::following`] returns. `slopes` contains the time
    /// derivatives of the legs' currents in A/s.
    fn following_slope<V: Wide>(
        &self,
        bank: &Bank<'a, V>,
        direction: f64,
        leg: usize,
        slopes: [f64; 3],
    ) -> f64 {
        let following = self.following(bank, direction, leg);
        let capacitance = self.case.inverter.bridge.terminal_capacitance;
        if following == 0.0 {
            return 0.0;
        }
        let time = self.time(bank);
        let rise = bank.here.source.rise.get(self.lane);
        let link = &self.case.inverter.link;
        let Some(storage) = link.storage else {
            let later = bank.machine.links.source_of(self.lane, time * 1e-9 + SOON).rise;
            return capacitance * (later - rise) / SOON;
        };
        let modes = bank.machine.legs.modes(self.lane, time);
        let taken: f64 = (0..3).filter(|k| modes[*k].is_upper()).map(|k| slopes[k]).sum();
        let lack = bank.here.source.voltage.get(self.lane) - bank.here.state.link.get(self.lane);
        let limited = link.most_current.is_some_and(|most| link.delivered(lack) >= most);
        let fed = if limited { 0.0 } else { (rise - following / capacitance) / storage.source_resistance };
        capacitance * (fed - taken) / storage.capacitance
    }

    /// Returns the largest distance in V from a bound at which a leg's potential counts as being at the bound; less than half of the
    /// distance between the bounds, unless the potential changes by more within `shortest` in s.
    fn near<V: Wide>(&self, bank: &Bank<'a, V>, leg: usize, shortest: f64) -> f64 {
        let [low, high] = self.band(bank, leg);
        let mut near = (bank.bounds.slack.blocked.get(self.lane) * POTENTIAL_DEEP).min((high - low) / 4.0);
        if shortest > 0.0 {
            let potential = bank.here.state.potential[leg].get(self.lane);
            let charge = (self.currents(bank)[leg] + self.taken(potential)).abs() * shortest;
            near += charge / self.case.inverter.bridge.terminal_capacitance;
        }
        near
    }

    /// Returns the potentials in V, lower and upper bound, beyond which a device of a leg begins to conduct.
    fn band<V: Wide>(&self, bank: &Bank<'a, V>, leg: usize) -> [f64; 2] {
        let gate = bank.machine.legs.gates[leg].of(self.lane, self.time(bank));
        let (low, high) = self.case.inverter.bridge.bounds_of(leg, gate, bank.here.state.link.get(self.lane));
        [low, high]
    }

    /// Finds the conduction modes from gates, potentials and currents. A potential beyond its bounds, as after a switch has
    /// turned on, moves to the nearer bound at once. A current that flows out of the leg at the lower bound, or into the
    /// leg at the upper bound, flows through a device; all other currents charge their terminals.
    ///
    /// A current that passes through zero within `shortest` in s counts as zero: the sign of its slope decides, not the
    /// sign of the current.
    pub(super) fn settle_terminals<V: Wide>(
        &mut self,
        bank: &mut Bank<'a, V>,
        shortest: f64,
    ) -> Result<(), RunError> {
        let (lane, time) = (self.lane, self.time(bank));
        self.found = time;
        let current = self.currents(bank);
        if !current.iter().all(|current| current.is_finite()) {
            return Err(RunError::NotFinite(bank.place(self.lane)));
        }
        let gates = self.gates(bank);
        let near: [f64; 3] = std::array::from_fn(|k| self.near(bank, k, shortest));
        let link = bank.here.state.link.get(lane);
        let bands: [[f64; 2]; 3] = std::array::from_fn(|k| self.band(bank, k));
        let held: [f64; 3] = std::array::from_fn(|k| {
            let [low, high] = bands[k];
            bank.here.state.potential[k].get(lane).max(low).min(high)
        });
        let bridge = self.case.inverter.bridge;
        let kind = bridge.devices.kind;
        // The current of the leg's device decides: phase current, capacitive current and divider's current. If it is zero, its slope
        // decides. A mode against the direction of the current would end before it began, over and over up to the next edge.
        let carried: [[f64; 2]; 3] =
            std::array::from_fn(|k| [1.0, -1.0].map(|way| current[k] + self.beside(bank, way, k)));
        let is_one = |k: usize| bands[k][1] - bands[k][0] <= ONE_BOUND * link;
        let again = shortest > 0.0;
        let is_none = |k: usize, way: usize, slope: f64| {
            carried[k][way].abs() <= bank.bounds.slack.leg[k].get(lane) + slope.abs() * shortest
        };
        let damped = bridge.terminal_resistance > 0.0;
        let least = NO_CURRENT * self.case.motor.rated_current;
        // `slopes`: slopes of the device's current in A/s, for current out of the leg and into it.
        let mode = |k: usize, slopes: [f64; 2]| {
            let [low, high] = bands[k];
            if is_one(k) {
                // With one bound only, the leg conducts for either direction of its current.
                let way = if again && is_none(k, 0, slopes[0]) { slopes[0] } else { carried[k][0] };
                return if way < 0.0 { kind.inflow(gates[k]) } else { kind.outflow(gates[k]) };
            }
            // So small a slope is a rounding error times the resistance: it makes no device conduct.
            let rises = slopes.map(|slope| if damped && slope.abs() * SOON <= least { 0.0 } else { slope });
            let way = |way: usize| if is_none(k, way, slopes[way]) { rises[way] } else { carried[k][way] };
            if way(0) > 0.0 && held[k] <= low + near[k] {
                kind.outflow(gates[k])
            } else if way(1) < 0.0 && held[k] >= high - near[k] {
                kind.inflow(gates[k])
            } else {
                Conduction::Blocked
            }
        };
        let potential_in = |k: usize, mode: Conduction| {
            bridge.devices.clamp(mode).map_or(held[k], |clamp| clamp.potential(link, current[k]))
        };
        // The modes of legs with a current do not depend on the slopes of the currents, so they are found first; the slopes depend on
        // these modes. The ringing resistance acts only in legs that certainly have no conducting device. In an undecided leg, the slope
        // with that resistance would let a device begin to conduct at once, and the slope without it would end this at once.
        let undecided = |k: usize| !is_one(k) && (is_none(k, 0, 0.0) || is_none(k, 1, 0.0));
        let mut modes: Modes = std::array::from_fn(|k| mode(k, [0.0; 2]));
        let behind: [f64; 3] = std::array::from_fn(|k| {
            let rings = modes[k] == Conduction::Blocked && !undecided(k);
            let met = if rings { bridge.terminal_resistance * current[k] } else { 0.0 };
            potential_in(k, modes[k]) - met
        });
        if again || (0..3).any(undecided) {
            let rise = self.rise(bank, behind);
            let slopes = self.axes(bank).map(|axis| axis.dot(rise));
            modes = std::array::from_fn(|k| {
                mode(k, [1.0, -1.0].map(|way| slopes[k] + self.following_slope(bank, way, k, slopes)))
            });
        }
        self.join(bank, modes, gates, current);
        self.expect(bank, modes, &bands, behind);
        bank.machine.legs.put(lane, modes);
        Ok(())
    }

    /// Charges terminals through their devices at this instant. A conducting leg's terminal takes the potential of its device. Another
    /// terminal moves to a bound if it is beyond this bound. `current` contains the currents of the legs in A.
    fn join<V: Wide>(&mut self, bank: &mut Bank<'a, V>, modes: Modes, gates: [Gate; 3], current: [f64; 3]) {
        let lane = self.lane;
        let (bridge, storage) = (&self.case.inverter.bridge, self.case.inverter.link.storage);
        let capacitance = bridge.terminal_capacitance;
        let share = storage.map_or(0.0, |of| capacitance / of.capacitance);
        let potential = bank.here.state.potential.each_ref().map(|of| of.get(lane));
        let before = Joined { potential, link: bank.here.state.link.get(lane), share };
        let after = before.settle(|k, link| {
            if let Some(clamp) = bridge.devices.clamp(modes[k]) {
                return (clamp.potential(link, current[k]), modes[k].is_upper());
            }
            let (low, high) = bridge.bounds_of(k, gates[k], link);
            let held = potential[k].max(low).min(high);
            (held, if held >= high { gates[k] != Gate::Low } else { held <= low && gates[k] == Gate::High })
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
