//! A leg's terminal at an instant, before the leg's mode is known.

use standstill_inverter::Gate;
use standstill_numeric::Wide;

use super::SOON;
use crate::control::run::Control;
use crate::guard::POTENTIAL_DEEP;
use crate::lanes::bank::Bank;

/// The quantities of a leg and its terminal that decide which device conducts.
#[derive(Clone, Copy, Debug)]
pub struct Terminal {
    /// State of the leg's gates.
    pub gate: Gate,
    /// Phase current in A, positive out of the leg.
    pub current: f64,
    /// Lower and upper potential in V beyond which a device begins to conduct.
    pub band: [f64; 2],
    /// Potential in V; at the nearer bound if it is beyond.
    pub held: f64,
    /// Largest distance in V from a bound at which the potential counts as being at the bound: less than half of the distance between
    /// the bounds, unless the potential changes by more within the shortest step.
    pub near: f64,
    /// Current in A of the leg's device, for a phase current out of the leg and into it: phase current, current that charges the
    /// terminal's capacitance as the link's voltage changes, and divider's current.
    pub carried: [f64; 2],
}

impl<'a> Control<'a> {
    /// Returns the terminals of the legs at this instant. `shortest` is the length in s of the shortest step.
    pub(in crate::control) fn terminals<V: Wide>(&self, bank: &Bank<'a, V>, shortest: f64) -> [Terminal; 3] {
        let (lane, time) = (self.lane, self.time(bank));
        let bridge = &self.case.inverter.bridge;
        let kind = bridge.devices.kind;
        let current = self.currents(bank);
        let link = bank.here.state.link.get(lane);
        let deep = bank.bounds.slack.blocked.get(lane) * POTENTIAL_DEEP;
        let following = self.following(bank, current);
        let is_divided = bank.machine.legs.leak.is_some();
        std::array::from_fn(|k| {
            let (gate, current) = (bank.machine.legs.gates[k].of(lane, time), current[k]);
            let (low, high) = bridge.bounds_of(k, gate, link);
            let potential = bank.here.state.potential[k].get(lane);
            let mut near = deep.min((high - low) / 4.0);
            if shortest > 0.0 {
                let charge = (current + self.taken(potential)).abs() * shortest;
                near += charge / bridge.terminal_capacitance;
            }
            let carried = [kind.outflow(gate), kind.inflow(gate)].map(|mode| {
                let mut beside = if mode.is_upper() { following } else { 0.0 };
                if is_divided {
                    let clamp = bridge.devices.clamp(mode);
                    beside += clamp.map_or(0.0, |clamp| self.taken(clamp.potential(link, current)));
                }
                current + beside
            });
            Terminal { gate, current, band: [low, high], held: potential.max(low).min(high), near, carried }
        })
    }

    /// Returns the current in A through the divider of a terminal with this potential in V; zero without a divider.
    fn taken(&self, potential: f64) -> f64 {
        self.case.sensors.settings.load().map_or(0.0, |resistance| potential / resistance)
    }

    /// Returns the current in A that charges a terminal's capacitance through a device at the upper rail as the link's voltage changes.
    /// A device at the lower rail has none. `current` contains the legs' currents in A.
    fn following<V: Wide>(&self, bank: &Bank<'a, V>, current: [f64; 3]) -> f64 {
        let capacitance = self.case.inverter.bridge.terminal_capacitance;
        if capacitance == 0.0 {
            return 0.0;
        }
        let here = &bank.here;
        let mut rise = here.source.rise.get(self.lane);
        let link = &self.case.inverter.link;
        if let Some(storage) = link.storage {
            let lack = here.source.voltage.get(self.lane) - here.state.link.get(self.lane);
            rise = (link.delivered(lack) - self.at_upper_rail(bank, current)) / storage.capacitance;
        }
        capacitance * rise
    }

    /// Returns the time derivative in A/s of the current that [`Self::following`] returns. `slopes` contains the time derivatives of the
    /// legs' currents in A/s.
    pub(super) fn following_slope<V: Wide>(
        &self,
        bank: &Bank<'a, V>,
        current: [f64; 3],
        slopes: [f64; 3],
    ) -> f64 {
        let following = self.following(bank, current);
        if following == 0.0 {
            return 0.0;
        }
        let capacitance = self.case.inverter.bridge.terminal_capacitance;
        let rise = bank.here.source.rise.get(self.lane);
        let link = &self.case.inverter.link;
        let Some(storage) = link.storage else {
            let later = bank.machine.links.source_of(self.lane, self.time(bank) * 1e-9 + SOON).rise;
            return capacitance * (later - rise) / SOON;
        };
        let lack = bank.here.source.voltage.get(self.lane) - bank.here.state.link.get(self.lane);
        let limited = link.most_current.is_some_and(|most| link.delivered(lack) >= most);
        let fed = if limited { 0.0 } else { (rise - following / capacitance) / storage.source_resistance };
        capacitance * (fed - self.at_upper_rail(bank, slopes)) / storage.capacitance
    }

    /// Returns the sum of a quantity of the legs over those that a device connects to the upper rail.
    fn at_upper_rail<V: Wide>(&self, bank: &Bank<'a, V>, of_legs: [f64; 3]) -> f64 {
        let modes = bank.machine.legs.modes(self.lane, self.time(bank));
        (0..3).filter(|k| modes[*k].is_upper()).map(|k| of_legs[k]).sum()
    }
}
