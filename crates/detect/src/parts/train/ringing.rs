//! Ringing of the terminals' capacitance with the winding after a pulse: its duration, its part of the current at the
//! end of a pulse, and waits until it has decayed.
//!
//! A pulse that begins while a current still rings has that current in all of its samples. The current that the pulse
//! before has left is opposite in forward and backward pulses, so it looks like a difference of the poles.

use standstill_interface::{Command, Fault, Nanos, Phase, Reading, Real, Sampling, Stage};

use super::{Place, PulseTrainSettings, Train};
use crate::nameplate::Nameplate;

/// Largest number of waits after a pulse, each as long as terminals may ring.
pub(super) const MOST_WAITS: u16 = 12;

/// Time from the begin of a pulse after which no line conducts, in fifths of the pulse: a current, as lagging sensors
/// show it, falls at most 1.2 times as long as it has risen.
pub(super) const FALLEN: usize = 11;

/// Standard deviations by which the mean square of readings without current may exceed that of the zeroing.
const QUIET: f64 = 6.0;

/// Current that may be left beside noise, as a share of the pulse's peak. If forward pulses begin with it and backward
/// pulses with its opposite, 10/3 of it appears as a difference of the poles: the fit of x² / 2 to a constant gives ∫
/// x²/2 / ∫ x⁴/4.
const LEFT: f64 = 0.0005;

/// Largest capacitance in F of a terminal with switches and a few metres of cable; the next constant is the quality
/// factor of its ringing with a winding of laminated iron.
const TERMINAL: f64 = 0.5e-9;
const QUALITY: f64 = 5.0;

/// Time constants after which a ringing is over: less than a hundredth of it is left.
const RUNG: f64 = 5.0;

/// Returns the time in which terminals of this capacitance stop ringing: five times 2 Q √(1.5 L C).
pub(super) fn time<T: Real>(drive: &Nameplate<T>) -> Nanos {
    let inductance = drive.line_inductance().to_double() / 2.0;
    let square = T::of(1.5 * inductance * TERMINAL).sqrt().to_double();
    Nanos::from_seconds(RUNG * 2.0 * QUALITY * square)
}

impl<T: Real> PulseTrainSettings<T> {
    /// Returns the largest current with which the open terminal may still ring at the end of a pulse, as a share of the
    /// pulse's current. A step of the potential by half of the link's voltage U starts the ringing: `i = (U/2) √(C/(1.5
    /// L)) e^{−t/(2 Q τ)}` with τ = √(1.5 L C), while the line has U t/(2 L).
    pub(crate) fn rings(&self) -> T {
        let own = T::of(self.ringing.seconds() / (RUNG * 2.0 * QUALITY));
        let pulse = T::of(self.pulse.seconds());
        if own > T::zero() {
            T::of(2.0 / 3.0) * own / pulse * (-pulse / (T::of(2.0 * QUALITY) * own)).exp()
        } else {
            T::zero()
        }
    }
}

impl<T: Real> Train<T> {
    /// Returns the mean square in A² of the deviations of readings without current from their mean, as an estimate of
    /// noise.
    pub(super) fn scatter(&self, readings: &[Reading<T>]) -> Result<T, Fault<T>> {
        let mut squares = T::zero();
        for reading in readings {
            let seen = self.seen(reading)?;
            for &phase in self.read() {
                let apart = seen[phase] - self.offset[phase];
                squares = squares + apart * apart;
            }
        }
        Ok(squares / self.noise_freedom())
    }

    /// Returns the phases whose noise is read by itself: a shunt in the link gives one reading, which stands for each phase.
    fn read(&self) -> &'static [Phase] {
        if self.settings.place == Place::InLink { &Phase::ALL[..1] } else { &Phase::ALL }
    }

    /// Returns the degrees of freedom with which the noise is estimated.
    fn noise_freedom(&self) -> T {
        T::of((usize::from(self.settings.zeroing.saturating_sub(1).max(1)) * self.read().len()) as f64)
    }

    /// Evaluates readings after a pulse: whether its residue, of the line's current and of the ringing charge of the
    /// terminals, is gone as far as noise lets it be seen. If not, a wait follows.
    pub(super) fn decayed(&mut self, readings: &[Reading<T>]) -> Result<(), Fault<T>> {
        let (mut squares, mut count) = (T::zero(), T::zero());
        let mut left = T::zero();
        for reading in readings {
            left = self.beyond_offset(reading)?;
            let seen = self.seen(reading)?;
            for &phase in self.read() {
                let apart = seen[phase] - self.offset[phase];
                (squares, count) = (squares + apart * apart, count + T::one());
            }
        }
        let two = T::of(2.0);
        let scatter = T::of(QUIET) * (two / count + two / self.noise_freedom()).sqrt();
        let share = self.last_peak * T::of(LEFT);
        let quiet = squares <= count * (self.noise * (T::one() + scatter) + share * share);
        let threshold = self.settings.threshold;
        let unseen = self.settings.place.switches() && self.waits == 0;
        // A current that lasts longer than terminals can ring has another cause.
        let over = self.still_rings() == Nanos::ZERO || self.waits >= MOST_WAITS;
        if over || quiet && !unseen && left <= threshold {
            self.margin.waited(self.waits + 1, MOST_WAITS + 1, left / threshold);
            self.margin.at_most(left, threshold);
            self.waits = 0;
            return if left <= threshold { Ok(()) } else { Err(Fault::CurrentPersists(left)) };
        }
        self.waits += 1;
        Ok(())
    }

    /// Returns for how long after the rest terminals may ring.
    fn still_rings(&self) -> Nanos {
        let s = &self.settings;
        s.ringing - (s.rest - s.pulse)
    }

    /// Returns the number of samples of a wait: no more than a pulse has.
    pub(super) fn samples_of_wait(&self) -> usize {
        let samples = self.still_rings().0.div_ceil(self.settings.interval.0.max(1));
        usize::try_from(samples).unwrap_or(usize::MAX).min(self.settings.samples())
    }

    /// Returns the command of a wait.
    pub(super) fn wait(&self) -> Command<T> {
        let count = self.samples_of_wait() as u64;
        let interval = Nanos(self.still_rings().0.div_ceil(count.max(1)));
        let sampling =
            Sampling { first: interval, interval, count: u32::try_from(count).unwrap_or(u32::MAX) };
        Command::hold(Stage::off(interval * count), sampling)
    }
}
