//! Digests of the tables of a finished run, which reveal later changes.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use standstill_campaign::store::Shard;
use standstill_files::Digest;

use super::names::SUMMARY;
use crate::error::Error;
use crate::shell::command_line::quoted;
use crate::shell::output::Output;
use crate::shell::terminal::tell;

/// Size and checksum of each table, by the table's name.
#[derive(Debug, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Tables(BTreeMap<String, String>);

impl Tables {
    /// Computes the digests of files that are complete but not yet in place.
    ///
    /// # Errors
    /// A file cannot be read back.
    pub fn of(output: &Output, names: impl IntoIterator<Item = &'static str>) -> Result<Self, Error> {
        let digest = |name: &str| Ok((name.to_owned(), output.digest(name)?));
        names.into_iter().map(digest).collect::<Result<_, _>>().map(Self)
    }

    /// Iterates over the names of the tables.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// Refuses a table that was changed since it was written. If the run has no digests (`None`), because an older version wrote it, a
    /// message states that changes cannot be detected.
    ///
    /// # Errors
    /// The table was changed, cannot be read, or belongs to another run; the message explains how to restore it.
    pub fn check(of: Option<&Self>, table: &Path) -> Result<(), Error> {
        let Some(Self(digests)) = of else {
            tell(&format!(
                "{}: {SUMMARY} beside it is of a version that kept no digest of it, so nobody can tell whether it was changed since",
                table.display()
            ));
            return Ok(());
        };
        let found = Digest::of_file(table).map_err(|error| Error::Read(table.to_owned(), error))?.to_string();
        let kept = table.file_name().and_then(|name| digests.get(&*name.to_string_lossy()));
        if kept == Some(&found) {
            return Ok(());
        }
        let folder = table.parent().unwrap_or(Path::new(""));
        // If a run ended between its table and its summary, its journal has all trials.
        let way = if folder.join(Shard::WHOLE.file_name()).exists() {
            format!(
                "delete {} and repeat the command of the run with --resume: the journal has its trials",
                quoted(&table.to_string_lossy())
            )
        } else {
            format!(
                "repeat the command of the run with --force --out {}: `run` in {SUMMARY} says which",
                quoted(&folder.to_string_lossy())
            )
        };
        let needed = match kept {
            Some(kept) => format!("{kept}, as {SUMMARY} beside it says: put that file back, or {way}"),
            None => format!("a table of which {SUMMARY} beside it knows: {way}"),
        };
        Err(Error::results(table, format!("{found}, which is not what the run wrote"), needed))
    }
}
