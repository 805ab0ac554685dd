//! The subcommands.

pub mod check;
pub mod compare;
pub mod init;
pub mod magnetics;
pub mod merge;
pub mod motors;
pub mod report;
pub mod reproduce;
pub mod run;
pub mod shell;
pub mod trace;

use std::path::Path;

use standstill_campaign::{ErrorSet, Scenario};
use standstill_detect::{LineInductanceSettings, Method, MethodName, Nameplate, Settings};
use standstill_plant::{DataSheet, Motor};
use standstill_sim::{Play, RotorState};

use crate::arguments::{Rotor, Setup};
use crate::error::Error;

/// A data sheet by built-in name or by its path.
fn sheet(name: &str) -> Result<DataSheet, Error> {
    if let Some(sheet) = DataSheet::built_in(name) {
        return Ok(sheet);
    }
    let path = Path::new(name);
    if path.extension().is_none_or(|extension| extension != "toml") {
        return Err(Error::UnknownMotor(name.to_owned()));
    }
    let text = std::fs::read_to_string(path).map_err(|error| Error::Read(path.to_owned(), error))?;
    DataSheet::parse(name, &text).map_err(Error::Motor)
}

/// A motor by built-in name or by the path of its data sheet.
fn motor(name: &str) -> Result<Motor, Error> {
    sheet(name)?.motor().map_err(Error::Motor)
}

/// What was simulated, for the JSON files.
fn setup_json<S>(setup: &Setup, scenario: &Scenario<S>) -> serde_json::Value {
    serde_json::json!({
        "motor": scenario.motor.name,
        "motor_file": (setup.motor != scenario.motor.name).then_some(&setup.motor),
        "errors": ErrorSet::from(setup.errors).name(),
        "decay": setup.decay.name(),
        "rotor": setup.rotor.name(),
        "load_torque_Nm": setup.load,
        "winding_temperature_C": setup.temperature.winding_temperature,
        "magnet_temperature_C": setup.temperature.magnet_temperature,
        "seed": setup.seed,
    })
}

/// A rotor's state by name; only the motor knows how far its brake lets it play.
fn rotor(rotor: Rotor, motor: &Motor, name: &str) -> Result<RotorState, Error> {
    Ok(match rotor {
        Rotor::Locked => RotorState::Locked,
        Rotor::Free => RotorState::Free,
        Rotor::Brake if motor.rotor.backlash == 0.0 => {
            return Err(Error::Arguments(format!(
                "--rotor brake: found a motor without play, {name}; needed: `rotor.brake_backlash` in its data sheet, or --rotor locked, which is the same without"
            )));
        }
        Rotor::Brake => RotorState::Braked(Play::of(motor)),
    })
}

fn load_on_locked_rotor(load: f64) -> Error {
    Error::Arguments(format!(
        "--load {load}: found --rotor locked, which no load moves; needed: --rotor free or --rotor brake"
    ))
}

/// The paper's method.
fn scenario(setup: &Setup) -> Result<Scenario, Error> {
    scenario_with(setup, |drive| LineInductanceSettings::paper(setup.decay.into(), drive))
}

/// Any other.
fn scenario_of(setup: &Setup, method: MethodName) -> Result<Scenario<Method<f64>>, Error> {
    scenario_with(setup, |drive| Method::suited(method, drive))
}

fn scenario_with<S: Settings<f64>>(
    setup: &Setup,
    settings: impl FnOnce(&Nameplate<f64>) -> S,
) -> Result<Scenario<S>, Error> {
    let motor = motor(&setup.motor)?;
    if setup.load != 0.0 && setup.rotor == Rotor::Locked {
        return Err(load_on_locked_rotor(setup.load));
    }
    let rotor = rotor(setup.rotor, &motor, &setup.motor)?;
    let hot = motor.at_temperature(setup.temperature.into())?;
    // The drive is set up for the motor of the data sheet, whatever the motor's temperature is.
    let scenario = Scenario::new(motor, setup.errors.into(), rotor, setup.seed, settings);
    Ok(Scenario { motor: hot, load_torque: setup.load, ..scenario })
}
