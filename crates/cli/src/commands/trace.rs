//! `standstill trace`: one trial of a campaign with all its waveforms.

mod answer;
mod instant;
mod overlay;
pub mod specimen;
mod verify;

use std::io::Write;

use standstill_detect::MethodName;
use standstill_scenario::Plan;
use standstill_sim::Trace;
use standstill_table::{Columns, Format, Writer};

use crate::answer::{Made, TableFile};

use crate::arguments::{Source, Trace as Options};
use crate::columns::traces::TraceTable;
use crate::commands::question::{Identity, setting};
use crate::doubts;
use crate::error::Error;
use crate::scenario::{self, Shipped, Shorthands};
use crate::shell::asked::NotedQuestion;
use crate::shell::command_line::typed_of;
use crate::shell::setup::Setup;
use crate::shell::{Report, host, interrupt};

/// Returns the command-line options that are shorthands for keys. The rotor angle (`--angle`) is not among them.
fn shorthands(options: &Options) -> Shorthands {
    Shorthands::default().setup(&options.setup).decay(options.decay).with(
        "--method",
        "detector.method",
        options.method.map(MethodName::name),
    )
}

/// Returns the plan of the trial's campaign, with the keys of `source` instead of those on the command line.
fn plan(options: &Options, source: &Source) -> Result<Plan, Error> {
    let shorthands = shorthands(options).with("--angle", "rotor.angle", options.angle);
    // The built-in scenario sets the paper's method. If the user names a method or library, an empty scenario is used instead.
    let keys = &source.keys.set;
    let names = |(key, _): &(String, String)| ["detector.method", "detector.library"].contains(&key.as_str());
    let names_method = options.method.is_some() || source.keys.detector.is_some() || keys.iter().any(names);
    let shipped = if names_method { Shipped::Empty } else { Shipped::Paper };
    let mut document = scenario::document(source, shipped, shorthands)?;
    scenario::vary(&mut document, &options.axes)?;
    let plan = Plan::new(document)?;
    if options.point >= plan.points().len() {
        return Err(Error::Arguments(format!(
            "--point {}: needed from 0 to {}, the last point of the axes",
            options.point,
            plan.points().len() - 1
        )));
    }
    let trials = plan.file().trials;
    if source.scenario.is_some() && options.trial >= trials {
        return Err(Error::Arguments(format!(
            "--trial {}: needed from 0 to {}, the last of the scenario's trials; of a run with more, `-s trials=N` says how many",
            options.trial,
            trials.saturating_sub(1)
        )));
    }
    Ok(plan)
}

pub fn run(options: &Options) -> Result<Report, Error> {
    interrupt::at_once();
    let settings = overlay::settings(&options.source.keys)?;
    if settings.len() > 1 {
        return overlay::run(options, &settings);
    }
    let plan = plan(options, &options.source)?;
    let single = plan.single(options.point, options.trial)?;
    doubts::warn(&single.scenario);
    doubts::warn_standing(&single.scenario);
    let host = host::current();
    let identity = Identity::new(&plan, [])?;
    let said = format!("{}, {}", setting(plan.file(), &single.scenario), trial_of(options));
    // Format and `--verify` are not part of the question: the same trial may replace its files.
    let of = (&identity, options.point, options.trial);
    let asked = NotedQuestion::new("trace", said, &of, options.force.force);
    let in_memory = host.as_ref().is_some_and(|host| !host.files);
    let folder = (!in_memory).then(|| options.out.clone());

    let case = single.case();
    let (record, watched, trace) = single.scenario.traced(&case, true, f64::INFINITY)?;
    if record.is_void() {
        return Err(Error::Arguments("the detector's program raised an error".to_owned()));
    }
    if let Some(host) = &host {
        for table in TraceTable::of(&trace) {
            let mut columns = Columns::new(table.columns(&trace));
            table.rows(&trace, Format::Npz, &mut |row| columns.row(row)).map_err(Error::Table)?;
            host.keep(table.name, columns);
        }
    }
    let verified = options.verify.then(|| verify::numerical_error(&single)).transpose()?;
    let file = plan.file_at(options.point)?;
    let text = plan.text()?;
    let one = answer::Traced {
        options,
        plan: &plan,
        single: &single,
        file: &file,
        identity: &identity,
        record: &record,
        watched: &watched,
        verified: verified.as_ref(),
    };
    let metadata = metadata(&identity, options.point, options.trial);
    let place = options.source.scenario.clone().unwrap_or_default().with_file_name("scenario");
    let varied = plan.file().axes.keys().cloned().collect();
    let files = &identity.of.files;
    let setup = Setup::of(&place, &text, files, varied);
    let made = Made {
        setup: Some(setup),
        command: typed_of(options.source.scenario.as_deref()),
        asked: Some(asked),
        tables: TraceTable::of(&trace)
            .map(|table| written(table, &trace, options.format, &metadata))
            .chain(verified.iter().map(|error| error.table(&metadata)))
            .collect(),
        ..Made::default()
    };
    one.answer(&trace)?.report(folder, host.is_some(), &made)
}

/// Returns a table of a trace as a file that is written row by row. `of` is the identity of the traced trial.
fn written<'a>(
    table: TraceTable,
    trace: &'a Trace,
    format: Format,
    of: &'a [(String, String)],
) -> TableFile<'a> {
    let name = format!("{}.{}", table.name, format.name());
    let rows = Box::new(move |file: &mut (dyn Write + Send)| {
        let mut writer = Writer::new(file, format, table.columns(trace), of)?;
        table.rows(trace, format, &mut |row| writer.row(row))?;
        writer.finish()
    });
    TableFile { name, rows }
}

/// Returns the metadata of the files: program, scenario, point and trial.
fn metadata(identity: &Identity, point: usize, trial: u64) -> Vec<(String, String)> {
    let place = [("point", point.to_string()), ("trial", trial.to_string())];
    let place = place.into_iter().map(|(key, value)| (key.to_owned(), value));
    identity.of.metadata().into_iter().chain(place).collect()
}

/// Returns the phrase that names the requested trial.
fn trial_of(options: &Options) -> String {
    let point = if options.point > 0 { format!(" of point {}", options.point) } else { String::new() };
    format!("trial {}{point}", options.trial)
}
