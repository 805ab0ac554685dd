//! The samples of a run: their instants and the values taken there.

use standstill_interface::{Nanos, Reading};
use standstill_inverter::Gate;
use standstill_numeric::Wide;

use super::course::Course;
use super::run::Control;
use crate::lanes::bank::Bank;
use crate::sensing::Instant;
use crate::trace::Event;

impl<'a> Control<'a> {
    /// Makes the next trigger pending: the one after the pending trigger, or the first.
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

    /// Returns whether samples are read off the steps that pass them: filters follow a step between its ends as
    /// exactly as at its ends, and their outputs change nothing in the machine. Where a capacitor or a filter stores
    /// the link's voltage, or a sample depends on a request, steps end at samples.
    pub(super) fn reads_within<V: Wide>(&self, bank: &Bank<'a, V>) -> bool {
        let settings = &self.case.sensors.settings;
        settings.bandwidth.is_some()
            && settings.arrangement != crate::Arrangement::LowSideShunts
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
            for time in &times[first..] {
                let read = *time <= now && self.convert(nominal, *time, current, dc_link, [Gate::Off; 3]);
                if read || *time > now {
                    break;
                }
            }
        }
        self.expect_sample(bank);
    }

    /// Writes the time of the next reading of the sensors into the bank's schedule. After its end the next command
    /// may read them at once.
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
        let (mut current, mut requested) = (self.currents(bank), [Gate::Off; 3]);
        if settings.arrangement == crate::Arrangement::LowSideShunts {
            // The drive knows its requests at the trigger, not when the sample was really taken.
            requested = self.sequencer.requested(self.course.start + nominal);
            // Samples come before gate edges of the same instant.
            let modes = bank.machine.legs.modes(self.lane, self.time(bank).next_down());
            current = settings.seen(current, modes);
        }
        if let Some(sensed) = &bank.sensed {
            current = sensed.at(self.lane, current);
        }
        let link = bank.here.state.link.get(self.lane);
        let dc_link = self.link_filter.map_or(link, |filter| filter.output());
        self.convert(nominal, self.time(bank), current, dc_link, requested);
    }

    /// Converts the values at a time in ns: currents in A and the link's voltage in V. Returns whether the reading is
    /// complete.
    fn convert(
        &mut self,
        nominal: Nanos,
        time: f64,
        current: [f64; 3],
        dc_link: f64,
        requested: [Gate; 3],
    ) -> bool {
        let skew = self.case.sensors.settings.skew;
        let Some((current, dc_link)) = self.course.converted(current, dc_link, skew) else { return false };
        let there = Instant { current, dc_link, requested };
        let mut reading: Reading<f64> = self.sampler.read(nominal, &there);
        if let Some(watching) = &self.comparators {
            reading.capture = watching.capture();
        }
        if self.probe.is_some() {
            self.event(time * 1e-9, Event::Sample(reading.current.0, reading.dc_link));
        }
        self.readings.push(reading);
        self.next_trigger();
        true
    }
}
