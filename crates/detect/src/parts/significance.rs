//! Significance: whether a measured saliency exceeds its possible errors.
//!
//! A method measures `z = |L_B|/L_A e^{j2θ}`. Without any saliency, z consists of errors, equally likely in all
//! directions. If each component of z has the standard error σ, |z| exceeds k σ with the probability `e^{−k²/2}`, 1.1 %
//! for k = 3 and 0.03 % for [`SIGNIFICANT`]. The angle's standard error is `σ_θ = σ/(2|z|)`: a saliency is significant
//! if the angle is known to 7°.
//!
//! A variance estimated from few samples may by chance be far too small. With ν degrees of freedom, |z| exceeds k σ̂
//! with the probability `(1 + k²/ν)^(−ν/2)`, which is 2 % for k = 4 and ν = 6. So `k² = ν (p^(−2/ν) − 1)` is used, see
//! [`scattered`]. Parts of σ² that are known and parts that are estimated add up, each multiplied by its own k². With
//! `ln(1 + f x) ≥ f ln(1 + x)` for a share f of σ², p is not exceeded whatever the shares are.
//!
//! Contributions to σ²:
//!
//! * **Line inductances** whose relative errors have the variance ε²: by equations (5) and (6), z is twice their mean
//!   with the weights e^{j2φ_k}, divided by their mean, so `σ² = 2 ε²/3` and `σ_θ = 0.408 ε/(|L_B|/L_A)`: [`of_lines`].
//!   ε² is noise, from the scatter of pulses or the residuals of a fit; the gain tolerance of the one sensor that reads
//!   a line, or the rest of it after a comparison of the sensors; and the legs' delays: [`of_timing`].
//! * **Current vectors** read by three sensors with gains 1 + δ_k: a current I is read as `I (1 + Σ δ_k/3) + I* Σ δ_k
//!   e^{j2γ_k}/3`, γ_k = 0°, 120°, 240°. The conjugate part looks like saliency: `σ² = ε²/6`, 0.408 ε again:
//!   [`of_phases`].
//! * **Pulse-width modulation**: the uncompensated rest of dead time and drops, as a share of the injected voltage:
//!   [`of_modulation`]; and the legs' delays, which are not compensated: [`of_rotating_delays`],
//!   [`of_pulsating_delays`].

use standstill_interface::{Fault, Real};

use crate::parts::margin::Margin;

/// Number of standard errors that a saliency must exceed.
pub(crate) const SIGNIFICANT: f64 = 4.0;

/// Probability with which an estimate from few samples may be so small that errors pass for a saliency.
const CHANCE: f64 = 1e-3;

/// Assumed standard deviation of a leg's delay, as a share of the dead time: 100 ns of 2 µs.
pub(crate) const DELAY: f64 = 0.05;

/// Share of dead time and drops that no compensation removes, because currents near zero are clamped: measured as the
/// apparent saliency of motors without saliency, at 550 V and 12 V.
const LEFT: f64 = 0.03;

/// Returns the variance of each component of z caused by relative errors of the line inductances with this variance.
pub(crate) fn of_lines<T: Real>(variance: T) -> T {
    variance * T::of(2.0 / 3.0)
}

/// Returns the variance of each component of z caused by the gains of three sensors with this standard deviation, in
/// the current vectors that they read.
pub(crate) fn of_phases<T: Real>(tolerance: T) -> T {
    tolerance * tolerance / T::of(6.0)
}

/// Returns the variance of a line inductance's relative error caused by the delays of the two edges of a pulse of this
/// length in s.
pub(crate) fn of_timing<T: Real>(dead_time: T, pulse: T) -> T {
    let share = T::of(DELAY) * dead_time / pulse;
    T::of(2.0) * share * share
}

/// Returns the variance of each component of z caused by the uncompensated rest of `lost` volts of dead time and drops;
/// `voltage`: injected voltage in V.
pub(crate) fn of_modulation<T: Real>(lost: T, voltage: T) -> T {
    let share = T::of(LEFT) * lost / voltage;
    share * share
}

/// Returns the standard deviation in V of a leg's voltage loss per carrier period, caused by on and off delays that
/// differ from the compensated ones. The loss acts against the current, so it changes its sign with the current.
fn of_a_leg<T: Real>(dead_time: T, period: T, dc_link: T) -> T {
    T::of(DELAY * core::f64::consts::SQRT_2) * dead_time / period * dc_link
}

/// Returns the variance of each component of z caused by the legs' delays, for a rotating voltage.
///
/// Leg k loses δ_k sign(cos(ωt − γ_k)), whose fundamental is 4/π δ_k cos(ωt − γ_k). As a vector, 2/3 Σ a^k of these,
/// the part that turns backwards is `4/(3π) Σ δ_k e^{j2γ_k}`: `σ = 4/(3π) √(3/2) σ_δ/V`.
pub(crate) fn of_rotating_delays<T: Real>(dead_time: T, period: T, dc_link: T, voltage: T) -> T {
    let share = of_a_leg(dead_time, period, dc_link) / voltage;
    T::of(8.0 / (3.0 * core::f64::consts::PI * core::f64::consts::PI)) * share * share
}

/// Returns the variance caused by the legs' delays under pulsating injection. The fundamentals of all legs have the
/// same phase, so their part across the axis is `2/3 · 4/π Σ δ_k sin γ_k`, twice as much as for a rotating voltage.
pub(crate) fn of_pulsating_delays<T: Real>(dead_time: T, period: T, dc_link: T, voltage: T) -> T {
    T::of(4.0) * of_rotating_delays(dead_time, period, dc_link, voltage)
}

/// Returns the variance that the legs' delays cause in the sum of the currents of two opposite vectors, across the
/// vectors and as a share of one of them. A leg whose current has reversed has another loss, by other switches. As a
/// vector, 2/3 Σ a^k of three losses has √(2/3) of one loss's deviation in each component.
pub(crate) fn of_vector_delays<T: Real>(dead_time: T, period: T, dc_link: T, voltage: T) -> T {
    let share = of_a_leg(dead_time, period, dc_link) / voltage;
    T::of(4.0 / 3.0) * share * share
}

/// Returns [`SIGNIFICANT`]² times a variance of each component of z that is known, or estimated from a hundred samples
/// or more.
pub(crate) fn known<T: Real>(variance: T) -> T {
    T::of(SIGNIFICANT * SIGNIFICANT) * variance
}

/// Returns k² times a variance of each component of z that is estimated with this many degrees of freedom.
pub(crate) fn scattered<T: Real>(variance: T, freedom: T) -> T {
    if freedom < T::one() {
        return T::infinity();
    }
    variance * freedom * (T::of(CHANCE).powf(-T::of(2.0) / freedom) - T::one())
}

/// Checks that a saliency of size |z| is significant: its square must exceed `square`, the sum of [`known`] and
/// [`scattered`] parts.
///
/// # Errors
/// No saliency is found: it is less than `least`, or not more than its possible errors.
pub(crate) fn check<T: Real>(margin: &mut Margin<T>, ratio: T, square: T, least: T) -> Result<(), Fault<T>> {
    let needed = least.max(square.sqrt());
    margin.at_least(ratio, needed);
    if ratio >= needed && ratio.is_finite() { Ok(()) } else { Err(Fault::NoSaliency { ratio, needed }) }
}

#[cfg(test)]
mod tests {
    use standstill_interface::{Abc, AlphaBeta};

    use super::*;

    fn check(ratio: f64, square: f64, least: f64) -> Result<(), Fault<f64>> {
        super::check(&mut Margin::new(), ratio, square, least)
    }
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
    fn law_delays_of_legs_make_as_much_saliency_as_stated() {
        let (dead_time, period, dc_link, voltage) = (2e-6, 1e-4, 12.0, 0.15);
        let deviation = of_a_leg(dead_time, period, dc_link);
        let of_leg = |k: usize| (120.0 * k as f64).to_radians().sin_cos();
        // The part of a period's mean losses that turns backwards, of a current that turns.
        let rotating = component(|noise| {
            let lost: [f64; 3] = core::array::from_fn(|_| deviation * noise.gauss());
            let steps = 90;
            let (mut real, mut imaginary) = (0.0, 0.0);
            for step in 0..steps {
                let (sin, cos) = ((f64::from(step) + 0.5) * 360.0 / f64::from(steps)).to_radians().sin_cos();
                let legs = Abc(core::array::from_fn(|k| {
                    let (sine, cosine) = of_leg(k);
                    lost[k] * (cos * cosine + sin * sine).signum()
                }));
                let vector = legs.clarke();
                real += (vector.alpha * cos - vector.beta * sin) / f64::from(steps);
                imaginary += (vector.alpha * sin + vector.beta * cos) / f64::from(steps);
            }
            real.hypot(imaginary) / voltage
        });
        let stated = of_rotating_delays(dead_time, period, dc_link, voltage);
        assert!((rotating / stated - 1.0).abs() < 0.03, "{rotating} {stated}");
        // Across the axis, of a current along it, at any angle.
        let mut noise = Noise::new(7);
        let trials = 20_000;
        let square = (0..trials).map(|number| {
            let (sin, cos) = (f64::from(number) * 0.123).sin_cos();
            let legs = Abc(core::array::from_fn(|k| {
                let (sine, cosine) = of_leg(k);
                deviation * noise.gauss() * (cos * cosine + sin * sine).signum()
            }));
            let vector = legs.clarke();
            (4.0 / core::f64::consts::PI * (vector.beta * cos - vector.alpha * sin) / voltage).powi(2)
        });
        let pulsating = square.sum::<f64>() / f64::from(trials);
        let stated = of_pulsating_delays(dead_time, period, dc_link, voltage);
        assert!((pulsating / stated - 1.0).abs() < 0.03, "{pulsating} {stated}");
    }

    #[test]
    fn law_what_may_be_wrong_alone_is_hardly_ever_a_saliency() {
        let mut noise = Noise::new(11);
        let found = (0..20_000)
            .filter(|_| check(noise.gauss().hypot(noise.gauss()), known(1.0), 0.0).is_ok())
            .count();
        // e^−8 of 20,000 are 6.7.
        assert!((1..=15).contains(&found), "{found}");
        assert!(check(0.02, known(1e-5), 0.005).is_ok());
        for (ratio, variance, least) in [
            (0.02, 1e-5, 0.03),
            (0.02, 1e-4, 0.0),
            (f64::NAN, 0.0, 0.0),
            (f64::INFINITY, 0.0, 0.0),
            (0.02, f64::INFINITY, 0.0),
        ] {
            assert!(check(ratio, known(variance), least).is_err(), "{ratio} {variance} {least}");
        }
    }

    #[test]
    fn law_a_variance_from_few_samples_finds_no_more_saliency_by_chance() {
        let mut noise = Noise::new(5);
        for freedom in [4_u32, 5, 6, 12] {
            // Shares of the whole variance that are estimated.
            for share in [1.0, 0.5] {
                let trials = 20_000;
                let found = (0..trials).filter(|_| {
                    let squares: f64 = (0..freedom).map(|_| noise.gauss().powi(2)).sum();
                    let estimate = share * squares / f64::from(freedom);
                    let needed = known(1.0 - share) + scattered(estimate, f64::from(freedom));
                    check(noise.gauss().hypot(noise.gauss()), needed, 0.0).is_ok()
                });
                let found = found.count();
                // Of 20 expected.
                assert!(found <= 36, "{freedom} {share}: {found}");
                assert!(share < 1.0 || found >= 6, "{freedom}: {found}");
            }
        }
        assert!((scattered(1.0_f64, 6.0) - 54.0).abs() < 1e-9);
        assert!((scattered(1.0_f64, 1e6) - 2.0 * 1e3_f64.ln()).abs() < 1e-3);
        assert!(scattered(0.0_f64, 0.0) == f64::INFINITY);
    }

    #[test]
    fn law_delays_of_legs_leave_as_much_across_two_opposite_vectors_as_stated() {
        let (dead, period, link, voltage) = (2e-6, 1e-4, 540.0, 90.0);
        let leg = of_a_leg(dead, period, link) / voltage;
        let mut noise = Noise::new(7);
        let mut vector = || Abc([(); 3].map(|()| leg * noise.gauss())).clarke().beta;
        let square = (0..20_000).map(|_| (vector() + vector()).powi(2)).sum::<f64>() / 20_000.0;
        assert!((square / of_vector_delays(dead, period, link, voltage) - 1.0).abs() < 0.05, "{square}");
    }
}
