//! Ctrl-C: finish the block, keep what is done.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Code of a process ended by an interrupt: 128 + SIGINT.
pub const INTERRUPTED: u8 = 130;

/// A flag that the first Ctrl-C sets. A second one ends the process at once.
pub fn flag() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&stop);
    // Without a handler Ctrl-C ends the process at once, which loses no finished file either.
    let _ = ctrlc::set_handler(move || {
        if seen.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(INTERRUPTED));
        }
    });
    stop
}
