//! The scenario that `check` writes: what it recommends, ready to be run.

use std::fs;
use std::path::{Path, PathBuf};

use standstill_plant::DataSheet;
use standstill_scenario::{Document, Origin};
use toml::Value;

use crate::arguments::Check;
use crate::error::Error;
use crate::terminal::wrapped;

/// Columns of its comment.
const COLUMNS: usize = 98;

/// What became of it.
pub enum Written {
    /// It is there.
    Done(PathBuf),
    /// Another one is there and stays.
    InTheWay(PathBuf),
}

impl Written {
    /// Where it is.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Done(path) => Some(path),
            Self::InTheWay(_) => None,
        }
    }
}

/// Writes it beside the scenario that was asked about, or where the option says. A file that says something else is not replaced.
pub fn write(
    options: &Check,
    asked: &Document,
    recommended: &Document,
    head: &str,
) -> Result<Written, Error> {
    let folder = asked.files().folder().to_owned();
    let path = options.write.clone().unwrap_or_else(|| folder.join(name(&options.motor)));
    let mut recommended = recommended.clone();
    if path.parent().unwrap_or_else(|| Path::new("")) != folder {
        from_anywhere(&mut recommended, &folder)?;
    }
    let written = format!("Written by `standstill check {}`.", options.motor);
    let mut text = String::new();
    for line in wrapped(head, COLUMNS).into_iter().chain([written]) {
        text.extend(["# ", &line, "\n"]);
    }
    text += &recommended.load()?.text()?;
    match fs::read_to_string(&path) {
        Ok(there) if there == text => return Ok(Written::Done(path)),
        Ok(_) if !options.force && options.write.is_some() => {
            return Err(Error::InTheWay {
                path,
                is: "there already",
                needed: "a new file, or --force given",
            });
        }
        Ok(_) if !options.force => return Ok(Written::InTheWay(path)),
        _ => {}
    }
    fs::write(&path, text).map_err(|error| Error::Write(path.clone(), error))?;
    Ok(Written::Done(path))
}

/// `check-` and what was asked about.
fn name(motor: &str) -> String {
    let stem = Path::new(motor).file_stem().unwrap_or_default().to_string_lossy();
    format!("check-{stem}.toml")
}

/// The motor's path from the root, for a file in another folder.
fn from_anywhere(document: &mut Document, folder: &Path) -> Result<(), Error> {
    for key in ["motor", "motor.base"] {
        let Some(Value::String(name)) = document.get(key) else { continue };
        if DataSheet::built_in_text(name).is_none()
            && let Ok(path) = std::path::absolute(folder.join(name))
        {
            document.set_value(key, path.to_string_lossy().into_owned().into(), Origin::CommandLine)?;
        }
    }
    Ok(())
}
