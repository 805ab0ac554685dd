//! The sensors of a drive according to their data sheets: current sensors, dividers at the terminals, comparators.

use standstill_interface::{Nanos, Phase, Real};

use crate::parts::train::{Derived, LINES};
use crate::settings::{SettingsError, require, require_positive, require_zero_or_more};

/// The drive's comparators and the timer that captures when one of them trips, as their data sheets state it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Comparing<T> {
    /// Tick of the timer in s; 0: no time is captured.
    pub tick: T,
    /// Mean delay in s from the threshold to the captured time.
    pub delay: T,
    /// Whether each leg has its own comparators, one for each direction of its current; otherwise one comparator serves
    /// all.
    pub own: bool,
    /// Standard deviation of each comparator's offset in A.
    pub offset: T,
    /// Standard deviation of each comparator's delay in s.
    pub delay_spread: T,
    /// Noise at a comparator in A rms.
    pub noise: T,
    /// Time in s after the begin of a pulse during which comparators are ignored.
    pub blanking: T,
    /// Highest threshold in A that the drive can set; 0: any.
    pub highest: T,
    /// Standard deviation of the timer's clock, relative.
    pub clock_error: T,
}

impl<T: Real> Comparing<T> {
    /// Converts to another precision.
    pub(super) fn cast<U: Real>(&self) -> Comparing<U> {
        cast!(self as Comparing { tick, delay, offset, delay_spread, noise, blanking, highest, clock_error; own;; })
    }

    pub(super) fn check(&self) -> Result<(), SettingsError> {
        require_zero_or_more(self.tick, "sensing.comparator.tick")?;
        require_zero_or_more(self.delay, "sensing.comparator.delay")?;
        require_zero_or_more(self.offset, "sensing.comparator.offset")?;
        require_zero_or_more(self.delay_spread, "sensing.comparator.delay_spread")?;
        require_zero_or_more(self.noise, "sensing.comparator.noise")?;
        require_zero_or_more(self.blanking, "sensing.comparator.blanking")?;
        require_zero_or_more(self.highest, "sensing.comparator.highest")?;
        require_zero_or_more(self.clock_error, "sensing.comparator.clock_error")
    }
}

/// Arrangement of a drive's current sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// In the phases: each sensor always shows the current of its phase.
    #[default]
    InLine,
    /// Shunts below the legs: each shows the current of its leg while the lower device of the leg conducts. In a pulse across two
    /// phases that is the leg which the current leaves, and after the pulse, when diodes return it to the link, the leg which it
    /// enters.
    BelowLegs,
    /// One shunt in the DC link instead of sensors in the phases. It shows the current of a pulse across two phases;
    /// with the opposite sign it shows the current that diodes return to the link.
    InLink,
}

impl Place {
    /// Returns whether the current in a sensor changes at edges of the legs.
    pub(crate) const fn switches(self) -> bool {
        !matches!(self, Self::InLine)
    }
}

/// Properties of the current sensors and their converter, according to their data sheets. By default sensors in the phases without
/// filters, all converted at once, without pick-up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensing<T> {
    /// Nominal corner frequency in Hz of the current sensors' first-order filters: they lag by 1/(2π f). None: no filter.
    pub bandwidth: Option<T>,
    /// Largest relative deviation of a phase's corner frequency from the mean of all phases. The mean's own deviation
    /// from the nominal value is fitted.
    pub bandwidth_mismatch: T,
    /// Delay between the conversions of successive phases. Phase k (a, b, c: 0, 1, 2) is converted k times this after
    /// the trigger, but never after the end of its command. The DC link's voltage is converted together with phase a.
    pub skew: Nanos,
    /// Time from the first conversion of a sample to its last one; a reading is the mean of several evenly spaced
    /// conversions.
    pub averaged: Nanos,
    /// Amplitude in A of the disturbance that an edge of a leg adds to all current readings (pick-up), and the time
    /// constant in s with which it decays. Zeros: no pick-up.
    pub pick_up: [T; 2],
    /// Arrangement of the current sensors.
    pub place: Place,
    /// Time after a request to a leg during which shunts are not read: dead time and settling of their amplifiers.
    pub settle: Nanos,
    /// Noise of a sample of the DC link's voltage in V rms, with that of its converter's rounding.
    pub link_noise: T,
    /// Comparators and timer.
    pub comparator: Comparing<T>,
}

/// The dividers through which a drive reads its terminals' voltages, as their data sheets state them. By default without errors and
/// filters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dividers<T> {
    /// Standard deviation of the dividers' gains, relative. Zero: equal.
    pub gain_tolerance: T,
    /// Standard deviation of the dividers' offsets in V of the terminal.
    pub offset: T,
    /// Corner frequency in Hz of the dividers' first-order filters. None: no filter.
    pub bandwidth: Option<T>,
}

impl<T: Real> Dividers<T> {
    /// Converts to another precision.
    pub(super) fn cast<U: Real>(&self) -> Dividers<U> {
        cast!(self as Dividers { gain_tolerance, offset;; bandwidth; })
    }

    pub(super) fn check(&self) -> Result<(), SettingsError> {
        if let Some(bandwidth) = self.bandwidth {
            require_positive(bandwidth, "dividers.bandwidth")?;
        }
        let tolerance = self.gain_tolerance;
        let is_share = tolerance >= T::zero() && tolerance < T::one();
        require(is_share, "dividers.gain_tolerance", "from 0 to below 1")?;
        require_zero_or_more(self.offset, "dividers.offset")
    }
}

impl<T: Real> Sensing<T> {
    /// Converts to another precision.
    pub(super) fn cast<U: Real>(&self) -> Sensing<U> {
        cast!(self as Sensing { bandwidth_mismatch, link_noise; skew, averaged, place, settle; bandwidth, pick_up; comparator })
    }

    /// Returns the time constant τ in s by which the sensors lag; zero without filter.
    pub(crate) fn lag(&self) -> T {
        self.bandwidth.map_or(T::zero(), |corner| (T::TAU() * corner).recip())
    }

    /// Returns the standard deviation in s of a line's τ, relative to the other lines: the mean of two sensors, each
    /// with a uniform deviation.
    pub(crate) fn lag_deviation(&self) -> T {
        self.lag() * self.bandwidth_mismatch / T::of(6.0).sqrt()
    }

    /// Returns the mean delay in s between the trigger and the sampling of a line's current, over its two phases. While
    /// the current is linear between the two samples, their mean belongs to the mean time. A phase without a sensor is
    /// as late as the phase that carries the line's current with it, because the third phase has none. With low-side
    /// shunts it is one or the other, depending on the direction; their mean is the same. One shunt in the link is read
    /// once, at its trigger. If several conversions are averaged, half of their span is added.
    pub(crate) fn late(&self, line: usize, derived: Derived) -> T {
        let (from, to) = LINES[line];
        let sampled = |phase, other| if derived == Derived::One(phase) { other } else { phase };
        let skew = self.skew * (sampled(from, to) as u64 + sampled(to, from) as u64);
        T::of((skew + self.averaged).seconds() / 2.0)
    }

    /// Returns the delay in s between the trigger and the sampling of a phase's current.
    pub(crate) fn late_of(&self, phase: Phase) -> T {
        T::of((self.skew * phase as u64).seconds() + self.averaged.seconds() / 2.0)
    }

    /// Returns the time in s after an edge during which samples are disturbed: until the pick-up has decayed to 0.7 %,
    /// and until shunts can be read.
    pub(crate) fn blank(&self) -> T {
        let [amplitude, decay] = self.pick_up;
        let settle = T::of(self.settle.seconds());
        if amplitude > T::zero() { settle.max(decay * T::of(5.0)) } else { settle }
    }

    /// Returns the time before the end of a pulse at which its current is sampled. It must be early enough for the
    /// converter to finish all phases before the edge, and for jitter not to move a sample into the pick-up of the
    /// edge. After the edge a shunt in the DC link shows the current with the opposite sign, and a low-side shunt shows
    /// none.
    pub(crate) fn lead(&self) -> Nanos {
        let blank = Nanos::from_seconds(self.blank().to_double());
        let blank = if self.place.switches() { blank.max(Nanos::from_micros(1)) } else { blank };
        self.averaged + self.skew * 2 + blank
    }

    /// Returns the key with the largest contribution to [`Self::lead`].
    pub(crate) fn lead_key(&self) -> &'static str {
        let blank = Nanos::from_seconds(self.blank().to_double());
        if self.averaged > blank.max(self.skew * 2) {
            "sensors.oversampling"
        } else if self.skew * 2 > blank {
            "sensors.skew"
        } else {
            self.blank_key()
        }
    }

    /// Returns the effective rise time in s that lagging sensors show for a current that has risen linearly for `time`.
    /// Once a few τ have passed, it is shorter by τ.
    pub(crate) fn seen(&self, time: T) -> T {
        let lag = self.lag();
        if lag > T::zero() { time - lag * (T::one() - (-time / lag).exp()) } else { time }
    }

    /// Returns a function that states whether a sample at a time can be used to compare the sensors, if the pulse ends
    /// after `pulse`. If phases are converted one after the other, a later phase reads more while the current rises and
    /// less while it falls. This cancels except for the sample at the peak. The pick-up of an edge must not look like a
    /// gain either.
    pub(crate) fn compares(&self, pulse: Nanos) -> impl Fn(Nanos) -> bool {
        let until = pulse + Nanos::from_seconds(self.blank().to_double());
        let skew = self.skew * 2 + self.averaged;
        let alike = skew == Nanos::ZERO && until == pulse;
        move |time| alike || time + skew < pulse || time > until
    }

    /// Returns the key with the largest contribution to [`Self::blank`].
    pub(crate) fn blank_key(&self) -> &'static str {
        if self.blank() > T::of(self.settle.seconds()) { "sensors.pick_up_decay" } else { "sensors.settle" }
    }

    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        if let Some(bandwidth) = self.bandwidth {
            require_positive(bandwidth, "sensing.bandwidth")?;
        }
        let mismatch = self.bandwidth_mismatch;
        let is_share = mismatch >= T::zero() && mismatch < T::one();
        require(is_share, "sensing.bandwidth_mismatch", "from 0 to below 1")?;
        require(self.skew <= Nanos::from_micros(100), "sensing.skew", "at most 100 us")?;
        require(self.averaged <= Nanos::from_micros(20_000), "sensing.averaged", "at most 20 ms")?;
        let [amplitude, decay] = self.pick_up;
        require_zero_or_more(amplitude, "sensing.pick_up")?;
        require_zero_or_more(decay, "sensing.pick_up")?;
        self.comparator.check()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_a_mean_is_that_of_its_middle_and_ends_before_the_edge() {
        let micros = Nanos::from_micros;
        let sensing = Sensing::<f64> { averaged: micros(4), ..Sensing::default() };
        let skewed = Sensing { skew: micros(1), ..sensing };
        assert!((sensing.late(0, Derived::None) - 2e-6).abs() < 1e-15);
        // Line a-b: the mean of two phases that are converted 1 us apart.
        assert!((skewed.late(0, Derived::None) - 2.5e-6).abs() < 1e-15);
        assert_eq!((sensing.lead(), skewed.lead()), (micros(4), micros(6)));
        // Shunts need additional time, so that jitter cannot move a sample beyond the edge.
        for place in [Place::InLink, Place::BelowLegs] {
            assert_eq!(Sensing { place, ..sensing }.lead(), micros(5));
        }
        assert_eq!((sensing.lead_key(), skewed.lead_key()), ("sensors.oversampling", "sensors.oversampling"));
        // A mean of conversions across the edge cannot compare sensors either.
        let compares = sensing.compares(micros(80));
        assert!(compares(micros(75)) && !compares(micros(77)) && compares(micros(81)));
    }
}
