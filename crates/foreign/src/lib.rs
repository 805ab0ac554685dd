//! Detectors from shared libraries, such as C code of a firmware, which are called by the interface `standstill.h`.
//!
//! ```text
//!   mine.so ─► Elf: is it one? what does it need? ─► Library ─► an Image for each lane ─► Foreign: a Detector
//!   (bytes)    before anything of it runs             its table   a copy, memory set back     step() or isr()
//! ```
//! A library is loaded from a copy of its bytes, once for each simultaneous detection, with copies of all libraries
//! that it needs except the C library. Firmware with global variables therefore runs in lanes, too. Before each trial,
//! the writable memory of the image is restored to its content after loading. The image's state in the C library is
//! restored as well: memory of `malloc`, random numbers, `errno`, rounding mode. Thread-local memory and threads cannot
//! be restored and are refused.
//!
//! `unsafe` occurs only in `loading.rs` and `image.rs` and `table.rs` (loading, memory, calls), `heap.rs`, `runtime.rs`
//! and `strings.rs` (what an image has in place of the C library's), `float.rs` (registers), `crash.rs` (signals),
//! `log.rs` (a callback) and `output.rs` (standard output).
#![cfg_attr(
    not(all(target_os = "linux", target_env = "gnu")),
    allow(dead_code, reason = "libraries are loaded on Linux with glibc alone")
)]

mod abi1;
mod command;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod crash;
mod detector;
mod elf;
mod fenced;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod float;
mod guard;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod heap;
#[cfg_attr(not(all(target_os = "linux", target_env = "gnu")), path = "elsewhere.rs")]
mod image;
mod interrupt;
mod library;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod loading;
mod log;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod output;
mod parts;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod random;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod runtime;
mod shared;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod strings;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod table;
mod texts;
mod watched;

pub use command::command;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub use crash::{ending, hanging, isolate};
pub use detector::{Foreign, Maker, Scale};
pub use elf::exported;
pub use guard::Guard;
pub use library::{Description, Level, Library, LoadError, Timing, load_elsewhere};
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub use output::{keep_output, output};
pub use standstill_interface::abi::ABI;
pub use texts::kept;
pub use watched::{Called, Watched};

/// The header that a detector in C includes.
pub const HEADER: &str = include_str!("../include/standstill.h");

#[cfg(test)]
mod tests {
    mod layout;
}
