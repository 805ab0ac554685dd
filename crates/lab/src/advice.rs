//! Which detector suits the motor and the drive that are set: who starts the lab knows, the lab remembers.

use std::collections::BTreeMap;
use std::sync::Mutex;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use standstill_scenario::Document;

use crate::bench::{Bench, lock};
use crate::error::LabError;
use crate::setting::Setting;

/// A detector and its settings.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Advice {
    /// Keys and their values, as `-s KEY=VALUE` takes them; none where nothing suits.
    pub keys: Option<BTreeMap<String, String>>,
    /// Reason, in a sentence.
    pub text: String,
}

/// Finds the detector of a scenario, or says why there is none to be found.
pub type Find = Box<dyn Fn(&Document) -> Result<Advice, String> + Send + Sync>;

/// The setting that is asked about.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Request {
    setting: Setting,
}

/// Answers that are kept.
const KEPT: usize = 48;

pub(crate) struct Adviser {
    find: Find,
    /// By the setting's name. Locked while an answer is looked for: pages that ask the same share it, and others do not take the
    /// machine from each other.
    known: Mutex<Vec<(String, Value)>>,
}

impl Adviser {
    pub fn new(find: Find) -> Self {
        Self { find, known: Mutex::default() }
    }

    /// Advice for a setting, whatever detector it has.
    pub fn answer(&self, bench: &Bench, request: &Request) -> Result<Value, LabError> {
        let mut setting = request.setting.clone();
        setting.set.retain(|key, _| !key.starts_with("detector."));
        let name = setting.name();
        let mut known = lock(&self.known);
        if let Some((_, answer)) = known.iter().find(|(other, _)| *other == name) {
            return Ok(answer.clone());
        }
        let ready = bench.ready(&setting)?;
        let answer = (self.find)(&ready.document)
            .map_or_else(|error| json!({ "keys": null, "text": error }), |advice| json!(advice));
        if known.len() >= KEPT {
            known.remove(0);
        }
        known.push((name, answer.clone()));
        Ok(answer)
    }
}
