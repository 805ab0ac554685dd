//! Scenarios: the settings of a campaign of trials (motor, drive, sensors, rotor, detector), read from TOML, and the
//! case that each trial simulates. A trial is one simulated detection at standstill.
//!
//! ```text
//!   text ─► Document ─► (overrides: -s, a point of the axes) ─► ScenarioFile ─► Scenario
//!           TOML with                                            typed tables     ready to run
//!           the lines of its keys
//! ```
//! Overrides change the document, not the scenario. So every key of a file can be set on the command line or varied by
//! a sweep axis, and its value is checked in one place. A trial is a pure function of its scenario (which has the seed)
//! and its number.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod axes;
mod build;
mod document;
pub mod doubts;
mod errors;
mod faults;
mod foreign;
mod hosted;
mod keys;
mod known;
mod link;
mod motor;
mod named;
mod number;
mod packed;
mod plan;
mod pole_rule;
mod record;
mod remote;
mod rotor;
mod scenario;
mod seed;
mod side_by_side;
mod single;
mod specimen;
mod suggestion;
mod tables;
mod terminals;
/// Runs the examples of the README as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

#[cfg(test)]
mod tests;
mod tolerances;
mod typed;
mod units;

pub use axes::{AxisSpec, DesignKind, Point};
pub use document::{Document, FileError, Origin};
pub use errors::{DriveSettings, ErrorSet};
pub use faults::{Between, FaultDraw, FaultMode, FaultPlace, FaultSettings, FaultTable};
pub use keys::{Key, Range, Usual, Values, key, keys};
pub use known::pole_signature;
pub use packed::Packed;
pub use plan::{Note, Plan, WatchPoints};
pub use pole_rule::PoleRule;
pub use record::{Record, TrialError, Verdict, miss_deg};
pub use rotor::{Memory, Rotor};
pub use scenario::{Scenario, Specimen};
pub use single::Single;
pub use specimen::{specimen, written};
pub use suggestion::{nearest, quoted};
pub use tables::ScenarioFile;
pub use tolerances::Tolerance;
pub use units::{schema, unit};

// Public only for the other crates of the workspace.
#[doc(hidden)]
pub use axes::{DesignTable, RangeSpec};
#[doc(hidden)]
pub use foreign::Made;
pub use hosted::{Given, Hosted, Provider, gave_up};
#[doc(hidden)]
pub use keys::{DetectorTable, InverterTable, RotorTable, SensorsTable, StopTable};
#[doc(hidden)]
pub use motor::MotorSpec;
#[doc(hidden)]
pub use named::Named;
#[doc(hidden)]
pub use remote::{Lost, Remote};
#[doc(hidden)]
pub use seed::value as seed_value;
#[doc(hidden)]
pub use units::{has_numbers, is_share};
