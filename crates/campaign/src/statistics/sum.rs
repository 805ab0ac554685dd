//! Sums without rounding: the same value in any order and from any parts.

use serde::{Deserialize, Serialize};

/// A sum of doubles as doubles that do not overlap, the smallest first, whose exact sum it is (J. R. Shewchuk, *Adaptive
/// precision floating-point arithmetic and fast robust geometric predicates*, 1997, section 2.4,
/// DOI 10.1007/PL00009321). A handful of them holds any number of terms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Sum(Vec<f64>);

/// Parts of 53 bits that do not overlap within the 2,098 bits from the largest double to the smallest, and as many zeros.
const MOST_PARTS: usize = 80;

impl Sum {
    /// Returns whether this can be a sum: finite parts, and no more than there are places in a double's range.
    pub(super) fn is_sound(&self) -> bool {
        self.0.len() <= MOST_PARTS && self.0.iter().all(|part| part.is_finite())
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

    /// Adds the exact product of two numbers.
    pub(super) fn add_product(&mut self, a: f64, b: f64) {
        let (product, rest) = two_product(a, b);
        self.add(product);
        // Beyond 1e300 it is not known.
        if rest.is_finite() {
            self.add(rest);
        }
    }

    /// Returns the sum of squared deviations from their mean of `n` terms with the sum `terms`, where this is the sum of their squares.
    /// Only the result is rounded: where the mean is ten million times the deviations, the difference of two rounded means of squares
    /// would have no digit left.
    pub(super) fn about_mean(&self, terms: &Self, n: f64) -> f64 {
        // Σ (x − m)² − n (mean − m)² for the double m next to the mean.
        let m = terms.value() / n;
        let (mut sum, mut rest_of_mean) = (self.clone(), terms.clone());
        rest_of_mean.add_product(-n, m);
        let rest_of_mean = rest_of_mean.value();
        sum.add_product(-rest_of_mean, rest_of_mean / n);
        for term in &terms.0 {
            sum.add_product(-2.0 * m, *term);
        }
        let (square, rest) = two_product(m, m);
        sum.add_product(n, square);
        sum.add_product(n, rest);
        sum.value().max(0.0)
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

/// Returns the rounded product of two numbers, and the rounding error (T. J. Dekker, *A floating-point technique for extending the
/// available precision*, 1971, DOI 10.1007/BF01397083).
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let halves = |x: f64| {
        let spread = 134_217_729.0 * x;
        let high = spread - (spread - x);
        (high, x - high)
    };
    let product = a * b;
    let ((a_high, a_low), (b_high, b_low)) = (halves(a), halves(b));
    (product, a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low))
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
    fn analytic_squares_about_a_mean_that_is_far_larger() {
        // Of 2^40 ± 1 the squares' rounding errors are as large as their deviations.
        let [low, high] = [-1.0, 1.0].map(|by| 2.0_f64.powi(40) + by);
        let (mut terms, mut squares) = (Sum::default(), Sum::default());
        for term in [low, high, high, low, high] {
            terms.add(term);
            squares.add_product(term, term);
        }
        assert_eq!(squares.about_mean(&terms, 5.0), 4.8);
        assert_eq!(two_product(low, high), (2.0_f64.powi(80), -1.0));
    }

    /// promise: statistics-add-up
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
