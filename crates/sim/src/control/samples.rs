//! The samples of a run: their instants and the values taken there.

use standstill_interface::{Nanos, Reading};
use standstill_inverter::Gate;
use standstill_numeric::Wide;

use super::comparators::Watching;
use super::course::Course;
use super::run::Control;
use crate::lanes::bank::Bank;
use crate::sensing::Instant;
use crate::trace::Event;

/// Room for readings and samples, handed on from run to run. Its contents are not used.
#[derive(Debug, Default)]
pub struct Room {
    pub(super) readings: Vec<Reading<f64>>,
    pub(super) taken: Vec<Instant>,
}

impl<'a> Control<'a> {
    /// Returns the run's room for those that follow.
    pub fn into_room(self) -> Room {
        Room { readings: self.readings, taken: self.sampler.into_room() }
    }

    /// Makes the next trigger pending: the first one, or the one after the pending trigger.
    pub(super) fn next_trigger(&mut self) {
        let Course { start, end, sampling, number, pending, .. } = self.course;
        let last = pending.map_or(start, |(_, at)| at);
        self.course.pending = (number < sampling.count).then(|| {
            let nominal = sampling.trigger(number);
            // Jitter may bring two triggers out of order; a converter takes them one after the other.
            (nominal, self.sampler.instant(start + nominal, start, end).max(last))
        });
        self.course.number += 1;
    }

    /// Returns whether samples are interpolated within steps. Filters are as exact within a step as at its ends, and
    /// their outputs do not act on the machine, so steps need not end at samples. Steps do end at samples where a
    /// capacitor or a filter stores the link's voltage, or where a sample depends on a request.
    pub(super) fn reads_within<V: Wide>(&self, bank: &Bank<'a, V>) -> bool {
        let settings = &self.case.sensors.settings;
        settings.bandwidth.is_some()
            && settings.acquisition == 0.0
            && !settings.arrangement.follows_legs()
            && (settings.terminal.is_none() || settings.divides(bank.machine.legs.elastance.is_some()))
            && self.link_filter.is_none()
            && bank.machine.links.storage.is_none()
    }

    /// Takes the samples that lie within the step just accepted.
    pub fn sample_within<V: Wide>(&mut self, bank: &mut Bank<'a, V>) {
        let now = self.time(bank);
        while let Some((nominal, at)) = self.course.pending
            && at.0 as f64 <= now
            && self.reads_within(bank)
            && let Some(sensed) = &bank.sensed
        {
            // Those of the phases that are still to come, which may be later than the step.
            let (first, skew) = (self.course.taken, self.case.sensors.settings.skew);
            let mut times = [at; 3];
            for k in first + 1..3 {
                times[k] = (times[k - 1] + skew).min(self.course.end);
            }
            let times = times.map(|time| time.0 as f64);
            let current = sensed.within(self.lane, times);
            let dc_link = bank.machine.links.source_of(self.lane, times[first] * 1e-9).voltage;
            // Taken with the first phase.
            let divided = if first == 0 { sensed.divided_within(self.lane, times[0]) } else { None };
            let terminal = divided.unwrap_or_default();
            for time in &times[first..] {
                let read = *time <= now
                    && self.take::<V>(
                        nominal,
                        *time,
                        current,
                        dc_link,
                        terminal,
                        ([Gate::Off; 3], [true; 3]),
                    );
                if read || *time > now {
                    break;
                }
            }
        }
        self.expect_sample(bank);
    }

    /// Writes the time of the next sample into the bank's schedule; after the last sample, the end of the command,
    /// because the next command may sample at once.
    pub(super) fn expect_sample<V: Wide>(&self, bank: &mut Bank<'a, V>) {
        let end = self.course.end;
        let next = self.course.pending.map_or(end, |(_, at)| at.min(end));
        bank.schedule.sample.put(self.lane, next.0 as f64);
    }

    /// Takes the sample that is due.
    #[inline(never)]
    pub(super) fn sample<V: Wide>(&mut self, bank: &mut Bank<'a, V>, nominal: Nanos) {
        if self.stale {
            self.look_at_link(bank);
        }
        let settings = &self.case.sensors.settings;
        let (mut current, mut requests) = (self.currents(bank), ([Gate::Off; 3], [true; 3]));
        if settings.arrangement.follows_legs() {
            // The drive knows its requests at the trigger and at each further conversion, not when the sample was really taken.
            let later = settings.conversion * u64::from(self.course.conversions);
            let at = (self.course.start + nominal + later).min(self.course.end);
            requests = (self.sequencer.requested(at), self.settled(at));
            // Samples come before gate edges of the same instant.
            let modes = bank.machine.legs.modes(self.lane, self.time(bank).next_down());
            current = settings.seen(current, modes);
        }
        if let Some(sensed) = &bank.sensed {
            current = sensed.at(self.lane, current);
        }
        let link = bank.here.state.link.get(self.lane);
        let dc_link = self.link_filter.map_or(link, |filter| filter.output());
        let terminal = if settings.terminal.is_some() { self.terminals_at_sample(bank) } else { [0.0; 3] };
        self.take::<V>(nominal, self.time(bank), current, dc_link, terminal, requests);
    }

    /// Returns for each leg whether the drive takes the amplifier of its shunt to have settled at `at`, a time of this
    /// command. It has settled when the dead time and the settling time have passed since the last request to the leg;
    /// for a shunt in the DC link, since the last request to any leg.
    fn settled(&self, at: Nanos) -> [bool; 3] {
        let settings = &self.case.sensors.settings;
        if settings.settle == Nanos::ZERO {
            return [true; 3];
        }
        let dead = self.case.inverter.gates.map(|gates| gates.dead_time);
        let changed = self.sequencer.changed(at);
        let settled: [bool; 3] = std::array::from_fn(|k| {
            changed[k].is_none_or(|changed| at >= changed + dead[k] + settings.settle)
        });
        if settings.arrangement == crate::Arrangement::DcLinkShunt {
            return [settled == [true; 3]; 3];
        }
        settled
    }

    /// Takes the values at a time in ns: currents in A, the link's voltage in V and the terminals' voltages in V.
    /// Returns whether all phases have been taken. The last argument has the requested gates, and whether each
    /// leg's amplifier has settled.
    fn take<V: Wide>(
        &mut self,
        nominal: Nanos,
        time: f64,
        current: [f64; 3],
        dc_link: f64,
        terminal: [f64; 3],
        (requested, settled): ([Gate; 3], [bool; 3]),
    ) -> bool {
        let settings = &self.case.sensors.settings;
        let (skew, oversampling, conversion) = (settings.skew, settings.oversampling, settings.conversion);
        if self.course.taken == 0 {
            self.course.terminal = terminal;
        }
        let mut current = current;
        let open = self.case.inverter.bridge.disconnected;
        if open != [false; 3] && !settings.arrangement.follows_legs() {
            // Behind an open wire a sensor has nothing to read, though the winding may ring with the cable's capacitance.
            current = std::array::from_fn(|k| if open[k] { 0.0 } else { current[k] });
        }
        let Some((current, dc_link)) = self.course.converted(current, dc_link, skew) else { return false };
        let there = Instant {
            terminal: self.course.terminal,
            requested,
            settled,
            capture: self.comparators.as_ref().and_then(Watching::capture),
            ..Instant::new(nominal, time, current, dc_link)
        };
        if self.sampler.take(there) || self.probe.is_some() {
            self.read_out::<V>();
        }
        if oversampling <= 1 || !self.course.repeats(oversampling, conversion) {
            self.next_trigger();
        }
        true
    }

    /// Returns whether a sample only reads currents and the link's voltage as they are, and nothing but ends of modes, edges
    /// of gates, samples and ends of commands are instants of the run.
    pub(super) fn has_plain_samples<V: Wide>(&self, bank: &Bank<'a, V>) -> bool {
        let settings = &self.case.sensors.settings;
        let link = &self.case.inverter.link;
        settings.skew == Nanos::ZERO
            && settings.oversampling <= 1
            && !settings.arrangement.follows_legs()
            && settings.terminal.is_none()
            && self.comparators.is_none()
            && self.link_filter.is_none()
            && self.case.faults.is_empty()
            && self.probe.is_none()
            && self.accounts.is_none()
            && bank.sensed.is_none()
            && bank.machine.legs.elastance.is_none()
            && link.sag.is_none()
            && link.storage.is_none()
    }

    /// Takes the plain sample that is due after a step under current, and sets the next instant. Returns whether that is
    /// all there is to do.
    #[inline]
    pub(super) fn passes_sample<V: Wide>(&mut self, bank: &mut Bank<'a, V>) -> bool {
        let lane = self.lane;
        let (time, end) = (self.time(bank), self.course.end);
        let idle = bank.machine.legs.idle_lanes() >> lane & 1 == 1;
        let Some((nominal, at)) = self.course.pending else { return false };
        if idle || at >= end || bank.schedule.sample.get(lane) > time {
            return false;
        }
        let current = self.currents(bank);
        self.take_plain::<V>(nominal, time, current, bank.here.state.link.get(lane));
        let next = self.course.pending.map_or(end, |(_, at)| at.min(end)).0 as f64;
        if next <= time {
            return false;
        }
        self.segments += 1;
        bank.schedule.stop.put(lane, next);
        bank.schedule.sample.put(lane, next);
        true
    }

    /// Takes the plain samples that are due up to a time in ns before which nothing else happens to a drive at rest.
    pub(super) fn sample_at_rest<V: Wide>(&mut self, bank: &Bank<'a, V>, until: f64) {
        let mut passed = self.time(bank);
        let mut current = None;
        while let Some((nominal, at)) = self.course.pending
            && at.0 as f64 <= until
        {
            let time = at.0 as f64;
            self.segments += u64::from(time > passed && time < until);
            passed = time;
            let current = *current.get_or_insert_with(|| self.currents(bank));
            let dc_link = bank.machine.links.source_of(self.lane, time * 1e-9).voltage;
            self.take_plain::<V>(nominal, time, current, dc_link);
        }
    }

    /// Takes a plain sample at a time in ns: currents in A, and the link's voltage in V.
    #[inline]
    fn take_plain<V: Wide>(&mut self, nominal: Nanos, time: f64, mut current: [f64; 3], dc_link: f64) {
        let open = self.case.inverter.bridge.disconnected;
        for k in 0..3 {
            current[k] = if open[k] { 0.0 } else { current[k] };
        }
        if self.sampler.take(Instant::new(nominal, time, current, dc_link)) {
            self.read_out::<V>();
        }
        self.next_trigger();
    }

    /// Converts the samples taken so far, and reports their readings to the observer.
    fn read_out<V: Wide>(&mut self) {
        let (known, time) = (self.readings.len(), self.sampler.last_taken());
        self.sampler.convert::<V>(&mut self.readings);
        if let Some(probe) = &mut self.probe {
            // An observer is shown each sample by itself.
            for reading in &self.readings[known..] {
                probe.event(time * 1e-9, Event::Sample(*reading));
            }
        }
    }

    /// Returns the readings that have been converted.
    pub fn readings(&self) -> &[Reading<f64>] {
        &self.readings
    }

    /// Returns the readings of the command so far.
    pub fn read<V: Wide>(&mut self) -> &[Reading<f64>] {
        self.read_out::<V>();
        &self.readings
    }
}
