//! Losses in the pulses of a line: the resistance of each phase, from rising and falling currents.
//!
//! A core without losses has one current for each flux. The flux of a pulse rises until t₁ and falls equally steeply
//! after it. At equal times before and after t₁ the current would therefore be the same. The difference is lost in
//! resistance and devices:
//! ```text
//! L (i(t₁ − s) − i(t₁ + s)) = ΔU s + R ∫ i dt,    ∫ i dt = 2 î s (1 − s / (2 t₁))
//! ```
//! ΔU, the drops of the devices, a late edge or sample, and the effect of a turning magnet in both directions are equal
//! in all lines; a bad contact in one phase is not. It adds to two lines, and nothing to the third.

use standstill_interface::{Fault, Phase, Reading, Real};

use super::margin::Margin;
use super::train::{LINES, PulseTrainSettings, Slot, Train};
use crate::nameplate::Place;

/// Standard deviations up to which a difference is noise.
const DEVIATIONS: f64 = 6.0;

/// Share of all losses by which phases may differ: saturation makes those of a line look larger or smaller, and so do irons.
const ALIKE: f64 = 0.35;

/// Sums over the pairs of samples of each line's pulses. A link that a pulse shows lower may leave it a pair less than another one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Losses<T> {
    /// Amounts in A by which currents after the peak fall short.
    short: [T; 3],
    /// Twice the charge between the samples of each pair, ∫ i dt, in As: short by that, times R / L.
    charge: [T; 3],
    pairs: [T; 3],
}

impl<T: Real> Losses<T> {
    pub fn new() -> Self {
        Self { short: [T::zero(); 3], charge: [T::zero(); 3], pairs: [T::zero(); 3] }
    }

    /// Returns the number of samples before the peak that have a counterpart while the current still falls; `volts`:
    /// voltage that drives it. The drops of the devices act against the link before the peak and with it afterwards,
    /// which ends the current earlier.
    fn pairs(train: &PulseTrainSettings<T>, volts: T) -> usize {
        let on = train.samples_on();
        let falling = volts + train.on_drop + train.off_drop;
        let until = volts / falling * T::of(0.95 * on as f64);
        (1..on).take_while(|pair| T::of(*pair as f64) <= until).count()
    }

    /// Adds a pulse that so many volts drive, the link less the drop of the switches. Where rising and falling currents are read by different
    /// shunts, their gains would look like losses.
    pub fn add(
        &mut self,
        train: &Train<T>,
        slot: Slot,
        readings: &[Reading<T>],
        volts: T,
    ) -> Result<(), Fault<T>> {
        let s = &train.settings;
        if s.place != Place::InLine {
            return Ok(());
        }
        let (peak, k) = (s.samples_on() - 1, slot.line);
        let (interval, t1) = (T::of(s.interval.seconds()), T::of(s.pulse.seconds()));
        let two = T::of(2.0);
        let highest = train.current(slot, &readings[peak])?;
        for pair in 1..=Self::pairs(s, volts) {
            let [before, after] =
                [train.current(slot, &readings[peak - pair])?, train.current(slot, &readings[peak + pair])?];
            let apart = interval * T::of(pair as f64);
            self.short[k] = self.short[k] + before - after;
            self.charge[k] = self.charge[k] + highest * two * apart * (T::one() - apart / (two * t1));
            self.pairs[k] = self.pairs[k] + T::one();
        }
        Ok(())
    }

    /// Returns the resistance in Ω that would cause the same losses in each line, devices included, and its standard
    /// deviation by noise; none if a line has no pair of samples. `lines`: inductances in H; `volts`: voltage that
    /// drives the current; `late`: delay in s with which the samples show each line's current.
    fn resistances(&self, noise: T, lines: [T; 3], (volts, late): (T, [T; 3])) -> Option<([T; 3], T)> {
        if self.pairs.iter().any(|pairs| *pairs < T::one()) {
            return None;
        }
        let two = T::of(2.0);
        let per_ampere: [T; 3] = core::array::from_fn(|k| lines[k] / self.charge[k]);
        // A current that is read later has risen more before the peak, and fallen more after it.
        let by_time = |k: usize| two * self.pairs[k] * volts / lines[k] * late[k];
        let found = core::array::from_fn(|k| per_ampere[k] * (self.short[k] - by_time(k)));
        // Two currents of a pair, each the mean of two sensors.
        let variance = |k: usize| per_ampere[k] * per_ampere[k] * noise * self.pairs[k];
        Some((found, ((variance(0) + variance(1) + variance(2)) / T::of(3.0)).sqrt()))
    }

    /// Checks that the phases have equal losses. `lines`: inductances in H; `shown`: voltage of the link in V, and the
    /// delay in s with which the samples show each line's current.
    pub fn check(
        &self,
        margin: &mut Margin<T>,
        train: &Train<T>,
        lines: [T; 3],
        shown: (T, [T; 3]),
    ) -> Result<(), Fault<T>> {
        let Some((lost, deviation)) = self.resistances(train.noise, lines, shown) else { return Ok(()) };
        let (two, three) = (T::of(2.0), T::of(3.0));
        let mean = (lost[0] + lost[1] + lost[2]) / three;
        // A mean of two lines less a third: 3/2 of a line's variance.
        let allowed = deviation * T::of(DEVIATIONS * 1.5_f64.sqrt()) + mean.abs() * T::of(ALIKE);
        for (k, without) in lost.into_iter().enumerate() {
            // The phase that the line does not have.
            let phase = Phase::ALL.into_iter().find(|phase| *phase != LINES[k].0 && *phase != LINES[k].1);
            let found = (mean * three - without) / two - without;
            margin.at_most(found, allowed);
            if let Some(phase) = phase
                && found > allowed
            {
                return Err(Fault::ContactResistive { phase, found, allowed });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
