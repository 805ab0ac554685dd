//! Commands of a detector to the drive.

use core::ops::{Add, Mul, Sub};

use num_traits::ToPrimitive;
use num_traits::float::FloatCore;

use crate::{Abc, Phase};

/// A time or duration in whole nanoseconds: gate edges and ADC triggers come from counters, not from reals.
/// Sums and products saturate at 584 years, differences at zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Nanos(pub u64);

impl Nanos {
    /// Zero.
    pub const ZERO: Self = Self(0);

    /// Makes a time from whole microseconds.
    pub const fn from_micros(micros: u64) -> Self {
        Self(micros.saturating_mul(1000))
    }

    /// Makes a time from seconds, rounded to nanoseconds; zero if the value is negative or not a number.
    ///
    /// ```
    /// use standstill_interface::Nanos;
    ///
    /// assert_eq!(Nanos::from_seconds(80e-6), Nanos::from_micros(80));
    /// assert_eq!(Nanos::from_seconds(-1.0), Nanos::ZERO);
    /// assert_eq!(Nanos(1_500).seconds(), 1.5e-6);
    /// ```
    pub fn from_seconds(seconds: f64) -> Self {
        Self(FloatCore::round(seconds * 1e9).to_u64().unwrap_or(if seconds > 0.0 { u64::MAX } else { 0 }))
    }

    /// Returns the time in seconds.
    pub fn seconds(self) -> f64 {
        self.0 as f64 * 1e-9
    }
}

impl Add for Nanos {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for Nanos {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl Mul<u64> for Nanos {
    type Output = Self;
    fn mul(self, factor: u64) -> Self {
        Self(self.0.saturating_mul(factor))
    }
}

/// Switching order of one inverter leg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Leg<T> {
    /// Both switches off; only the diodes can conduct.
    Off,
    /// Lower switch on.
    Low,
    /// Upper switch on.
    High,
    /// Centre-aligned PWM at the drive's carrier frequency: the upper switch for this share of each period
    /// (0 to 1), the lower switch for the rest.
    Duty(T),
    /// Switches once: the lower switch is on until this time after the begin of the stage, then the upper switch. At
    /// zero, or at the stage's end or later, the leg does not switch.
    ///
    /// Together with [`Leg::Fall`] it makes a PWM period one command in which each half may have its own duty:
    /// ```
    /// use standstill_interface::{Abc, Command, Leg, Nanos, Sampling, Stage};
    ///
    /// // A period of 80 µs: high in its middle, for 10 µs before and for 16 µs after it.
    /// let half = |leg: Leg<f32>| Stage { legs: Abc::new(leg, Leg::Low, Leg::Low), duration: Nanos(40_000) };
    /// let period = Command::sequence(
    ///     half(Leg::Rise(Nanos(30_000))),
    ///     half(Leg::Fall(Nanos(16_000))),
    ///     Sampling::once(Nanos(40_000)),
    /// );
    /// assert_eq!(period.duration(), Nanos(80_000));
    /// ```
    Rise(Nanos),
    /// Switches once: the upper switch is on until this time after the begin of the stage, then the lower switch.
    Fall(Nanos),
}

impl<T> Leg<T> {
    /// Returns centre-aligned PWM over half a period: high for this share of it (0 to 1), adjacent to the middle of the
    /// period, which ends the first half and begins the second.
    ///
    /// ```
    /// use standstill_interface::{Leg, Nanos};
    ///
    /// let half = Nanos(40_000);
    /// assert_eq!(Leg::<f32>::in_half(0.25, half, false), Leg::Rise(Nanos(30_000)));
    /// assert_eq!(Leg::<f32>::in_half(0.25, half, true), Leg::Fall(Nanos(10_000)));
    /// assert_eq!(Leg::<f32>::in_half(1.0, half, true), Leg::High);
    /// ```
    pub fn in_half(duty: f64, half_period: Nanos, second: bool) -> Self {
        let on = FloatCore::round(duty * half_period.0 as f64).to_u64().unwrap_or(0);
        match Nanos(on.min(half_period.0)) {
            Nanos::ZERO => Self::Low,
            on if on == half_period => Self::High,
            on if second => Self::Fall(on),
            on => Self::Rise(half_period - on),
        }
    }
}

/// The legs' state for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage<T> {
    /// The state of each phase's leg.
    pub legs: Abc<Leg<T>>,
    /// Duration of the stage.
    pub duration: Nanos,
}

impl<T> Stage<T> {
    /// Makes all six switches off.
    pub const fn off(duration: Nanos) -> Self {
        Self { legs: Abc::new(Leg::Off, Leg::Off, Leg::Off), duration }
    }

    /// Makes a stage with `first` high, `second` low and the third leg open: the DC link across two phases.
    ///
    /// ```
    /// use standstill_interface::{Leg, Nanos, Phase, Stage};
    ///
    /// let pulse: Stage<f32> = Stage::line(Phase::B, Phase::C, Nanos::from_micros(200));
    /// assert_eq!(pulse.legs[Phase::A], Leg::Off);
    /// assert_eq!(pulse.legs[Phase::B], Leg::High);
    /// assert_eq!(pulse.legs[Phase::C], Leg::Low);
    /// ```
    pub fn line(first: Phase, second: Phase, duration: Nanos) -> Self {
        let mut stage = Self::off(duration);
        stage.legs[first] = Leg::High;
        stage.legs[second] = Leg::Low;
        stage
    }

    /// Makes a stage with `first` and `second` low and the third leg open: the two phases are short-circuited through
    /// the lower rail.
    pub fn freewheel(first: Phase, second: Phase, duration: Nanos) -> Self {
        let mut stage = Self::off(duration);
        stage.legs[first] = Leg::Low;
        stage.legs[second] = Leg::Low;
        stage
    }
}

/// When the ADC samples, counted from the start of the command: `count` triggers, the first at `first`, then
/// one every `interval`. None may lie after the end of the command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sampling {
    /// First trigger.
    pub first: Nanos,
    /// Time between two triggers.
    pub interval: Nanos,
    /// Number of triggers.
    pub count: u32,
}

impl Sampling {
    /// No samples at all.
    pub const NONE: Self = Self { first: Nanos::ZERO, interval: Nanos::ZERO, count: 0 };

    /// Makes one sample.
    pub const fn once(at: Nanos) -> Self {
        Self { first: at, interval: Nanos::ZERO, count: 1 }
    }

    /// Makes two samples.
    ///
    /// ```
    /// use standstill_interface::{Nanos, Sampling};
    ///
    /// let sampling = Sampling::twice(Nanos(50_000), Nanos(200_000));
    /// assert_eq!(sampling.trigger(1), Nanos(200_000));
    /// assert_eq!(sampling.last(), Some(Nanos(200_000)));
    /// assert_eq!(Sampling::NONE.last(), None);
    /// ```
    pub fn twice(first: Nanos, second: Nanos) -> Self {
        Self { first, interval: second - first, count: 2 }
    }

    /// Returns the trigger with this number.
    pub fn trigger(self, number: u32) -> Nanos {
        self.first + self.interval * u64::from(number)
    }

    /// Returns the last trigger, if there is one.
    pub fn last(self) -> Option<Nanos> {
        self.count.checked_sub(1).map(|number| self.trigger(number))
    }
}

/// One order to the drive: up to two stages, and the times of the samples. Two stages combine a pulse and its decay in
/// one order, so that a sample at the edge between them requires no decision in zero time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command<T> {
    /// First stage.
    pub stage: Stage<T>,
    /// A second stage that follows at once, if any.
    pub then: Option<Stage<T>>,
    /// ADC triggers over the whole command; for a command with a threshold, from the end of its first stage on.
    pub sampling: Sampling,
    /// Threshold in A of the drive's comparators, if the first stage ends when one of them trips. See [`Command::until`].
    pub threshold: Option<T>,
}

impl<T> Command<T> {
    /// Makes a single stage.
    pub const fn hold(stage: Stage<T>, sampling: Sampling) -> Self {
        Self { stage, then: None, sampling, threshold: None }
    }

    /// Makes two stages, one after the other.
    ///
    /// ```
    /// use standstill_interface::{Command, Nanos, Phase, Sampling, Stage};
    ///
    /// // A pulse of 200 µs across phases a and b, sampled at its end; then all gates off until the current is gone.
    /// let pulse = Stage::line(Phase::A, Phase::B, Nanos::from_micros(200));
    /// let decay = Stage::off(Nanos::from_micros(400));
    /// let command: Command<f64> = Command::sequence(pulse, decay, Sampling::once(pulse.duration));
    /// assert_eq!(command.duration(), Nanos::from_micros(600));
    /// ```
    pub const fn sequence(stage: Stage<T>, then: Stage<T>, sampling: Sampling) -> Self {
        Self { stage, then: Some(then), sampling, threshold: None }
    }

    /// Makes a stage that ends when a comparator of the drive trips at `threshold`, in A, at the latest after its
    /// duration; then another stage, for the whole of its duration.
    ///
    /// The comparator stops the pulse itself: its output opens the gates after its propagation delay, without a
    /// program, and the drive's timer captures that instant ([`Reading::capture`](crate::Reading::capture)). Until
    /// then the legs of the first stage must keep their gates: no duty and no edge within it. Samples are counted
    /// from the end of the first stage, whether it tripped or not: a trigger at zero samples where the pulse ends,
    /// and its reading has the captured time.
    ///
    /// ```
    /// use standstill_interface::{Abc, Command, Leg, Nanos, Sampling, Stage};
    ///
    /// // Phase a against both others until 2 A flow, for at most 300 µs; then all gates are off for 400 µs.
    /// let pulse = Stage { legs: Abc::new(Leg::High, Leg::Low, Leg::Low), duration: Nanos::from_micros(300) };
    /// let decay = Stage::off(Nanos::from_micros(400));
    /// let command: Command<f32> = Command::until(2.0, pulse, decay, Sampling::once(Nanos::ZERO));
    /// // At most.
    /// assert_eq!(command.duration(), Nanos::from_micros(700));
    /// ```
    pub const fn until(threshold: T, stage: Stage<T>, then: Stage<T>, sampling: Sampling) -> Self {
        Self { stage, then: Some(then), sampling, threshold: Some(threshold) }
    }

    /// Returns the duration of all stages; for a command with a threshold, the longest possible one.
    pub fn duration(&self) -> Nanos {
        self.stage.duration + self.then.as_ref().map_or(Nanos::ZERO, |stage| stage.duration)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_seconds_and_nanoseconds() {
        assert_eq!(Nanos::from_seconds(80e-6), Nanos::from_micros(80));
        assert_eq!(Nanos::from_seconds(1.6e-9), Nanos(2));
        assert_eq!(Nanos::from_seconds(-1.0), Nanos::ZERO);
        assert_eq!(Nanos::from_seconds(f64::NAN), Nanos::ZERO);
        assert_eq!(Nanos::from_seconds(f64::INFINITY), Nanos(u64::MAX));
    }

    #[test]
    fn law_times_saturate() {
        let most = Nanos(u64::MAX);
        assert_eq!((most + Nanos(1), most * 2, Nanos(1) - Nanos(2)), (most, most, Nanos::ZERO));
    }
}
