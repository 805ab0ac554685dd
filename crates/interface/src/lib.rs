//! All that crosses between a rotor position detector and the drive that runs it.
//!
//! ```text
//!              Command: what the legs do, when to sample
//!   ┌──────────┐ ─────────────────────────────────────► ┌─────────────────┐
//!   │ Detector │                                        │ drive and motor │
//!   └──────────┘ ◄───────────────────────────────────── └─────────────────┘
//!              Readings: phase currents, DC link
//! ```
//!
//! A [`Detector`] is a state machine without input or output: it gets the readings of its last command and
//! returns the next command, or its [`Outcome`]. It has no clock, no thread and no allocation, so the same
//! code runs in this simulator and in firmware. A [`Reading`] has no field for the true rotor angle: a
//! detector cannot look.
#![no_std]
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

pub mod abi;
mod angle;
mod choice;
mod command;
mod detector;
mod frames;
mod outcome;
mod reading;
mod real;

pub use angle::Angle;
pub use choice::Choice;
pub use command::{Command, Leg, Nanos, Sampling, Stage};
pub use detector::{Detector, Step};
pub use frames::{Abc, AlphaBeta, Dq, Phase};
pub use outcome::{Fault, Findings, Outcome, Own, Polarity, PoleEvidence, Rotation, Undetermined};
pub use reading::{Capture, Counts, Reading, Sensed};
pub use real::{Arithmetic, Real};

/// The examples of the README run too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
