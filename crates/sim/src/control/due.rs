//! Instants of a run: requests to legs that have been carried out, instants of the DC source, and waiting of a machine at rest.

use standstill_interface::Nanos;
use standstill_numeric::{Lane, Wide};

use super::run::Control;
use crate::effect::{Effect, each_effect};
use crate::lanes::bank::Bank;
use crate::physics::gates::NEVER;

impl<'a> Control<'a> {
    /// Replaces each request that has been carried out at a time in ns by the next request.
    pub(super) fn carry_out_requests<V: Wide>(&mut self, bank: &mut Bank<'a, V>, time: f64) {
        for k in 0..3 {
            while self.is_carried_out(bank, time, k) {
                self.sequencer.carry_out(&mut bank.machine.legs, self.lane, k);
            }
        }
    }

    /// Returns whether, at a time in ns, the pending request to leg `k` can have no further effect on the conduction of the leg.
    pub(super) fn is_carried_out<V: Wide>(&self, bank: &Bank<'a, V>, time: f64, k: usize) -> bool {
        let legs = &bank.machine.legs;
        let (direction, both) = (legs.direction(self.lane, k), legs.has_mosfets(self.lane));
        legs.gates[k].is_carried_out(self.lane, time, direction, both)
    }

    /// Replaces the executed request to leg `k` by the next request.
    pub fn carry_out<V: Wide>(&mut self, bank: &mut Bank<'a, V>, k: usize) {
        self.sequencer.carry_out(&mut bank.machine.legs, self.lane, k);
    }

    /// Returns the first time in ns after `time` in ns at which a voltage sag of the DC source begins, reaches its middle or ends. A
    /// long step could otherwise miss the sag.
    pub(super) fn next_source_instant(&self, time: f64) -> f64 {
        let Some(sag) = self.case.inverter.link.sag else { return NEVER };
        [0.0, 0.5, 1.0]
            .into_iter()
            .map(|share| Nanos::from_seconds(sag.start + share * sag.duration).0 as f64)
            .find(|at| *at > time)
            .unwrap_or(NEVER)
    }

    /// Returns the time in ns of the next edge of a gate after `time`.
    pub(super) fn next_edge<V: Wide>(&self, bank: &Bank<'a, V>, time: f64) -> f64 {
        let [a, b, c] = &bank.machine.legs.gates;
        let [a, b, c] = [a, b, c].map(|gates| gates.next_of(self.lane, time).0);
        a.least(b).least(c)
    }

    /// Returns whether the machine rests until the next instant: no current flows, the rotor does not move, and nothing that stores
    /// energy or varies with time could start either.
    pub(super) fn rests<V: Wide>(&self, bank: &Bank<'a, V>) -> bool {
        let machine = &bank.machine;
        let mut rests = machine.legs.idle_lanes() >> self.lane & 1 == 1
            && !self.motion.moves()
            && self.case.inverter.link.sag.is_none();
        each_effect!(machine, machine.branch.as_ref(), effect => rests &= Effect::<V>::is_still(effect));
        rests
    }

    /// Advances the time of a resting machine to `until` in ns.
    pub(super) fn wait<V: Wide>(&mut self, bank: &mut Bank<'a, V>, until: f64) {
        self.watch_waiting(bank, until);
        bank.here.time.put(self.lane, until);
        self.stale = true;
        self.show_change(bank);
    }
}
