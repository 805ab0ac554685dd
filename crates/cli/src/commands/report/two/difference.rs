//! Differences between two runs, with 95 % intervals.

use standstill_campaign::{Estimate, correlated_difference, paired_difference};
pub use standstill_campaign::{independent_difference as independent, paired_rms};

/// Counts of an event in pairs of trials with common random numbers: the number of all pairs, of pairs with the event only in run A, and of
/// pairs with the event only in run B.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    pub only_a: u64,
    pub only_b: u64,
    pub pairs: u64,
}

impl Rates {
    /// Returns the rate of the event in run B minus the rate in run A. Only pairs in which one of the two runs had the event contribute to
    /// the difference.
    pub fn difference(self) -> Estimate {
        paired_difference([self.only_a, self.only_b], self.pairs)
    }
}

/// Returns a percentile of the error's magnitude in run B minus that in run A, in degrees, with its 95 % interval. `pairs` contains the
/// errors of both runs in each trial, in degrees. `a` and `b` are the percentiles of the two runs. To first order the error of an order
/// statistic depends on the number of values beyond the percentile, so two percentiles are as strongly correlated as the indicators of
/// exceeding them.
pub fn paired_percentile(pairs: &[(f64, f64)], [a, b]: [Estimate; 2]) -> Estimate {
    let share = |of: &dyn Fn(&(f64, f64)) -> bool| {
        pairs.iter().filter(|pair| of(pair)).count() as f64 / pairs.len() as f64
    };
    let (beyond_a, beyond_b) =
        (|pair: &(f64, f64)| pair.0.abs() > a.value, |pair: &(f64, f64)| pair.1.abs() > b.value);
    let [p, q, both] = [share(&beyond_a), share(&beyond_b), share(&|pair| beyond_a(pair) && beyond_b(pair))];
    let spread = (p * (1.0 - p) * q * (1.0 - q)).sqrt();
    let correlation = if spread > 0.0 { (both - p * q) / spread } else { 0.0 };
    correlated_difference([a, b], correlation.clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use standstill_sim::{Purpose, Streams};

    use super::*;

    /// A standard normal of a pair.
    fn normal(pair: u32, of: u64) -> f64 {
        Streams::new(of, u64::from(pair)).open(Purpose::Design).normal()
    }

    #[test]
    fn analytic_the_difference_of_rms_is_held_by_its_interval_and_pairs_make_it_narrow() {
        // a = 1·x, b = 1.1·√(1 − ρ²)·y + 1.1·ρ·x: rms 1 and 1.1, correlated by ρ.
        let (mut held, mut widths) = (0, [0.0; 2]);
        for answer in 0..200 {
            for (k, rho) in [0.0, 0.95_f64].into_iter().enumerate() {
                let pair = |n: u32| {
                    let (x, y) = (normal(n + 400 * answer, 0), normal(n + 400 * answer, 1));
                    (x, 1.1 * (rho * x + (1.0 - rho * rho).sqrt() * y))
                };
                let pairs: Vec<(f64, f64)> = (0..400).map(pair).collect();
                let Estimate { low, high, .. } = paired_rms(&pairs);
                held += u32::from(low <= 0.1 && 0.1 <= high);
                widths[k] += (high - low) / 200.0;
            }
        }
        // 380 ± 4.4 of 400.
        assert!((362..=397).contains(&held), "{held}");
        // To first order ± 1.96·√((1 + 1.21)/(2 n)), and of correlated ones 2·ρ²·1.1 less under the root.
        let expected = |rho: f64| 2.0 * 1.96 * ((1.0 + 1.21 - 2.2 * rho * rho) / 800.0).sqrt();
        for (width, rho) in widths.into_iter().zip([0.0, 0.95]) {
            assert!((width / expected(rho) - 1.0).abs() < 0.1, "{width} {}", expected(rho));
        }
    }

    #[test]
    fn analytic_the_difference_of_percentiles_is_held_by_its_interval_and_pairs_make_it_narrow() {
        // As above; the 95th percentile of a normal's magnitude is 1.96 σ.
        let (mut held, mut widths) = (0, [0.0; 2]);
        for answer in 0..200 {
            for (k, rho) in [0.0, 0.95_f64].into_iter().enumerate() {
                let pair = |n: u32| {
                    let (x, y) = (normal(n + 400 * answer, 2), normal(n + 400 * answer, 3));
                    (x, 1.1 * (rho * x + (1.0 - rho * rho).sqrt() * y))
                };
                let pairs: Vec<(f64, f64)> = (0..400).map(pair).collect();
                let p95 = |of: fn(&(f64, f64)) -> f64| {
                    let mut statistics = standstill_campaign::Statistics::default();
                    for pair in &pairs {
                        statistics.add_outcome(standstill_scenario::Verdict::Found, None, Some(of(pair)));
                    }
                    statistics.summary().p95_deg
                };
                let Estimate { low, high, .. } = paired_percentile(&pairs, [p95(|p| p.0), p95(|p| p.1)]);
                held += u32::from(low <= 0.196 && 0.196 <= high);
                widths[k] += (high - low) / 200.0;
            }
        }
        // 380 ± 4.4 of 400; a few more, because ranks are whole numbers.
        assert!((366..=397).contains(&held), "{held}");
        assert!(widths[1] < 0.75 * widths[0], "{widths:?}");
    }

    #[test]
    fn analytic_rates_differ_by_what_happened_in_one_alone() {
        let none = Rates { only_a: 0, only_b: 0, pairs: 1000 }.difference();
        assert_eq!(none.value, 0.0);
        // The upper end for no case in n trials is 3.69/n.
        assert!((none.high * 1000.0 - 3.69).abs() < 0.02 && none.low == -none.high, "{none:?}");
        let more = Rates { only_a: 2, only_b: 30, pairs: 1000 }.difference();
        assert!((more.value - 0.028).abs() < 1e-12 && more.low > 0.0, "{more:?}");
        // Near the normal one: ± 1.96·√(32)/1000.
        let half = 1.96 * 32.0_f64.sqrt() / 1000.0;
        assert!(((more.high - more.low) / 2.0 / half - 1.0).abs() < 0.15, "{more:?}");
    }
}
