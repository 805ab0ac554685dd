//! The cubic with given values and slopes at both ends of a step.

use standstill_numeric::Lane;

/// Values at the beginning and at the end, and slopes there times the step's length.
#[derive(Clone, Copy, Debug)]
pub struct Cubic<T> {
    /// At the beginning and at the end.
    pub value: [T; 2],
    /// Slopes per step.
    pub slope: [T; 2],
}

impl<T: Lane> Cubic<T> {
    /// Its value at a share of the step.
    #[inline(always)]
    pub fn at(&self, x: T) -> T {
        let [a, b] = self.value;
        let [s, e] = self.slope;
        // a + x (s + x (c + x d)) with c = 3 (b − a) − 2 s − e, d = s + e − 2 (b − a).
        let rise = b - a;
        let c = rise * 3.0 - s - s - e;
        let d = s + e - rise - rise;
        a + x * (s + x * (c + x * d))
    }

    /// Its slope per step at a share of the step.
    #[inline(always)]
    pub fn rise(&self, x: T) -> T {
        let [a, b] = self.value;
        let [s, e] = self.slope;
        let rise = b - a;
        let c = rise * 3.0 - s - s - e;
        let d = s + e - rise - rise;
        s + x * (c + c + x * (d * 3.0))
    }

    /// Its integral from the beginning to a share of the step, per step.
    #[inline(always)]
    pub fn area(&self, x: T) -> T {
        let [a, b] = self.value;
        let [s, e] = self.slope;
        let rise = b - a;
        let c = rise * 3.0 - s - s - e;
        let d = s + e - rise - rise;
        x * (a + x * (s * 0.5 + x * (c * (1.0 / 3.0) + x * (d * 0.25))))
    }

    /// About the lowest value within the step, where it falls at its beginning and rises at its end; else infinite.
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
    /// The first share of the step at which it falls to `level`, between two shares: above it at the first and below it at
    /// the second.
    pub fn falls_to(&self, level: f64, from: f64, to: f64) -> f64 {
        // Regula falsi with the Illinois modification: as safe as bisection, and quick.
        let at = |x: f64| self.at(x) - level;
        let (mut low, mut high) = (from, to);
        let (mut at_low, mut at_high) = (at(low).max(0.0), at(high));
        let mut side = 0;
        for _ in 0..60 {
            if at_high >= 0.0 || high - low < 1e-14 {
                break;
            }
            let middle = low + (high - low) * at_low / (at_low - at_high);
            let middle = if middle > low && middle < high { middle } else { (low + high) * 0.5 };
            let value = at(middle);
            if value < 0.0 {
                if side == -1 {
                    at_low *= 0.5;
                }
                let close = high - middle < 1e-14 || value > -1e-16;
                (high, at_high, side) = (middle, value, -1);
                if close {
                    break;
                }
            } else {
                if side == 1 {
                    at_high *= 0.5;
                }
                (low, at_low, side) = (middle, value, 1);
                if value == 0.0 {
                    return middle;
                }
            }
        }
        high
    }
}
