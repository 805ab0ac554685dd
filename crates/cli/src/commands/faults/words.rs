//! Sentences of `faults`: the headline and its details.

use standstill_analysis::faults::{Allowed, Worst, trials_that_show};
use standstill_quantity::{count, short};
use standstill_report::page::Tone;

use super::rates::Rates;
use super::row::{LATENT, Row, percent};
use crate::summary::FAILING;

/// The question that the rows of the table answer.
pub struct Subject<'a> {
    /// The scenario with its keys, for a command line.
    pub asked: String,
    pub rates: Option<&'a Rates>,
    pub allowed: Allowed,
    /// True if the scenario itself has faults. They are then present in each row.
    pub has_own: bool,
    pub has_magnet: bool,
    /// True if the motor has a magnet and its data show which pole is which.
    pub has_poles: bool,
}

/// Largest share of dangerous answers of a fault for which the headline is still good.
const MOST: f64 = 1e-3;

/// Returns the rows that have a fault which reaches the method.
fn faults(rows: &[Row]) -> Vec<&Row> {
    rows.iter().filter(|row| !row.entry.modes.is_empty() && !row.is_unread()).collect()
}

fn rows_of(count: usize) -> String {
    if count == 1 { "the one fault".to_owned() } else { format!("{count} faults") }
}

/// Returns true if the drive without a fault gives no answer in any start. The effect of a fault is then not visible.
pub fn is_silent(rows: &[Row]) -> bool {
    let mut whole = rows.iter().filter(|row| row.entry.modes.is_empty()).peekable();
    whole.peek().is_some() && whole.all(|row| row.counts.detected() == row.counts.trials)
}

/// Returns true if the row has no fault, but its share of starts without an answer is larger than `check` allows.
pub fn is_mute(row: &Row) -> bool {
    row.entry.modes.is_empty() && row.counts.detected() as f64 > FAILING * row.counts.trials as f64
}

/// Returns the headline, which states how many faults lead to dangerous answers. A start without an answer is not dangerous.
pub fn headline(rows: &[Row]) -> (Tone, String) {
    if is_silent(rows) {
        let text = "Nothing to be said of faults, for without a fault no start has an answer";
        return (Tone::Bad, text.to_owned());
    }
    let faults = faults(rows);
    if faults.is_empty() {
        return (
            Tone::Warning,
            "Nothing to be said of faults, for none reaches a method that reads no current".to_owned(),
        );
    }
    let open: Vec<&&Row> = faults.iter().filter(|row| row.counts.undetected_bound() > MOST).collect();
    let of = rows_of(faults.len());
    if open.is_empty() {
        let text = format!("Of {of} none leads to more than 0.1 % dangerous answers (upper bound of 95 %)");
        return (Tone::Good, text);
    }
    let seen: Vec<&&&Row> = open.iter().filter(|row| row.counts.undetected() > 0).collect();
    let open = open.len();
    if seen.is_empty() {
        return (
            Tone::Warning,
            format!("Of {of} none has a dangerous answer; {open} cannot be shown to have at most 0.1 %"),
        );
    }
    let most = seen.iter().max_by_key(|row| row.counts.undetected());
    let most = most.map_or_else(String::new, |row| {
        let share = percent(row.counts.undetected(), row.counts.trials);
        format!(", up to {share} % ({}, {})", row.method, row.fault())
    });
    let seen = seen.len();
    let text = format!(
        "Of {of} {seen} {} dangerous answers{most}; {open} cannot be shown to have at most 0.1 %",
        if seen == 1 { "has" } else { "have" }
    );
    (Tone::Bad, text)
}

/// Returns the start with the largest error and the row of this start.
pub fn worst(rows: &[Row]) -> Option<(&Row, Worst)> {
    let worst = rows.iter().filter_map(|row| Some((row, row.counts.worst?)));
    worst.max_by(|a, b| a.1.error_deg.abs().total_cmp(&b.1.error_deg.abs()))
}

/// Returns the words for the drive without an additional fault. `has_own` is true if the scenario itself has faults.
pub const fn beside(has_own: bool) -> &'static str {
    if has_own { "with the scenario's own faults alone" } else { "without a fault" }
}

/// Returns the sentences that define *dangerous*, and those with details that the headline does not have.
pub fn details(of: &Subject<'_>, rows: &[Row]) -> Vec<String> {
    let allowed = of.allowed;
    let from = if rows.iter().all(|row| row.in_sectors) {
        "beyond the sector named"
    } else if rows.iter().any(|row| row.in_sectors) {
        "off, or beyond the sector named"
    } else {
        "off"
    };
    let pole = if of.has_magnet { "the wrong pole, or an angle" } else { "the motor has no poles: an axis" };
    let mut details = vec![format!("dangerous: {pole} more than {}° {from}", allowed.error_deg)];
    details.extend(poles(of, rows));
    details.extend(trials_needed(rows));
    let whole = rows.iter().filter(|row| row.entry.modes.is_empty() && row.counts.undetected() > 0);
    details.extend(whole.map(|row| {
        let share = percent(row.counts.undetected(), row.counts.trials);
        format!("{} {share} % of the answers of {} are dangerous", beside(of.has_own), row.method)
    }));
    details.extend(rows.iter().filter(|row| is_mute(row)).map(|row| {
        let share = percent(row.counts.detected(), row.counts.trials);
        format!(
            "without a fault {share} % of the starts of {} have no answer: {}",
            row.method,
            row.reason().unwrap_or_default()
        )
    }));
    details.push(format!(
        "moved: by more than {}°; current: more than {} A, the rated one, or the drive's trip",
        allowed.moved_deg,
        short(allowed.current)
    ));
    details.extend(worst(rows).map(|(row, worst)| {
        let from = if row.in_sectors { "beyond the sector" } else { "off" };
        format!("the worst start: {} with {}, {:.1}° {from}", row.method, row.fault(), worst.error_deg)
    }));
    details.extend(list(rows, "without an effect in these starts", |row| {
        row.effect().as_deref() == Some(LATENT)
    }));
    details.extend(list(rows, "not read, as the method reads no current", Row::is_unread));
    details.extend(rows.iter().filter(|row| row.counts.errors > 0).map(|row| {
        format!(
            "{} with {}: {} of {} starts could not be simulated to their end; right, wrong pole, beyond and detected leave them out",
            row.method,
            row.fault(),
            count(row.counts.errors),
            count(row.counts.trials)
        )
    }));
    details
}

/// Returns for each method, in their order, a line that lists the faults of the rows that `is` holds for.
fn list(rows: &[Row], what: &str, is: impl Fn(&Row) -> bool) -> Vec<String> {
    let listed = rows.iter().filter(|row| is(row)).map(|row| (row.method.as_str(), row.fault()));
    let mut lines: Vec<(&str, Vec<String>)> = Vec::new();
    for (method, fault) in listed {
        match lines.last_mut() {
            Some((of, faults)) if *of == method => faults.push(fault),
            _ => lines.push((method, vec![fault])),
        }
    }
    lines.into_iter().map(|(method, faults)| format!("{method}, {what}: {}", faults.join("; "))).collect()
}

/// Returns the sentence on wrong poles. None for a motor without magnetic poles, and if no start names a pole.
fn poles(of: &Subject<'_>, rows: &[Row]) -> Option<String> {
    let faults = faults(rows);
    let seen = faults.iter().filter(|row| row.counts.wrong_pole > 0).count();
    let open = faults.iter().filter(|row| row.counts.wrong_pole_bound() > MOST).count();
    let text = if open == 0 {
        "wrong poles: at most 0.1 % with each fault (upper bound of 95 %)".to_owned()
    } else {
        format!(
            "wrong poles: seen with {seen} of {}; {open} cannot be shown to have at most 0.1 %",
            rows_of(faults.len())
        )
    };
    let names_poles = |row: &&Row| row.counts.right + row.counts.beyond + row.counts.wrong_pole > 0;
    (of.has_magnet && rows.iter().any(|row| names_poles(&row))).then_some(text)
}

/// Returns the sentence on faults without a dangerous answer whose upper bound is still above `MOST`. It states how many trials would lower
/// the bound to `MOST`. None if there are no such faults.
fn trials_needed(rows: &[Row]) -> Option<String> {
    let is_open = |row: &&&Row| row.counts.undetected() == 0 && row.counts.undetected_bound() > MOST;
    let count = faults(rows).iter().filter(is_open).count();
    let needed = trials_that_show(MOST);
    (count > 0).then(|| {
        format!("{count} of them without a dangerous answer seen: --trials {needed} shows at most 0.1 % if none is seen")
    })
}
