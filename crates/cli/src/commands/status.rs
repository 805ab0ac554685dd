//! `standstill status`: which shards of a run are finished, and which must be submitted again.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;
use standstill_campaign::store::{ShardsError, State, Survey};
use standstill_quantity::count;

use crate::arguments::Status;
use crate::results::{Begun, SUMMARY, SummaryFile, Tables};
use crate::shell::Report;

use crate::error::Error;
use crate::shell::table::Print as _;
use standstill_report::page::{Column, Table};

/// Largest number of shards that are listed; if there are more, only their number is printed.
const MOST_LINES: usize = 40;

pub fn run(options: &Status) -> Result<Report, Error> {
    let survey = match Survey::of(&options.folders) {
        Err(ShardsError::None(folder)) => return finished(&folder, options.json),
        survey => survey?,
    };
    let code = u8::from(!survey.is_done());
    let count = |state| survey.shards.iter().filter(|shard| shard.state == state).count();
    // Of a run without shards nothing has to be submitted again.
    let plain = survey.shards.len() == 1;
    let again = if plain { String::new() } else { survey.again() };
    if options.json {
        let counts: serde_json::Map<_, _> =
            State::ALL.iter().map(|state| (state.name().to_owned(), count(*state).into())).collect();
        let array = (!again.is_empty()).then_some(&again);
        let json =
            json!({ "run": survey.identity, "counts": counts, "array": array, "shards": survey.shards });
        return Ok(Report { text: format!("{json:#}\n"), code });
    }
    let counts = State::ALL.iter().filter(|state| count(**state) > 0);
    let counts: Vec<String> = counts.map(|state| format!("{} {}", count(*state), state.name())).collect();
    let all = survey.shards.len();
    let mut text = if plain {
        format!("a run without shards: {}\n", counts.join(", ").trim_start_matches("1 "))
    } else {
        format!("{all} shards: {}\n", counts.join(", "))
    };
    let open: Vec<_> = survey.shards.iter().filter(|shard| shard.state != State::Done).collect();
    let rows = open.iter().take(MOST_LINES).map(|shard| {
        let left = shard.left.map_or_else(String::new, |left| left.to_string());
        let journal = shard.journal.as_ref().map_or_else(String::new, |path| path.display().to_string());
        vec![shard.index.to_string(), shard.state.name().to_owned(), left, journal]
    });
    if !open.is_empty() {
        text.push('\n');
        let columns = [
            Column::word("shard"),
            Column::word("state"),
            Column::word("trials left"),
            Column::prose("journal"),
        ];
        text += &Table::new(columns).rows(rows).text();
    }
    if open.len() > MOST_LINES {
        let _ = writeln!(text, "… and {} more that are not done", open.len() - MOST_LINES);
    }
    let unreadable = open.iter().find(|shard| shard.state == State::Damaged && shard.left.is_none());
    if let Some(path) = unreadable.and_then(|shard| shard.journal.as_ref()) {
        let _ = writeln!(text, "\n{} has no head that can be read: remove it first.", path.display());
    }
    let stopped = |state| !matches!(state, State::Done | State::Running);
    if plain && open.iter().any(|shard| stopped(shard.state)) {
        text += "\nGive the command that began it again, with --resume: it goes on where the journal ends.\n";
        if let Some(begun) = options.folders.iter().find_map(|folder| Begun::of(folder)) {
            let _ = writeln!(text, "  {} --resume", begun.typed);
        }
    }
    if !again.is_empty() {
        let _ = writeln!(text, "\nSubmit again with --array={again}");
    }
    Ok(Report { text, code })
}

/// Returns the report on a folder that contains no journals, such as the folder of a finished run with its summary and tables.
fn finished(folder: &Path, as_json: bool) -> Result<Report, Error> {
    if !folder.join(SUMMARY).exists() {
        return Err(ShardsError::None(folder.to_owned()).into());
    }
    let summary = SummaryFile::read(folder)?;
    // A table that was changed or removed since is reported as an error.
    for table in summary.tables.iter().flat_map(Tables::names) {
        summary.check(&folder.join(table))?;
    }
    let (run, trials) = (&summary.run, summary.trials());
    let text = if as_json {
        let counts: serde_json::Map<_, _> = State::ALL
            .iter()
            .map(|state| (state.name().to_owned(), i32::from(*state == State::Done).into()))
            .collect();
        format!("{:#}\n", json!({ "run": run, "counts": counts, "array": null, "shards": [] }))
    } else {
        let points = if run.points == 1 { String::new() } else { format!(" at {} points", run.points) };
        format!("a finished run: {} trials{points}; nothing is left to do\n", count(trials))
    };
    Ok(Report { text, code: 0 })
}
