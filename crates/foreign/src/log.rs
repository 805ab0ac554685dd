//! The log of a detector: lines that a library hands over by `sts_log()`, with the call in which it did.
#![allow(unsafe_code, reason = "a library calls back, with an address that it was given and a text")]

use std::ffi::{CStr, c_char, c_void};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use standstill_interface::Nanos;
use standstill_interface::abi::Drive;

use crate::image::Site;
use crate::watched::Called;

/// Lines of a detection that are kept at most.
const MOST_LINES: usize = 1000;

/// Bytes of a line that are kept at most.
const LONGEST: usize = 500;

/// Lines that the program still writes to standard error.
static LEFT: AtomicU32 = AtomicU32::new(101);

/// The log of one detector.
#[derive(Debug, Default)]
pub struct Log {
    /// Calls of the detector so far.
    calls: AtomicU64,
    /// Time in ns of the running function, plus one; 0: not known.
    time: AtomicU64,
    lines: Mutex<Vec<Called<String>>>,
}

impl Log {
    /// Returns a log, and the drive that offers it to a library. The address is valid as long as the log is.
    pub fn offered_by(drive: &Drive) -> (Arc<Self>, Drive) {
        let log = Arc::new(Self::default());
        let take: extern "C" fn(*mut c_void, *const c_char) = take;
        let drive = Drive {
            log_to: Arc::as_ptr(&log).expose_provenance(),
            log: (take as *const ()).expose_provenance(),
            ..*drive
        };
        (log, drive)
    }

    /// Begins the next call; returns its number, from 1. Lines of `create` have the number 0.
    pub fn next_call(&self) -> u64 {
        self.calls.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Sets the time of the function that is called next.
    pub fn set_time(&self, time: Nanos) {
        self.time.store(time.0.saturating_add(1), Ordering::Relaxed);
    }

    /// Takes all lines, each with its call and time.
    pub fn take(&self) -> Vec<Called<String>> {
        std::mem::take(&mut self.lines.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Writes lines of the log that were not taken to standard error, with library, trial and call. Only the first
    /// lines of a run are written, so that they do not drown a campaign's output.
    pub fn say(&self, site: Site) {
        for Called { call, what: text, .. } in self.take() {
            match LEFT.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)) {
                Ok(1) => eprintln!(
                    "standstill: further lines of the log are left out; `standstill trace` has those of a trial"
                ),
                Ok(_) => eprintln!("standstill: {site}, call {call}: {text}"),
                Err(_) => return,
            }
        }
    }

    fn add(&self, text: &[u8]) {
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        let text = match lines.len() {
            MOST_LINES => format!("further lines are left out: {MOST_LINES} are kept"),
            more if more > MOST_LINES => return,
            _ => String::from_utf8_lossy(&text[..text.len().min(LONGEST)]).trim_end().to_owned(),
        };
        let time = self.time.load(Ordering::Relaxed).checked_sub(1).map(Nanos);
        lines.push(Called { call: self.calls.load(Ordering::Relaxed), time, what: text });
    }
}

/// Implements `sts_drive.log`.
extern "C" fn take(log_to: *mut c_void, text: *const c_char) {
    // SAFETY: a library hands back the address that it was given, while its detector is there; null, if it does not.
    let (log, text) =
        unsafe { (log_to.cast::<Log>().as_ref(), (!text.is_null()).then(|| CStr::from_ptr(text))) };
    if let (Some(log), Some(text)) = (log, text) {
        log.add(text.to_bytes());
    }
}
