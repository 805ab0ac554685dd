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
//! An edge that comes τ later, or a sample that is taken as much earlier, moves the peak: −2 U τ / L, the same at each s, whereas losses grow
//! with s. Legs switch apart by some ten nanoseconds, which in a short pulse looks like as much resistance as the winding has. The offset
//! of each line is therefore estimated beside its losses, from what the drive's data sheet says of edges: a normal distribution about zero.

use standstill_interface::{Fault, Phase, Reading, Real};

use super::margin::Margin;
use super::train::{LINES, PulseTrainSettings, Slot, Train};
use crate::nameplate::Place;

/// Standard deviations up to which a difference is noise.
const DEVIATIONS: f64 = 6.0;

/// Share of all losses by which phases may differ: saturation makes those of a line look larger or smaller, and so do irons.
const ALIKE: f64 = 0.35;

/// Share of the squared charges that the pairs of a line must differ by, where nothing is known of an offset: less is rounding.
const LEAST_SPREAD: f64 = 1e-4;

/// The pairs of samples of one line's pulses. A link that a pulse shows lower may leave it a pair less than another one.
#[derive(Clone, Copy, Debug)]
struct Pairs<T> {
    count: T,
    /// Mean of the amounts in A by which currents after the peak fall short.
    short: T,
    /// Mean of twice the charge between the samples of a pair, ∫ i dt, in As: short by that, times R / L.
    charge: T,
    /// Sum of the squared deviations of the charge from its mean, and of its products with those of the amounts.
    squares: T,
    products: T,
}

/// Losses of each line's pulses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Losses<T>([Pairs<T>; 3]);

/// What drives the currents of the lines, and when they are read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Driven<T> {
    /// Voltage in V.
    pub volts: T,
    /// Delay in s with which the samples show each line's current.
    pub late: [T; 3],
    /// Standard deviation in s of the time between edges and samples, from line to line.
    pub edges: T,
}

impl<T: Real> Pairs<T> {
    /// Adds a pair by Welford's update.
    fn add(&mut self, short: T, charge: T) {
        self.count = self.count + T::one();
        let (apart, off) = (charge - self.charge, short - self.short);
        self.charge = self.charge + apart / self.count;
        self.short = self.short + off / self.count;
        self.squares = self.squares + apart * (charge - self.charge);
        self.products = self.products + apart * (short - self.short);
    }

    /// Returns the slope of the amounts over the charges in 1/s, and its variance; none if the pairs do not tell it. `noise`: variance of an
    /// amount in A²; `offset`: amount in A that is the same in all pairs, and its variance in A².
    fn slope(&self, noise: T, (offset, variance): (T, T)) -> Option<(T, T)> {
        // With no variance all of the mean belongs to the losses, with a large one nothing of it.
        let spread = self.count * variance;
        let share = if spread > T::zero() { noise / (spread + noise) } else { T::one() };
        let of_mean = share * self.count * self.charge;
        let squares = self.squares + of_mean * self.charge;
        let least = T::of(LEAST_SPREAD) * self.count * self.charge * self.charge;
        (squares > least)
            .then(|| ((self.products + of_mean * (self.short - offset)) / squares, noise / squares))
    }
}

impl<T: Real> Losses<T> {
    pub fn new() -> Self {
        let zero = T::zero();
        Self([Pairs { count: zero, short: zero, charge: zero, squares: zero, products: zero }; 3])
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
            self.0[k].add(before - after, highest * two * apart * (T::one() - apart / (two * t1)));
        }
        Ok(())
    }

    /// Returns the resistance in Ω that would cause the same losses in each line, devices included, and its standard
    /// deviation by noise and edges; none if the pairs of a line do not tell it. `noise`: variance of a reading in A²; `lines`: inductances
    /// in H.
    fn resistances(&self, noise: T, lines: [T; 3], driven: Driven<T>) -> Option<([T; 3], T)> {
        let (mut found, mut sum) = ([T::zero(); 3], T::zero());
        for (k, pairs) in self.0.iter().enumerate() {
            // A current that is read later has risen more before the peak, and fallen more after it.
            let by_time = T::of(2.0) * driven.volts / lines[k];
            let offset = (by_time * driven.late[k], by_time * by_time * driven.edges * driven.edges);
            // Two currents of a pair, each the mean of two sensors.
            let (slope, variance) = pairs.slope(noise, offset)?;
            found[k] = lines[k] * slope;
            sum = sum + lines[k] * lines[k] * variance;
        }
        Some((found, (sum / T::of(3.0)).sqrt()))
    }

    /// Checks that the phases have equal losses. `lines`: inductances in H.
    pub fn check(
        &self,
        margin: &mut Margin<T>,
        train: &Train<T>,
        lines: [T; 3],
        driven: Driven<T>,
    ) -> Result<(), Fault<T>> {
        let Some((lost, deviation)) = self.resistances(train.noise, lines, driven) else { return Ok(()) };
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
