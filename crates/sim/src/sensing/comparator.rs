//! Comparators: they end a pulse when its current reaches a threshold; a timer captures the time of this trip.

use standstill_interface::{Nanos, Phase, choice};

use crate::{Purpose, Streams};

choice! {
    /// Arrangement of a drive's comparators: the currents that they compare with the threshold.
    #[derive(Default)]
    pub enum Comparators {
        /// One comparator for the current in the DC link: the sum of the currents of the legs at the positive rail. While only one leg
        /// is high, that is its current; while only one leg is low, that is minus its current.
        Common = "common" default,
        /// Two comparators for each phase, one for each direction of the current, each with its own offset and delay. Their inputs are
        /// the phases' current sensors: in line, or shunts below the legs, which carry a leg's current while its lower device conducts.
        PerLeg = "per-leg",
    }
}

/// Number of comparators on a drive with two per phase. The first three are for currents into the motor in phases a, b and c. The last
/// three are for currents out of the motor in the same phases.
pub const OWN: usize = 6;

/// Time during which the simulated noise of a comparator stays constant, as a share of the noise's time constant.
const NOISE_HOLD: f64 = 0.25;

/// Settings of the comparators of a type of drive. The errors of each specimen are drawn from them. A drive with neither a timer nor an
/// overcurrent trip has no comparators.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ComparatorSettings {
    /// Arrangement of the comparators: one for the link's current, or two for each phase.
    pub arrangement: Comparators,
    /// Tick in s of the timer that captures the times of the comparators' trips. Zero means no timer.
    pub timer: f64,
    /// Standard deviation of the relative error of the timer's clock.
    pub timer_error: f64,
    /// Standard deviation of each comparator's offset in A.
    pub offset: f64,
    /// Mean propagation delay in s from the crossing of the threshold to the gate signals and to the timer.
    pub delay: f64,
    /// Standard deviation in s of each comparator's delay.
    pub delay_spread: f64,
    /// Noise of the current at each comparator's input in A rms. [`Comparator`] describes its spectrum.
    pub noise: f64,
    /// Corner frequency of the comparators' noise in Hz. Zero means that the noise stays constant during a pulse.
    pub noise_bandwidth: f64,
    /// Blanking time: after the beginning of each stage, the comparators are ignored for this time.
    pub blanking: Nanos,
    /// Number of bits of the converter that sets the threshold. Zero means an exact threshold.
    pub bits: u8,
    /// Upper end in A of the range of the converter that sets the threshold.
    pub range: f64,
    /// Current in A at which the comparators switch the drive off permanently. Zero means never.
    pub trip: f64,
}

impl ComparatorSettings {
    /// Returns the number of comparators: 0, 1, or 6 if there are two per phase.
    pub fn count(&self) -> usize {
        match self.arrangement {
            _ if !self.any() => 0,
            Comparators::Common => 1,
            Comparators::PerLeg => OWN,
        }
    }

    /// Returns whether the drive has comparators.
    pub fn any(&self) -> bool {
        self.timer > 0.0 || self.trip > 0.0
    }

    /// Returns the time in ns during which the simulated noise stays constant, and the correlation of successive noise values. None
    /// without noise, or if the noise stays constant during a pulse.
    pub(crate) fn noise_hold(&self) -> Option<(f64, f64)> {
        let time_constant = 1.0 / (std::f64::consts::TAU * self.noise_bandwidth);
        (self.noise > 0.0 && self.noise_bandwidth > 0.0)
            .then(|| (time_constant * 1e9 * NOISE_HOLD, standstill_numeric::exp(-NOISE_HOLD)))
    }

    /// Returns the highest threshold in A that the drive's converter can set. Without a converter any threshold can be set, and the value
    /// is 0.
    pub fn highest(&self) -> f64 {
        if self.bits == 0 { 0.0 } else { self.set(self.range) }
    }

    /// Returns the threshold in A that the drive's converter sets for a requested `threshold` in A.
    ///
    /// ```
    /// use standstill_sim::ComparatorSettings;
    ///
    /// let coarse = ComparatorSettings { bits: 4, range: 16.0, ..ComparatorSettings::default() };
    /// assert_eq!([2.4, 2.6, 99.0].map(|threshold| coarse.set(threshold)), [2.0, 3.0, 15.0]);
    /// assert_eq!(ComparatorSettings::default().set(2.4), 2.4);
    /// ```
    pub fn set(&self, threshold: f64) -> f64 {
        if self.bits == 0 {
            return threshold;
        }
        let codes = f64::from(1_u32 << self.bits);
        let step = self.range / codes;
        step * (threshold / step).round().clamp(0.0, codes - 1.0)
    }
}

/// The errors of one specimen's comparators and timer.
///
/// A comparator trips at most once in a command, because the drive latches its output. After the trip, noise and the reversal of the
/// link's current at the opening of the gates have no effect. A comparator's hysteresis would act only before the trip, and there it is
/// part of the offset.
///
/// The noise has the spectrum of a first-order filter. Its correlation falls to 1/e in the time τ = 1/(2π f). The comparator trips at the
/// first crossing, so faster noise makes the trip earlier and its scatter smaller. The simulated noise keeps each value for τ/4. This
/// time takes the place of the comparator's response time. Noise without a bandwidth has a τ longer than a pulse: one draw shifts the
/// threshold for the whole pulse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparator {
    /// Offset of each comparator in A. The comparator compares its current minus this offset. A single comparator uses the first value.
    pub offset: [f64; OWN],
    /// Propagation delay of each comparator in s.
    pub delay: [f64; OWN],
    /// Duration of the timer's tick in s.
    pub tick: f64,
    /// Time by which the timer starts before the pulse, as a share of a tick between −½ and ½. It is negative if the timer starts later.
    pub phase: f64,
}

impl Comparator {
    /// Makes the comparators of a drive without errors.
    pub const fn nominal(settings: &ComparatorSettings) -> Self {
        Self { offset: [0.0; OWN], delay: [settings.delay; OWN], tick: settings.timer, phase: 0.0 }
    }

    /// Draws the errors of one specimen's comparators. For a drive without comparators it draws no numbers.
    pub(super) fn draw(settings: &ComparatorSettings, streams: Streams) -> Self {
        let mut drawn = Self::nominal(settings);
        if !settings.any() {
            return drawn;
        }
        let [mut offsets, mut delays, mut timer] = streams.open_together([
            Purpose::ComparatorOffset,
            Purpose::ComparatorDelay,
            Purpose::CaptureTimer,
        ]);
        for n in 0..settings.count() {
            drawn.offset[n] = settings.offset * offsets.normal();
            drawn.delay[n] = (settings.delay + settings.delay_spread * delays.normal()).max(0.0);
        }
        drawn.tick = settings.timer * (1.0 + settings.timer_error * timer.normal()).max(0.1);
        drawn.phase = timer.uniform() - 0.5;
        drawn
    }

    /// Returns the number of whole ticks that the timer has counted at `time` in s after the beginning of the pulse.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a conversion saturates")]
    pub fn ticks(&self, time: f64) -> u32 {
        (time / self.tick + self.phase).floor() as u32
    }
}

/// One comparator of a drive, identified by the current at its input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// The current in the DC link.
    Link,
    /// The current of a phase (0 to 2) into the motor.
    Into(usize),
    /// The current of a phase (0 to 2) out of the motor.
    Out(usize),
}

impl Input {
    /// Returns the comparator's index among the comparators of a drive.
    pub fn number(self) -> usize {
        match self {
            Self::Link => 0,
            Self::Into(phase) => phase,
            Self::Out(phase) => 3 + phase,
        }
    }

    /// Returns the comparator's phase. For the comparator in the DC link it is phase a.
    pub fn phase(self) -> Phase {
        Phase::ALL[self.number() % 3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_ticks_that_have_passed() {
        let settings = ComparatorSettings { timer: 0.32e-6, ..ComparatorSettings::default() };
        let timer = Comparator::nominal(&settings);
        assert_eq!(
            [0.0, 0.31e-6, 0.33e-6, 320.1e-6, 1e6].map(|time| timer.ticks(time)),
            [0, 0, 1, 1000, u32::MAX]
        );
        let early = Comparator { phase: -0.4, ..timer };
        assert_eq!([0.0, 0.33e-6, 0.46e-6].map(|time| early.ticks(time)), [0, 0, 1]);
    }

    #[test]
    fn law_specimens_have_the_stated_spread() {
        let settings = ComparatorSettings {
            arrangement: Comparators::PerLeg,
            timer: 1e-6,
            timer_error: 0.01,
            offset: 0.1,
            delay: 200e-9,
            delay_spread: 10e-9,
            ..ComparatorSettings::default()
        };
        let n = 2000;
        let drawn = |arrangement| {
            (0..n).map(move |k| {
                Comparator::draw(&ComparatorSettings { arrangement, ..settings }, Streams::new(1, k))
            })
        };
        let rms = |of: &dyn Fn(&Comparator) -> f64| {
            (drawn(Comparators::PerLeg).map(|one| of(&one).powi(2)).sum::<f64>() / n as f64).sqrt()
        };
        for k in 0..OWN {
            assert!((rms(&|one| one.offset[k]) / 0.1 - 1.0).abs() < 0.06);
            assert!((rms(&|one| one.delay[k] - 200e-9) / 10e-9 - 1.0).abs() < 0.06);
        }
        assert!((rms(&|one| one.tick / 1e-6 - 1.0) / 0.01 - 1.0).abs() < 0.06);
        assert!((rms(&|one| one.phase) * 12.0_f64.sqrt() - 1.0).abs() < 0.06);
        // A single comparator has the draw of the first of six; the other offsets stay zero.
        assert!(drawn(Comparators::Common).zip(drawn(Comparators::PerLeg)).all(|(one, own)| {
            one.offset[0] == own.offset[0] && one.offset[1..] == [0.0; 5] && own.offset[1] != 0.0
        }));
    }
}
