//! Seeds up to 2^64 − 1, written as integers, or as texts if they exceed TOML's integers.

use std::borrow::Cow;
use std::fmt;

use schemars::{Schema, SchemaGenerator, json_schema};
use serde::de::{Error, Unexpected, Visitor};
use serde::{Deserializer, Serializer};
use toml::Value;

/// Returns a seed as a TOML value of a scenario.
pub fn value(seed: u64) -> Value {
    i64::try_from(seed).map_or_else(|_| Value::String(seed.to_string()), Value::Integer)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde calls it")]
pub(super) fn serialize<S: Serializer>(seed: &u64, serializer: S) -> Result<S::Ok, S::Error> {
    match value(*seed) {
        Value::String(text) => serializer.serialize_str(&text),
        _ => serializer.serialize_u64(*seed),
    }
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
    struct Seed;

    impl Visitor<'_> for Seed {
        type Value = u64;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "a whole number from 0 to {}", u64::MAX)
        }

        fn visit_u64<E: Error>(self, seed: u64) -> Result<u64, E> {
            Ok(seed)
        }

        fn visit_i64<E: Error>(self, seed: i64) -> Result<u64, E> {
            seed.try_into().map_err(|_| E::invalid_value(Unexpected::Signed(seed), &self))
        }

        fn visit_str<E: Error>(self, text: &str) -> Result<u64, E> {
            text.parse().map_err(|_| E::invalid_value(Unexpected::Str(text), &self))
        }
    }

    deserializer.deserialize_any(Seed)
}

/// Type that stands for a seed in the JSON schema only.
pub(super) struct SeedSchema;

impl schemars::JsonSchema for SeedSchema {
    fn schema_name() -> Cow<'static, str> {
        "Seed".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [
            { "type": "integer", "minimum": 0 },
            { "type": "string", "pattern": "^[0-9]+$", "description": "Above 9223372036854775807." }
        ] })
    }
}

#[cfg(test)]
mod tests {
    use crate::tests::{error, scenario};

    #[test]
    fn law_every_seed_can_be_written_down() {
        for seed in [0, 7, i64::MAX as u64, i64::MAX as u64 + 1, u64::MAX] {
            let text = format!("seed = {}", super::value(seed));
            assert_eq!(scenario(&text).seed, seed);
            let file: super::super::ScenarioFile = toml::from_str(&text).expect("valid");
            assert_eq!(scenario(&file.text().expect("serialisable")).seed, seed);
        }
        for text in ["-1", "\"-1\"", "\"18446744073709551616\"", "1.5"] {
            let message = error(&format!("seed = {text}"));
            assert!(message.contains("`seed`") && message.contains("18446744073709551615"), "{message}");
        }
    }
}
