//! ABI 1: libraries compiled with the first `standstill.h`, which had no sizes, link current, terminals or comparators.
//! They are called through these types and receive only the data of that version.

use std::ffi::c_void;
use std::mem::offset_of;

use standstill_interface::abi::{Answer, Command, Drive, Legs, Sample, Stage};

/// `sizeof(sts_drive)` of ABI 1, whose fields are the first of the present one.
#[allow(clippy::cast_possible_truncation, reason = "a struct of some bytes")]
pub const DRIVE_BYTES: u32 = offset_of!(Drive, settle_ns) as u32;

/// `sts_sample` of ABI 1: the first fields of the present structure, with zeros in the reserved ones.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Sample1 {
    time_ns: u64,
    current: [f32; 3],
    dc_link: f32,
    current_count: [u32; 3],
    dc_link_count: u32,
    sensed: [u8; 3],
    dc_link_clipped: u8,
    half: u8,
    reserved: [u8; 3],
}

impl From<&Sample> for Sample1 {
    fn from(sample: &Sample) -> Self {
        Self {
            time_ns: sample.time_ns,
            current: sample.current,
            dc_link: sample.dc_link,
            current_count: sample.current_count,
            dc_link_count: sample.dc_link_count,
            sensed: sample.sensed,
            dc_link_clipped: sample.dc_link_clipped,
            half: sample.half,
            reserved: [0; 3],
        }
    }
}

/// `sts_legs`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Legs1 {
    leg: [u8; 3],
    reserved: u8,
    duty: [f32; 3],
}

impl Legs1 {
    /// Converts the legs of the present version.
    pub fn of(legs: &Legs) -> Self {
        Self { leg: legs.leg, reserved: 0, duty: legs.duty }
    }

    /// Copies the values that a library wrote.
    pub fn write(&self, legs: &mut Legs) {
        (legs.leg, legs.duty) = (self.leg, self.duty);
    }
}

/// `sts_command` of ABI 1; its stages have the present layout.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Command1 {
    stage: [Stage; 2],
    stages: u32,
    samples: u32,
    first_ns: u64,
    interval_ns: u64,
}

impl From<&Command1> for Command {
    fn from(command: &Command1) -> Self {
        let Command1 { stage, stages, samples, first_ns, interval_ns } = *command;
        Self { stages, stage, samples, first_ns, interval_ns, ..Self::default() }
    }
}

/// `sts_result`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Answer1 {
    angle: f32,
    angle_deviation: f32,
    pole_evidence: f32,
    pole_needed: f32,
    reason: u32,
}

impl Answer1 {
    /// Nothing known.
    pub const NONE: Self = Self {
        angle: Answer::UNSET,
        angle_deviation: Answer::UNSET,
        pole_evidence: Answer::UNSET,
        pole_needed: Answer::UNSET,
        reason: 0,
    };
}

impl From<&Answer1> for Answer {
    fn from(answer: &Answer1) -> Self {
        let Answer1 { angle, angle_deviation, pole_evidence, pole_needed, reason } = *answer;
        Self { angle, angle_deviation, pole_evidence, pole_needed, reason, ..Self::NONE }
    }
}

// Of ABI 1's table of functions, whose fields are the first of the present one, these two have other types.
pub type Step1 =
    unsafe extern "C-unwind" fn(*mut c_void, *const Sample1, u32, *mut Command1, *mut Answer1) -> i32;
pub type Isr1 = unsafe extern "C-unwind" fn(*mut c_void, *const Sample1, *mut Legs1, *mut Answer1) -> i32;
