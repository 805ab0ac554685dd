//! Standstill's detectors as a static C library for drives: `sts_detectors.h`, from the same source as in the bench.
//!
//! ```text
//!   a drive's C ── samples ──► sts_step() ──► Detector<f32> ── command, or result ──► the drive
//!                                 └─ all it keeps is in an sts_state of the drive's
//! ```
//! This builds only while no crate below it needs more than `core`: with the standard library there would be two panic
//! handlers, with `alloc` an allocator would be missing.
#![no_std]

mod begin;
mod c;
mod commissioning;
mod convert;

use core::panic::PanicInfo;

pub use commissioning::learn;

/// Handles a panic by an endless loop, which ends by the drive's watchdog. Detectors do not panic, and the linked code
/// contains no text of a panic.
#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    loop {}
}
