//! By how much two runs differ, with 95 % intervals.

pub use standstill_campaign::independent_difference as independent;
use standstill_campaign::{Estimate, paired_difference};

/// Of pairs of trials with the same random numbers: in how many something happened in one alone.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    pub only_a: u64,
    pub only_b: u64,
    pub pairs: u64,
}

impl Rates {
    /// What B has more than A: pairs in which both or none had it say nothing.
    pub fn difference(self) -> Estimate {
        paired_difference([self.only_a, self.only_b], self.pairs)
    }
}

/// The rms of the second errors less that of the first, over pairs: with r the rms, the difference of the means of b²/(2 r_b)
/// and a²/(2 r_a) to first order, whose standard deviation the pairs tell.
pub fn paired_rms(pairs: &[(f64, f64)]) -> Estimate {
    let count = pairs.len() as f64;
    let rms = |of: fn(&(f64, f64)) -> f64| {
        (pairs.iter().map(|pair| of(pair) * of(pair)).sum::<f64>() / count).sqrt()
    };
    let (a, b) = (rms(|pair| pair.0), rms(|pair| pair.1));
    let value = b - a;
    let part = |(x, y): &(f64, f64)| {
        let of = |error: f64, rms: f64| if rms > 0.0 { error * error / (2.0 * rms) } else { 0.0 };
        of(*y, b) - of(*x, a)
    };
    let mean = pairs.iter().map(part).sum::<f64>() / count;
    let variance =
        pairs.iter().map(|pair| (part(pair) - mean) * (part(pair) - mean)).sum::<f64>() / (count - 1.0);
    let half = 1.96 * (variance / count).sqrt();
    Estimate { value, low: value - half, high: value + half }
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
    fn analytic_rates_differ_by_what_happened_in_one_alone() {
        let none = Rates { only_a: 0, only_b: 0, pairs: 1000 }.difference();
        assert_eq!(none.value, 0.0);
        // Of none in n, 3.69/n.
        assert!((none.high * 1000.0 - 3.69).abs() < 0.02 && none.low == -none.high, "{none:?}");
        let more = Rates { only_a: 2, only_b: 30, pairs: 1000 }.difference();
        assert!((more.value - 0.028).abs() < 1e-12 && more.low > 0.0, "{more:?}");
        // Near the normal one: ± 1.96·√(32)/1000.
        let half = 1.96 * 32.0_f64.sqrt() / 1000.0;
        assert!(((more.high - more.low) / 2.0 / half - 1.0).abs() < 0.15, "{more:?}");
    }
}
