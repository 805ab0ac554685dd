//! The answer of `odds` as text, tables and JSON.

use serde_json::json;
use standstill_analysis::subset::Run;
use standstill_analysis::{Alarm, Anatomy, Draw, Estimator as By, Event, Odds, Sector};
use standstill_campaign::Estimate;
use standstill_quantity::{count, magnitude, rounded, significant};
use standstill_report::page::{Block, Column, Section, Table, Tone};

use crate::answer::{Answer, Record, Records, verdict};
use crate::commands::question::Silence;
use crate::shell::NOT_SHOWN;
use crate::shell::values::{probability, probability_interval};

/// Number of random errors of a start that are listed for a sector.
const LISTED: usize = 6;

/// Formats a sector of the rotor angle as table cells: its angles, the sign of the error, its share of the event in per cent, and the
/// random errors whose mean is clearly not zero.
fn cells(sector: &Sector) -> Vec<String> {
    let sign = match sector.positive {
        Some(true) => "+",
        Some(false) => "−",
        None => "",
    };
    let draw = |draw: &Draw| format!("{} {:+.1} ± {:.1} σ", draw.name, draw.mean, draw.deviation);
    let mut draws: Vec<String> = sector.draws.iter().take(LISTED).map(draw).collect();
    if sector.draws.len() > LISTED {
        draws.push(format!("{} more", sector.draws.len() - LISTED));
    }
    vec![
        format!("{:.0} to {:.0}", sector.angles_deg.0, sector.angles_deg.1),
        sign.to_owned(),
        format!("{:.1}", 100.0 * sector.share),
        if draws.is_empty() { "none away from zero".to_owned() } else { draws.join(", ") },
    ]
}

/// Formats a large number of trials with two digits.
pub(super) fn about(trials: f64) -> String {
    let two = significant(trials, 2);
    if two < 1e6 { count(two) } else { format!("{} million", rounded(two, -6)) }
}

/// Formats a ratio in words. Ratios from 10 on have two digits.
pub(super) fn times(ratio: f64) -> String {
    if ratio < 1.5 {
        return "about".to_owned();
    }
    let two = significant(ratio, 2);
    format!("{} times", if two < 10.0 { two.round().to_string() } else { count(two) })
}

fn method(odds: &Odds) -> String {
    let how = match odds.estimator {
        By::Subset => format!(
            "by subset simulation: {} runs of up to {} levels, {} trials",
            odds.runs.len(),
            odds.levels,
            count(odds.trials)
        ),
        By::Mixture { parts, effective, searched } => format!(
            "by importance sampling around the {} that {} runs of subset simulation (up to {} levels){} found in \
             the event: as good as {} independent starts with it, {} trials",
            if parts == 1 { "part".to_owned() } else { format!("{parts} parts") },
            odds.runs.len(),
            odds.levels,
            if searched { " and draws of twice the spread" } else { "" },
            count(effective),
            count(odds.trials)
        ),
        By::Plain => format!("by {} plain trials ({} trials in all)", count(odds.plain), count(odds.trials)),
    };
    let interval = if odds.widened { "[interval widened, for it is doubtful]" } else { "[95 % interval]" };
    if odds.probability.value > 0.0 { format!("{interval}, {how}") } else { how }
}

/// Formats a probability as `one in N starts`. The number of digits, at most three, depends on the interval. None if the probability is
/// zero.
fn one_in(p: &Estimate) -> Option<String> {
    const NAMES: [(f64, &str); 3] = [(1e12, " million million"), (1e9, " billion"), (1e6, " million")];
    let often = Estimate { value: 1.0 / p.value, low: 1.0 / p.high, high: 1.0 / p.low };
    let behind = magnitude(often.value)? - often.last_place()?;
    let digits = 1 + usize::try_from(behind.clamp(0, 2)).unwrap_or(0);
    let often = (p.value > 0.0).then(|| significant(1.0 / p.value, digits))?;
    let (unit, name) = NAMES.into_iter().find(|(unit, _)| often >= *unit).unwrap_or((1.0, ""));
    match rounded(often / unit, 0) {
        1.0 if name.is_empty() => Some("nearly every start".to_owned()),
        often => Some(format!("one in {}{name} starts", count(often))),
    }
}

/// Returns the phrase that names the set of starts to which the probability refers.
fn share_of(event: Event, in_sectors: bool) -> String {
    match event {
        Event::Error(bound) if in_sectors => format!(
            "of all starts those whose axis is beyond the sector named by more than {bound}°; one without an axis is not among them"
        ),
        Event::Error(bound) => format!(
            "of all starts those whose axis is off by more than {bound}°; one without an axis is not among them"
        ),
        _ => "of all starts".to_owned(),
    }
}

/// Returns the answer if no start has the axis or angle that the event requires.
pub(super) fn unanswered(setting: String, event: Event, starts: &Silence) -> Answer {
    let headline = format!("{event}: nothing to be said, for {}", starts.sentence());
    let verdict = verdict(Tone::Bad, headline, Vec::new());
    let json = json!({
        "event": event.to_string(),
        "probability": null,
        "low": null,
        "high": null,
        "plain_starts": starts.json(),
    });
    let answer = Answer::new("odds", format!("Odds of {event}"), setting, verdict, Vec::new());
    Answer { json, csv: Some(Records::default()), code: NOT_SHOWN, ..answer }
}

fn headline(event: Event, odds: &Odds, starts: &Silence) -> String {
    let rarity = rarity(event, odds);
    if starts.is_frequent() { format!("{rarity}; {}", starts.counted()) } else { rarity }
}

fn rarity(event: Event, odds: &Odds) -> String {
    if let Some(often) = one_in(&odds.probability) {
        return format!("{event}: {}, {often}", probability_interval(&odds.probability));
    }
    let how = match odds.estimator {
        By::Subset | By::Mixture { .. } => "reached",
        By::Plain => "seen",
    };
    let (most, plain) = (probability(odds.probability.high), count(odds.plain));
    format!("{event}: not {how}, at most {most} (97.5 %, none in {plain} plain trials)")
}

fn run((number, run): (usize, &Run)) -> Record {
    Record::default()
        .with("run", number + 1)
        .with("probability", run.probability)
        .with("own_variation", run.variation)
        .with("levels", run.levels)
        .with("trials", run.trials)
        .with("acceptance", run.acceptance)
        .with("ancestors", run.ancestors)
        .with("end", run.end.name())
}

/// Returns the table of the runs. Only the page shows it.
fn runs(odds: &Odds) -> Table {
    let columns = ["run", "probability", "own variation", "levels", "trials"].map(Column::number);
    let more = [Column::number("moves taken").unit("%"), Column::number("ancestors")];
    let rows = odds.runs.iter().enumerate().map(|(number, run)| {
        vec![
            (number + 1).to_string(),
            format!("{:.2e}", run.probability),
            format!("{:.2}", run.variation),
            run.levels.to_string(),
            run.trials.to_string(),
            format!("{:.0}", 100.0 * run.acceptance),
            run.ancestors.to_string(),
        ]
    });
    Table::new(columns.into_iter().chain(more))
        .captioned("The runs; own variation: the coefficient of variation that a run expects of itself")
        .rows(rows)
}

fn sectors(anatomy: &Anatomy) -> Table {
    let columns = [
        Column::word("angle").unit("°"),
        Column::word("error"),
        Column::word("share").unit("%"),
        Column::prose("draws away from zero"),
    ];
    Table::new(columns)
        .captioned("What it looks like: means of its draws, in standard deviations")
        .rows(anatomy.sectors.iter().map(cells))
}

fn sector(sector: &Sector) -> serde_json::Value {
    let draw = |draw: &Draw| json!({ "draw": draw.name, "mean": draw.mean, "deviation": draw.deviation });
    json!({
        "angles_deg": [sector.angles_deg.0, sector.angles_deg.1],
        "positive_error": sector.positive,
        "share": sector.share,
        "draws": sector.draws.iter().map(draw).collect::<Vec<_>>(),
    })
}

/// Returns the answer without its figures. `in_sectors` is true if the method answers with sectors.
pub(super) fn answer(
    setting: String,
    event: Event,
    in_sectors: bool,
    odds: &Odds,
    anatomy: &Anatomy,
    starts: &Silence,
) -> Answer {
    let found = odds.probability;
    let alarms: Vec<String> = odds.alarms.iter().map(ToString::to_string).collect();
    let remark = |remark: &Alarm| match remark {
        // Importance sampling explains them, or they would be alarms.
        _ if remark.is_of_runs() => format!("the levels alone would be doubtful: {remark}"),
        _ => remark.to_string(),
    };
    let remarks: Vec<String> = odds.remarks.iter().map(remark).collect();
    let records: Records = odds.runs.iter().enumerate().map(run).collect();
    let by = match odds.estimator {
        By::Subset => "subset simulation",
        By::Mixture { .. } => "importance sampling",
        By::Plain => "plain trials",
    };
    let json = json!({
        "event": event.to_string(),
        "share_of": share_of(event, in_sectors),
        "probability": found.value,
        "low": found.low,
        "high": found.high,
        "widened": odds.widened,
        "trials": odds.trials,
        "levels": odds.levels,
        "by": by,
        "runs": records,
        "plain_starts": starts.json(),
        "alarms": alarms,
        "remarks": remarks,
        "sectors": anatomy.sectors.iter().map(sector).collect::<Vec<_>>(),
    });
    let tone = if alarms.is_empty() && !starts.is_frequent() { Tone::Neutral } else { Tone::Warning };
    let levels =
        (odds.estimator != By::Plain).then(|| format!("levels of {}", event.order_parameter(in_sectors)));
    let doubts = alarms.iter().map(|alarm| format!("doubtful: {alarm}"));
    let details = [share_of(event, in_sectors), starts.sentence(), method(odds)].into_iter();
    let details = details.chain(levels).chain(doubts).chain(remarks);
    let verdict = verdict(tone, headline(event, odds, starts), details.collect());
    let mut answer = Answer::new("odds", format!("Odds of {event}"), setting, verdict, Vec::new());
    let looks = Section::new("What it looks like", [Block::Table(sectors(anatomy))]);
    answer.sections.extend((!anatomy.sectors.is_empty()).then_some(looks));
    let runs = Section::new("Runs", [Block::Table(runs(odds))]).aside();
    answer.sections.extend((!odds.runs.is_empty()).then_some(runs));
    Answer { json, csv: Some(records), ..answer }
}

#[cfg(test)]
mod tests {
    use standstill_analysis::Answers;
    use standstill_analysis::subset::{End, Settings};

    use super::*;
    use crate::commands::question::silence::Needs;

    #[test]
    fn law_one_in_so_many_has_few_digits() {
        let said = |value, half: f64| {
            one_in(&Estimate { value, low: value * (1.0 - half), high: value * (1.0 + half) })
        };
        let starts = |often: &str| Some(format!("one in {often} starts"));
        assert_eq!(said(2.27e-9, 0.3), starts("440 million"));
        assert_eq!(said(1.234e-10, 0.3), starts("8.1 billion"));
        assert_eq!(said(1.0 / 64.2, 0.06), starts("64"));
        assert_eq!(said(0.4, 0.01), starts("2.5"));
        assert_eq!(said(4.954e-5, 0.01), starts("20,200"));
        assert_eq!(said(0.0, 0.0), None);
    }

    #[test]
    fn regress_what_no_run_reached_is_bounded_by_plain_trials_in_words_too() {
        let run = |end, probability| Run {
            end,
            probability,
            variation: 0.0,
            levels: 16,
            curve: Vec::new(),
            trials: 166_000,
            acceptance: 0.5,
            ancestors: 100,
            unread: [0.0; 8],
            failures: Vec::new(),
            plain_hits: 0,
        };
        let settings = Settings::default();
        let mut odds = Odds::of_runs(&settings, vec![run(End::TooRare, 1e-16); 8]);
        odds.remarks.push(Alarm::Unled(0.05));
        let none = Anatomy { sectors: Vec::new(), typical: None };
        let starts = Silence { answers: Answers { starts: 1000, ..Answers::default() }, needs: Needs::Angle };
        let answer = answer("setting".to_owned(), Event::Failed, false, &odds, &none, &starts);
        let text = answer.text();
        let headline = "failed: not reached, at most 1.15e-4 (97.5 %, none in 32,000 plain trials)\n";
        assert!(text.contains(headline) && text.contains("the runs gave up at 1e-16"), "{text}");
        assert!(!text.contains("interval"), "{text}");
        assert!(
            text.contains("\n  5 % of the failed starts ended with a fault that no margin tells"),
            "{text}"
        );
        let titles: Vec<&str> = answer.sections.iter().map(|section| section.title.as_str()).collect();
        assert_eq!(titles, ["Answer", "Runs"]);
    }
}
