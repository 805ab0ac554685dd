//! Advice on each requirement: how to judge it again, which start to look at, and how many trials would decide it.

use std::path::Path;

use standstill_analysis::Effort;
use standstill_analysis::faults::Entry;
use standstill_analysis::qualify::{Case, Claim, Claimed, MOST_TRIALS, Verdict};
use standstill_quantity::count;
use standstill_report::page::Block;
use standstill_scenario::MotorSpec;

use super::words::Words;
use crate::commands::question::again;
use crate::shell::command_line::{quoted, set_pair};

impl Words<'_> {
    fn scenario(&self, of: &Case) -> String {
        let keys: String = of.options().iter().map(|pair| set_pair(pair)).collect();
        again(self.question) + &keys
    }

    /// Returns the command that evaluates a requirement again. `number` is the index of the requirement.
    pub fn repeats(&self, number: usize) -> String {
        let file = quoted(&self.requirements.to_string_lossy());
        let id = quoted(&self.requirement(number).id);
        let mut line = again(self.question);
        // The file of requirements follows that of the scenario.
        let scenario = quoted(&self.question.scenario.to_string_lossy());
        line.insert_str(scenario.len(), &format!(" {file}"));
        format!(
            "standstill qualify {line} --only {id} --no-witness --out qualify-{}",
            slug(&self.requirement(number).id)
        )
    }

    /// Returns advice on a requirement as a sentence, and the command to run if there is one.
    pub fn advice(&self, number: usize) -> (String, Option<String>) {
        let id = &self.requirement(number).id;
        let Some((of, claim)) = self.binding(number) else { return (String::new(), None) };
        match claim.verdict() {
            Verdict::Passed => (format!("{id} passed; to judge it again:"), Some(self.repeats(number))),
            Verdict::Failed => match claim.seen.worst {
                Some((trial, _)) if claim.rare.is_none() => {
                    // `trace` shows only trials that the scenario has, so the number of trials is raised if necessary.
                    let more = trial >= of.plan().file().trials;
                    let more = if more { format!(" -s trials={}", trial + 1) } else { String::new() };
                    let scenario = self.scenario(of);
                    let command =
                        format!("standstill trace {scenario}{more} --trial {trial} --out trace-{}", slug(id));
                    (format!("{id} failed; a start that counts against it:"), Some(command))
                }
                _ => {
                    let command = self.odds(of, claim, Effort::High);
                    (format!("{id} failed; to see what such a start looks like:"), command)
                }
            },
            Verdict::NotShown => self.open(id, of, claim),
        }
    }

    fn odds(&self, of: &Case, claim: &Claim, effort: Effort) -> Option<String> {
        let event = claim.rare.as_ref()?.event.to_string();
        let (scenario, effort) = (self.scenario(of), effort.name());
        Some(format!("standstill odds {scenario} --event {} --effort {effort}", quoted(&event)))
    }

    /// Returns the argument of `magnetics` that selects the motor of a case. This is the name or the file of the motor, or the scenario
    /// file if the scenario itself describes the motor.
    fn motor_file(&self, of: &Case) -> String {
        let scenario = &self.question.scenario;
        let MotorSpec::Named(name) = &of.plan().file().motor else {
            return scenario.to_string_lossy().into_owned();
        };
        // A motor given in place of a scenario is named as it was typed. A file that a scenario names lies in the scenario's folder.
        let is_file = Path::new(name).extension().is_some() && Path::new(name) != scenario;
        let folder = scenario.parent().filter(|_| is_file);
        folder.map_or_else(|| name.clone(), |folder| folder.join(name).to_string_lossy().into_owned())
    }

    /// Returns advice on a requirement that neither passed nor failed.
    fn open(&self, id: &str, of: &Case, claim: &Claim) -> (String, Option<String>) {
        if claim.open.is_some() {
            let command = format!("standstill magnetics {}", quoted(&self.motor_file(of)));
            return (
                format!(
                    "{id} is not shown, because the motor's data leave its poles open; measure which pole draws more current:"
                ),
                Some(command),
            );
        }
        if matches!(claim.claimed, Claimed::Undetected(_)) && claim.seen.of == 0 {
            let mode = of.fault.as_ref().and_then(Entry::single).map_or("MODE", |mode| mode.name());
            let text = format!(
                "{id} is not shown: of {} starts none is dangerous even without the checks, so nothing is there to cover; require \
                 `faults.{mode}: P(wrong_pole) <= 0.1 %` in its place",
                claim.trials
            );
            return (text, None);
        }
        let [_, starts] = claim.counts();
        let trials = if matches!(claim.claimed, Claimed::Undetected(_)) {
            claim.trials
        } else {
            starts.max(claim.trials)
        };
        let text = format!("{id} is not shown by {} trials; {}", count(trials), self.more(claim));
        let Some(rare) = &claim.rare else { return (text, None) };
        if rare.plain.is_some() {
            // Runs with more effort reach lower probabilities. They do not reach the event either, or they show that it is too frequent.
            return (
                format!("{text}; odds with more effort cannot pass it: the event is too rare for their runs"),
                None,
            );
        }
        let alarm = |alarm| format!("; odds have an alarm ({alarm}), with which nothing is passed");
        let alarm = rare.alarms.first().map_or_else(String::new, alarm);
        let file = self.requirements.display();
        match self.found.requirements.odds.and_then(Effort::deeper) {
            Some(deeper) => (
                format!(
                    "{text}{alarm}; odds with more effort (odds = \"{}\" in {file} judges by them):",
                    deeper.name()
                ),
                self.odds(of, claim, deeper),
            ),
            None => (format!("{text}{alarm}"), None),
        }
    }

    /// Returns the phrase on the number of trials that are needed to show that a claim holds.
    fn more(&self, claim: &Claim) -> String {
        match claim.trials_needed() {
            Some(needed) if needed <= MOST_TRIALS => {
                // A fifth more trials than suffice if the results continue as before.
                let trials = rounded_up(needed + needed / 5).min(MOST_TRIALS);
                let (needed, file) = (rounded_up(needed), self.requirements.display());
                format!(
                    "some {} would show it if they go on so: set trials = {trials} for it in {file}",
                    count(needed)
                )
            }
            Some(needed) => {
                let asked = claim.rare.is_some() || self.found.requirements.odds.is_some();
                let rest = if asked { "" } else { "; or set odds = \"normal\" there" };
                format!(
                    "it would take {}, and a requirement may have {}: state a weaker limit, or show it otherwise{rest}",
                    count(rounded_up(needed)),
                    count(MOST_TRIALS)
                )
            }
            None => {
                "what was seen is not below its limit: more trials would rather show that it fails".to_owned()
            }
        }
    }

    /// Returns blocks with advice on the requirements that did not pass, and on how to evaluate a requirement again.
    pub fn next(&self) -> Vec<Block> {
        let passed = |number: &usize| self.found.verdict(*number) == Verdict::Passed;
        let mut blocks = Vec::new();
        for number in self.asked.iter().filter(|number| !passed(number)) {
            let (text, command) = self.advice(*number);
            blocks.push(Block::Text(text));
            blocks.extend(command.map(code));
        }
        // The first requirement with the worst verdict. If the user asked about a single requirement, its command is already above.
        let worst = self.asked.iter().rev().max_by_key(|number| self.found.verdict(**number));
        if let Some(number) = worst.filter(|_| self.asked.len() > 1) {
            blocks.push(Block::Text("To judge one requirement again, as in the list:".to_owned()));
            blocks.push(code(self.repeats(*number)));
        }
        blocks
    }
}

/// Rounds a number of trials up to two digits.
fn rounded_up(trials: u64) -> u64 {
    let unit = 10_u64.pow(trials.max(1).ilog10().saturating_sub(1));
    trials.div_ceil(unit) * unit
}

fn code(command: String) -> Block {
    Block::Code { caption: String::new(), text: command + "\n" }
}

/// Converts the id of a requirement to a text that is valid in a folder's name.
fn slug(id: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '-' };
    id.chars().map(plain).take(40).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_numbers_of_trials_are_rounded_up_to_two_digits() {
        assert_eq!(
            [0, 7, 99, 101, 6_164_480, 7_300_000].map(rounded_up),
            [0, 7, 99, 110, 6_200_000, 7_300_000]
        );
        assert_eq!(slug("POLE <&1"), "POLE---1");
    }
}
