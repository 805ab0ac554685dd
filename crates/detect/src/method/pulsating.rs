//! Pulsating high-frequency injection.
//!
//! A voltage V cos ωt along the estimated axis raises a current I sin ωt with the components
//! ```text
//! I_d = V/ω (Y0 + Y1 cos 2δ),   I_q = V/ω Y1 sin 2δ,   Y0,1 = ½ (1/L_d ± 1/L_q)
//! ```
//! where δ is how far the axis is ahead of its estimate: `δ = ½ atan2(I_q, I_d − V Y0/ω)`, and again along the corrected
//! axis. There I_q vanishes whatever V and Y0 are; they only show the way. For L_d > L_q, where Y1 is negative, both
//! arguments change their sign.

use standstill_interface::{AlphaBeta, Angle, Dq, Fault, Findings, Real};

use crate::checks::Check;
use crate::parts::injection::{Clock, Demodulator, Injection, InjectionMethod, InjectionSettings};
use crate::parts::margin::Margin;
use crate::parts::significance;
use crate::parts::turning;

/// Settings of the pulsating injection.
pub type PulsatingInjectionSettings<T> = InjectionMethod<T, Pulsating<T>>;

/// The detector by pulsating injection.
pub type PulsatingInjection<T> = Injection<T, Pulsating<T>>;

/// Angle in rad that the last two corrections may have in common besides the rotor's movement: 2°, if the inductances
/// are those of the data sheet.
const STEADY: f64 = 2.0 * turning::DEGREE;

/// Number of measurements after which corrections only follow the rotor's movement, instead of finding the unknown
/// axis.
const FOUND: u8 = 5;

/// A pulsating voltage along an axis that is corrected measurement by measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulsating<T> {
    axis: Angle<T>,
    measurements: u8,
    /// The last two corrections in rad.
    ahead: [T; 2],
    /// Sum of i sin ωt.
    sum: AlphaBeta<T>,
}

impl<T: Real> Demodulator<T> for Pulsating<T> {
    fn new() -> Self {
        let zero = T::zero();
        Self {
            axis: Angle::from_radians(zero),
            measurements: 0,
            ahead: [zero; 2],
            sum: AlphaBeta::new(zero, zero),
        }
    }

    /// Returns the settings with 6 measurements of 10 cycles each, of which the first two cycles settle.
    fn suited(settings: InjectionSettings<T>) -> InjectionSettings<T> {
        InjectionSettings { ramp: 2, cycles: 8, iterations: 6, ..settings }
    }

    fn voltage(&self, s: &InjectionSettings<T>, clock: Clock) -> AlphaBeta<T> {
        let phase = s.phase(2 * clock.period + 1);
        Dq::new(s.voltage * phase.alpha, T::zero()).unpark(self.axis)
    }

    fn add(&mut self, s: &InjectionSettings<T>, clock: Clock, current: AlphaBeta<T>) {
        self.sum = self.sum + current * s.phase_read(clock).beta;
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
        let current = (self.sum * (T::of(2.0) / samples)).park(self.axis);
        self.sum = AlphaBeta::new(T::zero(), T::zero());
        margin.at_least(current.norm(), s.least_current);
        if current.norm() < s.least_current {
            return Err(Fault::NoCurrent { peak: current.norm(), needed: s.least_current });
        }
        let frequency = s.frequency_read();
        let mean = s.voltage * s.mean_admittance() / frequency;
        let sign = -s.saliency().factor::<T>();
        let (sine, cosine) = (sign * current.q, sign * (current.d - mean));
        let ratio = sine.hypot(cosine) / mean;
        // Of what resistance takes of I_d no saliency is made.
        let reactance = frequency / s.mean_admittance();
        let resistive = s.resistance / reactance;
        let inductive = mean / (T::one() + resistive * resistive);
        let spread = noise / mean;
        // I_d is compared with what the data sheet expects, so that a gain in common looks like as much saliency.
        let common = s.gain_tolerance * s.gain_tolerance;
        let doubt = s.doubt(dc_link, s.voltage, common, significance::of_pulsating_delays);
        let (zero, one) = (T::zero(), T::one());
        let [along, across] =
            [Dq::new(one, zero), Dq::new(zero, one)].map(|component| component.unpark(self.axis));
        let noisy = s.noise_along(across, along);
        let variance = spread * spread * (noisy + noisy) / samples + doubt;
        // More inductance makes less of this current only where it exceeds the resistance: Im 1/(R + jωL) has its extreme at
        // R = ωL, and beyond that the d-axis would be taken for the q-axis.
        let telling = (T::one() - resistive * resistive).max(T::zero());
        let evidence = telling * current.q.hypot(current.d - inductive) / inductive;
        significance::check(margin, ratio.min(evidence), significance::known(variance), s.least_saliency)?;
        // I_q has a noise of σ √noisy √(2/n); δ is I_q over twice the saliency's current.
        let half = noisy / T::of(2.0);
        findings.angle_deviation = Some(noise * half.sqrt() / (samples.sqrt() * ratio * mean));
        let ahead = sine.atan2(cosine) / T::of(2.0);
        self.axis = Angle::from_radians(self.axis.radians() + ahead);
        self.measurements += 1;
        self.ahead = [self.ahead[1], ahead];
        if s.polarity.checks.has(Check::Turning) && self.measurements >= s.iterations.max(FOUND) {
            let deviation =
                findings.angle_deviation.unwrap_or(T::zero()) * T::of(2.0).sqrt() * T::of(turning::FEW);
            let one = s.step().seconds() * f64::from(s.periods) * f64::from(s.ramp + s.cycles);
            // A rotor that turns is as far ahead each time; what is still being found shrinks, or changes its sign.
            let [before, last] = self.ahead;
            let alike = if before * last > T::zero() { before.abs().min(last.abs()) } else { T::zero() };
            let moved = if last > T::zero() { alike + alike } else { -alike - alike };
            turning::check_axis(margin, (moved, T::of(2.0 * one)), deviation, T::of(STEADY))?;
        }
        Ok((self.measurements >= s.iterations).then_some(self.axis))
    }
}
