//! The types of `standstill.h` and `sts_detectors.h`, field by field: the interface between a detector and a drive if
//! one of them is written in C. The headers state the meaning and unit of each field. A test of the crate
//! `standstill-foreign` compares each size, offset and number with those of C compilers.
#![allow(missing_docs, reason = "the headers say what each field is")]

mod sample;

use core::ffi::{c_char, c_void};

use crate::{Fault, Undetermined};

pub use sample::{sensed_code, sensed_of};

/// The version of these types.
pub const ABI: u32 = 2;

/// Triggers of the converters between two updates of an interrupt, at most.
pub const MOST_TRIGGERS: u32 = 16;

/// `STS_OFF` and the others, in their order.
pub const OFF: u8 = 0;
pub const LOW: u8 = 1;
pub const HIGH: u8 = 2;
pub const DUTY: u8 = 3;
pub const RISE: u8 = 4;
pub const FALL: u8 = 5;

/// `enum sts_flags`.
pub const INTERRUPT: u32 = 1;
pub const DOUBLE_UPDATE: u32 = 2;
pub const REENTRANT: u32 = 4;

/// `enum sts_status`.
pub const GO_ON: i32 = 0;
pub const FOUND: i32 = 1;
pub const AXIS: i32 = 2;
pub const FAILED: i32 = 3;

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    pub size: u32,
    pub current_bits: u32,
    pub dc_link_bits: u32,
    pub amps_per_count: f32,
    pub amps_at_zero: f32,
    pub volts_per_count: f32,
    pub dc_link: f32,
    pub rated_current: f32,
    pub resistance: f32,
    pub ld: f32,
    pub lq: f32,
    pub flux: f32,
    pub dead_time: f32,
    pub stronger_pole: i32,
    pub period_ns: u64,
    pub settle_ns: u64,
    pub terminal_bits: u32,
    pub terminal_volts_per_count: f32,
    pub timer_tick: f32,
    pub comparator_delay: f32,
    pub comparator_offset: f32,
    pub comparator_noise: f32,
    pub comparators: u32,
    pub comparator_delay_spread: f32,
    pub comparator_blanking: f32,
    pub threshold_highest: f32,
    /// Addresses stored as numbers, so that a drive's knowledge can be sent from one thread to another.
    pub log_to: usize,
    pub log: usize,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    pub time_ns: u64,
    pub current: [f32; 3],
    pub dc_link: f32,
    pub current_count: [u32; 3],
    pub dc_link_count: u32,
    pub sensed: [u8; 3],
    pub dc_link_clipped: u8,
    pub half: u8,
    pub link_sensed: u8,
    pub captured: u8,
    pub comparator: u8,
    pub link_current: f32,
    pub link_current_count: u32,
    pub terminal: [f32; 3],
    pub terminal_count: [u32; 3],
    pub terminal_sensed: [u8; 3],
    pub reserved: u8,
    pub capture_ticks: u32,
}

/// `sts_readings`: samples one after the other, `stride` bytes apart.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Readings {
    pub size: u32,
    pub count: u32,
    pub stride: u32,
    pub reserved: u32,
    pub first: *const c_void,
}

#[allow(clippy::cast_possible_truncation, reason = "a struct of some bytes")]
const fn bytes<T>() -> u32 {
    size_of::<T>() as u32
}

impl Readings {
    /// Makes the C form of these samples; none if there are more than four thousand million.
    pub fn of(samples: &[Sample]) -> Option<Self> {
        Some(Self {
            size: bytes::<Self>(),
            count: u32::try_from(samples.len()).ok()?,
            stride: bytes::<Sample>(),
            reserved: 0,
            first: samples.as_ptr().cast(),
        })
    }
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Legs {
    pub size: u32,
    pub leg: [u8; 3],
    pub reserved: u8,
    pub duty: [f32; 3],
    pub shift: [f32; 3],
    pub sample_at: f32,
    pub sample_every: f32,
}

impl Default for Legs {
    /// Makes all off.
    fn default() -> Self {
        Self {
            size: bytes::<Self>(),
            leg: [OFF; 3],
            reserved: 0,
            duty: [0.0; 3],
            shift: [0.0; 3],
            sample_at: 0.0,
            sample_every: 0.0,
        }
    }
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stage {
    pub leg: [u8; 3],
    pub reserved: u8,
    pub duty: [f32; 3],
    pub edge_ns: [u32; 3],
    pub reserved_too: u32,
    pub duration_ns: u64,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    pub size: u32,
    pub stages: u32,
    pub stage: [Stage; 2],
    pub samples: u32,
    pub until: f32,
    pub first_ns: u64,
    pub interval_ns: u64,
}

impl Default for Command {
    /// Returns a command without any order.
    fn default() -> Self {
        Self {
            size: bytes::<Self>(),
            stages: 0,
            stage: [Stage::default(); 2],
            samples: 0,
            until: 0.0,
            first_ns: 0,
            interval_ns: 0,
        }
    }
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    pub size: u32,
    pub angle: f32,
    pub angle_deviation: f32,
    pub pole_evidence: f32,
    pub pole_needed: f32,
    pub reason: u32,
    pub age: f32,
}

impl Answer {
    /// Size of `sts_result` in the first header of this version.
    pub const LEAST: usize = core::mem::offset_of!(Self, age);

    /// Value of a field that nobody wrote to: a quiet NaN with a payload that no computation produces.
    pub const UNSET: f32 = f32::from_bits(0x7FC5_7500);

    /// Nothing known.
    pub const NONE: Self = Self {
        size: bytes::<Self>(),
        angle: Self::UNSET,
        angle_deviation: Self::UNSET,
        pole_evidence: Self::UNSET,
        pole_needed: Self::UNSET,
        reason: 0,
        age: Self::UNSET,
    };
}

// An exception of C++ that leaves one of them is found out by who calls it.
pub type Create =
    unsafe extern "C-unwind" fn(*const Drive, *const c_char, u64, *mut *const c_char) -> *mut c_void;
pub type Destroy = unsafe extern "C-unwind" fn(*mut c_void);
pub type Reason = unsafe extern "C-unwind" fn(u32) -> *const c_char;
pub type Step = unsafe extern "C-unwind" fn(*mut c_void, *const Readings, *mut Command, *mut Answer) -> i32;
pub type Isr = unsafe extern "C-unwind" fn(*mut c_void, *const Readings, *mut Legs, *mut Answer) -> i32;
pub type Probe = unsafe extern "C-unwind" fn(*mut c_void, u32, *mut f32) -> *const c_char;
pub type Task = unsafe extern "C-unwind" fn(*mut c_void, u64);
pub type Entry = unsafe extern "C-unwind" fn(u32) -> *const Table;

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Table {
    pub abi: u32,
    pub size: u32,
    pub flags: u32,
    pub pwm_hz: u32,
    pub sample_at: f32,
    pub update_delay: u32,
    pub name: *const c_char,
    pub create: Option<Create>,
    pub destroy: Option<Destroy>,
    pub reason: Option<Reason>,
    pub step: Option<Step>,
    pub isr: Option<Isr>,
    pub probe: Option<Probe>,
    pub samples: u32,
    pub sample_every: f32,
    pub task: Option<Task>,
    pub task_ns: u64,
}

impl Table {
    /// Size of `sts_detector` in the first header of this version; a detector of that size lacks the fields that were
    /// appended later.
    pub const LEAST: usize = core::mem::offset_of!(Self, probe);
}

/// `STS_DETECTOR_BYTES`: memory of a detector of any method.
pub const DETECTOR_BYTES: usize = 16 * 1024;

/// `STS_MOST_SAMPLES`: largest number of samples of any method's command.
pub const MOST_SAMPLES: usize = 128;

/// `sts_plate`: the nameplate for a detector of the static library.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plate {
    pub rated_pulse_ns: u64,
    pub dead_time_ns: u64,
    pub period_ns: u64,
    pub skew_ns: u64,
    pub rated_current: f32,
    pub resistance: f32,
    pub ld: f32,
    pub lq: f32,
    pub flux: f32,
    pub stronger_pole: i32,
    pub stronger_pole_half: i32,
    pub pole_difference: f32,
    pub gain_tolerance: f32,
    pub dc_link: f32,
    pub switch_drop: [f32; 2],
    pub diode_drop: [f32; 2],
    pub reverse_drop: [f32; 2],
    pub sensor_bandwidth: f32,
    pub bandwidth_mismatch: f32,
    pub pick_up: [f32; 2],
    pub settle_ns: u64,
    pub readings: u32,
    pub comparators: u32,
    pub timer_tick: f32,
    pub comparator_delay: f32,
    pub comparator_delay_spread: f32,
    pub comparator_offset: f32,
    pub comparator_noise: f32,
    pub divider_tolerance: f32,
    pub divider_offset: f32,
    pub divider_bandwidth: f32,
    pub comparator_blanking: f32,
    pub threshold_highest: f32,
    pub timer_error: f32,
    pub link_noise: f32,
    pub averaged_ns: u64,
    pub delay_mismatch: f32,
}

/// `enum sts_kinds`: kinds of readings that a drive has.
pub const PHASE_CURRENTS: u32 = 1;
pub const LINK_CURRENT: u32 = 2;
pub const TERMINALS: u32 = 4;
pub const CAPTURES: u32 = 8;
pub const BELOW_LEGS: u32 = 16;

/// `sts_setting`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    pub key: *const c_char,
    pub value: f64,
}

/// Returns the code of `enum sts_reason` for an axis without a pole.
pub const fn axis_reason<T>(reason: &Undetermined<T>) -> u32 {
    reason.listed().0
}

/// Returns the code of `enum sts_reason` for a failure.
pub const fn failure_reason<T>(fault: &Fault<T>) -> u32 {
    fault.listed().0
}
