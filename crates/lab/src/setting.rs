//! Settings of the page: a scenario and the keys that differ from it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// A scenario, by its name in the lab, with changed keys.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Setting {
    /// Path of the scenario from the lab's folder; empty: the scenario with which the lab was started.
    pub scenario: String,
    /// Keys and their values, as `-s KEY=VALUE` takes them.
    pub set: BTreeMap<String, String>,
    /// The point of the axes, if there are any.
    pub point: usize,
}

/// Largest number of changed keys, and of their bytes; a page sends far less.
const MOST: usize = 64 << 10;

impl Setting {
    /// Returns the key for caches: equal settings have equal names.
    pub fn name(&self) -> String {
        // Texts and a number: nothing that JSON lacks.
        serde_json::to_string(self).unwrap_or_default()
    }

    /// Returns whether it is of a size that a page may send.
    pub fn is_sensible(&self) -> bool {
        self.set.iter().map(|(key, value)| key.len() + value.len() + 8).sum::<usize>() <= MOST
    }

    /// Returns the setting without a key.
    #[must_use]
    pub fn without(&self, key: &str) -> Self {
        let mut other = self.clone();
        other.set.remove(key);
        other
    }

    /// Returns the changed keys in the order in which a document must take them: a motor comes before its numbers.
    pub fn in_order(&self) -> impl Iterator<Item = (&str, &str)> {
        let rank = |key: &str| match key {
            "motor" => 0,
            "motor.base" => 1,
            _ => 2,
        };
        let mut all: Vec<(&str, &str)> =
            self.set.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect();
        all.sort_by_key(|(key, _)| rank(key));
        all.into_iter()
    }
}
