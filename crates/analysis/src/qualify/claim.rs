//! Claims: what a requirement says of the starts of a case, what was seen of them, and what that shows.

use serde::{Deserialize, Serialize};
use standstill_scenario::Record;

use super::Case;
use super::demand::{self, Bad};
use super::rare::Rare;
use super::sequential::{Mean, Share};
use crate::faults::is_detected;

/// Axis error in degrees as which a start without an answer counts, which no error exceeds.
const LARGEST_DEG: f64 = 90.0;

/// Verdict on a requirement or a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// It is shown to hold.
    Passed,
    /// The trials leave it open.
    NotShown,
    /// It is shown not to hold.
    Failed,
}

/// The statement that a claim makes, with its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Claimed {
    /// The rms of the axis error in degrees is at most this.
    Rms(f64),
    /// At most a share of starts has this.
    Share(Bad, bool, f64),
    /// At most this share of dangerous starts is not detected.
    Undetected(f64),
}

/// Results of the trials as far as they bear on a claim.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seen {
    /// Starts that count against it.
    pub cases: u64,
    /// Starts that it is about: all, or the dangerous ones.
    pub of: u64,
    /// For a claim about an rms: the squared errors, divided by the square of 90°.
    pub squares: Vec<f64>,
    /// The start that is worst, or the first one that counts against it, and its error in degrees if it has one.
    pub worst: Option<(u64, f64)>,
}

/// A claim of a requirement in a case.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// Number of the requirement in its list.
    pub requirement: usize,
    /// The statement, with its limit.
    pub claimed: Claimed,
    /// True if it guards another claim: that few starts have no answer.
    pub guards: bool,
    /// Most trials.
    pub most: u64,
    /// Probability of an error of this claim.
    pub alpha: f64,
    /// Results of the trials.
    pub seen: Seen,
    /// Number of trials after which it was decided, or that were run.
    pub trials: u64,
    /// Verdict by plain trials.
    pub plain: Verdict,
    /// Result of subset simulation, if it was asked for.
    pub rare: Option<Rare>,
    /// Reason why it cannot be shown whatever the trials say.
    pub open: Option<String>,
}

impl Claim {
    /// Returns the verdict, by plain trials or by odds.
    pub fn verdict(&self) -> Verdict {
        let found = self.rare.as_ref().map_or(self.plain, |rare| rare.verdict);
        match (&self.open, found) {
            (Some(_), Verdict::Passed) => Verdict::NotShown,
            (_, found) => found,
        }
    }

    fn share(&self, most: f64) -> Share {
        Share { most, alpha: self.alpha }
    }

    fn mean(&self, most_deg: f64) -> Mean {
        Mean { most: square(most_deg), alpha: self.alpha }
    }

    /// Returns the largest value allowed: an rms in degrees, or a share.
    pub fn limit(&self) -> f64 {
        match self.claimed {
            Claimed::Rms(most) | Claimed::Share(_, _, most) | Claimed::Undetected(most) => most,
        }
    }

    /// Returns the value that was seen, with the interval that holds at all times, by plain trials.
    pub fn interval(&self) -> [f64; 3] {
        match self.claimed {
            Claimed::Rms(most) => {
                let values = &self.seen.squares;
                let [low, high] = self.mean(most).interval(values);
                let value = values.iter().sum::<f64>() / values.len() as f64;
                [value, low, high].map(|square| LARGEST_DEG * square.sqrt())
            }
            Claimed::Share(_, _, most) | Claimed::Undetected(most) => {
                let (cases, of) = (self.seen.cases, self.seen.of);
                let [low, high] = self.share(most).interval(cases, of);
                [cases as f64 / of as f64, low, high]
            }
        }
    }

    /// Returns the number of starts that would show it if they went on as those seen; none if that does not lead there.
    pub fn trials_needed(&self) -> Option<u64> {
        match self.claimed {
            Claimed::Rms(most) => self.mean(most).trials_needed(&self.seen.squares),
            Claimed::Share(_, _, most) | Claimed::Undetected(most) => {
                let rate = self.seen.cases as f64 / (self.seen.of as f64).max(1.0);
                let needed = self.share(most).trials_needed(rate)?;
                // Of all starts, only some are those that it is about.
                let part = self.trials as f64 / (self.seen.of as f64).max(1.0);
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
                let all = (needed as f64 * part.max(1.0)) as u64;
                Some(all)
            }
        }
    }

    /// Decides the claim if what was seen shows it.
    pub(super) fn look(&mut self) {
        let shown = match self.claimed {
            Claimed::Rms(most) => self.mean(most).shown(&self.seen.squares),
            Claimed::Share(_, _, most) | Claimed::Undetected(most) => {
                self.share(most).shown(self.seen.cases, self.seen.of)
            }
        };
        self.plain = match shown {
            Some(true) => Verdict::Passed,
            Some(false) => Verdict::Failed,
            None => Verdict::NotShown,
        };
    }

    /// Returns true if trials may still decide the claim.
    pub(super) fn is_open(&self) -> bool {
        self.plain == Verdict::NotShown && self.trials < self.most
    }
}

/// Returns a mean square over that of the largest axis error.
fn square(deg: f64) -> f64 {
    (deg / LARGEST_DEG) * (deg / LARGEST_DEG)
}

impl Seen {
    /// Adds a start, with the same start without the method's checks.
    pub(super) fn add(&mut self, claimed: Claimed, record: &Record, without: Option<&Record>, of: &Case) {
        let silent = demand::is_unanswered(record);
        let counts = match claimed {
            Claimed::Rms(_) => {
                let miss = if silent { None } else { record.axis_miss_deg() }.unwrap_or(LARGEST_DEG);
                self.squares.push(square(miss));
                self.of += 1;
                if self.worst.is_none_or(|(_, worst)| miss.abs() > worst.abs()) {
                    self.worst = Some((record.trial, miss));
                }
                return;
            }
            Claimed::Share(bad, or_unanswered, _) => {
                // With a fault a start need not have an answer, but one that could not be simulated shows nothing good.
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

    /// Adds what was seen of later starts.
    pub(super) fn join(&mut self, other: Self) {
        self.cases += other.cases;
        self.of += other.of;
        self.squares.extend(other.squares);
        // The first that counts; of an rms, where none counts, the largest.
        let larger =
            |a: (u64, f64), b: (u64, f64)| if self.cases == 0 && b.1.abs() > a.1.abs() { b } else { a };
        self.worst = match (self.worst, other.worst) {
            (Some(a), Some(b)) => Some(larger(a, b)),
            (a, b) => a.or(b),
        };
    }
}
