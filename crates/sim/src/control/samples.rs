//! The samples of a run: when they are due, and what is there then.

use standstill_interface::{Nanos, Reading};
use standstill_inverter::Gate;
use standstill_numeric::Wide;

use super::course::Course;
use super::run::Control;
use crate::lanes::bank::Bank;
use crate::sensing::Instant;
use crate::trace::Event;

impl<'a> Control<'a> {
    /// The trigger after the one that is pending, or the first.
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

    /// Takes the sample that is due.
    #[inline(never)]
    pub(super) fn sample<V: Wide>(&mut self, bank: &mut Bank<'a, V>, nominal: Nanos) {
        if self.stale {
            self.look_at_link(bank);
        }
        let settings = &self.case.sensors.settings;
        let (mut current, mut requested) = (self.currents(bank), [Gate::Off; 3]);
        if settings.arrangement == crate::Arrangement::LowSideShunts {
            // The drive knows what it told the legs at the trigger, not when the sample was really taken.
            requested = self.lines.told(self.course.start + nominal);
            // Samples come before gate edges of the same instant.
            let modes = bank.machine.legs.modes(self.lane, self.time(bank).next_down());
            current = settings.seen(current, modes);
        }
        if let Some(filters) = &self.filters {
            current = filters.map(|filter| filter.output());
        }
        if let Some(ringing) = &self.ringing {
            let added = ringing.at(self.time(bank));
            current = current.map(|current| current + added);
        }
        let link = bank.here.state.link.get(self.lane);
        let dc_link = self.link_filter.map_or(link, |filter| filter.output());
        let Some((current, dc_link)) = self.course.converted(current, dc_link, settings.skew) else { return };
        let there = Instant { current, dc_link, requested };
        let reading: Reading<f64> = self.sampler.read(nominal, &there);
        if self.probe.is_some() {
            self.event(self.time(bank) * 1e-9, Event::Sample(reading.current.0, reading.dc_link));
        }
        self.readings.push(reading);
        self.next_trigger();
    }
}
