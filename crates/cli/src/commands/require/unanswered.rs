//! The effect of starts without an answer, each counted as 90°, on a limit of an rms error.

use std::fmt;

use serde::Serialize;
use standstill_analysis::bracket::Edge;
use standstill_analysis::limit::rms::{Dominated, dominated, made_by, widens};
use standstill_analysis::limit::{Limits, Measure};
use standstill_campaign::Estimate;

use crate::arguments::MOST_AT_A_VALUE as MOST;
use crate::shell::values::{percent, probability};
use standstill_analysis::require::Judged;
use standstill_quantity::count;

/// A remark that starts without an answer decide a limit of the rms error. At the edge, these starts cause more than half of the mean
/// square error, or more than half of the square of the upper end of the rms interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unanswered {
    /// The quantity that these starts decide: `limit`, or `interval` if they affect only the interval of the measure.
    decide: &'static str,
    trials: u64,
    share: f64,
    share_high: f64,
    /// Rms error in degrees that the starts without an answer cause by themselves. Each of them counts as an error of 90°.
    rms_deg: f64,
    rms_high_deg: f64,
}

impl Unanswered {
    /// Makes the remark for the judged value closest to the edge, among those with as many trials as the edge. Returns none if starts
    /// without an answer do not decide the limit.
    pub fn of(limits: &Limits, judged: &[Judged], edge: &Edge) -> Option<Self> {
        let last = judged.iter().filter(|judged| judged.trials == edge.trials);
        let apart = |judged: &&Judged| (judged.value - edge.value).abs();
        let at = last.min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
        let number = limits.0.iter().position(|limit| limit.measure == Measure::Rms)?;
        let (rms, share) = (&at.measures[number], &at.without_answer?);
        // If the interval is too wide, the remark is also made if these starts cause most of the interval, but not of the mean square.
        let open = || (!edge.narrow && widens(rms, share)).then(|| Self::new("interval", share, at.trials));
        Self::in_measure(rms, share, at.trials).or_else(open)
    }

    /// Makes the remark for an rms error and a share of starts without an answer. Returns none if these starts do not decide the limit.
    pub fn in_measure(rms: &Estimate, share: &Estimate, trials: u64) -> Option<Self> {
        let decide = match dominated(rms, share)? {
            Dominated::Value => "limit",
            Dominated::Interval => "interval",
        };
        Some(Self::new(decide, share, trials))
    }

    fn new(decide: &'static str, share: &Estimate, trials: u64) -> Self {
        Self {
            decide,
            trials,
            share: share.value,
            share_high: share.high,
            rms_deg: made_by(share.value),
            rms_high_deg: made_by(share.high),
        }
    }
}

impl fmt::Display for Unanswered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { trials, share, share_high, rms_deg, rms_high_deg, .. } = self;
        write!(f, "starts without an answer, counted as 90°, decide this {}: ", self.decide)?;
        if self.decide == "limit" {
            return write!(f, "{} of them make {}° of rms alone", percent(*share), probability(*rms_deg));
        }
        let seen = if *share > 0.0 { percent(*share) } else { "none".to_owned() };
        write!(
            f,
            "{seen} of {} starts lacked one, but up to {} may, which make {}° of rms alone",
            count(*trials),
            percent(*share_high),
            probability(*rms_high_deg)
        )
    }
}

/// Returns a sentence if the number of trials is too small to show that the limits hold, even with no failure. Returns none if the number
/// suffices.
pub fn too_few(limits: &Limits, edge: &Edge) -> Option<String> {
    let needed = limits.least_trials();
    (needed > edge.trials).then(|| {
        format!(
            "{} trials cannot show that it surely holds, whatever they are: that takes at least {needed}, because of n trials \
             without a case up to 3.7/n may be one",
            edge.trials
        )
    })
}

/// Returns a sentence for an interval that is wider than requested. `needed` is the number of trials that would suffice.
pub fn wide(width: f64, needed: Option<u64>) -> String {
    let wide = format!("the interval is wider than {} of the value", percent(width));
    match needed {
        Some(needed) if needed <= MOST => {
            format!("{wide}: about {needed} trials would make it narrower (--most {needed})")
        }
        Some(needed) => format!("{wide}: that would take about {needed} trials"),
        None => format!("{wide}; --most allows more trials"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_the_trials_that_help_are_told_as_an_option_while_it_takes_them() {
        assert!(wide(0.05, Some(720_000)).ends_with("(--most 720000)"));
        assert!(wide(0.05, Some(720_000_000)).ends_with("take about 720000000 trials"));
    }

    #[test]
    fn analytic_starts_that_were_not_seen_are_told_where_they_keep_an_interval_wide() {
        use standstill_analysis::bracket::{Bound, Side};

        let limits: Limits = "rms <= 1 deg".parse().expect("limits");
        // Of 60,000 up to 0.00615 % may lack an answer: 0.498 deg² of the 0.52 between 1 and 1.52.
        let judged = [Judged {
            value: 0.014,
            trials: 60_000,
            clear: false,
            measures: vec![Estimate { value: 1.0, low: 0.99, high: 1.52_f64.sqrt() }],
            without_answer: Some(Estimate { value: 0.0, low: 0.0, high: 6.15e-5 }),
        }];
        let decided = |narrow: bool| {
            let edge = Edge {
                side: Side::Largest,
                value: 0.014,
                interval: [Some(0.010), Some(0.0146)],
                narrow,
                trials: 60_000,
                needed: None,
                bound: Bound::Limits(vec![0]),
            };
            Unanswered::of(&limits, &judged, &edge).map(|found| found.to_string())
        };
        let text = decided(false).expect("a sentence");
        assert!(text.contains("decide this interval: none of 60,000 starts lacked one"), "{text}");
        assert_eq!(decided(true), None);
    }

    #[test]
    fn analytic_what_decides_is_told() {
        let share = |value, high| Estimate { value, low: 0.0, high };
        let rms = |value, high| Estimate { value, low: 0.0, high };
        let said = |rms, share| Unanswered::in_measure(&rms, &share, 20_000).map(|found| found.to_string());
        let text = said(rms(0.95, 1.3), share(1e-4, 2e-4)).expect("a sentence");
        assert!(text.ends_with("decide this limit: 0.01 % of them make 0.9000° of rms alone"), "{text}");
        let text = said(rms(0.15, 1.23), share(0.0, 1.84e-4)).expect("a sentence");
        assert!(text.contains("decide this interval: none of 20,000") && text.contains("0.0184 %"), "{text}");
        assert_eq!(said(rms(5.0, 5.2), share(0.0, 1.84e-4)), None);
    }
}
