//! Root mean square of the axis error over starts, some of which may have no answer.
//!
//! Each start without an answer counts as 90°. A few such starts make most of the mean square, and their share is
//! seldom known well: if no such start is observed in n starts, their share may still be up to 3.7/n. The interval of
//! the mean square is therefore combined from the interval of this share and the interval of the other starts' mean
//! square.

use standstill_campaign::{Estimate, binomial_interval};

use crate::sobol::ratio;

/// Axis error in degrees with which a start without an answer counts.
const COUNTS: f64 = 90.0;

/// Statistics of the observed starts, from which the root mean square is estimated.
pub(super) struct Seen {
    /// Number of starts without an answer.
    without: usize,
    /// Number of all starts.
    all: usize,
    /// Mean square error in degrees² of the starts with an answer.
    square: Estimate,
    /// Squared errors in degrees² of the starts with an answer, in ascending order.
    squares: Vec<f64>,
}

impl Seen {
    /// Makes the statistics from the errors in degrees; the error of a start without an answer is infinite.
    pub(super) fn of(values: &[f64]) -> Self {
        let mut squares: Vec<f64> = values.iter().filter(|e| e.is_finite()).map(|e| e * e).collect();
        let square = ratio(squares.iter().map(|square| (*square, 1.0)));
        squares.sort_by(f64::total_cmp);
        Self { without: values.len() - squares.len(), all: values.len(), square, squares }
    }

    /// Returns the root mean square with the 95 % interval that it would have after `trials` similar trials.
    ///
    /// The mean square is p 90² + (1 − p) m, with the share p of starts without an answer and the mean square m of the
    /// others. The distances from the estimate to the ends of both intervals, weighted by their effect, are added as
    /// squares (G. Y. Zou and A. Donner, "Construction of confidence limits about effect measures", 2008,
    /// doi:10.1002/sim.3095).
    pub(super) fn rms(&self, trials: f64) -> Estimate {
        let share = super::share(self.without, self.all, trials);
        let whole = COUNTS * COUNTS;
        let root = |x: f64| x.max(0.0).sqrt();
        if self.squares.len() < 2 {
            // Too few starts have an answer: of their errors in further starts only the bound of 90° is known.
            let sum = share.value * whole + self.squares.iter().sum::<f64>() / (self.all as f64).max(1.0);
            return Estimate { value: root(sum), low: root(share.low * whole), high: COUNTS };
        }
        // The width of an interval is inversely proportional to the root of the number of trials.
        let wider = (self.all as f64 / trials).sqrt();
        let m = self.square;
        let [below, above] = [m.value - m.low, m.high - m.value].map(|apart| apart * wider);
        let answered = trials * self.squares.len() as f64 / self.all as f64;
        let m = Estimate { low: (m.value - below).max(least(&self.squares, answered)), ..m };
        let value = share.value * whole + (1.0 - share.value) * m.value;
        let end = |share_apart: f64, m_apart: f64| {
            let [a, b] = [share_apart * (whole - m.value), (1.0 - share.value) * m_apart];
            (a * a + b * b).sqrt()
        };
        let low = value - end(share.value - share.low, m.value - m.low);
        // The lower end is at least the mean square of the lower ends of both parts.
        let low = low.max(share.low * whole + (1.0 - share.high) * m.low);
        let high = value + end(share.high - share.value, above);
        Estimate { value: root(value), low: root(low), high: root(high) }
    }
}

/// Returns the root mean square with an interval that covers only the observed starts, for comparisons on common random numbers.
pub(super) fn seen(values: &[f64]) -> Estimate {
    let squares = values.iter().map(|e| if e.is_finite() { e * e } else { COUNTS * COUNTS });
    ratio(squares.map(|square| (square, 1.0))).map(|x| x.max(0.0).sqrt())
}

/// Returns the share of starts without an answer, with the exact 95 % interval of this share.
pub(super) fn without_answer(values: &[f64]) -> Estimate {
    let count = values.iter().filter(|error| !error.is_finite()).count();
    binomial_interval(count as u64, values.len() as u64)
}

/// Returns a lower bound of the mean square. It is half the lower end of the median's interval, because half of all values exceed the
/// median.
fn least(squares: &[f64], trials: f64) -> f64 {
    0.5 * super::quantile(squares, 0.5, trials).low
}

/// Part of an rms estimate that is mainly caused by starts without an answer. Each such start counts as 90°.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dominated {
    /// The estimated value. Starts without an answer cause more than half of the mean square.
    Value,
    /// The upper end of the interval. Starts without an answer may cause more than half of its square.
    Interval,
}

/// Returns the part of an rms estimate that is mainly caused by starts without an answer. `share` is the share of these starts. None if
/// they cause no part mainly.
pub fn dominated(rms: &Estimate, share: &Estimate) -> Option<Dominated> {
    let most = |share: f64, rms: f64| share > 0.0 && share * COUNTS * COUNTS > rms * rms / 2.0;
    if most(share.value, rms.value) {
        Some(Dominated::Value)
    } else {
        most(share.high, rms.high).then_some(Dominated::Interval)
    }
}

/// Returns true if the upper part of an rms interval is mainly due to the uncertain share of starts without an answer. It then causes more
/// than half of the difference between the squares of the interval's upper end and of the rms.
pub fn widens(rms: &Estimate, share: &Estimate) -> bool {
    2.0 * square_of(share.high - share.value) > rms.high * rms.high - rms.value * rms.value
}

/// Returns the rms error in degrees if this share of the starts has no answer and the other starts have no error.
pub fn made_by(share: f64) -> f64 {
    COUNTS * share.sqrt()
}

/// Returns the mean square error in degrees² that this share of starts without an answer adds.
pub fn square_of(share: f64) -> f64 {
    COUNTS * COUNTS * share
}

/// Returns the share of starts without an answer that makes an rms error of `most` degrees if the other starts have no error.
pub(super) fn share_of(most: f64) -> f64 {
    (most / COUNTS) * (most / COUNTS)
}

#[cfg(test)]
mod tests {
    use standstill_sim::{Purpose, Streams};

    use super::*;

    const NONE: f64 = f64::INFINITY;

    fn rms(values: &[f64]) -> Estimate {
        Seen::of(values).rms(values.len() as f64)
    }

    #[test]
    fn analytic_starts_without_an_answer_widen_the_interval_before_one_is_seen() {
        // All of 1,000 starts have an answer, with errors of 0.1°: up to 0.368 % of starts may have none, which makes an rms of 5.46°.
        let mut values = [0.1, -0.1].repeat(500);
        let none = rms(&values);
        assert!((none.value - 0.1).abs() < 1e-12 && (none.low - 0.1).abs() < 1e-6, "{none:?}");
        assert!((none.high - 5.46).abs() < 0.01, "{none:?}");
        assert_eq!(dominated(&none, &without_answer(&values)), Some(Dominated::Interval));
        assert!(widens(&none, &without_answer(&values)));
        // With errors of 10°, starts without an answer may cause less than half of the square of the interval's upper end.
        let large: Vec<f64> = (0..1000).map(|k| 10.0 * f64::from(k % 3)).collect();
        let (rms_of_large, share) = (rms(&large), without_answer(&large));
        assert_eq!((dominated(&rms_of_large, &share), widens(&rms_of_large, &share)), (None, true));
        values[0] = NONE;
        let one = rms(&values);
        assert!((one.value - 8.1_f64.sqrt()).abs() < 0.01, "{one:?}");
        let share = without_answer(&values);
        assert_eq!(dominated(&one, &share), Some(Dominated::Value));
        // The interval contains that of the share alone, and overlaps the interval with no such start observed.
        assert!(one.low < 0.47 && one.low > 0.1 && one.high >= made_by(share.high), "{one:?}");
        assert!(one.low < none.high);
    }

    #[test]
    fn law_intervals_of_rms_cover_what_is_rare() {
        // In 1,000 starts, 0.3, then 3, then 30 starts without an answer are expected.
        for p in [3e-4, 3e-3, 3e-2] {
            let truth = (p * 8100.0 + (1.0 - p) * 0.04_f64).sqrt();
            let covered = (0..400).filter(|number| {
                let mut draws = Streams::new(5, *number).open(Purpose::Design);
                let mut one = || if draws.uniform() < p { NONE } else { 0.2 * draws.normal() };
                let values: Vec<f64> = (0..1000).map(|_| one()).collect();
                let found = rms(&values);
                found.low <= truth && truth <= found.high
            });
            let covered = covered.count();
            assert!(covered >= 370, "{p}: {covered} of 400");
        }
    }

    #[test]
    fn regress_a_lower_end_of_rms_is_not_zero() {
        // One large error makes most of the mean square: its interval, symmetric about the estimate, would reach below zero.
        let mut values = vec![0.1; 1000];
        values[3] = 60.0;
        let found = rms(&values);
        assert!(found.low > 0.05 && found.low < 0.5, "{found:?}");
        let all = rms(&[NONE; 100]);
        assert!(all.value == 90.0 && all.high == 90.0 && all.low > 88.0, "{all:?}");
    }
}
