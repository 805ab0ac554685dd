//! One deterministic run of motor, inverter, sensors and detector.
//!
//! ```text
//!   command → gate edges → conduction → voltage → flux → current → reading → detector → command
//! ```
//!
//! Time is cut at every instant: gate edges and ADC triggers at whole nanoseconds, changes of conduction and of
//! the rotor's motion wherever they fall. Between two neighbouring instants the flow is smooth and one
//! high-order integrator carries it ([`run`]). A run is a pure function of its [`Case`]: nothing reads a clock,
//! and every random draw belongs to a purpose and has a number there ([`Streams`]).
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod case;
mod flow;
mod integrator;
mod lanes;
mod ledger;
mod limits;
pub mod lockstep;
mod machine;
mod motion;
mod rig;
mod sensing;
mod streams;
mod stride;
mod timeline;
mod trace;

pub use case::{Case, Ended, Play, RotorState, Run, RunError, Tolerance, Work};
pub use flow::Flow;
pub use integrator::Attempt;
pub use lanes::{Bank, LANES, Lanes};
pub use ledger::Ledger;
pub use limits::{Limits, MARGINS};
pub use lockstep::{run, run_side_by_side};
pub use machine::{CORE, Evaluation, Machine, Operating, PLANE, WITH_EDDY, WITH_LEDGER};
pub use motion::Motion;
pub use sensing::{Adc, Arrangement, Resolver, SensorSettings, Sensors, VoltageSensor};
pub use streams::{Draws, Purpose, Streams, Strip, Tape};
pub use stride::{Ask, Stride};
pub use trace::{Event, NoProbe, Probe, Snapshot, Trace};

/// The engine that was before: the referee.
pub mod reference {
    pub use crate::lanes::run_side_by_side;
    pub use crate::rig::run;
}
