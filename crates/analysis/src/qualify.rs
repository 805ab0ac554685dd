//! Qualification: whether a list of requirements is met, each passed, failed or not shown.
//!
//! Each requirement makes a claim on a probability or a mean in each case for which it is judged: a combination of motor, temperatures,
//! error set and fault. Claims are tested by sequential tests ([`sequential`]), which may stop after any number of trials, so that trials
//! end as soon as all claims are decided. The probability of error of the whole list is split evenly over all claims. Rare events that
//! plain trials do not decide are left to subset simulation ([`rare`]), whose interval is an estimate, not a proof.

mod claim;
mod demand;
mod list;
mod not_modelled;
pub mod rare;
pub mod sequential;

use standstill_numeric::whole;
use standstill_odds::kept;
use standstill_plant::Entry as SheetEntry;
use standstill_scenario::{Document, FaultMode, FileError, Note, Plan};
use toml::Value;

pub use self::claim::{Claim, Claimed, Seen, Verdict};
pub use self::demand::{Bad, Current, Demand, LimitedMeasure};
pub use self::list::{MOST_TRIALS, Requirement, Requirements};
pub use self::not_modelled::NOT_MODELLED;
use crate::faults::{Allowed, Entry, in_blocks};
use crate::{Halt, Watch};

/// Number of trials after which the claims are tested for the first time.
const FIRST: u64 = 64;
/// Factor by which the number of trials grows from one test of the claims to the next.
const MORE: f64 = 1.25;

/// Number of trials that a thread runs at a time.
const AT_ONCE: u64 = 64;

/// A combination of settings, with or without a fault, for which requirements are judged. All claims of a case are judged by the same
/// trials.
#[derive(Clone, Debug)]
pub struct Case {
    /// Keys of the scenario that the requirements set, with their values.
    pub settings: Vec<(String, Value)>,
    /// The fault in the drive; none for a drive without a fault.
    pub fault: Option<Entry>,
    /// Name of the motor.
    pub motor: String,
    /// Values that the motor's data sheet marks as assumed.
    pub assumed: Vec<SheetEntry>,
    /// The claims that the requirements make in this case.
    pub claims: Vec<Claim>,
    plan: Plan,
    /// The plan with the method's checks off. None for a drive without a fault, or for a method without checks.
    without: Option<Plan>,
    /// Rated current of the motor in A.
    rated: f64,
    /// Limits beyond which an answer is dangerous.
    allowed: Allowed,
}

impl Case {
    /// Returns true if the case has these settings and this fault.
    fn is(&self, settings: &[(String, Value)], fault: Option<FaultMode>) -> bool {
        self.settings == settings && self.fault.as_ref().and_then(Entry::single) == fault
    }

    /// Adds the claims of a requirement to the case. `number` is the index of the requirement. `unanswered` is the largest share of starts
    /// without an answer. It limits this share for requirements that a method could meet by giving no answers.
    fn claim(&mut self, number: usize, requirement: &Requirement, unanswered: f64) {
        let demand = requirement.demand;
        let claimed = match demand.what {
            LimitedMeasure::Rms(most) => Claimed::Rms(most),
            LimitedMeasure::Share { bad, or_unanswered, most } => Claimed::Share(bad, or_unanswered, most),
            LimitedMeasure::Coverage(least) => Claimed::Undetected(1.0 - least),
        };
        let about_poles = matches!(
            claimed,
            Claimed::Undetected(_) | Claimed::Share(Bad::WrongPole | Bad::Angle(_) | Bad::WrongSector, ..)
        );
        let open = self.plan.note(Note::Poles).filter(|_| about_poles && self.plan.pole_is_open());
        let claim = |claimed, guards| Claim {
            requirement: number,
            claimed,
            guards,
            most: requirement.trials,
            alpha: f64::NAN,
            seen: Seen::default(),
            trials: 0,
            plain: Verdict::NotShown,
            rare: None,
            open: open.clone(),
        };
        self.claims.push(claim(claimed, false));
        if demand.is_guarded() {
            self.claims.push(claim(Claimed::Share(Bad::Unanswered, false, unanswered), true));
        }
    }

    /// Returns the command-line options that put the case's settings and fault into a scenario.
    pub fn options(&self) -> Vec<String> {
        let is_of_entry =
            |key: &String| self.fault.iter().any(|entry| entry.keys.iter().any(|(of, _)| of == key));
        let settings: Vec<_> = self.settings.iter().filter(|(key, _)| !is_of_entry(key)).cloned().collect();
        texts(&settings).into_iter().chain(self.fault.iter().flat_map(Entry::arguments)).collect()
    }

    /// Returns a text that states when an answer is dangerous.
    pub fn danger(&self) -> String {
        let half = self.plan.scenario(0).ok().and_then(|scenario| scenario.detector.half_sector());
        let what = if half.is_some() { "beyond the sector" } else { "off" };
        format!("more than {}° {what}, or with the wrong pole", self.allowed.error_deg)
    }

    /// Returns the case's plan.
    pub const fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Runs trials until each claim is decided or has reached its largest number of trials. Only claims of the requirements that `is_asked`
    /// selects count.
    fn judge(&mut self, watch: &dyn Watch, is_asked: &dyn Fn(usize) -> bool) -> Result<(), Halt<FileError>> {
        let mut most: Vec<u64> = self.claims.iter().map(|claim| claim.most).collect();
        most.sort_unstable();
        let (mut done, mut look) = (0, 0);
        loop {
            let open = |claim: &Claim| claim.is_open() && is_asked(claim.requirement);
            if !self.claims.iter().any(open) {
                return Ok(());
            }
            // The numbers of trials at which claims are tested depend neither on other claims nor on the requirements selected.
            look = if done < look { look } else { next(look) };
            let limit = most.iter().copied().find(|most| *most > done).unwrap_or(look);
            let to = look.min(limit);
            let part = self.part(done..to, watch)?;
            done = to;
            for (claim, seen) in self.claims.iter_mut().zip(part) {
                if claim.plain == Verdict::NotShown && claim.trials < claim.most {
                    claim.seen.join(seen);
                    claim.trials = done;
                    if done == look || done == claim.most {
                        claim.look();
                    }
                }
            }
        }
    }

    /// Runs these trials, or reads their stored results. Returns one result for each claim.
    fn part(&self, trials: std::ops::Range<u64>, watch: &dyn Watch) -> Result<Vec<Seen>, Halt<FileError>> {
        let claims: Vec<Claimed> = self.claims.iter().map(|claim| claim.claimed).collect();
        let key = format!("{} trials {trials:?}: {claims:?}", self.options().join(" "));
        let count = trials.end - trials.start;
        kept(
            watch,
            &key,
            |_| count,
            || {
                // Only a coverage needs the same starts without checks.
                let covers = claims.iter().any(|claimed| matches!(claimed, Claimed::Undetected(_)));
                let plans = (&self.plan, self.without.as_ref().filter(|_| covers));
                let parts = in_blocks(plans, trials, AT_ONCE, watch, |with, alone| {
                    let mut seen = vec![Seen::default(); claims.len()];
                    for (k, record) in with.iter().enumerate() {
                        for (seen, claimed) in seen.iter_mut().zip(&claims) {
                            seen.add(*claimed, record, alone.get(k), self);
                        }
                    }
                    seen
                })?;
                let mut all = vec![Seen::default(); claims.len()];
                for part in parts {
                    for (all, seen) in all.iter_mut().zip(part) {
                        all.join(seen);
                    }
                }
                Ok(all)
            },
        )
    }
}

/// Returns the settings as command-line arguments of the form `key=value`.
fn texts(settings: &[(String, Value)]) -> Vec<String> {
    let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    settings.iter().map(|(key, value)| format!("{key}={}", text(value))).collect()
}

/// Returns the number of trials that the file gives. It is an error if the number is out of range.
fn trials(document: &Document, key: &str, given: Option<u64>) -> Result<Option<u64>, FileError> {
    match given {
        Some(trials) if !(list::FEWEST..=MOST_TRIALS).contains(&trials) => Err(document.refuse(
            key,
            &trials.to_string(),
            &format!("a whole number from {} to {MOST_TRIALS}", list::FEWEST),
        )),
        given => Ok(given),
    }
}

/// Returns true for a key of the fault with this number, such as `faults.0.onset`.
fn is_of_fault(key: &str, number: usize) -> bool {
    key.strip_prefix("faults.")
        .and_then(|rest| rest.split_once('.'))
        .is_some_and(|(n, _)| n == number.to_string())
}

/// Returns the number of trials at the next test of the claims. `look` is the number of trials at the last test.
fn next(look: u64) -> u64 {
    whole::<u64>(look as f64 * MORE).max(FIRST)
}

/// Requirements on a scenario, and the results of their trials.
#[derive(Clone, Debug)]
pub struct Qualification {
    /// The requirements.
    pub requirements: Requirements,
    /// The cases in which the requirements are judged.
    pub cases: Vec<Case>,
}

impl Qualification {
    /// Makes the cases of the requirements for a scenario. All errors in the cases are found here, before the first trial.
    ///
    /// # Errors
    /// Values make no valid scenario, or a limit does not apply to the method or drive; the error names the line of the
    /// requirement.
    pub fn new(requirements: Requirements, plan: &Plan, document: &Document) -> Result<Self, FileError> {
        let cases = requirements.cases(plan, document)?;
        Ok(Self { requirements, cases })
    }

    /// Judges the requirements whose indices `is_asked` selects, case by case. Before each case, calls `hear` with the number of finished
    /// cases.
    ///
    /// # Errors
    /// A trial cannot be run, or the computation was interrupted.
    pub fn judge(
        &mut self,
        watch: &dyn Watch,
        is_asked: &(dyn Fn(usize) -> bool + Sync),
        mut hear: impl FnMut(&Self, usize),
    ) -> Result<(), Halt<FileError>> {
        for number in 0..self.cases.len() {
            hear(self, number);
            self.cases[number].judge(watch, is_asked)?;
            if let Some(effort) = self.requirements.odds {
                // Odds do not change the verdict on a requirement that failed by trials.
                let count = self.requirements.list.len();
                let failed: Vec<bool> = (0..count).map(|of| self.verdict(of) == Verdict::Failed).collect();
                let is_open = |of: usize| is_asked(of) && !failed[of];
                rare::decide(&mut self.cases[number], &self.requirements, effort, watch, &is_open)?;
            }
        }
        Ok(())
    }

    /// Returns the claims of the requirement with this index. Each claim comes with its case.
    pub fn claims(&self, requirement: usize) -> impl Iterator<Item = (&Case, &Claim)> {
        let of = move |claim: &&Claim| claim.requirement == requirement;
        self.cases.iter().flat_map(move |case| case.claims.iter().filter(of).map(move |claim| (case, claim)))
    }

    /// Returns the verdict on the requirement with this index. It is failed if one of the requirement's claims failed, passed if all of
    /// them passed, and not shown otherwise.
    pub fn verdict(&self, requirement: usize) -> Verdict {
        self.claims(requirement).map(|(_, claim)| claim.verdict()).max().unwrap_or(Verdict::NotShown)
    }

    /// Returns the number of all claims. The probability of error is divided by this number.
    pub fn count(&self) -> usize {
        self.cases.iter().map(|case| case.claims.len()).sum()
    }
}

#[cfg(test)]
mod tests;
