//! Rotating high-frequency injection.
//!
//! A voltage V e^{jωt} raises a current with a part that turns with the voltage, `P e^{jωt}`, and, by saliency, a part
//! that turns against it, `N e^{−jωt}`, whose phase contains 2θ. With `P = ⟨i e^{−jωt}⟩`, `N = ⟨i e^{jωt}⟩`
//! ```text
//! 2θ = arg[N P (L_Σ + jR/ω)],   L_Σ = (L_d + L_q)/2,   for L_d < L_q; half a turn further for L_d > L_q
//! ```
//! A shift of the time of all samples turns P and N against each other and cancels in the product.

use standstill_interface::{AlphaBeta, Angle, Fault, Findings, Real};

use crate::checks::Check;
use crate::keys::{Lines, Microseconds};
use crate::parts::complex::{Complex, Turning};
use crate::parts::injection::{Clock, Demodulator, Injection, InjectionMethod, InjectionSettings};
use crate::parts::margin::Margin;
use crate::parts::significance;
use crate::parts::turning;

/// Settings of the rotating injection.
pub type RotatingInjectionSettings<T> = InjectionMethod<T, Rotating<T>>;

/// The detector by rotating injection.
pub type RotatingInjection<T> = Injection<T, Rotating<T>>;

/// A rotating voltage, and the current's parts that turn with it and against it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotating<T> {
    /// Sum of i e^{−jωt} in A; `negative`, the next field: sum of i e^{jωt}.
    positive: Complex<T>,
    negative: Complex<T>,
    /// `negative` after a quarter of the measurement; `middle`, the next field: after half of it.
    quarter: Complex<T>,
    middle: Complex<T>,
}

impl<T: Real> Demodulator<T> for Rotating<T> {
    fn new() -> Self {
        let zero = Complex::zero();
        Self { positive: zero, negative: zero, quarter: zero, middle: zero }
    }

    fn describe(s: &InjectionSettings<T>, line: &mut Lines<'_>) {
        line("voltage", format_args!("{:.1} V", s.voltage));
        line("cycle", format_args!("{}", Microseconds(s.step() * u64::from(s.periods))));
        line("ramp", format_args!("{} cycles", s.ramp));
        line("cycles", format_args!("{}", s.cycles));
        s.polarity.describe(line);
    }

    fn voltage(&self, s: &InjectionSettings<T>, clock: Clock) -> AlphaBeta<T> {
        let ramp = T::of(f64::from(s.ramp) * f64::from(s.periods));
        let now = T::of(f64::from(clock.cycle) * f64::from(s.periods) + f64::from(clock.period) + 0.5);
        let amplitude = s.voltage * (now / ramp.max(T::of(0.5))).min(T::one());
        s.phase(2 * clock.period + 1) * amplitude
    }

    fn add(&mut self, s: &InjectionSettings<T>, clock: Clock, current: AlphaBeta<T>) {
        let (current, phase) = (Complex::of(current), Complex::of(s.phase_read(clock)));
        if clock.period == 0 && clock.cycle == s.ramp + s.cycles / 4 {
            self.quarter = self.negative;
        }
        if clock.period == 0 && clock.cycle == s.ramp + s.cycles / 2 {
            self.middle = self.negative;
        }
        self.positive = self.positive + current * phase.conj();
        self.negative = self.negative + current * phase;
    }

    fn conclude(
        &mut self,
        s: &InjectionSettings<T>,
        noise: T,
        dc_link: T,
        findings: &mut Findings<T>,
        margin: &mut Margin<T>,
    ) -> Result<Option<Angle<T>>, Fault<T>> {
        let samples = T::of(f64::from(s.cycles) * f64::from(s.periods));
        let (positive, negative) = (self.positive.length() / samples, self.negative.length() / samples);
        margin.at_least(positive, s.least_current);
        if positive < s.least_current {
            return Err(Fault::NoCurrent { peak: positive, needed: s.least_current });
        }
        let mean = (s.d_axis_inductance + s.q_axis_inductance) / T::of(2.0);
        let frequency = s.frequency_read();
        let resistive = Complex::new(mean, s.resistance / frequency);
        // Products of sums would leave the range of single precision before their arguments do.
        let unit = |z: Complex<T>| z.scale(T::one() / z.length());
        let product =
            (unit(self.negative) * unit(self.positive) * resistive).scale(-s.saliency().factor::<T>());
        // |N|/|P| = (1/L_d − 1/L_q)/(1/L_d + 1/L_q) = |L_B|/L_A.
        let ratio = negative / positive;
        // The current's end draws an ellipse with half-axes |P| ± |N|. Of two phases alone it draws a line, |N| = |P|, which is the third
        // phase's, whatever the rotor's angle.
        let known = (s.d_axis_inductance - s.q_axis_inductance).abs() / (mean * T::of(2.0));
        let (width, needed) = (positive - negative, positive * (T::one() - known) / T::of(3.0));
        margin.at_least(width, needed);
        if width < needed {
            return Err(Fault::NoCurrent { peak: width, needed });
        }
        findings.mean_inductance = Some(s.voltage / (positive * frequency * T::of(1.5)));
        // N has a noise of σ √(2/3)/√n in each component, and the axis's angle is half of N's. Through one shunt, too: its
        // noise is larger across the voltage than along it, so it turns with the voltage, and N is taken against the voltage.
        let spread = noise / positive;
        // Near zero current, the drops of the devices lower the voltage that drives the current.
        let impedance = (frequency / s.mean_admittance()).hypot(s.resistance);
        let driven = s.voltage.min(positive * impedance);
        let doubt = s.doubt(dc_link, driven, significance::of_rotating_delays);
        let variance = spread * spread * T::of(2.0 / 3.0) / samples + doubt;
        significance::check(margin, ratio, significance::known(variance), s.least_saliency)?;
        self.check_standing(s, noise, margin)?;
        findings.angle_deviation = Some(noise * T::of(1.0 / 6.0).sqrt() / (samples.sqrt() * negative));
        Ok(Some(Angle::from_radians(product.argument() / T::of(2.0))))
    }
}

impl<T: Real> Rotating<T> {
    /// Checks that both halves of the measurement see the same axis: N turns by twice the angle of the rotor.
    fn check_standing(
        &self,
        s: &InjectionSettings<T>,
        noise: T,
        margin: &mut Margin<T>,
    ) -> Result<(), Fault<T>> {
        if !s.polarity.checks.has(Check::Turning) || s.cycles < 2 {
            return Ok(());
        }
        let (half, two) = (T::of(f64::from(s.cycles / 2) * f64::from(s.periods)), T::of(2.0));
        let [first, second] = [self.middle, self.negative - self.middle];
        let ahead = (second * first.conj()).argument() / two;
        let square = |z: Complex<T>| (half / z.length()) * (half / z.length());
        let variance = noise * noise * T::of(2.0 / 3.0) / half * (square(first) + square(second));
        let deviation = variance.sqrt() / two * T::of(turning::FEW);
        let seconds = T::of(s.step().seconds() * f64::from(s.periods) * f64::from(s.cycles)) / two;
        // From the first quarter to the first half, N turns by a quarter of that angle.
        let within = (first * self.quarter.conj()).argument() / two;
        let way = turning::direction(ahead, within, T::of(0.25));
        turning::check_axis(margin, (ahead, seconds), deviation, T::of(2.0 * turning::DEGREE), way)
    }
}
