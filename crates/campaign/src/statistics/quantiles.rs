//! Quantiles of any number of values in memory that does not grow.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Number of values that are stored exactly; with more values, only the number in each bin is stored.
const EXACT: usize = 100_000;

/// Bits of a double by which values in a bin may differ: 14 of the mantissa's 52 bits remain, and neighbouring bins
/// differ by 1/16384.
const COARSE: u32 = 38;

/// Positive values, to be asked for order statistics: exact up to a hundred thousand values, then to four digits.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Magnitudes {
    exact: Vec<f64>,
    /// Counts by the leading bits, which order positive doubles as their values do.
    bins: BTreeMap<u64, u64>,
    count: u64,
    largest: Option<f64>,
}

impl Magnitudes {
    pub(super) fn add(&mut self, value: f64) {
        self.count += 1;
        self.largest = Some(self.largest.map_or(value, |largest| largest.max(value)));
        if self.bins.is_empty() {
            self.exact.push(value);
            if self.exact.len() > EXACT {
                self.coarsen();
            }
        } else {
            self.put(value);
        }
    }

    /// Returns whether these can be values: as many as the count says, none of them infinite.
    pub(super) fn is_sound(&self) -> bool {
        let highest = f64::INFINITY.to_bits() >> COARSE;
        let bins = self.bins.values().copied().try_fold(self.exact.len() as u64, u64::checked_add);
        bins == Some(self.count)
            && (self.bins.is_empty() || self.exact.is_empty())
            && self.bins.keys().all(|bin| *bin < highest)
            && self.exact.iter().chain(&self.largest).all(|value| value.is_finite())
            && self.largest.is_some() == (self.count > 0)
    }

    /// Adds all values of another.
    pub(super) fn merge(&mut self, other: &Self) {
        if !other.bins.is_empty() {
            self.coarsen();
            for (bin, count) in &other.bins {
                *self.bins.entry(*bin).or_default() += count;
            }
            self.count += other.count;
            self.largest = self.largest.into_iter().chain(other.largest).reduce(f64::max);
        }
        other.exact.iter().for_each(|value| self.add(*value));
    }

    /// Replaces the values by counts in bins.
    fn coarsen(&mut self) {
        for value in std::mem::take(&mut self.exact) {
            self.put(value);
        }
    }

    fn put(&mut self, value: f64) {
        *self.bins.entry(value.abs().to_bits() >> COARSE).or_default() += 1;
    }

    pub(super) fn count(&self) -> u64 {
        self.count
    }

    pub(super) fn largest(&self) -> Option<f64> {
        self.largest
    }

    /// Returns the order statistics with these ranks, counted from 0; none if there is no such rank.
    pub(super) fn at<const N: usize>(&self, ranks: [Option<u64>; N]) -> [Option<f64>; N] {
        if self.bins.is_empty() {
            let mut sorted = self.exact.clone();
            sorted.sort_unstable_by(f64::total_cmp);
            return ranks.map(|rank| sorted.get(usize::try_from(rank?).ok()?).copied());
        }
        ranks.map(|rank| {
            let mut left = rank.filter(|rank| *rank < self.count)?;
            if left == self.count - 1 {
                return self.largest;
            }
            let (bin, _) = self.bins.iter().find(|(_, count)| match left.checked_sub(**count) {
                Some(rest) => {
                    left = rest;
                    false
                }
                None => true,
            })?;
            let [low, high] = [bin << COARSE, (bin + 1) << COARSE].map(f64::from_bits);
            Some(low.midpoint(high))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_ranks_of_many_values_are_right_to_four_digits() {
        let mut magnitudes = Magnitudes::default();
        let count = 3 * EXACT as u64;
        // A permutation of 1 to `count`, over which the values are logarithmic.
        let value = |rank: u64| 1e-3 * (rank as f64 / count as f64 * 12.0).exp();
        for k in 0..count {
            magnitudes.add(value(k * 7 % count));
            if k + 1 == EXACT as u64 {
                assert!(magnitudes.bins.is_empty());
            }
        }
        assert!(magnitudes.exact.is_empty() && magnitudes.exact.capacity() == 0);
        let ranks = [0, 1, count / 2, count * 95 / 100, count - 2];
        let found = magnitudes.at(ranks.map(Some));
        for (rank, found) in ranks.into_iter().zip(found) {
            let found = found.expect("there");
            assert!((found / value(rank) - 1.0).abs() < 1.0 / 16384.0, "{rank}: {found}");
        }
        assert_eq!(magnitudes.at([Some(count - 1)]), [Some(value(count - 1))]);
        assert_eq!(magnitudes.at([Some(count), None]), [None, None]);
        assert!(magnitudes.bins.len() < 20 * 16384, "memory is bounded by the range of the values");
    }
}
