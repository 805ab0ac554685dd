//! `[map]`: a core that stands in a file of its own.

use schemars::JsonSchema;
use serde::Deserialize;

use super::sourced;
use super::{Entry, Source};
use crate::MapValues;

/// The name of a file, which may have a source.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "must be a file's name, or a table { value = …, source = …, reason = … }")]
pub(super) enum SourcedFile {
    Plain(String),
    Whole(WholeFile),
}

/// The name of a file, with its source.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct WholeFile {
    value: String,
    source: Source,
    reason: String,
}

impl SourcedFile {
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Plain(name) => name,
            Self::Whole(file) => &file.value,
        }
    }

    pub(super) fn entry(&self, key: &str) -> Entry {
        let (source, reason) = match self {
            Self::Plain(_) => (Source::Given, sourced::PLAIN),
            Self::Whole(file) => (file.source, file.reason.trim()),
        };
        Entry { key: key.to_owned(), value: self.name().to_owned(), source, reason: reason.to_owned() }
    }
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct MapTable {
    pub(super) file: SourcedFile,
    /// Whether the file has peak or rms values; peak values without it.
    pub(super) values: Option<MapValues>,
    /// The columns of a text in place of its header.
    pub(super) columns: Option<String>,
    /// What is done where the file has one side of the d-axis only; without it, nothing.
    pub(super) beyond: Option<Beyond>,
}

/// How a map goes on where its file has no data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum Beyond {
    /// As algebraic cores do that were fitted to it.
    Fitted,
}
