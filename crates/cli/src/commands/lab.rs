//! `standstill lab`: a page in the browser on which one sees what a detection does.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;

use standstill_analysis::{Candidate, Demands, Suitability};
use standstill_lab::{Advice, Bench, Folder, Given, LabError, Server};
use standstill_quantity::Scale;
use standstill_scenario::{Document, FileError, Origin};

use crate::Report;
use crate::arguments::Lab as Options;
use crate::error::Error;
use crate::interrupt;
use crate::scenario::{self, Shorthands};

pub fn run(options: &Options) -> Result<Report, Error> {
    let server =
        Server::bind(options.port.unwrap_or(0), bench(options)?, Box::new(report)).map_err(Error::Lab)?;
    let stopped = Arc::clone(&server);
    interrupt::then(move || stopped.stop());
    crate::print(&format!(
        "The lab is at {}\nWho has this address can use it. Ctrl-C ends the lab.\n",
        server.address()
    ))?;
    if !options.no_browser {
        open(&server.address());
    }
    server.serve();
    Ok(Report { text: "The lab has ended.\n".to_owned(), code: 0 })
}

/// The lab of what the command line names.
fn bench(options: &Options) -> Result<Bench, Error> {
    let folder = |path: &Path| {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        Folder::open(path).map_err(|error| Error::Read(path.to_owned(), error))
    };
    let (document, file, folder) = match &options.place {
        None => (Given::nothing()?.document, None, None),
        Some(path) if path.is_dir() => (Given::nothing()?.document, None, Some(folder(path)?)),
        Some(path) => {
            let beside = path.parent().unwrap_or_else(|| Path::new(""));
            (scenario::read(path)?, Some(path.clone()), Some(folder(beside)?))
        }
    };
    let document = scenario::changed(document, &options.keys, Shorthands::default())?;
    let given = Given { document, file, keys: options.keys.set.clone() };
    let bench = Bench::new(given, folder).map_err(|LabError { message, .. }| Error::Arguments(message))?;
    Ok(bench.advised(Box::new(advice)))
}

/// What `standstill check` recommends for a scenario's motor and drive.
fn advice(document: &Document) -> Result<Advice, String> {
    let suitability =
        Suitability::of(document, &Demands::default(), |_| ()).map_err(|error| error.to_string())?;
    let Some(candidate) = suitability.recommended() else {
        let text = "`check` finds no method that suits this motor and drive: `standstill check` says what each lacks.";
        return Ok(Advice { keys: None, text: text.to_owned() });
    };
    let both = [&candidate.locked, &candidate.free];
    let worst = both.into_iter().max_by(|a, b| a.p95_deg.value.total_cmp(&b.p95_deg.value));
    let text = format!(
        "{}: 95 of 100 errors within {}°, {} wrong poles and {} starts without an angle in {}, a free rotor moves by {}°.",
        candidate.method,
        worst.map_or_else(|| "–".to_owned(), |worst| worst.p95_deg.alone()),
        both.map(|s| s.wrong_poles).into_iter().sum::<u64>(),
        both.map(|s| s.trials - s.found).into_iter().sum::<u64>(),
        both.map(|s| s.trials).into_iter().sum::<u64>(),
        standstill_quantity::number(2, candidate.free.max_moved_deg),
    );
    let keys = keys(document, candidate).map_err(|error| error.to_string())?;
    Ok(Advice { keys: Some(keys), text })
}

/// The keys that make a candidate's detector of a scenario: its method, and what differs from its settings by itself.
fn keys(document: &Document, candidate: &Candidate) -> Result<BTreeMap<String, String>, FileError> {
    let mut document = document.clone();
    document.set("detector.method", candidate.method.name(), Origin::CommandLine)?;
    let plain = document.unchecked_scenario_of(&document.motor()?)?;
    let mut wanted = plain.clone();
    wanted.detector = candidate.settings;
    let mut keys = BTreeMap::from([("detector.method".to_owned(), candidate.method.name().to_owned())]);
    for key in standstill_scenario::keys().into_iter().map(|of| of.key) {
        if !key.starts_with("detector.") || plain.value(&key) == wanted.value(&key) {
            continue;
        }
        let text = match wanted.value(&key) {
            Some(toml::Value::Float(value)) if !standstill_scenario::is_share(&key) => {
                let scale = Scale::suiting(&standstill_scenario::unit(&key).unwrap_or_default(), value.abs());
                format!("{} {}", scale.number(value), scale.unit).trim_end().to_owned()
            }
            Some(value) => standstill_scenario::written(&value),
            None => continue,
        };
        keys.insert(key, text);
    }
    Ok(keys)
}

/// The page of a run.
fn report(folder: &Path, fence: &Path) -> Result<String, String> {
    super::report::html(folder, fence).map_err(|error| error.to_string())
}

/// Opens the page where that can be done; else the address is printed anyway.
fn open(address: &str) {
    let (program, words): (_, &[&str]) = if cfg!(target_os = "macos") {
        ("open", &[])
    } else if cfg!(windows) {
        ("rundll32", &["url.dll,FileProtocolHandler"])
    } else {
        ("xdg-open", &[])
    };
    let quiet = Stdio::null;
    let browser =
        Command::new(program).args(words).arg(address).stdin(quiet()).stdout(quiet()).stderr(quiet()).spawn();
    if let Ok(mut browser) = browser {
        // It may end before the lab does.
        std::thread::spawn(move || browser.wait());
    }
}
