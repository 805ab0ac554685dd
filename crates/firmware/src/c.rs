//! The functions of `sts_detectors.h`: the only place of `unsafe` here.
//!
//! Soundness: the caller keeps the header's side: pointers to whole structs of its own, zero-ended texts, arrays as
//! long as it says. A state that `sts_begin` did not make lacks its mark.
#![allow(unsafe_code, reason = "C calls these functions with pointers")]

use core::ffi::{CStr, c_char};
use core::fmt::{self, Write as _};
use core::ptr::{addr_of_mut, null};
use core::slice;

use standstill_detect::AnyDetector;
use standstill_interface::abi::{
    self, Answer, Command, DETECTOR_BYTES, MOST_SAMPLES, Plate, Sample, Setting,
};
use standstill_interface::{Detector as _, Reading, Step};

use crate::begin::{self, Refused};
use crate::convert;

/// Content of an `sts_state`.
#[repr(C)]
pub struct State {
    mark: u64,
    detector: AnyDetector<f32>,
    readings: [Reading<f32>; MOST_SAMPLES],
    text: Text,
}

const _: () = assert!(size_of::<State>() <= DETECTOR_BYTES && align_of::<State>() <= align_of::<u64>());

/// Of a state with a detector in it.
const READY: u64 = 0x5354_4154_4544_4554;

/// A zero-ended text; what is too long is cut.
struct Text {
    bytes: [u8; 128],
    length: usize,
}

impl fmt::Write for Text {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes().take(self.bytes.len() - 1 - self.length) {
            self.bytes[self.length] = byte;
            self.length += 1;
        }
        Ok(())
    }
}

/// A text of C, cut where it is no longer text.
///
/// # Safety
/// It is zero-ended.
unsafe fn text<'a>(from: *const c_char) -> &'a str {
    if from.is_null() {
        return "";
    }
    // SAFETY: the caller's.
    let text = unsafe { CStr::from_ptr(from) };
    text.to_str().unwrap_or("?")
}

/// See `sts_detectors.h`.
///
/// # Safety
/// Pointers and numbers as the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sts_begin(
    state: *mut State,
    method: *const c_char,
    plate: *const Plate,
    settings: *const Setting,
    settings_count: u32,
) -> *const c_char {
    // SAFETY: memory of the caller, as large and as aligned as an `sts_state`, which a test compares with `State`; what was in
    // it needs no end. All fields are written before it is used as a whole.
    unsafe {
        addr_of_mut!((*state).mark).write(0);
        addr_of_mut!((*state).text).write(Text { bytes: [0; 128], length: 0 });
    }
    // SAFETY: so many settings of the caller, with their texts.
    let made = unsafe {
        let settings =
            if settings_count == 0 { &[] } else { slice::from_raw_parts(settings, settings_count as usize) };
        let settings = settings.iter().map(|setting| (text(setting.key), setting.value));
        begin::detector(text(method), &*plate, settings)
    };
    // SAFETY: as above.
    unsafe {
        match made {
            Ok(detector) => {
                addr_of_mut!((*state).detector).write(detector);
                addr_of_mut!((*state).readings).write([convert::NO_READING; MOST_SAMPLES]);
                addr_of_mut!((*state).mark).write(READY);
                null()
            }
            Err(refused) => refuse(&mut *addr_of_mut!((*state).text), &refused),
        }
    }
}

fn refuse(into: &mut Text, refused: &Refused<'_>) -> *const c_char {
    // It takes what fits.
    let _ = write!(into, "{refused}");
    into.bytes.as_ptr().cast()
}

/// See `sts_detectors.h`.
///
/// # Safety
/// Pointers and numbers as the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sts_step(
    state: *mut State,
    samples: *const Sample,
    samples_count: u32,
    command: *mut Command,
    result: *mut Answer,
) -> i32 {
    let count = samples_count as usize;
    // SAFETY: the mark says that `sts_begin` wrote all of the state.
    let known = unsafe { addr_of_mut!((*state).mark).read() } == READY && count <= MOST_SAMPLES;
    if !known {
        let (status, answer) = convert::unexpected();
        // SAFETY: a result of the caller.
        unsafe { result.write(answer) };
        return status;
    }
    // SAFETY: as above, and so many samples of the caller.
    let (state, samples) =
        unsafe { (&mut *state, if count == 0 { &[] } else { slice::from_raw_parts(samples, count) }) };
    for (reading, sample) in state.readings.iter_mut().zip(samples) {
        *reading = convert::reading(sample);
    }
    match state.detector.step(&state.readings[..count]) {
        Step::Drive(next) => {
            // SAFETY: a command of the caller.
            unsafe { command.write(convert::command(&next)) };
            abi::GO_ON
        }
        Step::Done(outcome) => {
            let (status, answer) = convert::outcome(&outcome);
            // SAFETY: a result of the caller.
            unsafe { result.write(answer) };
            // A detection is over: another one begins with `sts_begin`.
            state.mark = 0;
            status
        }
    }
}
