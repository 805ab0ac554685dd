//! The power stage: gates with dead time, switches and diodes, and the DC link.
//!
//! ```text
//!   link + ──┬────────┬────────┬──       A leg is described by what it does to its terminal:
//!            S↓ D     S↓ D     S↓ D        current out of it   → its potential sits at the lower bound,
//!            ├── a    ├── b    ├── c       current into it     → at the upper bound,
//!            S↓ D     S↓ D     S↓ D        no current (blocked) → anywhere between the two.
//!   link − ──┴────────┴────────┴──       The gates move the bounds.
//! ```
//!
//! A leg is High, Low or Off. Which of its four devices conducts, or none, is its [`Conduction`]. The modes of the
//! three legs follow from the gates and the port (currents, inductances, back-EMF): [`Bridge::resolve`]. While the
//! modes last, [`Bridge::potentials`] gives the terminal potentials. A blocked leg's potential is the one that keeps
//! its current at zero, from one linear equation, so there is no off-resistance and no stiffness. A mode lasts while
//! its leg's current keeps its direction, or its potential stays between the bounds that the gates set.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod bridge;
mod devices;
mod gates;
mod link;

pub use bridge::{Bridge, Modes, OpenLeg, Port};
pub use devices::{Clamp, Conduction, DeviceKind, Devices};
pub use gates::{Gate, GateTiming};
pub use link::{DcLink, Sag, Source, Storage};

// What the sister crates need of each other.
#[doc(hidden)]
pub use bridge::AXES;

use standstill_interface::Nanos;

/// An inverter: everything between the commands and the motor's terminals.
#[derive(Clone, Debug, PartialEq)]
pub struct Inverter {
    /// Switches, diodes, and the behaviour of an idle leg.
    pub bridge: Bridge,
    /// Dead time and delays of each leg, a to c.
    pub gates: [GateTiming; 3],
    /// The DC side.
    pub link: DcLink,
    /// Period of the PWM carrier.
    pub carrier_period: Nanos,
}

/// The examples of the README run too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
