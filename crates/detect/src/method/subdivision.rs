//! Pulse subdivision: voltage vectors all around, then ever closer to the one that raised the most current.
//!
//! ```text
//!   12 vectors, 30° apart ─► best ± 15° ─► best ± 7.5° ─► best ± 3.75° ─► best ± 1.875°
//! ```
//! Every vector starts from rest, has the same length, and causes a current in its own direction, which is largest
//! where the inductance is smallest. For L_d > L_q that is across the magnet, so the smallest current is sought
//! instead. Of the two ends of the axis the search finds the one with the larger current. A free rotor moves by degrees
//! meanwhile, so a polarity test follows.

#[cfg(test)]
mod tests;

use standstill_interface::{AlphaBeta, Angle, Command, Fault, Findings, Nanos, Reading, Real, Sensed};

use crate::checks::{Check, Checks};
use crate::keys::{Keyed, Setting, Value, place};
use crate::nameplate::Nameplate;
use crate::parts::lines::SaliencySign;
use crate::parts::polarity::PolaritySettings;
use crate::parts::settle::{SettleSettings, Settler, all_seen, link};
use crate::parts::significance;
use crate::parts::then_pole::{Measurement, Next, ThenPole};
use crate::parts::turning;
use crate::settings::{SettingsError, require, require_positive, require_share, require_zero_or_more};

/// Settings of the pulse subdivision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubdivisionSettings<T> {
    /// The vectors, and the polarity test that follows them.
    pub vector: PolaritySettings<T>,
    /// Rough d-axis inductance in H, from which the vectors' voltage is chosen.
    pub d_axis_inductance: T,
    /// Number of halvings of the angle after the first round.
    pub halvings: u8,
    /// Sign of the motor's L_B.
    pub saliency: SaliencySign,
    /// |L_B| / L_A below which no angle is named.
    pub least_saliency: T,
    /// Relative standard deviation of the sensors' gains, which may look like a saliency.
    pub gain_tolerance: T,
    /// The wait before each vector.
    pub settle: SettleSettings<T>,
}

impl<T: Real> SubdivisionSettings<T> {
    /// Returns settings for this motor and drive: vectors to the rated current (92 V for 1 ms on the paper's motor), 10
    /// ms of rest.
    pub fn suited(drive: &Nameplate<T>) -> Self {
        Self {
            vector: PolaritySettings::sequential(drive),
            d_axis_inductance: drive.d_axis_inductance,
            halvings: 4,
            saliency: drive.saliency(),
            least_saliency: T::of(0.02),
            gain_tolerance: drive.gain_tolerance,
            settle: SettleSettings::suited(drive, 10_000, 20),
        }
    }

    fn check(&self) -> Result<(), SettingsError> {
        require_positive(self.d_axis_inductance, "d_axis_inductance")?;
        require_share(self.least_saliency, "least_saliency")?;
        require_zero_or_more(self.gain_tolerance, "gain_tolerance")?;
        require(self.halvings <= 20, "halvings", "at most 20: finer than any sensor")?;
        self.settle.check()?;
        self.vector.check()
    }
}

/// Angle in rad (4°) by which the vectors themselves may turn a free rotor between a vector and its opposite.
const PUSHED: f64 = 4.0 * turning::DEGREE;

/// Number of vectors of the first round.
const FIRST: usize = 12;

/// The detector by pulse subdivision.
pub type Subdivision<T> = ThenPole<T, Halving<T>>;

/// The measurement of the pulse subdivision: vectors in ever smaller steps of the angle.
#[derive(Clone, Debug)]
pub struct Halving<T> {
    settings: SubdivisionSettings<T>,
    /// Currents of the first round, each along its vector, in A per V of the link.
    first: [T; FIRST],
    /// Sums in A of the currents of opposite vectors of that round; `derived`, the next field: whether a current was
    /// not seen by a sensor of its own.
    opposite: [AlphaBeta<T>; FIRST / 2],
    derived: bool,
    /// Number of vectors given so far.
    given: usize,
    /// Best direction so far in rad, and its score: the current in A/V, with the sign that makes the best one largest.
    /// `centre`, the next field: direction in rad around which the vectors of the present round lie.
    best: (T, T),
    centre: T,
    /// End of the command of that vector.
    seen: Nanos,
}

impl<T: Real> Subdivision<T> {
    /// Makes a detector, ready for its first step.
    ///
    /// # Errors
    /// The method cannot work with one of the settings.
    pub fn new(settings: SubdivisionSettings<T>) -> Result<Self, SettingsError> {
        settings.check()?;
        let measurement = Halving {
            settings,
            first: [T::zero(); FIRST],
            opposite: [AlphaBeta::new(T::zero(), T::zero()); FIRST / 2],
            derived: false,
            given: 0,
            best: (T::zero(), T::neg_infinity()),
            centre: T::zero(),
            seen: Nanos::ZERO,
        };
        Ok(Self::start(measurement, Settler::new(settings.settle, true), settings.vector))
    }
}

impl<T: Real> Halving<T> {
    /// Returns the direction in rad of the next vector.
    fn direction(&self) -> T {
        let first = T::TAU() / T::of(FIRST as f64);
        if self.given < FIRST {
            return first * T::of(self.given as f64);
        }
        let later = self.given - FIRST;
        let step = (0..=later / 2).fold(first, |step, _| step / T::of(2.0));
        self.centre + if later.is_multiple_of(2) { step } else { -step }
    }

    fn pushed(&mut self, readings: &[Reading<T>], settler: &mut Settler<T>) -> Result<(), Fault<T>> {
        let Some(reading) = readings.last() else { return Err(Fault::UnexpectedReadings) };
        let direction = self.direction();
        let angle = Angle::from_radians(direction);
        let seen = all_seen(reading)?;
        let current = PolaritySettings::direct_current(seen, angle);
        let needed = self.settings.vector.least_current;
        settler.margin.at_least(current, needed);
        if current < needed || !current.is_finite() {
            return Err(Fault::NoCurrent { peak: current, needed });
        }
        let answer = current / link(reading)?;
        if self.given < FIRST {
            self.first[self.given] = answer;
            let sum = &mut self.opposite[self.given % (FIRST / 2)];
            *sum = *sum + seen.clarke();
            self.derived |= reading.sensed.0.contains(&Sensed::Derived);
        }
        let score = -self.settings.saliency.factor::<T>() * answer;
        if score > self.best.1 {
            self.best = (direction, score);
            self.seen = settler.clock;
        }
        self.given += 1;
        if self.given == FIRST {
            self.check_saliency(settler)?;
            self.check_standing(link(reading)?, settler)?;
        }
        if self.given >= FIRST && (self.given - FIRST).is_multiple_of(2) {
            self.centre = self.best.0;
        }
        Ok(())
    }

    /// Returns the harmonic n = `order` of the currents of the first round: (2/12) Σ current e^{j n φ}.
    fn harmonic(&self, order: f64) -> AlphaBeta<T> {
        let zero = AlphaBeta::new(T::zero(), T::zero());
        self.first.iter().enumerate().fold(zero, |sum, (k, answer)| {
            let (sin, cos) = (T::TAU() * T::of(order * k as f64 / FIRST as f64)).sin_cos();
            sum + AlphaBeta::new(cos, sin) * (*answer * T::of(2.0 / FIRST as f64))
        })
    }

    fn check_saliency(&mut self, settler: &mut Settler<T>) -> Result<(), Fault<T>> {
        let mean = self.first.iter().fold(T::zero(), |sum, answer| sum + *answer) / T::of(FIRST as f64);
        // (1/L_d − 1/L_q)/(1/L_d + 1/L_q) = |L_B|/L_A.
        // Noise has equal parts in all harmonics, and saliency and poles have none in the fourth to sixth: these
        // estimate the noise of the second. The sixth is a single number with twice the variance.
        let [fourth, fifth, sixth] = [4.0, 5.0, 6.0].map(|order| self.harmonic(order) * (T::one() / mean));
        let squares = fourth.dot(fourth) + fifth.dot(fifth) + sixth.alpha * sixth.alpha / T::of(2.0);
        let freedom = T::of(5.0);
        let needed = significance::known(significance::of_phases(self.settings.gain_tolerance))
            + significance::scattered(squares / freedom, freedom);
        let (ratio, least) = (self.harmonic(2.0).norm() / mean, self.settings.least_saliency);
        significance::check(&mut settler.margin, ratio, needed, least)
    }

    /// Checks that the rotor stands still, from the currents of opposite vectors, six waits apart. If the axis turns by
    /// δ in between, the sum of the two currents is `−2 δ κ I e^{j(2θ − φ)}`, with the mean current I and κ = (L_q −
    /// L_d)/(L_q + L_d). In the rotor's frame, a saturating core adds `A + B cos 2x` along the magnet and `C sin 2x`
    /// across it, with x = φ − θ, and the induced voltage adds a constant, like an offset. The speed is estimated from
    /// the part of the six sums that these leave unexplained.
    fn check_standing(&mut self, dc_link: T, settler: &mut Settler<T>) -> Result<(), Fault<T>> {
        const PAIRS: usize = FIRST / 2;
        let s = &self.settings;
        if !s.vector.checks.has(Check::Turning) || s.vector.magnet_flux <= T::zero() {
            return Ok(());
        }
        let sign = -s.saliency.factor::<T>();
        let second = self.harmonic(2.0) * (sign * dc_link);
        let axis = Angle::from_radians(second.beta.atan2(second.alpha) / T::of(2.0));
        let seconds = T::of((s.settle.wait + s.vector.duration()).seconds());
        let by_speed = -T::of(2.0 * PAIRS as f64) * seconds * second.norm() * sign;
        let x: [T; PAIRS] =
            core::array::from_fn(|k| T::TAU() * T::of(k as f64 / FIRST as f64) - axis.radians());
        let along = turning::beside(x.map(|x| x.sin() * by_speed), x.map(|x| (x + x).cos()));
        let across = turning::beside(x.map(|x| x.cos() * by_speed), x.map(|x| (x + x).sin()));
        let (mut product, mut square, mut all) = (T::zero(), T::zero(), T::zero());
        for ((sum, along), across) in self.opposite.iter().zip(along).zip(across) {
            let sum = sum.park(axis);
            product = product + sum.d * along + sum.q * across;
            square = square + along * along + across * across;
            all = all + sum.d * sum.d + sum.q * sum.q;
        }
        let noise = settler.noise.deviation();
        let variance = noise * noise * s.vector.by_reading() * T::of(2.0) / square;
        let freedom = settler.noise.freedom();
        let seconds = seconds * T::of(PAIRS as f64);
        let ahead = product / square * seconds;
        let deviation = turning::deviation(variance, freedom, self.derived) * seconds;
        // If the axis is slightly wrong, a share of the saturation's part is left.
        let askew = (all / square).sqrt() * seconds * T::of(turning::UNEVEN);
        // An axis that has turned by half a turn looks the same, and no vector follows its opposite soon enough to show
        // a direction.
        turning::check_axis(&mut settler.margin, (ahead, seconds), deviation, T::of(PUSHED) + askew, None)
    }
}

impl<T: Real> Measurement<T> for Halving<T> {
    fn rested(&mut self, settler: &Settler<T>) -> Command<T> {
        let s = &self.settings;
        let amplitude = s.vector.amplitude(s.d_axis_inductance);
        s.vector.command(Angle::from_radians(self.direction()), amplitude, settler.dc_link)
    }

    fn measured(
        &mut self,
        readings: &[Reading<T>],
        settler: &mut Settler<T>,
        _: &mut Findings<T>,
    ) -> Result<Next<T>, Fault<T>> {
        self.pushed(readings, settler)?;
        let s = &self.settings;
        Ok(if self.given < FIRST + 2 * usize::from(s.halvings) {
            Next::Wait
        } else {
            // The rotor was seen along the best vector when that was given.
            Next::Test(Angle::from_radians(self.best.0), T::of(self.seen.seconds()), s.d_axis_inductance)
        })
    }
}

impl<T: Real> Keyed for SubdivisionSettings<T> {
    const SETTINGS: &'static [Setting<Self>] = &[
        place!(LEAST_SALIENCY, s => s.least_saliency, Value::of, real),
        place!(GAIN_TOLERANCE, s => s.gain_tolerance, Value::of, real),
        place!(CHECKS, s => s.vector.checks => value, set_value),
        place!(VECTOR_CURRENT, s => s.vector.current, Value::of, real),
        place!(POLE_ERROR, s => s.vector => pole_error, set_pole_error),
    ];

    const CHECKS: Checks = PolaritySettings::<T>::CHECKS;

    fn carrier(&self) -> Option<Nanos> {
        Some(self.vector.carrier_period)
    }
}
