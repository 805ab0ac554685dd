//! Six pulses: one leg against the two others, in all six directions, each until its current reaches a threshold.
//!
//! ```text
//!   a high, b and c low ─► a comparator trips ─► all off ─► 60° further: c low, a and b high ─► …
//!          t_0                                                   t_1                             t_5
//! ```
//! A drive with a comparator and a timer needs no converter for it: what it measures is six times. y = 1/t is the mean slope of
//! the current up to the threshold, in the direction φ of the vector. With L_B/L_A = k of a motor that does not saturate
//! `y = Y (1 − k cos 2(θ − φ))` up to what the resistance adds; saturation along the magnet adds `p cos(θ − φ)`. So of six directions,
//! 60° apart,
//! ```text
//!   z2 = Σ y e^{j2φ} / (3 Y) = −k e^{j2θ}         the axis, as equations (5) to (7) of line pulses
//!   z1 = Σ y e^{jφ} / (3 Y)  =  p e^{jθ}          the pole
//!   z3 = Σ y (−1)^n / (6 Y)                       what fits neither: a residual of one degree of freedom
//! ```
//! The mean time to the threshold t instead of its inverse y would be off by degrees. p grows with the square of the threshold.
//!
//! What all six times have in common costs nothing to first order: the threshold's own error, the offset of one comparator, an
//! unknown delay, the timer's clock. What differs is error: half a tick of the timer either way, noise at the comparator, and
//! where each leg has comparators of its own, their offsets, of which each shifts one time: they look like a pole.
//!
//! Where there is no timer, each pulse has the same length and the current of the leg that stands alone is sampled at its end:
//! y is that current by the link's voltage. The sensors' offsets, which would look like a pole, are read after the decay of each pulse.
//!
//! The vectors follow one another around the circle, so that a current that a pulse left behind shifts all of them alike.
//! In a second round they go backwards, which takes out what drifts evenly.

#[cfg(test)]
mod tests;

use standstill_interface::{
    Abc, AlphaBeta, Angle, Command, Fault, Findings, Leg, Nanos, Phase, Reading, Real, Sampling, Sensed,
    Stage, Step,
};

use crate::keys::{self, Keyed, Lines, Microseconds, Setting, Value, place};
use crate::method::Sequence;
use crate::nameplate::{Nameplate, Sensing};
use crate::parts::lines::SaliencySign;
use crate::parts::margin::Margin;
use crate::parts::polarity::{Pointer, Pole, Signature};
use crate::parts::settle::{largest, link, seen};
use crate::parts::significance;
use crate::parts::train::Derived;
use crate::settings::{
    LONGEST, SettingsError, Source, require, require_error, require_positive, require_share,
    require_zero_or_more,
};

/// Directions of the vectors in a round.
const VECTORS: usize = 6;

/// Rounds of sampled currents.
const SAMPLED_ROUNDS: u8 = 4;

/// Settings of the six pulses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SixPulseSettings<T> {
    /// Current in A at which a pulse ends; without a timer, the one that the pulse is made for.
    pub threshold: T,
    /// Longest pulse where its time is measured.
    pub longest: Nanos,
    /// Length of every pulse where its current is sampled.
    pub sampled: Nanos,
    /// How long all switches are open after a pulse, as a share of the longest.
    pub rest: T,
    /// Rounds of six pulses.
    pub rounds: u8,
    /// Whether the time to the threshold is measured, and not the current after a time.
    pub timed: bool,
    /// Dead time, which passes before a pulse begins.
    pub dead_time: Nanos,
    /// Sign of the motor's L_B.
    pub saliency: SaliencySign,
    /// |L_B| / L_A below which no angle is named.
    pub least_saliency: T,
    /// What a motor's poles answer at the threshold.
    pub signature: Signature,
    /// Probability of a wrong pole that is allowed.
    pub pole_error: T,
    /// Standard deviation of the current sensors' gains, relative.
    pub gain_tolerance: T,
    /// Width of the sectors in which the answer is given; zero: an angle between them.
    pub sector: Angle<T>,
    /// The sensors, with comparators and timer.
    pub sensing: Sensing<T>,
}

impl<T: Real> SixPulseSettings<T> {
    /// For this motor and drive: times to the rated current where the drive captures them, else currents after the time that
    /// raises the rated current where the core saturates most.
    pub fn suited(drive: &Nameplate<T>) -> Self {
        let timed = drive.sensing.comparator.tick > T::zero();
        let threshold = drive.rated_current;
        let mut settings = Self {
            threshold,
            longest: Nanos::ZERO,
            sampled: Nanos::ZERO,
            rest: T::of(1.6),
            rounds: if timed { 1 } else { SAMPLED_ROUNDS },
            timed,
            dead_time: drive.dead_time,
            saliency: drive.saliency(),
            least_saliency: T::of(0.005),
            signature: drive.signature,
            pole_error: T::of(1e-4),
            gain_tolerance: drive.gain_tolerance,
            sector: Angle::from_radians(T::zero()),
            sensing: drive.sensing,
        };
        (settings.longest, settings.sampled) =
            (settings.suited_pulse(drive, true), settings.suited_pulse(drive, false));
        settings
    }

    /// A pulse that surely reaches the threshold, or one that raises it where the core saturates most.
    fn suited_pulse(&self, drive: &Nameplate<T>, timed: bool) -> Nanos {
        let seconds = if timed {
            // Against what two devices and the winding drop at the threshold, with half as much to spare.
            let drop = drive.switch_drop[0] * T::of(2.0)
                + self.threshold * (drive.resistance + drive.switch_drop[1]) * T::of(1.5);
            let left = (drive.dc_link - drop).max(drive.dc_link * T::of(0.2));
            let most = drive.d_axis_inductance.max(drive.q_axis_inductance);
            let comparator = drive.sensing.comparator.delay;
            T::of(1.5 * 1.5) * most * self.threshold / left + comparator + T::of(1e-6)
        } else {
            // Two phases in series against one and a half.
            T::of(0.75 * drive.rated_pulse.seconds()) * self.threshold / drive.rated_current
        };
        let seconds = seconds.max(T::of(self.sensing.lead().seconds() * 2.0));
        // Not longer than one can wait for after it.
        let seconds = seconds.min(T::of(LONGEST.seconds() / 3.0));
        let micros = (seconds / T::of(1e-6)).round().max(T::of(2.0)).to_double();
        Nanos::from_seconds(micros * 1e-6) + drive.dead_time
    }

    fn check(&self) -> Result<(), SettingsError> {
        let comparator = &self.sensing.comparator;
        require_positive(self.threshold, "threshold")?;
        require(
            !self.timed || comparator.tick > T::zero(),
            "timed",
            "false, or `sensors.timer` be set: without a timer this drive captures no time to a threshold",
        )?;
        require(
            !self.timed || comparator.highest == T::zero() || self.threshold <= comparator.highest,
            "threshold",
            "at most the highest code of the converter that sets it: `sensors.threshold_range`",
        )?;
        let pulse = self.pulse();
        require(
            pulse > self.dead_time + self.sensing.lead() && pulse <= LONGEST,
            "threshold",
            "such that a pulse is longer than the dead time, and at most a minute",
        )?;
        require(self.rest > T::one() && self.rest() <= LONGEST, "rest", "longer than the pulse")?;
        let rounds = if self.timed { 1 } else { 2 };
        require(
            self.rounds >= rounds,
            "rounds",
            "at least 1, and 2 where `timed` is false, to see how the pulses scatter",
        )?;
        let sector = self.sector.degrees().round().to_double();
        require([0.0, 30.0, 60.0].contains(&sector), "sector", "0, 30 or 60 degrees")?;
        require_share(self.least_saliency, "least_saliency")?;
        require_error(self.pole_error, "pole_error")?;
        require_zero_or_more(self.gain_tolerance, "gain_tolerance")?;
        self.sensing.check()
    }

    /// Length of a pulse, where its time is measured the longest.
    fn pulse(&self) -> Nanos {
        if self.timed { self.longest } else { self.sampled }
    }

    /// How long all switches are open after it.
    fn rest(&self) -> Nanos {
        Nanos::from_seconds(self.pulse().seconds() * self.rest.to_double()).max(self.pulse() + Nanos(1))
    }

    /// The threshold, with pulses in proportion.
    fn set_threshold(&mut self, threshold: T) {
        let share = (threshold / self.threshold).to_double();
        let dead_time = self.dead_time;
        for pulse in [&mut self.longest, &mut self.sampled] {
            *pulse = dead_time + Nanos::from_seconds(((*pulse - dead_time).seconds() * share).max(2e-6));
        }
        self.threshold = threshold;
    }
}

/// Phase of the leg that stands alone in the vector of this number, and whether it is the high one.
const fn alone(number: usize) -> (Phase, bool) {
    (Phase::ALL[[0, 2, 1, 0, 2, 1][number]], number.is_multiple_of(2))
}

/// Direction of the vector of this number times `harmonic`.
fn direction<T: Real>(number: usize, harmonic: usize) -> AlphaBeta<T> {
    // Exactly alike for all vectors, so that what they have in common adds up to nothing.
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

/// The pulses of one direction.
#[derive(Clone, Copy, Debug)]
struct Pulses<T> {
    count: T,
    /// Mean of y, and the sum of the squares of what is away from it.
    mean: T,
    squares: T,
    /// Mean of t in s.
    time: T,
}

impl<T: Real> Pulses<T> {
    fn add(&mut self, y: T, time: T) {
        self.count = self.count + T::one();
        let apart = y - self.mean;
        self.mean = self.mean + apart / self.count;
        self.squares = self.squares + apart * (y - self.mean);
        self.time = self.time + (time - self.time) / self.count;
    }
}

/// The detector of the six pulses.
#[derive(Clone, Debug)]
pub struct SixPulse<T> {
    settings: SixPulseSettings<T>,
    /// Pulses given.
    given: usize,
    pulses: [Pulses<T>; VECTORS],
    /// Phases without a sensor, as seen so far.
    derived: Derived,
    margin: Margin<T>,
    findings: Findings<T>,
}

impl<T: Real> SixPulse<T> {
    /// A detector, ready for its first step.
    ///
    /// # Errors
    /// A setting with which the method cannot work.
    pub fn new(settings: SixPulseSettings<T>) -> Result<Self, SettingsError> {
        settings.check()?;
        let zero = T::zero();
        Ok(Self {
            settings,
            given: 0,
            pulses: [Pulses { count: zero, mean: zero, squares: zero, time: zero }; VECTORS],
            derived: Derived::None,
            margin: Margin::new(),
            findings: Findings::default(),
        })
    }

    /// Number of the vector of a pulse: around the circle, and back in the next round.
    fn vector(pulse: usize) -> usize {
        let (round, place) = (pulse / VECTORS, pulse % VECTORS);
        if round.is_multiple_of(2) { place } else { VECTORS - 1 - place }
    }

    fn command(&self) -> Command<T> {
        let s = &self.settings;
        let (phase, high) = alone(Self::vector(self.given));
        let (one, others) = if high { (Leg::High, Leg::Low) } else { (Leg::Low, Leg::High) };
        let mut legs = Abc([others; 3]);
        legs[phase] = one;
        let length = s.pulse();
        let (pulse, rest) = (Stage { legs, duration: length }, Stage::off(s.rest()));
        if s.timed {
            Command::until(s.threshold, pulse, rest, Sampling::once(Nanos::ZERO))
        } else {
            let sampled = length - s.sensing.lead();
            Command::sequence(pulse, rest, Sampling::twice(sampled, length + rest.duration))
        }
    }

    /// y and t of the pulse of the vector of this number.
    fn measured(&mut self, number: usize, readings: &[Reading<T>]) -> Result<(T, T), Fault<T>> {
        let s = &self.settings;
        let dead_time = T::of(s.dead_time.seconds());
        if s.timed {
            let [reading] = readings else { return Err(Fault::UnexpectedReadings) };
            let voltage = link(reading)?;
            let Some(capture) = reading.capture else {
                self.margin.at_least(T::zero(), T::one());
                // What is known of the current is that it stayed below the threshold.
                return Err(Fault::NoCurrent { peak: T::zero(), needed: s.threshold });
            };
            let comparator = &s.sensing.comparator;
            let ticks = T::of(f64::from(capture.ticks) + 0.5);
            let time = ticks * comparator.tick - comparator.delay - dead_time;
            // A clock that is a little fast may count a trip beyond the end of the longest pulse, none may count twice as much.
            let longest = T::of(s.longest.seconds());
            if time > longest + longest {
                return Err(Fault::UnexpectedReadings);
            }
            self.margin.at_most(time.min(longest), longest);
            // A threshold that was passed before there was time for a current, or before the comparators watched: those trip
            // as soon as they do, within a tick and a half of the end of the blanking, and what clock and delay may err.
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
        let [end, after] = readings else { return Err(Fault::UnexpectedReadings) };
        let (phase, high) = alone(number);
        let voltage = link(end)?;
        // What the sensors read without current; where a phase is derived, that of those from which it is.
        self.derived = self.derived.with(end);
        let read = seen(end, phase)?;
        let residual = if end.sensed[phase] == Sensed::Derived {
            let others = Phase::ALL.into_iter().filter(|other| *other != phase);
            let mut sum = T::zero();
            for other in others {
                sum = sum + seen(after, other)?;
            }
            -sum
        } else {
            seen(after, phase)?
        };
        let most = s.threshold * T::of(0.25);
        let left = largest(after)?;
        self.margin.at_most(left, most);
        if left > most {
            return Err(Fault::CurrentPersists(left));
        }
        let current = if high { read - residual } else { residual - read };
        let needed = s.threshold * T::of(0.05);
        self.margin.at_least(current, needed);
        if current < needed {
            return Err(Fault::NoCurrent { peak: current, needed });
        }
        let middle = T::of(s.sensing.averaged.seconds()) / T::of(2.0);
        let time = T::of((s.sampled - s.sensing.lead()).seconds()) + middle - dead_time;
        Ok((current / voltage, time))
    }

    /// Variance of a direction's relative y by what is known to err in it.
    fn known(&self, pulses: &Pulses<T>) -> T {
        let (s, time) = (&self.settings, pulses.time);
        let square = |share: T| share * share;
        let delays = significance::of_timing(T::of(s.dead_time.seconds()), time) / T::of(2.0);
        if !s.timed {
            let lag = s.sensing.lag() * s.sensing.bandwidth_mismatch / T::of(3.0).sqrt() / time;
            return delays + square(lag);
        }
        let comparator = &s.sensing.comparator;
        let mut known = delays + square(comparator.tick / time) / T::of(12.0);
        // y t is the link's voltage inverted.
        known = known + square(s.sensing.link_noise * pulses.mean * time) / T::of(f64::from(s.rounds));
        if comparator.own {
            known = known + square(comparator.offset / s.threshold) + square(comparator.delay_spread / time);
        }
        known + square(comparator.noise / s.threshold) / T::of(f64::from(s.rounds))
    }

    /// Variance of the mean of a direction's y, as a share of the mean of all, as the rounds' scatter shows it.
    fn scatter(&self, mean: T) -> T {
        let freedom = self.freedom();
        if freedom <= T::zero() {
            return T::zero();
        }
        let squares = self.pulses.iter().fold(T::zero(), |sum, pulses| sum + pulses.squares);
        squares / (mean * mean) / freedom / T::of(f64::from(self.settings.rounds))
    }

    /// Degrees of freedom of the pulses' scatter.
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
        // By what each direction's y errs, on the pole's harmonic along the axis and on the axis's own across it.
        let (sin, cos) = axis.radians().sin_cos();
        let along = AlphaBeta::new(cos, sin);
        let across = AlphaBeta::new(-(sin + sin) * cos, cos * cos - sin * sin);
        let (mut all, mut of_pole, mut of_axis) = (T::zero(), T::zero(), T::zero());
        for (number, pulses) in self.pulses.iter().enumerate() {
            let share = pulses.mean / mean;
            let variance = share * share * self.known(pulses);
            let [pole, angle] = [direction(number, 1).dot(along), direction(number, 2).dot(across)];
            all = all + variance / T::of(18.0);
            of_pole = of_pole + pole * pole * variance / T::of(9.0);
            of_axis = of_axis + angle * angle * variance / T::of(9.0);
        }
        // Of six values with the variance σ² each component of a harmonic has σ²/3, and the third harmonic alone σ²/6: one that is
        // beyond two of its deviations says that there is more than is known.
        let third_part = T::of(1.0 / 3.0);
        let scatter = scatter * third_part;
        let unknown = (T::of(0.5) * third * third - all - scatter).max(T::zero());
        // A sensor's gain is that of both directions of its phase: it looks like a saliency, not like a pole. Of shunts below the legs it is
        // that of one: the other direction is read by the other two, and the pole's harmonic gets −½ Σ g e^{jφ} of the gains g.
        let changing = if self.derived == Derived::Several { T::of(0.375) } else { T::zero() };
        let changing = changing * s.gain_tolerance * s.gain_tolerance;
        let gains = if s.timed { T::zero() } else { s.gain_tolerance * s.gain_tolerance * third_part };
        let mut needed = significance::known(all + unknown + gains);
        if scatter > T::zero() {
            needed = needed + significance::scattered(scatter, self.freedom());
        }
        let ratio = second.norm();
        self.findings.angle_deviation =
            Some((of_axis + unknown + gains + scatter).sqrt() / (ratio * T::of(2.0)));
        significance::check(&mut self.margin, ratio, needed, s.least_saliency)?;
        let deviation = (of_pole + unknown + scatter + changing).sqrt();
        let pointer = Pointer { direction: first, deviation };
        Ok(self.in_sector(pointer.read(axis, s.signature, s.pole_error)))
    }

    /// The answer as the middle of its sector, where sectors are asked for.
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
            let number = Self::vector(last);
            let (y, time) = self.measured(number, readings)?;
            self.pulses[number].add(y, time);
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

impl<T: Real> Keyed for SixPulseSettings<T> {
    const SOURCES: &'static [Source] = &[Source::CapturedTimes, Source::PhaseCurrents];

    const SETTINGS: &'static [Setting<Self>] = &[
        place!(REST, s => s.rest, Value::of, real),
        place!(ROUNDS, s => s.rounds, Value::times, count),
        place!(LEAST_SALIENCY, s => s.least_saliency, Value::of, real),
        place!(POLE_ERROR, s => s.pole_error, Value::of, real),
        place!(GAIN_TOLERANCE, s => s.gain_tolerance, Value::of, real),
        Setting::new(
            &keys::THRESHOLD,
            |s| Some(Value::of(s.threshold)),
            |s, value| {
                s.set_threshold(value.real());
                true
            },
        ),
        place!(TIMED, s => s.timed, Value::Flag, is_set),
        Setting::new(
            &keys::SECTOR,
            |s| Some(Value::of(s.sector.degrees())),
            |s, value| {
                s.sector = Angle::from_degrees(value.real());
                true
            },
        ),
    ];

    fn needed_sources(&self) -> &'static [Source] {
        // Without a timer `check` refuses timed pulses, by their key.
        if self.timed { Self::SOURCES } else { &[Source::PhaseCurrents] }
    }

    fn describe(&self, line: &mut Lines<'_>) {
        line("threshold", format_args!("{} A", self.threshold.to_double()));
        line("rounds", format_args!("{}", self.rounds));
        let length = if self.timed { "longest pulse" } else { "pulse" };
        line(length, format_args!("{}", Microseconds(self.pulse())));
        line("rest", format_args!("{}", Microseconds(self.rest())));
        line("signature", format_args!("{}", self.signature.in_words()));
    }
}
