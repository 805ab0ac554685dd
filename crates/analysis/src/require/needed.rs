//! How many trials a requirement needs.

use standstill_campaign::Estimate;
use standstill_numeric::{exp, ln};
use standstill_quantity::{magnitude, rounded};

use crate::bracket::Edge;
use crate::limit::{Measure, rms};

/// What the last trials of a value showed of a measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// The value.
    pub value: f64,
    /// The measure.
    pub measure: Estimate,
    /// The share of starts without an answer, where the measure is a root mean square.
    pub without_answer: Option<Estimate>,
}

/// About how many trials would make an interval narrower than this share of the value. None where the values do not tell how
/// the measure changes with the value.
///
/// The part of the measure's interval that was seen narrows with their root, that of what was not seen with their number. How
/// wide that is in values the measure's slope tells, on that side of the edge on which the interval is wide: beyond the edge
/// starts may cease to answer, and the measure leaps. At the edge itself the slope may be less than that over the whole side,
/// so the number is never below that of an interval which narrows with the root of the trials.
pub fn trials_needed(measure: Measure, seen: &[Seen], edge: &Edge, width: f64) -> Option<u64> {
    /// A twentieth more each time, up to some thousand times as many.
    const STEPS: u32 = 160;
    // An end that is further off is rather that of the range.
    let [start, end] = [edge.interval.0.max(edge.value / 2.0), edge.interval.1.min(edge.value * 2.0)];
    let apart = |seen: &&Seen| (seen.value - edge.value).abs();
    let nearest = |a: &&Seen, b: &&Seen| apart(a).total_cmp(&apart(b));
    let at = seen.iter().min_by(nearest)?;
    let below = edge.value - start >= end - edge.value;
    let side = || {
        let is_there = move |seen: &&Seen| {
            if below {
                (edge.value / 2.0..at.value).contains(&seen.value)
            } else {
                seen.value > at.value && seen.value <= edge.value * 2.0
            }
        };
        seen.iter().filter(is_there)
    };
    // Over all of the interval on that side, or at least to the next value.
    let inside = side().filter(|seen| (start..=end).contains(&seen.value)).max_by(nearest);
    let other = inside.or_else(|| side().min_by(nearest))?;
    // Of a root mean square the mean square, to which both parts add up.
    let of = |x: f64| if measure == Measure::Rms { x * x } else { x };
    let slope = ln(of(other.measure.value / at.measure.value)) / ln(other.value / at.value);
    let Estimate { value, low, high } = at.measure;
    let [up, down] = [of(high) - of(value), of(value) - of(low)];
    let unseen = at.without_answer.map_or(0.0, |share| rms::square_of(share.high - share.value)).min(up);
    let known = (up * up - unseen * unseen).sqrt();
    let wide = |times: f64| {
        let up = ((known * known + unseen * unseen / times) / times).sqrt();
        (up + down / times.sqrt()) / (of(value) * slope.abs())
    };
    let mut steps = (0..STEPS).map(|k| exp(f64::from(k) * ln(1.05)));
    let by_slope = steps.find(|times| wide(*times) <= width)?;
    let excess = (end - start) / edge.value / width;
    let trials = edge.trials as f64 * by_slope.max(excess * excess);
    // In two digits, rounded up.
    let last = magnitude(trials)? - 1;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousand millions")]
    let trials = rounded(rounded(trials, -last).ceil(), last) as u64;
    (trials > edge.trials).then_some(trials)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bracket::Side;

    fn edge(interval: (f64, f64), trials: u64) -> Edge {
        Edge { side: Side::Largest, value: 1.0, interval, narrow: false, stretches: Vec::new(), trials }
    }

    /// A value whose mean square is known to `known`, and with n trials without a case to 3.69/n times 90° squared more.
    fn seen(value: f64, square: f64, known: f64, trials: f64) -> Seen {
        let high = 3.69 / trials;
        let up = (known * known + (8100.0 * high).powi(2)).sqrt();
        Seen {
            value,
            measure: Estimate {
                value: square.sqrt(),
                low: (square - known).sqrt(),
                high: (square + up).sqrt(),
            },
            without_answer: Some(Estimate { value: 0.0, low: 0.0, high }),
        }
    }

    #[test]
    fn analytic_the_trials_that_are_needed_are_those_with_which_the_interval_is_narrow() {
        // The mean square rises with the square of the value. Of n trials it is known to 3/√n, and up to 3.69/n may lack an
        // answer, each with 90°.
        let of = |n: f64| {
            [0.95, 1.0, 1.05].map(|value: f64| seen(value, value * value, 3.0 * value * value / n.sqrt(), n))
        };
        let now = 300_000.0_f64;
        // The interval of the value is half as wide as that of its square: 0.05 below, 0.003 above.
        let width = |n: f64| {
            let Estimate { low, high, .. } = of(n)[1].measure;
            (high * high - low * low) / 2.0
        };
        let edge_now = edge((0.947, 1.003), 300_000);
        let needed = trials_needed(Measure::Rms, &of(now), &edge_now, 0.01).expect("told");
        // What was not seen narrows faster than with the root.
        assert!(width(needed as f64) <= 0.01 && needed as f64 <= 1.05 * now * 5.6 * 5.6, "{needed}");
        // An interval of values that is narrower than the slope tells does not make the number smaller.
        let narrower = edge((0.95, 1.0), 300_000);
        let needed = trials_needed(Measure::Rms, &of(now), &narrower, 0.045).expect("told");
        assert!(width(needed as f64) <= 0.045 && width(0.85 * needed as f64) > 0.045, "{needed}");
        // Where all starts have their answers it is four times narrower with sixteen times as many.
        let mut known = of(now);
        for seen in &mut known {
            seen.without_answer = None;
            seen.measure.high = (2.0 * seen.value.powi(2) - seen.measure.low.powi(2)).sqrt();
        }
        let width = 3.0 / now.sqrt();
        let edge = edge((1.0 - width / 2.0, 1.0 + width / 2.0), 300_000);
        known[0].value = edge.interval.0;
        known[0].measure.value = edge.interval.0;
        let needed = trials_needed(Measure::Rms, &known, &edge, width / 4.0).expect("told");
        assert!((needed as f64 / now / 16.0 - 1.0).abs() < 0.1, "{needed}");
        // A value alone does not tell how the measure changes.
        assert_eq!(trials_needed(Measure::Rms, &known[..1], &edge, 0.01), None);
    }

    #[test]
    fn law_a_cliff_beyond_the_edge_does_not_make_the_number_small() {
        // The mean square rises with the square of the value up to 1.02; beyond, one start in five lacks an answer.
        for trials in [10_000_u64, 40_000, 300_000] {
            let n = trials as f64;
            let at = |value: f64| {
                let square = value * value + if value > 1.02 { 8100.0 / 5.0 } else { 0.0 };
                seen(value, square, 3.0 * value * value / n.sqrt(), n)
            };
            let all = [0.6, 0.8, 0.9, 1.0, 1.03, 1.5].map(at);
            // It surely holds up to where both parts end below 1.
            let inner = (1.0 - 8100.0 * 3.69 / n).max(0.0).sqrt();
            let edge = edge((inner, 1.03), trials);
            let needed = trials_needed(Measure::Rms, &all, &edge, 0.05).expect("told");
            let width = (1.03 - inner.max(0.5)) / 0.05;
            assert!(needed > trials && needed as f64 >= n * width * width * 0.999, "{needed} after {trials}");
            // With so many, what was not seen leaves the value's lower end as near as it was to be.
            assert!(8100.0 * 3.69 / needed as f64 / 2.0 < 0.05, "{needed}");
        }
    }
}
