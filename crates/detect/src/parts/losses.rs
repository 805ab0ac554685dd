//! Losses in the pulses of a line: the resistance of each phase, from rising and falling currents.
//!
//! A core without losses has one current for each flux. The flux of a pulse rises until t₁ and falls equally steeply
//! after it. At equal times before and after t₁ the current would therefore be the same. The difference is lost in
//! resistance and devices:
//! ```text
//! L (i(t₁ − s) − i(t₁ + s)) = ΔU s + R ∫ i dt,    ∫ i dt = 2 î s (1 − s / (2 t₁))
//! ```
//! ΔU, the drops of the devices, and the effect of a turning magnet in both directions are equal in all lines; a bad contact in one phase is
//! not. It adds to two lines, and nothing to the third.
//!
//! An edge that comes τ later, or a sample that is taken τ earlier than the sequence says, moves the peak: −2 U τ / L,
//! the same at each s, whereas losses grow with s. Legs switch apart by some ten nanoseconds, which in a short pulse
//! looks like as much resistance as the winding has. Each line's offset is therefore estimated beside its losses: a
//! part that all lines have in common, of any size, and a rest with a normal distribution, whose width the drive's data
//! sheet states.
//!
//! The differences are fitted over the time 2 s (1 − s / (2 t₁)) alone, so that the result is linear in the currents:
//! the effect of a turning magnet cancels between forward and backward pulses.

use standstill_interface::{Fault, Phase, Reading, Real};

use super::margin::Margin;
use super::train::{LINES, PulseTrainSettings, Slot, Train};
use crate::nameplate::Place;

/// Number of standard deviations up to which a difference counts as noise.
const DEVIATIONS: f64 = 6.0;

/// Share of all losses by which phases may differ: saturation makes the losses of a line look larger or smaller, and so
/// does the iron.
const ALIKE: f64 = 0.35;

/// Least variance of a reading in A²: that of a nanoampere, which no converter resolves.
const LEAST_NOISE: f64 = 1e-18;

/// Statistics of the pairs of samples before and after the peak, of one line's pulses in one direction. A pulse with a
/// lower reading of the link's voltage may have a pair less than another pulse.
#[derive(Clone, Copy, Debug)]
struct Pairs<T> {
    count: T,
    /// Mean current in A at the peak.
    peak: T,
    /// Mean of i(t₁ − s) − i(t₁ + s) in A, the amount by which the current after the peak falls short.
    short: T,
    /// Mean of the time ∫ i dt / î = 2 s (1 − s / (2 t₁)) in s. A resistance R makes `short` R î / L times as much.
    time: T,
    /// Sums over the pairs: squared deviation of the time from its mean, in s²; that of the amount, in A²; product of
    /// both, in A s.
    times: T,
    shorts: T,
    products: T,
}

/// Losses of each line's pulses, backward and forward.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Losses<T>([[Pairs<T>; 2]; 3]);

/// Voltage that drives the currents of the lines, and when they are read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Timing<T> {
    /// Voltage in V.
    pub volts: T,
    /// Delay in s with which the samples show each line's current.
    pub late: [T; 3],
    /// Standard deviation in s of each line's own part of the time between edges and samples, in addition to a part
    /// that all lines have in common.
    pub deviation: T,
}

impl<T: Real> Pairs<T> {
    /// Adds a pair by Welford's update.
    fn add(&mut self, short: T, time: T, peak: T) {
        self.count = self.count + T::one();
        let (apart, off) = (time - self.time, short - self.short);
        self.peak = self.peak + (peak - self.peak) / self.count;
        self.time = self.time + apart / self.count;
        self.short = self.short + off / self.count;
        self.times = self.times + apart * (time - self.time);
        self.shorts = self.shorts + off * (short - self.short);
        self.products = self.products + apart * (short - self.short);
    }

    /// Combines the pairs of both directions into one set. Residuals must be taken from each direction by itself,
    /// because the directions differ if a core saturates.
    fn and(&self, other: &Self) -> Self {
        let count = self.count + other.count;
        let (share, between) = (other.count / count, self.count * other.count / count);
        let (apart, off) = (other.time - self.time, other.short - self.short);
        Self {
            count,
            peak: self.peak + share * (other.peak - self.peak),
            short: self.short + share * off,
            time: self.time + share * apart,
            times: self.times + other.times + between * apart * apart,
            shorts: self.shorts + other.shorts + between * off * off,
            products: self.products + other.products + between * apart * off,
        }
    }

    /// Returns the sum of the squared deviations in A² from a straight line, and the degrees of freedom.
    fn residuals(&self) -> (T, T) {
        let two = T::of(2.0);
        if self.times > T::zero() {
            ((self.shorts - self.products * self.products / self.times).max(T::zero()), self.count - two)
        } else {
            (self.shorts, self.count - T::one())
        }
    }

    /// Returns the amount in A at s = 0 of a straight line, and its variance; none if all pairs have one time. `noise`: variance of an amount.
    fn offset(&self, noise: T) -> Option<(T, T)> {
        (self.times > T::zero()).then(|| {
            let offset = self.short - self.products / self.times * self.time;
            (offset, noise * (self.count.recip() + self.time * self.time / self.times))
        })
    }

    /// Returns the slope in A/s of the amounts over the times, and its variance. `noise`: variance of an amount in A²; `offset`: expected
    /// amount at s = 0, and its variance.
    fn slope(&self, noise: T, (offset, variance): (T, T)) -> (T, T) {
        // If the offset is known exactly, the whole mean counts as losses; if its variance is large, nothing of the
        // mean does.
        let share = noise / (self.count * variance + noise);
        let of_mean = share * self.count * self.time;
        let squares = self.times + of_mean * self.time;
        ((self.products + of_mean * (self.short - offset)) / squares, noise / squares)
    }
}

impl<T: Real> Losses<T> {
    pub fn new() -> Self {
        let zero = T::zero();
        let none = Pairs {
            count: zero,
            peak: zero,
            short: zero,
            time: zero,
            times: zero,
            shorts: zero,
            products: zero,
        };
        Self([[none; 2]; 3])
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

    /// Adds a pulse; `volts`: driving voltage in V, the link's less the drop of the switches. Does nothing if different
    /// shunts read rising and falling currents, because their gains would look like losses.
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
            self.0[k][usize::from(slot.forward)].add(
                before - after,
                two * apart * (T::one() - apart / (two * t1)),
                highest,
            );
        }
        Ok(())
    }

    /// Returns the resistance in Ω that would cause the same losses in each line, devices included, and its standard
    /// deviation by noise and edges; none if a line has no pair of samples in one direction. `noise`: variance of a
    /// reading in A²; `lines`: inductances in H.
    fn resistances(&self, noise: T, lines: [T; 3], timing: Timing<T>) -> Option<([T; 3], T)> {
        if self.0.iter().flatten().any(|pairs| pairs.count < T::one()) {
            return None;
        }
        // Jitter and the steps of a converter scatter the amounts, but do not show in readings without current.
        let (sum, freedom) = self
            .0
            .iter()
            .flatten()
            .map(Pairs::residuals)
            .fold((T::zero(), T::zero()), |(a, b), (c, d)| (a + c, b + d));
        let scatter = if freedom > T::zero() { sum / freedom } else { T::zero() };
        // Variance of an amount: the difference of two currents, each the mean of two sensors.
        let noise = noise.max(scatter).max(T::of(LEAST_NOISE));
        // A current that is read later has risen more before the peak, and fallen more after it.
        let by_time = lines.map(|line| T::of(2.0) * timing.volts / line);
        let own = timing.deviation * timing.deviation;
        let both = self.0.map(|[back, forward]| back.and(&forward));
        let (mut later, mut weights) = (T::zero(), T::zero());
        for (k, pairs) in both.iter().enumerate() {
            if let Some((offset, variance)) = pairs.offset(noise) {
                let weight = (variance / (by_time[k] * by_time[k]) + own).recip();
                later = later + weight * (offset / by_time[k] - timing.late[k]);
                weights = weights + weight;
            }
        }
        let later = if weights > T::zero() { later / weights } else { T::zero() };
        let (mut found, mut sum) = ([T::zero(); 3], T::zero());
        for (k, pairs) in both.iter().enumerate() {
            let offset = (by_time[k] * (timing.late[k] + later), by_time[k] * by_time[k] * own);
            let (slope, variance) = pairs.slope(noise, offset);
            let per_slope = lines[k] / pairs.peak;
            found[k] = per_slope * slope;
            sum = sum + per_slope * per_slope * variance;
        }
        Some((found, (sum / T::of(3.0)).sqrt()))
    }

    /// Checks that the phases have equal losses. `lines`: inductances in H.
    pub fn check(
        &self,
        margin: &mut Margin<T>,
        train: &Train<T>,
        lines: [T; 3],
        timing: Timing<T>,
    ) -> Result<(), Fault<T>> {
        let Some((lost, deviation)) = self.resistances(train.noise, lines, timing) else { return Ok(()) };
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
