//! When enough pairs of vectors have been given.

use standstill_interface::{PoleEvidence, Real};

use crate::settings::{SettingsError, require, require_error, require_positive};

/// Settings of the sequential test.
///
/// Each pair of vectors gives the relative difference of the two responses, `S = (i₊/U₊ − i₋/U₋) / mean`. With its
/// mean S̄ over n pairs and the variance `v = σ²/n + floor²` of that mean, the test stops when both
/// ```text
/// 2 Δ₀ |S̄| / v ≥ ln((1 − α)/α)      Wald: a difference of +Δ₀ against one of −Δ₀
/// S̄² / v ≥ 2 ln(1/(2α))             a difference against none; Q(z) ≤ exp(−z²/2)/2
/// ```
/// hold. The second keeps a motor without any difference from being given a pole by what the sensors get wrong.
///
/// σ² is what the pairs scatter by, and not less than the sensors' noise makes of it. Both rules take it as known. Pairs
/// that scatter by more than the sensors' noise know it only from themselves: then at least four are asked for, and α
/// holds for what is no smaller than about a percent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SequentialSettings<T> {
    /// α: probability of a wrong pole that is allowed.
    pub error: T,
    /// Δ₀: relative difference of the currents that the motor shows at least.
    pub effect: T,
    /// Standard deviation of what repetition does not reveal, relative: the DC link between the pulses, residual
    /// currents.
    pub floor: T,
    /// Pairs of vectors after which the answer is "undetermined".
    pub most_pairs: u8,
}

impl<T: Real> SequentialSettings<T> {
    /// For a motor whose currents differ by this share: the effect is half of it, the probability of a wrong pole one
    /// in a million.
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

    /// The probability of a wrong pole when the differences have this mean and this variance of the mean.
    pub(super) fn error_of(&self, mean: T, variance: T) -> T {
        let one = T::one();
        let wald = one / (one + (T::of(2.0) * self.effect * mean.abs() / variance).exp());
        wald.max(tail(mean * mean / variance))
    }

    /// Evidence in standard deviations `√v` of the mean, for the pole that draws more current: Wald's rule and the tail
    /// both ask for so many.
    pub(super) fn evidence(&self, mean: T, variance: T) -> PoleEvidence<T> {
        let deviation = variance.sqrt();
        let wald = deviation * ((T::one() - self.error) / self.error).ln() / (T::of(2.0) * self.effect);
        PoleEvidence { deviations: mean / deviation, needed: wald.max(tail_beyond(self.error)) }
    }
}

/// Standard deviations beyond which [`tail`] is less than this probability.
pub(super) fn tail_beyond<T: Real>(probability: T) -> T {
    (-T::of(2.0) * (T::of(2.0) * probability).ln()).sqrt()
}

/// An upper bound of the normal distribution's tail beyond z, from z²: `exp(−z²/2)/2`.
pub(crate) fn tail<T: Real>(z_squared: T) -> T {
    (-z_squared / T::of(2.0)).exp() / T::of(2.0)
}
