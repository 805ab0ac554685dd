//! The identity of a question, which is stored with its answer.

use std::path::Path;

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use standstill_campaign::store::{self, Shard, Sweep};
use standstill_files::read_text;
use standstill_scenario::Plan;

use crate::error::Error;

/// The identity of a question: its scenario and its options.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Identity of the scenario, the seed, the program, and the files that the scenario reads.
    pub of: store::Identity,
    /// Options that the command line sets, each with its value as text.
    pub options: IndexMap<String, String>,
}

/// Name of the JSON member that contains the identity of an answer's question.
pub const KEY: &str = "question";

impl Identity {
    /// Makes the identity of a question from the plan of its scenario and from its options.
    pub fn new<const N: usize>(plan: &Plan, options: [(&str, Option<String>); N]) -> Result<Self, Error> {
        let of = Sweep { plan, shard: Shard::WHOLE, threads: None }.identity()?;
        let set = options.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?)));
        Ok(Self { of, options: set.collect() })
    }

    /// Describes in words all differences between two questions. Returns none if the questions are equal.
    fn difference(&self, other: &Self) -> Option<String> {
        let of = |question: &Self, name: &str| {
            question.options.get(name).map_or_else(|| "not set".to_owned(), |value| format!("`{value}`"))
        };
        let only_there = other.options.keys().filter(|name| !self.options.contains_key(*name));
        let names = self.options.keys().chain(only_there);
        let others = names
            .filter(|name| self.options.get(*name) != other.options.get(*name))
            .map(|name| format!("{name} is {} there and {} here", of(self, name), of(other, name)));
        let all: Vec<String> = self.of.difference(&other.of).into_iter().chain(others).collect();
        (!all.is_empty()).then(|| all.join("; "))
    }

    /// Refuses to replace the answer to another question, or a file that is not an answer. The same question may be
    /// asked again, because its answer is the same.
    ///
    /// # Errors
    /// The file at this path answers another question, or is not an answer.
    pub fn guard(&self, path: &Path) -> Result<(), Error> {
        #[derive(Deserialize)]
        struct Answered {
            question: Identity,
        }
        if !path.exists() {
            return Ok(());
        }
        let text = read_text(path).map_err(|error| Error::Read(path.to_owned(), error))?;
        let difference = match serde_json::from_str::<Answered>(&text) {
            Ok(found) => found.question.difference(self),
            Err(_) => Some("this file does not say which".to_owned()),
        };
        difference.map_or(Ok(()), |difference| Err(Error::another("question", path, &difference)))
    }
}
