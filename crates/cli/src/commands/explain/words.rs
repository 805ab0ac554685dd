//! The explanation of a trial as text and tables.

use std::fmt::Write as _;

use standstill_analysis::Explained;
use standstill_campaign::Estimate;
use standstill_detect::Method;
use standstill_interface::Angle;
use standstill_quantity::{magnitude, short};
use standstill_report::page::{Block, Column, Table, Tone};
use standstill_scenario::{Plan, Record, Scenario, Verdict};
use standstill_sim::Ended;

use super::Repeated;
use crate::answer::verdict;
use crate::commands::trace::specimen;
use crate::results::Begun;
use crate::shell::command_line::set;
use crate::summary::{decimals_of, fixed};

/// Number of errors that the text for terminals lists. The errors with the largest effect come first.
const LISTED: usize = 12;

/// Footnote on random draws that are not normally distributed. It explains how they are expressed in standard deviations.
const SCORE: &str = "drawn: in standard deviations; of a uniform draw the normal score of its quantile, so that ±1.64 σ cut off 5 % either way.";

/// Footnote of the table of causes. It is shown if the scenario's converter rounds readings to whole codes.
const ROUNDED: &str = " its part: mean and 95 % interval over 16 places of the converter's codes; within rounding: zero lies in that interval, and what the trial does then is the converter's.";

/// Formats the effect of an error in degrees. Half the width of the interval follows if there is an interval. The text has at most three
/// decimals, or more if half the width would otherwise be shown as zero.
fn part(part: &Estimate) -> String {
    let half = part.high - part.value;
    // Three decimals suffice, unless they would show a small value as zero.
    let least = magnitude(if half > 0.0 { half } else { part.value });
    let least = least.map_or(0, |first| usize::try_from(-first).unwrap_or(0));
    let decimals = decimals_of([part.value, part.low, part.high]).min(least.max(3));
    // Zero has no sign.
    let sign = if part.value > 0.0 { "+" } else { "" };
    let value = sign.to_owned() + &fixed(part.value, decimals);
    let value = if value.chars().all(|c| "+0.".contains(c)) { value.replace('+', "") } else { value };
    if half > 0.0 { format!("{value} ± {half:.decimals$}°") } else { format!("{value}°") }
}

/// Formats the outcome of a trial in a few words.
fn ended(record: &Record) -> String {
    match (record.error_deg(), record.axis_error_deg()) {
        (Some(error), _) if error.abs() > 90.0 => {
            format!("wrong pole, axis error {:+.3}°", record.axis_error_deg().unwrap_or(f64::NAN))
        }
        (Some(error), _) => format!("found, error {error:+.3}°"),
        (None, Some(axis)) => format!("{}, axis error {axis:+.3}°", record.verdict().name()),
        (None, None) => format!("{}: {}", record.verdict().name(), record.reason()),
    }
}

/// Formats the evidence that the readings give for the right and for the wrong pole, in standard deviations. None if there is no such
/// evidence.
fn evidence(record: &Record) -> Option<String> {
    let Ended::Outcome(outcome) = record.run.ended else { return None };
    let findings = outcome.findings();
    let right = outcome.evidence_for(Angle::from_radians(record.run.end_angle));
    let mut text = String::new();
    if let (Some(right), Some(evidence)) = (right, findings.pole_evidence) {
        let needed = if evidence.needed.is_finite() {
            format!("needed {:.1} σ", evidence.needed)
        } else {
            "no evidence of these readings suffices".to_owned()
        };
        let _ = write!(
            text,
            "evidence for the right pole {right:+.1} σ, for the wrong one {:+.1} σ; {needed}",
            -right
        );
    }
    if let Some(polarity) = findings.polarity {
        let gap = if text.is_empty() { "" } else { "; " };
        let _ = write!(
            text,
            "{gap}currents of the two vectors {:.3} A and {:.3} A",
            polarity.along, polarity.against
        );
    }
    (!text.is_empty()).then_some(text)
}

/// Returns the sentence on the check that ended the detection. It states how far the checked quantity was from its limit. None if no check
/// with a limit ended the detection.
fn missed(record: &Record) -> Option<String> {
    let margin = record.findings().fault_margin.filter(|margin| *margin < 0.0)?;
    (record.verdict() == Verdict::Failed).then(|| {
        format!(
            "the check that ended it found {:.0} % of what its limit asks for",
            100.0 * (1.0 + margin).max(0.0)
        )
    })
}

/// Smallest movement of the rotor, in electrical degrees, that the text mentions. It is measured over one detection.
const MOVED_DEG: f64 = 0.1;

/// Returns the sentence on the movement of the rotor during the detection. None if the movement is below `MOVED_DEG`.
fn turned(record: &Record, scenario: &Scenario<Method<f64>>) -> Option<String> {
    let moved = record.rotor_moved_deg();
    (moved >= MOVED_DEG).then(|| {
        let mut said = format!("the rotor moved by {moved:.2}° electrical meanwhile");
        if scenario.start_speed != 0.0 {
            let _ = write!(said, ": it turned at {} rpm from the start", short(scenario.start_speed));
        }
        if let Some(age) = record.findings().age {
            let _ = write!(said, "; the angle holds {:.2} ms before the end", age * 1e3);
        }
        said
    })
}

/// Returns the commands that are proposed after trials, each with its purpose. `named` is the command line that began the run. After
/// trials without an answer, a key is proposed only if each of these trials has an answer once this key's error is at its mean; otherwise
/// no value of the key can meet a limit on such starts.
pub fn next(all: &[Repeated], named: &Begun) -> Vec<(String, String)> {
    let Some(first) = all.first() else { return Vec::new() };
    let silent = || all.iter().map(|of| &of.explained).filter(|of| of.record.error_deg().is_none());
    let one = of_one(first, named);
    let (Some(check), true) = (&named.check, first.explained.record.error_deg().is_none()) else {
        return vec![one];
    };
    let answers = |of: &Explained, key: &str| {
        let cause = of.causes.iter().find(|cause| cause.key == key);
        cause.is_some_and(|cause| !cause.within_rounding && cause.without.error_deg().is_some())
    };
    let settings = ("settings with which starts have an answer".to_owned(), check.clone());
    let key = one.1.split_once(" --key ").and_then(|(_, rest)| rest.split(' ').next());
    let mends = key.is_some_and(|key| key == "rotor.speed" || silent().all(|of| answers(of, key)));
    std::iter::once(settings).chain(Some(one).filter(|_| mends)).collect()
}

/// Returns the purpose and the text of the command that is proposed after a trial.
fn of_one(of: &Repeated, named: &Begun) -> (String, String) {
    let (explained, scenario) = (&of.explained, &of.single.scenario);
    let (record, method_alone) = (&explained.record, &explained.without_all);
    let far = |record: &Record| record.miss_deg().map_or(180.0, f64::abs);
    let require = |key: &str| {
        format!("standstill require {} --key {key} --limit \"p95 <= 5 deg, unanswered <= 1 %\"", named.line)
    };
    let main = explained.causes.first().filter(|cause| {
        !cause.within_rounding
            && far(&cause.without) < 0.5 * far(record)
            && standstill_scenario::key(&cause.key).is_some()
    });
    if scenario.start_speed != 0.0
        && record.rotor_moved_deg() >= MOVED_DEG
        && far(method_alone) >= 0.5 * far(record)
    {
        return ("the speed that starts may have".to_owned(), require("rotor.speed"));
    }
    match (main, &named.check) {
        (Some(cause), _) => (format!("how small {} must be", cause.key), require(&cause.key)),
        (None, Some(check)) if far(method_alone) >= 0.5 * far(record) => (
            "no error of drive and sensors makes it; settings with which starts end otherwise".to_owned(),
            check.clone(),
        ),
        (None, None) if far(method_alone) >= 0.5 * far(record) => {
            let trial = record.trial;
            let trials = if named.line.contains("trials=") {
                String::new()
            } else {
                set("trials", &(trial + 1).to_string())
            };
            let command =
                format!("standstill trace {}{trials} --trial {trial} --out trace-{trial}", named.line);
            ("this start with all its waveforms".to_owned(), command)
        }
        (None, _) => {
            ("the part of each error in all starts".to_owned(), format!("standstill budget {}", named.line))
        }
    }
}

/// Returns the blocks of a trial: the verdict, the trial's random errors, and a table with the effect of each error.
pub fn blocks(plan: &Plan, of: &Repeated) -> Vec<Block> {
    let (explained, single) = (&of.explained, &of.single);
    let record = &explained.record;
    let place = specimen::heading(plan, single);
    let headline =
        format!("{}, rotor at {:.2}°: {}", place.trim_end(), record.start_angle_deg(), ended(record));
    let mut far: Vec<_> = explained.causes.iter().filter_map(|cause| Some((cause, cause.drawn?))).collect();
    far.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
    let largest: Vec<String> =
        far.iter().take(4).map(|(cause, drawn)| format!("{} {drawn:+.1} σ", cause.name)).collect();
    let mut details = Vec::new();
    if !largest.is_empty() {
        details.push(format!("furthest from their means: {}", largest.join(", ")));
    }
    details.extend(evidence(record));
    details.extend(missed(record));
    details.extend(turned(record, &single.scenario));
    details.push(if explained.causes.is_empty() {
        "the run draws no errors: what is off here is the method's own at this angle".to_owned()
    } else {
        format!("with all errors at their means: {}", ended(&explained.without_all))
    });
    if let Some(rounding) = explained.rounding_deg {
        details.push(format!(
            "the converter's rounding alone moves this error by {rounding:.3}° (standard deviation over the 15 other places of its codes)"
        ));
    }
    let specimen = specimen::text(single);
    let rows = explained.causes.iter().map(|cause| {
        let drawn = cause.drawn.map_or_else(|| "–".to_owned(), |drawn| format!("{drawn:+.2} σ"));
        let change = match cause.part_deg {
            _ if cause.within_rounding => "within rounding".to_owned(),
            Some(part) => self::part(&part),
            None => "–".to_owned(),
        };
        vec![cause.name.clone(), drawn, ended(&cause.without), change]
    });
    let columns = [
        Column::word("error at its mean, one at a time"),
        Column::number("drawn"),
        Column::prose("the trial then"),
        Column::number("its part"),
    ];
    let mut table = Table::new(columns).rows(rows);
    let further = table.rows.len().saturating_sub(LISTED);
    if further > 0 {
        let smaller =
            if explained.causes[LISTED - 1].part_deg.is_some() { ", with smaller effects" } else { "" };
        let sentence =
            format!("{further} further errors{smaller}: explain.csv, explain.html and --json have them.");
        table = table.excerpt((0..LISTED).collect(), sentence);
    }
    let tone = if record.pole_correct() == Some(true) { Tone::Neutral } else { Tone::Bad };
    let drawn = Block::Code { caption: "What it drew".to_owned(), text: specimen };
    let mut blocks = vec![verdict(tone, headline, details), drawn];
    if !explained.causes.is_empty() {
        let rounded = explained.rounding_deg.map_or("", |_| ROUNDED);
        blocks.extend([Block::Table(table), Block::Text(format!("{SCORE}{rounded}"))]);
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_parts_have_no_digits_beyond_their_intervals() {
        let said = |value: f64, half: f64| part(&Estimate { value, low: value - half, high: value + half });
        assert_eq!(said(-2.0518, 0.1719), "-2.05 ± 0.17°");
        assert_eq!(said(0.7104, 0.0601), "+0.71 ± 0.06°");
        assert_eq!(said(31.25, 12.5), "+31 ± 12°");
        assert_eq!(said(-0.008_7, 0.001_6), "-0.009 ± 0.002°");
        assert_eq!(said(1.5, 0.0), "+1.50°");
        // Small parts have digits, and zeros no sign.
        assert_eq!(said(-0.000_21, 0.000_043), "-0.00021 ± 0.00004°");
        assert_eq!(said(-0.000_001, 0.000_4), "0.0000 ± 0.0004°");
        assert_eq!(said(0.0, 0.0), "0°");
    }
}
