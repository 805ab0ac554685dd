//! Drive and motor as functional mock-up units (FMU): co-simulation by FMI 2.0 and 3.0.
//!
//! ```text
//!   standstill fmu ─► Model: the scenario, its variables ─► modelDescription.xml ┐
//!                                    │                       resources/          ├─ zip ─► drive.fmu
//!   this crate as a shared library ──┼─────────────────────► binaries/           ┘
//!                                    ▼
//!   importer ─► fmi2DoStep ─► Instance: legs → command → readings ─► fmi2GetReal ─► importer
//! ```
//! The crate is compiled twice: into the program, which writes the archive, and as the shared library that goes into it. Both
//! make the same list of variables from the scenario in `resources/`, so that a value reference means the same to both. The
//! engine is the one of all other commands ([`standstill_sim::Driven`]).
//!
//! The interface to C is written by hand after the headers of the standard (<https://fmi-standard.org>); no header and no
//! libclang is needed.

mod archive;
mod description;
mod documentation;
mod exported;
mod fmi2;
mod fmi3;
mod instance;
mod log;
mod model;
mod rig;
mod units;
mod variables;

pub use archive::{Binary, pack};
pub use model::{Model, ModelError, Part, Version};
pub use variables::{Kind, Role, Variable};
