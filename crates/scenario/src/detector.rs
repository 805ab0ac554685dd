//! The table of the detector: its method, what it is told, and the keys that methods describe.

use std::fmt;
use std::marker::PhantomData;
use std::sync::LazyLock;

use indexmap::IndexMap;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Error, MapAccess, Visitor};
use serde::ser::SerializeStruct;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use standstill_detect::{Key, Kind, Method, MethodName, SettingsError, Signature, Value, keys};
use standstill_quantity::unit::{Ampere, Degree, Hertz, One, Second, Share, Volt};
use standstill_quantity::{Quantity, Unit};

use super::document::FileError;
use super::named::Named;
use crate::PoleRule;

/// The method and its settings. What is left out suits the motor; a setting that the method does not have is an error.
#[derive(Clone, Debug, Default)]
pub struct DetectorTable {
    /// The method.
    pub method: Named<MethodName>,
    /// Which pole draws more current: what the detector is told, right or wrong.
    pub signature: Option<Named<Signature>>,
    /// How poles are decided.
    pub polarity: Option<Named<PoleRule>>,
    /// Dead time that the detector is told.
    pub dead_time: Option<Quantity<Second>>,
    /// Longest time that a detection may take.
    pub time_limit: Option<Quantity<Second>>,
    /// A shared library that is the detector, in place of a method.
    pub library: Option<String>,
    /// A class of Python that is the detector: its module, name and digest.
    pub python: Option<String>,
    /// Whether the program that runs the trials has that class.
    pub(super) hosted: bool,
    /// Longest time that a call of the library may take.
    pub call_timeout: Option<Quantity<Second>>,
    /// What the library is told: KEY=VALUE.
    pub config: IndexMap<String, toml::Value>,
    /// Whether `method` is set.
    named: bool,
    /// Whether its library is an axis, so that there is no method either.
    pub(super) library_is_an_axis: bool,
    /// The methods' own keys that are set.
    settings: Vec<(&'static Key, Value)>,
}

/// A field of the table.
#[derive(Clone, Copy)]
enum Field {
    Method,
    Signature,
    Polarity,
    DeadTime,
    TimeLimit,
    Library,
    Python,
    CallTimeout,
    Config,
    Key(&'static Key),
}

/// All fields by name, in the order in which they are written.
static FIELDS: LazyLock<Vec<(&'static str, Field)>> = LazyLock::new(|| {
    let mut fields = vec![("method", Field::Method)];
    for key in keys::ALL {
        // How a pole is decided stands before what is allowed of it.
        if key.name == keys::POLE_ERROR.name {
            fields.extend([("signature", Field::Signature), ("polarity", Field::Polarity)]);
        }
        fields.push((key.name, Field::Key(key)));
    }
    fields.push(("dead_time", Field::DeadTime));
    fields.push(("time_limit", Field::TimeLimit));
    fields.push(("library", Field::Library));
    fields.push(("python", Field::Python));
    fields.push(("call_timeout", Field::CallTimeout));
    // A table, which stands behind plain values.
    fields.push(("config", Field::Config));
    fields
});

static NAMES: LazyLock<Vec<&'static str>> = LazyLock::new(|| FIELDS.iter().map(|(name, _)| *name).collect());

/// Work on numbers of a unit that is known by its symbol.
trait WithUnit {
    type Output;
    fn with<U: Unit>(self) -> Self::Output;
}

fn in_unit<W: WithUnit>(unit: &str, share: bool, act: W) -> W::Output {
    match unit {
        "s" => act.with::<Second>(),
        "A" => act.with::<Ampere>(),
        "V" => act.with::<Volt>(),
        "Hz" => act.with::<Hertz>(),
        "deg" => act.with::<Degree>(),
        _ if share => act.with::<Share>(),
        _ => act.with::<One>(),
    }
}

/// A number as it is read.
struct Read<'m, 'de, M>(&'m mut M, PhantomData<&'de ()>);

impl<'de, M: MapAccess<'de>> WithUnit for Read<'_, 'de, M> {
    type Output = Result<f64, M::Error>;
    fn with<U: Unit>(self) -> Self::Output {
        self.0.next_value::<Quantity<U>>().map(Quantity::value)
    }
}

/// A number as people read it.
struct Print(f64);

impl WithUnit for Print {
    type Output = String;
    fn with<U: Unit>(self) -> String {
        Quantity::<U>::si(self.0).to_string()
    }
}

/// What the schema says of a number that may be left out.
struct Describe<'a>(&'a mut SchemaGenerator);

impl WithUnit for Describe<'_> {
    type Output = Schema;
    fn with<U: Unit>(self) -> Schema {
        self.0.subschema_for::<Option<Quantity<U>>>()
    }
}

impl<'de> Deserialize<'de> for Field {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Name;
        impl Visitor<'_> for Name {
            type Value = Field;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("field identifier")
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<Field, E> {
                let known = FIELDS.iter().find(|(known, _)| *known == name);
                known.map(|(_, field)| *field).ok_or_else(|| E::unknown_field(name, &NAMES))
            }
        }
        deserializer.deserialize_identifier(Name)
    }
}

impl<'de> Deserialize<'de> for DetectorTable {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Table;
        impl<'de> Visitor<'de> for Table {
            type Value = DetectorTable;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a table")
            }

            fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<DetectorTable, M::Error> {
                let mut table = DetectorTable::default();
                while let Some(field) = map.next_key::<Field>()? {
                    match field {
                        Field::Method => (table.method, table.named) = (map.next_value()?, true),
                        Field::Signature => table.signature = Some(map.next_value()?),
                        Field::Polarity => table.polarity = Some(map.next_value()?),
                        Field::DeadTime => table.dead_time = Some(map.next_value()?),
                        Field::TimeLimit => table.time_limit = Some(map.next_value()?),
                        Field::Library => table.library = Some(map.next_value()?),
                        Field::Python => table.python = Some(map.next_value()?),
                        Field::CallTimeout => table.call_timeout = Some(map.next_value()?),
                        Field::Config => table.config = map.next_value()?,
                        Field::Key(key) => {
                            let value = match key.kind {
                                Kind::Flag => Value::Flag(map.next_value()?),
                                Kind::Number { unit, share, .. } => {
                                    Value::Number(in_unit(unit, share, Read(&mut map, PhantomData))?)
                                }
                            };
                            table.settings.push((key, value));
                        }
                    }
                }
                Ok(table)
            }
        }
        deserializer.deserialize_struct("DetectorTable", &NAMES, Table)
    }
}

impl Serialize for DetectorTable {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut table = serializer.serialize_struct("DetectorTable", FIELDS.len())?;
        for (name, field) in FIELDS.iter() {
            match field {
                Field::Method if self.has_no_method() => {}
                Field::Method => table.serialize_field(name, &self.method)?,
                Field::Signature => {
                    self.signature.iter().try_for_each(|it| table.serialize_field(name, it))?;
                }
                Field::Polarity => self.polarity.iter().try_for_each(|it| table.serialize_field(name, it))?,
                Field::DeadTime => {
                    self.dead_time.iter().try_for_each(|it| table.serialize_field(name, it))?;
                }
                Field::TimeLimit => {
                    self.time_limit.iter().try_for_each(|it| table.serialize_field(name, it))?;
                }
                Field::Library => self.library.iter().try_for_each(|it| table.serialize_field(name, it))?,
                Field::Python => self.python.iter().try_for_each(|it| table.serialize_field(name, it))?,
                Field::CallTimeout => {
                    self.call_timeout.iter().try_for_each(|it| table.serialize_field(name, it))?;
                }
                Field::Config if self.config.is_empty() => {}
                Field::Config => table.serialize_field(name, &self.config)?,
                Field::Key(key) => match self.value(key) {
                    Some(Value::Number(number)) => table.serialize_field(name, &number)?,
                    Some(Value::Flag(flag)) => table.serialize_field(name, &flag)?,
                    None => {}
                },
            }
        }
        table.end()
    }
}

/// The fields that no method describes, for what the schema says of them.
#[derive(Default, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Common {
    /// The method.
    method: Named<MethodName>,
    /// Which pole draws more current: what the detector is told, right or wrong.
    #[serde(skip_serializing_if = "Option::is_none")]
    signature: Option<Named<Signature>>,
    /// How poles are decided.
    #[serde(skip_serializing_if = "Option::is_none")]
    polarity: Option<Named<PoleRule>>,
    /// Dead time that the detector is told.
    #[serde(skip_serializing_if = "Option::is_none")]
    dead_time: Option<Quantity<Second>>,
    /// Longest time that a detection may take, in simulated time: one that is not done by then fails. Without it, 20 s.
    #[serde(skip_serializing_if = "Option::is_none")]
    time_limit: Option<Quantity<Second>>,
    /// A shared library that is the detector in place of a method, by its path: see docs/firmware.md.
    #[serde(skip_serializing_if = "Option::is_none")]
    library: Option<String>,
    /// A class of Python in place of a method, as `module.Class@digest`. `standstill.run(..., detector=Class)` writes it into the record
    /// of its run, and runs it: see docs/python.md.
    #[serde(skip_serializing_if = "Option::is_none")]
    python: Option<String>,
    /// With --isolate, the longest time that a call of the library may take on the clock. Without it, 1 s.
    #[serde(skip_serializing_if = "Option::is_none")]
    call_timeout: Option<Quantity<Second>>,
    /// What the library is told, handed over as lines KEY=VALUE.
    #[serde(skip_serializing_if = "IndexMap::is_empty")]
    #[schemars(with = "IndexMap<String, Scalar>")]
    config: IndexMap<String, toml::Value>,
}

/// What a library can be told: a text, a number, or true or false.
#[derive(JsonSchema)]
#[serde(untagged)]
#[expect(dead_code, reason = "only its schema is used")]
enum Scalar {
    Text(String),
    Number(f64),
    Flag(bool),
}

impl JsonSchema for DetectorTable {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "DetectorTable".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = Common::json_schema(generator);
        schema.insert("description".to_owned(), ABOUT.into());
        let described: Vec<(String, Schema)> = keys::ALL
            .iter()
            .map(|key| {
                let mut schema = match key.kind {
                    Kind::Flag => generator.subschema_for::<Option<bool>>(),
                    Kind::Number { unit, share, .. } => in_unit(unit, share, Describe(generator)),
                };
                // A full stop ends a sentence of the documentation, which the schema has as it stands there.
                schema.insert("description".to_owned(), key.about.into());
                (key.name.to_owned(), schema)
            })
            .collect();
        if let Some(properties) = schema.get_mut("properties").and_then(serde_json::Value::as_object_mut) {
            properties.extend(described.into_iter().map(|(name, schema)| (name, schema.to_value())));
        }
        schema
    }
}

const ABOUT: &str = "The method and its settings. What is left out suits the motor; a setting that the method does not have is an error.";

impl DetectorTable {
    /// Whether something else stands in place of a method, and no method is named.
    fn has_no_method(&self) -> bool {
        (self.library.is_some() || self.library_is_an_axis || self.python.is_some()) && !self.named
    }

    /// What it is for people: the class, the library's file, or the method.
    pub fn name(&self) -> &str {
        let stem = |library| std::path::Path::new(library).file_stem().and_then(|stem| stem.to_str());
        match (&self.python, &self.library) {
            (Some(class), _) => class.split('@').next().unwrap_or(class),
            (None, Some(library)) => stem(library).unwrap_or(library),
            (None, None) => self.method.0.name(),
        }
    }

    /// Settings of methods beside a library, which has none of theirs.
    pub(super) fn foreign_to_library(&self) -> Option<&'static str> {
        let polarity = self.polarity.map(|_| "polarity");
        let method = self.named.then_some("method");
        method.or(polarity).or_else(|| self.settings.first().map(|(key, _)| key.name))
    }

    /// What is set of a key.
    fn value(&self, key: &Key) -> Option<Value> {
        self.settings.iter().find(|(set, _)| set.name == key.name).map(|(_, value)| *value)
    }

    /// Sets what the table has in the settings of a method, for a motor whose poles' currents differ by `difference`.
    pub(super) fn apply(&self, method: &mut Method<f64>, difference: f64) -> Result<(), FileError> {
        let name = self.method.0;
        let foreign = |key: &str| FileError::foreign_setting(key, name);
        if let Some(Named(rule)) = self.polarity {
            let polarity = method.polarity_mut().ok_or_else(|| foreign("polarity"))?;
            polarity.rule = rule.settings(difference);
        }
        for key in keys::ALL {
            let Some(value) = self.value(key) else { continue };
            check(key, value)?;
            if !method.set(key, value) {
                return Err(foreign(key.name));
            }
        }
        Ok(())
    }
}

/// Whether a value is within its key's range.
fn check(key: &Key, value: Value) -> Result<(), FileError> {
    let (Kind::Number { whole, range: [low, high], needed, .. }, Value::Number(number)) = (key.kind, value)
    else {
        return Ok(());
    };
    if (low..=high).contains(&number) && !(whole && number.fract() != 0.0) {
        return Ok(());
    }
    Err(refused(key, value, needed))
}

/// The error of a value, told as its range is written.
fn refused(key: &Key, value: Value, needed: &str) -> FileError {
    let written = match (key.kind, value) {
        (Kind::Number { share: true, .. }, Value::Number(number)) if needed.contains('%') => {
            format!("{} %", standstill_quantity::rounded(number, 2))
        }
        (Kind::Number { unit, share, .. }, Value::Number(number)) => in_unit(unit, share, Print(number)),
        (_, Value::Flag(flag)) => flag.to_string(),
        (Kind::Flag, Value::Number(number)) => number.to_string(),
    };
    FileError::key(&format!("detector.{}", key.name), &written, needed)
}

/// The error of settings with which a method cannot work: of a key with the value that it has.
pub(super) fn unworkable(method: &Method<f64>, error: &SettingsError) -> FileError {
    let key = keys::ALL.iter().find(|key| key.name == error.setting);
    match key.and_then(|key| Some((key, method.get(key)?))) {
        Some((key, value)) => refused(key, value, error.needed),
        None => FileError::settings(error),
    }
}
