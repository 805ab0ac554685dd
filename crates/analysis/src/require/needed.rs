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

/// About how many trials would make an interval narrower than this share of the value: the part of what was seen narrows with
/// their root, that of what was not seen with their number. None where the values do not tell how the measure changes with
/// the value.
pub fn trials_needed(measure: Measure, seen: &[Seen], edge: &Edge, width: f64) -> Option<u64> {
    /// A twentieth more each time, up to some thousand times as many.
    const STEPS: u32 = 160;
    let near = |seen: &&Seen| (0.5..=2.0).contains(&(seen.value / edge.value));
    let mut near: Vec<&Seen> = seen.iter().filter(near).collect();
    near.sort_by(|a, b| a.value.total_cmp(&b.value));
    let [first, .., last] = near[..] else { return None };
    // Of a root mean square the mean square, to which both parts add up.
    let of = |x: f64| if measure == Measure::Rms { x * x } else { x };
    let slope = ln(of(last.measure.value / first.measure.value)) / ln(last.value / first.value);
    let apart = |seen: &&&Seen| (seen.value - edge.value).abs();
    let at = near.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
    let Estimate { value, low, high } = at.measure;
    let [up, down] = [of(high) - of(value), of(value) - of(low)];
    let unseen = at.without_answer.map_or(0.0, |share| rms::square_of(share.high - share.value)).min(up);
    let known = (up * up - unseen * unseen).sqrt();
    let wide = |times: f64| {
        let up = ((known * known + unseen * unseen / times) / times).sqrt();
        (up + down / times.sqrt()) / (of(value) * slope.abs())
    };
    let mut steps = (0..STEPS).map(|k| exp(f64::from(k) * ln(1.05)));
    let trials = edge.trials as f64 * steps.find(|times| wide(*times) <= width)?;
    // In two digits, rounded up.
    let last = magnitude(trials)? - 1;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousand millions")]
    let trials = rounded(rounded(trials, -last).ceil(), last) as u64;
    Some(trials)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bracket::Side;

    #[test]
    fn analytic_the_trials_that_are_needed_are_those_with_which_the_interval_is_narrow() {
        // The mean square rises with the square of the value. Of n trials it is known to 3/√n, and up to 3.69/n may lack an
        // answer, each with 90°.
        let of = |n: f64| {
            let at = |value: f64| {
                let square = value * value;
                let known = 3.0 * square / n.sqrt();
                let high = (square + (known * known + (8100.0 * 3.69 / n).powi(2)).sqrt()).sqrt();
                Seen {
                    value,
                    measure: Estimate { value, low: (square - known).sqrt(), high },
                    without_answer: Some(Estimate { value: 0.0, low: 0.0, high: 3.69 / n }),
                }
            };
            [at(0.9), at(1.0), at(1.1)]
        };
        let now = 300_000.0_f64;
        let edge = Edge {
            side: Side::Largest,
            value: 1.0,
            interval: (0.9, 1.0),
            narrow: false,
            stretches: Vec::new(),
            trials: 300_000,
        };
        let needed = trials_needed(Measure::Rms, &of(now), &edge, 0.01).expect("told");
        // The interval of the value is half as wide as that of its square.
        let width = |n: f64| {
            let Estimate { low, high, .. } = of(n)[1].measure;
            (high * high - low * low) / 2.0
        };
        assert!(width(needed as f64) <= 0.01 && width(0.85 * needed as f64) > 0.01, "{needed}");
        // Where all starts have their answers it is four times narrower with sixteen times as many.
        let mut known = of(now);
        for seen in &mut known {
            seen.without_answer = None;
            seen.measure.high = (2.0 * seen.value.powi(2) - seen.measure.low.powi(2)).sqrt();
        }
        let needed = trials_needed(Measure::Rms, &known, &edge, 3.0 / now.sqrt() / 4.0).expect("told");
        assert!((needed as f64 / now / 16.0 - 1.0).abs() < 0.1, "{needed}");
        // A value alone does not tell how the measure changes.
        assert_eq!(trials_needed(Measure::Rms, &known[..1], &edge, 0.01), None);
    }
}
