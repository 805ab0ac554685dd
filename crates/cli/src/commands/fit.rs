//! `standstill fit`: a motor's data identified from scope traces.

mod answer;
mod drive;
mod next;
mod prediction;

use std::path::{Path, PathBuf};

use standstill_fit::record::{LINK, Record, RecordError};
use standstill_fit::{MOST_USED, Start, fit, is_like};
use standstill_plant::{DataSheet, Files, Motor, built_in};
use standstill_scenario::Document;

use self::drive::{DRIVE_KEYS, SETTLE_KEY, estimate_of};
use crate::answer::{Answer, Made};
use crate::arguments::{Fit as Options, Keys};
use crate::error::Error;
use crate::scenario::{self, Shorthands};
use crate::shell::asked::NotedQuestion;
use crate::shell::{Report, interrupt, progress};

const FILES: [&str; 8] = [
    "motor.toml",
    "fit.csv",
    "fit.json",
    "fit.html",
    "fit.svg",
    "fit.png",
    "prediction.svg",
    "prediction.png",
];

fn read(path: &Path) -> Result<Record, Error> {
    let bytes = Files::default().read(path).map_err(|error| Error::Read(path.to_owned(), error))?;
    let file = path.display().to_string();
    match std::str::from_utf8(&bytes) {
        Ok(text) => Record::parse(&file, text).map_err(Error::Record),
        Err(error) => {
            let line = bytes[..error.valid_up_to()].split(|byte| *byte == b'\n').count();
            let found = "bytes that are no UTF-8".to_owned();
            let needed = "a text with commas between its columns".to_owned();
            Err(Error::Record(RecordError { file, line: Some(line), column: None, found, needed }))
        }
    }
}

/// Returns the motor and the drive with which the fit begins.
fn start(options: &Options, records: &[Record]) -> Result<Start, Error> {
    if let Some((key, _)) = options.set.iter().find(|(key, _)| !DRIVE_KEYS.contains(&key.as_str())) {
        let known = DRIVE_KEYS.join(", ");
        return Err(Error::Arguments(format!(
            "-s {key}: needed a key of the drive that a fit uses: {known}"
        )));
    }
    let shorthands = Shorthands::default().with("--motor", "motor", options.motor.as_deref());
    let mut keys = Keys { set: options.set.clone(), detector: None };
    if records.iter().any(|record| record.channels[LINK]) {
        keys.set.push(("sensors.arrangement".to_owned(), "dc-link-shunt".to_owned()));
    } else if options.set.iter().any(|(key, _)| key == SETTLE_KEY) {
        let message =
            format!("-s {SETTLE_KEY}: needed a trace with i_link_A, the current of a shunt in the DC link");
        return Err(Error::Arguments(message));
    }
    let document = scenario::changed(Document::parse(Path::new("scenario"), "")?, &keys, shorthands)?;
    let motor = options.motor.as_ref().map(|_| document.motor()).transpose()?;
    let drive_of = if let Some(motor) = &motor {
        motor.clone()
    } else {
        // The default devices depend on the rated current and the link's voltage, so the recorded maxima stand in for them.
        let rows = || records.iter().flat_map(|record| &record.rows);
        let currents = rows().flat_map(|row| row.current).filter(|i| i.is_finite());
        let current = currents.fold(0.0, |most, i| i.abs().max(most));
        let link = rows().map(|row| row.link).fold(0.0, f64::max);
        let like = built_in("paper-5k5").ok_or_else(|| Error::UnknownMotor("paper-5k5".to_owned()))?;
        Motor { rated_current: current.max(1e-6), dc_link: Some(link), ..like }
    };
    let stated = options.set.iter().map(|(key, _)| estimate_of(key).to_owned()).collect();
    let scenario = document.unchecked_scenario_of(&drive_of)?;
    let (devices, dead_time) = (scenario.drive.bridge.devices, scenario.drive.dead_time.seconds());
    let settle = scenario.sensors.settle.seconds();
    Ok(Start { motor, devices, dead_time, stated, settle, most_used: MOST_USED })
}

/// Returns true if both paths lead to the same existing file.
fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Checks that no trace is given twice, and that no output file would overwrite an input file.
fn distinct(options: &Options) -> Result<(), Error> {
    let traces: Vec<&Path> = options.traces.iter().chain(&options.predict).map(PathBuf::as_path).collect();
    for (k, trace) in traces.iter().enumerate() {
        if traces[..k].iter().any(|before| same_file(before, trace)) {
            let path = trace.display();
            return Err(Error::Arguments(format!(
                "{path}: found the same file twice; needed: each trace once"
            )));
        }
    }
    let motor = options.motor.as_ref().map(Path::new);
    for input in traces.into_iter().chain(motor) {
        if let Some(name) = FILES.iter().find(|name| same_file(input, &options.out.join(name))) {
            let (out, input) = (options.out.display(), input.display());
            return Err(Error::Arguments(format!(
                "--out {out}: {name} there is {input}, which is read; needed: another folder"
            )));
        }
    }
    Ok(())
}

pub fn run(options: &Options) -> Result<Report, Error> {
    interrupt::at_once();
    distinct(options)?;
    let records = options.traces.iter().map(|path| read(path)).collect::<Result<Vec<_>, _>>()?;
    let unseen = options.predict.iter().map(|path| read(path)).collect::<Result<Vec<_>, _>>()?;
    let channels = std::array::from_fn(|k| records.iter().any(|record| record.channels[k]));
    for record in &unseen {
        // A mistake is reported before the long search.
        is_like(record, records[0].angle.is_some(), channels).map_err(Error::Fit)?;
    }
    let start = start(options, &records)?;
    let names: Vec<String> = options.traces.iter().map(|path| path.display().to_string()).collect();
    let of = (&records, &unseen, &start, &options.motor, &options.set);
    let asked = NotedQuestion::new("fit", names.join(", "), &of, options.force.force);
    // A mistake is reported before the long search.
    asked.guard(&options.out, &FILES)?;
    let spinner = progress::spinner("fitting");
    let fitted = fit(&records, &start, &|| {
        spinner.inc(1);
        false
    });
    spinner.finish_and_clear();
    let fitted = fitted.and_then(|fit| fit.with_a_resistance(&records)).map_err(Error::Fit)?;
    let predicted = unseen.iter().map(|record| fitted.predict(record, &start));
    let predicted = predicted.collect::<Result<Vec<_>, _>>().map_err(Error::Fit)?;
    let sheet = fitted.sheet(&names.join(", "), start.motor.as_ref());
    // Checks that the data sheet can be read again.
    DataSheet::parse("motor.toml", &sheet).and_then(|sheet| sheet.motor()).map_err(Error::Motor)?;
    let answer = Answer {
        files: vec![("motor.toml", sheet.into_bytes())],
        ..answer::of(&fitted, &predicted, &records, &names, options)
    };
    answer.report(Some(options.out.clone()), options.json, &Made { asked: Some(asked), ..Made::default() })
}
