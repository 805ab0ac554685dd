//! Settings of the open terminal.

use standstill_interface::{Nanos, Real, Sampling};

use crate::checks::Checks;
use crate::keys::{Keyed, Lines, Microseconds, Setting, Value, place};
use crate::nameplate::Nameplate;
use crate::parts::lines::SaliencySign;
use crate::parts::polarity::Signature;
use crate::parts::train::{rest_after, share_of};
use crate::settings::{
    LONGEST, SettingsError, Source, require, require_error, require_positive, require_share,
    require_zero_or_more,
};

/// Time constants after which a divider's filter has settled to 3e-4.
const SETTLED: f64 = 8.0;

/// Least number of samples of a pulse that are used.
const LEAST_SAMPLES: usize = 4;

/// Settings of the open terminal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenTerminalSettings<T> {
    /// Time for which the DC link is connected to a line.
    pub pulse: Nanos,
    /// Time for which all gates are off after the pulse.
    pub rest: Nanos,
    /// Number of rounds of six pulses.
    pub rounds: u8,
    /// Interval between ADC samples.
    pub interval: Nanos,
    /// Time from the begin of a vector to the first used sample. Until then the terminals' capacitances have stopped
    /// ringing, and the dividers' filters have settled.
    pub settle: Nanos,
    /// Largest number of repetitions of a rest; after these the detection fails.
    pub attempts: u16,
    /// Whether the dividers are compared on an all-high vector.
    pub comparison: bool,
    /// Relative standard deviation of the dividers' gains; used if the gains are not compared.
    pub gain_tolerance: T,
    /// Standard deviation of the dividers' offsets in V.
    pub offset: T,
    /// Standard deviation of errors that imitate saturation, as a share of the line's voltage.
    pub pole_floor: T,
    /// Resistance of a phase in Ω.
    pub resistance: T,
    /// Mean inductance of a line in H: L_d + L_q.
    pub line_inductance: T,
    /// κ: rise of 1/L_q with a current along the magnet, as a multiple of the rise of 1/L_d.
    pub cross_saturation: T,
    /// Dead time of the drive.
    pub dead_time: Nanos,
    /// Sign of the motor's L_B.
    pub saliency: SaliencySign,
    /// |L_B| / L_A below which no angle is named.
    pub least_saliency: T,
    /// The pole that draws more current in pulses like these.
    pub signature: Signature,
    /// Probability of a wrong pole that is allowed.
    pub pole_error: T,
    /// Checks that are on: whether the rotor stands still.
    pub checks: Checks,
    /// Flux linkage of the magnet in Wb, by which a turning rotor induces a voltage; zero without a magnet.
    pub magnet_flux: T,
    /// Corner frequency in Hz of the dividers' filters; none: no filter.
    pub bandwidth: Option<T>,
    /// Time from the first conversion of a sample to its last one.
    pub averaged: Nanos,
}

impl<T: Real> OpenTerminalSettings<T> {
    /// Returns settings for this motor and drive: pulses that raise half of the rated current. On the paper's motor
    /// they last 200 µs, and the detection 3.6 ms.
    pub fn suited(drive: &Nameplate<T>) -> Self {
        let dividers = &drive.dividers;
        Self {
            pulse: Nanos::ZERO,
            rest: Nanos::ZERO,
            rounds: 1,
            interval: Nanos::ZERO,
            settle: Nanos::ZERO,
            attempts: 50,
            comparison: true,
            gain_tolerance: dividers.gain_tolerance,
            offset: dividers.offset,
            pole_floor: T::of(5e-4),
            resistance: drive.resistance,
            line_inductance: drive.line_inductance(),
            cross_saturation: drive.cross_saturation,
            dead_time: drive.dead_time,
            saliency: drive.saliency(),
            least_saliency: T::of(0.005),
            signature: drive.pulse_signature,
            pole_error: T::of(1e-6),
            checks: Checks::ALL,
            magnet_flux: drive.magnet_flux,
            bandwidth: dividers.bandwidth,
            averaged: drive.sensing.averaged,
        }
        .with_pulse(drive.line_pulse(T::of(0.5)))
    }

    /// Returns the settings with pulses of another length: 8 to 20 samples in each, of which the second half is used.
    pub(super) fn with_pulse(self, pulse: Nanos) -> Self {
        let parts = (pulse.0 / 10_000).clamp(8, 20);
        let interval = Nanos(pulse.0 / parts);
        let lag = self.bandwidth.map_or(T::zero(), |corner| (T::TAU() * corner).recip());
        let filtered = Nanos::from_seconds((T::of(SETTLED) * lag).to_double()) + self.dead_time;
        let settle = Nanos(pulse.0 / 2).max(filtered);
        Self { pulse, interval, settle, rest: rest_after(pulse), ..self }
    }

    pub(super) fn check(&self) -> Result<(), SettingsError> {
        require(
            self.pulse > Nanos::ZERO && self.pulse <= LONGEST,
            "pulse",
            "more than zero and a minute at most",
        )?;
        require(self.dead_time < self.pulse, "dead_time", "shorter than the pulse")?;
        require(self.rest > self.pulse, "rest", "longer than the pulse: the current needs as long to decay")?;
        require(self.rest <= LONGEST, "rest", "such that a pulse takes a minute at most")?;
        require(self.rounds > 0, "rounds", "at least 1")?;
        require(self.interval.0 >= 2, "interval", "2 ns or more")?;
        require(
            u16::try_from(self.samples()).is_ok(),
            "interval",
            "such that a pulse has 65,535 samples at most",
        )?;
        let needed = "so long that the dividers' filters settle in the first part of it, and samples remain";
        require(self.settle < self.pulse && self.used() >= LEAST_SAMPLES, "pulse", needed)?;
        let needed = "such that all conversions of a sample come before the next edge: half of an interval";
        require(self.averaged * 2 < self.interval, "sensors.oversampling", needed)?;
        require(self.attempts > 0, "attempts", "at least 1")?;
        let tolerance = self.gain_tolerance;
        require(tolerance >= T::zero() && tolerance < T::one(), "gain_tolerance", "from 0 to below 1")?;
        require_zero_or_more(self.offset, "offset")?;
        require_share(self.pole_floor, "pole_floor")?;
        require_zero_or_more(self.resistance, "resistance")?;
        require_positive(self.line_inductance, "line_inductance")?;
        require(self.cross_saturation.is_finite(), "cross_saturation", "finite")?;
        require_zero_or_more(self.magnet_flux, "magnet_flux")?;
        require_share(self.least_saliency, "least_saliency")?;
        require_error(self.pole_error, "pole_error")
    }

    /// Returns the time of a sample after the begin of its command: the middle of its interval, so that jitter cannot
    /// move a sample beyond the end of its pulse.
    pub(super) fn time(&self, sample: usize) -> Nanos {
        Nanos(self.interval.0 / 2) + self.interval * sample as u64
    }

    /// Returns the number of samples of a command of this duration.
    pub(super) fn samples_in(&self, duration: Nanos) -> usize {
        let after = duration - Nanos(self.interval.0 / 2);
        usize::try_from(after.0 / self.interval.0.max(1)).unwrap_or(usize::MAX).saturating_add(1)
    }

    /// Returns the number of samples of a pulse and its rest.
    pub(super) fn samples(&self) -> usize {
        self.samples_in(self.pulse + self.rest)
    }

    /// Returns the indices of the samples of a pulse that are used: the first one, and the one after the last.
    pub(super) fn window(&self) -> (usize, usize) {
        let half = self.interval.0 / 2;
        let number = |until: Nanos| (until.0.saturating_sub(half)).div_ceil(self.interval.0.max(1));
        let as_count = |number: u64| usize::try_from(number).unwrap_or(usize::MAX);
        (as_count(number(self.settle)), as_count(number(self.pulse)))
    }

    pub(super) fn used(&self) -> usize {
        let (from, to) = self.window();
        to.saturating_sub(from)
    }

    pub(super) fn sampling(&self, duration: Nanos) -> Sampling {
        let count = u32::try_from(self.samples_in(duration)).unwrap_or(u32::MAX);
        Sampling { first: self.time(0), interval: self.interval, count }
    }
}

impl<T: Real> Keyed for OpenTerminalSettings<T> {
    const SETTINGS: &'static [Setting<Self>] = &[
        place!(PULSE, s => Value::time(s.pulse); value => *s = s.with_pulse(value.nanos())),
        place!(
            REST, s => Value::Number(share_of(s.pulse, s.rest));
            value => s.rest = Nanos::from_seconds(value.number() * s.pulse.seconds())
        ),
        place!(ROUNDS, s => s.rounds, Value::times, count),
        place!(LEAST_SALIENCY, s => s.least_saliency, Value::of, real),
        place!(POLE_ERROR, s => s.pole_error, Value::of, real),
        place!(GAIN_TOLERANCE, s => s.gain_tolerance, Value::of, real),
        place!(CHECKS, s => s.checks => value, set_value),
        place!(COMPARISON, s => s.comparison, Value::Flag, is_set),
    ];

    const SOURCES: &'static [Source] = &[Source::Terminals];

    fn describe(&self, line: &mut Lines<'_>) {
        line("pulse", format_args!("{}", Microseconds(self.pulse)));
        line("rest", format_args!("{}", Microseconds(self.rest)));
        line("rounds", format_args!("{}", self.rounds));
        line("interval", format_args!("{}", Microseconds(self.interval)));
        line("settle", format_args!("{}", Microseconds(self.settle)));
        line("signature", format_args!("{}", self.signature.in_words()));
    }
}
