//! The cubic with given values and slopes at both ends of a step.

use standstill_numeric::{Lane, Wide};

/// Cubic polynomial over a step, given by its values and slopes at both ends. Time is a share of the step, from 0 to 1. So slopes are
/// changes per step.
#[derive(Clone, Copy, Debug)]
pub struct Cubic<T> {
    /// Values at the beginning and at the end.
    pub value: [T; 2],
    /// Slopes per step at the beginning and at the end.
    pub slope: [T; 2],
}

impl<T: Lane> Default for Cubic<T> {
    #[inline(always)]
    fn default() -> Self {
        Self { value: [T::of(0.0); 2], slope: [T::of(0.0); 2] }
    }
}

impl<V: Wide> Cubic<V> {
    /// Returns the cubic of a lane.
    pub fn get(&self, lane: usize) -> Cubic<f64> {
        let one = |pair: &[V; 2]| pair.each_ref().map(|number| number.get(lane));
        Cubic { value: one(&self.value), slope: one(&self.slope) }
    }
}

impl<T: Lane> Cubic<T> {
    /// Returns the four coefficients, beginning with the constant: a, s, 3 (b − a) − 2 s − e, s + e − 2 (b − a). Here a and b are the
    /// values at the ends, and s and e are the slopes at the ends.
    #[inline(always)]
    pub fn powers(&self) -> [T; 4] {
        let ([a, b], [s, e]) = (self.value, self.slope);
        let rise = b - a;
        [a, s, rise * 3.0 - s - s - e, s + e - rise - rise]
    }

    /// Returns the value after the share `x` of the step.
    #[inline(always)]
    pub fn at(&self, x: T) -> T {
        let [a, s, c, d] = self.powers();
        a + x * (s + x * (c + x * d))
    }

    /// Returns the slope per step after the share `x` of the step.
    #[inline(always)]
    pub fn rise(&self, x: T) -> T {
        let [_, s, c, d] = self.powers();
        s + x * (c + c + x * (d * 3.0))
    }

    /// Returns the integral from the beginning to the share `x` of the step, divided by the step's length.
    #[inline(always)]
    pub fn area(&self, x: T) -> T {
        let [a, s, c, d] = self.powers();
        x * (a + x * (s * 0.5 + x * (c * (1.0 / 3.0) + x * (d * 0.25))))
    }

    /// Returns approximately the lowest value between the ends, if the cubic falls at its beginning and rises at its end. Otherwise
    /// returns infinity.
    #[inline(always)]
    pub fn dip(&self) -> T {
        let zero = T::of(0.0);
        let [s, e] = self.slope;
        let far = T::of(f64::INFINITY);
        let lowest = self.at(s / (s - e));
        T::choose(zero.above(s), T::choose(e.above(zero), lowest, far), far)
    }
}

impl Cubic<f64> {
    /// Returns the share of the step, between `from` and `to`, at which the cubic falls to `level`. The cubic must be above the level at
    /// `from` and below it at `to`; otherwise one of these ends is returned. The result is exact up to rounding. Newton's method finds
    /// it, with bisection where a Newton step leaves the bracket.
    pub fn falls_to(&self, level: f64, from: f64, to: f64) -> f64 {
        let [a, s, c, d] = self.powers();
        let a = a - level;
        let (mut low, mut high) = (from, to);
        let begin = a + from * (s + from * (c + from * d));
        let end = a + to * (s + to * (c + to * d));
        if end >= 0.0 || begin <= 0.0 {
            return if end >= 0.0 { to } else { from };
        }
        // Starts from the straight line between the ends, because most currents are nearly straight.
        let mut x = from + (to - from) * begin / (begin - end);
        for _ in 0..MOST_ROUNDS {
            let value = a + x * (s + x * (c + x * d));
            let slope = s + x * (c + c + x * (d * 3.0));
            if value < 0.0 {
                high = x;
            } else {
                low = x;
            }
            let next = x - value / slope;
            if !(next >= low && next <= high) {
                x = (low + high) * 0.5;
                continue;
            }
            let moved = (next - x).abs();
            x = next;
            // Newton's method squares the error: the rest is below rounding.
            if moved < CLOSE {
                break;
            }
        }
        x
    }
}

/// If the error of a root, as a share of the step, is below this value, the next Newton iteration is the last one.
const CLOSE: f64 = 1e-8;
/// Largest number of iterations. Bisection alone needs no more to reach the error [`CLOSE`].
const MOST_ROUNDS: u32 = 60;

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the cubic `factor` (x − r) (x² + p x + q), with r the `root`.
    fn cubic(root: f64, p: f64, q: f64, factor: f64) -> Cubic<f64> {
        let value = |x: f64| factor * (x - root) * (x * x + p * x + q);
        let slope = |x: f64| factor * ((x * x + p * x + q) + (x - root) * (x + x + p));
        Cubic { value: [value(0.0), value(1.0)], slope: [slope(0.0), slope(1.0)] }
    }

    #[test]
    fn analytic_the_root_of_a_cubic() {
        for root in [1e-9, 0.01, 0.3, 0.5, 0.77, 0.999_999] {
            // Nearly straight, bent, and with an inflection in the middle.
            for (p, q) in [(0.0, 1e3), (1.0, 1.0), (-1.0, 0.3), (3.0, 0.01)] {
                for factor in [-1.0, -1e-6, -1e9] {
                    let found = cubic(root, p, q, factor).falls_to(0.0, 0.0, 1.0);
                    assert!((found - root).abs() < 1e-13, "{root} {p} {q} {factor}: {found}");
                }
            }
        }
    }
}
