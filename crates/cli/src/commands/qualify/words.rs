//! Text on each requirement of a qualification.

use std::path::Path;

use serde_json::{Value, json};
use standstill_analysis::faults::Entry;
use standstill_analysis::qualify::{Case, Claim, Claimed, Qualification, Requirement, Verdict};
use standstill_analysis::witness::Witness;
use standstill_quantity::{count, magnitude};
use standstill_report::page::Sheet;

use crate::answer::{Record, Records};
use crate::arguments::Question;

/// The results of a qualification, and the requirements for which the user wants them.
pub struct Words<'a> {
    pub found: &'a Qualification,
    /// Indices of the requirements for which the user wants the results.
    pub asked: &'a [usize],
    pub question: &'a Question,
    /// Path of the file of requirements.
    pub requirements: &'a Path,
    /// Witnesses that fail on this machine. A witness is a computation with a known result. If a witness fails, the qualification fails,
    /// too.
    pub silent: Vec<&'a Witness>,
}

/// Describes a case in words: the scenario keys that it sets, and its fault.
pub fn case(case: &Case) -> String {
    let text = |value: &toml::Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    let settings = case.settings.iter().map(|(key, value)| format!("{key}={}", text(value)));
    let fault = case.fault.as_ref().and_then(Entry::single).map(|mode| format!("fault {}", mode.name()));
    let all: Vec<String> = settings.chain(fault).collect();
    if all.is_empty() { "the scenario".to_owned() } else { all.join(", ") }
}

/// Formats a share with three digits. The text is in per cent unless the share is tiny.
pub fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent > 0.0 && percent < 0.01 {
        return format!("{share:.1e}");
    }
    // Near 100 % the shortfall keeps its digits, and no bound is rounded up.
    let near = percent > 99.0 && percent < 100.0;
    let digits = if near { magnitude(100.0 - percent) } else { magnitude(percent) };
    let decimals = digits.map_or(0, |power| usize::try_from(2 - power).unwrap_or(0));
    let shown = if near {
        let scale = (0..decimals).fold(1.0, |scale, _| 10.0 * scale);
        // The small term allows for the rounding error of the product.
        (percent * scale + 1e-6).floor() / scale
    } else {
        percent
    };
    format!("{shown:.decimals$} %")
}

#[cfg(test)]
#[test]
fn law_shares_keep_three_digits_at_both_ends_and_no_bound_is_rounded_to_the_whole() {
    for (share, text) in [
        (1.0, "100 %"),
        (0.9997, "99.9700 %"),
        (0.999_995, "99.999500 %"),
        (0.999_999_6, "99.9999600 %"),
        (0.5, "50.0 %"),
        (0.0123, "1.23 %"),
        (3e-6, "3.0e-6"),
        (0.0, "0 %"),
    ] {
        assert_eq!(percent(share), text);
    }
}

/// Formats an rms error in degrees with three digits.
fn degrees(value: f64) -> String {
    let decimals = magnitude(value).map_or(0, |power| usize::try_from(2 - power).unwrap_or(0).min(6));
    format!("{value:.decimals$}°")
}

/// Describes the result of a claim and its interval in words. A claim is the limit of a requirement in one case.
fn shown(of: &Case, claim: &Claim) -> String {
    let seen = &claim.seen;
    let [cases, starts] = claim.counts();
    let [value, low, high] = claim.interval();
    let text = match claim.claimed {
        Claimed::Rms(_) => {
            format!(
                "rms {} of {} starts, {} to {}",
                degrees(value),
                seen.squares.len(),
                degrees(low),
                degrees(high)
            )
        }
        Claimed::Share(bad, or_unanswered, _) => {
            let or = if or_unanswered { " or no answer" } else { "" };
            // The limit of a guard, a claim that few starts have no answer, is in no other cell of the row.
            let most =
                claim.guards.then(|| format!(", where {} may be (unanswered)", percent(claim.limit())));
            let (low, high) = (percent(low), percent(high));
            format!(
                "{bad}{or}: {} of {} starts, {low} to {high}{}",
                count(cases),
                count(starts),
                most.unwrap_or_default()
            )
        }
        Claimed::Undetected(_) if seen.of == 0 => {
            format!("without the method's checks no start is {}", of.danger())
        }
        Claimed::Undetected(_) => {
            let [least, most] = [percent(1.0 - high), percent(1.0 - low)];
            format!(
                "{} of {} dangerous starts detected, {least} to {most}; dangerous: without the method's checks {}",
                seen.of - seen.cases,
                seen.of,
                of.danger()
            )
        }
    };
    let Some(rare) = &claim.rare else { return text };
    if let Some([_, of]) = rare.plain {
        return format!("{text}; {of} of them are plain trials of odds, whose runs did not reach the event");
    }
    let [low, high] = rare.ends;
    let alarms: Vec<String> = rare.alarms.iter().map(|alarm| format!("; alarm: {alarm}")).collect();
    let odds = match rare.probability.value {
        0.0 => format!("at most {high:.1e}"),
        value => format!("{value:.1e} [{low:.1e}, {high:.1e}]"),
    };
    format!("{text}; odds: {odds}, an estimate{}", alarms.concat())
}

fn by(claim: &Claim) -> &'static str {
    let by_odds = claim.rare.as_ref().is_some_and(|rare| rare.plain.is_none());
    if by_odds { "odds" } else { "trials" }
}

impl Words<'_> {
    pub fn requirement(&self, number: usize) -> &Requirement {
        &self.found.requirements.list[number]
    }

    /// Returns the sentence on the probability that one or more verdicts are wrong.
    pub fn confidence(&self) -> String {
        let count = self.found.count();
        let whole = 1.0 - self.found.requirements.confidence;
        let split = if count == 1 {
            "of its one claim".to_owned()
        } else {
            format!("split evenly over {count} claims")
        };
        format!(
            "At most {} probability that any verdict by trials is wrong, {split}: each interval holds with {} \
             whenever its trials ended; odds are estimates outside of that bound",
            percent(whole),
            percent(1.0 - whole / count as f64),
        )
    }

    /// Returns the claim that decides a requirement. Among the claims with the worst verdict, it is the claim with the largest ratio of
    /// result to limit. The result is the estimate if the claim failed, otherwise the upper end of its interval. A guard is a claim that
    /// few starts have no answer. It decides only if no other claim has the worst verdict.
    pub fn binding(&self, number: usize) -> Option<(&Case, &Claim)> {
        let worst = self.found.verdict(number);
        let beyond = |claim: &Claim| {
            let [value, _, high] = claim.interval();
            (if worst == Verdict::Failed { value } else { high }) / claim.limit()
        };
        let all = self.found.claims(number).filter(|(_, claim)| claim.verdict() == worst);
        all.reduce(|a, b| {
            let is_worse = match (a.1.guards, b.1.guards) {
                (guards, other) if guards != other => guards,
                _ => beyond(b.1) > beyond(a.1),
            };
            if is_worse { b } else { a }
        })
    }

    /// Returns the phrase on the number of cases that have the same verdict as the requirement. None if the requirement has a single case.
    fn of_cases(&self, number: usize) -> Option<String> {
        let worst = self.found.verdict(number);
        let mut cases: Vec<(Vec<String>, Verdict)> = Vec::new();
        for (of, claim) in self.found.claims(number) {
            match cases.iter_mut().find(|(options, _)| *options == of.options()) {
                Some((_, verdict)) => *verdict = claim.verdict().max(*verdict),
                None => cases.push((of.options(), claim.verdict())),
            }
        }
        let count = cases.iter().filter(|(_, verdict)| *verdict == worst).count();
        (cases.len() > 1).then(|| format!("{count} of {} cases {}", cases.len(), worst.name()))
    }

    /// Returns the table row of a requirement.
    pub fn row(&self, number: usize) -> Vec<String> {
        let requirement = self.requirement(number);
        let (shown, trials) = self.evidence(number);
        let verdict = self.found.verdict(number).name().to_owned();
        vec![requirement.id.clone(), verdict, requirement.limit.clone(), shown, trials.to_string()]
    }

    /// Returns two values: the results that decide a requirement in words, and the number of trials of all its cases. This number includes
    /// the trials of `odds`.
    pub fn evidence(&self, number: usize) -> (String, u64) {
        let claims: Vec<_> = self.found.claims(number).collect();
        let trials =
            claims.iter().filter(|(_, claim)| !claim.guards).map(|(_, claim)| claim.trials).sum::<u64>();
        let odds: u64 =
            claims.iter().filter_map(|(_, claim)| claim.rare.as_ref()).map(|rare| rare.trials).sum();
        let Some((of, claim)) = self.binding(number) else { return (String::new(), trials) };
        let mut text = shown(of, claim);
        if !of.settings.is_empty() || of.fault.is_some() {
            text = format!("{}: {text}", case(of));
        }
        if let Some(open) = &claim.open {
            text = format!("{text}; {open}");
        }
        if let Some(cases) = self.of_cases(number) {
            let which =
                if claim.verdict() == Verdict::Failed { "the worst" } else { "the nearest to its limit" };
            text = format!("{cases}, {which}: {text}");
        }
        (text, trials + odds)
    }

    fn claim_json(of: &Case, claim: &Claim) -> Value {
        let [value, low, high] = claim.interval();
        let [cases, starts] = claim.counts();
        let odds = claim.rare.as_ref().map(|rare| {
            json!({
                "event": rare.event.to_string(),
                "probability": rare.probability.value, "low_95": rare.probability.low, "high_95": rare.probability.high,
                "low": rare.ends[0], "high": rare.ends[1], "trials": rare.trials, "alarms": rare.alarms,
                "is": "an estimate by the scatter of independent runs, not a bound that is proved",
            })
        });
        json!({
            "case": of.options(), "motor": of.motor, "guards_answers": claim.guards, "verdict": claim.verdict().name(), "decided_by": by(claim),
            "shown": shown(of, claim), "value": value, "low": low, "high": high, "at_most": claim.limit(),
            "cases": cases, "of": starts, "trials": claim.trials, "most_trials": claim.most,
            "error_probability": claim.alpha, "trial": claim.seen.worst.map(|(trial, _)| trial),
            "trials_needed": (claim.verdict() == Verdict::NotShown).then(|| claim.trials_needed()).flatten(),
            "open": claim.open, "odds": odds,
        })
    }

    /// Returns as JSON the verdicts on the requirements for which the user wants the results.
    pub fn json(&self) -> Value {
        let of = |number: &usize| {
            let requirement = self.requirement(*number);
            let claims: Vec<Value> =
                self.found.claims(*number).map(|(of, claim)| Self::claim_json(of, claim)).collect();
            let (next, command) = self.advice(*number);
            json!({
                "id": requirement.id, "text": requirement.text, "limit": requirement.limit,
                "verdict": self.found.verdict(*number).name(), "claims": claims,
                "next": next, "next_command": command, "repeats": self.repeats(*number),
            })
        };
        let verdict =
            self.asked.iter().map(|number| self.found.verdict(*number)).max().unwrap_or(Verdict::NotShown);
        let verdict = if self.silent.is_empty() { verdict } else { Verdict::Failed };
        json!({
            "verdict": verdict.name(),
            "confidence": self.found.requirements.confidence,
            "claims": self.found.count(),
            "requirements": self.asked.iter().map(of).collect::<Vec<_>>(),
        })
    }

    /// Returns the rows of the CSV file, one for each claim.
    pub fn records(&self) -> Records {
        let mut rows = Vec::new();
        for number in self.asked {
            let requirement = self.requirement(*number);
            for (of, claim) in self.found.claims(*number) {
                let [value, low, high] = claim.interval();
                let [cases, starts] = claim.counts();
                rows.push(
                    Record::default()
                        .with("id", &requirement.id)
                        .with("limit", &requirement.limit)
                        .with("case", case(of))
                        .with("guards_answers", claim.guards)
                        .with("verdict", claim.verdict().name())
                        .with("decided_by", by(claim))
                        .with("value", value)
                        .with("low", low)
                        .with("high", high)
                        .with("at_most", claim.limit())
                        .with("cases", cases)
                        .with("of", starts)
                        .with("trials", claim.trials)
                        .with("odds", claim.rare.as_ref().map(|rare| rare.probability.value))
                        .with("odds_at_most", claim.rare.as_ref().map(|rare| rare.ends[1]))
                        .with("trial", claim.seen.worst.map(|(trial, _)| trial)),
                );
            }
        }
        rows.into_iter().collect()
    }

    /// Returns the page for the signatures.
    pub fn sheet(
        &self,
        headline: &str,
        setting: &str,
        manifest: &Value,
        witnesses: Option<&[Witness]>,
    ) -> Sheet {
        let fact = |name: &str, of: &Value| {
            (name.to_owned(), of.as_str().map_or_else(|| of.to_string(), str::to_owned))
        };
        let scenario = self.question.scenario.display();
        let mut facts = vec![
            ("Drive".to_owned(), setting.lines().next().unwrap_or_default().to_owned()),
            (
                "Scenario".to_owned(),
                format!("{scenario} ({})", manifest["scenario"]["digest"].as_str().unwrap_or_default()),
            ),
            (
                "Requirements".to_owned(),
                format!(
                    "{} ({})",
                    self.requirements.display(),
                    manifest["requirements"]["digest"].as_str().unwrap_or_default()
                ),
            ),
            (
                "Program".to_owned(),
                format!(
                    "Standstill {} ({}), numerics {}, ABI {}",
                    manifest["program"]["version"].as_str().unwrap_or_default(),
                    manifest["program"]["digest"].as_str().unwrap_or("no digest"),
                    manifest["program"]["numerics"],
                    manifest["program"]["abi"],
                ),
            ),
            fact("Processor", &manifest["machine"]["processor"]),
        ];
        facts.push(("Witnesses".to_owned(), super::manifest::heard(witnesses)));
        let rows = self.asked.iter().map(|number| {
            let requirement = self.requirement(*number);
            let (shown, trials) = self.evidence(*number);
            [
                requirement.id.clone(),
                requirement.text.clone(),
                requirement.limit.clone(),
                format!("{shown} ({} trials)", count(trials)),
                self.found.verdict(*number).name().to_owned(),
            ]
        });
        Sheet {
            title: "Qualification".to_owned(),
            headline: headline.to_owned(),
            facts,
            columns: ["Id", "Requirement", "Limit", "Shown", "Verdict"],
            rows: rows.collect(),
            notes: vec![
                self.confidence() + ".",
                "A simulation shows what its model contains. What it leaves out, what of the motor is assumed, and the conditions of rare events are in the annexes of qualify.json and qualify.html, which belong to this page.".to_owned(),
            ],
            signatures: vec!["Prepared by".to_owned(), "Reviewed by".to_owned()],
        }
    }
}
