//! A hidden note in the folder of a run: the scenario, keys and seed as its command line named them. Commands that are
//! proposed next are printed from it, ready to type.

use std::path::Path;

use serde::{Deserialize, Serialize};
use standstill_files::read_text;
use standstill_plant::built_in;

use crate::error::Error;
use crate::shell::command_line::is_quoted;
use crate::shell::host;
use crate::shell::output::replace;

/// File name of the note; the leading dot hides it from lists of results.
const NOTE: &str = ".standstill-scenario.json";

/// How a command line named the scenario of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Begun {
    /// The scenario's file, or a motor's name.
    pub scenario: String,
    /// The scenario with its keys and its seed, ready to be typed.
    pub line: String,
    /// The complete command line without the options `--resume` and `--force`.
    pub typed: String,
    /// The command that searches for settings with which starts have an answer. None if this command cannot judge the run, for example a
    /// run with a detector library.
    pub check: Option<String>,
}

impl Begun {
    /// Writes the note into a folder of results. Writes nothing in a host program, which has no command line.
    ///
    /// # Errors
    /// The note cannot be written.
    pub fn note(&self, folder: &Path) -> Result<(), Error> {
        let path = folder.join(NOTE);
        if host::current().is_some() {
            Self::forget(folder);
            return Ok(());
        }
        // The note consists of strings: writing it as JSON cannot fail.
        let text = serde_json::to_vec_pretty(self).unwrap_or_default();
        replace(&path, &text)
    }

    /// Removes the note of an earlier run.
    pub fn forget(folder: &Path) {
        let _ = std::fs::remove_file(folder.join(NOTE));
    }

    /// Reads the note of a run. Returns none if the note is missing, if the scenario's path leads to no file from the present working
    /// directory, or if a line is not as this program writes command lines: a folder may come from somebody else.
    pub fn of(folder: &Path) -> Option<Self> {
        let begun: Self = serde_json::from_str(&read_text(&folder.join(NOTE)).ok()?).ok()?;
        let is_there = Path::new(&begun.scenario).is_file() || built_in(&begun.scenario).is_some();
        let commands = [Some(&begun.typed), begun.check.as_ref()].into_iter().flatten();
        let are_own = commands.into_iter().all(|line| line.starts_with("standstill ") && is_quoted(line));
        (is_there && are_own && is_quoted(&begun.line)).then_some(begun)
    }
}
