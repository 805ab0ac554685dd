//! The motor: winding, magnetics, rotor and the built-in data sheets.
//!
//! Angles are electrical, from the axis of phase a to the magnet's north pole (the d-axis). The transforms are
//! amplitude-invariant, so power and energy carry a factor 3/2: with `i = ∂W/∂ψ`, the field stores `3/2 W`.
//!
//! * [`Winding`]: the inductances of the three phases over the rotor angle, equations (1)–(4) of the paper.
//! * [`Magnetics`]: the core as one energy `W(ψ)`; [`Linear`] and [`Algebraic`] are such energies.
//! * [`MagneticCircuit`]: the core with harmonics over the angle, eddy currents and the magnet's temperature.
//! * [`Rotor`]: inertia, friction, cogging and the play of its brake.
//! * [`Survey`]: the properties of the magnetics that matter for a detection, above all which pole draws more current.
//! * [`Motor`]: the whole motor, validated; [`DataSheet`]: the TOML of a motor, each number with its source.
//! * [`Files`], of `standstill-files`: the only way by which data sheets and flux maps are read.
//!
//! "The paper" is Chen Cheng and Tao Ze'an, *On-Line Detection Method for Initial Rotor Position Angle of Permanent
//! Magnet Synchronous Motor*, 2019 (article 1673-6540(2019)06-0102-04, in Chinese).
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod datasheet;
mod fluxmap;
mod library;
mod magnetics;
mod motor;
mod plausible;
mod published;
mod rotor;
mod survey;
mod thermal;
mod winding;

pub use datasheet::{ConvertibleKey, DataSheet, Entry, EqualNumber, MotorError, NameplateNumber};
pub use fluxmap::{
    Continuation, FittedCore, FluxMap, InductanceErrors, MapAxes, MapReport, PoleKnowledge, PoleSpread,
};
pub use library::{built_in, built_in_names};
pub use magnetics::{
    Algebraic, Cell, Cogging, Core, Eddy, EddyBranch, Falls, FallsError, Harmonics, Hysteresis, IronBridge,
    Linear, MOST_CELLS, MagneticCircuit, MagneticState, Magnetics, NoConvergence,
};
pub use motor::{Motor, Ratings};
pub use plausible::Doubtful;
pub use published::{
    MAGNETS_INSIDE_FROM, PUBLISHED_SATURATION, PublishedFall, PublishedSaturation, fall_of_surface_magnets,
};
pub use rotor::{Friction, Rotor};
pub use standstill_files::sheet::Source;
pub use standstill_files::{Digest, Files, MapError, MapLayout, MapPoint, MapSamples, MapValues, Place};
pub use survey::{OperatingPoint, PolarityPoint, PolaritySignature, Survey};
pub use thermal::{Temperature, TemperatureError, Thermal};
pub use winding::{Winding, rotor_angle_from_lines};

// What the sister crates need of each other.
#[doc(hidden)]
pub use magnetics::{Circuits, Eddies, Series};

/// The examples of the README run too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
