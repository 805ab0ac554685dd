//! A scenario as TOML text, with the position of each key, the overrides, and errors that name positions.

mod error;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use standstill_files::{Files, TableError, key_span, line_of, read_keyed, syntax};
use toml::{Table, Value};

pub use self::error::{FileError, Origin};
use super::axes::AxisSpec;
use super::hosted::Provider;
use super::tables::ScenarioFile;

/// A scenario file as TOML, with its overrides. An override is a value from the command line, a value of a sweep axis, or a value that a
/// trial draws.
#[derive(Clone, Debug)]
pub struct Document {
    file: PathBuf,
    text: Arc<str>,
    pub(super) table: Table,
    pub(super) changed: Vec<(String, Origin)>,
    files: Files,
    /// The class that `detector.python` names, if the running program provides it.
    pub(super) hosted: Option<Arc<dyn Provider>>,
}

/// Largest number of parts in the path of a key.
const MOST_PARTS: usize = 16;

impl Document {
    /// Reads a scenario file. [`Document::files`] does not list this file, because a run is identified by the file's
    /// content with all overrides.
    pub fn read(file: &Path) -> Result<Self, FileError> {
        let text = Files::default().text(file);
        let text =
            text.map_err(|error| FileError::Read { file: file.to_owned(), error: error.to_string() })?;
        Self::parse(file, &text)
    }

    /// Parses a scenario from text. `file` is its name in messages, and relative paths start at the folder of `file`.
    pub fn parse(file: &Path, text: &str) -> Result<Self, FileError> {
        let table = text.parse::<Table>().map_err(|error| FileError::Syntax {
            file: file.to_owned(),
            line: line_of(text, error.span().map_or(0, |span| span.start)),
            message: syntax(text, &error),
        })?;
        let files = Files::of(file.parent().unwrap_or_else(|| Path::new("")));
        Ok(Self { file: file.to_owned(), text: text.into(), table, changed: Vec::new(), files, hosted: None })
    }

    /// Sets a key, such as `sensors.noise`. `value` is the text that would stand in the file. A string needs no quotes.
    pub fn set(&mut self, key: &str, value: &str, origin: Origin) -> Result<(), FileError> {
        let parsed =
            format!("value = {value}").parse::<Table>().ok().and_then(|mut table| table.remove("value"));
        self.set_value(key, parsed.unwrap_or_else(|| value.into()), origin)
    }

    /// Sets a key to a TOML value and records the origin of the value.
    pub fn set_value(&mut self, key: &str, value: Value, origin: Origin) -> Result<(), FileError> {
        let place = origin.to_string();
        let wrong = |message| FileError::Key { place: place.clone(), key: key.to_owned(), message };
        // The keys of axes and tolerances have dots in them.
        let dotted = ["axes.", "tolerances."].iter().any(|table| key.starts_with(table));
        let mut parts: Vec<&str> = key.splitn(if dotted { 2 } else { usize::MAX }, '.').collect();
        // Nested tables are read recursively, so their depth is limited. Keys of a scenario have only a few parts.
        let last = parts.pop().filter(|last| !last.is_empty() && parts.len() < MOST_PARTS);
        let Some(last) = last.filter(|_| parts.iter().all(|part| !part.is_empty())) else {
            return Err(wrong("not a key such as `sensors.noise`".to_owned()));
        };
        let mut table = &mut self.table;
        let mut parts_left = parts.iter().enumerate();
        while let Some((depth, part)) = parts_left.next() {
            let entry = table.entry(*part).or_insert_with(|| {
                if *part == "faults" { Value::Array(Vec::new()) } else { Value::Table(Table::new()) }
            });
            // A motor given by name becomes a table with this name as its `base`.
            if depth == 0
                && *part == "motor"
                && let Value::String(name) = entry
            {
                let base = Value::String(std::mem::take(name));
                *entry = Value::Table(std::iter::once(("base".to_owned(), base)).collect());
            }
            // In a list, the next part of the path is the index of a table, from 0; the index after the last one adds a
            // table.
            let below = match entry {
                Value::Array(list) => {
                    let (number, there) = (parts_left.next(), list.len());
                    let number = number.and_then(|(_, number)| number.parse::<usize>().ok());
                    if number == Some(there) {
                        list.push(Value::Table(Table::new()));
                    }
                    let Some(below) = number.and_then(|number| list.get_mut(number)) else {
                        return Err(wrong(format!("needed a number from 0 to {there} after `{part}.`")));
                    };
                    below
                }
                entry => entry,
            };
            let Value::Table(below) = below else {
                return Err(wrong(format!("`{part}` is {below}, not a table")));
            };
            table = below;
        }
        if parts.first() == Some(&"motor") && !self.table_has_motor() {
            self.base_of_default();
        }
        if let Some(table) = self.holder(&parts) {
            table.insert(last.to_owned(), value);
        }
        self.changed.push((key.to_owned(), origin));
        Ok(())
    }

    /// Replaces the motor's name or path by its whole data sheet, so that later loads read no file for the motor.
    pub(super) fn resolve_motor(&mut self, sheet: Table) {
        self.table.insert("motor".to_owned(), Value::Table(sheet));
    }

    /// Returns the table at these parts of a key's path; none if there is no such table.
    fn holder(&mut self, parts: &[&str]) -> Option<&mut Table> {
        let Some((first, below)) = parts.split_first() else { return Some(&mut self.table) };
        let value = self.table.get_mut(*first)?;
        below.iter().try_fold(value, |value, part| child_mut(value, part))?.as_table_mut()
    }

    /// Returns true if `[motor]` has entries other than empty tables that an override created.
    fn table_has_motor(&self) -> bool {
        match self.table.get("motor") {
            Some(Value::Table(motor)) => motor.values().any(|value| !is_empty(value)),
            _ => false,
        }
    }

    /// Sets the default motor as the base if an override changes a key of the motor and the file names no motor.
    fn base_of_default(&mut self) {
        if let Some(Value::Table(motor)) = self.table.get_mut("motor") {
            motor.insert("base".to_owned(), "paper-5k5".into());
        }
    }

    /// Turns a key into a sweep axis, whose values replace the key's value in the file.
    pub fn vary(&mut self, key: &str, axis: &AxisSpec) -> Result<(), FileError> {
        let value =
            Value::try_from(axis).map_err(|error| FileError::key(key, &error.to_string(), "an axis"))?;
        let axes = self.table.entry("axes").or_insert_with(|| Value::Table(Table::new()));
        let Value::Table(axes) = axes else { return Err(FileError::key("axes", "no table", "a table")) };
        axes.insert(key.to_owned(), value);
        self.changed.push((format!("axes.{key}"), Origin::CommandLine));
        Ok(())
    }

    /// Files that were read because the scenario names them. Their paths are relative to the folder of the scenario
    /// file.
    pub fn files(&self) -> &Files {
        &self.files
    }

    /// Forbids reading further files from now on.
    pub(super) fn seal(&mut self) {
        self.files = self.files.sealed();
    }

    /// Restricts reading of further files to this folder and those below it; without a folder, forbids reading further
    /// files.
    ///
    /// # Errors
    /// `folder` is not a folder.
    pub fn fence(&mut self, folder: Option<&Path>) -> Result<(), FileError> {
        let fenced = match folder {
            None => Ok(self.files.sealed()),
            Some(folder) => self.files.fenced(folder),
        };
        self.files = fenced.map_err(|error| FileError::Read {
            file: folder.unwrap_or_else(|| Path::new("")).to_owned(),
            error: error.to_string(),
        })?;
        Ok(())
    }

    /// Removes a key, as if it had never been set.
    pub fn remove(&mut self, key: &str) {
        let mut parts: Vec<&str> = key.split('.').collect();
        let last = parts.pop().unwrap_or_default();
        if let Some(table) = self.holder(&parts) {
            table.remove(last);
        }
        self.changed.retain(|(changed, _)| changed != key);
    }

    /// Returns the origin of a key's value. Returns none if the file itself sets the value or the key is not set.
    pub fn origin(&self, key: &str) -> Option<Origin> {
        self.changed.iter().rev().find(|(changed, _)| changed == key).map(|(_, origin)| *origin)
    }

    /// Returns the value of a key, overrides included.
    pub fn get(&self, key: &str) -> Option<&Value> {
        let (first, rest) = match key.split_once('.') {
            Some((first, rest)) => (first, Some(rest)),
            None => (key, None),
        };
        rest.into_iter()
            .flat_map(|rest| rest.split('.'))
            .try_fold(self.table.get(first)?, |value, part| child(value, part))
    }

    /// Parses the document into typed tables.
    pub fn load(&self) -> Result<ScenarioFile, FileError> {
        let mut file: ScenarioFile = self.read_as()?;
        file.hosted.clone_from(&self.hosted);
        Ok(file)
    }

    /// Parses the document into the tables of another kind of file, with the same error messages as for scenarios.
    ///
    /// # Errors
    /// A key is unknown or a value is invalid; the error names its line.
    pub fn read_as<T: serde::de::DeserializeOwned>(&self) -> Result<T, FileError> {
        read_keyed(Value::Table(self.table.clone()))
            .map_err(|TableError { key, message }| FileError::serde(&key, &message))
            .map_err(|error| self.locate(error))
    }

    /// Returns the error for a key whose value a command cannot use. `found` describes the value found, `needed` the values allowed. The
    /// error contains the position of the key.
    pub fn refuse(&self, key: &str, found: &str, needed: &str) -> FileError {
        self.locate(FileError::key(key, found, needed))
    }

    /// Adds the position of the key to an error that has no position yet.
    pub fn locate(&self, error: FileError) -> FileError {
        let FileError::Key { place, key, message } = error else { return error };
        if !place.is_empty() {
            return FileError::Key { place, key, message };
        }
        // `changed` has the keys without quotes around parts with dots.
        let plain = key.replace('"', "").replace('[', ".").replace(']', "");
        let by_change = self.changed.iter().rev().find(|(changed, _)| {
            plain == *changed
                || changed.starts_with(&format!("{plain}."))
                || plain.starts_with(&format!("{changed}."))
        });
        let file = self.file.display();
        let place = match (by_change, key_span(&self.text, &key)) {
            (Some((changed, origin)), _) => {
                let table = match origin {
                    Origin::CommandLine | Origin::Option(_) => None,
                    Origin::Axis => Some("axes"),
                    Origin::Tolerance => Some("tolerances"),
                };
                // The axis or tolerance may stand in the file or come from the command line.
                let own = table.map(|table| format!("{table}.{changed}"));
                let own = own.filter(|own| self.changed.iter().all(|(key, _)| key != own));
                match own.and_then(|own| key_span(&self.text, &own)) {
                    Some(span) => format!("{file}: line {}, {origin}", line_of(&self.text, span.start)),
                    None => origin.to_string(),
                }
            }
            (None, Some(span)) => format!("{file}: line {}", line_of(&self.text, span.start)),
            (None, None) => file.to_string(),
        };
        FileError::Key { place, key, message }
    }
}

/// Returns the value inside `value` that one part of a key's path names. In a table, the part is the name of an entry. In a list, the part
/// is the number of an element.
fn child<'v>(value: &'v Value, part: &str) -> Option<&'v Value> {
    match value {
        Value::Table(table) => table.get(part),
        Value::Array(list) => list.get(part.parse::<usize>().ok()?),
        _ => None,
    }
}

fn child_mut<'v>(value: &'v mut Value, part: &str) -> Option<&'v mut Value> {
    match value {
        Value::Table(table) => table.get_mut(part),
        Value::Array(list) => list.get_mut(part.parse::<usize>().ok()?),
        _ => None,
    }
}

fn is_empty(value: &Value) -> bool {
    matches!(value, Value::Table(table) if table.values().all(is_empty))
}
