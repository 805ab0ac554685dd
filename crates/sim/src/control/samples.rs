//! The samples of a run: their instants, and the values that are taken at them.

use standstill_interface::{Nanos, Reading};
use standstill_inverter::Gate;
use standstill_numeric::Wide;

use super::comparators::Watching;
use super::course::Course;
use super::past::Past;
use super::run::Control;
use crate::lanes::bank::Bank;
use crate::sensing::Instant;
use crate::trace::Event;

/// Allocated memory for readings and samples, which the next run in a lane reuses. Its contents are not used.
#[derive(Debug, Default)]
pub struct Room {
    pub(super) readings: Vec<Reading<f64>>,
    pub(super) taken: Vec<Instant>,
    pub(super) past: Past,
}

impl<'a> Control<'a> {
    /// Returns the run's allocated memory, for the next run.
    pub fn into_room(self) -> Room {
        Room { readings: self.readings, taken: self.sampler.into_room(), past: self.past }
    }

    /// Makes the next trigger pending: the first trigger, or the trigger that follows the pending trigger.
    pub(super) fn next_trigger(&mut self) {
        let Course { start, end, sampling, number, pending, .. } = self.course;
        let last = pending.map_or(start, |(_, at)| at);
        self.course.pending = (number < sampling.count).then(|| {
            let nominal = sampling.trigger(number);
            // Jitter may exchange two triggers, but a converter takes them in order.
            (nominal, self.sampler.instant(start + nominal, start, end).max(last))
        });
        self.course.number += 1;
    }

    /// Returns whether samples may lie within steps. The filters' outputs are as exact within a step as at its ends, and do not act
    /// on the machine, so steps need not end at samples. Steps end at samples if a capacitor or a filter stores the link's
    /// voltage, or if a sample depends on a request to the legs.
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
            // Times of the phases that have not been taken; they may be later than the step.
            let (first, skew) = (self.course.taken, self.case.sensors.settings.skew);
            let mut times = [at; 3];
            for k in first + 1..3 {
                times[k] = (times[k - 1] + skew).min(self.course.end);
            }
            let times = times.map(|time| time.0 as f64);
            let current = sensed.within(self.lane, times);
            let dc_link = bank.machine.links.source_of(self.lane, times[first] * 1e-9).voltage;
            // The terminals are taken together with the first phase.
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
            // The drive goes by its requests at the nominal time of the trigger and of each further conversion.
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

    /// Returns for each leg whether the drive assumes that the amplifier of its shunt has settled at `at`, a time of this command:
    /// the dead time and the settling time have passed since the last change of the request to the leg. For a shunt in the
    /// DC link, this must hold for all legs.
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

    /// Takes values at a time in ns into the pending sample: currents in A, the link's voltage in V and the terminals' voltages in V.
    /// `requested` contains the requests to the legs.
    /// `settled` is true for each leg whose amplifier has settled. Returns whether all phases of the conversion have been taken.
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
            // A sensor on the drive's side of an open wire reads no current, even if the winding rings with the cable's capacitance.
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

    /// Returns whether the samples of this run are plain: each one only reads the unfiltered currents and link voltage, and the run has
    /// no other instants than ends of modes, gate edges, samples and ends of commands.
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

    /// Takes the plain sample that is due after a step with current, and sets the next instant. Returns whether nothing else is due,
    /// so that the next step can be taken.
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

    /// Takes the plain samples that are due up to `until` in ns, for a machine at rest without other instants before that time.
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
            // With an observer, samples are converted one by one, so this time is that of the only reading.
            for reading in &self.readings[known..] {
                probe.event(time * 1e-9, Event::Sample(*reading));
            }
        }
    }

    /// Returns the readings that have been converted, without converting the pending samples.
    pub fn readings(&self) -> &[Reading<f64>] {
        &self.readings
    }

    /// Converts the samples taken so far, and returns all readings of the present command.
    pub fn read<V: Wide>(&mut self) -> &[Reading<f64>] {
        self.read_out::<V>();
        &self.readings
    }
}
