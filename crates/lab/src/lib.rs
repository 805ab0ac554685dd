//! The lab: a page on which users change the rotor's angle or a setting and see the effect on one detection and on ten
//! thousand.
//!
//! ```text
//!   page (canvas, no framework) ◄─ engine.mjs ─┬─► server: 127.0.0.1, a token ─┐
//!                                              └─► worker: WebAssembly ────────┴─► Bench ─► scenario, campaign, sim
//! ```
//! The page communicates with [`Bench`], which has the given scenario and returns the results of changed ones.
//! Scenarios, trials and waveforms are those of `standstill run` and `standstill trace`, to the last bit. `Server`
//! makes it available at an address of this machine.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the C library"))]

mod advice;
mod bench;
mod cloud;
mod commands;
mod controls;
mod convert;
mod detection;
mod error;
mod folder;
mod in_words;
#[cfg(feature = "server")]
mod server;
mod setting;
mod values;

pub use advice::{Advice, Find};
pub use bench::{Bench, Given};
pub use cloud::{CloudRequest, Filling, Pair};
pub use detection::DetectionRequest;
pub use error::LabError;
pub use folder::Folder;
#[cfg(feature = "server")]
pub use server::{Report, Server, ServerError};
pub use setting::Setting;
