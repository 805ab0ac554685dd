//! The clock of the PWM period.

use std::ffi::c_int;

use super::{Component, with};
use crate::instance::Outcome;
use crate::log::{slice, slice_mut};
use crate::variables::Kind;

/// Whether the clock ticks now.
///
/// # Safety
/// A component, and arrays of so many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetClock(
    component: *mut Component,
    references: *const u32,
    count: usize,
    values: *mut bool,
) -> c_int {
    // SAFETY: as the importer promises.
    unsafe {
        with(component, |component| {
            for (reference, value) in slice(references, count).iter().zip(slice_mut(values, count)) {
                *value = component.instance.get(*reference, Kind::Clock)? != 0.0;
            }
            Ok(())
        })
    }
}

/// The importer, which knows the time, lets the clock tick.
///
/// # Safety
/// A component, and arrays of so many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetClock(
    component: *mut Component,
    references: *const u32,
    count: usize,
    values: *const bool,
) -> c_int {
    // SAFETY: as the importer promises.
    unsafe {
        with(component, |component| {
            for (reference, value) in slice(references, count).iter().zip(slice(values, count)) {
                clock(component, *reference)?;
                component.instance.state.tick = *value;
            }
            Ok(())
        })
    }
}

fn clock(component: &Component, reference: u32) -> Outcome {
    if component.instance.is_clock(reference) {
        Ok(())
    } else {
        Err(format!("value reference: found {reference}, needed that of a clock"))
    }
}

/// The period of the clock in s.
///
/// # Safety
/// A component, and arrays of so many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetIntervalDecimal(
    component: *mut Component,
    references: *const u32,
    count: usize,
    intervals: *mut f64,
    qualifiers: *mut c_int,
) -> c_int {
    const UNCHANGED: c_int = 1;
    // SAFETY: as the importer promises.
    unsafe {
        with(component, |component| {
            let places = slice_mut(intervals, count).iter_mut().zip(slice_mut(qualifiers, count));
            for (reference, (interval, qualifier)) in slice(references, count).iter().zip(places) {
                clock(component, *reference)?;
                (*interval, *qualifier) = (component.instance.period(), UNCHANGED);
            }
            Ok(())
        })
    }
}

/// It ticks at the start of the simulation.
///
/// # Safety
/// A component, and arrays of so many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetShiftDecimal(
    component: *mut Component,
    references: *const u32,
    count: usize,
    shifts: *mut f64,
) -> c_int {
    // SAFETY: as the importer promises.
    unsafe {
        with(component, |component| {
            for (reference, shift) in slice(references, count).iter().zip(slice_mut(shifts, count)) {
                clock(component, *reference)?;
                *shift = 0.0;
            }
            Ok(())
        })
    }
}
