//! How near a detection was to giving up.

use standstill_interface::Real;

/// The smallest margin of the checks so far that can end a detection with a fault: by which factor what is checked kept its
/// limit, less one. At zero a check is about to fire, below zero it did. A factor makes checks of currents, angles and
/// inductances comparable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margin<T>(T);

impl<T: Real> Margin<T> {
    /// Before the first check.
    pub fn new() -> Self {
        Self(T::infinity())
    }

    /// After a check that something is at least `limit`.
    pub fn at_least(&mut self, value: T, limit: T) {
        self.add(value / limit);
    }

    /// After a check that something is at most `limit`, which what is not positive keeps by far.
    pub fn at_most(&mut self, value: T, limit: T) {
        if value > T::zero() {
            self.add(limit / value);
        }
    }

    /// After the last of some waits for a current to go, at whose end it was this many thresholds: how many more waits it
    /// might have taken of those that it may take.
    pub fn waited(&mut self, waits: u16, attempts: u16, thresholds: T) {
        let taken = T::of(f64::from(waits)) - T::one() + thresholds;
        self.at_most(taken, T::of(f64::from(attempts)));
    }

    /// A value that is not a number has no margin; a factor that is negative beyond all bounds is as bad as none.
    fn add(&mut self, factor: T) {
        let margin = factor - T::one();
        let beyond = margin < T::zero() && !margin.is_finite();
        self.0 = self.0.min(if beyond { -T::one() } else { margin });
    }

    /// After the checks of another as well.
    pub fn and(&mut self, other: Self) {
        self.0 = self.0.min(other.0);
    }

    /// None before a check that has a limit.
    pub fn smallest(self) -> Option<T> {
        self.0.is_finite().then_some(self.0)
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
        // Neither one that is kept more easily nor one that says nothing.
        margin.at_most(0.0, 1.0);
        margin.at_least(f64::NAN, 1.0);
        margin.at_least(0.0, 0.0);
        assert_eq!(margin.smallest(), Some(1.0));
        let mut other = Margin::new();
        other.at_most(2.0, 1.0);
        margin.and(other);
        assert_eq!(margin.smallest(), Some(-0.5));
        // What keeps a limit by its sign says nothing; what misses a limit of zero has failed.
        margin.at_most(-3.0, 1.0);
        assert_eq!(margin.smallest(), Some(-0.5));
        margin.at_least(-1.0, 0.0);
        assert_eq!(margin.smallest(), Some(-1.0));
    }
}
