//! Digests of results: the numbers that a program computes, to the last bit, and the stored ones.

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use standstill_detect::MethodName;
use standstill_plant::{built_in, built_in_names};
use standstill_scenario::{Document, FileError, Plan};
use thiserror::Error;

use crate::store::{Journal, JournalError, Row, Rows, Shard, Sweep, SweepError};

/// The lines of digests, one a number of the numerics.
pub(super) const TEXT: &str = include_str!("../numerics.txt");

/// Cases in addition to methods on motors, for other code that determines the numbers of a trial.
const OTHERS: [(&str, &str); 10] = [
    (
        "map",
        "errors = \"harsh\"\n[motor]\nbase = \"motor.toml\"\n[axes]\n\"rotor.state\" = [\"locked\", \"free\"]",
    ),
    (
        "tolerances",
        "errors = \"harsh\"\nrotor = { state = \"free\", load = \"0.01 N m\" }\n[tolerances]\n\"motor.winding.resistance\" = { normal = \"5 %\" }\n\"sensors.noise\" = { uniform = \"4 mA\", mean = \"10 mA\" }",
    ),
    (
        "warm",
        "motor = \"gearless-hoist\"\nrotor = { winding_temperature = \"120 °C\", magnet_temperature = \"90 °C\" }\n[inverter]\nripple = \"3 %\"\nripple_frequency = \"300 Hz\"\nopen_leg = \"open\"",
    ),
    (
        "sensors",
        "[axes]\n\"sensors.arrangement\" = [\"two-in-line\", \"low-side-shunts\"]\n\"sensors.bandwidth\" = [\"20 kHz\"]\n\"inverter.dead_time\" = [\"4 us\"]",
    ),
    (
        "field",
        "errors = \"field\"\n[axes]\nmotor = [\"paper-5k5\", \"outrunner\"]\n\"inverter.terminal_capacitance\" = [\"0 F\", \"0.3 nF\"]\n\"detector.method\" = [\"line-inductance\", \"bipolar\"]",
    ),
    (
        "ringing",
        "[inverter]\nterminal_capacitance = \"0.3 nF\"\n[axes]\nmotor = [\"paper-5k5\", \"outrunner\"]\n\"detector.method\" = [\"line-inductance-fast\", \"bipolar\"]",
    ),
    (
        "hysteresis, ringing terminals and a link that gives way",
        "motor = { base = \"outrunner\", hysteresis = { coercive_current = 0.5, depth = \"5 %\", cells = 2 } }\ndetector.method = \"bipolar\"\nrotor.state = \"free\"\n[inverter]\nterminal_capacitance = \"0.3 nF\"\ncapacitance = \"100 uF\"\nsource_resistance = \"0.1 Ω\"",
    ),
    (
        "contacts",
        "detector.method = \"bipolar\"\n[axes]\nmotor = [\"paper-5k5\", \"light-vehicle\"]\n[[faults]]\nmode = \"contact-resistance\"\nat = \"b\"\nmagnitude = [\"0.5 Ω\", \"5 Ω\"]",
    ),
    (
        "six pulses, sampled",
        "detector.method = \"six-pulse\"\n[axes]\nmotor = [\"surface-magnet\", \"outrunner\"]\nerrors = [\"default\", \"harsh\"]\n\"sensors.arrangement\" = [\"three-in-line\", \"two-in-line\", \"low-side-shunts\"]",
    ),
    (
        "shorted turns",
        "[axes]\nmotor = [\"paper-5k5\", \"light-vehicle\"]\n\"detector.method\" = [\"bipolar\", \"maximum-likelihood\"]\n[[faults]]\nmode = \"turns-shorted\"\nat = \"b\"\nmagnitude = [\"0.2 %\", \"6 %\"]\ncoupling = 0.5\nresistance = \"1 mΩ\"",
    ),
];

/// Effects that no other kept run contains, each with the digest of its rows. A digest that changes is a change of results: it asks
/// for the next number, too (see [`OTHERS`]).
const EFFECTS: [(&str, &str, &str); 5] = [
    (
        "source resistance",
        "[inverter]\ncapacitance = \"100 uF\"\nsource_resistance = \"2 Ω\"\n[axes]\n\"rotor.state\" = [\"locked\", \"free\"]",
        "30021f0f",
    ),
    (
        "sag",
        "detector.method = \"bipolar\"\n[inverter]\nsag_depth = \"20 %\"\nsag_start = \"0.5 ms\"\nsag_duration = \"3 ms\"\n[axes]\n\"rotor.state\" = [\"locked\", \"free\"]",
        "258080c6",
    ),
    (
        "hysteresis",
        "motor = { base = \"paper-5k5\", hysteresis = { coercive_current = 0.08, depth = \"5 %\", cells = 3 } }\ndetector.method = \"bipolar\"\n[axes]\n\"rotor.memory\" = [\"virgin\", \"former\"]\n\"rotor.state\" = [\"locked\", \"free\"]",
        "8bcfdaf2",
    ),
    (
        "terminals",
        "sensors.terminals = true\ndetector.method = \"open-terminal\"\n[axes]\nerrors = [\"default\", \"field\"]\nmotor = [\"paper-5k5\", \"cross-saturation\"]",
        "eea3d616",
    ),
    (
        "six pulses, timed with common and own comparators",
        "errors = \"field\"\ndetector.method = \"six-pulse\"\n[sensors]\ntimer = \"0.32 us\"\n[axes]\nmotor = [\"paper-5k5\", \"outrunner\"]\n\"sensors.comparators\" = [\"common\", \"per-leg\"]\n\"rotor.state\" = [\"locked\", \"free\"]",
        "cc7d0d0b",
    ),
];

/// Motors of the library that digests are of: one that is added behind them changes no result.
const MOTORS: usize = 12;

/// Returns each method on the motors, each of these with other errors and another state of the rotor.
fn method(name: MethodName) -> Vec<String> {
    let shift = MethodName::ALL.iter().position(|method| *method == name).unwrap_or_default();
    // Seconds of pulse-width modulation: on some motors, once.
    let long = [MethodName::DcAlignment, MethodName::HfiRotating].contains(&name);
    let scenario = |(k, motor): (usize, &str)| {
        let errors = ["none", "noise", "default", "harsh"][(k + shift) % 4];
        let brake = built_in(motor).is_some_and(|motor| motor.rotor.backlash > 0.0);
        let rotor = ["locked", "free", if brake { "brake" } else { "free" }][(k + shift / 2) % 3];
        let trials = if long { 1 } else { 2 };
        format!(
            "motor = \"{motor}\"\nerrors = \"{errors}\"\nrotor.state = \"{rotor}\"\ndetector.method = \"{name}\"\ntrials = {trials}\n"
        )
    };
    built_in_names().take(MOTORS).enumerate().filter(|(k, _)| !long || k % 3 == 0).map(scenario).collect()
}

/// Returns a data sheet with a map, beside the scenarios.
fn write_motor(folder: &Path) -> Result<(), DigestError> {
    let mut map = String::from("i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n");
    for d in -12..=12 {
        for q in -12..=12 {
            let (d, q) = (f64::from(d), f64::from(q));
            let psi_d = 0.45 + 0.0106 * d - 2e-5 * d * d - 5e-5 * q * q;
            let psi_q = 0.0169 * q - 1e-4 * d * q;
            let _ = writeln!(map, "{d},{q},{psi_d:.9},{psi_q:.9}");
        }
    }
    let wrong = |what: &str| DigestError::Sheet(what.to_owned());
    let sheet =
        standstill_plant::DataSheet::built_in_text("paper-5k5").ok_or_else(|| wrong("built-in motor"))?;
    let (head, rest) = sheet.split_once("[saturation]").ok_or_else(|| wrong("[saturation]"))?;
    let rotor = &rest[rest.find("[rotor]").ok_or_else(|| wrong("[rotor]"))?..];
    let line = "file = { value = \"map.csv\", source = \"given\", reason = \"computed\" }";
    let write = |name: &str, text: String| {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|error| DigestError::Write(path, error))
    };
    write("map.csv", map)?;
    write("motor.toml", format!("{head}[map]\n{line}\n{rotor}"))
}

/// Why digests could not be computed.
#[derive(Debug, Error)]
pub enum DigestError {
    /// A file that could not be written.
    #[error("{0}: {1}")]
    Write(PathBuf, io::Error),
    /// The data sheet that is changed lacks something.
    #[error("the data sheet of paper-5k5 lacks {0}")]
    Sheet(String),
    /// A scenario that cannot be.
    #[error(transparent)]
    File(#[from] FileError),
    /// A run could not continue.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// A journal that cannot be used.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The rows show nothing: two are equal, or none has an angle.
    #[error("the rows of {0} tell nothing of its numbers")]
    Empty(String),
    /// The work was stopped.
    #[error("stopped")]
    Stopped,
}

/// A result that is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    /// The method or effect that it is of.
    pub name: String,
    /// The stored digest; empty if there is none.
    pub kept: String,
    /// Digest that this program has computed.
    pub here: String,
}

/// Returns the rows of a run, as they are stored.
fn rows(folder: &Path, scenario: &str, stop: &AtomicBool) -> Result<Vec<Row>, DigestError> {
    let plan = Plan::new(Document::parse(&folder.join("s.toml"), scenario)?)?;
    let sweep = Sweep { plan: &plan, shard: Shard::WHOLE, threads: None };
    let path = folder.join("run.journal");
    let mut journal = Journal::create(&path, &sweep.identity()?)?;
    if !sweep.run(&mut journal, stop, |_| {})? {
        return Err(DigestError::Stopped);
    }
    let (mut rows, mut all) = (Rows::open(&path)?, Vec::new());
    while let Some(block) = rows.block()? {
        all.extend(block.into_iter().map(|(_, row)| row));
    }
    Ok(all)
}

/// Returns the digest of every bit of these rows.
fn digest(name: &str, rows: &Vec<Row>) -> Result<String, DigestError> {
    let empty = || DigestError::Empty(name.to_owned());
    // Digests of trials that are alike, or without angles, would tell nothing.
    let alike = rows.windows(2).any(|pair| pair[0] == pair[1]);
    if alike || rows.iter().all(|row| row.axis_error_deg.is_none()) {
        return Err(empty());
    }
    Ok(format!("{:08x}", crc32fast::hash(&postcard::to_stdvec(rows).map_err(|_| empty())?)))
}

/// Computes the digest of each method's rows, then of the others', in a folder for their files. Those that are kept are of the last line of
/// `numerics.txt`.
///
/// # Errors
/// A folder that cannot be written; a stop.
pub fn methods(folder: &Path, stop: &AtomicBool) -> Result<Vec<Kept>, DigestError> {
    write_motor(folder)?;
    // Methods that came later, with sensors of their own, are among the effects.
    let later = |name: &MethodName| [MethodName::OpenTerminal, MethodName::SixPulse].contains(name);
    let methods =
        MethodName::ALL.into_iter().filter(|name| !later(name)).map(|name| (name.to_string(), method(name)));
    let others = OTHERS.map(|(name, text)| (name.to_owned(), vec![format!("trials = 4\n{text}")]));
    let mut kept = TEXT.lines().last().unwrap_or_default().split(' ').skip(1);
    let mut all = Vec::new();
    for (name, scenarios) in methods.chain(others) {
        let mut of = Vec::new();
        for text in scenarios {
            of.extend(rows(folder, &text, stop)?);
        }
        let here = digest(&name, &of)?;
        all.push(Kept { name, kept: kept.next().unwrap_or_default().to_owned(), here });
    }
    Ok(all)
}

/// Computes the digest of each effect's rows, in a folder for their files.
///
/// # Errors
/// A folder that cannot be written; a stop.
pub fn effects(folder: &Path, stop: &AtomicBool) -> Result<Vec<Kept>, DigestError> {
    let one = |(name, text, kept): (&str, &str, &str)| {
        let here = of_scenario(folder, name, text, stop)?;
        Ok(Kept { name: name.to_owned(), kept: kept.to_owned(), here })
    };
    EFFECTS.into_iter().map(one).collect()
}

/// Computes the digest of four trials of a scenario.
///
/// # Errors
/// A folder that cannot be written; a stop.
pub fn of_scenario(folder: &Path, name: &str, text: &str, stop: &AtomicBool) -> Result<String, DigestError> {
    digest(name, &rows(folder, &format!("trials = 4\n{text}"), stop)?)
}
