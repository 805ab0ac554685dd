//! Who watches a run, and what follows its steps from within: snapshots, the sensors' filters, the ledger.

use standstill_interface::Phase;
use standstill_numeric::Wide;

use super::conduction::One;
use super::gates::matters;
use super::run::Control;
use crate::lockstep::lanes::bank::Bank;
use crate::lockstep::step::two_derivative::Here;
use crate::trace::{Event, Snapshot};

/// Currents in A and link voltage in V at one time.
type Point = ([f64; 3], f64);

impl<'a> Control<'a> {
    /// Follows the step that was just accepted, of which the bank has the inside at one and two thirds.
    pub fn follow<V: Wide>(&mut self, bank: &Bank<'a, V>, thirds: &[Here<V>; 2]) {
        if self.filters.is_some() || self.link_filter.is_some() {
            let h = bank.tried.h.get(self.lane);
            let points = [&bank.begin, &thirds[0], &thirds[1], &bank.tried.end]
                .map(|here| (self.currents_at(bank, here), here.state.link.get(self.lane)));
            self.filter(h, points);
        }
        if let Some(mut accounts) = self.accounts.take() {
            accounts.follow(self, bank);
            self.accounts = Some(accounts);
        }
        self.watch(bank);
    }

    fn filter(&mut self, h: f64, points: [Point; 4]) {
        if h <= 0.0 {
            return;
        }
        let (settings, modes) = (self.case.sensors.settings, self.modes);
        if let Some(filters) = &mut self.filters {
            let seen = points.map(|(current, _)| settings.seen(current, modes));
            for (k, filter) in filters.iter_mut().enumerate() {
                filter.advance(h, seen.map(|current| current[k]));
            }
        }
        if let Some(filter) = &mut self.link_filter {
            filter.advance(h, points.map(|(_, link)| link));
        }
    }

    /// Shows who watches the step just accepted, and the gate edges on the way.
    fn watch<V: Wide>(&mut self, bank: &Bank<'a, V>) {
        let Some(resolution) = self.probe.as_ref().and_then(|probe| probe.resolution()) else { return };
        let (begin, end) = (bank.begin.time.get(self.lane), bank.tried.end.time.get(self.lane));
        let h = (end - begin) * 1e-9;
        // A number of snapshots per step is small and positive.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let parts = (h / resolution).ceil().max(1.0) as u32;
        for part in 1..=parts {
            let share = f64::from(part) / f64::from(parts);
            let time = begin + (end - begin) * share;
            while let Some((leg, (at, gate))) = self.gates.due(time.next_down())
                && !matters(self.modes[leg], gate)
            {
                let there = bank.within(((at - begin) / (end - begin)).clamp(0.0, 1.0));
                self.show(bank, &there);
                self.gates.take(leg);
                self.event(at * 1e-9, Event::Gate(Phase::ALL[leg], gate));
            }
            if part == parts {
                self.show(bank, &bank.tried.end);
            } else {
                self.show(bank, &bank.within(share));
            }
        }
    }

    /// Lets a time pass in which nothing happens, up to a time in ns: for who watches and for the sensors' filters.
    pub(super) fn watch_waiting<V: Wide>(&mut self, bank: &mut Bank<'a, V>, until: f64) {
        let begin = self.time(bank);
        let h = (until - begin) * 1e-9;
        if h > 0.0 && (self.filters.is_some() || self.link_filter.is_some()) {
            let link = &self.case.inverter.link;
            let ripples = self.link_filter.is_some() && link.ripple != 0.0;
            // A filter takes a cubic through four points: too few for a ripple of which a long wait has several periods.
            let parts = if ripples { (8.0 * h * link.ripple_frequency).ceil().max(1.0) } else { 1.0 };
            let mut part = 0.0;
            while part < parts {
                let points = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|share| {
                    let time = begin * 1e-9 + (part + share) / parts * h;
                    ([0.0; 3], bank.machine.links.source_of(self.lane, time).voltage)
                });
                self.filter(h / parts, points);
                part += 1.0;
            }
        }
        self.watch_resting(bank, until);
    }

    #[inline(never)]
    fn watch_resting<V: Wide>(&mut self, bank: &Bank<'a, V>, until: f64) {
        let Some(resolution) = self.probe.as_ref().and_then(|probe| probe.resolution()) else { return };
        let begin = self.time(bank);
        let h = (until - begin) * 1e-9;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let parts = (h / resolution).ceil().max(1.0) as u32;
        let mut here = bank.here.clone();
        for part in 1..=parts {
            let time = begin + (until - begin) * f64::from(part) / f64::from(parts);
            here.time.put(self.lane, time);
            here.state.link.put(self.lane, bank.machine.links.source_of(self.lane, time * 1e-9).voltage);
            self.show(bank, &here);
        }
    }

    /// Shows the machine as it is to who watches.
    #[inline]
    pub(super) fn show_here<V: Wide>(&mut self, bank: &Bank<'a, V>) {
        if self.probe.is_some() {
            self.show_now(bank);
        }
    }

    #[inline(never)]
    fn show_now<V: Wide>(&mut self, bank: &Bank<'a, V>) {
        if self.probe.as_ref().and_then(|probe| probe.resolution()).is_some() {
            let mut here = bank.here.clone();
            if bank.machine.links.storage.is_none() {
                let time = here.time.get(self.lane) * 1e-9;
                here.state.link.put(self.lane, bank.machine.links.source_of(self.lane, time).voltage);
            }
            self.show(bank, &here);
        }
    }

    fn show<V: Wide>(&mut self, bank: &Bank<'a, V>, here: &Here<V>) {
        let lane = self.lane;
        let current = self.currents_at(bank, here);
        let one = One::of(bank, here, lane);
        let port = one.port(current, self.case.motor.resistance);
        let potential = self.case.inverter.bridge.potentials(self.gates.now(), self.modes, &port);
        let snapshot = Snapshot {
            time: here.time.get(lane) * 1e-9,
            current,
            potential,
            dc_link: one.dc_link,
            angle: self.case.start_angle + here.state.turned.get(lane),
            speed: here.state.speed.get(lane),
            torque: self.torque(here),
            modes: self.modes,
        };
        if let Some(probe) = &mut self.probe {
            probe.snapshot(&snapshot);
        }
    }

    /// Electromagnetic torque in N·m, also of a locked rotor, whose steps do without.
    fn torque<V: Wide>(&self, here: &Here<V>) -> f64 {
        let lane = self.lane;
        let state = &here.state;
        let angle = self.case.start_angle + state.turned.get(lane);
        let turned = standstill_numeric::Heading::of(state.turned.get(lane));
        let plane = |v: &crate::lockstep::physics::plane::Plane<V>| {
            crate::lockstep::physics::plane::Plane::new(v.x.get(lane), v.y.get(lane)).to_rotor(turned)
        };
        let motor = self.case.motor;
        let (flux, current) = (plane(&state.flux), plane(&here.at.current));
        let magnetic = motor.magnetics.state(flux, standstill_numeric::Heading::of(angle));
        motor.torque(flux, current, magnetic.energy_slope) + motor.cogging(angle)
    }
}
