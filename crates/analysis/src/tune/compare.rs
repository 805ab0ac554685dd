//! Paired differences between two settings.

use standstill_campaign::{Estimate, paired_difference};
use standstill_sim::{Purpose, Streams};

use crate::limit::{Limits, Measure, Tally, rms};

/// Number of bootstrap samples.
const SAMPLES: u64 = 400;

/// Returns the difference of each measure between two settings, second minus first, with its 95 % interval. Effects of the common random
/// numbers cancel. The interval of a share is computed from the trials in which the event happened with only one of the settings. It
/// exists even if the event was never observed. The intervals of other measures come from a bootstrap over paired trials (B. Efron,
/// "Bootstrap methods", 1979, doi:10.1214/aos/1176344552). A bootstrap knows nothing of events that no trial showed: see [`unseen`]. The
/// difference is zero if `alike` is true, which states that the settings are equal. Different settings may differ in trials that were not
/// run, even if all observed trials are equal.
pub fn paired(
    taken: &Limits,
    [first, second]: [&Tally; 2],
    alike: bool,
    seed: u64,
) -> Vec<(Measure, Estimate)> {
    let pairs = first.values().iter().zip(second.values());
    let of = |(limit, (a, b)): (&crate::limit::Limit, (&Vec<f64>, &Vec<f64>))| {
        let found = if alike {
            Estimate { value: 0.0, low: 0.0, high: 0.0 }
        } else if limit.measure.unit().is_none() {
            shares(a, b)
        } else {
            bootstrapped(limit.measure, a, b, seed)
        };
        (limit.measure, found)
    };
    taken.0.iter().zip(pairs).map(of).collect()
}

/// Returns the difference of two shares, second minus first, with its 95 % interval. `a` and `b` have a number for each trial, which is
/// above zero if the event happened.
fn shares(a: &[f64], b: &[f64]) -> Estimate {
    let alone = |one: &[f64], other: &[f64]| {
        one.iter().zip(other).filter(|(one, other)| **one > 0.0 && **other <= 0.0).count() as u64
    };
    paired_difference([alone(a, b), alone(b, a)], a.len() as u64)
}

fn bootstrapped(measure: Measure, a: &[f64], b: &[f64], seed: u64) -> Estimate {
    let apart = |a: Vec<f64>, b: Vec<f64>| {
        let [a, b] = [a, b].map(|values| measure.seen(values).value);
        // Two infinite measures have no difference.
        if a == b { 0.0 } else { b - a }
    };
    let sample = |number: u64| {
        let mut draws = Streams::new(seed, number).open(Purpose::Design);
        let last = (a.len() as u64).saturating_sub(1);
        let (mut x, mut y) = (Vec::with_capacity(a.len()), Vec::with_capacity(a.len()));
        for _ in 0..a.len() {
            // The index is below the number of trials.
            #[allow(clippy::cast_possible_truncation, reason = "an index into trials that are in memory")]
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
    Estimate { value: apart(a.to_vec(), b.to_vec()), low: at(25), high: at(975) }
}

/// Possible effect on the difference of two rms errors of starts without an answer that did not occur in the trials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unseen {
    /// Largest possible increase of the share of starts without an answer.
    pub share: f64,
    /// Rms error of the second settings, in degrees, if the share increases by this amount.
    pub rms_deg: f64,
}

/// Returns the possible effect of starts without an answer that did not occur in the trials. None if it cannot make the second rms error as
/// large as the first. `first` and `second` are the rms errors in degrees. `more` is the difference of the shares of starts without an
/// answer.
pub fn unseen(first: &Estimate, second: &Estimate, more: &Estimate) -> Option<Unseen> {
    let rms_deg = (second.value * second.value + rms::square_of(more.high.max(0.0))).sqrt();
    (more.high > 0.0 && rms_deg >= first.value).then_some(Unseen { share: more.high, rms_deg })
}
