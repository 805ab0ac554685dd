//! Solution of one ringing mode over a step, with a force f and a remainder J that are cubics (symbols: `ringing.rs`). Time is
//! in steps, y is the damping, and θ the angle in rad by which the mode turns in the step:
//!
//! ```text
//!   ξ′ = η + f − 2 y ξ,   η′ = −θ² (ξ + J),   I = ξ + J
//! ```

use standstill_numeric::{Lane, PER_FACTORIAL, Wide, eight, four};

use crate::step::hermite;

/// Coefficients of a cubic over a step: a₀ + a₁ s + a₂ s² + a₃ s³ for s from 0 to 1.
pub type Powers<V> = [V; 4];

/// Returns the coefficients of the cubic with these values and slopes per step at both ends.
#[inline(always)]
pub fn cubic<V: Wide>(value: [V; 2], slope: [V; 2]) -> Powers<V> {
    hermite::Cubic { value, slope }.powers()
}

/// Returns the coefficients of the cubic with these values and slopes per step at both ends; without `CUBIC`, those of the tangent at the
/// beginning.
#[inline(always)]
pub fn over<V: Wide, const CUBIC: bool>(value: [V; 2], slope: [V; 2]) -> Powers<V> {
    if CUBIC { cubic(value, slope) } else { [value[0], slope[0], V::of(0.0), V::of(0.0)] }
}

/// Returns the coefficients of the cubic restricted to the first `share` of the step, times `first`.
#[inline(always)]
pub fn scaled<V: Wide>(of: &Powers<V>, share: V, first: V) -> Powers<V> {
    let [a, b, c, d] = *of;
    let (two, three) = (share * share, share * share * share);
    [a * first, b * share * first, c * two * first, d * three * first]
}

/// Returns the weighted sum of a cubic's coefficients.
#[inline(always)]
pub fn sum<V: Wide>(of: &Powers<V>, with: &[V; 4]) -> V {
    of[0] * with[0] + of[1] * with[1] + of[2] * with[2] + of[3] * with[3]
}

/// Returns the mean of a cubic over its step.
#[inline(always)]
pub fn mean_of<V: Wide>(of: &Powers<V>) -> V {
    of[0] + of[1] * 0.5 + of[2] * (1.0 / 3.0) + of[3] * 0.25
}

/// Returns the value of a cubic at the end of its step.
#[inline(always)]
pub fn at_end<V: Wide>(of: &Powers<V>) -> V {
    of[0] + of[1] + of[2] + of[3]
}

/// Returns the coefficients of the parabola about which the modal current I oscillates: it solves `I″ + 2 y I′ + θ² I = f′ + J″ + 2 y J′`,
/// whose right side is a parabola if f and J are cubics. `turned` is θ². `damping` is y.
#[inline(always)]
pub fn about<V: Lane>(turned: V, damping: V, f: &Powers<V>, j: &Powers<V>) -> [V; 3] {
    let twice = damping + damping;
    let pull = [
        f[1] + j[2] * 2.0 + twice * j[1],
        f[2] * 2.0 + j[3] * 6.0 + twice * j[2] * 2.0,
        f[3] * 3.0 + twice * j[3] * 3.0,
    ];
    let second = pull[2] / turned;
    let first = (pull[1] - twice * second * 2.0) / turned;
    let zeroth = (pull[0] - twice * first - second * 2.0) / turned;
    [zeroth, first, second]
}

/// Solution of a mode over a step in which it turns by a small angle, or is not damped.
pub struct Near<V> {
    /// Squared angle θ² of the mode in the step.
    pub turned: V,
    /// Damping y.
    pub damping: V,
    /// Decay factor e^(−y).
    pub decay: V,
    /// Stumpff's functions c₀ to c₅ of θ² − y².
    pub stumpff: [V; 6],
}

impl<V: Wide> Near<V> {
    /// Returns ξ at the end of the step and the mean of I over the step. `velocity` is η at the beginning. `damped` contains the lanes with
    /// damping. With damping, force and remainder times `e^(y s)` are approximated by cubics.
    #[inline(always)]
    pub fn after(&self, velocity: V, f: &Powers<V>, j: &Powers<V>, damped: V::Mask) -> [V; 2] {
        let (turned, y) = (self.turned, self.damping);
        let [_, c1, c2, c3, c4, c5] = self.stumpff;
        // Integrals over the step of the powers of time, times cosine and sine of the angle that is left.
        let cosines = [c1, c2, c3 * 2.0, c4 * 6.0];
        let sines = [c2, c3, c4 * 2.0, c5 * 6.0];
        let mean = c2 * velocity + sum(f, &sines) + sum(j, &cosines);
        if !V::any(damped) {
            return [c1 * velocity + sum(f, &cosines) - turned * sum(j, &sines), mean];
        }
        let decay = self.decay;
        let (f, j) = (grown(f, y, decay, damped), grown(j, y, decay, damped));
        let pull = turned * sum(&j, &sines) + y * sum(&f, &sines);
        let flux = c1 * velocity + sum(&f, &cosines) - pull;
        // With damping, the mean of I follows from the change of η.
        let [c0, ..] = self.stumpff;
        let pulled = turned * sum(&j, &cosines) + y * sum(&f, &cosines);
        let speed = c0 * velocity - (turned - y * y) * sum(&f, &sines) - pulled;
        let end = decay * (speed + y * flux);
        let safe = V::choose(damped, turned, V::of(1.0));
        [flux * decay, V::choose(damped, (velocity - end) / safe, mean)]
    }
}

/// Returns a cubic that matches e^(y s) times the given cubic, in values and slopes at both ends. Without damping,
/// returns the given cubic.
#[inline(always)]
fn grown<V: Wide>(of: &Powers<V>, y: V, decay: V, damped: V::Mask) -> Powers<V> {
    let [a, b, c, d] = *of;
    let grow = V::of(1.0) / decay;
    let end = at_end(of);
    let slope = b + c + c + d * 3.0;
    let grown = cubic([a, grow * end], [b + y * a, grow * (slope + y * end)]);
    [
        V::choose(damped, grown[0], a),
        V::choose(damped, grown[1], b),
        V::choose(damped, grown[2], c),
        V::choose(damped, grown[3], d),
    ]
}

/// Solution of a damped oscillation over a step.
pub struct Far<V> {
    /// Squared angle θ² of the mode in the step.
    pub turned: V,
    /// Damping y.
    pub damping: V,
    /// Decay factor e^(−y).
    pub decay: V,
    /// cos w, with w² = θ² − y².
    pub cos: V,
    /// (sin w)/w.
    pub sin: V,
}

impl<V: Wide> Far<V> {
    /// Returns ξ at the end of the step and the mean of I over the step. `velocity` is η at the beginning. The solution is a parabola plus
    /// a decaying oscillation about it.
    #[inline(always)]
    pub fn after(&self, velocity: V, f: &Powers<V>, j: &Powers<V>) -> [V; 2] {
        let (turned, damping, decay) = (self.turned, self.damping, self.decay);
        let [zeroth, first, second] = about(turned, damping, f, j);
        let away = j[0] - zeroth;
        let rise = velocity + f[0] + j[1] - first + damping * away;
        let left = decay * (away * self.cos + rise * self.sin);
        let square = turned - damping * damping;
        let falls =
            decay * ((rise - damping * away) * self.cos - (away * square + damping * rise) * self.sin);
        let flux = zeroth + first + second + left - at_end(j);
        let slope = first + second * 2.0 + falls - (j[1] + j[2] * 2.0 + j[3] * 3.0);
        // The mean of I follows from the change of η: η′ = −θ² I.
        let velocity_at_end = slope - at_end(f) + (damping + damping) * flux;
        [flux, (velocity - velocity_at_end) / turned]
    }
}

/// Returns e^(−x) for non-negative x. Above x = 64, returns e^−64, which is negligible.
#[inline(always)]
pub fn decayed<V: Wide>(x: V) -> V {
    let part = x.least(V::of(64.0)) * (-1.0 / 128.0);
    let x2 = part * part;
    let x4 = x2 * x2;
    let c = PER_FACTORIAL;
    let low = eight(part, x2, x4, [c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]]);
    let high = four(part, x2, [c[8], c[9], c[10], c[11]]) + x4 * c[12];
    let mut power = high * (x4 * x4) + low;
    let mut doubled = 0;
    while doubled < 7 {
        power = power * power;
        doubled += 1;
    }
    power
}
