//! The sequential rule: whether the pairs of vectors given so far suffice.

use standstill_interface::{PoleEvidence, Real};

use crate::settings::{SettingsError, require, require_error, require_positive};

/// Settings of the sequential polarity test.
///
/// Each pair of vectors gives the relative difference of the two responses, `S = (i₊/U₊ − i₋/U₋) / mean`. With its mean
/// S̄ over n pairs and the variance `v = σ²/n + floor²` of that mean, the test stops when both
/// ```text
/// 2 Δ₀ |S̄| / v ≥ ln((1 − α)/α)      Wald: a difference of +Δ₀ against one of −Δ₀
/// S̄² / v ≥ 2 ln(1/(2α))             a difference against none; Q(z) ≤ exp(−z²/2)/2
/// ```
/// hold. The second condition prevents sensor errors from giving a pole to a motor without any difference.
///
/// σ² is the scatter of the pairs, but at least the variance that the sensors' noise causes. Both rules take it as
/// known. If the pairs scatter by more than the sensors' noise, σ² is estimated from the pairs themselves. Then at
/// least four pairs are required, and α is reliable only down to about one per cent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SequentialSettings<T> {
    /// α: probability of a wrong pole that is allowed.
    pub error: T,
    /// Δ₀: least relative difference between the currents of the motor's two poles.
    pub effect: T,
    /// Relative standard deviation of errors that repetition does not reveal: the DC link's voltage between the pulses,
    /// residual currents.
    pub floor: T,
    /// Pairs of vectors after which the answer is "undetermined".
    pub most_pairs: u8,
}

impl<T: Real> SequentialSettings<T> {
    /// Returns settings for a motor whose pole currents differ by this share. The effect is half of it; the probability
    /// of a wrong pole is one in a million.
    pub fn new(difference: T) -> Self {
        Self {
            error: T::of(1e-6),
            effect: (difference.abs() / T::of(2.0)).max(T::of(1e-3)),
            floor: T::of(0.003),
            most_pairs: 8,
        }
    }

    pub(super) fn check(&self) -> Result<(), SettingsError> {
        require_error(self.error, "polarity.error")?;
        require_positive(self.effect, "polarity.effect")?;
        require_positive(self.floor, "polarity.floor")?;
        require(self.most_pairs >= 2, "polarity.most_pairs", "at least 2")
    }

    /// Returns the probability of a wrong pole if the differences have this mean and the mean has this variance.
    pub(super) fn error_of(&self, mean: T, variance: T) -> T {
        let one = T::one();
        let wald = one / (one + (T::of(2.0) * self.effect * mean.abs() / variance).exp());
        wald.max(tail(mean * mean / variance))
    }

    /// Returns the evidence for the pole that draws more current, in standard deviations `√v` of the mean, and the
    /// evidence needed by Wald's rule and by the tail probability.
    pub(super) fn evidence(&self, mean: T, variance: T) -> PoleEvidence<T> {
        let deviation = variance.sqrt();
        let wald = deviation * ((T::one() - self.error) / self.error).ln() / (T::of(2.0) * self.effect);
        PoleEvidence { deviations: mean / deviation, needed: wald.max(tail_beyond(self.error)) }
    }
}

/// Returns the number of standard deviations beyond which [`tail`] is less than this probability.
pub(super) fn tail_beyond<T: Real>(probability: T) -> T {
    (-T::of(2.0) * (T::of(2.0) * probability).ln()).sqrt()
}

/// Returns an upper bound of the normal distribution's tail beyond z, from z²: `exp(−z²/2)/2`.
pub(crate) fn tail<T: Real>(z_squared: T) -> T {
    (-z_squared / T::of(2.0)).exp() / T::of(2.0)
}
