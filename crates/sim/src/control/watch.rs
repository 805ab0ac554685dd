//! The observer of a run and its snapshots. Also the filters and the energy balance, which need values within steps.

use standstill_interface::Phase;
use standstill_inverter::{Gate, Modes};
use standstill_numeric::{Heading, Wide};

use super::run::Control;
use crate::lanes::bank::{Bank, Outcome};
use crate::step::two_derivative::Here;
use crate::trace::{Event, Snapshot};

impl<'a> Control<'a> {
    /// Advances filters, energy balance and observer over the last accepted step. `thirds` contains the states of the machines at
    /// one third and two thirds of the step.
    pub fn follow<V: Wide>(&mut self, bank: &Bank<'a, V>, thirds: &[Here<V>; 2]) {
        if let Some(filter) = &mut self.link_filter {
            let points = [&bank.outcome.begin, &thirds[0], &thirds[1], &bank.outcome.tried.end]
                .map(|here| here.state.link.get(self.lane));
            filter.advance(bank.outcome.tried.h.get(self.lane), points);
        }
        self.follow_dividers(bank, thirds);
        if V::ALONE {
            if let Some(mut accounts) = self.accounts.take() {
                accounts.follow(self, bank);
                self.accounts = Some(accounts);
            }
            self.watch(bank);
        }
    }

    /// Returns the longest time in s between two snapshots of the observer; none if there is no observer, or if it
    /// takes no snapshots.
    fn resolution(&self) -> Option<f64> {
        self.probe.as_ref().and_then(|probe| probe.resolution())
    }

    /// Passes snapshots and gate edges within the last accepted step to the observer.
    fn watch<V: Wide>(&mut self, bank: &Bank<'a, V>) {
        let Some(resolution) = self.resolution() else { return };
        let (begin, end) =
            (bank.outcome.begin.time.get(self.lane), bank.outcome.tried.end.time.get(self.lane));
        let h = (end - begin) * 1e-9;
        // A number of snapshots per step is small and positive.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let parts = (h / resolution).ceil().max(1.0) as u32;
        let mut shown_until = [begin; 3];
        for part in 1..=parts {
            let share = f64::from(part) / f64::from(parts);
            let time = begin + (end - begin) * share;
            while let Some((k, at, gate)) = self.next_gate(bank, shown_until, time) {
                shown_until[k] = at;
                if gate != self.shown.1[k] {
                    let there = bank.within(((at - begin) / (end - begin)).clamp(0.0, 1.0));
                    self.show(bank, &there);
                    self.shown.1[k] = gate;
                    self.event(at * 1e-9, Event::Gate(Phase::ALL[k], gate));
                }
            }
            if part == parts {
                self.show(bank, &bank.outcome.tried.end);
            } else {
                self.show(bank, &bank.within(share));
            }
        }
        self.show_change(bank);
    }

    /// Returns the first gate edge before the time `before` in ns and after the time `after` in ns of its leg: number of the leg, time
    /// in ns of the edge, and new gate.
    fn next_gate<V: Wide>(
        &self,
        bank: &Bank<'a, V>,
        after: [f64; 3],
        before: f64,
    ) -> Option<(usize, f64, Gate)> {
        let legs = &bank.machine.legs;
        let edges = (0..3).map(|k| {
            let (at, gate) = legs.gates[k].next_of(self.lane, after[k]);
            (k, at, gate)
        });
        let ahead = edges.filter(|(k, at, _)| *at > after[*k] && *at < before);
        ahead.min_by(|(_, a, _), (_, b, _)| a.total_cmp(b))
    }

    /// Reports gates and conduction modes that have changed since the last report to the observer, with a snapshot before and one
    /// after the change.
    #[inline]
    pub(super) fn show_change<V: Wide>(&mut self, bank: &Bank<'a, V>) {
        if V::ALONE && self.probe.is_some() {
            self.show_what_changed(bank);
        }
    }

    #[inline(never)]
    fn show_what_changed<V: Wide>(&mut self, bank: &Bank<'a, V>) {
        let time = self.time(bank);
        let (modes, gates) = (bank.machine.legs.modes(self.lane, time), self.gates(bank));
        let (old_modes, old_gates) = self.shown;
        if (modes, gates) == self.shown {
            return;
        }
        self.show_now(bank);
        for (k, phase) in Phase::ALL.into_iter().enumerate() {
            if gates[k] != old_gates[k] {
                self.event(time * 1e-9, Event::Gate(phase, gates[k]));
            }
        }
        for (k, phase) in Phase::ALL.into_iter().enumerate() {
            if modes[k] != old_modes[k] {
                self.event(time * 1e-9, Event::Conduction(phase, modes[k]));
            }
        }
        self.shown = (modes, gates);
        self.show_now(bank);
    }

    /// Advances the observer and the sensors' filters over a time in which the machine rests, up to `until` in ns.
    pub(super) fn watch_waiting<V: Wide>(&mut self, bank: &mut Bank<'a, V>, until: f64) {
        if bank.sensed.is_some() || bank.control.follow {
            self.follow_waiting(bank, until);
        }
    }

    #[inline(never)]
    fn follow_waiting<V: Wide>(&mut self, bank: &mut Bank<'a, V>, until: f64) {
        let begin = self.time(bank);
        let h = (until - begin) * 1e-9;
        bank.rest_sensors(self.lane, h);
        let link = &self.case.inverter.link;
        // A filter's input is a cubic through four points; a long wait with several periods of the ripple is therefore divided.
        let ripples = link.ripple != 0.0;
        let parts = if ripples { (8.0 * h * link.ripple_frequency).ceil().max(1.0) } else { 1.0 };
        self.rest_dividers(bank, begin, until, parts);
        if let Some(filter) = &mut self.link_filter
            && h > 0.0
        {
            let mut part = 0.0;
            while part < parts {
                let points = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|share| {
                    let time = begin * 1e-9 + (part + share) / parts * h;
                    bank.machine.links.source_of(self.lane, time).voltage
                });
                filter.advance(h / parts, points);
                part += 1.0;
            }
        }
        if V::ALONE {
            self.watch_resting(bank, until);
        }
    }

    #[inline(never)]
    fn watch_resting<V: Wide>(&mut self, bank: &Bank<'a, V>, until: f64) {
        let Some(resolution) = self.resolution() else { return };
        let begin = self.time(bank);
        let h = (until - begin) * 1e-9;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let parts = (h / resolution).ceil().max(1.0) as u32;
        let mut here = bank.here;
        for part in 1..=parts {
            here.time.put(self.lane, begin + (until - begin) * f64::from(part) / f64::from(parts));
            bank.machine.links.look(self.lane, &mut here);
            self.show(bank, &here);
        }
    }

    /// Shows the machine's present state to the observer.
    #[inline]
    pub(super) fn show_here<V: Wide>(&mut self, bank: &Bank<'a, V>) {
        if V::ALONE && self.probe.is_some() {
            self.show_now(bank);
        }
    }

    #[inline(never)]
    fn show_now<V: Wide>(&mut self, bank: &Bank<'a, V>) {
        if self.resolution().is_some() {
            let here = self.place(bank);
            self.show(bank, &here);
        }
    }

    /// Returns the present state of the machine with the present voltage of the link.
    fn place<V: Wide>(&self, bank: &Bank<'a, V>) -> Here<V> {
        let mut here = bank.here;
        bank.machine.links.look(self.lane, &mut here);
        here
    }

    fn show<V: Wide>(&mut self, bank: &Bank<'a, V>, here: &Here<V>) {
        let (modes, gates) = self.shown;
        let snapshot = self.snapshot(bank, here, modes, gates);
        if let Some(probe) = &mut self.probe {
            probe.snapshot(&snapshot);
        }
    }

    /// Returns a snapshot of the machine at the present simulated time. It works in a run without a probe, too.
    pub fn now<V: Wide>(&self, bank: &Bank<'a, V>) -> Snapshot {
        let modes = bank.machine.legs.modes(self.lane, self.time(bank));
        self.snapshot(bank, &self.place(bank), modes, self.gates(bank))
    }

    fn snapshot<V: Wide>(
        &self,
        bank: &Bank<'a, V>,
        here: &Here<V>,
        modes: Modes,
        gates: [Gate; 3],
    ) -> Snapshot {
        let lane = self.lane;
        Snapshot {
            time: here.time.get(lane) * 1e-9,
            current: self.currents_at(bank, here),
            potential: self.potentials(bank, here, modes, gates),
            dc_link: here.state.link.get(lane),
            angle: self.case.start_angle + here.state.turned.get(lane),
            speed: here.state.speed.get(lane),
            torque: self.torque(bank, here),
            modes,
            comparator: self.comparators.as_ref().map(super::comparators::Watching::state),
        }
    }

    /// Returns the electromagnetic torque in N·m, also of a locked rotor, whose steps do not compute it.
    fn torque<V: Wide>(&self, bank: &Bank<'a, V>, here: &Here<V>) -> f64 {
        let (lane, state, motor) = (self.lane, &here.state, self.case.motor);
        let angle = self.case.start_angle + state.turned.get(lane);
        let turned = Heading::of(state.turned.get(lane));
        let mut core = here.at.current;
        let Outcome { begin, begin_branch, tried, .. } = &bank.outcome;
        let passed = bank.here.time.get(lane) > here.time.get(lane);
        if let Some(branch) = if passed { begin_branch } else { &bank.machine.branch } {
            // Within a step, the play cells follow the path of the flux, which has this tangent at the step's beginning.
            let along = tried.change[0].flux * ((here.time - begin.time) * 1e-9);
            core = core - branch.at(state.flux, passed.then_some(along)).current;
        }
        core = bank.machine.without_shorted(state, core);
        let (flux, current) = (state.flux.get(lane).to_rotor(turned), core.get(lane).to_rotor(turned));
        let magnetic = motor.magnetics.state(flux, Heading::of(angle));
        motor.torque(flux, current, magnetic.energy_slope) + motor.cogging(angle)
    }
}
