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
            && settings.terminal.is_none()
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
                let read = *time <= now
                    && self.convert(nominal, *time, current, dc_link, [0.0; 3], ([Gate::Off; 3], [true; 3]));
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
        self.convert(nominal, self.time(bank), current, dc_link, terminal, requests);
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

    /// Converts the values at a time in ns: currents in A, the link's voltage in V and the terminals' voltages in V.
    /// Returns whether all phases have been converted. The last argument has the requested gates, and whether each
    /// leg's amplifier has settled.
    fn convert(
        &mut self,
        nominal: Nanos,
        time: f64,
        current: [f64; 3],
        dc_link: f64,
        terminal: [f64; 3],
        (requested, settled): ([Gate; 3], [bool; 3]),
    ) -> bool {
        let settings = &self.case.sensors.settings;
        let skew = settings.skew;
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
        let there = Instant { time, current, dc_link, terminal: self.course.terminal, requested, settled };
        let mut reading: Reading<f64> = self.sampler.read(nominal, &there);
        if settings.oversampling > 1 {
            match self.course.averaged(reading, settings.oversampling, settings.conversion) {
                Some(mean) => reading = mean,
                None => return true,
            }
        }
        if let Some(watching) = &self.comparators {
            reading.capture = watching.capture();
        }
        if self.probe.is_some() {
            self.event(time * 1e-9, Event::Sample(reading));
        }
        self.readings.push(reading);
        self.next_trigger();
        true
    }
}
