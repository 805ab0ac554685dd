//! Line pulses in both directions, which also calibrate the current sensors.
//!
//! Per line, the mean of `L = U t1 / i2` over both directions cancels the effect of saturation to first order. The gain
//! mismatch of the sensors is measured (see [`crate::parts::train`]) and divided out; then equations (5)–(7) give the
//! axis. The difference of the forward and the backward inductance of each line points along the magnet, so the same
//! pulses also give the pole.
//!
//! i2 is sampled at the end of the pulse. If phases are converted one after the other, or edges disturb the readings,
//! that is too late: the last phases would be read in the decay, and jitter would move samples into and out of the
//! disturbance. Then i2 is sampled earlier (`Sensing::lead`), and t1 ends at the mean time at which the line's two
//! phases are converted, less the sensors' lag.

#[cfg(test)]
mod tests;

use standstill_interface::{AlphaBeta, Fault, Findings, Nanos, Phase, Reading, Real, Step};

use crate::checks::Checks;
use crate::keys::{Keyed, Lines, Setting, Value, place};
use crate::method::Sequence;
use crate::nameplate::{Nameplate, Place};
use crate::parts::both_ways::BothWaysSettings;
use crate::parts::lines::line_directions;
use crate::parts::losses::Losses;
use crate::parts::margin::Margin;
use crate::parts::polarity::{Pointer, Pole};
use crate::parts::settle::link;
use crate::parts::train::{GainComparison, Slot, Train};
use crate::parts::{instant, significance, turning};
use crate::settings::{SettingsError, Source, require};

/// Settings of the bipolar method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BipolarSettings<T>(pub BothWaysSettings<T>);

impl<T: Real> BipolarSettings<T> {
    /// Returns settings for this motor and drive.
    pub fn suited(drive: &Nameplate<T>) -> Self {
        // Four samples per pulse are enough to compare the sensors; shunts below the legs, compared at the pulse's end,
        // need ten. Fewer if the first one would come too early.
        let pulse = drive.line_pulse(T::of(0.5));
        let parts = if drive.sensing.place == Place::BelowLegs { 10 } else { 4 };
        let interval = Nanos(pulse.0 / parts).max(drive.sensing.lead() * 2);
        Self(BothWaysSettings::suited(drive, interval))
    }

    fn check(&self) -> Result<(), SettingsError> {
        self.0.train.check()?;
        require(self.0.train.rounds >= 2, "rounds", "at least 2, to see how the pulses scatter")?;
        self.0.check()?;
        let (train, lead) = (&self.0.train, self.0.sensing.lead());
        let needed = "such that a pulse is sampled before its end: all conversions of a sample and what an edge spoils within one interval";
        require(
            lead < train.interval && lead + train.dead_time < train.pulse,
            self.0.sensing.lead_key(),
            needed,
        )
    }
}

/// Statistics of the pulses of one line in one direction.
#[derive(Clone, Copy, Debug)]
struct Sums<T> {
    pulses: T,
    /// Mean of an inductance in H, or of the relative difference of two; the field after it is the sum of squared
    /// deviations from the mean.
    mean: T,
    squares: T,
}

impl<T: Real> Sums<T> {
    /// Adds a value by Welford's update, which keeps the digits of the squares in single precision.
    fn add(&mut self, inductance: T) {
        self.pulses = self.pulses + T::one();
        let apart = inductance - self.mean;
        self.mean = self.mean + apart / self.pulses;
        self.squares = self.squares + apart * (inductance - self.mean);
    }
}

/// The bipolar detector.
#[derive(Clone, Debug)]
pub struct Bipolar<T> {
    settings: BothWaysSettings<T>,
    train: Train<T>,
    /// Sums for each line, backward and forward.
    sums: [[Sums<T>; 2]; 3],
    /// Inductance in H of the first pulse of a pair (forward and backward); `differences`, the next field: relative
    /// differences of such pairs, by line.
    other_way: Option<T>,
    differences: [Sums<T>; 3],
    gains: GainComparison<T>,
    /// Sum of the voltages in V that drove the currents of all pulses.
    volts: T,
    losses: Losses<T>,
    findings: Findings<T>,
}

impl<T: Real> Bipolar<T> {
    /// Makes a detector, ready for its first step.
    ///
    /// # Errors
    /// The method cannot work with one of the settings.
    pub fn new(settings: BipolarSettings<T>) -> Result<Self, SettingsError> {
        settings.check()?;
        let none = Sums { pulses: T::zero(), mean: T::zero(), squares: T::zero() };
        Ok(Self {
            settings: settings.0,
            train: Train::leading(settings.0.train, settings.0.sensing.lead()),
            sums: [[none; 2]; 3],
            other_way: None,
            differences: [none; 3],
            gains: GainComparison::new(),
            volts: T::zero(),
            losses: Losses::new(),
            findings: Findings::default(),
        })
    }

    fn add(&mut self, slot: Slot, readings: &[Reading<T>]) -> Result<(), Fault<T>> {
        let s = &self.settings.train;
        match s.place {
            Place::InLine => {
                for (n, reading) in readings.iter().enumerate() {
                    let both = self.train.both(slot, reading)?;
                    if let Some(both) = self.at_once(slot, n, both) {
                        self.gains.add(slot, both);
                    }
                }
            }
            Place::BelowLegs => {
                if let Some(both) = self.train.at_edge(slot, readings, &self.settings.sensing)? {
                    self.gains.add(slot, both);
                }
            }
            // One shunt has no second sensor to compare, and its amplifier may clip what diodes return to the link.
            Place::InLink => {}
        }
        let end = &readings[s.samples_on() - 1];
        self.settings.check_pulse(&mut self.train, slot, end)?;
        let s = &self.settings.train;
        let current = self.train.current(slot, end)?;
        let sensing = &self.settings.sensing;
        let late = if s.place == Place::BelowLegs {
            sensing.late_of(slot.phases().1)
        } else {
            sensing.late(slot.line, self.train.derived)
        };
        let seconds = sensing.seen(self.risen(s.samples_on()) + late);
        let volts = link(end)? - s.on_drop;
        self.volts = self.volts + volts;
        self.losses.add(&self.train, slot, readings, volts)?;
        let inductance = volts * seconds / current;
        // This happens, for example, if the link's voltage is below the drops of the switches.
        if inductance <= T::zero() || !inductance.is_finite() {
            return Err(Fault::NotInductive(slot.phases().0));
        }
        self.sums[slot.line][usize::from(slot.forward)].add(inductance);
        // The two directions of a line follow each other, so changes from round to round do not enter their difference.
        match self.other_way.take() {
            Some(other) => {
                let [back, forward] = if slot.forward { [other, inductance] } else { [inductance, other] };
                let apart = T::of(2.0) * (back - forward) / (back + forward);
                self.differences[slot.line].add(apart);
            }
            None => self.other_way = Some(inductance),
        }
        Ok(())
    }

    /// Returns the time in s for which the current has risen when this many samples of a pulse have been triggered.
    fn risen(&self, samples: usize) -> T {
        let s = &self.settings.train;
        T::of((s.interval * samples as u64 - self.train.lead - s.dead_time).seconds())
    }

    /// Returns sample `n` of a pulse as if all phases had been converted at its trigger. While the current rises
    /// linearly, a phase that is converted later reads more, in proportion to the time. None if the current does not
    /// rise linearly there.
    fn at_once(&self, slot: Slot, n: usize, (from, to): (T, T)) -> Option<(T, T)> {
        let sensing = &self.settings.sensing;
        if self.train.lead == Nanos::ZERO {
            return Some((from, to));
        }
        let risen = self.risen(n + 1);
        if n >= self.settings.train.samples_on() || risen <= T::zero() {
            return None;
        }
        let at_trigger = |phase: Phase| {
            let late = T::of((sensing.skew * phase as u64).seconds());
            sensing.seen(risen) / sensing.seen(risen + late)
        };
        let (enters, leaves) = slot.phases();
        Some((from * at_trigger(enters), to * at_trigger(leaves)))
    }

    fn answer(&mut self) -> Result<Pole<T>, Fault<T>> {
        let s = &self.settings;
        let n = T::of(f64::from(s.train.rounds));
        // With equal gains assumed to within a percent the noise of a comparison of all readings does not matter.
        let below = s.train.place == Place::BelowLegs;
        let (ratios, noise) =
            if below { self.train.gains_at_edge(&self.gains) } else { self.gains.measured(T::zero()) };
        let (ratios, unknown) = GainComparison::known(ratios, noise, s.gain_tolerance);
        let half = T::of(0.5);
        let mut lines = [T::zero(); 3];
        let mut pointer = AlphaBeta::new(T::zero(), T::zero());
        let mut scatter = T::zero();
        for (k, (line, direction)) in self.sums.iter().zip(line_directions()).enumerate() {
            let [back, forward] = line.map(|sums| sums.mean);
            let mean = (forward + back) * half;
            lines[k] = mean;
            // Less inductance forward than backward: the pole that draws more current lies forward.
            let difference = (back - forward) / mean;
            // Forward pulses are read by the sensor of the line's second phase there, backward ones by that of the first.
            let difference = if below { difference + ratios[k] } else { difference };
            pointer = pointer + direction * difference;
            for sums in line {
                scatter = scatter + sums.squares / (mean * mean);
            }
        }
        let both = self.sums.map(|line| line.map(|sums| sums.mean));
        s.plausibility.inductances(&mut self.train.margin, both, s.train.pulse, s.train.resistance)?;
        let volts = self.volts / (n * T::of(6.0));
        let current =
            volts * self.risen(s.train.samples_on()) * T::of(3.0) / (lines[0] + lines[1] + lines[2]);
        let mut margin = self.train.margin;
        let derived = self.train.derived;
        let early = T::of(self.train.lead.seconds()) + s.sensing.lag();
        let late = core::array::from_fn(|k| s.sensing.late(k, derived) - early);
        let held = s.plausibility.contact(&mut margin, &self.losses, &self.train, lines, (volts, late));
        let held = held.and_then(|()| s.plausibility.codes(&mut margin, &self.gains, &self.train));
        // The margin counts even if the start ends here.
        self.train.margin = margin;
        held?;
        let (_, saliency) = s.saliency(lines, ratios, derived, &mut self.findings);
        // Variance of a mean over n pulses' relative inductances, pooled.
        let freedom = (n - T::one()) * T::of(6.0);
        let one = scatter / freedom / n;
        // Differences between the lags of the lines are the same in every round.
        let lag = s.sensing.lag_deviation() / self.risen(s.train.samples_on());
        let lags = lag * lag;
        let needed = significance::scattered(significance::of_lines(one * half), freedom)
            + significance::known(significance::of_lines(lags));
        s.check_saliency(&mut self.train.margin, &saliency, needed, &s.train)?;
        // A line's gain is a sixth of the difference of the other two lines' r.
        let [ab, bc, ca] = unknown;
        let gains = if below { (ab + bc + ca) / T::of(54.0) } else { T::zero() };
        // Equation (7) turns a relative error ε of each line's mean of two directions into an angle of 0.408 ε /
        // (|L_B|/L_A).
        let axis = (one * half + lags + gains).sqrt() * T::of(1.0 / 6.0).sqrt() / saliency.ratio();
        self.findings.angle_deviation = Some(axis);
        let instant = instant::of_lines(saliency.axis, self.train.instants());
        self.findings.age = Some(instant::age(self.train.clock, instant));
        // The third phase's current induces (√3/2) |L_B|/L_A of itself into the line with the same sign forward and
        // backward, so the difference of both directions contains it twice.
        let rings = T::of(3.0).sqrt() * saliency.ratio() * s.train.rings();
        let lasting = s.pole_variance(derived, unknown) + rings * rings;
        // Deviation of each component of the pointer: three directions, each with a difference of two means.
        let deviation = (T::of(1.5) * (T::of(2.0) * one + lasting)).sqrt();
        let pointer = Pointer { direction: pointer, deviation };
        let known = self.train.noise * half / (current * current);
        let pairs = self.differences.iter().fold(T::zero(), |all, sums| all + sums.squares);
        let of_pairs = T::of(3.0) * (n - T::one());
        let pairs = pairs / of_pairs * half;
        // Variance of a pulse's inductance without the part that a turning rotor adds, and at least that of the
        // readings' noise.
        let still = turning::estimated(one * n, freedom).min(turning::estimated(pairs, of_pairs));
        let still = still.max(known) / n;
        let across = (T::of(1.5) * (T::of(2.0) * still + lasting)).sqrt();
        let across = Pointer { deviation: across, ..pointer };
        let margin = &mut self.train.margin;
        s.check_standing(margin, (turning::AT_THE_END, volts), &across, (saliency.axis, axis))?;
        // Comes after the check for a turning rotor, whose effect on both directions has a fault of its own.
        s.plausibility.directions(&mut self.train.margin, both, &s.train)?;
        s.check_sheet(&mut self.train.margin, &saliency, needed, &s.train)?;
        Ok(s.pole(&saliency, &pointer))
    }
}

impl<T: Real> Sequence<T> for Bipolar<T> {
    fn next(&mut self, readings: &[Reading<T>]) -> Result<Step<T>, Fault<T>> {
        if let Some(slot) = self.train.take(readings)? {
            self.add(slot, readings)?;
        }
        Ok(match self.train.next() {
            Some(command) => Step::Drive(command),
            None => Step::Done(self.answer()?.outcome(self.findings)),
        })
    }

    fn so_far(&self) -> (&Findings<T>, Margin<T>) {
        (&self.findings, self.train.margin)
    }
}

impl<T: Real> Keyed for BipolarSettings<T> {
    const SOURCES: &'static [Source] = &[Source::PhaseCurrents, Source::LinkCurrent];

    const CHECKS: Checks = Checks::ALL;

    const SETTINGS: &'static [Setting<Self>] = &[
        place!(
            PULSE, s => Value::time(s.0.train.pulse);
            value => s.0.train = s.0.train.with_pulse(value.nanos())
        ),
        place!(
            REST, s => Value::Number(s.0.train.rest_share());
            value => s.0.train.set_rest_share(value.number())
        ),
        place!(ROUNDS, s => s.0.train.rounds, Value::times, count),
        place!(LEAST_SALIENCY, s => s.0.least_saliency, Value::of, real),
        place!(POLE_ERROR, s => s.0.pole_error, Value::of, real),
        place!(GAIN_TOLERANCE, s => s.0.gain_tolerance, Value::of, real),
        place!(CHECKS, s => s.0.plausibility.checks => value, set_value),
    ];

    fn describe(&self, line: &mut Lines<'_>) {
        self.0.train.describe(line);
        line("signature", format_args!("{}", self.0.signature.in_words()));
    }
}
