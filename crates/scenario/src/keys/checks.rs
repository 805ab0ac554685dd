//! The plausibility checks of a method that are on, as files write them: true for all, false for none, or a list of
//! names.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::SeqAccessDeserializer;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use standstill_detect::{Check, Checks, MethodName};
use standstill_interface::Choice;
use toml::Value;

use super::{Values, Written};
use crate::document::FileError;

/// The plausibility checks of a method that are on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckList {
    /// All checks of the method (true), or none (false).
    All(bool),
    /// The checks that a list names.
    Named(Checks),
}

impl CheckList {
    /// Converts these checks to the shortest form: true for all checks, false for no checks, otherwise a list.
    pub(crate) fn of(checks: Checks) -> Self {
        match checks {
            Checks::ALL => Self::All(true),
            Checks::NONE => Self::All(false),
            some => Self::Named(some),
        }
    }

    /// Returns the TOML value: true for all checks, false for none, or the list of their names.
    pub(crate) fn value(self) -> Value {
        match self {
            Self::All(on) => on.into(),
            Self::Named(some) => Value::Array(some.iter().map(|check| check.name().into()).collect()),
        }
    }

    /// Returns an error if a check is named that the method does not have.
    pub(crate) fn check(self, method: MethodName) -> Result<(), FileError> {
        match self {
            Self::Named(some) => some
                .beyond(method.checks())
                .map_or(Ok(()), |check| Err(FileError::foreign_check(check, method))),
            Self::All(_) => Ok(()),
        }
    }
}

struct Read;

impl<'de> Visitor<'de> for Read {
    type Value = CheckList;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "true, false or a list of {}", <Check as Choice>::NAMES.join(", "))
    }

    fn visit_bool<E: Error>(self, all: bool) -> Result<CheckList, E> {
        Ok(CheckList::All(all))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, names: A) -> Result<CheckList, A::Error> {
        let all = Vec::<String>::deserialize(SeqAccessDeserializer::new(names))?;
        let checks = Checks::named(all.iter().map(String::as_str));
        checks.map(CheckList::Named).map_err(|wrong| Error::unknown_variant(wrong, <Check as Choice>::NAMES))
    }
}

impl<'de> Deserialize<'de> for CheckList {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Read)
    }
}

impl Serialize for CheckList {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.value().serialize(serializer)
    }
}

impl JsonSchema for CheckList {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Checks".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let one = |check: &Check| serde_json::json!({ "type": "string", "const": check.name(), "description": check.about().trim() });
        let names: Vec<_> = Check::ALL.iter().map(one).collect();
        json_schema!({
            "description": "True for all checks, false for none, or a list of those that are on.",
            "anyOf": [{ "type": "boolean" }, { "type": "array", "items": { "oneOf": names } }],
        })
    }
}

impl Written for CheckList {
    fn checks(&self) -> Option<Checks> {
        Some(match self {
            Self::All(on) => Checks::all(*on),
            Self::Named(some) => *some,
        })
    }

    fn values() -> Values {
        Values::List(Check::ALL.iter().map(|check| (check.name(), check.about().trim())).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_checks_are_all_none_or_a_list_of_names() {
        let read = |text: &str| {
            let table: toml::Table = format!("x = {text}").parse().expect("TOML");
            table["x"].clone().try_into::<CheckList>().map_err(|error| error.to_string())
        };
        let two = CheckList::Named(Checks::of([Check::Link, Check::Turning]));
        for (text, checks) in [
            ("true", CheckList::All(true)),
            ("false", CheckList::All(false)),
            ("[]", CheckList::Named(Checks::NONE)),
            ("[\"turning\", \"link\", \"link\"]", two),
        ] {
            assert_eq!(read(text), Ok(checks), "{text}");
            assert_eq!(checks.value().try_into(), Ok(checks), "{text}");
        }
        assert_eq!(two.value().to_string(), "[\"link\", \"turning\"]");
        let wrong = read("[\"link\", \"lnik\"]").expect_err("no such check");
        assert!(Check::ALL.iter().all(|check| wrong.contains(check.name())), "{wrong}");
        for text in ["1", "\"link\"", "[1]"] {
            assert!(read(text).is_err(), "{text}");
        }
    }
}
