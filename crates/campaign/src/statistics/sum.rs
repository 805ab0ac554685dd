//! Sums without rounding: the same value in any order and from any parts.

use serde::{Deserialize, Serialize};

/// A sum of doubles as doubles that do not overlap, the smallest first, whose exact sum it is (J. R. Shewchuk, *Adaptive
/// precision floating-point arithmetic and fast robust geometric predicates*, 1997, section 2.4,
/// DOI 10.1007/PL00009321). A handful of them holds any number of terms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Sum(Vec<f64>);

impl Sum {
    /// Makes the empty sum.
    pub(super) const fn new() -> Self {
        Self(Vec::new())
    }

    /// Adds a finite term.
    pub(super) fn add(&mut self, term: f64) {
        let mut carried = term;
        let mut kept = 0;
        for k in 0..self.0.len() {
            let (sum, rest) = two_sum(carried, self.0[k]);
            if rest != 0.0 {
                self.0[kept] = rest;
                kept += 1;
            }
            carried = sum;
        }
        self.0.truncate(kept);
        self.0.push(carried);
    }

    /// Adds all terms of another.
    pub(super) fn merge(&mut self, other: &Self) {
        other.0.iter().for_each(|part| self.add(*part));
    }

    /// Returns the double nearest to the exact sum; if two are equally near, the even one.
    pub(super) fn value(&self) -> f64 {
        let mut parts = self.0.iter().rev().copied();
        let mut sum = parts.next().unwrap_or(0.0);
        while let Some(part) = parts.next() {
            let (high, rest) = two_sum(sum, part);
            sum = high;
            if rest == 0.0 {
                continue;
            }
            // Half way between two doubles, what is still to come decides.
            if let Some(next) = parts.find(|part| *part != 0.0)
                && (next > 0.0) == (rest > 0.0)
            {
                let further = sum + 2.0 * rest;
                if further - sum == 2.0 * rest {
                    sum = further;
                }
            }
            break;
        }
        sum
    }
}

impl FromIterator<f64> for Sum {
    fn from_iter<I: IntoIterator<Item = f64>>(terms: I) -> Self {
        let mut sum = Self::default();
        terms.into_iter().for_each(|term| sum.add(term));
        sum
    }
}

/// Returns the rounded sum of two numbers, and the rounding error (D. E. Knuth, *The Art of Computer Programming*,
/// volume 2, section 4.2.2, theorem B).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_sums_that_rounding_loses() {
        let sum = |terms: &[f64]| terms.iter().copied().collect::<Sum>().value();
        assert_eq!(sum(&[]), 0.0);
        assert_eq!(sum(&[1e100, 1.0, -1e100]), 1.0);
        assert_eq!(sum(&[0.1; 10]), 1.0);
        // Half way to the next double, and a little more or less.
        let half = f64::EPSILON / 2.0;
        assert_eq!(sum(&[1.0, half]), 1.0);
        assert_eq!(sum(&[1.0, half, 1e-40]), 1.0 + f64::EPSILON);
        assert_eq!(sum(&[1.0, half, -1e-40]), 1.0);
        assert_eq!(sum(&[1.0 + f64::EPSILON, half]), 1.0 + 2.0 * f64::EPSILON);
    }

    #[test]
    fn law_order_and_parts_do_not_matter() {
        let terms: Vec<f64> = (0..3000_u32)
            .map(|k| {
                (f64::from(k) * 0.7).sin() * 10_f64.powi(k.wrapping_mul(2_654_435_761).cast_signed() % 40)
            })
            .collect();
        let forth: Sum = terms.iter().copied().collect();
        let back: Sum = terms.iter().rev().copied().collect();
        let mut parts = Sum::default();
        for part in terms.chunks(7) {
            parts.merge(&part.iter().copied().collect());
        }
        let plain: f64 = terms.iter().sum();
        assert!(plain != terms.iter().rev().sum::<f64>(), "rounding shows");
        assert_eq!([forth.value(), back.value()], [parts.value(); 2]);
        assert!(forth.0.len() < 40, "{}", forth.0.len());
    }
}
