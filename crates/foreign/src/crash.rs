//! What the program says before a crash of a foreign library ends it: which library, in which trial.
#![allow(
    unsafe_code,
    reason = "signal handlers are registered and write to standard error by system calls alone"
)]

use std::cell::Cell;
use std::ptr;
use std::sync::Once;

/// A detection for whoever must tell of its crash.
#[derive(Debug)]
pub struct Site {
    text: String,
}

impl Site {
    /// Of a trial with this library.
    pub fn new(library: &str, trial: u64) -> Self {
        Self { text: format!("the detector {library} in trial {trial}") }
    }
}

thread_local! {
    /// The detection that is inside its library in this thread. Without destructor, so that a signal handler may read it.
    static HERE: Cell<*const Site> = const { Cell::new(ptr::null()) };
}

/// From here on to [`leave`] a crash is that detection's.
#[inline]
pub fn enter(site: &Site) -> *const Site {
    HERE.replace(site)
}

/// See [`enter`].
#[inline]
pub fn leave(before: *const Site) {
    HERE.set(before);
}

/// Signals that end a program because of what its code did.
const SIGNALS: [(libc::c_int, &str); 5] = [
    (libc::SIGSEGV, "SIGSEGV, memory that is not its own"),
    (libc::SIGBUS, "SIGBUS, memory that is not there"),
    (libc::SIGFPE, "SIGFPE, such as a division of whole numbers by zero"),
    (libc::SIGILL, "SIGILL, no instruction"),
    (libc::SIGABRT, "SIGABRT, abort() or a failed assert()"),
];

/// What a signal is, by its number.
pub fn signal_name(number: i32) -> String {
    let known = SIGNALS.iter().find(|(known, _)| *known == number);
    known.map_or_else(|| format!("signal {number}"), |(_, name)| (*name).to_owned())
}

/// Makes crashes tell. Once for the program.
pub fn watch() {
    static WATCH: Once = Once::new();
    WATCH.call_once(|| {
        for (signal, _) in SIGNALS {
            // SAFETY: a zeroed sigaction is one without flags and mask; the handler is one that signals allow.
            unsafe {
                let mut action: libc::sigaction = std::mem::zeroed();
                action.sa_sigaction = on_signal as *const () as libc::sighandler_t;
                // On the stack that threads have for the overflow of their own.
                action.sa_flags = libc::SA_ONSTACK | libc::SA_RESETHAND;
                libc::sigaction(signal, &raw const action, ptr::null_mut());
            }
        }
        // SAFETY: a function without arguments.
        unsafe { libc::atexit(on_exit) };
    });
}

fn write(text: &str) {
    // SAFETY: so many bytes from there; nothing can be done where standard error takes none.
    unsafe { libc::write(libc::STDERR_FILENO, text.as_ptr().cast(), text.len()) };
}

/// Whose crash it is, if it is a library's.
fn here() -> Option<&'static str> {
    let site = HERE.get();
    // SAFETY: null, or a detection that is inside its library, which outlives the call.
    (!site.is_null()).then(|| unsafe { (*site).text.as_str() })
}

extern "C" fn on_signal(signal: libc::c_int) {
    if let Some(site) = here() {
        let name = SIGNALS.iter().find(|(known, _)| *known == signal).map_or("a signal", |(_, name)| name);
        for text in ["\nerror: ", site, " crashed: ", name, "\n"] {
            write(text);
        }
    }
    // The handler is gone: the signal ends the program as it would have without it.
    // SAFETY: a signal to this thread itself.
    unsafe { libc::raise(signal) };
}

extern "C" fn on_exit() {
    if let Some(site) = here() {
        for text in ["\nerror: ", site, " called exit(), which ends the whole program\n"] {
            write(text);
        }
        // SAFETY: the program ends here; results are not written, as their command is in the middle of its work.
        unsafe { libc::_exit(1) };
    }
}
