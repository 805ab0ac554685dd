//! The discharge of ringing terminals by dividers, within a step.
//!
//! A divider at each terminal discharges it at the rate γ (`dw/dt = −K i − γ w`). With `η̂ = η + γ ξ` the equations are again
//! those of an oscillator as in `ringing.rs`, with changed coefficients:
//! ```text
//!   ξ′ = η̂ + f* − 2δ I − γ ξ,   η̂′ = −(ω² + 2δγ) (ξ + Ĵ),   Ĵ = J − γ f*/(ω² + 2δγ)
//! ```
//! [`Ringing`]'s `force` is f* − 2δ J, so that (ω² + 2δγ) Ĵ = ω² J − γ (f* − 2δ J).

use standstill_numeric::Wide;

use super::Ringing;
use crate::effect::terminals::swing::{Powers, decayed, mean_of, scaled};

/// Discharge of the terminals by dividers over a step. If a discharge exists, the coefficients in [`Ringing`] describe η̂ and Ĵ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leak<V> {
    /// Rate γ of the discharge times the step's length.
    rate: V,
    /// Squared angles in rad² by which the modes would turn in the step without the discharge.
    turned: [V; 2],
    /// Difference J − Ĵ of the first mode, as a cubic over the step.
    aside: Powers<V>,
}

impl<V: Wide> Leak<V> {
    /// Makes the record of a discharge before the modes are known. `rate` is γ times the step's length.
    #[inline(always)]
    pub fn of(rate: V) -> Self {
        Self { rate, turned: [V::of(0.0); 2], aside: [V::of(0.0); 4] }
    }

    /// Returns the part of a mode's damping (times the step's length) that the dividers cause.
    #[inline(always)]
    pub fn damping(&self, m: usize) -> V {
        V::only(self.turned[m].above(V::of(0.0)), self.rate) * 0.5
    }
}

impl<V: Wide> Ringing<V> {
    /// Changes the coefficients of a mode to those for η̂ and Ĵ. A mode that does not ring has no charged terminal and stays unchanged.
    #[inline(always)]
    pub(super) fn discharge(&mut self, m: usize) {
        let Some(leak) = &mut self.leak else { return };
        let (turned, force, one) = (self.turned[m], self.force[m], V::of(1.0));
        let rings = turned.above(V::of(0.0));
        let rate = V::only(rings, leak.rate);
        let faster = turned + self.damping[m] * (rate + rate);
        let per_square = one / V::choose(rings, faster, one);
        let before = self.remainder[m];
        for n in 0..4_usize {
            let discharged = (before[n] * turned - force[n] * rate) * per_square;
            self.remainder[m][n] = V::choose(rings, discharged, before[n]);
            if m == 0 {
                leak.aside[n] = before[n] - self.remainder[m][n];
            }
        }
        leak.turned[m] = turned;
        self.turned[m] = faster;
        self.damping[m] = self.damping[m] + rate * 0.5;
    }

    /// Returns two means over a share of the step: the mean of a mode's current, and the mean of the current that would change η by the
    /// same amount if there were no dividers. `flux` is ξ at the end of the share. `mean` is the mean of ξ + Ĵ.
    #[inline(always)]
    pub(super) fn means(&self, m: usize, share: V, flux: V, mean: V) -> [V; 2] {
        let Some(leak) = &self.leak else { return [mean; 2] };
        let turned = leak.turned[m] * share * share;
        let rings = turned.above(V::of(0.0));
        let gone = self.turned[m] * share * share * mean + leak.rate * share * flux;
        let charging = V::choose(rings, gone / V::choose(rings, turned, V::of(1.0)), mean);
        let aside = mean_of(&scaled(&leak.aside, share, V::of(1.0)));
        [if m == 0 { mean + aside } else { mean }, charging]
    }

    /// Returns the fraction by which the common potential of three floating terminals falls in a share of the step; none without
    /// dividers.
    #[inline(always)]
    pub(in crate::effect::terminals) fn fallen(&self, share: V) -> Option<V> {
        some!(&self.leak, leak => V::of(1.0) - decayed(leak.rate * share))
    }
}
