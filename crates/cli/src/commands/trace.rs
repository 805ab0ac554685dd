//! `standstill trace`: one trial of a campaign with all its waveforms.

mod overlay;
pub mod specimen;
mod verify;

use serde_json::json;
use standstill_detect::MethodName;
use standstill_interface::Abc;
use standstill_scenario::{Plan, ScenarioFile};
use standstill_scenario::{Record, Scenario, Verdict};
use standstill_sim::{Ledger, Run, Trace};
use standstill_table::{Columns, Format, Writer};

use crate::arguments::{Source, Trace as Options};
use crate::columns::traces::TraceTable;
use crate::commands::question::{Identity, setting};
use crate::doubts;
use crate::error::Error;
use crate::figures;
use crate::scenario::{self, Shipped, Shorthands};
use crate::shell::Report;
use crate::shell::asked::NotedQuestion;
use crate::shell::output::{Output, file_list};
use crate::shell::{host, interrupt};

/// Returns the plan of the trial's campaign, with the keys of `source` instead of the command line's.
fn plan(options: &Options, source: &Source) -> Result<Plan, Error> {
    let shorthands = Shorthands::default()
        .setup(&options.setup)
        .decay(options.decay)
        .with("--method", "detector.method", options.method.map(MethodName::name))
        .with("--angle", "rotor.angle", options.angle);
    // What is shipped is set up for the paper's method.
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
    let file = plan.file_at(options.point)?;
    let scenario = &single.scenario;
    doubts::warn(scenario);
    let host = host::current();
    let in_memory = host.as_ref().is_some_and(|host| !host.files);
    let tables = TraceTable::ALL.map(|table| format!("{}.{}", table.name, options.format.name()));
    let mut names: Vec<&str> = tables.iter().map(String::as_str).collect();
    names.extend(["result.json", "waveform.svg", "waveform.png"]);
    names.extend(options.verify.then_some("verify.csv"));
    let identity = Identity::new(&plan, [])?;
    let asked = || {
        let said = format!("{}, {}", setting(plan.file(), scenario), trial_of(options));
        // The same trial in another format, or with its numerical error, is no other one.
        let of = (&identity, options.point, options.trial);
        NotedQuestion::new("trace", said, &of, options.force.force)
    };
    let output = if in_memory { None } else { Some(Output::answering(asked(), &options.out, &names)?) };

    let case = single.case();
    let (record, watched, trace) = scenario.traced(&case, true, f64::INFINITY)?;
    if let Some(host) = &host {
        for table in TraceTable::of(&trace) {
            let mut columns = Columns::new(table.columns(&trace));
            table.rows(&trace, Format::Npz, &mut |row| columns.row(row)).map_err(Error::Table)?;
            host.keep(table.name, columns);
        }
    }
    let verified = options.verify.then(|| verify::numerical_error(&single)).transpose()?;
    let mut result = result(&file, scenario, &record, &watched);
    result["version"] = identity.of.version.as_str().into();
    result["numerics"] = identity.of.numerics.into();
    result["scenario"] = plan.text()?.into();
    result["point"] = specimen::point_json(&plan, single.point);
    result["trial"] = single.trial.into();
    result["specimen"] = specimen::json(&case, &single.drawn);
    if let Some(error) = &verified {
        result["numerical_error"] = error.json();
    }
    let json = format!("{result:#}\n");
    let code = u8::from(record.verdict() == Verdict::Error);
    let Some(mut output) = output else {
        return Ok(Report { text: json, code });
    };
    write(&mut output, options, &trace, &metadata(&identity, options.point, options.trial))?;
    if let Some(error) = &verified {
        output.file("verify.csv", error.csv().as_bytes())?;
    }
    output.file("result.json", json.as_bytes())?;
    let about = title(&file, &record, options);
    let figure = figures::detection(
        &trace,
        &about,
        &setting(&file, scenario),
        scenario.sensors.comparator.arrangement,
        super::found(&record),
    );
    output.figure("waveform", &figure)?;
    let files = output.finish()?;
    if host.is_some() {
        return Ok(Report { text: json, code });
    }

    let text = format!(
        "{}\n{}{}{}{}\n{}",
        setting(&file, scenario),
        specimen::heading(&plan, &single),
        summary(&record, &watched),
        specimen::text(&case, &single.drawn),
        verified.map_or_else(String::new, |error| error.text()),
        file_list(&options.out, &files)
    );
    Ok(Report { text, code })
}

/// Writes waveform and events, with the identity of their trial.
fn write(
    output: &mut Output,
    options: &Options,
    trace: &Trace,
    of: &[(String, String)],
) -> Result<(), Error> {
    for table in TraceTable::of(trace) {
        let name = format!("{}.{}", table.name, options.format.name());
        let path = options.out.join(&name);
        let failed = |error| Error::table(&path, error);
        let mut file = output.begin(&name)?;
        let mut writer = Writer::new(&mut file, options.format, table.columns(trace), of).map_err(failed)?;
        table.rows(trace, options.format, &mut |row| writer.row(row)).map_err(failed)?;
        writer.finish().map_err(failed)?;
        output.close(&name, file)?;
    }
    Ok(())
}

/// Returns the metadata of files: program, scenario, point and trial.
fn metadata(identity: &Identity, point: usize, trial: u64) -> Vec<(String, String)> {
    let place = [("point", point.to_string()), ("trial", trial.to_string())];
    let place = place.into_iter().map(|(key, value)| (key.to_owned(), value));
    identity.of.metadata().into_iter().chain(place).collect()
}

/// Returns the figure's title.
fn title(file: &ScenarioFile, record: &Record, options: &Options) -> String {
    let angle = match file.rotor.angle {
        Some(angle) => angle.value().to_string(),
        None => format!("{:.3}", record.start_angle_deg()),
    };
    format!("{}, rotor at {angle}°", trial_of(options))
}

/// Returns the phrase for the requested trial.
fn trial_of(options: &Options) -> String {
    let point = if options.point > 0 { format!(" of point {}", options.point) } else { String::new() };
    format!("trial {}{point}", options.trial)
}

/// Formats the outcome of the trial.
fn ended(record: &Record) -> String {
    match (record.estimated_angle_deg(), record.error_deg()) {
        (Some(angle), Some(error)) => format!("found {angle:.3}°, error {error:+.3}°"),
        _ => format!("{}: {}", record.verdict().name(), record.reason()),
    }
}

fn summary(record: &Record, watched: &Run<f64>) -> String {
    let found = ended(record);
    let work = watched.work;
    format!(
        "rotor at {:.3}°: {found}\nrotor moved {:.3}°, detection took {:.1} ms, largest phase current {:.2} A\n\
         {} evaluations of the core, {} steps, {} segments, {} events; energy balance closes to {:.1e} J\n",
        record.true_angle_deg(),
        record.rotor_moved_deg(),
        record.run.duration.seconds() * 1e3,
        record.run.peak_current,
        work.derivatives,
        work.steps,
        work.segments,
        work.events,
        watched.ledger.map_or(0.0, |ledger| ledger.imbalance()),
    )
}

fn result<S>(
    file: &ScenarioFile,
    scenario: &Scenario<S>,
    record: &Record,
    watched: &Run<f64>,
) -> serde_json::Value {
    let run: &Run<f64> = &record.run;
    let lines = |abc: Abc<f64>, factor: f64| {
        let Abc([ab, bc, ca]) = abc;
        json!({ "ab": ab * factor, "bc": bc * factor, "ca": ca * factor })
    };
    let f = record.findings();
    json!({
        "setup": super::setup_json(file, &scenario.motor),
        "method": file.detector.name(),
        "start_angle_deg": record.start_angle_deg(),
        "true_angle_deg": record.true_angle_deg(),
        "resolver_angle_deg": run.resolver_angle.to_degrees().rem_euclid(360.0),
        "outcome": record.verdict().name(),
        "reason": record.reason(),
        "estimated_angle_deg": record.estimated_angle_deg(),
        "axis_deg": record.axis_deg(),
        "error_deg": record.error_deg(),
        "pole_correct": record.pole_correct(),
        "rotor_moved_deg": record.rotor_moved_deg(),
        "duration_s": run.duration.seconds(),
        "peak_current_A": run.peak_current,
        "line_inductance_mH": f.line_inductance.map(|l| lines(l, 1e3)),
        "line_resistance_ohm": f.line_resistance.map(|r| lines(r, 1.0)),
        "L_A_mH": f.mean_inductance.map(|l| l * 1e3),
        "L_B_mH": f.saliency.map(|l| l * 1e3),
        "i_d_along_A": f.polarity.map(|p| p.along),
        "i_d_against_A": f.polarity.map(|p| p.against),
        "angle_deviation_deg": f.angle_deviation.map(f64::to_degrees),
        "pole_error_probability": f.pole_error,
        "pole_evidence_deviations": f.pole_evidence.map(|e| e.deviations),
        "pole_evidence_needed": f.pole_evidence.map(|e| e.needed),
        "sensor_gain": f.sensor_gain.map(|g| g.0),
        "polarity_margin_A": f.polarity.map(|p| p.margin()),
        "energy_J": watched.ledger.as_ref().map(energies),
        "right_hand_sides": watched.work.derivatives,
    })
}

/// Returns the energy balance of a run, in J, as JSON.
fn energies(ledger: &Ledger) -> serde_json::Value {
    let mut json = json!(ledger);
    json["imbalance"] = ledger.imbalance().into();
    json
}
