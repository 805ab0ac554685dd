//! Claims: statements of a requirement on the starts of one case, the results of the trials, and the verdicts.

use serde::{Deserialize, Serialize};
use standstill_interface::choice;
use standstill_numeric::whole;
use standstill_scenario::Record;

use super::Case;
use super::demand::{self, Bad};
use super::rare::Rare;
use super::sequential::{Mean, Share};
use crate::faults::is_detected;

/// Axis error in degrees with which a start without an answer counts. No axis error is larger.
const LARGEST_DEG: f64 = 90.0;

choice! {
    /// Verdict on a requirement or a claim.
    #[derive(PartialOrd, Ord)]
    pub enum Verdict {
        /// The trials show that the statement holds.
        Passed = "passed",
        /// The trials do not decide.
        NotShown = "not shown",
        /// The trials show that the statement does not hold.
        Failed = "failed",
    }
}

/// The statement that a claim makes, and the limit in this statement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Claimed {
    /// The rms of the axis error is at most this value in degrees.
    Rms(f64),
    /// The share of starts with the given result is at most the last value. If the flag is true, starts without an answer count as if they
    /// had this result.
    Share(Bad, bool, f64),
    /// A limit on starts that are dangerous with the method's checks off. The share of them that still has an answer with the checks on is
    /// at most this value.
    Undetected(f64),
}

/// Results of the trials that matter for a claim.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// Number of starts that count against the claim.
    pub cases: u64,
    /// Number of starts that the claim concerns. These are all starts, or only the dangerous ones for [`Claimed::Undetected`].
    pub of: u64,
    /// Squared errors, divided by the square of 90°. Empty unless the claim is about an rms.
    pub squares: Vec<f64>,
    /// Number of the worst start, and its error in degrees (NaN if it has none). For an rms this is the start with the largest error.
    /// Otherwise it is the first start that counts against the claim.
    pub worst: Option<(u64, f64)>,
}

/// A statement that a requirement makes about one case.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// Index of the claim's requirement in the list.
    pub requirement: usize,
    /// The statement and its limit.
    pub claimed: Claimed,
    /// True if this claim guards another claim, which a method could meet by giving no answers. This claim then states that few starts have
    /// no answer.
    pub guards: bool,
    /// Largest number of trials that may be run for the claim.
    pub most: u64,
    /// Probability that the verdict on this claim is wrong.
    pub alpha: f64,
    /// Results of the trials.
    pub seen: Seen,
    /// Number of trials after which the claim was decided. If the claim is undecided, it is the number of trials that were run.
    pub trials: u64,
    /// Verdict from plain trials.
    pub plain: Verdict,
    /// Result of subset simulation, if it was requested.
    pub rare: Option<Rare>,
    /// Reason why the claim cannot pass, whatever the trials show. None if it can pass.
    pub open: Option<String>,
}

impl Claim {
    /// Returns the verdict from subset simulation if that simulation reached the event. Otherwise returns the verdict from plain trials.
    pub fn verdict(&self) -> Verdict {
        let found = match &self.rare {
            Some(rare) if rare.plain.is_some() => self.shown(),
            Some(rare) => rare.verdict,
            None => self.plain,
        };
        match (&self.open, found) {
            (Some(_), Verdict::Passed) => Verdict::NotShown,
            (_, found) => found,
        }
    }

    /// Returns the number of starts that count against the claim, and the number of all starts that it concerns. Both include the plain
    /// trials of a subset simulation that did not reach the event. These are further trials of the same event, so the sequential test goes
    /// on with them at the same probability of error.
    pub fn counts(&self) -> [u64; 2] {
        let [cases, of] = self.rare.as_ref().and_then(|rare| rare.plain).unwrap_or_default();
        [self.seen.cases + cases, self.seen.of + of]
    }

    fn share(&self, most: f64) -> Share {
        Share { most, alpha: self.alpha }
    }

    fn mean(&self, most_deg: f64) -> Mean {
        Mean { most: square(most_deg), alpha: self.alpha }
    }

    /// Returns the largest value that the claim allows, which is an rms in degrees or a share.
    pub fn limit(&self) -> f64 {
        match self.claimed {
            Claimed::Rms(most) | Claimed::Share(_, _, most) | Claimed::Undetected(most) => most,
        }
    }

    /// Returns three numbers: the value that plain trials showed, and the lower and upper end of its interval. The interval is valid after
    /// any number of trials. The numbers are an rms in degrees or a share.
    pub fn interval(&self) -> [f64; 3] {
        match self.claimed {
            Claimed::Rms(most) => {
                let values = &self.seen.squares;
                let [low, high] = self.mean(most).interval(values);
                let value = values.iter().sum::<f64>() / values.len() as f64;
                [value, low, high].map(|square| LARGEST_DEG * square.sqrt())
            }
            Claimed::Share(_, _, most) | Claimed::Undetected(most) => {
                let [cases, of] = self.counts();
                let [low, high] = self.share(most).interval(cases, of);
                [cases as f64 / of as f64, low, high]
            }
        }
    }

    /// Returns the number of starts after which the claim would pass if further starts resembled the starts so far. None if they would not
    /// show that the claim holds.
    pub fn trials_needed(&self) -> Option<u64> {
        match self.claimed {
            Claimed::Rms(most) => self.mean(most).trials_needed(&self.seen.squares),
            Claimed::Share(_, _, most) | Claimed::Undetected(most) => {
                let [cases, of] = self.counts();
                let rate = cases as f64 / (of as f64).max(1.0);
                let needed = self.share(most).trials_needed(rate)?;
                // The claim concerns only some of all starts.
                let part = self.trials as f64 / (self.seen.of as f64).max(1.0);
                Some(whole(needed as f64 * part.max(1.0)))
            }
        }
    }

    /// Tests the claim with the results so far, and stores the verdict.
    pub(super) fn look(&mut self) {
        self.plain = self.shown();
    }

    /// Returns the verdict from all plain trials so far.
    fn shown(&self) -> Verdict {
        let [cases, of] = self.counts();
        let shown = match self.claimed {
            Claimed::Rms(most) => self.mean(most).shown(&self.seen.squares),
            Claimed::Share(_, _, most) | Claimed::Undetected(most) => self.share(most).shown(cases, of),
        };
        match shown {
            Some(true) => Verdict::Passed,
            Some(false) => Verdict::Failed,
            None => Verdict::NotShown,
        }
    }

    /// Returns true if the claim is undecided and more trials may be run.
    pub(super) fn is_open(&self) -> bool {
        self.plain == Verdict::NotShown && self.trials < self.most
    }
}

/// Returns the square of an error, divided by the square of the largest axis error. `deg` is the error in degrees.
fn square(deg: f64) -> f64 {
    (deg / LARGEST_DEG) * (deg / LARGEST_DEG)
}

impl Seen {
    /// Adds a start. `without` is the record of the same start with the method's checks off.
    pub(super) fn add(&mut self, claimed: Claimed, record: &Record, without: Option<&Record>, of: &Case) {
        let silent = demand::is_unanswered(record);
        let counts = match claimed {
            Claimed::Rms(_) => {
                let miss = if silent { None } else { record.axis_error_deg() }.unwrap_or(LARGEST_DEG);
                self.squares.push(square(miss));
                self.of += 1;
                if self.worst.is_none_or(|(_, worst)| miss.abs() > worst.abs()) {
                    self.worst = Some((record.trial, miss));
                }
                return;
            }
            Claimed::Share(bad, or_unanswered, _) => {
                // With a fault a missing answer does not count, but a start that could not be simulated does.
                let broke_down = of.fault.is_some() && silent && !is_detected(record);
                bad.happened(record, of.rated) || or_unanswered && silent || broke_down
            }
            Claimed::Undetected(_) => {
                if without.and_then(|record| of.allowed.danger(record)).is_none() {
                    return;
                }
                !is_detected(record)
            }
        };
        self.of += 1;
        if counts {
            self.cases += 1;
            self.worst = self.worst.or(Some((record.trial, record.error_deg().unwrap_or(f64::NAN))));
        }
    }

    /// Adds the results of later starts.
    pub(super) fn join(&mut self, other: Self) {
        self.cases += other.cases;
        self.of += other.of;
        self.squares.extend(other.squares);
        // The first start that counts; for an rms, where no start counts, the one with the larger error.
        let larger =
            |a: (u64, f64), b: (u64, f64)| if self.cases == 0 && b.1.abs() > a.1.abs() { b } else { a };
        self.worst = match (self.worst, other.worst) {
            (Some(a), Some(b)) => Some(larger(a, b)),
            (a, b) => a.or(b),
        };
    }
}
