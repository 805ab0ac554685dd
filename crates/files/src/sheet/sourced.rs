//! A number with its source and reason, read from a table. By hand, so that it is compiled once and not for each unit.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{DeserializeSeed, Error, IntoDeserializer, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use standstill_quantity::{Number, Quantity, Unit};

use super::Entry;
use crate::table::{Keyed, TableError};

/// Where a number comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// Printed in the source that the data sheet names.
    Given,
    /// Estimated from a measurement, as `standstill fit` does.
    Measured,
    /// Computed from what is printed there.
    Inferred,
    /// Neither: chosen, for the reason stated.
    Assumed,
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Given => "given",
            Self::Measured => "measured",
            Self::Inferred => "inferred",
            Self::Assumed => "assumed",
        })
    }
}

/// A number of a data sheet with its source.
#[derive(Clone, Debug)]
pub struct Sourced<U> {
    /// The number.
    pub value: Quantity<U>,
    /// Kind of source of the number.
    pub source: Source,
    /// Reason for the value.
    pub reason: String,
}

impl<U: Unit> Sourced<U> {
    /// Returns the number in SI.
    pub fn number(&self) -> f64 {
        self.value.value()
    }

    /// Reads a number from a value of TOML: a plain number, a text with a unit, or a table with source and reason.
    ///
    /// # Errors
    /// The value is wrong; the error contains it, the requirement, and the key below this one.
    pub fn of(from: toml::Value) -> Result<Self, TableError> {
        let (value, source, reason) = of_value(Number(U::DIMENSION), from)?;
        Ok(Self { value: Quantity::si(value), source, reason })
    }
}

/// A number that is given, or may be.
pub trait Stated {
    /// Returns it as an entry under this key of a table; none if it is not given.
    fn entry(&self, table: &str, key: &str) -> Option<Entry>;
}

impl<U: Unit> Stated for Sourced<U> {
    fn entry(&self, table: &str, key: &str) -> Option<Entry> {
        let (key, value) = (format!("{table}.{key}"), self.value.to_string());
        Some(Entry { key, value, source: self.source, reason: self.reason.trim().to_owned() })
    }
}

impl<S: Stated> Stated for Option<S> {
    fn entry(&self, table: &str, key: &str) -> Option<Entry> {
        self.as_ref()?.entry(table, key)
    }
}

impl<'de, U: Unit> Deserialize<'de> for Sourced<U> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (value, source, reason) = read(Number(U::DIMENSION), deserializer)?;
        Ok(Self { value: Quantity::si(value), source, reason })
    }
}

impl<U: Unit> JsonSchema for Sourced<U> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("Number in {}", U::SYMBOL).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        schema(&Quantity::<U>::json_schema(generator), generator)
    }
}

/// Returns the schema of a number with a source, which a scenario may omit.
fn schema(quantity: &Schema, generator: &mut SchemaGenerator) -> Schema {
    let source = Source::json_schema(generator);
    json_schema!({
        "anyOf": [quantity, {
            "type": "object",
            "properties": { "value": quantity, "source": source, "reason": { "type": "string" } },
            "required": ["value", "source", "reason"],
            "additionalProperties": false
        }]
    })
}

const FIELDS: &[&str] = &["value", "source", "reason"];

fn of_value(number: Number, from: toml::Value) -> Result<(f64, Source, String), TableError> {
    read(number, Keyed(from))
}

/// Returns the number in SI, its source and the reason.
fn read<'de, D: Deserializer<'de>>(number: Number, from: D) -> Result<(f64, Source, String), D::Error> {
    from.deserialize_struct("Sourced", FIELDS, Table(number))
}

#[derive(Deserialize)]
#[serde(field_identifier, rename_all = "lowercase")]
enum Field {
    Value,
    Source,
    Reason,
}

struct Table(Number);

/// The number alone. For a number without a unit, a text is an error.
struct Value(Number);

impl<'de> DeserializeSeed<'de> for Value {
    type Value = f64;

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<f64, D::Error> {
        from.deserialize_any(self)
    }
}

impl Visitor<'_> for Value {
    type Value = f64;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.0.expecting(f)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<f64, E> {
        if self.0.0.is_bare() {
            return Err(E::custom(format!(
                "found the text \"{text}\", needed a number without quotes, such as 3"
            )));
        }
        self.0.visit_str(text)
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<f64, E> {
        self.0.visit_f64(value)
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<f64, E> {
        self.0.visit_i64(value)
    }
}

/// Reason of a number that stands by itself.
pub const PLAIN: &str = "in the data sheet, without a reason";

fn plain(value: f64) -> (f64, Source, String) {
    (value, Source::Given, PLAIN.to_owned())
}

impl<'de> Visitor<'de> for Table {
    type Value = (f64, Source, String);

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number with its unit as text, a plain number, or a table { value = …, source = …, reason = … }")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
        Ok(plain(Value(self.0).deserialize(text.into_deserializer())?))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        Ok(plain(self.0.deserialize(value.into_deserializer())?))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        Ok(plain(self.0.deserialize(value.into_deserializer())?))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let (mut value, mut source, mut reason) = (None, None, None);
        while let Some(field) = map.next_key()? {
            match field {
                Field::Value => value = Some(map.next_value_seed(Value(self.0))?),
                Field::Source => source = Some(map.next_value()?),
                Field::Reason => reason = Some(map.next_value()?),
            }
        }
        let value = value.ok_or_else(|| A::Error::missing_field("value"))?;
        let source = source.ok_or_else(|| A::Error::missing_field("source"))?;
        Ok((value, source, reason.ok_or_else(|| A::Error::missing_field("reason"))?))
    }
}
