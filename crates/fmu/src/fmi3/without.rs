//! Functions that the standard wants and that have nothing to do here: other kinds of FMUs, of values and of abilities.

use std::ffi::{c_char, c_int, c_void};
use std::ptr::null_mut;

use super::{Component, Logger, tell};
use crate::exported::without;

/// Refuses the instance: the FMU supports co-simulation only.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateModelExchange(
    _: *const c_char,
    _: *const c_char,
    _: *const c_char,
    _: bool,
    _: bool,
    environment: *mut c_void,
    logger: Option<Logger>,
) -> *mut Component {
    tell(logger, environment, "it is an FMU for co-simulation, not for model exchange");
    null_mut()
}

/// Refuses the instance: the FMU supports co-simulation only.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateScheduledExecution(
    _: *const c_char,
    _: *const c_char,
    _: *const c_char,
    _: bool,
    _: bool,
    environment: *mut c_void,
    logger: Option<Logger>,
    _: *const c_void,
    _: *const c_void,
    _: *const c_void,
) -> *mut Component {
    tell(logger, environment, "it is an FMU for co-simulation, not for scheduled execution");
    null_mut()
}

type References = *const u32;

without! {
    "values of this kind":
        fmi3GetFloat32(References, usize, *mut f32, usize), fmi3SetFloat32(References, usize, *const f32, usize),
        fmi3GetInt8(References, usize, *mut i8, usize), fmi3SetInt8(References, usize, *const i8, usize),
        fmi3GetUInt8(References, usize, *mut u8, usize), fmi3SetUInt8(References, usize, *const u8, usize),
        fmi3GetInt16(References, usize, *mut i16, usize), fmi3SetInt16(References, usize, *const i16, usize),
        fmi3GetUInt16(References, usize, *mut u16, usize), fmi3SetUInt16(References, usize, *const u16, usize),
        fmi3GetUInt32(References, usize, *mut u32, usize), fmi3SetUInt32(References, usize, *const u32, usize),
        fmi3GetUInt64(References, usize, *mut u64, usize), fmi3SetUInt64(References, usize, *const u64, usize),
        fmi3GetString(References, usize, *mut *const c_char, usize),
        fmi3SetString(References, usize, *const *const c_char, usize),
        fmi3GetBinary(References, usize, *mut usize, *mut *const u8, usize),
        fmi3SetBinary(References, usize, *const usize, *const *const u8, usize);
    "clocks that the importer could change":
        fmi3GetIntervalFraction(References, usize, *mut u64, *mut u64, *mut c_int),
        fmi3GetShiftFraction(References, usize, *mut u64, *mut u64),
        fmi3SetIntervalDecimal(References, usize, *const f64),
        fmi3SetIntervalFraction(References, usize, *const u64, *const u64),
        fmi3SetShiftDecimal(References, usize, *const f64),
        fmi3SetShiftFraction(References, usize, *const u64, *const u64),
        fmi3ActivateModelPartition(u32, f64);
    "dependencies that it tells":
        fmi3GetNumberOfVariableDependencies(u32, *mut usize),
        fmi3GetVariableDependencies(u32, *mut usize, *mut u32, *mut usize, *mut c_int, usize);
    "derivatives":
        fmi3GetDirectionalDerivative(References, usize, References, usize, *const f64, usize, *mut f64, usize),
        fmi3GetAdjointDerivative(References, usize, References, usize, *const f64, usize, *mut f64, usize),
        fmi3GetOutputDerivatives(References, usize, *const i32, *mut f64, usize);
    "structural parameters":
        fmi3EnterConfigurationMode(), fmi3ExitConfigurationMode();
    "model exchange":
        fmi3EnterContinuousTimeMode(), fmi3CompletedIntegratorStep(bool, *mut bool, *mut bool), fmi3SetTime(f64),
        fmi3SetContinuousStates(*const f64, usize), fmi3GetContinuousStates(*mut f64, usize),
        fmi3GetContinuousStateDerivatives(*mut f64, usize), fmi3GetEventIndicators(*mut f64, usize),
        fmi3GetNominalsOfContinuousStates(*mut f64, usize), fmi3GetNumberOfEventIndicators(*mut usize),
        fmi3GetNumberOfContinuousStates(*mut usize);
}
