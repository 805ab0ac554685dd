//! Advice on the detector for the present motor and drive. A function given at the start of the lab finds it; this
//! module stores the answers.

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
    /// Keys and values in the format of `-s KEY=VALUE`; none if no detector is suitable.
    pub keys: Option<BTreeMap<String, String>>,
    /// Reason, in a sentence.
    pub text: String,
}

/// Finds the detector of a scenario, or returns the reason why there is none.
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
    /// Answers by the name of the setting. The lock is held during a search: pages with the same question share the
    /// answer, and others do not compete for the processor.
    known: Mutex<Vec<(String, Value)>>,
}

impl Adviser {
    pub fn new(find: Find) -> Self {
        Self { find, known: Mutex::default() }
    }

    /// Returns the advice for a setting; the setting's own detector does not matter.
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
