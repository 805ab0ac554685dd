//! Makes the document of a command from a scenario file, or from a built-in one, with the settings of options and `-s`.

use std::path::Path;

use standstill_detect::{Decay, MethodName};
use standstill_interface::Choice;
use standstill_plant::DataSheet;
use standstill_scenario::{AxisSpec, Document, Origin, seed_value};
use toml::Value;

use crate::arguments::{Axes, Keys, Load, PaperDecay, Seed, Setup, Source, Temperatures};
use crate::error::Error;
use crate::shell::command_line::set;
use crate::shell::host;
use crate::shell::terminal::tell;

/// The built-in scenario with the paper's method and motor, which is the default of `reproduce` and `trace`.
const PAPER: &str = include_str!("../scenarios/reproduce.toml");

/// Built-in documents for commands without a scenario file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shipped {
    /// A scenario without keys, in which all values are defaults.
    Empty,
    /// The scenario with the paper's method.
    Paper,
}

/// Options that are shorthands for keys. Each entry contains the option, the key and the value.
#[derive(Debug, Default)]
#[must_use]
pub struct Shorthands(Vec<(&'static str, &'static str, Value)>);

impl Shorthands {
    /// Adds an option and the key that it sets, if the option is given.
    pub fn with(mut self, option: &'static str, key: &'static str, value: Option<impl Into<Value>>) -> Self {
        self.0.extend(value.map(|value| (option, key, value.into())));
        self
    }

    /// Returns the given options with the keys that they set.
    pub fn given(&self) -> Vec<(&'static str, &'static str)> {
        self.0.iter().map(|(option, key, _)| (*option, *key)).collect()
    }

    /// Returns the keys that the options set as a text of `-s KEY=VALUE`, for commands that do not have these options. The key `left_out`
    /// is omitted.
    pub fn as_keys(&self, left_out: Option<&str>) -> String {
        let key = |(_, key, value): &(&str, &str, Value)| {
            set(key, &value.as_str().map_or_else(|| value.to_string(), str::to_owned))
        };
        self.0.iter().filter(|(_, key, _)| Some(*key) != left_out).map(key).collect()
    }

    /// Adds `--load`.
    pub fn load(self, load: Load) -> Self {
        self.with("--load", "rotor.load", load.load)
    }

    /// Adds `--winding-temperature` and `--magnet-temperature`.
    pub fn temperatures(self, temperatures: Temperatures) -> Self {
        let Temperatures { winding_temperature, magnet_temperature } = temperatures;
        self.with("--winding-temperature", "rotor.winding_temperature", winding_temperature).with(
            "--magnet-temperature",
            "rotor.magnet_temperature",
            magnet_temperature,
        )
    }

    /// Adds `--seed`.
    pub fn seed(self, seed: Seed) -> Self {
        self.with("--seed", "seed", seed.seed.map(seed_value))
    }

    /// Adds `--trials`.
    pub fn trials(self, trials: Option<u64>) -> Self {
        self.with("--trials", "trials", trials.and_then(|trials| i64::try_from(trials).ok()))
    }

    /// Adds `--decay`.
    pub fn decay(self, decay: PaperDecay) -> Self {
        let method = decay.decay.map(|decay| match decay {
            Decay::Slow => MethodName::LineInductance.name(),
            Decay::Fast => MethodName::LineInductanceFast.name(),
        });
        self.with("--decay", "detector.method", method)
    }

    /// Adds the options of motor and drive.
    pub fn setup(self, setup: &Setup) -> Self {
        self.with("--motor", "motor", setup.motor.clone())
            .with("--errors", "errors", setup.errors.map(Choice::name))
            .with("--rotor", "rotor.state", setup.rotor.map(Choice::name))
            .load(setup.load)
            .temperatures(setup.temperature)
            .seed(setup.seed)
    }
}

/// Returns the document of the scenario file, or of a built-in one, with all settings from the command line.
pub fn document(source: &Source, shipped: Shipped, shorthands: Shorthands) -> Result<Document, Error> {
    let document = match (&source.scenario, shipped) {
        (Some(path), _) => read(path)?,
        (None, Shipped::Empty) => Document::parse(Path::new("scenario"), "")?,
        (None, Shipped::Paper) => Document::parse(Path::new("reproduce.toml"), PAPER)?,
    };
    changed(document, &source.keys, shorthands)
}

/// Returns the document for a command's argument MOTOR. It is the document of a scenario file, or the default scenario with this motor.
pub fn of_motor(name: &str, keys: &Keys, shorthands: Shorthands) -> Result<Document, Error> {
    let path = Path::new(name);
    // An argument without an ending is a motor's name, known or not.
    let document =
        if path.exists() || path.extension().is_some() { read_either(path)?.0 } else { named(name)? };
    says_something(&document, path);
    changed(document, keys, shorthands)
}

/// Reads the document of a scenario file. If the file is a motor, returns the default scenario with this motor and
/// prints a message about it.
pub fn read(path: &Path) -> Result<Document, Error> {
    let (document, motor) = read_either(path)?;
    if motor && host::current().is_none() {
        tell(&format!("{} is a motor, not a scenario: this is the default scenario with it", path.display()));
    }
    Ok(document)
}

/// Prints that the default scenario is used if the document is empty. Such a file is valid, but the user may have meant a motor. `run` and
/// `sweep` do not need this message, because they always print the motor.
fn says_something(document: &Document, path: &Path) {
    if document.is_empty() && host::current().is_none() {
        let file = path.display();
        tell(&format!("{file} has no key: this is the default scenario, with the motor paper-5k5"));
    }
}

/// Returns the default scenario with the motor of this name or path.
fn named(motor: &str) -> Result<Document, Error> {
    let document = Document::parse(Path::new("scenario"), "")?;
    changed(document, &Keys::default(), Shorthands::default().with("MOTOR", "motor", Some(motor)))
}

/// Reads a scenario without printing a message. Also returns true if the file is a motor: a built-in motor or a data sheet. A data sheet
/// differs from a scenario by its name or nameplate.
pub fn read_either(path: &Path) -> Result<(Document, bool), Error> {
    let name = path.to_string_lossy();
    if !path.exists() && DataSheet::built_in_text(&name).is_some() {
        return Ok((named(&name)?, true));
    }
    // A word is the name of a motor, known or not.
    if !path.exists() && path.extension().is_none() && !name.contains('/') && host::current().is_none() {
        return Err(Error::UnknownMotor(name.into_owned()));
    }
    if let Some(found) = named_otherwise(path) {
        return Err(Error::results(path, found, "a scenario (.toml), or a motor"));
    }
    let document = text_of(path)?;
    if ["name", "winding", "nameplate"].iter().any(|key| document.get(key).is_some()) {
        return Ok((named(&name)?, true));
    }
    Ok((document, false))
}

/// Describes a file or folder that is neither a scenario nor a motor, and names the command that reads it. Returns none if no command reads
/// this kind of file.
fn named_otherwise(path: &Path) -> Option<String> {
    if path.join("summary.json").exists() {
        return Some(format!("the folder of a run; `standstill report {}` shows it", path.display()));
    }
    if path.is_dir() {
        return Some("a folder".to_owned());
    }
    let kind = path.extension()?.to_str()?.to_ascii_lowercase();
    if path.exists() && kind == "fmu" {
        return Some(
            "an FMU, which is for tools that import them; `standstill trace` simulates what it was written from"
                .to_owned(),
        );
    }
    let tables = ["csv", "txt", "tsv", "npz", "mat", "parquet"];
    (path.exists() && tables.contains(&kind.as_str())).then(|| {
        "a table; `standstill magnetics` takes flux maps, `standstill fit` traces, and a data sheet names its map".to_owned()
    })
}

/// Parses a file that may be a scenario or a motor. If the host program supplies the text, the file is not read.
fn text_of(path: &Path) -> Result<Document, Error> {
    if let Some(host) = host::current()
        && let Some(text) = host.text(path)
    {
        return Ok(Document::parse(path, text)?);
    }
    Ok(Document::read(path)?)
}

/// Applies the settings from the command line to a document. The motor is set before its keys, and `-s` before other
/// options.
pub fn changed(mut document: Document, keys: &Keys, shorthands: Shorthands) -> Result<Document, Error> {
    let (motors, others): (Vec<_>, Vec<_>) =
        shorthands.0.into_iter().partition(|(_, key, _)| *key == "motor");
    for (option, key, value) in motors {
        let value = value.as_str().map(|name| from_here(name, &document));
        document.set_value(key, value.unwrap_or_default().into(), Origin::Option(option))?;
    }
    for (number, (key, value)) in keys.set.iter().enumerate() {
        if let Some((_, first)) = keys.set[..number].iter().find(|(other, _)| other == key) {
            return Err(Error::Arguments(format!(
                "--set: `{key}` is there twice, with `{first}` and `{value}`; needed once"
            )));
        }
        document.set(key, value, Origin::CommandLine)?;
    }
    if let Some(library) = &keys.detector {
        // The library replaces the file's method. A method on the command line as well is a mistake, which the scenario
        // reports.
        if document.origin("detector.method").is_none() {
            document.remove("detector.method");
        }
        let path = library_from_here(library, &document);
        document.set_value("detector.library", path.into(), Origin::Option("--detector"))?;
    }
    for (option, key, value) in others {
        document.set_value(key, value, Origin::Option(option))?;
    }
    hosted(document)
}

/// Sets the detectors that the running program provides, if it provides some: a class of Python.
pub fn hosted(mut document: Document) -> Result<Document, Error> {
    if let Some((class, provider)) = host::current().as_ref().and_then(|host| host.detector.as_ref()) {
        document.host(class, provider)?;
    }
    Ok(document)
}

/// Converts the path of a motor from an option to a path for a document. The path in an option is relative to the working directory, and
/// the path in a document is relative to the document's folder.
fn from_here(name: &str, document: &Document) -> String {
    let elsewhere =
        !document.files().folder().as_os_str().is_empty() && DataSheet::built_in_text(name).is_none();
    let path = elsewhere.then(|| std::path::absolute(name).ok()).flatten().filter(|path| path.exists());
    path.map_or_else(|| name.to_owned(), |path| path.to_string_lossy().into_owned())
}

/// Converts the path of a library from an option to a path for a document. The new path is relative to the document's folder if the library
/// is inside this folder, and absolute otherwise.
fn library_from_here(library: &Path, document: &Document) -> String {
    let path = std::path::absolute(library).unwrap_or_else(|_| library.to_owned());
    let folder = std::path::absolute(document.files().folder()).or_else(|_| std::env::current_dir());
    let own = folder.ok().and_then(|folder| path.strip_prefix(folder).ok().map(Path::to_owned));
    own.unwrap_or(path).to_string_lossy().into_owned()
}

/// Adds sweep axes to a document.
pub fn vary(document: &mut Document, axes: &Axes) -> Result<(), Error> {
    for (n, (key, values)) in axes.vary.iter().enumerate() {
        if axes.vary[..n].iter().any(|(other, _)| other == key) {
            return Err(Error::Arguments(format!(
                "--vary: `{key}` is there twice; needed once, with all its values"
            )));
        }
        let axis = AxisSpec::parse(values)
            .map_err(|message| Error::Arguments(format!("--vary `{key}={values}`: {message}")))?;
        document.vary(key, &axis)?;
    }
    if let Some(design) = axes.design {
        document.set("design.kind", design.name(), Origin::CommandLine)?;
    }
    if let Some(points) = axes.points {
        document.set("design.points", &points.to_string(), Origin::CommandLine)?;
    }
    Ok(())
}
