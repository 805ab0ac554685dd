//! The answer of `report` on a single finished run.

use std::path::Path;

use serde_json::json;
use standstill_report::figure::{Figure, Layer};
use standstill_report::page::Section;

use super::verdict::{next, verdict};
use crate::answer::{self, Answer, Made};
use crate::results::{FinishedRun, SummaryFile};
use crate::shell::command_line::quoted;
use crate::shell::setup::{Setup, setting};
use crate::summary;

/// Makes the answer about a run from its figures. A terminal shows only the verdict, because `run` has already printed the results.
pub fn answer(run: &FinishedRun, figures: Vec<(String, Figure, String)>) -> Answer {
    let (tone, headline, details) = verdict(run);
    let next = next(run, tone);
    let json = json!({ "headline": headline, "details": details, "run": run.summary.run });
    let verdict = Section::new("Verdict", [answer::verdict(tone, headline, details)]);
    let results = summary::sections(&run.summary).into_iter().map(Section::aside);
    let answer = Answer {
        name: "report",
        title: "Initial rotor position: Monte Carlo".to_owned(),
        sections: std::iter::once(verdict).chain(results).collect(),
        figures,
        json,
        ..Answer::default()
    };
    next.into_iter().fold(answer, |answer, (purpose, command)| answer.next(purpose, command))
}

/// Returns the origin of a run's page: setup, facts, and the commands that reproduce it.
pub fn made(run: &FinishedRun) -> Made<'_> {
    let identity = &run.summary.run;
    let varied = run.file.axes.keys().cloned().collect();
    let setup = Setup::of(Path::new("scenario"), &identity.scenario, &identity.files, varied);
    let setup = Setup { fence: run.fence.as_deref(), ..setup };
    let axes = (!run.summary.points.is_empty()).then(|| {
        let keys: Vec<&str> = run.file.axes.keys().map(String::as_str).collect();
        [("Axes", keys.join(", ")), ("Points", run.summary.points.len().to_string())]
    });
    let facts = [
        ("Trials", trials(&run.summary)),
        ("Seed", identity.seed.to_string()),
        ("Program", format!("Standstill {}", identity.version)),
        ("Folder", run.folder.display().to_string()),
    ];
    let doubt = identity.motor_note.clone().map(|note| ("Motor's numbers", note));
    let facts =
        axes.into_iter().flatten().chain(facts).chain(doubt).map(|(name, value)| (name.to_owned(), value));
    let subtitle = setting(&run.file);
    Made { setup: Some(setup), subtitle, facts: facts.collect(), command: commands(run), ..Made::default() }
}

/// Formats the number of trials of a run. For a sweep, formats the number of trials at each point.
fn trials(summary: &SummaryFile) -> String {
    let all = summary.trials();
    let each = || summary.points.iter().map(|point| point.summary.trials);
    match (each().min(), each().max()) {
        (Some(least), Some(most)) if least == most => format!("{least} at each point, {all} in all"),
        (Some(least), Some(most)) => format!("{least} to {most} at a point, {all} in all"),
        _ => all.to_string(),
    }
}

/// Returns the caption of a figure.
pub fn caption(name: &str, figure: &Figure) -> String {
    let mut layers = figure.panels.iter().flat_map(|panel| &panel.layers);
    let text = match name.split('_').next() {
        // A figure of few starts has no band.
        Some("error") if layers.any(|layer| matches!(layer, Layer::Band { .. })) => {
            "The band holds 90 % of the errors at each angle. Wrong poles are marked at the edge."
        }
        Some("error") => "Wrong poles are marked at the edge.",
        Some("distribution") => "Wrong poles are not in it: they are counted by themselves.",
        Some("heat") => {
            "Rms error at each point. Hatched cells are not to be chosen, whatever the error of the starts that had an answer."
        }
        Some("sweep") => "Each mark is a point of the sweep with its 95 % interval.",
        _ => "Bars are 95 % intervals. What never happened is shown as its upper limit.",
    };
    text.to_owned()
}

/// Returns the commands that reproduce the run and this page.
fn commands(run: &FinishedRun) -> String {
    let format = run.format_option();
    let out = quoted(&run.folder.display().to_string());
    format!("standstill run scenario.toml --out {out}{format}\nstandstill report {out}")
}
