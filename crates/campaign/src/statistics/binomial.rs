//! The binomial distribution for any number of trials.
//!
//! Libraries stop their series after a fixed number of terms, or search from a start that is far from the root: with ten
//! million trials one never came back. Here the continued fraction runs until it has converged, which takes some √n terms,
//! and roots are enclosed.

use standstill_numeric::{beta, exp, exp_m1, ln};

/// Returns P(X ≥ `count`) for `total` trials with probability `p` each; `count` from 1 to `total`.
fn at_least(count: u64, total: u64, p: f64) -> f64 {
    beta(count as f64, (total - count + 1) as f64, p)
}

/// Returns the probability with which `count` or more in `total` happen in a share `tail` of all cases: the lower end
/// of the exact (Clopper–Pearson) interval.
pub(super) fn lower(count: u64, total: u64, tail: f64) -> f64 {
    if count == 0 {
        return 0.0;
    }
    if count == total {
        return exp(ln(tail) / total as f64);
    }
    let (mut low, mut high) = (0.0, count as f64 / total as f64);
    // The tail grows with the probability; what is enclosed is halved until doubles end.
    for _ in 0..1100 {
        let middle = low + (high - low) / 2.0;
        if middle <= low || middle >= high || high - low < 1e-14 * high {
            break;
        }
        if at_least(count, total, middle) < tail {
            low = middle;
        } else {
            high = middle;
        }
    }
    low + (high - low) / 2.0
}

/// Returns the upper end.
pub(super) fn upper(count: u64, total: u64, tail: f64) -> f64 {
    if count == 0 {
        // Without the rounding of 1 − (1 − p).
        return -exp_m1(ln(tail) / total as f64);
    }
    1.0 - lower(total - count, total, tail)
}

/// Returns the least count that is not exceeded in a share `q` of all cases, of `total` trials with the probability
/// `p`.
pub(super) fn quantile(total: u64, p: f64, q: f64) -> u64 {
    // P(X ≤ k) = 1 − P(X ≥ k + 1) grows with k.
    let (mut low, mut high) = (0, total);
    while low < high {
        let middle = low + (high - low) / 2;
        if 1.0 - at_least(middle + 1, total, p) >= q {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use statrs::distribution::{Binomial, DiscreteCDF};

    use super::*;

    #[test]
    fn analytic_tails_are_sums_of_terms() {
        for (total, p) in [(1_u32, 0.3_f64), (7, 0.5), (40, 0.05), (200, 0.93)] {
            let mut term = (1.0 - p).powf(f64::from(total));
            let mut tail = 1.0;
            for count in 1..=total {
                tail -= term;
                term *= f64::from(total - count + 1) / f64::from(count) * p / (1.0 - p);
                let found = at_least(u64::from(count), u64::from(total), p);
                assert!((found - tail).abs() < 1e-12, "{count} of {total}: {found} {tail}");
            }
        }
    }

    #[test]
    fn cross_quantiles_agree_with_statrs_where_that_converges() {
        for (total, p) in [(1, 0.3), (20, 0.95), (999, 0.95), (1000, 0.5), (10_000, 0.99)] {
            for q in [0.025, 0.5, 0.975] {
                let reference = Binomial::new(p, total).expect("valid").inverse_cdf(q);
                assert_eq!(quantile(total, p, q), reference, "{total} {p} {q}");
            }
        }
    }

    #[test]
    fn regress_intervals_of_many_trials() {
        // Normal limits with their first correction for skewness, (z² − 1)(1 − 2p)/(6n) about k ± 1/2.
        for total in [1_000_000_u64, 100_000_000] {
            let n = total as f64;
            for share in [1e-3, 0.05, 0.5, 0.9] {
                // A share of a count.
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
                let count = (n * share) as u64;
                let z = 1.959_964;
                let sigma = (share * (1.0 - share) / n).sqrt();
                let (low, high) = (lower(count, total, 0.025), upper(count, total, 0.025));
                assert!(((share - low) / (z * sigma) - 1.0).abs() < 0.05, "{count} of {total}: {low}");
                assert!(((high - share) / (z * sigma) - 1.0).abs() < 0.05, "{count} of {total}: {high}");
            }
            assert!((upper(0, total, 0.025) * n - 3.688_879).abs() < 1e-5);
            // Poisson limits of a few: 5 have [1.623, 11.668].
            assert!((lower(5, total, 0.025) * n - 1.623).abs() < 1e-3);
            assert!((upper(5, total, 0.025) * n - 11.668).abs() < 1e-3);
            assert_eq!(upper(total, total, 0.025), 1.0);
            let below = quantile(total, 0.95, 0.025) as f64;
            assert!((below - (0.95 * n - 1.96 * (n * 0.95 * 0.05).sqrt())).abs() < 2.0 + 1e-4 * n.sqrt());
        }
    }
}
