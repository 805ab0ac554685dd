//! Pages of reports and explanations that are older than the data beside them: they are marked as outdated.

use std::path::Path;

use standstill_files::read_text;

use crate::shell::asked::rewrite;

use crate::error::Error;
use crate::shell::command_line::quoted;

/// Pages in a run's folder. Each entry contains the subfolder, the file name, and the command that makes the page.
const PAGES: [(&str, &str, &str); 2] = [
    ("report", "report.html", "standstill report FOLDER"),
    ("report", "comparison.html", "standstill report FOLDER OTHER"),
];

/// How the names of the folders of `explain` begin, with the options that select its trials.
const SELECTIONS: [(&str, &str); 4] = [
    ("trial-", "--trial"),
    ("worst-", "--worst"),
    ("unanswered-", "--unanswered --worst"),
    ("wrong-poles-", "--wrong-poles --worst"),
];

/// Returns all pages, including those of `explain`, which has a folder for each selection of trials.
fn pages(folder: &Path) -> Vec<(String, &'static str, String)> {
    let mut pages = PAGES.map(|(place, name, command)| (place.to_owned(), name, command.to_owned())).to_vec();
    let folders = std::fs::read_dir(folder.join("explain")).into_iter().flatten().flatten();
    let mut names: Vec<String> = folders.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    pages.extend(names.into_iter().filter_map(|name| {
        let command = format!("standstill explain FOLDER{} --force", options_of(&name)?);
        Some((format!("explain/{name}"), "explain.html", command))
    }));
    pages
}

/// Text at the begin of a page's visible content. The note is inserted before this text.
const BEFORE: &str = "<header class=\"top\">";

/// Returns the note for a page whose run has been extended or replaced.
fn note(command: &str) -> String {
    format!(
        "<p class=\"verdict bad\" role=\"alert\"><strong>This page is older than the data beside it: these have been extended, or are of \
         another run by now. <code>{command}</code> makes it anew.</strong></p>"
    )
}

/// Inserts the note into each outdated page of a run's folder. Returns a message for each page.
///
/// # Errors
/// A page cannot be written.
pub fn mark(folder: &Path) -> Result<Vec<String>, Error> {
    let mut said = Vec::new();
    for (place, name, command) in pages(folder) {
        let of = folder.join(&place);
        let Ok(page) = read_text(&of.join(name)) else { continue };
        let note = note(&command);
        if !page.contains(&note) {
            rewrite(&of, name, page.replacen(BEFORE, &format!("{note}{BEFORE}"), 1).as_bytes())?;
        }
        let command = command.replace("FOLDER", &quoted(&folder.display().to_string()));
        said.push(format!("{place}/{name}, which is older: `{command}` makes it anew"));
    }
    Ok(said)
}

/// Returns the options of `explain` that are encoded in the name of its folder. Returns none for other names.
fn options_of(name: &str) -> Option<String> {
    let (of, point) = name
        .split_once("-point-")
        .map_or((name, String::new()), |(of, point)| (of, format!(" --point {point}")));
    SELECTIONS
        .iter()
        .find_map(|(begin, options)| Some(format!(" {options} {}{point}", of.strip_prefix(begin)?)))
}
