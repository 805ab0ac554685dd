//! The subcommands.

#[cfg(feature = "program")]
pub mod begin;
pub mod bounds;
pub mod budget;
pub mod check;
pub mod compare;
#[cfg(feature = "program")]
pub mod completions;
pub mod convert;
pub mod explain;
pub mod faults;
pub mod fit;
#[cfg(feature = "program")]
pub mod fmu;
pub mod init;
#[cfg(feature = "program")]
pub mod lab;
pub mod magnetics;
pub mod merge;
pub mod motors;
pub mod odds;
pub mod qualify;
mod question;
pub mod report;
pub mod reproduce;
pub mod require;
pub mod run;
pub mod slurm;
pub mod status;
pub mod trace;
pub mod tune;
pub mod witness;

use std::path::Path;

use standstill_detect::{Decay, Method, MethodName};
use standstill_plant::{DataSheet, Files, Motor};
use standstill_quantity::Quantity;
use standstill_report::figure::Figure;
use standstill_scenario::{MotorSpec, Record, Scenario, ScenarioFile};
use standstill_sim::Trace;

use crate::error::Error;
use crate::shell::terminal::tell;
use crate::{figures, scenario};

/// Draws the waveforms of a trial and the angle that its detector found. If the detector found only an axis, draws the end of the axis that
/// is nearer to the rotor.
fn waveforms(
    trace: &Trace,
    title: &str,
    conditions: &str,
    scenario: &Scenario<Method<f64>>,
    record: &Record,
) -> Figure {
    let error = record.error_deg().or_else(|| record.axis_error_deg());
    let found = error.map(|error| (record.true_angle_deg() + error).to_radians());
    figures::detection(trace, title, conditions, scenario.sensors.comparator.arrangement, found)
}

/// Reads a data sheet by the name of a built-in motor or by its path.
fn sheet(name: &str) -> Result<DataSheet, Error> {
    if let Some(sheet) = DataSheet::built_in(name) {
        return Ok(sheet);
    }
    let path = Path::new(name);
    if path.extension().is_none_or(|extension| extension != "toml") {
        return Err(Error::UnknownMotor(name.to_owned()));
    }
    // A scenario file is accepted: a message says that only its motor is used.
    if path.exists()
        && let Ok((document, false)) = scenario::read_either(path)
        && let Ok(file) = document.load()
    {
        tell(&format!("{name} is a scenario, not a data sheet: this is its motor, {}", file.motor.name()));
        return Ok(document.data_sheet()?);
    }
    let text = Files::default().text(path).map_err(|error| Error::Read(path.to_owned(), error))?;
    DataSheet::parse(name, &text).map_err(Error::Motor)
}

/// Returns how fast the current decays after a pulse of the paper's method. None for other methods.
const fn decay(method: MethodName) -> Option<Decay> {
    match method {
        MethodName::LineInductance => Some(Decay::Slow),
        MethodName::LineInductanceFast => Some(Decay::Fast),
        _ => None,
    }
}

/// Returns the simulated motor and conditions as JSON.
fn setup_json(file: &ScenarioFile, motor: &Motor) -> serde_json::Value {
    let motor_file = match &file.motor {
        MotorSpec::Named(name) => Some(name).filter(|name| **name != motor.name),
        MotorSpec::Table(_) => None,
    };
    serde_json::json!({
        "motor": motor.name,
        "motor_file": motor_file,
        "errors": file.errors.0.name(),
        "decay": file.detector.library.is_none().then(|| decay(file.detector.method())).flatten().map(Decay::name),
        "rotor": file.rotor.state().name(),
        "load_torque_Nm": file.rotor.load.map_or(0.0, Quantity::value),
        "winding_temperature_C": file.rotor.winding_temperature.map(Quantity::value),
        "magnet_temperature_C": file.rotor.magnet_temperature.map(Quantity::value),
        "seed": file.seed,
    })
}
