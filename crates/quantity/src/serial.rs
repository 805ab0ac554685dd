//! Quantities in files, and their JSON Schema.

use std::fmt;

use serde::de::{DeserializeSeed, Error, Visitor};
use serde::{Deserialize, Deserializer};

use crate::{Dimension, Quantity, Unit, prefix};

/// Reads a number in SI of this dimension: a plain number, or a text with a unit. Not generic over the unit, so that the
/// code is compiled once for each format and not once more for each unit.
#[derive(Clone, Copy, Debug)]
pub struct Number(pub Dimension);

impl<'de> DeserializeSeed<'de> for Number {
    type Value = f64;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<f64, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl Visitor<'_> for Number {
    type Value = f64;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.0.symbol {
            "" if self.0.share => write!(f, "a share such as 0.005 or \"0.5 %\""),
            "" => write!(f, "a number without unit"),
            symbol => write!(f, "a number in {symbol}, or a text such as \"1.5 {symbol}\""),
        }
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<f64, E> {
        if value.is_finite() { Ok(value) } else { Err(E::custom("not a finite number")) }
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<f64, E> {
        self.visit_f64(value as f64)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<f64, E> {
        self.0.parse(text).map_err(E::custom)
    }
}

impl<'de, U: Unit> Deserialize<'de> for Quantity<U> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Number(U::DIMENSION).deserialize(deserializer).map(Self::si)
    }
}

impl<U: Unit> serde::Serialize for Quantity<U> {
    /// Writes the value as a number in SI, which is exact.
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_f64(self.0)
    }
}

impl<U: Unit> schemars::JsonSchema for Quantity<U> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("Quantity in {}", U::SYMBOL).into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schema(&U::DIMENSION)
    }
}

/// Returns the JSON Schema of a number of this dimension. The function is not generic, for the same reason as
/// [`Number`].
fn schema(dimension: &Dimension) -> schemars::Schema {
    let number = r"^\s*[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*";
    let units: Vec<String> = dimension.spellings().map(|unit| unit.replace('^', r"\^")).collect();
    let unit = match &units[..] {
        [] if dimension.share => "%?".to_owned(),
        [] => String::new(),
        units => format!("([{}]?({}))?", prefix::spellings(), units.join("|")),
    };
    let what = match dimension.symbol {
        "" if dimension.share => "a share: a number, or a text in per cent".to_owned(),
        "" => "a number".to_owned(),
        symbol => format!("a number in {symbol}, or a text with a unit"),
    };
    schemars::json_schema!({
        "description": what,
        "x-unit": dimension.symbol,
        "x-share": dimension.share,
        "anyOf": [{ "type": "number" }, { "type": "string", "pattern": format!("{number}{unit}\\s*$") }]
    })
}
