//! Trains of line pulses in both directions, and the zeroing of the sensors before them.
//!
//! ```text
//!   zero ─► AB+ ─► AB− ─► BC+ ─► BC− ─► CA+ ─► CA−   CA− ─► CA+ ─► BC− ─► …   round after round
//!
//!   one pulse:   i ╱╲      on for t1, then all gates off until the current is gone and a little longer
//!             ____╱  ╲___
//! ```
//! Each line carries equal forward and backward currents. That cancels the effect of saturation on the inductance to
//! first order, moves a free rotor back to its initial position, and separates the two effects. Even rounds run
//! backwards, so that a slow drift does not look like a difference of the lines.

mod edge;
mod gains;
mod instants;
mod rest;
mod ringing;
mod slot;
#[cfg(test)]
mod tests;

use standstill_interface::{Abc, Command, Fault, Nanos, Phase, Reading, Real, Sampling, Stage};

use crate::keys::{Lines, Microseconds};
use crate::nameplate::{Nameplate, Place};
use crate::parts::margin::Margin;
use crate::parts::settle::{all_seen, largest_beyond, link, link_current, seen};
use crate::settings::{LONGEST, SettingsError, require, require_positive, require_zero_or_more};
pub(crate) use gains::GainComparison;
pub(crate) use rest::{rest_after, share_of};
use ringing::FALLEN;
pub(crate) use slot::{Derived, Slot};

/// The lines: from the first phase to the second.
pub(crate) const LINES: [(Phase, Phase); 3] =
    [(Phase::A, Phase::B), (Phase::B, Phase::C), (Phase::C, Phase::A)];

/// Longest interval between samples before the first pulse.
pub(crate) const ZEROING_INTERVAL: Nanos = Nanos::from_micros(10);

/// Settings of a train.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulseTrainSettings<T> {
    /// t1: how long the DC link is across a line.
    pub pulse: Nanos,
    /// Time for which all gates are off after a pulse; longer than the current needs to decay.
    pub rest: Nanos,
    /// Number of rounds of six pulses.
    pub rounds: u8,
    /// Interval between ADC samples; the pulse is a multiple of it.
    pub interval: Nanos,
    /// Number of samples before the first pulse that determine the sensors' offsets.
    pub zeroing: u16,
    /// Phase current in A below which the current counts as decayed. Before the first pulse, while offsets are unknown,
    /// the threshold limits the change of the readings, and twice the threshold limits the readings.
    pub threshold: T,
    /// Number of zeroings before the detection fails because a current does not decay.
    pub attempts: u16,
    /// Least current in A that a pulse must raise.
    pub least_current: T,
    /// Dead time of the drive.
    pub dead_time: Nanos,
    /// Resistance of a phase in Ω with that of a device.
    pub resistance: T,
    /// Voltage in V that the two switches in a line take from the link while it drives the current.
    pub on_drop: T,
    /// Voltage in V that the two diodes add to the link while the current decays.
    pub off_drop: T,
    /// Arrangement of the current sensors.
    pub place: Place,
    /// Time from the end of a current until terminals with a capacitance no longer ring with the winding. A shorter
    /// rest is prolonged: always if no sensor shows that current, otherwise until the current is gone.
    pub ringing: Nanos,
}

impl<T: Real> PulseTrainSettings<T> {
    /// Returns settings for this motor and drive: pulses that raise half of the rated current (200 µs on the paper's
    /// motor), in three rounds (9.4 ms there). The samples are `interval` apart, or the next larger time that
    /// divides the pulse evenly.
    pub fn suited(drive: &Nameplate<T>, interval: Nanos) -> Self {
        let pulse = drive.line_pulse(T::of(0.5));
        let parts = (pulse.0 / interval.0.max(1)).max(1);
        let parts = (1..=parts).rev().find(|parts| pulse.0.is_multiple_of(*parts)).unwrap_or(1);
        Self {
            pulse,
            rest: rest_after(pulse),
            rounds: 3,
            interval: Nanos(pulse.0 / parts),
            zeroing: 30,
            threshold: drive.rated_current * T::of(0.025),
            attempts: 400,
            least_current: drive.rated_current * T::of(0.05),
            dead_time: drive.dead_time,
            resistance: drive.resistance + (drive.switch_drop[1] + drive.diode_drop[1]) / T::of(2.0),
            on_drop: drive.switch_drop[0] * T::of(2.0),
            off_drop: drive.diode_drop[0] * T::of(2.0),
            place: drive.sensing.place,
            ringing: ringing::time(drive),
        }
    }

    /// Returns the train with pulses of another length and the same number of samples.
    #[must_use]
    pub fn with_pulse(self, pulse: Nanos) -> Self {
        let interval = Nanos(pulse.0 / (self.samples_on() as u64).max(1));
        let pulse = interval * self.samples_on() as u64;
        Self { pulse, interval, rest: rest_after(pulse), ..self }
    }

    /// Calls `line` with the settings that an engineer would copy into a drive.
    pub(crate) fn describe(&self, line: &mut Lines<'_>) {
        line("train.pulse", format_args!("{}", Microseconds(self.pulse)));
        line("train.rest", format_args!("{}", Microseconds(self.rest)));
        line("train.rounds", format_args!("{}", self.rounds));
        line("train.interval", format_args!("{}", Microseconds(self.interval)));
    }

    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        require(self.pulse > Nanos::ZERO, "pulse", "positive")?;
        require(self.dead_time < self.pulse, "dead_time", "shorter than the pulse")?;
        require(self.rest > self.pulse, "rest", "longer than the pulse: the current needs as long to decay")?;
        require(self.period() <= LONGEST, "rest", "such that a pulse takes a minute at most")?;
        require(self.rounds > 0, "rounds", "at least 1")?;
        require(self.interval > Nanos::ZERO, "interval", "positive")?;
        require(
            self.pulse.0.is_multiple_of(self.interval.0.max(1)),
            "interval",
            "a whole fraction of the pulse",
        )?;
        let few = u16::try_from(self.samples()).is_ok();
        require(few, "interval", "such that a pulse has 65,535 samples at most")?;
        require(self.zeroing > 0, "zeroing", "at least 1")?;
        require_positive(self.threshold, "threshold")?;
        require(self.attempts > 0, "attempts", "at least 1")?;
        require_positive(self.least_current, "least_current")?;
        require_zero_or_more(self.resistance, "resistance")?;
        require_zero_or_more(self.on_drop, "on_drop")?;
        require_zero_or_more(self.off_drop, "off_drop")
    }

    /// Returns the rest as a share of the pulse, as it was set.
    pub(crate) fn rest_share(&self) -> f64 {
        share_of(self.pulse, self.rest)
    }

    /// Sets the rest as a share of the present pulse.
    pub(crate) fn set_rest_share(&mut self, share: f64) {
        self.rest = Nanos::from_seconds(share * self.pulse.seconds());
    }

    /// Returns the time from the begin of one pulse to that of the next.
    pub fn period(&self) -> Nanos {
        self.pulse + self.rest
    }

    /// Returns the number of samples of one pulse and its decay.
    pub(crate) fn samples(&self) -> usize {
        usize::try_from(self.period().0 / self.interval.0.max(1)).unwrap_or(usize::MAX)
    }

    /// Returns the number of samples up to the end of the pulse; the last of them is at its very end.
    pub(crate) fn samples_on(&self) -> usize {
        usize::try_from(self.pulse.0 / self.interval.0.max(1)).unwrap_or(usize::MAX)
    }
}

/// Gives the pulses of a train one after the other.
#[derive(Clone, Debug)]
pub(crate) struct Train<T> {
    pub settings: PulseTrainSettings<T>,
    /// Time before the end of its interval at which each sample of a pulse is taken.
    pub lead: Nanos,
    /// Whether the sample at the end of a pulse does not show its peak, because it is partly taken after the edge, or
    /// because the edge disturbs it.
    pub spoilt_end: bool,
    zeroings: u16,
    /// Number of pulses given; the field after it is the number of the pulse whose readings come next.
    given: u16,
    under_way: Option<Slot>,
    started: bool,
    /// Time of the commands given so far.
    pub clock: Nanos,
    /// Sum in ns, by line, of the instants at which the pulses of this train end.
    ends: [u64; 3],
    /// Number of the present wait for a current that has not decayed; none while no such current is known.
    waits: u16,
    /// Peak in A of the last pulse.
    last_peak: T,
    /// Offsets of the sensors in A.
    pub offset: Abc<T>,
    /// Variance in A² of a reading by noise, from the zeroing.
    pub noise: T,
    /// Phases without a sensor, as seen so far.
    pub derived: Derived,
    /// Margin to a fault; the method adds the margins of its own checks.
    pub margin: Margin<T>,
}

impl<T: Real> Train<T> {
    pub fn new(settings: PulseTrainSettings<T>) -> Self {
        Self::leading(settings, Nanos::ZERO)
    }

    /// Makes a train whose pulses are sampled `lead` before the end of each interval.
    pub fn leading(settings: PulseTrainSettings<T>, lead: Nanos) -> Self {
        let zero = T::zero();
        Self {
            settings,
            lead,
            spoilt_end: false,
            zeroings: 0,
            given: 0,
            under_way: None,
            started: false,
            clock: Nanos::ZERO,
            ends: [0; 3],
            waits: 0,
            last_peak: zero,
            offset: Abc::new(zero, zero, zero),
            noise: zero,
            derived: if settings.place == Place::BelowLegs { Derived::Several } else { Derived::None },
            margin: Margin::new(),
        }
    }

    /// Evaluates the readings of the last command. Returns the pulse that they belong to; none if the command was no
    /// pulse.
    pub fn take(&mut self, readings: &[Reading<T>]) -> Result<Option<Slot>, Fault<T>> {
        if !self.started {
            return Ok(None);
        }
        if self.waits > 0 {
            if readings.len() != self.samples_of_wait() {
                return Err(Fault::UnexpectedReadings);
            }
            self.decayed(readings)?;
            return Ok(None);
        }
        if let Some(slot) = self.under_way {
            let s = &self.settings;
            if readings.len() != s.samples() {
                return Err(Fault::UnexpectedReadings);
            }
            let peak = self.peak(slot, readings)?;
            let needed = self.settings.least_current;
            self.margin.at_least(peak, needed);
            if peak < needed || !peak.is_finite() {
                return Err(Fault::NoCurrent { peak, needed });
            }
            // The shunt that shows a current is known, and one shunt in the link has one gain for all lines.
            if self.settings.place == Place::InLine {
                self.derived = readings.iter().fold(self.derived, Derived::with);
            }
            self.last_peak = peak;
            let fallen = s.samples_on() * FALLEN / 5;
            self.decayed(&readings[fallen.min(readings.len() - 1)..])?;
            return Ok(Some(slot));
        }
        self.zero(readings)?;
        Ok(None)
    }

    fn zero(&mut self, readings: &[Reading<T>]) -> Result<(), Fault<T>> {
        if readings.len() != usize::from(self.settings.zeroing) {
            return Err(Fault::UnexpectedReadings);
        }
        let zero = T::zero();
        let mut sum = Abc::new(zero, zero, zero);
        for reading in readings {
            let seen = self.seen(reading)?;
            for phase in Phase::ALL {
                sum[phase] = sum[phase] + seen[phase];
            }
            link(reading)?;
        }
        self.offset = sum.map(|sum| sum / T::of(readings.len() as f64));
        self.noise = self.scatter(readings)?;
        // A current that decays changes the readings; one that does not decay exceeds any offset.
        let mut most = self.offset.0.iter().fold(zero, |most, offset| most.max(offset.abs())) / T::of(2.0);
        for reading in readings {
            most = most.max(self.beyond_offset(reading)?);
        }
        let (gone, last) = (most <= self.settings.threshold, self.zeroings >= self.settings.attempts);
        if gone || last {
            let s = self.settings;
            self.margin.waited(self.zeroings, s.attempts, most / s.threshold);
            // All gates are off: what stays is an offset, which no further wait takes away.
            self.margin.at_most(most, s.threshold);
        }
        if gone {
            self.zeroings = 0;
        } else if last {
            return Err(Fault::CurrentPersists(most));
        }
        Ok(())
    }

    /// Returns the phase currents in A as the sensors show them; with a shunt in the link, its current for each phase.
    fn seen(&self, reading: &Reading<T>) -> Result<Abc<T>, Fault<T>> {
        if self.settings.place == Place::InLink {
            link_current(reading).map(|current| Abc([current; 3]))
        } else {
            all_seen(reading)
        }
    }

    /// Returns the largest current in A that a sensor shows, without offsets.
    fn beyond_offset(&self, reading: &Reading<T>) -> Result<T, Fault<T>> {
        if self.settings.place == Place::InLink {
            return Ok((link_current(reading)? - self.offset[Phase::A]).abs());
        }
        largest_beyond(reading, &self.offset)
    }

    fn following(&mut self) -> Option<Command<T>> {
        let s = self.settings;
        // A zeroing that found no rest is repeated.
        if !self.started || (self.given == 0 && self.zeroings > 0) {
            self.started = true;
            self.zeroings += 1;
            let count = u32::from(s.zeroing);
            let interval = s.interval.min(ZEROING_INTERVAL);
            let sampling = Sampling { first: interval, interval, count };
            return Some(Command::hold(Stage::off(interval * u64::from(count)), sampling));
        }
        if self.waits > 0 {
            return Some(self.wait());
        }
        if self.given >= u16::from(s.rounds) * 6 {
            self.under_way = None;
            return None;
        }
        let slot = Slot::of(self.given);
        self.given += 1;
        self.under_way = Some(slot);
        self.ends[slot.line] += (self.clock + s.pulse).0;
        let (from, to) = slot.phases();
        let count = u32::try_from(s.samples()).unwrap_or(u32::MAX);
        let sampling = Sampling { first: s.interval - self.lead, interval: s.interval, count };
        Some(Command::sequence(Stage::line(from, to, s.pulse), Stage::off(s.rest), sampling))
    }

    /// Returns whether the last pulse so far is the last one of its round.
    pub fn ends_round(&self) -> bool {
        self.given.is_multiple_of(6)
    }

    /// Begins again with other pulses; offsets stay.
    pub fn restart(&mut self, settings: PulseTrainSettings<T>) {
        self.settings = settings;
        self.given = 0;
        self.under_way = None;
        self.ends = [0; 3];
    }

    /// Returns the current in A at the end of a pulse: from the sample there, or, if that is disturbed, extrapolated
    /// from the one before.
    fn peak(&self, slot: Slot, readings: &[Reading<T>]) -> Result<T, Fault<T>> {
        let s = &self.settings;
        let (end, delay) = (s.samples_on() - 1, s.dead_time);
        let risen = s.interval * end as u64 - delay;
        if !self.spoilt_end || risen == Nanos::ZERO {
            return self.current(slot, &readings[end]);
        }
        let more = (s.pulse - delay).seconds() / risen.seconds();
        Ok(self.current(slot, &readings[end - 1])? * T::of(more))
    }

    /// Returns the line's current in A in the direction of the pulse, without offsets: the mean of the two sensors.
    pub fn current(&self, slot: Slot, reading: &Reading<T>) -> Result<T, Fault<T>> {
        let (from, to) = self.both(slot, reading)?;
        Ok((from + to) / T::of(2.0))
    }

    /// Returns the current from each of the two sensors: in the phase that it enters and in the phase that it leaves.
    /// One shunt in the link gives both values, and so does the one low-side shunt through which the current flows.
    #[inline]
    pub fn both(&self, slot: Slot, reading: &Reading<T>) -> Result<(T, T), Fault<T>> {
        let (from, to) = slot.phases();
        let returned = reading.at > self.settings.pulse;
        let one = match self.settings.place {
            Place::InLine => {
                let seen = all_seen(reading)?;
                return Ok((seen[from] - self.offset[from], self.offset[to] - seen[to]));
            }
            Place::InLink => {
                let drawn = link_current(reading)? - self.offset[Phase::A];
                if returned { -drawn } else { drawn }
            }
            Place::BelowLegs if returned => seen(reading, from)? - self.offset[from],
            Place::BelowLegs => self.offset[to] - seen(reading, to)?,
        };
        Ok((one, one))
    }
}
