//! The scenario file that `check` writes, with the recommended settings and ready to run.

use std::path::{Path, PathBuf};
use std::{fs, io};

use standstill_plant::DataSheet;
use standstill_scenario::{Document, Origin};
use toml::Value;

use crate::arguments::Check;
use crate::error::Error;
use crate::shell::asked::digest;
use crate::shell::output::{beside, folder_of, remove_stale, replace};
use crate::shell::wrap::wrapped;

/// Width of the file's comment in columns.
const COLUMNS: usize = 98;

/// Beginning of the comment line that states the file's origin.
const WRITTEN: &str = "Written by `standstill check";

/// The outcome of writing the scenario file.
pub enum Written {
    /// The file was written, or it already had this content.
    Done(PathBuf),
    /// Another file exists at this path and was not replaced.
    InTheWay(PathBuf),
    /// The file cannot be written. The user did not ask for it with `--write`, so this is no error.
    Failed(String),
}

impl Written {
    /// Returns the path of the file. None if the file was not written.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Done(path) => Some(path),
            Self::InTheWay(_) | Self::Failed(_) => None,
        }
    }
}

/// Writes the scenario file to the path of `--write`, or else beside the scenario that was checked. Replaces a file that a user has
/// written or edited only if `--force` is given.
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
    let scenario = with_whole_numbers(&recommended.load()?.text()?);
    let written = format!("{WRITTEN} {}`; digest of the lines below: {}", options.motor, digest(&scenario));
    let mut text = String::new();
    for line in wrapped(head, COLUMNS).into_iter().chain([written]) {
        text.extend(["# ", &line, "\n"]);
    }
    text += &scenario;
    remove_stale(folder_of(&path));
    match fs::read(&path) {
        Ok(there) if there == text.as_bytes() => return Ok(Written::Done(path)),
        // An answer of an earlier check that nobody has edited is replaced.
        Ok(there) if is_unedited(&String::from_utf8_lossy(&there)) => {}
        Ok(_) if !options.force && options.write.is_some() => {
            return Err(Error::InTheWay {
                path,
                is: "there already",
                needed: "a new file, or --force given",
            });
        }
        Ok(_) if !options.force => return Ok(Written::InTheWay(path)),
        Err(error) if error.kind() != io::ErrorKind::NotFound && options.write.is_none() => {
            return Ok(Written::Failed(format!("{}: {error}", path.display())));
        }
        _ => {}
    }
    match replace(&path, text.as_bytes()) {
        Ok(()) => Ok(Written::Done(path)),
        Err(Error::Write(path, error)) if options.write.is_none() => {
            Ok(Written::Failed(format!("{}: {error}", path.display())))
        }
        Err(error) => Err(error),
    }
}

/// Returns the scenario with the values of keys that take whole numbers written as such: `rounds = 24` in place of `rounds = 24.0`.
fn with_whole_numbers(scenario: &str) -> String {
    let mut table = "";
    let mut text = String::new();
    for line in scenario.lines() {
        let header = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
        table = header.unwrap_or(table);
        let is_whole = |(name, _): &(&str, &str)| {
            let path = if table.is_empty() { (*name).to_owned() } else { format!("{table}.{name}") };
            standstill_scenario::key(&path).and_then(|key| key.range).is_some_and(|range| range.whole)
        };
        let whole = line.split_once(" = ").filter(is_whole).and_then(|_| line.strip_suffix(".0"));
        text.extend([whole.unwrap_or(line), "\n"]);
    }
    text
}

/// Returns true if a file is as an earlier `check` wrote it.
fn is_unedited(text: &str) -> bool {
    let Some((_, rest)) = text.split_once(WRITTEN) else { return false };
    let Some((line, scenario)) = rest.split_once('\n') else { return false };
    line.ends_with(&format!(": {}", digest(scenario)))
}

/// Checks before the computation that the file of `--write` can be written.
///
/// # Errors
/// The folder does not exist or cannot be written, or the file exists and `--force` is not given.
pub fn free(options: &Check) -> Result<(), Error> {
    let Some(path) = &options.write else { return Ok(()) };
    let refused = |is, needed| Err(Error::InTheWay { path: path.clone(), is, needed });
    if !folder_of(path).is_dir() {
        return refused("in a folder that is not there", "a folder that is");
    }
    // A file that an earlier `check` wrote is accepted here: `write` compares its content with the new answer.
    let is_answer = || fs::read(path).is_ok_and(|text| String::from_utf8_lossy(&text).contains(WRITTEN));
    if path.exists() && !options.force && !is_answer() {
        return refused("there already", "a new file, or --force given");
    }
    // A pipe or a device is written to directly. For a file, a temporary folder beside it is made and removed, to test whether the place
    // can be written.
    if path.exists() && !path.is_file() { Ok(()) } else { beside(path).map(drop) }
}

/// Returns the name of the file: `check-` and the name of the motor or scenario.
fn name(motor: &str) -> String {
    let stem = Path::new(motor).file_stem().unwrap_or_default().to_string_lossy();
    format!("check-{stem}.toml")
}

/// Makes the motor's path in the document absolute, so that a file in another folder can use it.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_whole_numbers_of_keys_that_take_no_others_have_no_decimals() {
        let text = "trials = 1000\n\n[inverter]\ndc_link = 48.0\n\n[detector]\nrounds = 24.0\npulse = 1.0\n";
        assert_eq!(with_whole_numbers(text), text.replace("24.0", "24"));
    }
}
