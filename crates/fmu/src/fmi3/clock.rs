//! The clock of the PWM period.

use std::ffi::c_int;

use super::{Component, References};
use crate::exported::{exported, get};
use crate::instance::Outcome;
use crate::log::{slice, slice_mut};
use crate::variables::Kind;

exported! {
    /// Whether the clock ticks now.
    fmi3GetClock(references: References, count: usize, values: *mut bool) =>
        get(&[Kind::Clock], |value| value != 0.0, (references, count, values));
    /// The importer, which knows the time, lets the clock tick.
    fmi3SetClock(references: References, count: usize, values: *const bool) => |component| {
        for (reference, value) in slice(references, count).iter().zip(slice(values, count)) {
            clock(component, *reference)?;
            component.instance.state.tick = *value;
        }
        Ok(())
    };
    /// The period of the clock in s.
    fmi3GetIntervalDecimal(references: References, count: usize, intervals: *mut f64, qualifiers: *mut c_int) =>
        |component| {
            const UNCHANGED: c_int = 1;
            let places = slice_mut(intervals, count).iter_mut().zip(slice_mut(qualifiers, count));
            for (reference, (interval, qualifier)) in slice(references, count).iter().zip(places) {
                clock(component, *reference)?;
                (*interval, *qualifier) = (component.instance.period(), UNCHANGED);
            }
            Ok(())
        };
    /// It ticks at the start of the simulation.
    fmi3GetShiftDecimal(references: References, count: usize, shifts: *mut f64) => |component| {
        for (reference, shift) in slice(references, count).iter().zip(slice_mut(shifts, count)) {
            clock(component, *reference)?;
            *shift = 0.0;
        }
        Ok(())
    };
}

fn clock(component: &Component, reference: u32) -> Outcome {
    if component.instance.is_clock(reference) {
        Ok(())
    } else {
        Err(format!("value reference: found {reference}, needed that of a clock"))
    }
}
