//! The differences between the scenarios of two runs.

use std::collections::{BTreeMap, BTreeSet};

use standstill_campaign::store::values;
use toml::Value;

use crate::results::FinishedRun;
use crate::shell::values::shown;

/// Returns the scenario keys that have different values in the two runs. Each entry contains the key, its value in run A, and its value in
/// run B.
pub fn settings(runs: [&FinishedRun; 2]) -> Vec<[String; 3]> {
    let [a, b] = runs.map(|run| {
        let text = |(key, value): (String, Value)| {
            let text = match &value {
                Value::String(text) => text.clone(),
                Value::Float(number) => shown(&key, *number),
                value => value.to_string(),
            };
            (key, text)
        };
        values(&run.summary.run.scenario).into_iter().map(text).collect::<BTreeMap<_, _>>()
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
