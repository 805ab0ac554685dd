//! `standstill witness`: checks (*witnesses*) against closed forms, conservation laws and stored results, computed on this machine.

use std::sync::atomic::AtomicBool;

use serde_json::{Value, json};
use standstill_analysis::witness::{Figure, Witness, WitnessError, all};
use standstill_campaign::NUMERICS;
use standstill_campaign::digests::DigestError;
use standstill_report::page::{Block, Column, Section, Table, Tone};

use crate::answer::{Answer, Record, Records, verdict};
use crate::arguments::Witness as Options;
use crate::error::Error;
use crate::shell::interrupt::{self, INTERRUPTED};
use crate::shell::output::{remove_stale, unfinished_prefix};
use crate::shell::{Report, progress};

/// Computes all witnesses, whose files are in a temporary folder. Returns none if stopped. `hear` is called with the name of each group of
/// witnesses before the group is computed.
pub fn hear(stop: &AtomicBool, hear: impl FnMut(&'static str)) -> Result<Option<Vec<Witness>>, Error> {
    let place = std::env::temp_dir();
    remove_stale(&place);
    let folder = tempfile::Builder::new().prefix(&unfinished_prefix()).tempdir();
    let folder = folder.map_err(Error::writing(&place))?;
    match all(folder.path(), stop, hear) {
        Err(WitnessError::Digest(DigestError::Stopped)) => Ok(None),
        found => found.map(Some).map_err(Error::Witness),
    }
}

pub fn run(options: &Options) -> Result<Report, Error> {
    let (stop, bar) = (interrupt::flag(), progress::working("witnesses"));
    let found = hear(&stop, |group| bar.set_message(group));
    bar.finish_and_clear();
    let interrupted = "Interrupted: not all witnesses were heard; begin again with\n  standstill witness\n";
    Ok(match found? {
        Some(found) => report(&found, options.json),
        None => Report { text: interrupted.to_owned(), code: INTERRUPTED },
    })
}

/// Returns the report on the witnesses; its exit code is 1 if one of them does not hold.
fn report(found: &[Witness], as_json: bool) -> Report {
    let holding = found.iter().filter(|witness| witness.holds()).count();
    let code = u8::from(holding < found.len());
    if as_json {
        return Report {
            text: format!(
                "{:#}\n",
                json!({ "hold": code == 0, "numerics": NUMERICS, "witnesses": json(found) })
            ),
            code,
        };
    }
    let tone = if code == 0 { Tone::Good } else { Tone::Bad };
    let headline = format!("{holding} of {} witnesses hold on this machine", found.len());
    let wrong = found
        .iter()
        .filter(|witness| !witness.holds())
        .map(|witness| format!("does not hold: {}", witness.claim));
    let mut details: Vec<String> = wrong.collect();
    if code != 0 {
        details.push("what this program computes here is not what it should be: report it with this output; trust no result of it".to_owned());
    }
    let blocks = vec![
        Block::Table(table(found, "known by")),
        Block::Text("docs/validation.md has what else is compared, with other programs too.".to_owned()),
    ];
    let sections =
        vec![Section::new("Answer", std::iter::once(verdict(tone, headline, details)).chain(blocks))];
    Report { text: Answer { sections, ..Answer::default() }.text(), code }
}

/// Formats a number with up to eight decimals. Uses scientific notation for very small and very large numbers.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        let digits = format!("{value:.8}");
        return digits.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    format!("{value:.3e}")
}

/// Returns the table of witnesses. `by`: heading of the column with the origin of the figures.
pub fn table(found: &[Witness], by: &str) -> Table {
    let columns = [
        Column::prose("claim"),
        Column::word(by).rank(1),
        Column::word("known"),
        Column::word("here"),
        Column::word("within"),
        Column::word("holds"),
    ];
    let rows = found.iter().map(|witness| {
        let [known, here, within] = match &witness.figure {
            Figure::Number { known, here, tolerance, unit } => [known, here]
                .map(|value| format!("{} {unit}", number(*value)).trim_end().to_owned())
                .into_iter()
                .chain([format!("{tolerance:.1e}")])
                .collect::<Vec<_>>()
                .try_into()
                .unwrap_or_default(),
            Figure::Digest { known, here } => [known.clone(), here.clone(), "every bit".to_owned()],
        };
        let holds = if witness.holds() { "yes" } else { "NO" };
        vec![witness.claim.clone(), witness.from.to_owned(), known, here, within, holds.to_owned()]
    });
    Table::new(columns).rows(rows)
}

/// Returns the witnesses as JSON.
pub fn json(found: &[Witness]) -> Value {
    let record = |witness: &Witness| {
        let record = Record::default()
            .with("claim", &witness.claim)
            .with("known_by", witness.from)
            .with("holds", witness.holds());
        match &witness.figure {
            Figure::Number { known, here, tolerance, unit } => {
                record.with("known", known).with("here", here).with("tolerance", tolerance).with("unit", unit)
            }
            Figure::Digest { known, here } => record.with("known", known).with("here", here),
        }
    };
    json!(found.iter().map(record).collect::<Records>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_one_witness_that_does_not_hold_is_named_and_ends_with_code_1() {
        let of = |here: f64| Witness {
            claim: "current of a pulse".to_owned(),
            from: "closed form",
            figure: Figure::Number { known: 1.33627, here, tolerance: 1e-9, unit: "A" },
        };
        let good = report(&[of(1.33627), of(1.33627)], false);
        assert_eq!(good.code, 0);
        assert!(good.text.contains("2 of 2 witnesses hold"), "{}", good.text);
        for as_json in [false, true] {
            let bad = report(&[of(1.33627), of(1.3363)], as_json);
            assert_eq!(bad.code, 1);
            assert!(bad.text.contains("current of a pulse") && bad.text.contains("1.3363"), "{}", bad.text);
        }
        assert!(report(&[of(1.3363)], false).text.contains("does not hold: current of a pulse"));
    }
}
