//! The filters of the phases' current sensors, for machines side by side.

use standstill_numeric::{PER_FACTORIAL, Wide, eight, four};

use crate::effect::terminals::ringing::Oscillation;
use crate::effect::terminals::swing::{Powers, decayed, scaled, sum};

/// First-order low-pass filters of the three phases.
#[derive(Clone, Copy, Debug, Default)]
pub struct Filters<V> {
    /// Reciprocals of the filters' time constants in 1/s.
    rate: [V; 3],
    /// Outputs of the filters in A.
    pub output: [V; 3],
}

/// Oscillating part of the phase currents over a step. It consists of two modal oscillations, and of a factor for each oscillation in
/// each phase.
pub type Rings<'o, V> = (&'o [Oscillation<V>; 2], &'o [[V; 3]; 2]);

impl<V: Wide> Filters<V> {
    /// Sets the corner frequencies in Hz of a lane's filters, and sets the filters' outputs to zero.
    pub fn put(&mut self, lane: usize, bandwidth: [f64; 3]) {
        for k in 0..3 {
            self.rate[k].put(lane, std::f64::consts::TAU * bandwidth[k]);
            self.output[k].put(lane, 0.0);
        }
    }

    /// Advances the filters of the lanes in `taken` over `h` seconds. Their inputs in A are cubics over the step plus oscillations.
    #[inline(always)]
    pub fn advance(&mut self, taken: V::Mask, h: V, input: &[Powers<V>; 3], rings: Option<Rings<'_, V>>) {
        for k in 0..3 {
            let rings = some!(rings, (of, shares) => (of, pair!(m => shares[m][k])));
            let output = after(self.output[k], h * self.rate[k], &input[k], rings);
            self.output[k] = V::choose(taken, output, self.output[k]);
        }
    }

    /// Returns the filter outputs in A of one machine within a step of `h` seconds. Lane n of the result is for phase `first` + n. Lane n
    /// of `share` is the share of the step that has elapsed for this phase. The oscillations `rings` must already be limited to these
    /// shares.
    #[inline(always)]
    pub fn within(
        &self,
        lane: usize,
        first: usize,
        share: V,
        h: f64,
        input: &[Powers<V>; 3],
        rings: Option<Rings<'_, V>>,
    ) -> V {
        // Lanes beyond the last phase repeat the numbers of phase `first`.
        let of = |number: &V| V::of(number.get(lane));
        let (mut output, mut rate) = (of(&self.output[first]), of(&self.rate[first]));
        let mut cubic =
            [of(&input[first][0]), of(&input[first][1]), of(&input[first][2]), of(&input[first][3])];
        let mut shares = [V::of(0.0); 2];
        for n in 0..V::LANES.min(3 - first) {
            let k = first + n;
            output.put(n, self.output[k].get(lane));
            rate.put(n, self.rate[k].get(lane));
            for power in 0..4 {
                cubic[power].put(n, input[k][power].get(lane));
            }
            if let Some((_, of_phases)) = rings {
                for m in 0..2 {
                    shares[m].put(n, of_phases[m][k].get(lane));
                }
            }
        }
        let cubic = scaled(&cubic, share, V::of(1.0));
        let rings = some!(rings, (of, _) => (of, shares));
        after(output, share * h * rate, &cubic, rings)
    }
}

/// Returns a filter's output after a step of `a` time constants, exact up to rounding. `output` is the output before the step. The input
/// is a cubic plus oscillations `z e^(σ s)`, each with a factor. The response to such an oscillation is `a/(a + σ) z (e^(σ s) − e^(−a
/// s))`.
#[inline(always)]
pub(super) fn after<V: Wide>(
    output: V,
    a: V,
    input: &Powers<V>,
    rings: Option<(&[Oscillation<V>; 2], [V; 2])>,
) -> V {
    let (decay, means) = means(a);
    let mut output = output * decay + a * sum(input, &means);
    if let Some((all, shares)) = rings {
        for m in 0..2 {
            let (of, share) = (&all[m], shares[m]);
            let ([re, im], [grown, turned]) = (of.phasor, of.over);
            let [x, y] = [a + of.turns[0], of.turns[1]];
            let factor = share * a / (x * x + y * y);
            let more = (re * x + im * y) * (grown - decay) - (im * x - re * y) * turned;
            output = output + factor * more;
        }
    }
    output
}

/// Largest step length, in time constants, for which [`means`] uses [`near`]. That function computes the weights from the last one
/// backwards. Longer steps use [`beyond`], which computes them from the first one forwards.
const SUMMED: f64 = 1.0;

/// Returns e^(−a) and the weights ∫ e^(−a (1 − s)) sⁿ ds for n from 0 to 3, where s runs from 0 to 1. The weights are the filter's
/// responses to powers of time. They are n! φ_(n+1)(−a), with φ_(n+1)(−a) = (1/n! − φ_n(−a))/a.
#[inline(always)]
pub(super) fn means<V: Wide>(a: V) -> (V, [V; 4]) {
    let far = a.above(V::of(SUMMED));
    if !V::any(far) {
        return near(a);
    }
    if !V::any(!far) {
        return beyond(a);
    }
    let (decay, means) = near(a.least(V::of(SUMMED)));
    let (decay_beyond, beyond) = beyond(a.greatest(V::of(SUMMED)));
    let mut all = means;
    for n in 0..4 {
        all[n] = V::choose(far, beyond[n], means[n]);
    }
    (V::choose(far, decay_beyond, decay), all)
}

/// Returns the result of [`means`] for short steps. φ₄ comes from its series; φ₃ to φ₁ follow backwards from φ₄.
#[inline(always)]
fn near<V: Wide>(a: V) -> (V, [V; 4]) {
    let one = V::of(1.0);
    let c = PER_FACTORIAL;
    let (a2, a4) = (a * a, (a * a) * (a * a));
    let low = eight(a, a2, a4, [c[4], -c[5], c[6], -c[7], c[8], -c[9], c[10], -c[11]]);
    let high = four(a, a2, [c[12], -c[13], c[14], -c[15]]) + (a2 * c[18] - a * c[17] + c[16]) * a4;
    let last = high * (a4 * a4) + low;
    let third = V::of(1.0 / 6.0) - a * last;
    let second = V::of(0.5) - a * third;
    let first = one - a * second;
    (one - a * first, [first, second, third * 2.0, last * 6.0])
}

/// Returns the result of [`means`] for long steps. φ₁ comes from e^(−a); φ₂ to φ₄ follow forwards from φ₁.
#[inline(always)]
fn beyond<V: Wide>(a: V) -> (V, [V; 4]) {
    let one = V::of(1.0);
    let (per, decay) = (one / a, decayed(a));
    let first = (one - decay) * per;
    let second = (one - first) * per;
    let third = (V::of(0.5) - second) * per;
    let last = (V::of(1.0 / 6.0) - third) * per;
    (decay, [first, second, third * 2.0, last * 6.0])
}

#[cfg(test)]
mod tests;
