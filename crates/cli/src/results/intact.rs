//! Whether `summary.json` is unchanged since the run wrote it: the file contains a digest of itself.
//!
//! The digest covers the text without white space and without the digest's own member, so that a file that was only
//! reformatted still counts as unchanged.

use std::path::Path;

use standstill_files::{Digest, read_text};

use super::names::SUMMARY;
use crate::error::Error;
use crate::shell::command_line::quoted;
use crate::shell::terminal::tell;

fn squeezed(text: &str) -> String {
    text.chars().filter(|c| !c.is_ascii_whitespace()).collect()
}

/// Returns the digest of a summary. The summary's text must not contain a digest yet.
pub fn digest(text: &str) -> String {
    Digest::of(squeezed(text).as_bytes()).to_string()
}

/// Returns true if a summary's text does not match its digest. This works even if the text cannot be parsed.
pub fn is_changed(text: &str) -> bool {
    const BEGIN: &str = ",\"digest\":\"";
    let text = squeezed(text);
    let Some((before, rest)) = text.split_once(BEGIN) else { return false };
    let Some((kept, after)) = rest.split_once('"') else { return true };
    squeezed(&digest(&format!("{before}{after}"))) != kept
}

/// Returns true if [`is_changed`] is true for the text of a summary file.
pub fn is_changed_file(path: &Path) -> bool {
    read_text(path).is_ok_and(|text| is_changed(&text))
}

/// Returns the error of a changed summary, with advice on how to proceed.
pub fn changed(path: &Path) -> Error {
    let folder = path.parent().unwrap_or(Path::new(""));
    let needed = format!(
        "the file as it was written: put it back, or repeat the command of the run with --force --out {}: `run` in it says which",
        quoted(&folder.to_string_lossy())
    );
    let found = "numbers or words that the run did not write: its digest is that of another text";
    Error::results(path, found, needed)
}

/// Prints a note that an older version wrote the summary without a digest, so that later changes cannot be detected.
pub fn say_unsealed(folder: &Path) {
    tell(&format!(
        "{}: of a version that kept no digest of it, so nobody can tell whether it was changed since",
        folder.join(SUMMARY).display()
    ));
}
