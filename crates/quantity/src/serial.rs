//! Quantities in files, and what JSON Schema says of them.

use std::fmt;
use std::marker::PhantomData;

use serde::{Deserialize, Deserializer};

use crate::{Quantity, Unit, prefix};

impl<'de, U: Unit> Deserialize<'de> for Quantity<U> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor<U>(PhantomData<U>);
        impl<U: Unit> serde::de::Visitor<'_> for Visitor<U> {
            type Value = Quantity<U>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                match U::SYMBOL {
                    "" if U::DIMENSION.share => write!(f, "a share such as 0.005 or \"0.5 %\""),
                    "" => write!(f, "a number without unit"),
                    symbol => write!(f, "a number in {symbol}, or a text such as \"1.5 {symbol}\""),
                }
            }

            fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Quantity<U>, E> {
                if value.is_finite() {
                    Ok(Quantity::si(value))
                } else {
                    Err(E::custom("not a finite number"))
                }
            }

            fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<Quantity<U>, E> {
                self.visit_f64(value as f64)
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Quantity<U>, E> {
                text.parse().map_err(E::custom)
            }
        }
        deserializer.deserialize_any(Visitor(PhantomData))
    }
}

impl<U: Unit> serde::Serialize for Quantity<U> {
    /// As a number in SI, which is exact.
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
        let number = r"^\s*[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*";
        let units: Vec<String> = U::DIMENSION.spellings().map(|unit| unit.replace('^', r"\^")).collect();
        let unit = match &units[..] {
            [] if U::DIMENSION.share => "%?".to_owned(),
            [] => String::new(),
            units => format!("([{}]?({}))?", prefix::spellings(), units.join("|")),
        };
        let what = match U::SYMBOL {
            "" if U::DIMENSION.share => "a share: a number, or a text in per cent".to_owned(),
            "" => "a number".to_owned(),
            symbol => format!("a number in {symbol}, or a text with a unit"),
        };
        schemars::json_schema!({
            "description": what,
            "x-unit": U::SYMBOL,
            "x-share": U::DIMENSION.share,
            "anyOf": [{ "type": "number" }, { "type": "string", "pattern": format!("{number}{unit}\\s*$") }]
        })
    }
}
