//! Whether a saliency is more than what may be wrong with it.
//!
//! A method measures `z = |L_B|/L_A e^{j2θ}`. Without any saliency there is still what errs, as likely in one direction
//! as in any other: where each component of z has the standard error σ, |z| exceeds k σ with the probability
//! `e^{−k²/2}`, 1.1 % for k = 3 and 0.03 % for [`SIGNIFICANT`]. The angle's standard error is `σ_θ = σ/(2|z|)`: a saliency is significant
//! where the angle is known to 7°. What σ² consists of:
//!
//! * **Line inductances** whose relative errors have the variance ε²: z is 2/3 of their mean with the weights e^{j2φ_k}
//!   beside their mean, equations (5) and (6), so `σ² = 2 ε²/3` and `σ_θ = 0.408 ε/(|L_B|/L_A)`: [`of_lines`]. ε² is
//!   noise as it shows in the scatter of pulses or in the residuals of a fit; the gain tolerance of the one sensor that reads
//!   a line, or what a comparison of the sensors leaves of it; and the legs' delays: [`of_timing`].
//! * **Current vectors** read by three sensors with gains 1 + δ_k: a current I is read as
//!   `I (1 + Σ δ_k/3) + I* Σ δ_k e^{j2γ_k}/3`, γ_k = 0°, 120°, 240°. What is conjugate looks like saliency:
//!   `σ² = ε²/6`, 0.408 ε again: [`of_phases`].
//! * **Pulse-width modulation**: what its compensation leaves of dead time and drops, as a share of the injected voltage:
//!   [`of_modulation`].

use standstill_interface::{Fault, Real};

/// Standard errors that a saliency must exceed.
pub(crate) const SIGNIFICANT: f64 = 4.0;

/// Standard deviation of a leg's delay that a drive is trusted to have, as a share of its dead time: 100 ns of 2 µs.
const DELAY: f64 = 0.05;

/// What is left of dead time and drops by the clamping of currents near zero, which no compensation knows: measured on motors
/// without saliency, 550 V and 12 V, as the saliency that they seem to have.
const LEFT: f64 = 0.03;

/// Variance of each component of z by relative errors of the line inductances with this variance.
pub(crate) fn of_lines<T: Real>(variance: T) -> T {
    variance * T::of(2.0 / 3.0)
}

/// Likewise by gains of three sensors with this standard deviation, of the current vectors that they read.
pub(crate) fn of_phases<T: Real>(tolerance: T) -> T {
    tolerance * tolerance / T::of(6.0)
}

/// Variance of the relative error of a line inductance by the delays of the two edges of a pulse of this length in s.
pub(crate) fn of_timing<T: Real>(dead_time: T, pulse: T) -> T {
    let share = T::of(DELAY) * dead_time / pulse;
    T::of(2.0) * share * share
}

/// Variance of each component of z by what is left of so many volts that dead time and drops take, of `voltage` injected.
pub(crate) fn of_modulation<T: Real>(lost: T, voltage: T) -> T {
    let share = T::of(LEFT) * lost / voltage;
    share * share
}

/// Whether a saliency |z| of this size is one, where each component of z has this variance.
///
/// # Errors
/// No saliency found: it is less than `least`, or no more than what may be wrong with it.
pub(crate) fn check<T: Real>(ratio: T, variance: T, least: T) -> Result<(), Fault<T>> {
    let needed = least.max(T::of(SIGNIFICANT) * variance.sqrt());
    if ratio >= needed && ratio.is_finite() { Ok(()) } else { Err(Fault::NoSaliency { ratio, needed }) }
}

#[cfg(test)]
mod tests {
    use standstill_interface::{Abc, AlphaBeta};

    use super::*;
    use crate::parts::lines::{Saliency, SaliencySign};
    use crate::testing::Noise;

    /// Mean square of a component of z over random draws.
    fn component(mut z: impl FnMut(&mut Noise) -> f64) -> f64 {
        let mut noise = Noise::new(3);
        (0..20_000).map(|_| z(&mut noise).powi(2) / 2.0).sum::<f64>() / 20_000.0
    }

    #[test]
    fn law_errors_of_lines_and_of_gains_make_as_much_saliency_as_stated() {
        let lines = component(|noise| {
            let lines = Abc([(); 3].map(|()| 27e-3 * (1.0 + 0.01 * noise.gauss())));
            Saliency::from_lines(lines, SaliencySign::Negative).ratio()
        });
        assert!((lines / of_lines(1e-4) - 1.0).abs() < 0.03, "{lines}");
        // A rotating current as three sensors read it: its reversed part.
        let phases = component(|noise| {
            let gains = [(); 3].map(|()| 1.0 + 0.01 * noise.gauss());
            let read = |at: f64| {
                let (sin, cos) = at.to_radians().sin_cos();
                let Abc(currents) = AlphaBeta::new(cos, sin).phases();
                Abc(core::array::from_fn(|k| gains[k] * currents[k])).clarke()
            };
            // i + conj(j j i(90°)) leaves twice what is conjugate.
            let (x, y) = (read(0.0), read(90.0));
            (x.alpha - y.beta).hypot(x.beta + y.alpha) / 2.0
        });
        assert!((phases / of_phases(0.01) - 1.0).abs() < 0.03, "{phases}");
    }

    #[test]
    fn law_what_may_be_wrong_alone_is_hardly_ever_a_saliency() {
        let mut noise = Noise::new(11);
        let found =
            (0..20_000).filter(|_| check(noise.gauss().hypot(noise.gauss()), 1.0, 0.0).is_ok()).count();
        // e^−8 of 20,000 are 6.7.
        assert!((1..=15).contains(&found), "{found}");
        assert!(check(0.02, 1e-5, 0.005).is_ok());
        for (ratio, variance, least) in [
            (0.02, 1e-5, 0.03),
            (0.02, 1e-4, 0.0),
            (f64::NAN, 0.0, 0.0),
            (f64::INFINITY, 0.0, 0.0),
            (0.02, f64::INFINITY, 0.0),
        ] {
            assert!(check(ratio, variance, least).is_err(), "{ratio} {variance} {least}");
        }
    }
}
