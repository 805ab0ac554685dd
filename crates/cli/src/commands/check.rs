//! `standstill check`: the suitability of a motor, and the recommended settings.

mod answer;
mod checked;
mod file;
mod words;

use standstill_analysis::{Demands, Progress, Suitability, Suited, standing};
use standstill_detect::Method;
use standstill_interface::Choice;
use standstill_plant::Motor;
use standstill_scenario::doubts::{self as sheet_doubts, of_sheet, wrong_signature};
use standstill_scenario::{Document, FileError, Origin, Rotor, Scenario};

use self::checked::Checked;
use super::init;
use crate::answer::{Answer, Made, verdict};
use crate::arguments::{Check, Temperatures};
use crate::doubts;
use crate::error::Error;
use crate::scenario::{self, Shorthands};
use crate::shell::terminal::{painted, tell};
use crate::shell::{Report, host, interrupt, progress};

/// Makes the scenario document from the motor or the file that the command line names.
fn document(options: &Check) -> Result<Document, Error> {
    let shorthands = Shorthands::default()
        .with("--errors", "errors", options.errors.map(Choice::name))
        .temperatures(options.temperature)
        .seed(options.seed);
    scenario::of_motor(&options.motor, &options.keys, shorthands)
}

pub fn run(options: &Check) -> Result<Report, Error> {
    interrupt::at_once();
    file::free(options)?;
    let mut document = document(options)?;
    if let Some((standing, _)) = standing(&document).filter(|_| document.origin("rotor.state").is_some()) {
        document = standing;
    }
    let file = document.load_single()?;
    if let Some(library) = &file.detector.library {
        let needed =
            "a scenario without: `check` looks for a method; `compare` sets a library beside the methods";
        return Err(document.refuse("detector.library", &format!("\"{library}\""), needed).into());
    }
    let motor = document.motor()?;
    if init::is_template(&options.motor) {
        tell(&format!(
            "warning: {} is the template that `standstill init` writes: its numbers are of no motor of yours",
            options.motor
        ));
    }
    // If the user names a method, the drive must have the sensors that this method reads. Otherwise `check` tries the methods whose sensors
    // the drive has.
    let asked_for = document.origin("detector.method").is_some();
    let scenario = if asked_for {
        with_movable(&document)?.scenario_of(&motor)?
    } else {
        of_any_method(&with_movable(&document)?, &motor)?
    };
    doubts::warn(&scenario);
    let signature = wrong_signature(&scenario);
    let demands = Demands {
        error_deg: options.tolerance,
        movement_deg: options.movement,
        current_a: options.current,
        time_s: options.time * 1e-3,
        ..Demands::default()
    };
    let spinner = progress::spinner("check");
    let found = Suitability::of(&document, &demands, options.effort, |progress| {
        let (line, message) = heard(progress);
        if let Some(line) = line {
            // The line of a finished method stays on the terminal; a log gets it, too.
            if spinner.is_hidden() && host::current().is_none() {
                tell(&line);
            } else {
                spinner.println(line);
            }
            spinner.inc(1);
        }
        if let Some(message) = message {
            spinner.set_message(message);
        }
    })?;
    spinner.finish_and_clear();
    let asked = Checked {
        motor: &motor,
        named: &options.motor,
        errors: file.errors.0,
        sheet: &document.data_sheet()?,
        demands: &demands,
        effort: options.effort,
        found: &found,
        signature: signature.as_deref(),
        doubts: &of_sheet(&motor),
        meant: &meant(&document, &motor),
        keys: keys(options),
    };
    let is_shown = !options.json && host::current().is_none();
    let written = match found.document(&document)? {
        Some(recommended) if is_shown || options.write.is_some() => {
            Some(file::write(options, &document, &recommended, &asked.head())?)
        }
        _ => None,
    };
    let next = answer::next(&asked, written.as_ref());
    let (tone, word) = asked.word();
    let verdict = verdict(tone, asked.head(), Vec::new());
    let title = format!("Is {} suited?", motor.name);
    let answer = Answer::new("check", title, String::new(), verdict, words::blocks(&asked, &next));
    let json = answer::json(&asked, written.as_ref(), &next);
    let code = u8::from(found.suited() != Suited::Yes);
    let mut report = Answer { json, code, ..answer }.report(None, options.json, &Made::default())?;
    if !options.json {
        report.text = report.text.replacen(word, &painted(tone, word), 1);
    }
    Ok(report)
}

/// Returns the document with a free rotor if it sets a load and no state of the rotor. A locked rotor is refused with a load, but the check
/// itself judges the rotor locked, without the load, and free.
fn with_movable(document: &Document) -> Result<Document, FileError> {
    let mut document = document.clone();
    if document.get("rotor.load").is_some() && document.get("rotor.state").is_none() {
        document.set("rotor.state", Rotor::Free.name(), Origin::CommandLine)?;
    }
    Ok(document)
}

/// Returns the scenario of a document that names no method. If the default method lacks a setting of the table `detector`, this table is
/// ignored.
fn of_any_method(document: &Document, motor: &Motor) -> Result<Scenario<Method<f64>>, FileError> {
    match document.unchecked_scenario_of(motor) {
        Err(error) if error.is_foreign_setting() => {
            let mut document = document.clone();
            document.remove("detector");
            document.unchecked_scenario_of(motor)
        }
        scenario => scenario,
    }
}

/// Returns the keys of the motor's nameplate with the numbers that are probably meant, for a data sheet with doubtful numbers. Empty if
/// there is no guess, or if the data sheet has no such keys.
fn meant(document: &Document, motor: &Motor) -> Vec<(String, String)> {
    let accepted = |numbers: Vec<(&str, String)>| {
        let mut document = document.clone();
        let keys = numbers.into_iter().map(|(key, value)| (format!("motor.nameplate.{key}"), value));
        let keys: Vec<_> = keys.collect();
        for (key, value) in &keys {
            document.set(key, value, Origin::CommandLine).ok()?;
        }
        document.motor().is_ok().then_some(keys)
    };
    sheet_doubts::meant(motor).into_iter().find_map(accepted).unwrap_or_default()
}

/// Returns the scenario keys that the options set, each with its value as text.
fn keys(options: &Check) -> Vec<(String, String)> {
    let Temperatures { winding_temperature, magnet_temperature } = options.temperature;
    let celsius = |value: f64| format!("{value} °C");
    let shorthands = [
        ("errors", options.errors.map(|errors| errors.name().to_owned())),
        ("seed", options.seed.seed.map(|seed| seed.to_string())),
        ("rotor.winding_temperature", winding_temperature.map(celsius)),
        ("rotor.magnet_temperature", magnet_temperature.map(celsius)),
    ];
    let shorthands = shorthands.into_iter().filter_map(|(key, value)| Some((key.to_owned(), value?)));
    shorthands.chain(options.keys.set.iter().cloned()).collect()
}

/// Converts progress to two texts: a line to print, and the name of the current step. Each is none if there is nothing to show.
fn heard(progress: Progress<'_>) -> (Option<String>, Option<String>) {
    match progress {
        Progress::Method(method) => (None, Some(method.name().to_owned())),
        Progress::Found(candidate) => {
            (Some(format!("{}: {}", candidate.method(), words::verdict(candidate))), None)
        }
        Progress::Confirming(setting) => (None, Some(format!("{} on fresh starts", setting.method))),
        Progress::Saturation(share) => (None, Some(format!("saturation of {:.1} %", 100.0 * share))),
        Progress::Change(change) => (None, Some(format!("with {change}"))),
    }
}
