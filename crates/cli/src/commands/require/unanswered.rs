//! What starts without an answer have to do with a limit on the root mean square, in which each counts as 90°.

use std::fmt;

use serde::Serialize;
use standstill_analysis::bracket::Edge;
use standstill_analysis::limit::rms::{Part, made_by, part};
use standstill_analysis::limit::{Limits, Measure};
use standstill_campaign::Estimate;

use crate::commands::question::probability;
use crate::figures::Judged;

/// That they decide a limit: at the edge most of the mean square, or of its interval's upper end, is theirs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Unanswered {
    /// The limit itself, or only how well it is known.
    decide: &'static str,
    trials: u64,
    share: f64,
    share_high: f64,
    /// The root mean square that they make alone.
    rms_deg: f64,
    rms_high_deg: f64,
}

impl Unanswered {
    /// Of the value that was judged next to the edge, by as many trials as were taken last.
    pub fn of(limits: &Limits, judged: &[Judged], edge: &Edge) -> Option<Self> {
        let last = judged.iter().filter(|judged| judged.trials == edge.trials);
        let apart = |judged: &&Judged| (judged.value - edge.value).abs();
        let at = last.min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
        let number = limits.0.iter().position(|limit| limit.measure == Measure::Rms)?;
        Self::in_measure(&at.measures[number], &at.without_answer?, at.trials)
    }

    /// Of a root mean square and a share.
    pub fn in_measure(rms: &Estimate, share: &Estimate, trials: u64) -> Option<Self> {
        let decide = match part(rms, share)? {
            Part::Value => "limit",
            Part::Interval => "interval",
        };
        Some(Self {
            decide,
            trials,
            share: share.value,
            share_high: share.high,
            rms_deg: made_by(share.value),
            rms_high_deg: made_by(share.high),
        })
    }
}

fn percent(share: f64) -> String {
    format!("{} %", standstill_quantity::listed(&[100.0 * share], "").trim_end())
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
            "{seen} of {trials} starts lacked one, but up to {} may, which make {}° of rms alone",
            percent(*share_high),
            probability(*rms_high_deg)
        )
    }
}

/// That no number of trials that was taken can show that the limits hold.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_what_decides_is_told() {
        let share = |value, high| Estimate { value, low: 0.0, high };
        let rms = |value, high| Estimate { value, low: 0.0, high };
        let said = |rms, share| Unanswered::in_measure(&rms, &share, 20_000).map(|found| found.to_string());
        let text = said(rms(0.95, 1.3), share(1e-4, 2e-4)).expect("told");
        assert!(text.ends_with("decide this limit: 0.01 % of them make 0.9000° of rms alone"), "{text}");
        let text = said(rms(0.15, 1.23), share(0.0, 1.84e-4)).expect("told");
        assert!(text.contains("decide this interval: none of 20000") && text.contains("0.0184 %"), "{text}");
        assert_eq!(said(rms(5.0, 5.2), share(0.0, 1.84e-4)), None);
    }
}
