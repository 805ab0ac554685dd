//! The potentials of the terminals on drives with voltage dividers, and the filters behind the dividers.

use standstill_inverter::{Conduction, Gate, Modes};
use standstill_numeric::Wide;

use super::conduction::One;
use super::run::Control;
use crate::lanes::bank::Bank;
use crate::sensing::LowPass;
use crate::step::two_derivative::Here;

impl<'a> Control<'a> {
    /// Returns the potentials of the terminals in V against the negative rail, with these gates and modes of the legs. For an open
    /// wire, returns the potential of the end at the drive.
    ///
    /// While no device conducts, leakages and dividers set the common potential of the three blocked terminals. Without dividers,
    /// equal leakages of both switches hold this potential halfway between the bounds. Dividers pull the mean potential to the
    /// negative rail (`Σ v_k / R = 0`) until a device begins to conduct.
    pub(super) fn potentials<V: Wide>(
        &self,
        bank: &Bank<'a, V>,
        here: &Here<V>,
        modes: Modes,
        gates: [Gate; 3],
    ) -> [f64; 3] {
        let mut potentials = self.potentials_of_winding(bank, here, modes, gates);
        for k in 0..3 {
            if let Some(share) = self.open_end(k, here.time.get(self.lane)) {
                potentials[k] = share * here.state.link.get(self.lane);
            }
        }
        potentials
    }

    /// Returns the potential of the drive's end of an open wire at a time in ns, as a share of the link's voltage. The leg's rail,
    /// the leakages or the divider determine this potential. None if the wire is intact.
    fn open_end(&self, k: usize, time: f64) -> Option<f64> {
        if !self.case.inverter.bridge.disconnected[k] {
            return None;
        }
        let loaded = self.case.sensors.settings.load().is_some();
        Some(match self.sequencer.intended(k, time) {
            Some(Gate::High) => 1.0,
            Some(Gate::Low) => 0.0,
            _ if loaded => 0.0,
            _ => 0.5,
        })
    }

    /// Sets the machine's next instant to `stop` in ns, or to the next change of the potential at the drive's end of an open wire if that
    /// is earlier. Such changes matter only to filters behind dividers of terminals with a capacitance.
    pub(super) fn stop_at<V: Wide>(&self, bank: &mut Bank<'a, V>, stop: f64) {
        let stop = self.hold_open_ends(bank, stop);
        bank.schedule.stop.put(self.lane, stop);
    }

    /// Passes the present potentials of the drive's ends of open wires to the filters behind the dividers of terminals with a capacitance.
    /// Returns the time in ns at which one of these potentials changes next, or `stop` if that is earlier.
    fn hold_open_ends<V: Wide>(&self, bank: &mut Bank<'a, V>, stop: f64) -> f64 {
        let divided = bank.sensed.as_mut().and_then(|sensed| sensed.divided.as_mut());
        let Some(divided) = divided.filter(|_| !self.case.faults.is_empty()) else { return stop };
        let time = bank.here.time.get(self.lane);
        let held = [0, 1, 2].map(|k| self.open_end(k, time));
        divided.hold(self.lane, held);
        let moves = (0..3).filter(|k| held[*k].is_some()).map(|k| self.sequencer.next_intended(k, time));
        moves.fold(stop, f64::min)
    }

    /// Returns the potentials in V of the winding's ends, also behind an open wire.
    fn potentials_of_winding<V: Wide>(
        &self,
        bank: &Bank<'a, V>,
        here: &Here<V>,
        modes: Modes,
        gates: [Gate; 3],
    ) -> [f64; 3] {
        let lane = self.lane;
        if bank.machine.legs.elastance.is_some() {
            return here.state.potential.map(|potential| potential.get(lane));
        }
        let one = One::of(bank, here, lane);
        let port = one.port(self.currents_at(bank, here));
        let bridge = &self.case.inverter.bridge;
        let potential = bridge.potentials(gates, modes, &port);
        if self.case.sensors.settings.load().is_none() || modes != [Conduction::Blocked; 3] {
            return potential;
        }
        let (mut down, mut up) = (f64::NEG_INFINITY, f64::INFINITY);
        for (gate, potential) in gates.into_iter().zip(potential) {
            let (low, high) = bridge.bounds(gate, port.dc_link);
            down = down.max(low - potential);
            up = up.min(high - potential);
        }
        let mean = potential.iter().sum::<f64>() / 3.0;
        let shift = (-mean).min(up).max(down);
        potential.map(|potential| potential + shift)
    }

    /// Returns the voltages in V at the dividers, or at the outputs of their filters, at the present time. A gate edge at the same
    /// time counts as later.
    pub(super) fn terminals_at_sample<V: Wide>(&self, bank: &Bank<'a, V>) -> [f64; 3] {
        if let Some(filters) = &self.terminal_filters {
            return filters.map(|filter| filter.output());
        }
        if let Some(divided) = bank.sensed.as_ref().and_then(|sensed| sensed.divided.as_ref()) {
            return divided.at(self.lane);
        }
        let before = self.time(bank).next_down();
        let legs = &bank.machine.legs;
        let gates = std::array::from_fn(|k| legs.gates[k].of(self.lane, before));
        self.potentials(bank, &bank.here, legs.modes(self.lane, before), gates)
    }

    /// Sets up the filters behind the dividers, with the potentials at rest as their outputs.
    pub(super) fn set_up_dividers<V: Wide>(&mut self, bank: &mut Bank<'a, V>) {
        let Some(corner) = self.case.sensors.settings.terminal.and_then(|of| of.bandwidth) else { return };
        let at_rest = self.potentials(bank, &bank.here, [Conduction::Blocked; 3], [Gate::Off; 3]);
        if let Some(divided) = bank.sensed.as_mut().and_then(|sensed| sensed.divided.as_mut()) {
            divided.put(self.lane, corner, at_rest);
        } else {
            self.terminal_filters = Some(at_rest.map(|potential| LowPass::new(corner, potential)));
        }
    }

    /// Advances the filters behind the dividers over the last accepted step. `thirds` contains the states of the
    /// machines at one third and two thirds of the step.
    pub(super) fn follow_dividers<V: Wide>(&mut self, bank: &Bank<'a, V>, thirds: &[Here<V>; 2]) {
        let Some(mut filters) = self.terminal_filters else { return };
        let (lane, step) = (self.lane, &bank.outcome.tried);
        let begin = bank.outcome.begin.time.get(lane);
        let legs = &bank.machine.legs;
        let gates = std::array::from_fn(|k| legs.gates[k].of(lane, begin));
        let modes = legs.modes(lane, begin);
        let points = [&bank.outcome.begin, &thirds[0], &thirds[1], &step.end]
            .map(|here| self.potentials(bank, here, modes, gates));
        advance(&mut filters, step.h.get(lane), &points);
        self.terminal_filters = Some(filters);
    }

    /// Advances the filters behind the dividers over an interval without current, from `begin` to `until` in ns. If the DC
    /// link ripples, the interval is divided into `parts`.
    pub(super) fn rest_dividers<V: Wide>(&mut self, bank: &Bank<'a, V>, begin: f64, until: f64, parts: f64) {
        let Some(mut filters) = self.terminal_filters else { return };
        if until <= begin {
            return;
        }
        let gates = self.gates(bank);
        let at = |share: f64| {
            let mut here = bank.here;
            here.time.put(self.lane, begin + (until - begin) * share);
            bank.machine.links.look(self.lane, &mut here);
            self.potentials(bank, &here, [Conduction::Blocked; 3], gates)
        };
        let mut part = 0.0;
        while part < parts {
            let points = [0.0, 1.0, 2.0, 3.0].map(|thirds: f64| at((part + thirds / 3.0) / parts));
            advance(&mut filters, (until - begin) * 1e-9 / parts, &points);
            part += 1.0;
        }
        self.terminal_filters = Some(filters);
    }
}

/// Advances the filters over `h` seconds, given the potentials in V at four equally spaced times.
fn advance(filters: &mut [LowPass; 3], h: f64, points: &[[f64; 3]; 4]) {
    for (k, filter) in filters.iter_mut().enumerate() {
        filter.advance(h, points.map(|potential| potential[k]));
    }
}
