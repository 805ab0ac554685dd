//! The functions of `sts_detectors.h`; only this module has `unsafe` code.
//!
//! Soundness: the caller obeys the header, with pointers to its own whole structs, zero-terminated texts, and arrays of
//! the stated lengths. A state that `sts_begin` did not make lacks its mark.
#![allow(unsafe_code, reason = "C calls these functions with pointers")]

use core::ffi::{CStr, c_char};
use core::fmt::{self, Write as _};
use core::mem::offset_of;
use core::ptr::{addr_of_mut, copy_nonoverlapping, null};
use core::slice;

use standstill_detect::AnyDetector;
use standstill_interface::abi::{
    self, Answer, Command, DETECTOR_BYTES, MOST_SAMPLES, Plate, Readings, Sample, Setting,
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

/// Marks a state that has a detector in it.
const READY: u64 = 0x5354_4154_4544_4554;

/// A zero-terminated text; a text that is too long is truncated.
struct Text {
    /// Longer than the longest reason.
    bytes: [u8; 256],
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

/// Returns a text of C, truncated at the first bytes that are not text.
///
/// # Safety
/// The text is zero-terminated.
unsafe fn text<'a>(from: *const c_char) -> &'a str {
    if from.is_null() {
        return "";
    }
    // SAFETY: the caller's.
    let text = unsafe { CStr::from_ptr(from) };
    text.to_str().unwrap_or("?")
}

/// Begins a detection, see `sts_detectors.h`.
///
/// # Safety
/// Pointers and numbers are as the header demands.
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
        addr_of_mut!((*state).text).write(Text { bytes: [0; 256], length: 0 });
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

/// Returns the sample with this index. Fields that an earlier version of the struct lacks count as not measured. None
/// if the struct is smaller than the smallest version.
///
/// # Safety
/// The distance between the caller's samples is as stated in the readings.
unsafe fn sample(readings: &Readings, number: u32) -> Option<Sample> {
    let stride = readings.stride as usize;
    if readings.first.is_null() || stride < offset_of!(Sample, link_current) {
        return None;
    }
    let mut sample = Sample::HIDDEN;
    // SAFETY: the caller's; of each side no more than it has.
    unsafe {
        let from = readings.first.cast::<u8>().add(number as usize * stride);
        copy_nonoverlapping(from, addr_of_mut!(sample).cast(), stride.min(size_of::<Sample>()));
    }
    Some(sample)
}

/// Computes the next step of a detection, see `sts_detectors.h`.
///
/// # Safety
/// Pointers and numbers are as the header demands.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sts_step(
    state: *mut State,
    readings: *const Readings,
    command: *mut Command,
    result: *mut Answer,
) -> i32 {
    // SAFETY: null, or readings of the caller.
    let count = unsafe { readings.as_ref() }.map_or(0, |readings| readings.count as usize);
    // SAFETY: the mark says that `sts_begin` wrote all of the state.
    let known = unsafe { addr_of_mut!((*state).mark).read() } == READY && count <= MOST_SAMPLES;
    if !known {
        let (status, answer) = convert::unexpected();
        // SAFETY: a result of the caller.
        unsafe { result.write(answer) };
        return status;
    }
    // SAFETY: as above.
    let state = unsafe { &mut *state };
    let mut read = 0;
    // SAFETY: null, or readings of the caller.
    if let Some(readings) = unsafe { readings.as_ref() } {
        for (number, reading) in (0..readings.count).zip(&mut state.readings) {
            // SAFETY: so many samples of the caller, as far apart as it says.
            let Some(sample) = (unsafe { sample(readings, number) }) else { break };
            (*reading, read) = (sample.reading(), read + 1);
        }
    }
    // Samples that cannot be read are others than were asked for.
    match state.detector.step(&state.readings[..read]) {
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
