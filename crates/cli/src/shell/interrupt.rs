//! Ctrl-C: finish the block, keep what is done.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::{host, output};
use crate::shell::terminal::tell;

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
    handle(move || {
        end_if_hanging();
        seen.swap(true, Ordering::SeqCst)
    });
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
            end_if_hanging();
            act();
        }
        again
    });
}

/// How long a library may take for a call after an interrupt.
#[cfg(target_os = "linux")]
const PATIENCE: std::time::Duration = std::time::Duration::from_secs(1);

/// Ends the process if a library does not return from a call: the work cannot end then, whatever the flag says.
fn end_if_hanging() {
    #[cfg(target_os = "linux")]
    std::thread::spawn(|| {
        let hanging = std::iter::repeat_with(|| standstill_foreign::hanging(PATIENCE)).flatten().next();
        output::abandon();
        tell(&format!(
            "Interrupted: {}. With --isolate (run, sweep) that costs its trial alone, after detector.call_timeout.",
            hanging.unwrap_or_default()
        ));
        std::process::exit(i32::from(INTERRUPTED));
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
