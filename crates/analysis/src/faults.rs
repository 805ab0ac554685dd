//! Failure modes of a drive, and their effect on a method: right answers, wrong answers, and detected faults.
//!
//! Each fault is added to the scenario, and the same trials are run twice: with the method's plausibility checks, and
//! without them. An answer that would start the motor wrongly is dangerous. The coverage is the share of starts with a
//! dangerous answer without the checks that have no answer with the checks.

mod entry;
mod reactions;
mod reasons;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use standstill_campaign::{Estimate, Statistics, in_parallel, one_sided_bounds};
use standstill_detect::Method;
use standstill_interface::{Fault, Outcome};
use standstill_numeric::{ln, ln_1p, whole};
use standstill_quantity::Quantity;
use standstill_scenario::{FileError, Plan, Record, Scenario, ScenarioFile, Verdict};
use standstill_sim::{Ended, RunError};

pub use self::entry::{Begins, Entry};
pub use self::reactions::Reactions;
use self::reactions::onset;
pub use self::reasons::reasons_that_name;
use crate::{Demands, Halt, Watch};
use standstill_odds::kept;

/// Number of trials that a thread runs at a time.
const AT_ONCE: u64 = 64;

/// Largest error, movement and current of an acceptable simulated motor start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowed {
    /// Largest error of the angle in degrees.
    pub error_deg: f64,
    /// Largest movement of the rotor in electrical degrees.
    pub moved_deg: f64,
    /// Largest phase current in A.
    pub current: f64,
}

impl Allowed {
    /// Makes the limits for a scenario. The error is limited by the scenario's `limit`, or to 2° if the scenario has none. The movement is
    /// limited as in `check`. The current is limited to the rated current.
    pub fn of(file: &ScenarioFile, scenario: &Scenario<Method<f64>>) -> Self {
        Self {
            error_deg: file.limit.map_or(Statistics::LIMIT_DEG, Quantity::value),
            moved_deg: Demands::DEFAULT.movement_deg,
            current: scenario.motor.rated_current,
        }
    }

    /// Returns the error in degrees of a dangerous answer, which has the wrong pole or is beyond the allowed error. None if the start has
    /// no dangerous answer.
    pub(crate) fn danger(&self, record: &Record) -> Option<f64> {
        let miss = record.miss_deg()?;
        let wrong = record.pole_correct() == Some(false) || miss.abs() > self.error_deg;
        wrong.then_some(miss)
    }
}

/// Returns true if the drive's overcurrent trip ended the start.
fn has_tripped(record: &Record) -> bool {
    matches!(record.run.ended, Ended::Error(RunError::Overcurrent { .. }))
}

/// Returns true if the start ended without an answer, which shows that something is wrong. Returns false if the simulation could not
/// continue.
pub(crate) fn is_detected(record: &Record) -> bool {
    match record.verdict() {
        Verdict::Found => false,
        Verdict::Undetermined | Verdict::Failed => true,
        Verdict::Error => has_tripped(record),
    }
}

/// Returns the name of the check that ended a start without an answer. The check for a turning rotor has one name for both directions.
fn reason(record: &Record) -> String {
    match record.run.ended {
        _ if has_tripped(record) => "overcurrent".to_owned(),
        Ended::Outcome(Outcome::Failed { fault: Fault::RotorTurns { speed, allowed, .. }, .. }) => {
            Fault::RotorTurns { speed, allowed, way: None }.name().to_owned()
        }
        _ => record.reason_name().unwrap_or_default(),
    }
}

/// Returns the least number of starts without an event that shows, with 95 % confidence, that the event's probability is at most `most`. If
/// the event happens in none of n starts, the upper end of its one-sided 95 % interval is 1 − 0.05^(1/n).
///
/// ```
/// use standstill_analysis::faults::trials_that_show;
///
/// assert_eq!([1e-3, 0.5].map(trials_that_show), [2995, 5]);
/// ```
pub fn trials_that_show(most: f64) -> u64 {
    whole((ln(0.05) / ln_1p(-most)).ceil())
}

/// A start with a dangerous answer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Worst {
    /// Number of the trial.
    pub trial: u64,
    /// Signed error of the start's answer in degrees. The error of a sector is measured from the sector's border.
    pub error_deg: f64,
}

/// Numbers of simulated motor starts with one fault, by how they ended.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// Number of starts.
    pub trials: u64,
    /// Number of answers within the allowed error.
    pub right: u64,
    /// Number of answers with the right pole whose error is larger than allowed.
    pub beyond: u64,
    /// Number of answers with the wrong pole. They make the motor start backwards.
    pub wrong_pole: u64,
    /// Number of starts without an answer, for each reason.
    pub unanswered: BTreeMap<String, u64>,
    /// Number of starts without an answer in which the axis was found but not the pole.
    pub undetermined: u64,
    /// Number of starts that the simulation could not complete. They count neither as answered nor as detected.
    pub errors: u64,
    /// Number of starts whose rotor moved more than allowed.
    pub moved: u64,
    /// Number of starts in which the current exceeded the allowed current or the drive tripped.
    pub overcurrent: u64,
    /// Number of starts that are dangerous with the method's checks off: their answer is beyond the allowed error or has the wrong pole.
    pub dangerous: u64,
    /// Number of dangerous starts that end without an answer when the method's checks are on.
    pub caught: u64,
    /// Times from the onset of the fault to the end of the starts without an answer.
    pub reactions: Reactions,
    /// Number of starts that end without an answer even with the method's checks off.
    pub refused_without: u64,
    /// The dangerous answer with the largest error.
    pub worst: Option<Worst>,
}

impl Counts {
    /// Returns the number of starts without an answer, in which the fault is detected.
    pub fn detected(&self) -> u64 {
        self.unanswered.values().sum()
    }

    /// Returns the number of starts with a dangerous answer even with the method's checks on.
    pub const fn undetected(&self) -> u64 {
        self.wrong_pole + self.beyond
    }

    /// Returns the upper end of the one-sided 95 % interval of the probability of a dangerous answer.
    pub fn undetected_bound(&self) -> f64 {
        one_sided_bounds(self.undetected(), self.trials)[1]
    }

    /// Returns the upper end of the one-sided 95 % interval of the probability of a wrong pole.
    pub fn wrong_pole_bound(&self) -> f64 {
        one_sided_bounds(self.wrong_pole, self.trials)[1]
    }

    /// Returns the share of dangerous starts that the checks catch, with the lower end of its one-sided 95 % interval. None if no start is
    /// dangerous.
    pub fn coverage(&self) -> Option<Estimate> {
        let value = (self.dangerous > 0).then(|| self.caught as f64 / self.dangerous as f64)?;
        let [low, _] = one_sided_bounds(self.caught, self.dangerous);
        Some(Estimate { value, low, high: 1.0 })
    }

    /// Returns the share of starts without an answer among the starts that the fault harms, with the lower end of its one-sided 95 %
    /// interval. The fault harms starts without an answer and starts with a dangerous answer despite the checks. None if it harms no start.
    /// Unlike [`coverage`](Self::coverage), this share includes starts that a method refuses even with its checks off.
    pub fn refused_share(&self) -> Option<Estimate> {
        let harmed = self.detected() + self.undetected();
        let value = (harmed > 0).then(|| self.detected() as f64 / harmed as f64)?;
        let [low, _] = one_sided_bounds(self.detected(), harmed);
        Some(Estimate { value, low, high: 1.0 })
    }

    /// Returns the number of starts without an answer for one of these reasons.
    pub fn ended_by(&self, reasons: &[&str]) -> u64 {
        self.unanswered.iter().filter(|(reason, _)| reasons.contains(&reason.as_str())).map(|(_, n)| n).sum()
    }

    /// Adds a start. `with` is the start's record with the method's checks on. `without` is its record with the checks off, if that trial
    /// was run. `onset` is the time in s at which the fault begins, if it is known.
    fn add(&mut self, with: &Record, without: Option<&Record>, allowed: Allowed, onset: Option<f64>) {
        self.trials += 1;
        let tripped = has_tripped(with);
        self.overcurrent += u64::from(tripped || with.run.peak_current > allowed.current);
        self.moved += u64::from(with.rotor_moved_deg() > allowed.moved_deg);
        let danger = |record: &Record| allowed.danger(record);
        let (answered, detected) = (with.verdict() == Verdict::Found, is_detected(with));
        self.errors += u64::from(!answered && !detected);
        if detected {
            *self.unanswered.entry(reason(with)).or_default() += 1;
            self.undetermined += u64::from(with.verdict() == Verdict::Undetermined);
            if let Some(onset) = onset {
                self.reactions.add(onset, with.run.duration.seconds());
            }
        }
        self.refused_without += u64::from(without.is_some_and(is_detected));
        if without.and_then(danger).is_some() {
            self.dangerous += 1;
            self.caught += u64::from(detected);
        }
        match danger(with) {
            Some(miss) => {
                if with.pole_correct() == Some(false) {
                    self.wrong_pole += 1;
                } else {
                    self.beyond += 1;
                }
                if self.worst.is_none_or(|worst| miss.abs() > worst.error_deg.abs()) {
                    self.worst = Some(Worst { trial: with.trial, error_deg: miss });
                }
            }
            None if answered => self.right += 1,
            None => {}
        }
    }

    fn join(mut self, other: Self) -> Self {
        self.trials += other.trials;
        self.right += other.right;
        self.undetermined += other.undetermined;
        self.errors += other.errors;
        self.beyond += other.beyond;
        self.wrong_pole += other.wrong_pole;
        self.moved += other.moved;
        self.overcurrent += other.overcurrent;
        self.dangerous += other.dangerous;
        self.caught += other.caught;
        self.reactions = self.reactions.join(other.reactions);
        self.refused_without += other.refused_without;
        for (reason, count) in other.unanswered {
            *self.unanswered.entry(reason).or_default() += count;
        }
        let larger = |of: &Worst| of.error_deg.abs();
        self.worst = match (self.worst, other.worst) {
            (Some(a), Some(b)) => Some(if larger(&b) > larger(&a) { b } else { a }),
            (a, b) => a.or(b),
        };
        self
    }
}

/// Key that switches the checks of a method on or off.
pub const CHECKS: &str = "detector.checks";

/// Runs the trials of a fault with the method's checks on. If there is a plan `without` checks, runs the same trials with the checks off
/// too. An interrupted study keeps its counts under the key `name`.
///
/// # Errors
/// A trial cannot be run, or the computation was interrupted.
pub fn study(
    name: &str,
    (plan, without): (&Plan, Option<&Plan>),
    trials: u64,
    allowed: Allowed,
    watch: &dyn Watch,
) -> Result<Counts, Halt<FileError>> {
    kept(
        watch,
        &format!("{name} {trials} {allowed:?}, from the onset"),
        |counts: &Counts| counts.trials,
        || {
            let scenario = plan.scenario(0)?;
            let counts = in_blocks((plan, without), 0..trials, AT_ONCE, watch, |with, alone| {
                let mut counts = Counts::default();
                for (k, with) in with.iter().enumerate() {
                    counts.add(with, alone.get(k), allowed, onset(&scenario, with.trial));
                }
                counts
            })?;
            Ok(counts.into_iter().fold(Counts::default(), Counts::join))
        },
    )
}

/// Runs trials of a plan in parallel, `at_once` at a time. If there is a plan `without` checks, runs the same trials of it, too. Calls
/// `of` for each block with the records of both plans, in the order of the trials, and returns its results. The second list is empty if
/// there is no second plan.
///
/// # Errors
/// A trial cannot be run, or the computation was interrupted.
pub(crate) fn in_blocks<T: Send>(
    (plan, without): (&Plan, Option<&Plan>),
    trials: Range<u64>,
    at_once: u64,
    watch: &dyn Watch,
    of: impl Fn(Vec<Record>, Vec<Record>) -> T + Sync,
) -> Result<Vec<T>, Halt<FileError>> {
    let scenario = plan.scenario(0)?;
    let unchecked = without.map(|plan| plan.scenario(0).map(|scenario| (plan, scenario))).transpose()?;
    let block = |number: u64| {
        if watch.stopped() {
            return Err(Halt::Stopped);
        }
        let from = trials.start + number * at_once;
        let numbers = from..trials.end.min(from + at_once);
        let with = records(plan, &scenario, numbers.clone())?;
        let alone = match &unchecked {
            Some((plan, scenario)) => records(plan, scenario, numbers)?,
            None => Vec::new(),
        };
        watch.did(with.len() as u64);
        Ok(of(with, alone))
    };
    in_parallel((0..(trials.end - trials.start).div_ceil(at_once)).collect(), &block)
}

/// Returns the records of these trials at the first point of a plan, in the order of the trials.
pub(crate) fn records(
    plan: &Plan,
    scenario: &Scenario<Method<f64>>,
    mut numbers: Range<u64>,
) -> Result<Vec<Record>, Halt<FileError>> {
    let mut records = Vec::new();
    let trials = plan.trials(0, scenario, &mut numbers, &mut |record| records.push(record));
    trials.map_err(|failed| Halt::Failed(failed.error))?;
    records.sort_by_key(|record| record.trial);
    Ok(records)
}

/// Returns the duration in s of trial 0 of a plan.
///
/// # Errors
/// The trial cannot be run.
pub fn duration(plan: &Plan) -> Result<f64, FileError> {
    let scenario = plan.scenario(0)?;
    match records(plan, &scenario, 0..1) {
        Ok(records) => Ok(records.first().map_or(0.0, |record| record.run.duration.seconds())),
        Err(Halt::Failed(error)) => Err(error),
        // Cannot happen: nothing stops the trial.
        Err(Halt::Stopped) => Ok(0.0),
    }
}
