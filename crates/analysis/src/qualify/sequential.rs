//! Sequential tests, which may be evaluated after any number of trials, and intervals that are valid at all these times
//! together.
//!
//! Both rest on Ville's inequality: a product of fair bets on the trials, which starts at 1 and is never negative,
//! exceeds 1/α at any time with a probability of at most α. So the probability of error is bounded for every stopping
//! rule.

use standstill_numeric::{exp, ln, ln_1p, ln_gamma, whole};

/// Weight of the beta prior of [`Share`], in events: the prior counts like this number of observed events.
const CASES: f64 = 0.5;

/// Sequential test of whether the probability of an event is below a limit. The test counts the events and may be evaluated after any
/// number of trials.
///
/// The test is a bet against each probability q. The bets are a mixture over all alternative probabilities f, weighted by a beta
/// distribution whose mean is the limit. After k events in n trials, the product of the bets against q is B(a + k, b + n − k)/B(a, b)/(q^k
/// (1 − q)^(n−k)). The interval contains all q for which this product has stayed below 1/α (H. Robbins, "Statistical methods related to the
/// law of the iterated logarithm", 1970, doi:10.1214/aos/1177696786).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// Largest allowed probability, between 0 and 1.
    pub most: f64,
    /// Largest allowed probability that the interval fails to contain the true value after some number of trials.
    pub alpha: f64,
}

impl Share {
    /// Returns the logarithm of the product of the bets against the probability `q`. `cases` is the number of events, and `trials` the
    /// number of trials.
    fn against(self, q: f64, cases: f64, trials: f64) -> f64 {
        let (a, b) = (CASES, CASES * (1.0 - self.most) / self.most);
        let ln_beta = |a: f64, b: f64| ln_gamma(a) + ln_gamma(b) - ln_gamma(a + b);
        let others = trials - cases;
        let likelihood = if cases > 0.0 { cases * ln(q) } else { 0.0 }
            + if others > 0.0 { others * ln_1p(-q) } else { 0.0 };
        ln_beta(a + cases, b + others) - ln_beta(a, b) - likelihood
    }

    /// Returns the lower and the upper end of the interval of the probability. `cases` is the number of events, and `trials` the number of
    /// trials.
    pub fn interval(self, cases: u64, trials: u64) -> [f64; 2] {
        let (cases, trials) = (cases as f64, trials as f64);
        if trials == 0.0 {
            return [0.0, 1.0];
        }
        let (seen, needed) = (cases / trials, -ln(self.alpha));
        let inside = |q: f64| self.against(q, cases, trials) < needed;
        let low = if cases > 0.0 { edge(seen, 0.0, inside) } else { 0.0 };
        let high = if cases < trials { edge(seen, 1.0, inside) } else { 1.0 };
        [low, high]
    }

    /// Returns true if the trials show that the probability is at most the limit, and false if they show that it is larger. None if they
    /// show neither.
    pub fn shown(self, cases: u64, trials: u64) -> Option<bool> {
        let [low, high] = self.interval(cases, trials);
        if high <= self.most { Some(true) } else { (low > self.most).then_some(false) }
    }

    /// Returns the number of trials that would show that the probability is at most the limit, if the event occurred at this rate. None if
    /// the rate is not below the limit.
    pub fn trials_needed(self, rate: f64) -> Option<u64> {
        if rate >= self.most {
            return None;
        }
        let enough = |trials: f64| self.against(self.most, rate * trials, trials) >= -ln(self.alpha);
        first(enough)
    }
}

/// Returns the border of the set of values for which `inside` is true, found by bisection. `from` belongs to the set, and `to` does not.
fn edge(from: f64, to: f64, inside: impl Fn(f64) -> bool) -> f64 {
    let (mut within, mut outside) = (from, to);
    for _ in 0..200 {
        let middle = f64::midpoint(within, outside);
        if middle == within || middle == outside {
            break;
        }
        *(if inside(middle) { &mut within } else { &mut outside }) = middle;
    }
    // The last value outside, so that rounding never makes an interval too narrow.
    outside
}

/// Returns the smallest number of trials for which `enough` is true, to 0.1 %. None if this number exceeds 10^15.
fn first(enough: impl Fn(f64) -> bool) -> Option<u64> {
    const FURTHEST: f64 = 1e15;
    let mut high = 1.0;
    while !enough(high) {
        high *= 2.0;
        if high > FURTHEST {
            return None;
        }
    }
    let mut low = high / 2.0;
    while high - low > (1e-3 * high).max(1.0) {
        let middle = f64::midpoint(low, high);
        *(if enough(middle) { &mut high } else { &mut low }) = middle;
    }
    Some(whole(high.ceil()))
}

/// Sequential test of whether the mean of numbers from 0 to 1 is below a limit.
///
/// The test assumes only that the numbers lie between 0 and 1. The bets against a mean of m or more are 1 + λ (m − x) for several λ, the
/// largest of which is 1. The bets against a mean of m or less are 1 + c (x/m − 1) for several c below 1. No bet becomes negative. If the
/// mean is as assumed, no bet gains on average (I. Waudby-Smith and A. Ramdas, "Estimating means of bounded random variables by betting",
/// 2024, doi:10.1093/jrsssb/qkad009).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// Largest allowed mean, between 0 and 1.
    pub most: f64,
    /// Largest allowed probability that the interval fails to contain the true value after some number of trials. Half of it applies to
    /// each end of the interval.
    pub alpha: f64,
}

/// Sizes of the bets against a large mean, each with its share of the stake. The largest bet has the largest share, because it gains most
/// if most numbers lie far below the limit, as they usually do.
const ABOVE: [(f64, f64); 4] = [(1.0, 0.7), (0.5, 0.1), (0.25, 0.1), (0.1, 0.1)];
/// Sizes of the bets against a small mean, each with its share of the stake.
const BELOW: [(f64, f64); 5] = [(0.5, 0.2), (0.25, 0.2), (0.1, 0.2), (0.03, 0.2), (0.01, 0.2)];

/// Number of factors that are multiplied before the logarithm is taken. With any realistic limit each factor is between
/// 10^-12 and 10^12, so the product does not overflow.
const TOGETHER: usize = 8;

/// Returns the logarithm of the wealth after betting a stake of 1 on these numbers. Each entry of `bets` is the size of a bet and its share
/// of the stake. `factor` returns the factor by which a bet of a size multiplies its stake at a number.
fn ln_wealth(bets: &[(f64, f64)], values: &[f64], factor: impl Fn(f64, f64) -> f64) -> f64 {
    let of = |(size, share): &(f64, f64)| {
        let logs = values.chunks(TOGETHER).map(|part| ln(part.iter().map(|x| factor(*size, *x)).product()));
        ln(*share) + logs.sum::<f64>()
    };
    let logs: Vec<f64> = bets.iter().map(of).collect();
    let largest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if largest.is_infinite() {
        return largest;
    }
    largest + ln(logs.iter().map(|log| exp(log - largest)).sum())
}

impl Mean {
    /// Returns the logarithm of the wealth that refutes a mean. Each end of the interval has half of `alpha`.
    fn needed(self) -> f64 {
        -ln(self.alpha / 2.0)
    }

    /// Returns true if the numbers refute a mean of `m` or more.
    fn is_below(self, m: f64, values: &[f64]) -> bool {
        ln_wealth(&ABOVE, values, |size, x| 1.0 + size * (m - x)) >= self.needed()
    }

    /// Returns true if the numbers refute a mean of `m` or less.
    fn is_above(self, m: f64, values: &[f64]) -> bool {
        ln_wealth(&BELOW, values, |size, x| 1.0 + size * (x / m - 1.0)) >= self.needed()
    }

    /// Returns true if the numbers show that their mean is at most the limit, and false if they show that it is larger. None if they show
    /// neither.
    pub fn shown(self, values: &[f64]) -> Option<bool> {
        if self.is_below(self.most, values) {
            return Some(true);
        }
        self.is_above(self.most, values).then_some(false)
    }

    /// Returns the lower and the upper end of the interval of the mean, with a relative accuracy of 0.1 %.
    pub fn interval(self, values: &[f64]) -> [f64; 2] {
        let seen = values.iter().sum::<f64>() / (values.len() as f64).max(1.0);
        // Bisection by factors, because the ends of a small mean's interval are decades away from it.
        let within = |mut inside: f64, mut outside: f64, is_out: &dyn Fn(f64) -> bool| {
            while (outside / inside).max(inside / outside) > 1.001 {
                let middle = (inside * outside).sqrt();
                *(if is_out(middle) { &mut outside } else { &mut inside }) = middle;
            }
            outside
        };
        let start = seen.max(LEAST);
        let high =
            if self.is_below(1.0, values) { within(start, 1.0, &|m| self.is_below(m, values)) } else { 1.0 };
        let low = if seen > LEAST && self.is_above(LEAST, values) {
            within(seen, LEAST, &|m| self.is_above(m, values))
        } else {
            0.0
        };
        [low, high]
    }

    /// Returns the number of trials that would show that the mean is at most the limit, if further numbers are distributed like these. None
    /// if the mean of these numbers is not below the limit.
    pub fn trials_needed(self, values: &[f64]) -> Option<u64> {
        let count = values.len() as f64;
        if values.is_empty() {
            return first(|trials| trials * ln_1p(self.most) >= self.needed() - ln(ABOVE[0].1));
        }
        let gains = ABOVE.map(|(size, share)| {
            let gain = values.iter().map(|x| ln_1p(size * (self.most - x))).sum::<f64>() / count;
            (gain, ln(share))
        });
        let enough = |trials: f64| gains.iter().any(|(gain, share)| share + gain * trials >= self.needed());
        gains.iter().any(|(gain, _)| *gain > 0.0).then(|| first(enough)).flatten()
    }
}

/// Means below this number count as zero. If the numbers are squares of the axis error relative to 90°, it corresponds to an rms error of
/// 0.9 µ°.
const LEAST: f64 = 1e-16;

#[cfg(test)]
mod tests;
