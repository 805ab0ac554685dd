//! `standstill lab`: an interactive page in the browser that shows a detection.

use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;

use standstill_analysis::{Demands, Effort, Suitability};
use standstill_lab::{Advice, Bench, Folder, Given, LabError, Server};
use standstill_scenario::Document;

use crate::arguments::Lab as Options;
use crate::error::Error;
use crate::scenario::{self, Shorthands};
use crate::shell::{Report, interrupt};

pub fn run(options: &Options) -> Result<Report, Error> {
    let server =
        Server::bind(options.port.unwrap_or(0), bench(options)?, Box::new(report)).map_err(Error::Lab)?;
    let stopped = Arc::clone(&server);
    interrupt::then(move || stopped.stop());
    crate::shell::terminal::print(&format!(
        "The lab is at {}\nWho has this address can use it. Ctrl-C ends the lab.\n",
        server.address()
    ))?;
    if !options.no_browser {
        open(&server.address());
    }
    server.serve();
    Ok(Report { text: "The lab has ended.\n".to_owned(), code: 0 })
}

/// Makes the lab of the scenario or folder that the command line names.
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

/// Returns the recommendation of `standstill check` for a scenario's motor and drive.
fn advice(document: &Document) -> Result<Advice, String> {
    let suitability = Suitability::of(document, &Demands::default(), Effort::Normal, |_| ())
        .map_err(|error| error.to_string())?;
    let (Some(candidate), Some(confirmed)) = (suitability.recommended(), suitability.confirmed()) else {
        let text = "`check` finds no method that suits this motor and drive: `standstill check` says what each lacks.";
        return Ok(Advice { keys: None, text: text.to_owned() });
    };
    let condition =
        if suitability.condition.is_some() { " on a condition: see `standstill check`" } else { "" };
    let text = format!(
        "{}{condition}: 95 of 100 errors within {}° at most, {} wrong poles in {} fresh starts with the rotor locked and free, \
         a free rotor moves by {}°.",
        candidate.method(),
        standstill_quantity::number(2, confirmed.p95_at_most_deg),
        confirmed.wrong_poles,
        standstill_quantity::count(confirmed.starts),
        standstill_quantity::number(2, confirmed.moved_deg),
    );
    Ok(Advice { keys: Some(candidate.setting.in_scenario().into_iter().collect()), text })
}

/// Returns the HTML page of the finished run in `folder`. Files outside the folder `fence` are not read.
fn report(folder: &Path, fence: &Path) -> Result<String, String> {
    super::report::html(folder, fence).map_err(|error| error.to_string())
}

/// Opens the page in a browser if possible. The user also sees the address on the terminal.
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
        // The thread waits for the browser's process, which may end before the lab.
        std::thread::spawn(move || browser.wait());
    }
}
