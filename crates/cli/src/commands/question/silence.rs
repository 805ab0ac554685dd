//! Starts without an answer: their number, their reasons, and the command to continue with.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Value, json};
use standstill_analysis::{Answers, Halt, Source, Trials, Watch};
use standstill_quantity::count;
use standstill_scenario::{FileError, Plan, Rotor, ScenarioFile};

use super::{again, given};
use crate::answer::{Answer, Next};
use crate::arguments::{Keys, Question, Seed};
use crate::shell::host;
use crate::summary::FAILING;

/// Number of trials of the unchanged scenario that are run to count starts with an answer.
pub const STARTS: u64 = 1000;

/// Largest number of reasons for missing answers that a sentence lists.
const NAMED: usize = 3;

/// The result that a start must have to count as a start with an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    Axis,
    Angle,
}

/// Numbers of starts with and without an answer, from trials of the unchanged scenario.
#[derive(Clone, Debug)]
pub struct Silence {
    pub answers: Answers,
    pub needs: Needs,
}

impl Silence {
    /// Runs trials of the unchanged scenario and counts the starts that found an axis.
    pub fn of_axes(plan: &Plan, watch: &dyn Watch) -> Result<Self, Halt<FileError>> {
        Ok(Self { answers: Answers::of(plan, STARTS, watch)?, needs: Needs::Axis })
    }

    /// Runs trials of the unchanged scenario and counts the starts that found an angle.
    pub fn of_angles(plan: &Plan, watch: &dyn Watch) -> Result<Self, Halt<FileError>> {
        Ok(Self { needs: Needs::Angle, ..Self::of_axes(plan, watch)? })
    }

    /// Returns true if fewer than half of the starts have an axis. The error of so few starts cannot be divided among its sources.
    pub fn is_mostly_silent(&self) -> bool {
        2 * self.answers.with_axis() < self.answers.starts
    }

    /// Returns the number of starts with an answer.
    pub fn answered(&self) -> u64 {
        match self.needs {
            Needs::Axis => self.answers.with_axis(),
            Needs::Angle => self.answers.with_angle(),
        }
    }

    fn without(&self) -> u64 {
        self.answers.starts - self.answered()
    }

    /// Returns true if more starts have no answer than `check` allows by default.
    pub fn is_frequent(&self) -> bool {
        self.without() as f64 > FAILING * self.answers.starts as f64
    }

    /// Returns the number of starts without an answer, in words.
    pub fn counted(&self) -> String {
        let (starts, what) = (count(self.answers.starts), self.what());
        match (self.answered(), self.without()) {
            (0, _) => format!("none of {starts} plain starts has {what}"),
            (_, 0) => format!("each of {starts} plain starts has {what}"),
            (_, 1) => format!("1 of {starts} plain starts has no {}", bare(what)),
            (_, without) => format!("{} of {starts} plain starts have no {}", count(without), bare(what)),
        }
    }

    /// Returns a sentence with the number of starts without an answer and with their reasons. The most frequent reason comes first.
    pub fn sentence(&self) -> String {
        let reasons = self.reasons();
        match reasons.split_at(reasons.len().min(NAMED)) {
            ([], _) => self.counted(),
            ([(reason, _)], _) => format!("{}: {reason}", self.counted()),
            (first, others) => {
                let named: Vec<String> =
                    first.iter().map(|(reason, of)| format!("{reason} in {}", count(*of))).collect();
                let others = match others.iter().map(|(_, of)| of).sum::<u64>() {
                    0 => String::new(),
                    of => format!(", other reasons in {}", count(of)),
                };
                format!("{}: {}{others}", self.counted(), named.join(", "))
            }
        }
    }

    /// Returns each reason for a missing answer with its number of starts. The most frequent reason comes first.
    fn reasons(&self) -> Vec<(&str, u64)> {
        let of_poles = (self.needs == Needs::Angle).then_some(&self.answers.without_pole);
        let mut all: BTreeMap<&str, u64> = BTreeMap::new();
        for (reason, count) in std::iter::once(&self.answers.without_axis).chain(of_poles).flatten() {
            *all.entry(reason).or_default() += count;
        }
        let mut all: Vec<_> = all.into_iter().collect();
        all.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        all
    }

    const fn what(&self) -> &'static str {
        match self.needs {
            Needs::Axis => "an axis",
            Needs::Angle => "an answer",
        }
    }

    pub fn json(&self) -> Value {
        let answers = &self.answers;
        json!({
            "starts": answers.starts,
            "with_axis": answers.with_axis(),
            "with_angle": answers.with_angle(),
            "without_axis": answers.without_axis,
            "without_pole": answers.without_pole,
        })
    }
}

/// Returns a noun without its article.
fn bare(noun: &str) -> &str {
    noun.split_once(' ').map_or(noun, |(_, noun)| noun)
}

/// Adds the command that [`next`] returns as the first of an answer's commands.
pub fn lead(mut answer: Answer, question: &Question, file: &ScenarioFile) -> Answer {
    answer.next.insert(0, next(&question.scenario, &question.keys, question.seed, file));
    answer
}

/// Adds the commands to continue with if nothing meets the limits. The first is `check`, if too many starts have no answer. The next is
/// `budget`, if most starts have an axis and the scenario has random errors.
///
/// # Errors
/// The plan has no valid scenario.
pub fn or_budget(
    mut answer: Answer,
    question: &Question,
    plan: &Plan,
    starts: &Silence,
) -> Result<Answer, FileError> {
    let has_errors = !Source::all(&Trials::new(plan)?).is_empty();
    if has_errors && !starts.is_mostly_silent() {
        let command = format!("standstill budget {}", again(question));
        answer = answer.next("which part of the drive makes the error", command);
    }
    Ok(if starts.is_frequent() { lead(answer, question, plan.file()) } else { answer })
}

/// Returns the command to continue with if starts have no answer: `check`, which tries other settings. If `check` does not judge such a
/// scenario, returns `run`, which gives the reasons.
pub fn next(scenario: &Path, keys: &Keys, seed: Seed, file: &ScenarioFile) -> Next {
    let check = check_command(scenario, keys, seed, file);
    let run = || {
        let again = given(&scenario.to_string_lossy(), keys, seed);
        ("why starts have no answer", format!("standstill run {again}"))
    };
    let (purpose, command) = check.map_or_else(run, |check| ("whether other settings answer", check));
    Next { purpose: purpose.to_owned(), command }
}

/// Returns the `check` command that searches for a method and settings with which starts have an answer. None for a scenario with a fault,
/// sweep axes, a driven rotor or the user's own detector, which `check` does not judge.
pub fn check_command(scenario: &Path, keys: &Keys, seed: Seed, file: &ScenarioFile) -> Option<String> {
    let has_own = file.detector.library.is_some() || host::current().is_some();
    if has_own || !file.faults.is_empty() || !file.axes.is_empty() || file.rotor.state() == Rotor::Driven {
        return None;
    }
    // `check` does not search settings that are given, so the detector's settings are left out.
    let set = keys.set.iter().filter(|(key, _)| !key.starts_with("detector.")).cloned().collect();
    let keys = Keys { set, detector: None };
    Some(format!("standstill check {}", given(&scenario.to_string_lossy(), &keys, seed)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn silence(needs: Needs, without_axis: &[(&str, u64)], without_pole: &[(&str, u64)]) -> Silence {
        let reasons = |of: &[(&str, u64)]| of.iter().map(|(reason, n)| ((*reason).to_owned(), *n)).collect();
        let answers = Answers {
            starts: 1000,
            without_axis: reasons(without_axis),
            without_pole: reasons(without_pole),
        };
        Silence { answers, needs }
    }

    #[test]
    fn law_starts_without_an_answer_are_counted_by_what_the_question_needs() {
        let of = |needs| silence(needs, &[("no saliency", 20)], &[("pole open", 300)]);
        let (angle, axis) = (of(Needs::Angle), of(Needs::Axis));
        assert_eq!((angle.answered(), axis.answered()), (680, 980));
        assert_eq!(
            angle.sentence(),
            "320 of 1000 plain starts have no answer: pole open in 300, no saliency in 20"
        );
        assert_eq!(axis.sentence(), "20 of 1000 plain starts have no axis: no saliency");
        assert!(angle.is_frequent() && axis.is_frequent());
        assert_eq!(angle.json()["without_pole"]["pole open"], 300);
    }

    #[test]
    fn law_none_one_and_all_have_words_of_their_own() {
        let said = |without: &[(&str, u64)]| silence(Needs::Angle, without, &[]).sentence();
        assert_eq!(said(&[]), "each of 1000 plain starts has an answer");
        assert_eq!(said(&[("clipped", 1)]), "1 of 1000 plain starts has no answer: clipped");
        assert_eq!(said(&[("clipped", 1000)]), "none of 1000 plain starts has an answer: clipped");
        let many = said(&[("a", 1), ("b", 5), ("c", 4), ("d", 3)]);
        assert_eq!(
            many,
            "13 of 1000 plain starts have no answer: b in 5, c in 4, d in 3, other reasons in 1"
        );
        assert!(!silence(Needs::Angle, &[("a", 10)], &[]).is_frequent());
        assert!(silence(Needs::Angle, &[("a", 11)], &[]).is_frequent());
    }
}
