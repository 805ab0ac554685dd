//! The answer of `tune` as text and tables.

use standstill_analysis::limit::{Limit, Measure};
use standstill_analysis::tune::{Judged, Question as Asked, Tuned};
use standstill_campaign::Estimate;
use standstill_quantity::{Scale, count, listed, short, significant};
use standstill_report::page::{Column, Table, Tone};

use crate::commands::require::Unanswered;
use crate::shell::values::{percent, scale, shown};
use crate::summary::decimals_of;

fn digits(estimate: &Estimate, scale: &Scale) -> usize {
    decimals_of([estimate.value, estimate.low, estimate.high].map(|value| scale.number(value)))
}

fn number(value: f64, digits: usize, scale: &Scale) -> String {
    if value.is_finite() { format!("{:.digits$}", scale.number(value) + 0.0) } else { "–".to_owned() }
}

/// Formats an estimate with its interval in the unit of `scale`.
fn interval(estimate: &Estimate, scale: &Scale) -> String {
    let digits = digits(estimate, scale);
    let [value, low, high] =
        [estimate.value, estimate.low, estimate.high].map(|value| number(value, digits, scale));
    if low == high { value } else { format!("{value} [{low}, {high}]") }
}

fn with_unit(measure: Measure, estimate: &Estimate) -> String {
    let scale = scale(measure, estimate.value);
    let gap = if scale.unit == "°" { "" } else { " " };
    format!("{}{gap}{}", interval(estimate, &scale), scale.unit)
}

/// Formats measures with their intervals and units in one line, separated by semicolons.
pub fn measures(all: &[(Measure, Estimate)]) -> String {
    let one =
        |(measure, estimate): &(Measure, Estimate)| format!("{measure} {}", with_unit(*measure, estimate));
    all.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// Formats settings as `key = value` in one line, separated by commas.
pub fn settings(asked: &Asked<'_>, values: &[f64]) -> String {
    let pairs = asked.ranges.iter().zip(values);
    pairs
        .map(|(range, value)| format!("{} = {}", range.key, value_of(&range.key, *value)))
        .collect::<Vec<_>>()
        .join(", ")
}

fn value_of(key: &str, value: f64) -> String {
    if value.is_nan() { "not known".to_owned() } else { shown(key, value) }
}

/// Formats settings as lines of a scenario file.
pub fn toml(asked: &Asked<'_>, judged: &Judged) -> String {
    let line = |(range, value): (&standstill_analysis::tune::Range, &f64)| {
        let text = shown(&range.key, *value);
        let plain = text.parse::<f64>().is_ok();
        if plain { format!("{} = {text}\n", range.key) } else { format!("{} = \"{text}\"\n", range.key) }
    };
    asked.ranges.iter().zip(&judged.values).map(line).collect()
}

/// Returns the tone of the answer, and the answer in a line.
pub fn headline(asked: &Asked<'_>, tuned: &Tuned) -> (Tone, String) {
    let minimise = asked.goal.minimise;
    let [start, best] =
        [&tuned.start, &tuned.best].map(|judged| with_unit(minimise, &judged.measured.get(minimise)));
    let settings = settings(asked, &tuned.best.values);
    let limits = limits(asked);
    // The initial settings keep the limits that are relative to them, even if other random numbers give another value. So only the other
    // limits are compared.
    let start_keeps = standstill_analysis::tune::verdict(&asked.absolute(), &tuned.start.measured).holds;
    if tuned.best.measured.get(Measure::Unanswered).value >= 1.0 {
        return (
            Tone::Bad,
            format!("No settings found with which a start has an answer; nearest: {settings}"),
        );
    }
    if !tuned.is_found() {
        return (Tone::Bad, format!("No settings found with which {limits}; nearest: {settings}"));
    }
    if !tuned.seems_better(&asked.goal) && start_keeps {
        return (
            Tone::Neutral,
            format!(
                "No settings found that are surely better than the start: {minimise} {best} against {start}"
            ),
        );
    }
    let found = format!("{settings}: {minimise} {best}, at the start {start}");
    if tuned.seems_better(&asked.goal) && !tuned.surely_better(&asked.goal) {
        let open = "not surely better: starts without an answer that were not seen may turn it";
        return (Tone::Warning, format!("{found}; {open}"));
    }
    let tone = if tuned.limits.surely || asked.goal.limits.0.is_empty() { Tone::Good } else { Tone::Warning };
    (tone, found)
}

/// Returns the peak current of the best settings in A, if it exceeds the rated current of the motor and the limits do not allow it.
pub fn exceeding(rated: f64, asked: &Asked<'_>, tuned: &Tuned) -> Option<f64> {
    let is_limited = asked.goal.limits.0.iter().any(|limit| limit.measure == Measure::PeakCurrent);
    let mut measures = tuned.best.measured.0.iter();
    let (_, peak) = measures.find(|(measure, _)| *measure == Measure::PeakCurrent)?;
    (tuned.is_found() && !is_limited && peak.value > rated).then_some(peak.value)
}

/// Adds to a headline that the best settings draw more than the rated current, which `check` refuses. Such an answer is at most a warning.
pub fn within(
    rated: f64,
    asked: &Asked<'_>,
    tuned: &Tuned,
    (tone, headline): (Tone, String),
) -> (Tone, String) {
    let Some(peak) = exceeding(rated, asked, tuned) else { return (tone, headline) };
    let tone = if tone == Tone::Bad { tone } else { Tone::Warning };
    (
        tone,
        format!(
            "{headline}; it draws {} A, more than the rated {} A",
            short(significant(peak, 4)),
            short(rated)
        ),
    )
}

/// Formats the limits with at most four digits. The mark `(start)` follows a limit that was computed with the initial settings.
pub fn limits(asked: &Asked<'_>) -> String {
    let one = |limit: &Limit| {
        let scale = scale(limit.measure, limit.most);
        let most = significant(scale.number(limit.most), 4);
        let start = if asked.relative.contains(&limit.measure) { " (start)" } else { "" };
        format!("{} <= {most} {}{start}", limit.measure, scale.unit)
    };
    asked.goal.limits.0.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// Returns the details of the answer: intervals, met and broken limits, and the extent of the search.
pub fn details(asked: &Asked<'_>, tuned: &Tuned) -> Vec<String> {
    let minimise = asked.goal.minimise;
    let apart = tuned.differences.get(minimise);
    let mut details = vec![format!(
        "[95 % interval] of {} trials of seed {}, which the search did not use; difference of {minimise} to the start {}",
        count(asked.effort.last),
        asked.seed.wrapping_add(2),
        with_unit(minimise, &apart)
    )];
    let relative = asked.relative.contains(&Measure::Rms);
    if let Some(unseen) = tuned.unseen().filter(|_| relative || minimise == Measure::Rms) {
        details.push(format!(
            "the difference of rms counts the detections seen: with these settings up to {} more of all detections than with the initial ones may \
             lack an answer unseen, each counted as 90°, which would make the rms {}°; ten times the --trials ({}) leave a tenth of that share",
            percent(unseen.share),
            listed(&[unseen.rms_deg], "").trim_end(),
            asked.effort.last.saturating_mul(10)
        ));
    }
    if !asked.goal.limits.0.is_empty() {
        let holds = match tuned.limits {
            v if v.surely => "surely kept",
            v if v.holds => "kept as far as the trials tell, not surely",
            v if v.possibly => "possibly kept, but not by these trials",
            _ => "not kept",
        };
        details.push(format!("{}: {holds}", limits(asked)));
    }
    let ends: Vec<String> = asked
        .ranges
        .iter()
        .zip(&tuned.best.values)
        .filter(|(range, value)| **value == range.low || **value == range.high)
        .map(|(range, _)| range.key.clone())
        .collect();
    if !ends.is_empty() {
        details.push(format!("at the end of the range: {}", ends.join(", ")));
    }
    let limited = asked.goal.limits.0.iter().any(|limit| limit.measure == Measure::Rms);
    if limited || minimise == Measure::Rms {
        let of_best = &tuned.best.measured;
        let share = of_best.get(Measure::Unanswered);
        let unanswered = Unanswered::in_measure(&of_best.get(Measure::Rms), &share, asked.effort.last);
        details.extend(unanswered.map(|text| format!("rms: {text}")));
    }
    details.push(format!(
        "{} settings looked at, from {} places; {} trials each at first, {} near the end",
        tuned.looks.len(),
        asked.effort.starts,
        asked.effort.coarse,
        asked.effort.fine
    ));
    details
}

/// Returns the word for the final settings: `best` if the limits hold, `nearest` if not.
pub fn last(tuned: &Tuned) -> &'static str {
    if tuned.is_found() { "best" } else { "nearest" }
}

/// Returns the table that compares initial and best settings, measure by measure.
pub fn table(asked: &Asked<'_>, tuned: &Tuned) -> Table {
    let keys = asked.ranges.iter().enumerate().map(|(k, range)| {
        let of = |judged: &Judged| value_of(&range.key, judged.values[k]);
        vec![range.key.clone(), of(&tuned.start), of(&tuned.best), String::new()]
    });
    let measures = tuned.best.measured.0.iter().map(|(measure, best)| {
        let start = tuned.start.measured.get(*measure);
        let scale = scale(*measure, best.value.max(start.value));
        let apart = tuned.differences.get(*measure);
        let difference = if apart.value == 0.0 && apart.low == apart.high {
            "same".to_owned()
        } else {
            interval(&apart, &scale)
        };
        vec![
            format!("{measure} {}", scale.unit),
            interval(&start, &scale),
            interval(best, &scale),
            difference,
        ]
    });
    Table::new([
        Column::word(""),
        Column::number("start"),
        Column::number(last(tuned)),
        Column::number("difference"),
    ])
    .rows(keys.chain(measures))
}

#[cfg(test)]
mod tests {
    use standstill_analysis::bracket::Verdict;
    use standstill_analysis::limit::Limits;
    use standstill_analysis::tune::{Effort, Goal, Measured};
    use standstill_scenario::Document;

    use super::*;

    #[test]
    fn law_the_headline_warns_where_unseen_starts_may_turn_it() {
        let document = Document::parse(std::path::Path::new("s.toml"), "").expect("TOML");
        let limits = Limits(Vec::new());
        let effort = Effort::new(20_000, &limits);
        let goal = Goal { minimise: Measure::Rms, limits };
        let against = Measure::Duration;
        let asked = Asked {
            document: &document,
            ranges: Vec::new(),
            goal,
            relative: Vec::new(),
            against,
            effort,
            seed: 1,
        };
        let exactly = |value: f64| Estimate { value, low: value, high: value };
        let judged =
            |rms: f64| Judged { values: Vec::new(), measured: Measured(vec![(Measure::Rms, exactly(rms))]) };
        let verdict_of = |more: f64| {
            let differences = vec![(Measure::Rms, exactly(-0.1)), (Measure::Unanswered, exactly(more))];
            let tuned = Tuned {
                start: judged(0.8),
                best: judged(0.7),
                differences: Measured(differences),
                limits: Verdict { holds: true, surely: true, possibly: true },
                front: Vec::new(),
                looks: Vec::new(),
            };
            headline(&asked, &tuned)
        };
        let (tone, text) = verdict_of(3.69 / 20_000.0);
        assert!(tone == Tone::Warning && text.contains("not surely better"), "{text}");
        let (tone, text) = verdict_of(0.0);
        assert!(tone == Tone::Good && !text.contains("surely"), "{text}");
    }
}
