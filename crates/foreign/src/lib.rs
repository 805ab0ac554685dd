//! Detectors from shared libraries, such as a firmware's own C: the other side of `standstill.h`.
//!
//! ```text
//!   mine.so ─► Elf: is it one? what does it need? ─► Library ─► an Image for each lane ─► Foreign: a Detector
//!   (bytes)    before anything of it runs             its table   a copy, memory set back     step() or isr()
//! ```
//! A library is loaded from a copy of its bytes, once for each detection that runs at the same time, so that a firmware with
//! global variables runs in lanes too. Before each trial the writable memory of its image is set back to what it was after
//! loading. What `malloc` gave is not; thread-local memory cannot be and is refused.
//!
//! `unsafe` stands in `image.rs` (loading, memory, calls) and `crash.rs` (signals) alone.

mod command;
#[cfg(target_os = "linux")]
mod crash;
mod detector;
mod elf;
mod guard;
#[cfg_attr(not(target_os = "linux"), path = "elsewhere.rs")]
mod image;
mod interrupt;
#[cfg(test)]
mod layout;
mod library;
mod shared;
mod texts;

#[cfg(target_os = "linux")]
pub use crash::{ending, isolate};
pub use detector::{Foreign, Maker, Scale};
pub use elf::exported;
pub use guard::Guard;
pub use library::{Description, Level, Library, LoadError, Timing, load_elsewhere};
pub use standstill_interface::abi::ABI;
pub use texts::kept;

/// The header that a detector in C includes.
pub const HEADER: &str = include_str!("../include/standstill.h");
