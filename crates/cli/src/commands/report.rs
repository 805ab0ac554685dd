//! `standstill report`: a finished run as one self-contained page, and its figures.

mod demands;
mod page;
mod study;
mod two;
mod verdict;

use std::path::Path;

use standstill_report::figure::Figure;
use standstill_report::study::figures;

use crate::results::{FinishedRun, say_extension};

use crate::answer::Made;
use crate::arguments::Report;
use crate::error::Error;
use crate::shell::Report as Said;
use crate::shell::asked::NotedQuestion;
use crate::shell::interrupt;

pub fn run(options: &Report) -> Result<Said, Error> {
    interrupt::at_once();
    let default = || (!options.json).then(|| options.folder.join("report"));
    let out = options.out.clone().or_else(default);
    let asked = out.as_deref().map(|out| asked(options, out));
    if let Some(second) = &options.second {
        return two::run(options, second, out, asked);
    }
    let run = FinishedRun::open(&options.folder)?;
    say_extension(&options.folder);
    let figures = if out.is_some() { drawn(&run)? } else { Vec::new() };
    let names: Vec<String> = figures.iter().map(|(name, ..)| format!("{name}.")).collect();
    let made = Made { asked, ..page::made(&run) };
    let said = page::answer(&run, figures).report(out.clone(), options.json, &made)?;
    if let Some(out) = out {
        remove_stale(&out, &names);
    }
    Ok(said)
}

/// Returns the question that the report's files answer. The folders of the runs identify it. If a folder contains another or a longer run
/// later, the question stays the same, and `report` replaces the page.
fn asked(options: &Report, out: &Path) -> NotedQuestion {
    let real = |folder: &Path| folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let first = real(&options.folder);
    // A page inside the folder of its run stays the page of that run if the folder is moved, so the question does not name the folder.
    let beside = out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let own = real(beside) == first;
    let first = if own { "the run beside it".to_owned() } else { first.display().to_string() };
    let (command, said) = match &options.second {
        None => ("report", first),
        Some(second) => ("report A B", format!("{first} and {}", real(second).display())),
    };
    NotedQuestion::place(command, said, options.force.force)
}

/// Returns the page of a finished run. Writes no file, and reads no file outside `fence`.
pub fn html(folder: &Path, fence: &Path) -> Result<String, Error> {
    let run = FinishedRun { fence: Some(fence.to_owned()), ..FinishedRun::open(folder)? };
    page::answer(&run, Vec::new()).page(drawn(&run)?, &page::made(&run)).html().map_err(Error::Page)
}

/// Draws the figures and returns them with their names and captions.
fn drawn(run: &FinishedRun) -> Result<Vec<(String, Figure, String)>, Error> {
    let study = study::study(run, run.cloud()?);
    let captioned = |(name, figure): (String, Figure)| {
        let caption = page::caption(&name, &figure);
        (name, figure, caption)
    };
    Ok(figures(&study).into_iter().map(captioned).collect())
}

/// Removes the figures of an earlier report that the new report does not contain. A reader would take them for figures of the new report.
fn remove_stale(folder: &Path, own: &[String]) {
    let ours =
        ["error_over_angle.", "distribution.", "sweep_", "wrong_poles_", "heat_", "methods.", "scatter."];
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let figure = [".svg", ".png"].iter().any(|end| name.ends_with(end));
        if figure
            && ours.iter().any(|ours| name.starts_with(ours))
            && !own.iter().any(|own| name.starts_with(own.as_str()))
        {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}
