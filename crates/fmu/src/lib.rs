//! Drive and motor as functional mock-up units (FMU): co-simulation by FMI 2.0 and 3.0.
//!
//! ```text
//!   standstill fmu ─► Model: the scenario, its variables ─► modelDescription.xml ┐
//!                                    │                       resources/          ├─ zip ─► drive.fmu
//!   this crate as a shared library ──┼─────────────────────► binaries/           ┘
//!                                    ▼
//!   importer ─► fmi2DoStep ─► Instance: legs → command → readings ─► fmi2GetReal ─► importer
//! ```
//! The crate is compiled twice: into the program, which writes the archive, and as the shared library in the archive.
//! Both make the same list of variables from the scenario in `resources/`, so that value references are the same. The
//! engine is that of all other commands ([`standstill_sim::Driven`]).
//!
//! The interface to C is written by hand and follows the headers of the standard (<https://fmi-standard.org>); neither
//! headers nor libclang are needed.

mod archive;
mod description;
mod documentation;
mod exported;
mod fmi2;
mod fmi3;
mod instance;
mod log;
mod model;
mod outputs;
mod past;
mod rig;
mod serial;
mod units;
mod variables;

pub use archive::{Binary, pack};
pub use model::{MOST_SAMPLES, Model, ModelError, Part, Version};
pub use variables::{Kind, Role, Variable};
