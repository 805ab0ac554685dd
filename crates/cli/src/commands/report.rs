//! `standstill report`: a finished run as one page to mail, and its figures.

mod page;
mod study;
mod two;
mod verdict;

use std::path::{Path, PathBuf};

use serde_json::json;
use standstill_report::figure::Figure;
use standstill_report::study::figures;

use crate::results::Run;
use crate::results::say_extension;
use crate::shell::output::file_list;

use crate::arguments::Report;
use crate::error::Error;
use crate::shell::Report as Said;
use crate::shell::asked::Asked;
use crate::shell::interrupt;
use crate::shell::output::Output;

pub fn run(options: &Report) -> Result<Said, Error> {
    interrupt::at_once();
    if let Some(second) = &options.second {
        let out = folder(options);
        return two::run(options, second, out.map(|out| (out.clone(), asked(options, &out))));
    }
    let run = Run::open(&options.folder)?;
    say_extension(&options.folder);
    let (_, headline, details) = verdict::verdict(&run.summary);
    let mut text = format!("{headline}\n  {}\n", details.join("\n  "));
    if options.json {
        let json = json!({ "headline": headline, "details": details, "run": run.summary.run });
        text = format!("{json:#}\n");
    }
    let Some(out) = folder(options) else { return Ok(Said { text, code: 0 }) };
    let (html, figures) = made(&run)?;
    let names: Vec<String> =
        figures.iter().flat_map(|(name, _)| ["svg", "png"].map(|kind| format!("{name}.{kind}"))).collect();
    let all: Vec<&str> = names.iter().map(String::as_str).chain(["report.html"]).collect();
    let mut output = Output::answering(asked(options, &out), &out, &all)?;
    output.file("report.html", html.as_bytes())?;
    for (name, figure) in &figures {
        output.file(&format!("{name}.svg"), figure.svg()?.as_bytes())?;
        output.file(&format!("{name}.png"), &figure.png()?)?;
    }
    let files = output.finish()?;
    remove_stale(&out, &files);
    if !options.json {
        text += "\n";
        text += &file_list(&out, &files);
    }
    Ok(Said { text, code: 0 })
}

/// The folder for the files, if any are wanted.
fn folder(options: &Report) -> Option<PathBuf> {
    let default = || (!options.json).then(|| options.folder.join("report"));
    options.out.clone().or_else(default)
}

/// What these files answer: of which folders they are. What stands in these may have become more since, or another run: then it is for
/// `report` to make the page anew.
fn asked(options: &Report, out: &Path) -> Asked {
    let real = |folder: &Path| folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let first = real(&options.folder);
    // Beside its own run a page stays that run's, wherever both are moved to.
    let beside = out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let own = real(beside) == first;
    let first = if own { "the run beside it".to_owned() } else { first.display().to_string() };
    let (command, said) = match &options.second {
        None => ("report", first),
        Some(second) => ("report A B", format!("{first} and {}", real(second).display())),
    };
    Asked::place(command, said, options.force.force)
}

/// The page of a finished run, with nothing written and no file read that is not below `fence`.
pub fn html(folder: &Path, fence: &Path) -> Result<String, Error> {
    let run = Run { fence: Some(fence.to_owned()), ..Run::open(folder)? };
    made(&run).map(|(html, _)| html)
}

/// The page and its figures.
fn made(run: &Run) -> Result<(String, Vec<(String, Figure)>), Error> {
    let cloud = run.cloud()?;
    let study = study::study(run, cloud);
    let figures = figures(&study);
    let html = page::page(run, &figures).html().map_err(Error::Page)?;
    Ok((html, figures))
}

/// Figures of an earlier report that this one does not have would be taken for its own.
fn remove_stale(folder: &Path, files: &[String]) {
    let ours =
        ["error_over_angle.", "distribution.", "sweep_", "wrong_poles_", "heat_", "methods.", "scatter."];
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let figure = [".svg", ".png"].iter().any(|end| name.ends_with(end));
        if figure && ours.iter().any(|ours| name.starts_with(ours)) && !files.contains(&name) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}
