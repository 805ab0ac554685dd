//! `[map]`: a core in a separate file.

use schemars::JsonSchema;
use serde::Deserialize;

use super::{PLAIN, Source};
use crate::MapValues;

/// The name of a file, which may have a source.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "must be a file's name, or a table { value = …, source = …, reason = … }")]
pub enum SourcedFile {
    Plain(String),
    Whole(WholeFile),
}

/// The name of a file, with its source.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WholeFile {
    value: String,
    source: Source,
    reason: String,
}

impl SourcedFile {
    /// Returns the name of the file.
    pub fn name(&self) -> &str {
        match self {
            Self::Plain(name) => name,
            Self::Whole(file) => &file.value,
        }
    }

    /// Returns the source and the reason.
    pub fn source(&self) -> (Source, &str) {
        match self {
            Self::Plain(_) => (Source::Given, PLAIN),
            Self::Whole(file) => (file.source, file.reason.trim()),
        }
    }
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapTable {
    pub file: SourcedFile,
    /// Whether the file has peak or rms values; peak values without it.
    pub values: Option<MapValues>,
    /// The columns of a text in place of its header.
    pub columns: Option<String>,
    /// Continuation beyond a file that has one side of the d-axis only; without it, none.
    pub beyond: Option<Beyond>,
}

/// How a map goes on where its file has no data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Beyond {
    /// The continuation is that of algebraic cores fitted to the map.
    Fitted,
}
