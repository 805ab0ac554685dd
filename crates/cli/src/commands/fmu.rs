//! `standstill fmu`: drive or motor as a functional mock-up unit.

use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use standstill_files::{open, read_at_most};
use standstill_fmu::{Binary, Model, Part, Version, pack};
use standstill_interface::Choice;
use standstill_scenario::Document;

use crate::arguments::{Fmu, FmuPart};
use crate::error::Error;
use crate::scenario::{self, Shorthands};
use crate::shell::output::replace;
use crate::shell::{Report, interrupt};

/// Largest size of the shared library in bytes. A library with full debug information has several hundred megabytes.
const MOST_BYTES: u64 = 1 << 30;

pub fn run(options: &Fmu) -> Result<Report, Error> {
    interrupt::at_once();
    if options.out.file_name().is_none() {
        return Err(Error::InTheWay { path: options.out.clone(), is: "a folder", needed: "a file" });
    }
    if options.out.extension().is_none_or(|extension| extension != "fmu") && !options.out.is_dir() {
        let (is, needed) = ("no FMU's name", "a file's that ends in .fmu");
        return Err(Error::InTheWay { path: options.out.clone(), is, needed });
    }
    let folder = options.out.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or_else(|| Path::new("."));
    // A missing folder is reported as a mistake; it is not created.
    std::fs::metadata(folder).map_err(Error::writing(&options.out))?;
    let shorthands = Shorthands::default()
        .with("--errors", "errors", options.errors.map(Choice::name))
        .with("--rotor", "rotor.state", options.rotor.map(Choice::name))
        .seed(options.seed);
    let given = shorthands.given().into_iter().map(|(_, key)| key.to_owned());
    let mut given: Vec<String> = given.chain(options.keys.set.iter().map(|(key, _)| key.clone())).collect();
    given.extend(options.keys.detector.is_some().then(|| "detector.library".to_owned()));
    let document = scenario::of_motor(&options.motor, &options.keys, shorthands)?;
    let part = match options.part {
        FmuPart::Drive => Part::Drive,
        FmuPart::Motor => Part::Motor,
    };
    let version = if options.fmi == "3" { Version::Three } else { Version::Two };
    let model = Model::new(&document, part).and_then(|model| match options.samples {
        1 => Ok(model),
        several => model.with_samples(several),
    });
    let model = model.map_err(|error| Error::Arguments(error.to_string()))?;
    no_idle_keys(&document, part, &given)?;
    let binaries = binaries(options)?;
    replaces_nothing_else(&options.out)?;
    let content = pack(&model, version, &binaries).map_err(Error::writing(&options.out))?;
    // The same options give the same bytes, so an equal file is accepted without `--force`.
    let there = read_at_most(&options.out, content.len() as u64);
    let other = there.map_or_else(|error| error.kind() != io::ErrorKind::NotFound, |there| there != content);
    if !options.force && other {
        return Err(Error::another("run", &options.out, "this FMU is another one"));
    }
    replace(&options.out, &content)?;
    let count = |of: fn(&standstill_fmu::Variable) -> bool| model.variables.iter().filter(|v| of(v)).count();
    let steps = match part {
        Part::Drive => {
            format!("steps of {}, a period of the PWM, or half of that", model.period_text())
        }
        Part::Motor => "steps of any length".to_owned(),
    };
    let text = format!(
        "{}: {} of {}, FMI {}, {} inputs, {} outputs, {} parameters; {steps}; for {}\n",
        options.out.display(),
        if part == Part::Drive { "drive" } else { "motor" },
        model.motor,
        if version == Version::Three { "3.0" } else { "2.0" },
        count(|v| v.is_input() && v.kind != standstill_fmu::Kind::Clock),
        count(standstill_fmu::Variable::is_output),
        count(standstill_fmu::Variable::is_parameter),
        binaries.iter().map(Binary::machine).collect::<Vec<_>>().join(", "),
    );
    Ok(Report { text, code: 0 })
}

/// Refuses keys from the command line that have no effect in the FMU. Such keys are accepted in a scenario file, because it may contain
/// more than a motor needs.
fn no_idle_keys(document: &Document, part: Part, given: &[String]) -> Result<(), Error> {
    let Some(key) = given.iter().find(|key| !part.has_use_for(key)) else { return Ok(()) };
    let known: Vec<String> = part.keys().iter().map(|key| format!("`{key}`")).collect();
    let (found, why) = match part {
        Part::Drive => ("in an FMU, which the importing tool runs", "the algorithm is that tool's"),
        Part::Motor => ("in an FMU of the motor alone", "inverter and sensors are in `--part drive`"),
    };
    let needed = format!("a key of {}; {why}", known.join(", "));
    Err(document.refuse(key, found, &needed).into())
}

/// Checks the output path. Only an existing FMU or folder may be replaced, not a text, a device file or a symbolic link.
fn replaces_nothing_else(out: &Path) -> Result<(), Error> {
    let Ok(there) = std::fs::symlink_metadata(out) else { return Ok(()) };
    let mut begin = [0; 4];
    let is_archive = there.is_file()
        && open(out).and_then(|mut file| file.read_exact(&mut begin)).is_ok()
        && &begin == b"PK\x03\x04";
    if is_archive || there.is_dir() {
        return Ok(());
    }
    Err(Error::InTheWay { path: out.to_owned(), is: "no FMU", needed: "another name, or an FMU to replace" })
}

/// Reads the shared libraries for the FMU. These are the libraries that `--binary` names. Without this option, they are the library beside
/// the program and the libraries for other processors and operating systems.
fn binaries(options: &Fmu) -> Result<Vec<Binary>, Error> {
    let mut paths = options.binary.clone();
    if paths.is_empty() {
        paths.push(own()?);
        let program = std::env::current_exe().map_err(|error| Error::Read("standstill".into(), error))?;
        paths.extend(Binary::others(&program));
    }
    let mut all: Vec<Binary> = Vec::new();
    for path in paths {
        let library = read_at_most(&path, MOST_BYTES).map_err(|error| Error::Read(path.clone(), error))?;
        let needed = format!(
            "the library of FMUs of standstill {}, which `cargo build --release` leaves beside the program as {}, and \
             scripts/fmu-binaries.sh for other kinds of machines in fmu-binaries",
            env!("CARGO_PKG_VERSION"),
            Binary::name()
        );
        let library = Binary::of(library).map_err(|found| Error::results(&path, found, needed))?;
        if all.iter().any(|there| there.machine() == library.machine()) {
            let found = format!("a second library for {}", library.machine());
            return Err(Error::results(path, found, "one for each kind of machine"));
        }
        all.push(library);
    }
    Ok(all)
}

/// Returns the path of the shared library for the processor and the operating system of this computer.
fn own() -> Result<PathBuf, Error> {
    let program = std::env::current_exe().map_err(|error| Error::Read("standstill".into(), error))?;
    let places = Binary::beside(&program);
    // Cargo may leave the library in either of two places. The newer file belongs to the last build.
    let there = places.iter().filter(|path| path.is_file());
    let found = there.max_by_key(|path| path.metadata().and_then(|file| file.modified()).ok()).cloned();
    found.ok_or_else(|| {
        Error::Arguments(format!(
            "an FMU needs the shared library {}, which is not beside the program ({}): build it with `cargo build --release -p standstill-fmu` and name it with --binary",
            Binary::name(),
            places[0].display()
        ))
    })
}
