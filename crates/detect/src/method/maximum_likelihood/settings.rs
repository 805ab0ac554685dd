//! Settings of the maximum-likelihood method.

use standstill_interface::{Nanos, Real};

use super::MOST_SAMPLES;
use crate::checks::{Check, Checks};
use crate::keys::{self, Keyed, Lines, Microseconds, Setting, Value, place};
use crate::nameplate::Nameplate;
use crate::parts::both_ways::BothWaysSettings;
use crate::parts::polarity::Signature;
use crate::parts::train::{PulseTrainSettings, ZEROING_INTERVAL, rest_after};
use crate::settings::{SettingsError, Source, require, require_positive};

/// When to stop lengthening the pulses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive<T> {
    /// Standard deviation of the angle in rad that is good enough.
    pub deviation: T,
    /// The longest pulse. Trains of it are repeated if it does not suffice.
    pub longest: Nanos,
    /// Current in A up to which pulses are lengthened.
    pub most_current: T,
    /// Largest number of trains; after it the answer is final.
    pub most_trains: u8,
}

/// Settings of the maximum-likelihood method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaximumLikelihoodSettings<T> {
    /// Pulses, or with `adaptive` the first ones, and how they are read.
    pub pulses: BothWaysSettings<T>,
    /// Whether and how the pulses grow.
    pub adaptive: Option<Adaptive<T>>,
}

impl<T: Real> MaximumLikelihoodSettings<T> {
    /// Returns settings for this motor and drive, with a sample every 10 µs.
    pub fn suited(drive: &Nameplate<T>) -> Self {
        // Short pulses have more samples.
        let interval = Nanos::from_micros(10).min(Nanos(drive.line_pulse(T::of(0.5)).0 / LEAST_PARTS));
        let interval = interval.max(drive.sensing.settle);
        let mut pulses = BothWaysSettings::suited(drive, interval);
        if pulses.train.samples() > MOST_SAMPLES {
            pulses.train.interval = Nanos(pulses.train.pulse.0 / 40);
        }
        Self { pulses, adaptive: None }
    }

    /// Returns adaptive settings. The pulses begin at a quarter of their length, with one round each, and grow until
    /// the angle is known to a tenth of a degree and the pole is certain. They grow at most to the length that raises
    /// three quarters of the rated current, and never beyond the rated current in any line.
    pub fn adaptive(drive: &Nameplate<T>) -> Self {
        let fixed = Self::suited(drive).pulses;
        let adaptive = Adaptive {
            deviation: T::of(0.1).to_radians(),
            longest: drive.line_pulse(T::of(0.75)).min(drive.longest_pulse()),
            most_current: drive.rated_current,
            most_trains: 8,
        };
        let pulse = Nanos((fixed.train.pulse.0 / 4).max(LEAST_PARTS * 10_000)).min(adaptive.longest);
        // What holds at half of the rated current and at all of it.
        let signature =
            if drive.signature == drive.pulse_signature { drive.signature } else { Signature::None };
        let mut train = lengthened(fixed.train, pulse, 1);
        // The first pulses are short, and one line may have twice the mean inductance.
        train.least_current = drive.rated_current * T::of(0.02);
        let pulses = BothWaysSettings { train, signature, ..fixed };
        Self { pulses, adaptive: Some(adaptive) }
    }

    /// Sets the length of the pulses, or with `adaptive` of the first ones. Samples are 10 µs apart if there is room
    /// for them.
    #[must_use]
    pub fn with_pulse(self, pulse: Nanos) -> Self {
        let mut settings = self;
        let train = &mut settings.pulses.train;
        *train = lengthened(*train, pulse, train.rounds);
        if let Some(adaptive) = &mut settings.adaptive {
            adaptive.longest = adaptive.longest.max(train.pulse);
        }
        settings
    }

    pub(super) fn check(&self) -> Result<(), SettingsError> {
        let train = &self.pulses.train;
        train.check()?;
        require(train.samples() <= MOST_SAMPLES, "interval", "such that a pulse has 112 samples at most")?;
        require(train.samples_on() as u64 >= LEAST_PARTS, "interval", "at most a quarter of the pulse")?;
        if let Some(adaptive) = self.adaptive {
            require_positive(adaptive.deviation, "adaptive.deviation")?;
            require(adaptive.longest >= train.pulse, "adaptive.longest", "at least as long as the pulse")?;
            require_positive(adaptive.most_current, "adaptive.most_current")?;
            require(adaptive.longest <= Nanos(1_000_000_000), "adaptive.longest", "a second at most")?;
            require(adaptive.most_trains > 0, "adaptive.most_trains", "at least 1")?;
        }
        self.pulses.check()?;
        // Samples of a zeroing may follow each other faster than those of a pulse.
        let interval = train.interval.min(ZEROING_INTERVAL);
        let needed =
            "such that all phases are converted before the next sample: less than half of the interval";
        let sensing = &self.pulses.sensing;
        require(sensing.skew * 2 < interval, "sensors.skew", needed)?;
        let needed = "such that all conversions of a sample come before the next one: twice `skew` and their span within an interval";
        require(sensing.skew * 2 + sensing.averaged < interval, "sensors.oversampling", needed)?;
        // The rise of the current after one edge and its fall after the other must leave samples.
        let blank = Nanos::from_seconds(self.pulses.sensing.blank().to_double());
        let needed =
            "such that a pulse leaves samples that no edge spoils: at most a tenth of the shortest pulse";
        require(blank * 2 <= train.pulse, self.pulses.sensing.blank_key(), needed)?;
        let needed =
            "with the dead time at most the interval between two samples: no sample of a pulse may be hidden";
        require(self.pulses.sensing.settle <= train.interval, "sensors.settle", needed)
    }
}

/// Samples in a pulse at least.
const LEAST_PARTS: u64 = 4;

/// Returns the train with pulses of another length, in whole microseconds, and as many samples as fit.
pub(super) fn lengthened<T: Real>(
    train: PulseTrainSettings<T>,
    pulse: Nanos,
    rounds: u8,
) -> PulseTrainSettings<T> {
    // Every 10 µs, if these are enough for a fit, and not so many that a pulse and its rest are too many.
    let parts = (pulse.0 / 10_000).clamp(LEAST_PARTS, 40);
    let interval = Nanos(pulse.0 / parts / 100 * 100);
    let pulse = interval * parts;
    PulseTrainSettings { pulse, interval, rest: rest_after(pulse), rounds, ..train }
}

impl<T: Real> Keyed for MaximumLikelihoodSettings<T> {
    const SOURCES: &'static [Source] = &[Source::PhaseCurrents, Source::LinkCurrent];

    const CHECKS: Checks = Checks::ALL.without(Check::BothWays).without(Check::Contact).without(Check::Codes);

    const SETTINGS: &'static [Setting<Self>] = &[
        place!(PULSE, s => Value::time(s.pulses.train.pulse); value => *s = s.with_pulse(value.nanos())),
        Setting::new(
            &keys::REST,
            // Pulses that grow choose their rests.
            |s| s.adaptive.is_none().then(|| Value::Number(s.pulses.train.rest_share())),
            |s, value| {
                if s.adaptive.is_none() {
                    s.pulses.train.set_rest_share(value.number());
                }
                s.adaptive.is_none()
            },
        ),
        place!(ROUNDS, s => s.pulses.train.rounds, Value::times, count),
        place!(LEAST_SALIENCY, s => s.pulses.least_saliency, Value::of, real),
        place!(POLE_ERROR, s => s.pulses.pole_error, Value::of, real),
        place!(GAIN_TOLERANCE, s => s.pulses.gain_tolerance, Value::of, real),
        place!(CHECKS, s => s.pulses.plausibility.checks => value, set_value),
        place!(
            BANDWIDTH, s => Value::of(s.pulses.sensing.bandwidth.unwrap_or_else(T::zero));
            value => s.pulses.sensing.bandwidth =
                Some(value.real()).filter(|corner: &T| *corner > T::zero())
        ),
        Setting::new(
            &keys::DEVIATION,
            |s| s.adaptive.map(|adaptive| Value::Number(adaptive.deviation.to_double().to_degrees())),
            |s, value| match &mut s.adaptive {
                Some(adaptive) => {
                    adaptive.deviation = T::of(value.number().to_radians());
                    true
                }
                None => false,
            },
        ),
    ];

    fn describe(&self, line: &mut Lines<'_>) {
        self.pulses.train.describe(line);
        if let Some(adaptive) = self.adaptive {
            line("adaptive.deviation", format_args!("{:.2}°", adaptive.deviation.to_degrees()));
            line("adaptive.longest", format_args!("{}", Microseconds(adaptive.longest)));
            line("adaptive.most_current", format_args!("{:.3} A", adaptive.most_current));
        }
        if let Some(bandwidth) = self.pulses.sensing.bandwidth {
            line("sensing.bandwidth", format_args!("{:.1} kHz", bandwidth / T::of(1e3)));
        }
        line("signature", format_args!("{}", self.pulses.signature.in_words()));
    }
}
