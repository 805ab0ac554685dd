//! The current at the end of a pulse, from the shunts below the two legs of a line.
//!
//! ```text
//!   below the leg that the current leaves       ╱            below the leg that it enters      ╲
//!   (its lower switch is on)                  ╱ │            (its lower diode conducts)      │  ╲
//!                                           ╱   └────                                  ──────┘   ╲
//! ```
//! The current itself is continuous at the edge, so both shunts show the same value except for their gains. A quadratic
//! through the samples of each side is extrapolated to the edge. An edge that is later than assumed makes one side
//! smaller and the other larger, equally in pulses of both directions, so that it cancels in [`GainComparison`].

use standstill_interface::{Fault, Reading, Real};

use super::{GainComparison, Slot, Train};
use crate::nameplate::Sensing;

/// Largest number of samples used on either side.
const MOST: usize = 12;
/// Smallest number of samples needed on either side.
const LEAST: usize = 3;

/// Samples of one side, evenly apart.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Side<T> {
    /// Index of the sample next to the edge; `count`, the next field: number of samples, counted away from the edge.
    nearest: usize,
    count: usize,
    /// Distance of the nearest sample from the edge, in intervals.
    distance: T,
}

impl<T: Real> Side<T> {
    /// Returns the weight of each sample in the extrapolation of the best-fitting quadratic to the edge: the sum over
    /// the orthogonal polynomials 1, u and u² − (n² − 1)/12 of their products at sample and edge, divided by the sums
    /// of their squares.
    fn weights(&self) -> [T; MOST] {
        let n = T::of(self.count as f64);
        let (one, twelve, square) = (T::one(), T::of(12.0), n * n);
        let curved = |u: T| u * u - (square - one) / twelve;
        let slopes = n * (square - one) / twelve;
        let curves = slopes * (square - T::of(4.0)) / T::of(15.0);
        let middle = (n - one) / T::of(2.0);
        let edge = -middle - self.distance;
        core::array::from_fn(|j| {
            if j >= self.count {
                return T::zero();
            }
            let u = T::of(j as f64) - middle;
            n.recip() + u * edge / slopes + curved(u) * curved(edge) / curves
        })
    }
}

impl<T: Real> Train<T> {
    /// Returns the samples before and after the end of a pulse; none if there are too few.
    fn sides(&self) -> Option<[Side<T>; 2]> {
        let (s, on) = (&self.settings, self.settings.samples_on());
        let lead = T::of(self.lead.seconds() / s.interval.seconds());
        // A sample at the very end may belong to either side.
        let spoilt = usize::from(self.lead.0 == 0);
        let before = Side {
            nearest: on.checked_sub(1 + spoilt)?,
            count: (on - spoilt).min(MOST),
            distance: if spoilt > 0 { T::one() } else { lead },
        };
        // Only while enough of the current is left: it falls about as fast as it has risen.
        let after = Side { nearest: on, count: (on / 4 * 3).min(MOST), distance: T::one() - lead };
        let enough = before.count >= LEAST && after.count >= LEAST && on + after.count <= s.samples();
        enough.then_some([before, after])
    }

    /// Returns the current in A at the end of a pulse from two shunts: below the leg that it enters, and below the leg
    /// that it leaves. None if there are too few samples.
    pub fn at_edge(
        &self,
        slot: Slot,
        readings: &[Reading<T>],
        sensing: &Sensing<T>,
    ) -> Result<Option<(T, T)>, Fault<T>> {
        let Some([mut before, mut after]) = self.sides() else { return Ok(None) };
        // The instant at which the current of a sample flowed: later than the trigger by the conversion, earlier by the
        // sensors' lag.
        let (from, to) = slot.phases();
        let shown =
            |phase| (sensing.late_of(phase) - sensing.lag()) / T::of(self.settings.interval.seconds());
        before.distance = before.distance - shown(to);
        after.distance = after.distance + shown(from);
        let mut at_edge = [T::zero(); 2];
        for (j, (leaves, enters)) in before.weights().into_iter().zip(after.weights()).enumerate() {
            for (side, (of, weight)) in [(before, leaves), (after, enters)].into_iter().enumerate() {
                if j < of.count {
                    let sample = if side == 0 { of.nearest - j } else { of.nearest + j };
                    at_edge[side] = at_edge[side] + self.current(slot, &readings[sample])? * weight;
                }
            }
        }
        let [leaves, enters] = at_edge;
        Ok((leaves > T::zero() && enters > T::zero()).then_some((enters, leaves)))
    }

    /// Returns r of each line, see [`GainComparison`], from the shunts below its legs, and its variance by the
    /// readings' noise.
    pub fn gains_at_edge(&self, gains: &GainComparison<T>) -> ([T; 3], [T; 3]) {
        let squares = |side: Side<T>| side.weights().into_iter().fold(T::zero(), |sum, w| sum + w * w);
        let amplified =
            self.sides().map_or(T::zero(), |[before, after]| (squares(before) + squares(after)) / T::of(2.0));
        gains.measured(self.noise * amplified)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_a_quadratic_is_extended_exactly_and_noise_grows_as_known() {
        for (count, distance) in [(3, 1.0), (8, 1.0), (12, 0.1), (5, 0.5)] {
            let side = Side { nearest: 0, count, distance };
            let at = |t: f64| 2.0 - 3.0 * t + 0.7 * t * t;
            let weights = side.weights();
            let sum: f64 = (0..count).map(|j| weights[j] * at(j as f64 + distance)).sum();
            assert!((sum - 2.0).abs() < 1e-12, "{count} {distance}: {sum}");
            assert!(weights[count..].iter().all(|weight| *weight == 0.0));
        }
        // One step beyond n samples: 3 (3 n² + 3 n + 2)/(n (n − 1) (n − 2)).
        for (count, expected) in [(3, 19.0), (8, 654.0 / 336.0)] {
            let weights = Side { nearest: 0, count, distance: 1.0_f64 }.weights();
            let squares: f64 = weights.iter().map(|weight| weight * weight).sum();
            assert!((squares - expected).abs() < 1e-12, "{count}: {squares}");
        }
    }
}
