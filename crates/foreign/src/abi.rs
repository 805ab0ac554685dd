//! The types of `standstill.h`, field by field. A test compares each size and offset with what a C compiler makes of them.

use std::ffi::{c_char, c_void};

/// The version of these types.
pub const ABI: u32 = 1;

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
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    pub time_ns: u64,
    pub current: [f32; 3],
    pub dc_link: f32,
    pub current_count: [u32; 3],
    pub dc_link_count: u32,
    pub sensed: [u8; 3],
    pub dc_link_clipped: u8,
    pub half: u8,
    pub reserved: [u8; 3],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Legs {
    pub leg: [u8; 3],
    pub reserved: u8,
    pub duty: [f32; 3],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Stage {
    pub legs: Legs,
    pub edge_ns: [u32; 3],
    pub reserved: u32,
    pub duration_ns: u64,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Command {
    pub stage: [Stage; 2],
    pub stages: u32,
    pub samples: u32,
    pub first_ns: u64,
    pub interval_ns: u64,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    pub angle: f32,
    pub angle_deviation: f32,
    pub pole_evidence: f32,
    pub pole_needed: f32,
    pub reason: u32,
}

impl Answer {
    /// Nothing known.
    pub const NONE: Self = Self {
        angle: f32::NAN,
        angle_deviation: f32::NAN,
        pole_evidence: f32::NAN,
        pole_needed: f32::NAN,
        reason: 0,
    };
}

pub type Create = unsafe extern "C" fn(*const Drive, *const c_char, u64, *mut *const c_char) -> *mut c_void;
pub type Destroy = unsafe extern "C" fn(*mut c_void);
pub type Reason = unsafe extern "C" fn(u32) -> *const c_char;
pub type Step = unsafe extern "C" fn(*mut c_void, *const Sample, u32, *mut Command, *mut Answer) -> i32;
pub type Isr = unsafe extern "C" fn(*mut c_void, *const Sample, *mut Legs, *mut Answer) -> i32;
pub type Entry = unsafe extern "C" fn(u32) -> *const Table;

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
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::mem::{offset_of, size_of};
    use std::path::Path;
    use std::process::Command as Process;

    use super::*;

    /// The C name of each type and field with what Rust makes of it.
    fn layout() -> Vec<(String, usize)> {
        let mut all = Vec::new();
        macro_rules! layout {
            ($($c:literal $rust:ident: $($field:ident)*;)*) => {$(
                all.push((format!("sizeof({})", $c), size_of::<$rust>()));
                $(all.push((format!("offsetof({}, {})", $c, stringify!($field)), offset_of!($rust, $field)));)*
            )*};
        }
        layout! {
            "sts_drive" Drive: size current_bits dc_link_bits amps_per_count amps_at_zero volts_per_count dc_link rated_current
                resistance ld lq flux dead_time stronger_pole period_ns;
            "sts_sample" Sample: time_ns current dc_link current_count dc_link_count sensed dc_link_clipped half reserved;
            "sts_legs" Legs: leg reserved duty;
            "sts_stage" Stage: legs edge_ns reserved duration_ns;
            "sts_command" Command: stage stages samples first_ns interval_ns;
            "sts_result" Answer: angle angle_deviation pole_evidence pole_needed reason;
            "sts_detector" Table: abi size flags pwm_hz sample_at update_delay name create destroy reason step isr;
        }
        for (name, value) in [
            ("STS_ABI", ABI),
            ("STS_OFF", OFF.into()),
            ("STS_LOW", LOW.into()),
            ("STS_HIGH", HIGH.into()),
            ("STS_DUTY", DUTY.into()),
            ("STS_RISE", RISE.into()),
            ("STS_FALL", FALL.into()),
            ("STS_INTERRUPT", INTERRUPT),
            ("STS_DOUBLE_UPDATE", DOUBLE_UPDATE),
            ("STS_REENTRANT", REENTRANT),
            ("STS_FOUND", FOUND.unsigned_abs()),
            ("STS_AXIS", AXIS.unsigned_abs()),
            ("STS_FAILED", FAILED.unsigned_abs()),
            ("STS_GO_ON", GO_ON.unsigned_abs()),
            ("STS_MEASURED", 0),
            ("STS_DERIVED", 1),
            ("STS_CLIPPED", 2),
            ("STS_HIDDEN", 3),
        ] {
            all.push((name.to_owned(), value as usize));
        }
        all
    }

    /// Compiles a program that prints each size, offset and number, by C99 and by C++17, without a warning.
    #[test]
    fn cross_sizes_offsets_and_numbers_are_those_of_a_c_and_of_a_cpp_compiler() {
        let layout = layout();
        let mut source =
            "#include \"standstill.h\"\n#include <stddef.h>\n#include <stdio.h>\nint main(void) {\n"
                .to_owned();
        for (expression, _) in &layout {
            let _ = writeln!(source, "printf(\"%lu\\n\", (unsigned long)({expression}));");
        }
        source += "return 0; }\n";
        let folder = tempfile::tempdir().expect("a folder");
        let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
        for (compiler, standard, file) in
            [("cc", "-std=c99", "layout.c"), ("c++", "-std=c++17", "layout.cpp")]
        {
            std::fs::write(folder.path().join(file), &source).expect("written");
            let built = Process::new(compiler)
                .args([standard, "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I"])
                .arg(&include)
                .args([file, "-o", "layout"])
                .current_dir(folder.path())
                .output();
            // A machine with a linker for Rust has a C compiler, not always one for C++.
            let built = match built {
                Err(error) if compiler == "c++" && error.kind() == std::io::ErrorKind::NotFound => {
                    eprintln!("c++ is not installed: the header was not tried with it");
                    continue;
                }
                built => built.expect("a compiler"),
            };
            assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
            let printed = Process::new(folder.path().join("layout")).output().expect("runs").stdout;
            let printed = String::from_utf8(printed).expect("digits");
            assert_eq!(printed.lines().count(), layout.len());
            for ((expression, ours), theirs) in layout.iter().zip(printed.lines()) {
                assert_eq!(ours.to_string(), theirs, "{expression} by {compiler}");
            }
        }
    }
}
