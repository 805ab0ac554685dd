//! Six pulses: one leg against the two others, in all six directions, each until its current reaches a threshold.
//!
//! ```text
//!   a high, b and c low ─► a comparator trips ─► all off ─► 60° further: c low, a and b high ─► …
//!          t_0                                                   t_1                             t_5
//! ```
//! A drive with a comparator and a timer needs no converter for this method, because only six durations are measured.
//! y = 1/t is the mean slope of the current up to the threshold, in the direction φ of the vector. For a motor without
//! saturation and with L_B/L_A = k, `y = Y (1 − k cos 2(θ − φ))` apart from the resistance's effect; saturation along
//! the magnet adds `p cos(θ − φ)`. So for six directions, 60° apart,
//! ```text
//!   z2 = Σ y e^{j2φ} / (3 Y) = −k e^{j2θ}         the axis, as equations (5) to (7) of line pulses
//!   z1 = Σ y e^{jφ} / (3 Y)  =  p e^{jθ}          the pole
//!   z3 = Σ y (−1)^n / (6 Y)                       what fits neither: a residual of one degree of freedom
//! ```
//! Using the time t instead of its inverse y would cause errors of degrees. p grows with the square of the threshold.
//!
//! Errors common to all six times have no effect to first order: the threshold's own error, the offset of a single
//! comparator, an unknown delay, the timer's clock. Errors that differ do matter: half a tick of the timer in both
//! directions, noise at the comparator, and, if each leg has its own comparators, their offsets, which together look like
//! a pole.
//!
//! Without a timer, all pulses have the same length, and the current of the single leg is sampled at the end: y is that
//! current divided by the link's voltage. Offsets, which would look like a pole, are read after the decay of each
//! pulse. A shunt in the link shows that current, positive in all six directions, by one gain and one offset.
//!
//! The vectors follow one another around the circle, so that a small current left by the previous pulse shifts all of
//! them nearly alike. In opposite pairs it would lengthen one pulse of each pair, which looks like a pole; opposite
//! pairs exist for comparison. A second round runs backwards, which cancels linear drift.

mod sampled;
mod settings;
#[cfg(test)]
mod tests;

use standstill_interface::{
    Abc, AlphaBeta, Angle, Command, Fault, Findings, Leg, Nanos, Phase, Reading, Real, Sampling, Stage, Step,
};

use crate::checks::Check;
use crate::method::Sequence;
use crate::parts::margin::Margin;
use crate::parts::polarity::{Pointer, Pole};
use crate::parts::settle::link;
use crate::parts::significance;
use crate::parts::train::Derived;
use crate::parts::turning::Standing;
use crate::settings::SettingsError;
pub use settings::SixPulseSettings;

/// Number of vectors in a round.
const VECTORS: usize = 6;

/// Order of the vectors if opposite ones follow each other.
const PAIRS: [usize; VECTORS] = [0, 3, 1, 4, 2, 5];

/// Returns the phase of the single leg in the vector with this number, and whether this leg is high.
const fn alone(number: usize) -> (Phase, bool) {
    (Phase::ALL[[0, 2, 1, 0, 2, 1][number]], number.is_multiple_of(2))
}

/// Returns the unit vector at `harmonic` times the direction of the vector with this number.
fn direction<T: Real>(number: usize, harmonic: usize) -> AlphaBeta<T> {
    // The components are exactly symmetric, so that a part common to all six vectors sums to exactly zero.
    let half = T::of(0.5);
    let high = T::of(0.75).sqrt();
    match number * harmonic % VECTORS {
        0 => AlphaBeta::new(T::one(), T::zero()),
        1 => AlphaBeta::new(half, high),
        2 => AlphaBeta::new(-half, high),
        3 => AlphaBeta::new(-T::one(), T::zero()),
        4 => AlphaBeta::new(-half, -high),
        _ => AlphaBeta::new(half, -high),
    }
}

/// Statistics of the pulses of one direction.
#[derive(Clone, Copy, Debug)]
struct Pulses<T> {
    count: T,
    /// Mean of y, in 1/s per volt of the link if timed, else in A per volt; the next field is the sum of squared
    /// deviations from the mean.
    mean: T,
    squares: T,
    /// Mean of t in s.
    time: T,
    /// Mean instant in s at which the current passed the threshold or was sampled.
    instant: T,
}

impl<T: Real> Pulses<T> {
    fn add(&mut self, y: T, time: T, instant: T) {
        self.count = self.count + T::one();
        let apart = y - self.mean;
        self.mean = self.mean + apart / self.count;
        self.squares = self.squares + apart * (y - self.mean);
        self.time = self.time + (time - self.time) / self.count;
        self.instant = self.instant + (instant - self.instant) / self.count;
    }
}

/// The detector of the six pulses.
#[derive(Clone, Debug)]
pub struct SixPulse<T> {
    settings: SixPulseSettings<T>,
    /// Number of pulses given so far.
    given: usize,
    /// Time in s from the start of the detection to the end of the last pulse and its pause.
    clock: T,
    pulses: [Pulses<T>; VECTORS],
    /// Sum in V of the link's voltages, one for each pulse.
    volts: T,
    /// Phases without a sensor, as seen so far.
    derived: Derived,
    margin: Margin<T>,
    findings: Findings<T>,
}

impl<T: Real> SixPulse<T> {
    /// Makes a detector, ready for its first step.
    ///
    /// # Errors
    /// The method cannot work with one of the settings.
    pub fn new(settings: SixPulseSettings<T>) -> Result<Self, SettingsError> {
        settings.check()?;
        let zero = T::zero();
        Ok(Self {
            settings,
            given: 0,
            clock: zero,
            pulses: [Pulses { count: zero, mean: zero, squares: zero, time: zero, instant: zero }; VECTORS],
            volts: zero,
            derived: Derived::None,
            margin: Margin::new(),
            findings: Findings::default(),
        })
    }

    /// Returns the number of a pulse's vector: around the circle or in opposite pairs, and backwards in the next round.
    fn vector(&self, pulse: usize) -> usize {
        let (round, place) = (pulse / VECTORS, pulse % VECTORS);
        let place = if round.is_multiple_of(2) { place } else { VECTORS - 1 - place };
        if self.settings.pairs { PAIRS[place] } else { place }
    }

    fn command(&self) -> Command<T> {
        let s = &self.settings;
        let (phase, high) = alone(self.vector(self.given));
        let (one, others) = if high { (Leg::High, Leg::Low) } else { (Leg::Low, Leg::High) };
        let mut legs = Abc([others; 3]);
        legs[phase] = one;
        let length = s.pulse();
        let (pulse, rest) = (Stage { legs, duration: length }, Stage::off(s.pause()));
        if s.timed {
            Command::until(s.threshold, pulse, rest, Sampling::once(Nanos::ZERO))
        } else {
            let sampled = length - s.sensing.lead();
            Command::sequence(pulse, rest, Sampling::twice(sampled, length + rest.duration))
        }
    }

    /// Returns y and t of the pulse for the vector with this number.
    fn measured(&mut self, number: usize, readings: &[Reading<T>]) -> Result<(T, T), Fault<T>> {
        let s = &self.settings;
        let dead_time = T::of(s.dead_time.seconds());
        if s.timed {
            let [reading] = readings else { return Err(Fault::UnexpectedReadings) };
            let voltage = link(reading)?;
            self.volts = self.volts + voltage;
            let Some(capture) = reading.capture else {
                self.margin.at_least(T::zero(), T::one());
                // Of the current only this is known: it stayed below the threshold.
                return Err(Fault::NoCurrent { peak: T::zero(), needed: s.threshold });
            };
            let comparator = &s.sensing.comparator;
            let ticks = T::of(f64::from(capture.ticks) + 0.5);
            let time = ticks * comparator.tick - comparator.delay - dead_time;
            // A fast clock may count a trip slightly beyond the end of the longest pulse, but no clock counts twice its
            // length.
            let longest = T::of(s.longest.seconds());
            if time > longest + longest {
                return Err(Fault::UnexpectedReadings);
            }
            self.margin.at_most(time.min(longest), longest);
            // A comparator whose threshold is exceeded when its blanking ends trips at once: within a tick and a half
            // of that end, plus the tolerances of clock and delay. Such a trip does not show when the current passed
            // the threshold.
            let three = T::of(3.0);
            let clock = (comparator.blanking + comparator.delay) * comparator.clock_error * three;
            let watched =
                (comparator.blanking - dead_time).max(T::zero()) + clock + comparator.delay_spread * three;
            let needed = watched + comparator.tick * T::of(1.5);
            self.margin.at_least(time, needed);
            if time <= needed {
                return Err(Fault::TrippedEarly { time, needed });
            }
            return Ok(((time * voltage).recip(), time));
        }
        self.sampled(number, readings)
    }

    /// Returns the instant in s of a time that counts from the end of a pulse's dead time, and advances the clock to the end of the pause.
    /// A comparator ends the pulse.
    fn pass(&mut self, time: T) -> T {
        let s = &self.settings;
        let instant = self.clock + T::of(s.dead_time.seconds()) + time;
        let end = if s.timed {
            instant + s.sensing.comparator.delay
        } else {
            self.clock + T::of(s.pulse().seconds())
        };
        self.clock = end + T::of(s.pause().seconds());
        instant
    }

    /// Returns the variance of a direction's relative y caused by the timer's tick.
    fn of_tick(&self, time: T) -> T {
        let share = self.settings.sensing.comparator.tick / time;
        share * share / T::of(12.0)
    }

    /// Names the timer in a fault if its tick hides the saliency of the data sheet. `of_tick` is the tick's part of the
    /// variance σ² of each component of z; 16 times the whole variance must be less than `square`, the square of the
    /// ratio. Measurements scatter by σ around the motor's own value, so a tick suffices if that value is 3 σ above the
    /// limit of 4 σ.
    fn named(&self, fault: Fault<T>, square: T, of_tick: T) -> Fault<T> {
        let (s, of_tick) = (&self.settings, significance::known(of_tick));
        let ratio = s.data_sheet_saliency;
        let surely = ratio * T::of(significance::SIGNIFICANT / (significance::SIGNIFICANT + 3.0));
        let left = surely * surely - (square - of_tick);
        if !s.timed || left <= T::zero() || ratio < s.least_saliency || surely * surely >= square {
            return fault;
        }
        let tick = s.sensing.comparator.tick;
        Fault::CoarseTimer { ratio, needed: square.sqrt(), tick, allowed: tick * (left / of_tick).sqrt() }
    }

    /// Returns the variance of a direction's relative y caused by known errors.
    fn known(&self, pulses: &Pulses<T>) -> T {
        let (s, time) = (&self.settings, pulses.time);
        let square = |share: T| share * share;
        let delays = significance::of_timing(T::of(s.dead_time.seconds()), time) / T::of(2.0);
        if !s.timed {
            let lag = s.sensing.lag() * s.sensing.bandwidth_mismatch / T::of(3.0).sqrt() / time;
            return delays + square(lag);
        }
        let comparator = &s.sensing.comparator;
        let mut known = delays + self.of_tick(time);
        // y t is the inverse of the link's voltage.
        known = known + square(s.sensing.link_noise * pulses.mean * time) / T::of(f64::from(s.rounds));
        if comparator.own {
            known = known + square(comparator.offset / s.threshold) + square(comparator.delay_spread / time);
        }
        known + square(comparator.noise / s.threshold) / T::of(f64::from(s.rounds))
    }

    /// Returns the variance of the mean of a direction's y, relative to the mean of all, from the scatter of the
    /// rounds.
    fn scatter(&self, mean: T) -> T {
        let freedom = self.freedom();
        if freedom <= T::zero() {
            return T::zero();
        }
        let squares = self.pulses.iter().fold(T::zero(), |sum, pulses| sum + pulses.squares);
        squares / (mean * mean) / freedom / T::of(f64::from(self.settings.rounds))
    }

    /// Returns the degrees of freedom of the pulses' scatter.
    fn freedom(&self) -> T {
        T::of(f64::from(self.settings.rounds - 1) * VECTORS as f64)
    }

    fn answer(&mut self) -> Result<Pole<T>, Fault<T>> {
        let s = self.settings;
        let (mut mean, mut third) = (T::zero(), T::zero());
        let zero = AlphaBeta::new(T::zero(), T::zero());
        let (mut first, mut second) = (zero, zero);
        for (number, pulses) in self.pulses.iter().enumerate() {
            let y = pulses.mean;
            mean = mean + y / T::of(6.0);
            first = first + direction(number, 1) * y;
            second = second + direction(number, 2) * y;
            third = if number.is_multiple_of(2) { third + y } else { third - y };
        }
        let share = (mean * T::of(3.0)).recip();
        let (first, second) = (first * share, second * (share * -s.saliency.factor::<T>()));
        let third = third * share / T::of(2.0);
        let scatter = self.scatter(mean);
        let axis = Angle::from_radians(second.beta.atan2(second.alpha) / T::of(2.0));
        // Known errors of each direction's y: their parts of the first harmonic along the axis, which gives the pole, and of
        // the second across it, which gives the axis.
        let (sin, cos) = axis.radians().sin_cos();
        let along = AlphaBeta::new(cos, sin);
        let across = AlphaBeta::new(-(sin + sin) * cos, cos * cos - sin * sin);
        let (mut all, mut of_tick) = (T::zero(), T::zero());
        let (mut of_pole, mut of_axis) = (T::zero(), T::zero());
        let mut instant = T::zero();
        for (number, pulses) in self.pulses.iter().enumerate() {
            let share = pulses.mean / mean;
            let variance = share * share * self.known(pulses);
            let [pole, angle] = [direction(number, 1).dot(along), direction(number, 2).dot(across)];
            all = all + variance / T::of(18.0);
            of_tick = of_tick + share * share * self.of_tick(pulses.time) / T::of(18.0);
            of_pole = of_pole + pole * pole * variance / T::of(9.0);
            of_axis = of_axis + angle * angle * variance / T::of(9.0);
            // The squares of the six components across the axis sum to 3: these are the weights of the turns that the vectors saw.
            instant = instant + angle * angle * pulses.instant / T::of(3.0);
        }
        // If each of six values has the variance σ², each component of a harmonic has σ²/3, and the third harmonic, a single
        // number, σ²/6. A third harmonic beyond two of its deviations shows errors that are not known.
        let third_part = T::of(1.0 / 3.0);
        let scatter = scatter * third_part;
        let unknown = (T::of(0.5) * third * third - all - scatter).max(T::zero());
        let [gains, changing] = s.of_gains(self.derived);
        let mut needed = significance::known(all + unknown + gains);
        if scatter > T::zero() {
            needed = needed + significance::scattered(scatter, self.freedom());
        }
        self.findings.age = Some(self.clock - instant);
        let ratio = second.norm();
        self.findings.angle_deviation =
            Some((of_axis + unknown + gains + scatter).sqrt() / (ratio * T::of(2.0)));
        significance::check(&mut self.margin, ratio, needed, s.least_saliency)
            .map_err(|fault| self.named(fault, needed, of_tick))?;
        let deviation = (of_pole + unknown + scatter + changing).sqrt();
        let pointer = Pointer { direction: first, deviation };
        let of_axis = (of_axis + gains + scatter).sqrt() / (ratio * T::of(2.0));
        // The third harmonic of a saturating core is no current across the magnet. The noise of times is known; their scatter
        // between rounds also contains the rotor's movement.
        let noise = if s.timed { T::zero() } else { scatter };
        let across = Pointer { deviation: (of_pole + noise + changing).sqrt(), ..pointer };
        self.check_standing(&across, (axis, of_axis), s.saliency.factor::<T>() * ratio)?;
        Ok(self.in_sector(pointer.read(axis, s.signature, s.pole_error)))
    }

    /// Checks that the rotor stands still; arguments: the axis with its standard deviation in rad, and k = L_B/L_A. The
    /// induced voltage causes no current along the magnet, and across it `ωψ/L_q`. Relative to Y times the vector's ⅔ U
    /// that is `D_q = −(3/2) (1 + k) ωψ/U`. In a single round the saliency turns from vector to vector, too, which adds
    /// an error that depends on the angle; a second, backward round cancels it.
    fn check_standing(
        &mut self,
        pointer: &Pointer<T>,
        (axis, of_axis): (Angle<T>, T),
        k: T,
    ) -> Result<(), Fault<T>> {
        let s = &self.settings;
        if !s.checks.has(Check::Turning) {
            return Ok(());
        }
        let volts = self.volts / T::of(f64::from(s.rounds) * VECTORS as f64);
        let by_volt = T::of(1.5) * (T::one() + k) / volts;
        let (flux, signature, pole_error) = (s.magnet_flux, s.signature, s.pole_error);
        let standing = Standing { by_volt, flux, signature, pole_error };
        standing.check(&mut self.margin, pointer, axis, of_axis)
    }

    /// Replaces the answer by the middle of its sector, if sectors are requested.
    fn in_sector(&mut self, pole: Pole<T>) -> Pole<T> {
        let width = self.settings.sector.radians();
        if width <= T::zero() || !pole.angle.radians().is_finite() {
            return pole;
        }
        self.findings.half_sector = Some(width / T::of(2.0));
        let middle = (pole.angle.radians() / width).round() * width;
        Pole { angle: Angle::from_radians(middle), ..pole }
    }
}

impl<T: Real> Sequence<T> for SixPulse<T> {
    fn next(&mut self, readings: &[Reading<T>]) -> Result<Step<T>, Fault<T>> {
        let all = usize::from(self.settings.rounds) * VECTORS;
        if let Some(last) = self.given.checked_sub(1) {
            let number = self.vector(last);
            let (y, time) = self.measured(number, readings)?;
            let instant = self.pass(time);
            self.pulses[number].add(y, time, instant);
        }
        if self.given == all {
            return Ok(Step::Done(self.answer()?.outcome(self.findings)));
        }
        let command = self.command();
        self.given += 1;
        Ok(Step::Drive(command))
    }

    fn so_far(&self) -> (&Findings<T>, Margin<T>) {
        (&self.findings, self.margin)
    }
}
