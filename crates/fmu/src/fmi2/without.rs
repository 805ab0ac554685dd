//! Functions that the standard requires but that have no effect here: texts, asynchronous steps, derivatives.

use std::ffi::{c_char, c_int};
use std::ptr::null;

use super::{Component, OK};
use crate::exported::{exported, without};
use crate::instance::Outcome;

const DISCARD: c_int = 2;

exported! {
    /// There are no texts.
    fmi2GetString(_references: *const u32, count: usize, _values: *mut *const c_char) => |_| no_texts(count);
    /// There are no texts.
    fmi2SetString(_references: *const u32, count: usize, _values: *const *const c_char) => |_| no_texts(count);
}

fn no_texts(count: usize) -> Outcome {
    if count == 0 { Ok(()) } else { Err("it has no text".to_owned()) }
}

without! {
    "derivatives":
        fmi2GetDirectionalDerivative(*const u32, usize, *const u32, usize, *const f64, *mut f64);
    "derivatives of inputs": fmi2SetRealInputDerivatives(*const u32, usize, *const c_int, *const f64);
    "derivatives of outputs": fmi2GetRealOutputDerivatives(*const u32, usize, *const c_int, *mut f64);
    "steps that go on by themselves": fmi2CancelStep();
}

/// Defines the status functions of asynchronous steps, which do not exist here.
macro_rules! statuses {
    ($($name:ident, $type:ty;)*) => {
        $(/// Nothing is pending.
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(_: *mut Component, _: c_int, _: *mut $type) -> c_int {
            DISCARD
        })*
    };
}

statuses! {
    fmi2GetStatus, c_int;
    fmi2GetIntegerStatus, c_int;
    fmi2GetBooleanStatus, c_int;
}

/// Returns the time of the last communication point.
///
/// # Safety
/// A component and a place.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetRealStatus(component: *mut Component, kind: c_int, value: *mut f64) -> c_int {
    const LAST_SUCCESSFUL_TIME: c_int = 2;
    // SAFETY: as the importer promises.
    unsafe {
        match (component.as_ref(), value.as_mut()) {
            (Some(component), Some(value)) if kind == LAST_SUCCESSFUL_TIME => {
                *value = component.instance.time();
                OK
            }
            _ => DISCARD,
        }
    }
}

/// Returns no text, because no step is pending.
///
/// # Safety
/// `value` is a place for a text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetStringStatus(
    _: *mut Component,
    _: c_int,
    value: *mut *const c_char,
) -> c_int {
    // SAFETY: as the importer promises.
    if let Some(value) = unsafe { value.as_mut() } {
        *value = null();
    }
    DISCARD
}
