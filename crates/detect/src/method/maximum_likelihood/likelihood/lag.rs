//! First-order sensors: their output for a given current, in closed form.
//!
//! `τ dy/dt = x − y`. Over a step of h in which x is a quadratic in u = t/h, `x = x₀ + x₁ u + x₂ u²`, and with r = h/τ
//! ```text
//! y(h) = e^(−r) y(0) + Σ x_k w_k,   w_k = r ∫₀¹ u^k e^(−r(1−u)) du,   w_0 = 1 − e^(−r),   w_k = 1 − k w_(k−1)/r
//! ```
//! which is valid for any ratio of lag to step. On steps shorter than the lag the recursion runs downwards from a
//! series for the last term, because upwards it would lose digits.
//!
//! The derivative of y with respect to τ needs the output of a second such sensor behind the first, `z = (second −
//! y)/τ`. The first sensor's output is the quadratic `p = x − τ x' + τ² x''` plus `(y(0) − p(0)) e^(−r u)`, to which
//! the second responds with `r (y(0) − p(0)) e^(−r)` at the end.

use core::ops::{Div, Mul};

use standstill_interface::{Arithmetic, Real};

use super::current::Flow;

/// A number or several numbers, which can be multiplied and divided by a plain number.
pub(super) trait Scaled<T>: Arithmetic + Mul<T, Output = Self> + Div<T, Output = Self> {}

impl<T, V: Arithmetic + Mul<T, Output = V> + Div<T, Output = V>> Scaled<T> for V {}

/// Response of a first-order lag over a step of one length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response<T> {
    /// r, the step as a multiple of the lag.
    ratio: T,
    /// e^(−r).
    left: T,
    /// w_0, w_1 and w_2.
    weights: [T; 3],
}

/// Ratio of step to lag below which the sensor's output is itself practically a quadratic; p would lose digits there.
const SHORT: f64 = 0.03;

/// Terms of the series; at r = 1 the next is 2e-9.
const TERMS: u8 = 11;

impl<T: Real> Response<T> {
    /// Makes the response for steps of this many lags.
    pub fn of(ratio: T) -> Self {
        let (one, two) = (T::one(), T::of(2.0));
        if ratio > one {
            let left = (-ratio).exp();
            let first = one - left;
            let second = one - first / ratio;
            return Self { ratio, left, weights: [first, second, one - two * second / ratio] };
        }
        // w_2 = 2 Σ (−1)^(m−1) r^m/(m + 2)!, by Horner's rule.
        let third = (1..=TERMS).rev().fold(one, |sum, m| one - sum * ratio / T::of(f64::from(m) + 3.0))
            * ratio
            / T::of(3.0);
        let second = ratio * (one - third) / two;
        let first = ratio * (one - second);
        Self { ratio, left: one - first, weights: [first, second, third] }
    }

    /// Returns the response for another step length, which is usually the same.
    pub fn at(self, ratio: T) -> Self {
        if ratio == self.ratio { self } else { Self::of(ratio) }
    }

    /// Returns y at the end of a step, from y at its beginning and the quadratic.
    fn apply<V: Scaled<T>>(&self, seen: V, [x0, x1, x2]: [V; 3]) -> V {
        let [w0, w1, w2] = self.weights;
        seen * self.left + x0 * w0 + x1 * w1 + x2 * w2
    }
}

/// Returns the quadratic with these values at both ends of a step and this rise at its beginning.
fn quadratic<V: Arithmetic>(begin: V, rise: V, end: V) -> [V; 3] {
    [begin, rise, end - begin - rise]
}

/// Current and its slopes behind a first-order lag.
#[derive(Clone, Copy, Debug)]
pub(super) struct Memory<V> {
    pub seen: Flow<V>,
    /// The current behind a second lag in series, for the slope over τ.
    second: V,
}

impl<V: Arithmetic> Memory<V> {
    /// Makes the state before the current begins. All derivatives are zero, although the one with respect to t_s begins
    /// with a step.
    pub fn new(zero: V) -> Self {
        Self { seen: Flow { current: zero, slopes: [zero; 3] }, second: zero }
    }

    /// Advances over a step of `time` in s, at whose ends the current is this and at whose beginning it rises at `rate`.
    pub fn follow<T: Real>(
        &mut self,
        response: &Response<T>,
        begin: &Flow<V>,
        rate: &Flow<V>,
        end: &Flow<V>,
        time: T,
    ) where
        V: Scaled<T>,
    {
        let [x0, x1, x2] = quadratic(begin.current, rate.current * time, end.current);
        let r = response.ratio;
        let before = self.seen.current;
        self.seen.current = response.apply(before, [x0, x1, x2]);
        self.second = if r < T::of(SHORT) {
            response.apply(self.second, quadratic(before, (x0 - before) * r, self.seen.current))
        } else {
            let two = T::of(2.0);
            let shown = [x0 - (x1 - x2 * two / r) / r, x1 - x2 * two / r, x2];
            response.apply(self.second, shown) + (before - shown[0]) * r * response.left
        };
        for (k, slope) in self.seen.slopes.iter_mut().enumerate() {
            let x = quadratic(begin.slopes[k], rate.slopes[k] * time, end.slopes[k]);
            *slope = response.apply(*slope, x);
        }
    }

    /// Returns the derivatives of the output with respect to L, c, t_s and τ.
    pub fn slopes<T: Real>(&self, lag: T) -> [V; 4]
    where
        V: Scaled<T>,
    {
        let [l, c, t] = self.seen.slopes;
        [l, c, t, (self.second - self.seen.current) / lag]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Output y(t) of a first-order sensor with τ = 1 for the input x = 1 + 2 t − 3 t².
    fn exact(y: f64, t: f64) -> f64 {
        let p = |t: f64| (1.0 + 2.0 * t - 3.0 * t * t) - (2.0 - 6.0 * t) + -6.0;
        p(t) + (y - p(0.0)) * (-t).exp()
    }

    #[test]
    fn analytic_a_quadratic_is_seen_exactly_on_steps_of_any_length() {
        for h in [1e-6, 1e-3, 0.05, 0.3, 0.999, 1.001, 4.0, 60.0] {
            let x = [1.0, 2.0 * h, -3.0 * h * h];
            let y: f64 = Response::of(h).apply(0.7, x);
            assert!(
                (y - exact(0.7, h)).abs() < 1e-8 * exact(0.7, h).abs().max(1.0),
                "{h}: {y} {}",
                exact(0.7, h)
            );
            let single = Response::of(f32::of(h)).apply(0.7, x.map(f32::of));
            assert!((f64::from(single) - y).abs() < 3e-6 * y.abs().max(1.0), "{h}: {single} {y}");
        }
        assert_eq!(Response::of(0.0_f64).apply(0.7, [1.0, 0.0, 0.0]), 0.7);
    }

    #[test]
    fn analytic_the_slope_over_the_lag_is_a_difference() {
        let none = Flow { current: 0.0, slopes: [0.0; 3] };
        let at = |current: f64| Flow { current, ..none };
        // Up at 1 A/s for a second, then down, in steps of a quarter.
        let seen = |lag: f64| {
            let mut memory = Memory::new(0.0);
            for k in 0..6_u8 {
                let (t, sign) = (f64::from(k) * 0.25, if k < 4 { 1.0 } else { -1.0 });
                let current = |t: f64| 1.0 - (1.0 - t).abs();
                let (begin, end) = (at(current(t)), at(current(t + 0.25)));
                memory.follow(&Response::of(0.25 / lag), &begin, &at(sign), &end, 0.25);
            }
            (memory.seen.current, memory.slopes(lag)[3])
        };
        for lag in [0.02, 0.1, 0.4, 2.0, 10.0] {
            let difference = (seen(lag + 1e-5).0 - seen(lag - 1e-5).0) / 2e-5;
            assert!((seen(lag).1 - difference).abs() < 1e-6, "{lag}: {} {difference}", seen(lag).1);
        }
    }
}
