//! Margin of a detection: how near it was to giving up.

use standstill_interface::Real;

/// Smallest margin of all checks so far that can end a detection with a fault: the factor by which the checked quantity
/// kept its limit, minus 1. At zero a check is about to fire; below zero it fired. As a factor, margins of currents,
/// angles and inductances can be compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margin<T> {
    smallest: T,
    unseen: Unseen<T>,
}

/// Limits in rad/s of comparisons of two axes. Up to `speed` they show no turn. From `folds` on, a right angle in the
/// time between both, a turn is ambiguous, because an axis looks the same after half a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unseen<T> {
    speed: T,
    folds: T,
}

impl<T: Real> Margin<T> {
    /// Makes the margin before the first check.
    pub fn new() -> Self {
        Self { smallest: T::infinity(), unseen: Unseen { speed: T::infinity(), folds: T::zero() } }
    }

    /// Adds a check that `value` is at least `limit`.
    pub fn at_least(&mut self, value: T, limit: T) {
        self.add(value / limit);
    }

    /// Adds a check that `value` is at most `limit`. Values that are not positive pass and do not change the margin.
    pub fn at_most(&mut self, value: T, limit: T) {
        if value > T::zero() {
            self.add(limit / value);
        }
    }

    /// Adds the waits for a current to decay: `waits` of at most `attempts`. At the end of the last wait the current
    /// was `thresholds` times the threshold, which counts as this share of a wait.
    pub fn waited(&mut self, waits: u16, attempts: u16, thresholds: T) {
        let taken = T::of(f64::from(waits)) - T::one() + thresholds;
        self.at_most(taken, T::of(f64::from(attempts)));
    }

    /// Adds a factor. A value that is not a number has no margin; very negative factors are clamped.
    fn add(&mut self, factor: T) {
        let margin = factor - T::one();
        let beyond = margin < T::zero() && !margin.is_finite();
        self.smallest = self.smallest.min(if beyond { -T::one() } else { margin });
    }

    /// Adds a comparison of two axes, `seconds` apart, that does not show a speed of up to `speed` in rad/s.
    pub fn compared(&mut self, speed: T, seconds: T) {
        if speed < self.unseen.speed {
            self.unseen = Unseen { speed, folds: T::FRAC_PI_2() / seconds };
        }
    }

    /// Returns the largest speed in rad/s that a rotor may have: at most `most` by another check, and not shown by a
    /// comparison of axes.
    pub fn unseen(&self, most: T) -> T {
        if most < self.unseen.folds { most.min(self.unseen.speed) } else { most }
    }

    /// Adds the checks of another margin.
    pub fn and(&mut self, other: Self) {
        self.smallest = self.smallest.min(other.smallest);
    }

    /// Returns the smallest margin; none before the first check with a limit.
    pub fn smallest(self) -> Option<T> {
        self.smallest.is_finite().then_some(self.smallest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_margins_are_factors_to_the_limit_less_one() {
        let mut margin = Margin::new();
        assert_eq!(margin.smallest(), None);
        margin.at_least(6.0, 2.0);
        assert_eq!(margin.smallest(), Some(2.0));
        margin.at_most(4.0, 8.0);
        assert_eq!(margin.smallest(), Some(1.0));
        // A larger margin, and checks without a margin, change nothing.
        margin.at_most(0.0, 1.0);
        margin.at_least(f64::NAN, 1.0);
        margin.at_least(0.0, 0.0);
        assert_eq!(margin.smallest(), Some(1.0));
        let mut other = Margin::new();
        other.at_most(2.0, 1.0);
        margin.and(other);
        assert_eq!(margin.smallest(), Some(-0.5));
        // A value that meets its limit by its sign has no margin; a value that misses a limit of zero has failed.
        margin.at_most(-3.0, 1.0);
        assert_eq!(margin.smallest(), Some(-0.5));
        margin.at_least(-1.0, 0.0);
        assert_eq!(margin.smallest(), Some(-1.0));
    }
}
