//! A number with its source and reason, read from a table. By hand, so that it is compiled once and not for each unit.

use std::fmt;

use serde::de::{DeserializeSeed, Error, IntoDeserializer, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use standstill_quantity::Number;

use super::Source;

const FIELDS: &[&str] = &["value", "source", "reason"];

/// The number in SI, its source and the reason.
pub fn read<'de, D: Deserializer<'de>>(number: Number, from: D) -> Result<(f64, Source, String), D::Error> {
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

/// The number by itself. Where there is no unit to write, a text is a slip.
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

/// What is said of a number that stands by itself.
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
