//! Options that make a command's scenario: a file, keys, and shorthands for keys.

use std::path::PathBuf;

use clap::Args;
use standstill_plant::Temperature;
use standstill_scenario::{DesignKind, ErrorSet, Rotor};

use super::values::{celsius, choice, newton_metres, seed, whole};

/// A scenario file and its keys, for commands that can do without a file.
#[derive(Debug, Args)]
pub struct Source {
    /// Scenario file (.toml), as `standstill run` takes it
    pub scenario: Option<PathBuf>,
    #[command(flatten)]
    pub keys: Keys,
}

/// Keys that replace those of the file.
#[derive(Debug, Default, Args)]
pub struct Keys {
    /// Set a key of the scenario, such as `sensors.noise="20 mA"`, in place of the file's value; any number of times
    #[arg(short, long = "set", value_name = "KEY=VALUE", value_parser = assignment)]
    pub set: Vec<(String, String)>,
    /// A shared library that is the detector, as standstill.h declares it, in place of a method [key: detector.library]
    #[arg(long, value_name = "FILE.so")]
    pub detector: Option<PathBuf>,
}

/// Motor and drive: shorthands for keys.
#[derive(Debug, Args)]
pub struct Setup {
    /// A built-in motor's name, or a data sheet's path (.toml) [key: motor; without a scenario: paper-5k5]
    #[arg(long)]
    pub motor: Option<String>,
    /// Set of errors of drive and sensors [key: errors; without a scenario: default]
    #[arg(long, value_parser = choice::<ErrorSet>())]
    pub errors: Option<ErrorSet>,
    /// Whether the rotor can move: locked, free, or held by a brake that lets it play (by the data sheet's backlash) [key:
    /// rotor.state; without a scenario: locked]
    #[arg(long, value_parser = choice::<Rotor>())]
    pub rotor: Option<Rotor>,
    #[command(flatten)]
    pub load: Load,
    #[command(flatten)]
    pub temperature: Temperatures,
    #[command(flatten)]
    pub seed: Seed,
}

/// The load, a shorthand for its key.
#[derive(Clone, Copy, Debug, Args)]
pub struct Load {
    /// Torque in N·m that a load exerts against forward motion, also at standstill, on a rotor that can move [key:
    /// rotor.load; without a scenario: 0]
    #[arg(long, value_name = "NM", value_parser = newton_metres(), allow_hyphen_values = true)]
    pub load: Option<f64>,
}

/// Temperatures of the motor. With a scenario they set the keys `rotor.winding_temperature` and `rotor.magnet_temperature`; a motor without a
/// scenario is brought to them.
#[derive(Clone, Copy, Debug, Args)]
pub struct Temperatures {
    /// True temperature of the winding in °C, which the drive does not know [default: that of the data sheet]
    #[arg(long, value_name = "CELSIUS", value_parser = celsius(), allow_hyphen_values = true)]
    pub winding_temperature: Option<f64>,
    /// True temperature of the magnets in °C, which the drive does not know [default: that of the data sheet]
    #[arg(long, value_name = "CELSIUS", value_parser = celsius(), allow_hyphen_values = true)]
    pub magnet_temperature: Option<f64>,
}

impl From<Temperatures> for Temperature {
    fn from(temperatures: Temperatures) -> Self {
        Self { winding: temperatures.winding_temperature, magnet: temperatures.magnet_temperature }
    }
}

/// The seed, a shorthand for its key.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct Seed {
    /// Seed of all random numbers [default: the scenario's, or 1]
    #[arg(long, value_parser = seed, allow_hyphen_values = true)]
    pub seed: Option<u64>,
}

/// Axes from the command line.
#[derive(Debug, Args)]
pub struct Axes {
    /// Vary a key, in addition to the scenario's axes: `KEY=FROM:TO:N`, `KEY=FROM:TO:N:log` or `KEY=A,B,C`
    #[arg(long, value_name = "KEY=VALUES", value_parser = assignment)]
    pub vary: Vec<(String, String)>,
    /// Choice of points from the axes [default: the scenario's, or grid]
    #[arg(long, value_parser = choice::<DesignKind>())]
    pub design: Option<DesignKind>,
    /// Number of points, for a design other than a grid
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=10_000_000))]
    pub points: Option<u32>,
}

/// Splits an option's argument `KEY=VALUE` into key and value.
pub fn assignment(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err("not KEY=VALUE, such as sensors.noise=\"20 mA\"".to_owned()),
    }
}
