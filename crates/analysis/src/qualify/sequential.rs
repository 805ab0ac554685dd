//! Tests that may be looked at after any number of trials, and intervals that hold after all of them at once.
//!
//! Both rest on Ville's inequality: a product of fair bets on the trials, which starts at one and never falls below zero, exceeds 1/α
//! at any time with a probability of at most α. So the error of stopping early is bounded whatever the rule for stopping is.

use standstill_numeric::{exp, ln, ln_1p, ln_gamma};

/// Weight of a prior: the number of cases that it counts as.
const CASES: f64 = 0.5;

/// A probability that is limited, of which cases are counted.
///
/// The bets are a mixture over all probabilities f, weighted by a beta distribution whose mean is the limit: after k cases in n trials the
/// product for the probability q is B(a + k, b + n − k)/B(a, b)/(q^k (1 − q)^(n−k)). The q for which it has stayed below 1/α are the interval
/// (H. Robbins, "Statistical methods related to the law of the iterated logarithm", 1970, doi:10.1214/aoms/1177696786).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// Largest allowed probability, between 0 and 1.
    pub most: f64,
    /// Probability with which the interval may ever miss.
    pub alpha: f64,
}

impl Share {
    /// Returns the logarithm of the product of bets against the probability `q` after `cases` in `trials`.
    fn against(self, q: f64, cases: f64, trials: f64) -> f64 {
        let (a, b) = (CASES, CASES * (1.0 - self.most) / self.most);
        let ln_beta = |a: f64, b: f64| ln_gamma(a) + ln_gamma(b) - ln_gamma(a + b);
        let others = trials - cases;
        let likelihood = if cases > 0.0 { cases * ln(q) } else { 0.0 }
            + if others > 0.0 { others * ln_1p(-q) } else { 0.0 };
        ln_beta(a + cases, b + others) - ln_beta(a, b) - likelihood
    }

    /// Returns the interval of the probability.
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

    /// Returns whether the limit is shown to hold (true), or not to hold (false); none if neither is shown.
    pub fn shown(self, cases: u64, trials: u64) -> Option<bool> {
        let [low, high] = self.interval(cases, trials);
        if high <= self.most { Some(true) } else { (low > self.most).then_some(false) }
    }

    /// Returns the number of trials that would show that the limit holds, if cases went on to come at this rate; none if that rate is not
    /// below the limit.
    pub fn trials_needed(self, rate: f64) -> Option<u64> {
        if rate >= self.most {
            return None;
        }
        let enough = |trials: f64| self.against(self.most, rate * trials, trials) >= -ln(self.alpha);
        first(enough)
    }
}

/// Returns the last place inside, between one inside and one at the end `to`.
fn edge(from: f64, to: f64, inside: impl Fn(f64) -> bool) -> f64 {
    let (mut within, mut outside) = (from, to);
    for _ in 0..200 {
        let middle = f64::midpoint(within, outside);
        if middle == within || middle == outside {
            break;
        }
        *(if inside(middle) { &mut within } else { &mut outside }) = middle;
    }
    // The end that is outside: an interval is never too narrow by rounding.
    outside
}

/// Returns the smallest number of trials that is enough, within a thousandth; none beyond 10^15.
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
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "above zero and at most 10^15"
    )]
    let trials = high.ceil() as u64;
    Some(trials)
}

/// A mean of numbers from 0 to 1 that is limited.
///
/// Of the numbers nothing is assumed but that range. Against a mean of m or more the bets are 1 + λ (m − x) for several λ up to 1, against
/// one of m or less 1 + c (x/m − 1) for several c below 1; no bet falls below zero, and under these means none gains on average (I.
/// Waudby-Smith and A. Ramdas, "Estimating means of bounded random variables by betting", 2024, doi:10.1093/jrsssb/qkad009).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// Largest allowed mean, between 0 and 1.
    pub most: f64,
    /// Probability with which the interval may ever miss, half of it on each side.
    pub alpha: f64,
}

/// Sizes of the bets, each with its share of the stake. Most numbers lie far below the limit: the largest bet is best then.
const ABOVE: [(f64, f64); 4] = [(1.0, 0.7), (0.5, 0.1), (0.25, 0.1), (0.1, 0.1)];
const BELOW: [(f64, f64); 5] = [(0.5, 0.2), (0.25, 0.2), (0.1, 0.2), (0.03, 0.2), (0.01, 0.2)];

/// Number of factors that are multiplied before their logarithm is taken: none is below 10^-12 or above 10^12 but of limits no one sets.
const TOGETHER: usize = 8;

/// Returns the logarithm of what a stake of one has become by bets of several sizes on these numbers.
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
    fn needed(self) -> f64 {
        -ln(self.alpha / 2.0)
    }

    /// Returns whether a mean of `m` or more is refuted.
    fn is_below(self, m: f64, values: &[f64]) -> bool {
        ln_wealth(&ABOVE, values, |size, x| 1.0 + size * (m - x)) >= self.needed()
    }

    /// Returns whether a mean of `m` or less is refuted.
    fn is_above(self, m: f64, values: &[f64]) -> bool {
        ln_wealth(&BELOW, values, |size, x| 1.0 + size * (x / m - 1.0)) >= self.needed()
    }

    /// Returns whether the limit is shown to hold (true), or not to hold (false); none if neither is shown.
    pub fn shown(self, values: &[f64]) -> Option<bool> {
        if self.is_below(self.most, values) {
            return Some(true);
        }
        self.is_above(self.most, values).then_some(false)
    }

    /// Returns the interval of the mean, each end within a thousandth.
    pub fn interval(self, values: &[f64]) -> [f64; 2] {
        let seen = values.iter().sum::<f64>() / (values.len() as f64).max(1.0);
        // By factors: the ends are decades away from the mean where it is small.
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

    /// Returns the number of trials that would show that the limit holds if all went on as these; none if they are not below it.
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

/// Means below this count as zero: of the squared errors of an axis, over 90°, those of an rms of 0.9 µ°.
const LEAST: f64 = 1e-16;

#[cfg(test)]
mod tests;
