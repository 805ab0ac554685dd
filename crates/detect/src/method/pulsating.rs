//! Pulsating high-frequency injection.
//!
//! A voltage V cos ωt along the estimated axis raises a current I sin ωt with the components
//! ```text
//! I_d = V/ω (Y0 + Y1 cos 2δ),   I_q = V/ω Y1 sin 2δ,   Y0,1 = ½ (1/L_d ± 1/L_q)
//! ```
//! where δ is the angle from the estimate to the axis. With `z = V/ω Y1 e^{j2θ}`, I_q is the component of z across
//! twice the estimate's angle. Two measurements, along phase a and 45° ahead of it, give both components of z and so a
//! first estimate; of the data sheet's inductances this needs only the sign of Y1. Each further measurement, along the
//! present estimate, gives the component across anew. On the axis I_q vanishes whatever V, Y0 and |z| are: `δ = ½
//! atan2(I_q, |z|)`. For L_d > L_q, Y1 is negative, and both arguments change their sign.

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

/// Angle in rad by which the last two corrections may seem to move the axis although the rotor stands.
const STEADY: f64 = 2.0 * turning::DEGREE;

/// Largest correction in rad whose sign shows the direction in which the rotor turns. A larger one combines |z| of two
/// instants between which the rotor has turned.
const CLEAR: f64 = 15.0 * turning::DEGREE;

/// Number of measurements along fixed axes, which give the first estimate of the axis.
const FIXED: u8 = 2;

/// Number of measurements after which corrections only follow the rotor's movement, instead of finding the unknown
/// axis.
const FOUND: u8 = 5;

/// A pulsating voltage along an axis that is corrected measurement by measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulsating<T> {
    axis: Angle<T>,
    measurements: u8,
    /// z in A, with the sign by which it points along twice the axis's angle.
    saliency: AlphaBeta<T>,
    /// The last two corrections in rad.
    ahead: [T; 2],
    /// Sum of i sin ωt; `half`, the next field: its part from the first half of the measurement.
    sum: AlphaBeta<T>,
    half: AlphaBeta<T>,
}

impl<T: Real> Demodulator<T> for Pulsating<T> {
    fn new() -> Self {
        let zero = T::zero();
        Self {
            axis: Angle::from_radians(zero),
            measurements: 0,
            saliency: AlphaBeta::new(zero, zero),
            ahead: [zero; 2],
            sum: AlphaBeta::new(zero, zero),
            half: AlphaBeta::new(zero, zero),
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
        let part = current * s.phase_read(clock).beta;
        self.sum = self.sum + part;
        if clock.cycle < s.ramp + s.cycles / 2 {
            self.half = self.half + part;
        }
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
        let first = T::of(2.0 / (f64::from(s.cycles / 2) * f64::from(s.periods)).max(1.0));
        let first = (self.half * first).park(self.axis).q;
        self.sum = AlphaBeta::new(T::zero(), T::zero());
        self.half = self.sum;
        margin.at_least(current.norm(), s.least_current);
        if current.norm() < s.least_current {
            return Err(Fault::NoCurrent { peak: current.norm(), needed: s.least_current });
        }
        let across = -s.saliency().factor::<T>() * current.q;
        self.measurements += 1;
        let twice = Angle::from_radians(self.axis.radians() * T::of(2.0));
        let saliency = match self.measurements {
            1 => AlphaBeta::new(T::zero(), across),
            FIXED => AlphaBeta::new(-across, self.saliency.beta),
            _ => Dq::new(self.saliency.norm(), across).unpark(twice),
        };
        self.saliency = saliency;
        if self.measurements < FIXED {
            self.axis = Angle::from_radians(T::FRAC_PI_4());
            return Ok(None);
        }
        let mean = s.voltage * s.mean_admittance() / s.frequency_read();
        // Mean current with the resistance in the circuit, to which the current of the saliency is compared.
        let resistive = s.resistance * s.mean_admittance() / s.frequency_read();
        let inductive = mean / (T::one() + resistive * resistive);
        let spread = noise / inductive;
        let doubt = s.doubt(dc_link, s.voltage, significance::of_pulsating_delays);
        let (zero, one) = (T::zero(), T::one());
        let axes = [Dq::new(one, zero), Dq::new(zero, one)].map(|component| component.unpark(self.axis));
        let noisy = s.noise_along(axes[1], axes[0]);
        let variance = spread * spread * (noisy + noisy) / samples + doubt;
        // A larger inductance lowers this current only while it exceeds the resistance: Im 1/(R + jωL) has its extreme
        // at R = ωL, and beyond that the d-axis would be taken for the q-axis.
        let telling = (T::one() - resistive * resistive).max(T::zero());
        let ratio = telling * saliency.norm() / inductive;
        significance::check(margin, ratio, significance::known(variance), s.least_saliency)?;
        // I_q has a noise of σ √noisy √(2/n); δ is I_q over twice the saliency's current.
        let half = noisy / T::of(2.0);
        findings.angle_deviation = Some(noise * half.sqrt() / (samples.sqrt() * saliency.norm()));
        let found = Angle::from_radians(saliency.beta.atan2(saliency.alpha));
        let ahead = found.difference(twice) / T::of(2.0);
        self.axis = Angle::from_radians(self.axis.radians() + ahead);
        self.ahead = [self.ahead[1], ahead];
        if s.polarity.checks.has(Check::Turning) && self.measurements >= s.iterations.max(FOUND) {
            let deviation =
                findings.angle_deviation.unwrap_or(T::zero()) * T::of(2.0).sqrt() * T::of(turning::FEW);
            let one = s.step().seconds() * f64::from(s.periods) * f64::from(s.ramp + s.cycles);
            // A turning rotor is ahead by the same angle each time; corrections of a search that still converges
            // shrink, or change their sign.
            let [before, last] = self.ahead;
            let alike = if before * last > T::zero() { before.abs().min(last.abs()) } else { T::zero() };
            let moved = if last > T::zero() { alike + alike } else { -alike - alike };
            // Within a measurement, I_q grows from the first half to the whole by a quarter of the turn during the
            // measurement, which is a part of the time to the next one.
            let within = -s.saliency().factor::<T>() * (current.q - first) / (T::of(2.0) * saliency.norm());
            let share = f64::from(s.cycles) / (4.0 * f64::from(s.ramp + s.cycles));
            let way = turning::direction(last, within, T::of(share));
            let way = way.filter(|_| before.abs().max(last.abs()) < T::of(CLEAR));
            let ahead = (moved, T::of(2.0 * one));
            turning::check_axis(margin, ahead, deviation, T::of(STEADY), way)?;
        }
        Ok((self.measurements >= s.iterations.max(FIXED + 1)).then_some(self.axis))
    }
}
