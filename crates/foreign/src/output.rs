//! Standard output is reserved for the program's answers: output of a library goes to standard error.
#![allow(unsafe_code, reason = "what the number of standard output stands for is changed")]

use std::fs::File;
use std::os::fd::AsFd as _;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

static KEPT: AtomicBool = AtomicBool::new(false);
static OUTPUT: OnceLock<Option<File>> = OnceLock::new();

/// Redirects standard output from the first loading of a library on: the program's answers go to [`output`], and all
/// other output goes to standard error. For a program that owns its standard output.
pub fn keep_output() {
    KEPT.store(true, Ordering::Relaxed);
    // A write beyond the largest file that is allowed (`ulimit -f`, quotas) fails with a message instead of a signal that ends the process.
    // SAFETY: no function is called at this signal.
    unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
}

/// Returns the file for the program's answers, if it is no longer standard output.
pub fn output() -> Option<&'static File> {
    OUTPUT.get()?.as_ref()
}

/// Redirects standard output, before a library runs.
pub fn divert() {
    if KEPT.load(Ordering::Relaxed) {
        OUTPUT.get_or_init(|| {
            let own = std::io::stdout().as_fd().try_clone_to_owned().ok()?;
            // SAFETY: two open files of this process; from here on one number stands for the other file.
            let diverted = unsafe { libc::dup2(libc::STDERR_FILENO, libc::STDOUT_FILENO) };
            (diverted >= 0).then(|| own.into())
        });
    }
}
