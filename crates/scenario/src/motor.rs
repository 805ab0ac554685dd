//! The motor of a scenario: a name, a path, or a data sheet inside the scenario.

use std::path::{Path, PathBuf};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use standstill_files::TableError;
use standstill_files::sheet::Sheet;
use standstill_plant::{DataSheet, Files, MotorError, built_in_names};
use toml::{Table, Value};

use super::document::FileError;
use super::suggestion::quoted;

/// The motor of a scenario: the name of a built-in motor, the path of a data sheet, or a table with a data sheet. The key `base` of the
/// table names another motor. This motor provides all values that the table does not contain.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum MotorSpec {
    /// A built-in motor's name or a path.
    Named(String),
    /// A data sheet inside the scenario.
    Table(Table),
}

impl Default for MotorSpec {
    fn default() -> Self {
        Self::Named("paper-5k5".to_owned())
    }
}

impl<'de> Deserialize<'de> for MotorSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = MotorSpec;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                write!(f, "a motor's name, the path of a data sheet, or a table")
            }

            fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<MotorSpec, E> {
                Ok(MotorSpec::Named(name.to_owned()))
            }

            fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<MotorSpec, M::Error> {
                Table::deserialize(MapAccessDeserializer::new(map)).map(MotorSpec::Table)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl JsonSchema for MotorSpec {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Motor".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut sheet = Sheet::json_schema(generator);
        // With a base, no other key is required.
        sheet.remove("required");
        if let Some(properties) =
            sheet.get_mut("properties").and_then(|properties| properties.as_object_mut())
        {
            let base = serde_json::json!({ "type": "string", "description": "The motor that this one differs from: a built-in name or a path." });
            properties.insert("base".to_owned(), base);
        }
        let names: Vec<&str> = built_in_names().collect();
        json_schema!({
            "anyOf": [
                { "type": "string", "enum": names },
                { "type": "string", "pattern": "\\.toml$", "description": "Path of a data sheet, from the scenario's folder." },
                sheet
            ]
        })
    }
}

impl MotorSpec {
    /// Reads the data sheet. Relative paths start at the folder of `files`.
    pub fn sheet(&self, files: &Files) -> Result<DataSheet, FileError> {
        match self {
            Self::Named(name) => named(name, files, "motor"),
            Self::Table(table) => in_place(table, files),
        }
    }

    /// Converts an error of the data sheet. If the wrong value stands in the scenario itself, the resulting error names the key of the
    /// scenario.
    pub(super) fn wrong(&self, error: MotorError) -> FileError {
        if let (Self::Table(table), MotorError::Value { key, found, needed, .. }) = (self, &error) {
            let mut parts = key.split('.');
            let first = parts.next().and_then(|part| table.get(part));
            if parts.try_fold(first, |at, part| Some(at?.get(part))).flatten().is_some() {
                return FileError::key(&format!("motor.{key}"), found, needed);
            }
        }
        FileError::Motor(error)
    }

    /// Returns the value of a number in the data sheet, such as `winding.resistance`. This value is the mean of a tolerance. Returns none
    /// if the data sheet does not have the number.
    ///
    /// # Errors
    /// The data sheet cannot be read, or gives the number under another key.
    pub(super) fn nominal(&self, key: &str, files: &Files) -> Result<Option<Value>, FileError> {
        let name = match self {
            Self::Named(name) => Some(name.as_str()),
            Self::Table(table) => table.get("base").and_then(Value::as_str),
        };
        let Some(name) = name else { return Ok(None) };
        let (_, text) = text(name, files, "motor")?;
        let Ok(sheet) = text.parse::<Table>() else { return Ok(None) };
        if let Some(other) = DataSheet::given_instead(key, &sheet) {
            let found = format!("a motor whose sheet gives this number as `{other}`");
            let needed = format!("a tolerance of `motor.nameplate.{other}`");
            return Err(FileError::key(&format!("tolerances.motor.{key}"), &found, &needed));
        }
        let sheet = Value::Table(sheet);
        let value = || {
            let number = key.split('.').try_fold(&sheet, |value, part| value.as_table()?.get(part))?;
            // A number of a nameplate may be plain, without a source.
            match number {
                Value::Table(sourced) => sourced.get("value").cloned(),
                plain => Some(plain.clone()),
            }
        };
        Ok(value())
    }

    /// Returns the whole data sheet as a table. With this table, the file of the data sheet need not be read again.
    pub(super) fn resolved(&self, files: &Files) -> Result<Table, FileError> {
        let base;
        let table = match self {
            Self::Named(name) => {
                // Called only for its errors, which name the key `motor` instead of `motor.base`.
                named(name, files, "motor")?;
                base = std::iter::once(("base".to_owned(), Value::String(name.clone()))).collect();
                &base
            }
            Self::Table(table) => table,
        };
        let (file, mut sheet) = whole(table, files)?;
        // The path of a flux map starts at the folder of its data sheet. The copied sheet has no folder, so the path is
        // made absolute.
        if let Some(map) = map_of(&mut sheet) {
            let beside = beside(&file, map);
            let absolute = std::path::absolute(beside)
                .map_err(|error| FileError::key("motor.map.file", map, &format!("a path: {error}")))?;
            *map = absolute.to_string_lossy().into_owned();
        }
        Ok(sheet)
    }

    /// Returns the motor's name for messages and reports: the name of a built-in motor or the path of a data sheet. For a table, returns
    /// its entry `name`, or the name of its base.
    pub fn name(&self) -> String {
        match self {
            Self::Named(name) => name.clone(),
            Self::Table(table) => match (table.get("name"), table.get("base")) {
                (Some(Value::String(name)), _) => name.clone(),
                (_, Some(Value::String(base))) if table.len() == 1 => base.clone(),
                (_, Some(Value::String(base))) => format!("{base}, changed"),
                _ => "a motor of its own".to_owned(),
            },
        }
    }
}

/// Returns the path of the flux-map file in a data sheet; none without a map.
pub(super) fn map_of(sheet: &mut Table) -> Option<&mut String> {
    let map = match sheet.get_mut("map")?.get_mut("file")? {
        Value::Table(sourced) => sourced.get_mut("value")?,
        other => other,
    };
    if let Value::String(map) = map { Some(map) } else { None }
}

fn beside(file: &str, map: &str) -> PathBuf {
    Path::new(file).parent().unwrap_or_else(|| Path::new("")).join(map)
}

/// Returns the text of a named data sheet, and the name of its file.
fn text(name: &str, files: &Files, key: &str) -> Result<(String, String), FileError> {
    if let Some(text) = DataSheet::built_in_text(name) {
        return Ok((name.to_owned(), text.to_owned()));
    }
    let path = files.folder().join(name);
    if path.extension().is_none_or(|extension| extension != "toml") {
        let known: Vec<&str> = built_in_names().collect();
        let needed = format!("a built-in motor ({}) or the path of a data sheet (.toml)", known.join(", "));
        return Err(FileError::key(key, &quoted(name, built_in_names()), &needed));
    }
    let text = files.text(&path).map_err(|error| {
        FileError::key(key, &path.display().to_string(), &format!("a readable file: {error}"))
    })?;
    if let Some(motor) = of_scenario(&text) {
        let found = format!("`{name}`, which is a scenario");
        let needed = format!("a data sheet, or a built-in motor; the scenario's own motor is {motor}");
        return Err(FileError::key(key, &found, &needed));
    }
    Ok((path.display().to_string(), text))
}

/// Returns the name of the motor in a scenario. `text` was read as a data sheet by mistake. Returns none if the text is not a scenario.
fn of_scenario(text: &str) -> Option<String> {
    const OWN: [&str; 7] = ["motor", "errors", "detector", "sensors", "inverter", "trials", "axes"];
    let table = text.parse::<Table>().ok()?;
    let sheet = ["name", "winding", "nameplate"].iter().any(|key| table.contains_key(*key));
    if sheet || !OWN.iter().any(|key| table.contains_key(*key)) {
        return None;
    }
    Some(table.get("motor").map_or_else(
        || "paper-5k5".to_owned(),
        |motor| match motor {
            Value::String(name) => format!("`{name}`"),
            _ => "in its [motor]".to_owned(),
        },
    ))
}

fn named(name: &str, files: &Files, key: &str) -> Result<DataSheet, FileError> {
    let (file, text) = text(name, files, key)?;
    let sheet = DataSheet::parse(&file, &text).map_err(FileError::Motor)?;
    Ok(sheet.with_files(files))
}

/// Keys of `[map]` that describe the file of the flux map. They need no source.
const WORDS: [&str; 3] = ["values", "columns", "beyond"];

/// Merges `changes` into `sheet`. A number without a source replaces the number and the source in the sheet, and is marked as assumed in
/// the scenario. `depth` is 0 for the whole sheet, 1 for a table of the sheet, and 2 for a number with several parts.
fn lay_over(sheet: &mut Table, changes: &Table, depth: usize) {
    for (key, value) in changes {
        match (sheet.get_mut(key), value) {
            (Some(Value::Table(below)), Value::Table(changes)) if depth == 0 => lay_over(below, changes, 1),
            (None, Value::Table(changes)) if depth == 0 => {
                let mut below = Table::new();
                lay_over(&mut below, changes, 1);
                sheet.insert(key.clone(), Value::Table(below));
            }
            // Several numbers of one key, such as a nameplate's saturation.
            (Some(Value::Table(below)), Value::Table(changes))
                if [&*below, changes].iter().all(|table| !table.contains_key("value")) =>
            {
                lay_over(below, changes, 2);
            }
            (_, Value::Table(_)) => {
                sheet.insert(key.clone(), value.clone());
            }
            (_, value) if depth > 0 && !WORDS.contains(&key.as_str()) => {
                let sourced = [
                    ("value", value.clone()),
                    ("source", "assumed".into()),
                    ("reason", "set in the scenario".into()),
                ];
                let sourced = sourced.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
                sheet.insert(key.clone(), Value::Table(sourced));
            }
            (_, value) => {
                sheet.insert(key.clone(), value.clone());
            }
        }
    }
}

/// Returns a file name for messages, and the whole data sheet of a motor that the scenario gives as a table. The table is merged with the
/// data sheet of its base.
fn whole(table: &Table, files: &Files) -> Result<(String, Table), FileError> {
    let mut changes = table.clone();
    let base = match changes.remove("base") {
        None => None,
        Some(Value::String(name)) => Some(name),
        Some(other) => {
            return Err(FileError::key("motor.base", &other.to_string(), "a motor's name or path"));
        }
    };
    let (file, mut sheet) = match base {
        Some(name) => {
            let (file, text) = text(&name, files, "motor.base")?;
            // The base must be a valid data sheet by itself, or its errors would be reported as errors of the scenario.
            let whole = DataSheet::parse(&file, &text).map_err(FileError::Motor)?;
            let mut sheet = text.parse::<Table>().map_err(|error| {
                FileError::key("motor.base", &name, &format!("a data sheet: {}", error.message()))
            })?;
            // A nameplate sheet without a name is named after its file.
            for (key, text) in [("name", whole.name()), ("title", whole.title())] {
                sheet.entry(key).or_insert_with(|| text.into());
            }
            (file, sheet)
        }
        None => (files.folder().join("scenario").display().to_string(), Table::new()),
    };
    for (key, text) in [("name", "scenario"), ("title", "A motor of a scenario"), ("notes", "")] {
        sheet.entry(key).or_insert_with(|| text.into());
    }
    lay_over(&mut sheet, &changes, 0);
    Ok((file, sheet))
}

fn in_place(table: &Table, files: &Files) -> Result<DataSheet, FileError> {
    let (file, sheet) = whole(table, files)?;
    if sheet.contains_key("nameplate") {
        let sheet = DataSheet::of_nameplate(&file, &sheet, None).map_err(FileError::Motor)?;
        return Ok(sheet.with_files(files));
    }
    match DataSheet::read(&file, sheet) {
        Ok(sheet) => sheet.map(|sheet| sheet.with_files(files)).map_err(FileError::Motor),
        Err(TableError { key, message }) => Err(FileError::serde(&format!("motor.{key}"), &message)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_only_what_differs_from_its_base_is_changed() {
        let name = |sheet: &str| MotorSpec::Table(sheet.parse().expect("a table")).name();
        assert_eq!(name(r#"base = "gimbal""#), "gimbal");
        assert_eq!(name("base = \"gimbal\"\nwinding.resistance = \"9 Ω\""), "gimbal, changed");
        assert_eq!(name("base = \"gimbal\"\nname = \"mine\""), "mine");
    }
}
