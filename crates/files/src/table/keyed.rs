//! Typed values from TOML, with errors that name the wrong key. An error receives its key while it is passed up, so
//! reading without errors costs nothing extra. The derived code of a type is compiled for this reader only.

use std::fmt;

use serde::de::value::StrDeserializer;
use serde::de::{DeserializeOwned, DeserializeSeed, Error, Expected, IntoDeserializer, Unexpected, Visitor};
use serde::{Deserializer, forward_to_deserialize_any};
use thiserror::Error;
use toml::Value;

use super::place::quoted;
use super::wording;

/// Fault of a table, with the key at fault.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{message}")]
pub struct TableError {
    /// The path of the key as TOML writes it, so with quotes around a part that has dots; empty if it is the table itself.
    pub key: String,
    /// The fault, in words.
    pub message: String,
}

/// Reads a value; an error names the key below it that is wrong.
///
/// ```
/// use standstill_files::read_keyed;
/// use toml::Value;
///
/// let value = "phases = [[1, 2], [3, true]]".parse::<toml::Table>()?;
/// let error = read_keyed::<std::collections::BTreeMap<String, Vec<Vec<i32>>>>(Value::Table(value)).unwrap_err();
/// assert_eq!(error.key, "phases[1][1]");
/// assert_eq!(error.message, "found true, needed a whole number");
/// # Ok::<(), toml::de::Error>(())
/// ```
pub fn read_keyed<T: DeserializeOwned>(value: Value) -> Result<T, TableError> {
    T::deserialize(Keyed(value))
}

impl TableError {
    /// Returns the missing key, if that is the error.
    pub(crate) fn lacks(&self) -> Option<&str> {
        self.message.strip_prefix("missing field `")?.strip_suffix('`')
    }

    /// Returns the error relative to the enclosing table, in which the value has this key.
    fn below(self, key: &str) -> Self {
        self.inside(&quoted(key))
    }

    /// Returns the error relative to the enclosing value: below a key as it is written, or at a position in a list.
    fn inside(mut self, outer: &str) -> Self {
        let dot = if self.key.is_empty() || self.key.starts_with('[') { "" } else { "." };
        self.key.insert_str(0, dot);
        self.key.insert_str(0, outer);
        self
    }
}

impl Error for TableError {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self { key: String::new(), message: message.to_string() }
    }

    fn invalid_type(found: Unexpected<'_>, needed: &dyn Expected) -> Self {
        Self::custom(format_args!("found {}, needed {}", wording::found(found), wording::needed(needed)))
    }

    fn invalid_value(found: Unexpected<'_>, needed: &dyn Expected) -> Self {
        Self::invalid_type(found, needed)
    }

    fn invalid_length(length: usize, needed: &dyn Expected) -> Self {
        Self::custom(format_args!("found a list of {length}, needed {}", wording::needed(needed)))
    }
}

/// Converts a value to the form that serde's errors have; none for dates and times.
fn unexpected(value: &Value) -> Option<Unexpected<'_>> {
    Some(match value {
        Value::String(text) => Unexpected::Str(text),
        Value::Integer(number) => Unexpected::Signed(*number),
        Value::Float(number) => Unexpected::Float(*number),
        Value::Boolean(flag) => Unexpected::Bool(*flag),
        Value::Array(_) => Unexpected::Seq,
        Value::Table(_) => Unexpected::Map,
        Value::Datetime(_) => return None,
    })
}

/// Returns a value in the words of messages.
pub fn in_words(value: &Value) -> String {
    unexpected(value)
        .map_or_else(|| format!("the date or time {value}"), |value| wording::found(value).into_owned())
}

/// A value as input of a derived `Deserialize`.
pub(crate) struct Keyed(pub Value);

impl Keyed {
    fn wrong(&self, expected: &dyn Expected) -> TableError {
        let Some(unexpected) = unexpected(&self.0) else {
            let found = &self.0;
            return TableError::custom(format!("found the date or time {found}, which no key has"));
        };
        TableError::invalid_type(unexpected, expected)
    }
}

impl<'de> Deserializer<'de> for Keyed {
    type Error = TableError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, TableError> {
        match self.0 {
            Value::Array(values) => {
                let mut items = Items { values: values.into_iter(), next: 0 };
                let found = visitor.visit_seq(&mut items)?;
                match items.values.len() {
                    0 => Ok(found),
                    more => {
                        let needed = format!("a list of {}", items.next);
                        Err(TableError::invalid_length(items.next + more, &needed.as_str()))
                    }
                }
            }
            _ => self.deserialize_struct("", &[], visitor),
        }
    }

    /// Rejects arrays: values with names are not read by position.
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, TableError> {
        match self.0 {
            Value::String(text) => visitor.visit_string(text),
            Value::Integer(number) => visitor.visit_i64(number),
            Value::Float(number) => visitor.visit_f64(number),
            Value::Boolean(flag) => visitor.visit_bool(flag),
            Value::Table(table) => visitor.visit_map(Entries { table: table.into_iter(), value: None }),
            Value::Array(_) | Value::Datetime(_) => Err(self.wrong(&visitor)),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, TableError> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, TableError> {
        visitor.visit_newtype_struct(self)
    }

    /// Returns one of several names.
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, TableError> {
        match &self.0 {
            Value::String(name) => visitor.visit_enum(name.as_str().into_deserializer()),
            _ => Err(self.wrong(&visitor)),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map identifier ignored_any
    }
}

struct Entries {
    table: <toml::Table as IntoIterator>::IntoIter,
    /// The key that was read last, with its value.
    value: Option<(String, Value)>,
}

impl<'de> serde::de::MapAccess<'de> for Entries {
    type Error = TableError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, TableError> {
        let Some((key, value)) = self.table.next() else { return Ok(None) };
        let name: StrDeserializer<TableError> = key.as_str().into_deserializer();
        let found = seed.deserialize(name).map_err(|error| error.below(&key))?;
        self.value = Some((key, value));
        Ok(Some(found))
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, TableError> {
        let (key, value) = self.value.take().ok_or_else(|| TableError::custom("a value without its key"))?;
        seed.deserialize(Keyed(value)).map_err(|error| error.below(&key))
    }
}

struct Items {
    values: std::vec::IntoIter<Value>,
    next: usize,
}

impl<'de> serde::de::SeqAccess<'de> for &mut Items {
    type Error = TableError;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, TableError> {
        let Some(value) = self.values.next() else { return Ok(None) };
        self.next += 1;
        let found = seed.deserialize(Keyed(value));
        found.map(Some).map_err(|error| error.inside(&format!("[{}]", self.next - 1)))
    }
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;
    use standstill_quantity::Quantity;
    use standstill_quantity::unit::Ohm;

    use super::*;

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Outer {
        inner: Option<Inner>,
        pair: (u8, f64),
    }

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Inner {
        resistance: Quantity<Ohm>,
        kind: Kind,
    }

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Kind {
        Star,
        Delta,
    }

    fn read(text: &str) -> Result<Outer, TableError> {
        read_keyed(Value::Table(text.parse().expect("TOML")))
    }

    #[test]
    fn law_every_error_names_its_key() {
        let pair = "pair = [1, 2.5]\n";
        let whole = read(&format!("{pair}inner = {{ resistance = \"3 mΩ\", kind = \"delta\" }}"));
        let inner = Inner { resistance: Quantity::si(3e-3), kind: Kind::Delta };
        assert_eq!(whole, Ok(Outer { inner: Some(inner), pair: (1, 2.5) }));
        assert_eq!(read(pair), Ok(Outer { inner: None, pair: (1, 2.5) }));
        for (text, key, message) in [
            ("pair = [1, true]", "pair[1]", "found true, needed a number"),
            ("pair = [300, 2.5]", "pair[0]", "found 300, needed a whole number from 0 to 255"),
            ("pair = [1, 2.5, 3]", "pair", "found a list of 3, needed a list of 2"),
            ("pair = [1]", "pair", "found a list of 1, needed a list of 2"),
            ("pair = { a = 1 }", "pair", "found a table, needed a list of 2"),
            ("pair = 1979-05-27", "pair", "found the date or time 1979-05-27, which no key has"),
            ("inner = {}", "inner", "missing field `resistance`"),
            ("inner = [1, 2]", "inner", "found a list, needed a table"),
            ("\"inner.resistance\" = 1", "\"inner.resistance\"", "unknown field `inner.resistance`"),
            ("inner = { \"kind.of\" = 1 }", "inner.\"kind.of\"", "unknown field `kind.of`"),
            ("inner.resistence = 1", "inner.resistence", "unknown field `resistence`"),
            ("inner.resistance = \"3 mH\"", "inner.resistance", "`3 mH` is not a finite number in Ω"),
            ("inner = { resistance = 1, kind = 3 }", "inner.kind", "found 3, needed a text in quotes"),
            ("inner = { resistance = 1, kind = \"wye\" }", "inner.kind", "unknown variant `wye`"),
            ("", "", "missing field `pair`"),
        ] {
            let error = read(text).expect_err(text);
            assert_eq!(error.key, key, "{text}");
            assert!(error.message.starts_with(message), "{text}: {error}");
        }
    }
}
