//! Whether one setting is better than another.

use standstill_campaign::Estimate;
use standstill_sim::{Purpose, Streams};

use crate::limit::{Limits, Measure, Tally};

/// Samples of the bootstrap.
const SAMPLES: u64 = 400;

/// What the second has more of each measure than the first, with 95 % intervals: a bootstrap over trials, each of which
/// both have had (B. Efron, "Bootstrap methods", 1979, doi:10.1214/aos/1176344552). What the random numbers do to both alike
/// makes no difference.
pub fn paired(taken: &Limits, first: &Tally, second: &Tally, seed: u64) -> Vec<(Measure, Estimate)> {
    let pairs = first.values().iter().zip(second.values());
    let of = |(limit, (a, b)): (&crate::limit::Limit, (&Vec<f64>, &Vec<f64>))| {
        let measure = limit.measure;
        let apart = |a: Vec<f64>, b: Vec<f64>| {
            let [a, b] = [a, b].map(|values| measure.seen(values).value);
            // Both beyond every bound are no further apart.
            if a == b { 0.0 } else { b - a }
        };
        let sample = |number: u64| {
            let mut draws = Streams::new(seed, number).open(Purpose::Design);
            let last = (a.len() as u64).saturating_sub(1);
            let (mut x, mut y) = (Vec::with_capacity(a.len()), Vec::with_capacity(a.len()));
            for _ in 0..a.len() {
                // Below the number of trials.
                #[allow(clippy::cast_possible_truncation)]
                let trial = draws.integer(last) as usize;
                x.push(a[trial]);
                y.push(b[trial]);
            }
            apart(x, y)
        };
        let same = a.iter().zip(b).all(|(a, b)| a == b);
        let mut samples: Vec<f64> = if same { vec![0.0] } else { (0..SAMPLES).map(sample).collect() };
        samples.sort_by(f64::total_cmp);
        let at = |share: usize| samples[(samples.len() - 1) * share / 1000];
        let value = apart(a.clone(), b.clone());
        (measure, Estimate { value, low: at(25), high: at(975) })
    };
    taken.0.iter().zip(pairs).map(of).collect()
}
