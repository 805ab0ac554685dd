//! Handling of Ctrl-C: the present block of trials is finished, and all results so far are kept.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, Once, PoisonError};

use super::{host, output};
use crate::shell::terminal::tell;

/// Exit code of a process ended by an interrupt: 128 + SIGINT.
pub const INTERRUPTED: u8 = 130;

/// Returns a flag that the first interrupt sets. Work that can keep its results so far checks this flag. A second interrupt ends the
/// process at once and removes unfinished files.
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

/// Makes an interrupt remove unfinished files and end the process at once. It is meant for short work without partial results.
pub fn at_once() {
    handle(|| {
        output::abandon();
        // On standard error: standard output may be a script.
        tell("Interrupted.");
        true
    });
}

/// Calls a function at the first interrupt. A second interrupt ends the process at once.
pub fn then(act: impl Fn() + Send + Sync + 'static) {
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

/// Longest time that a library's call may take after an interrupt.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const PATIENCE: std::time::Duration = std::time::Duration::from_secs(1);

/// Ends the process if a call of a library does not return. During such a call, the interrupt flag is not checked.
fn end_if_hanging() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
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

/// Answer to an interrupt: true if the process ends at once. The newest one counts.
type Ends = Arc<dyn Fn() -> bool + Send + Sync>;

static ENDS: Mutex<Option<Ends>> = Mutex::new(None);
static SET: Once = Once::new();

fn handle(ends: impl Fn() -> bool + Send + Sync + 'static) {
    // A host program handles its interrupts itself.
    if host::current().is_some() {
        return;
    }
    *ENDS.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::new(ends));
    // If no handler can be set, an interrupt ends the process at once, which loses no finished file either.
    SET.call_once(|| {
        let _ = ctrlc::set_handler(|| {
            let ends = ENDS.lock().unwrap_or_else(PoisonError::into_inner).clone();
            if ends.is_some_and(|ends| ends()) {
                output::abandon();
                std::process::exit(i32::from(INTERRUPTED));
            }
        });
    });
}
