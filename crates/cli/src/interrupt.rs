//! Ctrl-C: finish the block, keep what is done.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::terminal::tell;
use crate::{host, output};

/// Code of a process ended by an interrupt: 128 + SIGINT.
pub const INTERRUPTED: u8 = 130;

/// A flag that the first interrupt sets, for work that can be stopped and kept. The second one ends the process at
/// once and removes what is in the making.
pub fn flag() -> Arc<AtomicBool> {
    if let Some(host) = host::current() {
        return host.flag();
    }
    let stop = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&stop);
    handle(move || seen.swap(true, Ordering::SeqCst));
    stop
}

/// For work too short to keep half of: an interrupt ends the process at once and removes what is in the making.
pub fn at_once() {
    handle(|| {
        output::abandon();
        // Not among what the command prints, which may be a script.
        tell("Interrupted.");
        true
    });
}

/// Calls this at the first interrupt; the second one ends the process at once.
pub fn then(act: impl Fn() + Send + 'static) {
    let seen = AtomicBool::new(false);
    handle(move || {
        let again = seen.swap(true, Ordering::SeqCst);
        if !again {
            act();
        }
        again
    });
}

fn handle(ends: impl Fn() -> bool + Send + 'static) {
    // Interrupts are its own.
    if host::current().is_some() {
        return;
    }
    // Without a handler an interrupt ends the process at once, which loses no finished file either.
    let _ = ctrlc::set_handler(move || {
        if ends() {
            output::abandon();
            std::process::exit(i32::from(INTERRUPTED));
        }
    });
}
