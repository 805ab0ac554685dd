//! `standstill run` and `standstill sweep`: run the trials of a scenario file and write the results into files.

mod earlier;
pub mod isolated;
mod opening;
pub mod results;

use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use standstill_campaign::Statistics;
use standstill_campaign::store::{
    Earlier, Identity, Journal, JournalError, Keep, Row, Shard, Shards, Sweep as Trials, Tally, beside,
};
use standstill_files::read_text;
use standstill_quantity::{Quantity, count};
use standstill_scenario::{Document, Origin, Plan};

use self::earlier::Found;
use self::results::Results;
use super::question::{check_command, given};
use crate::arguments::{Amount, Keys, Results as Options, Rows, Run, Sweep};
use crate::doubts;
use crate::error::Error;
use crate::results::{Begun, STATISTICS, SUMMARY, SummaryFile, files_wanted, guard};
use crate::scenario::{self, Shorthands};
use crate::shell::command_line::{self, quoted, to_resume};
use crate::shell::interrupt::{self, INTERRUPTED};
use crate::shell::output::Output;
use crate::shell::terminal::{for_reading, paragraph, tell};
use crate::shell::{Report, host, progress};

pub fn run(options: &Run) -> Result<Report, Error> {
    carry_out(options, document_of(options)?)
}

pub fn sweep(options: &Sweep) -> Result<Report, Error> {
    let mut document = document_of(&options.run)?;
    scenario::vary(&mut document, &options.axes)?;
    if document.load()?.axes.is_empty() {
        return Err(Error::Arguments(format!(
            "{} has no axes: needed --vary KEY=FROM:TO:N or a table [axes]; without them it is `standstill run`",
            options.run.scenario.display()
        )));
    }
    carry_out(&options.run, document)
}

/// Returns the document of a scenario file with the changes from the command line.
pub fn document(
    path: &Path,
    keys: &Keys,
    Amount { trials, seed, stop_at }: &Amount,
) -> Result<Document, Error> {
    let shorthands = Shorthands::default().trials(*trials).seed(*seed);
    let mut document = scenario::changed(scenario::read(path)?, keys, shorthands)?;
    for (key, value) in stop_at {
        document.set(&format!("stop_at.{key}"), value, Origin::CommandLine)?;
    }
    Ok(document)
}

/// Returns the document of a run's options.
fn document_of(options: &Run) -> Result<Document, Error> {
    document(&options.scenario, &options.keys, &options.amount)
}

fn carry_out(options: &Run, document: Document) -> Result<Report, Error> {
    options.amount.check(options.rows)?;
    if options.isolate && !cfg!(feature = "program") {
        // A host program that contains this library cannot be started again as a worker.
        return Err(Error::Arguments("--isolate needs a process of the program `standstill`".to_owned()));
    }
    // A plan of many points takes time, and an interrupt finds nothing to keep.
    interrupt::at_once();
    let plan = if options.isolate { isolated::plan(&document)? } else { progress::plan(document)? };
    let trials = Trials { plan: &plan, shard: options.shard, threads: options.threads.map(usize::from) };
    let identity = trials.identity()?;
    let out = &options.results.out;
    let whole = options.shard == Shard::WHOLE;
    let path = out.join(options.shard.file_name());
    let stop = interrupt::flag();
    // The output is made and removed again, so that files that cannot be written are reported before the first trial.
    drop(Output::create(out, &results::names(options))?);
    if !whole {
        beside(out, &identity, options.results.force)?;
    }
    if path.exists() && !options.resume {
        make_way(&path, options.results.force)?;
    }
    if !path.exists()
        && options.resume
        && whole
        && let Some(report) = finished(options, &identity)?
    {
        return Ok(report);
    }
    guard(&options.results, &identity.whole(), options.resume)?;
    let first = plan.scenario(0)?;
    doubts::warn(&first);
    if plan.file().axes.is_empty() {
        doubts::warn_standing(&first);
    }
    std::fs::create_dir_all(out).map_err(Error::writing(out))?;
    let begun = Begun {
        scenario: options.scenario.to_string_lossy().into_owned(),
        line: given(&options.scenario.to_string_lossy(), &options.keys, options.amount.seed),
        typed: command_line::begun(),
        check: check_command(&options.scenario, &options.keys, options.amount.seed, plan.file()),
    };
    let mut statistics = Statistics::default();
    let mut found = if options.resume { Found::of(out, &identity)? } else { Found::default() };
    // A new run gets its note before its journal. A run that is continued gets its note after this process has locked the journal.
    let is_new = !path.exists();
    if is_new {
        begun.note(out)?;
    }
    let clear = || {
        if is_new {
            Begun::forget(out);
        }
        remove_if_empty(out);
    };
    // The journal stays locked until its rows are in the files.
    let outcome = match options.rows {
        Rows::All => {
            let mut journal = journal(&path, &identity, &mut statistics).inspect_err(|_| clear())?;
            if !is_new {
                begun.note(out)?;
            }
            say(options, &plan, &identity)?;
            advance(&trials, &mut found.rows, &mut journal, statistics, &stop)
                .and_then(|done| if done { write(options, &path, &stop, &begun) } else { Ok(None) })
        }
        Rows::None => {
            let limit = plan.file().limit.map_or(Statistics::LIMIT_DEG, Quantity::value);
            let mut tally = Tally::open(&path, &identity, limit).inspect_err(|_| clear())?;
            for earlier in &found.tallies {
                tally = tally.after(earlier);
            }
            if !is_new {
                begun.note(out)?;
            }
            say(options, &plan, &identity)?;
            advance(&trials, &mut found.rows, &mut tally, statistics, &stop)
                .and_then(|done| if done { write(options, &path, &stop, &begun) } else { Ok(None) })
        }
    };
    match outcome {
        Ok(Some(mut report)) => {
            found.remove();
            let statistics = options.rows == Rows::None && !found.tallies.is_empty();
            if (found.rows.taken() > 0 || statistics) && !options.results.json {
                report.text += &paragraph("", &found.said(out));
            }
            Ok(report)
        }
        Ok(None) => Ok(interrupted(&options.results, &path)),
        Err(error) => {
            // The caller prints the error itself.
            if path.exists() {
                tell(&format!(
                    "what was done is kept in {}; once the cause is gone, --resume goes on",
                    path.display()
                ));
            }
            Err(error)
        }
    }
}

/// Prints motor, method, conditions and number of trials before the first trial, after all checks have passed.
fn say(options: &Run, plan: &Plan, identity: &Identity) -> Result<(), Error> {
    if options.results.json || host::current().is_some() {
        return Ok(());
    }
    crate::shell::terminal::print(&for_reading(opening::text(plan, identity, options.shard) + "\n"))
}

/// Opens the journal of rows. Rows of an existing journal are added to the statistics.
fn journal(path: &Path, identity: &Identity, statistics: &mut Statistics) -> Result<Journal, Error> {
    if !path.exists() {
        return Ok(Journal::create(path, identity)?);
    }
    let journal = Journal::resume(path, identity, |_, row| statistics.add_row(row))?;
    if let Some(aside) = journal.damaged() {
        tell(&format!(
            "a block of {} is damaged; what stood behind it is in {} and is computed again",
            path.display(),
            aside.display()
        ));
    }
    Ok(journal)
}

/// Removes the folder if it is empty.
fn remove_if_empty(folder: &Path) {
    let _ = std::fs::remove_dir(folder);
}

/// Writes the files of a run from its complete journal. Returns none if interrupted.
fn write(options: &Run, path: &Path, stop: &AtomicBool, begun: &Begun) -> Result<Option<Report>, Error> {
    if options.shard != Shard::WHOLE {
        if options.results.json {
            let json =
                serde_json::json!({ "shard": options.shard.to_string(), "journal": path, "done": true });
            return Ok(Some(Report { text: format!("{json:#}\n"), code: 0 }));
        }
        let text = format!(
            "Shard {} is done: {}\nOnce all {} are there, put them together with\n  standstill merge FOLDERS --out DIR\n",
            options.shard,
            path.display(),
            options.shard.count
        );
        return Ok(Some(Report { text, code: 0 }));
    }
    let shards = Shards::single(path)?;
    let Some(results) = Results::write(&options.results, &shards, stop)? else { return Ok(None) };
    // The journal is removed only now that the files are in place. Of a run without rows it is kept under another name, because only the
    // journal can be extended.
    if options.rows == Rows::None && files_wanted() {
        let kept = options.results.out.join(STATISTICS);
        std::fs::rename(path, &kept).map_err(Error::writing(&kept))?;
    } else {
        std::fs::remove_file(path).map_err(Error::writing(path))?;
    }
    Ok(Some(results.report(&options.results, Some(begun))))
}

/// Runs the missing trials. Returns false if the user interrupted the run. `earlier`: rows of earlier runs, which are not simulated again.
fn advance(
    trials: &Trials<'_>,
    earlier: &mut Earlier,
    journal: &mut impl Keep,
    mut statistics: Statistics,
    stop: &AtomicBool,
) -> Result<bool, Error> {
    let bar = progress::bar(statistics.trials() + journal.walk().left());
    bar.set_position(statistics.trials());
    bar.reset_eta();
    let points = trials.plan.points().len();
    let done = trials.run_after(earlier, journal, stop, |point: usize, rows: &[Row]| {
        bar.inc(rows.len() as u64);
        bar.set_message(so_far(points, point, rows, &mut statistics));
    });
    bar.finish_and_clear();
    Ok(done?)
}

/// Returns the progress as text. For a run without sweep axes it is the rms error so far. For a sweep it is the number of the point,
/// because an error over all points would depend on the user's choice of points.
fn so_far(points: usize, point: usize, rows: &[Row], statistics: &mut Statistics) -> String {
    if points > 1 {
        return format!("point {} of {points}", point + 1);
    }
    for row in rows {
        statistics.add_row(row);
    }
    format!("rms {}°", statistics.rms().alone())
}

/// Returns the report if this folder already contains the files of the run.
fn finished(options: &Run, identity: &Identity) -> Result<Option<Report>, Error> {
    let names = results::names(options);
    let options = &options.results;
    let path = options.out.join(SUMMARY);
    // Files of trials in another format do not count as finished.
    if names.is_empty() || names.iter().any(|name| !options.out.join(name).exists()) {
        return Ok(None);
    }
    let summary = match SummaryFile::read(&options.out) {
        // An unreadable summary is replaced.
        Err(_) if options.force => return Ok(None),
        summary => summary?,
    };
    if summary.run.begins(identity) {
        return Ok(None);
    }
    if let Some(difference) = summary.run.difference(identity) {
        if options.force {
            return Ok(None);
        }
        return Err(Error::another("run", path, &difference));
    }
    for table in names.iter().filter(|name| **name != SUMMARY) {
        match summary.check(&options.out.join(table)) {
            Err(_) if options.force => return Ok(None),
            checked => checked?,
        }
    }
    let code = u8::from(summary.errors() > 0);
    let text = if options.json {
        read_text(&path).map_err(|error| Error::Read(path, error))?
    } else {
        crate::results::say_extension(&options.out);
        let trials = count(identity.trials);
        let mut said =
            format!("{} has the results of {trials} trials; nothing to do.\n", options.out.display());
        if names.len() > 1 {
            let _ = writeln!(
                said,
                "A page of them:\n  standstill report {}",
                quoted(&options.out.to_string_lossy())
            );
        }
        said
    };
    Ok(Some(Report { text, code }))
}

/// Removes an existing journal if `force` is true, and refuses the run otherwise. Never removes a journal that another process uses.
fn make_way(path: &Path, force: bool) -> Result<(), Error> {
    if Journal::is_busy(path) {
        return Err(Error::Journal(JournalError::Busy(path.to_owned())));
    }
    if force {
        return std::fs::remove_file(path).map_err(Error::writing(path));
    }
    Err(Error::unfinished(path, "trials of a run that is not finished, or of a shard"))
}

fn interrupted(options: &Options, path: &Path) -> Report {
    let command = to_resume();
    if options.json {
        let json = serde_json::json!({ "interrupted": true, "journal": path, "resume": command });
        return Report { text: format!("{json:#}\n"), code: INTERRUPTED };
    }
    let text = format!("Interrupted: what was done is kept in {}. Go on with\n  {command}\n", path.display());
    Report { text, code: INTERRUPTED }
}
