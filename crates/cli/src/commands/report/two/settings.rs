//! The differences of two runs' scenarios.

use std::collections::{BTreeMap, BTreeSet};

use toml::Value as Toml;

use crate::results::FinishedRun;
use crate::shell::values::shown as shown_value;

/// Returns the keys of the scenarios whose values differ: key, value of A, value of B.
pub fn settings(runs: [&FinishedRun; 2]) -> Vec<[String; 3]> {
    let [a, b] = runs.map(|run| {
        let table: toml::Table = toml::from_str(&run.summary.run.scenario).unwrap_or_default();
        let mut keys = BTreeMap::new();
        flatten("", &Toml::Table(table), &mut keys);
        keys
    });
    let all: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let of = |keys: &BTreeMap<String, String>, key: &String| {
        keys.get(key).cloned().unwrap_or_else(|| "–".to_owned())
    };
    all.into_iter()
        .filter(|key| a.get(*key) != b.get(*key))
        .map(|key| [key.clone(), of(&a, key), of(&b, key)])
        .collect()
}

/// Collects values by their keys, those of nested tables too.
fn flatten(before: &str, value: &Toml, into: &mut BTreeMap<String, String>) {
    match value {
        Toml::Table(table) => {
            for (key, value) in table {
                let key = if before.is_empty() { key.clone() } else { format!("{before}.{key}") };
                flatten(&key, value, into);
            }
        }
        Toml::String(text) => {
            into.insert(before.to_owned(), text.clone());
        }
        Toml::Float(number) => {
            into.insert(before.to_owned(), shown_value(before, *number));
        }
        value => {
            into.insert(before.to_owned(), value.to_string());
        }
    }
}
