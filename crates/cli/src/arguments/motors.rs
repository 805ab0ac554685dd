//! Options of the commands about a motor: its data, its maps, its traces, its FMU.

use std::path::PathBuf;

use clap::Args;
use standstill_plant::MapValues;
#[cfg(feature = "program")]
use standstill_scenario::{ErrorSet, Rotor};

use super::scenario::{self, Keys, Seed, Temperatures};
use super::values::{Force, OUT, amperes, choice, map_values, ohms, whole};
#[cfg(feature = "program")]
#[cfg(feature = "program")]
#[derive(Debug, Args)]
pub struct Fmu {
    /// A built-in motor's name, a data sheet's path or that of a scenario file (.toml), whose detector is left out
    pub motor: String,
    #[command(flatten)]
    pub keys: Keys,
    /// Set of errors of drive and sensors [key: errors; without a scenario: default]
    #[arg(long, value_parser = choice::<ErrorSet>())]
    pub errors: Option<ErrorSet>,
    /// Whether the rotor can move [key: rotor.state; without a scenario: locked]
    #[arg(long, value_parser = choice::<Rotor>())]
    pub rotor: Option<Rotor>,
    #[command(flatten)]
    pub seed: Seed,
    /// Contents: `drive`, inverter with motor and sensors, whose inputs are legs and outputs are samples; or `motor` alone, with voltages as
    /// inputs, currents and torque as outputs
    #[arg(long, value_name = "PART", value_enum, default_value_t = FmuPart::Drive)]
    pub part: FmuPart,
    /// Version of FMI: 2, which every tool imports, or 3, with a clock for the PWM period
    #[arg(long, value_name = "V", value_parser = ["2", "3"], default_value = "2")]
    pub fmi: String,
    /// Samples of the converters in each step of a drive, from 1 to 16, evenly spaced; each has outputs of its own
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(standstill_fmu::MOST_SAMPLES)), default_value_t = 1)]
    pub samples: u32,
    /// File to write
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    /// Replace another FMU of that name; without it, it stays
    #[arg(long)]
    pub force: bool,
    /// A shared library to include, once for each kind of machine [default: the one beside the program,
    /// and those of the folder fmu-binaries there]
    #[arg(long, value_name = "FILE")]
    pub binary: Vec<PathBuf>,
}

/// The contents of an FMU.
#[cfg(feature = "program")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum FmuPart {
    /// Inverter, motor and sensors
    Drive,
    /// The motor alone
    Motor,
}

#[derive(Debug, Args)]
pub struct Magnetics {
    /// A built-in motor's name, or the path of a data sheet (.toml) or a flux map (.csv, .txt, .tsv, .npz, .mat)
    pub motor: String,
    /// Pole pairs of the motor that a flux map describes: needed for its torque
    #[arg(long, value_name = "P", value_parser = whole::<u32>(1..=200))]
    pub pole_pairs: Option<u32>,
    /// Resistance in Ω of a phase of the motor that a flux map describes: needed for its time constants
    #[arg(long, value_name = "OHM", value_parser = ohms(), allow_hyphen_values = true)]
    pub resistance: Option<f64>,
    /// Whether a flux map has peak values (amplitude-invariant) or rms values of currents and fluxes [default: peak]
    #[arg(long, value_name = "VALUES", value_parser = map_values)]
    pub values: Option<MapValues>,
    /// Columns of a flux map as text, in place of its header, `-` for others: `i_d_A,i_q_A,-,psi_d_mWb,psi_q_mWb`
    #[arg(long, value_name = "NAMES")]
    pub columns: Option<String>,
    /// Continue a flux map that has only one side of the d-axis by cores fitted to it (`fitted`)
    #[arg(long, value_name = "HOW", value_parser = ["fitted"])]
    pub beyond: Option<String>,
    /// Largest current in A [default: the rated current, or the map's range]
    #[arg(long, value_name = "A", value_parser = amperes(), allow_hyphen_values = true)]
    pub current: Option<f64>,
    /// Folder for the files, created if it does not exist
    #[arg(long, value_name = "DIR", default_value = OUT)]
    pub out: PathBuf,
    #[command(flatten)]
    pub force: Force,
    #[command(flatten)]
    pub temperature: Temperatures,
    /// Print JSON and write no files
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Fit {
    /// Traces (.csv) of one or several pulses from rest, with the columns t_s, i_a_A, i_b_A, i_c_A (one may be missing) or i_link_A (of a
    /// shunt in the DC link), u_dc_V, and leg_a, leg_b, leg_c: the requests to the legs, off, low or high; angle_deg, the
    /// rotor's electrical angle from an encoder, is optional
    #[arg(required = true)]
    pub traces: Vec<PathBuf>,
    /// A trace (.csv) that is not fitted: its currents are predicted with the fitted values, and the differences are printed; any
    /// number of times
    #[arg(long, value_name = "TRACE.csv")]
    pub predict: Vec<PathBuf>,
    /// A motor like the measured one, a built-in's name or a data sheet's path (.toml): start of the fit, and source of the values
    /// that the traces do not determine [default: none]
    #[arg(long, value_name = "START")]
    pub motor: Option<String>,
    /// A known value of the drive, such as `inverter.dead_time="1.5 us"`; any number of times [default: error set default]
    #[arg(short, long = "set", value_name = "KEY=VALUE", value_parser = scenario::assignment)]
    pub set: Vec<(String, String)>,
    /// Folder for the files, created if it does not exist
    #[arg(long, value_name = "DIR", default_value = OUT)]
    pub out: PathBuf,
    #[command(flatten)]
    pub force: Force,
    /// Print the content of fit.json instead of text
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Convert {
    /// Numbers as a data sheet or a controller gives them, by the keys of [nameplate], such as `pole_pairs=7 Kv="900 rpm/V"`
    #[arg(required = true, value_name = "KEY=VALUE", value_parser = scenario::assignment)]
    pub numbers: Vec<(String, String)>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Motors {
    /// Only this one: a built-in motor's name, or a data sheet's path (.toml)
    pub name: Option<String>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}
