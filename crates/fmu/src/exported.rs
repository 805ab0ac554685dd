//! Common code of the functions of both versions, and the macro that exports them.
#![allow(unsafe_code, reason = "an importer calls through pointers")]

use std::ffi::c_int;
use std::ptr::null_mut;

use crate::instance::{Instance, Outcome, State};
use crate::log::{guarded, slice, slice_mut};
use crate::variables::Kind;

pub const OK: c_int = 0;
pub const ERROR: c_int = 3;

/// An instance of a version of the standard, with its means of reporting errors.
pub trait Component {
    /// Returns the instance.
    fn instance(&mut self) -> &mut Instance;
    /// Reports an error to the importer.
    fn tell(&self, message: &str);
}

/// Exports functions of the standard. Each is given with its action on a component, either in full or by one of the
/// functions below.
macro_rules! exported {
    ($($(#[$doc:meta])* $name:ident($($argument:ident: $type:ty),*) => $do:expr;)*) => {
        $($(#[$doc])*
        ///
        /// # Safety
        /// A component that is not freed and that nobody else uses meanwhile; places and arrays of so many values, or null.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(component: *mut Component $(, $argument: $type)*) -> c_int {
            // SAFETY: as the importer promises.
            unsafe { $crate::exported::with(component, $do) }
        })*
    };
}
pub(crate) use exported;

/// Functions of kinds of values that there are none of, and of abilities that the description does not claim.
macro_rules! without {
    ($($what:literal: $($name:ident($($type:ty),*)),*;)*) => {
        $($(/// Not claimed by the description; an error.
        ///
        /// # Safety
        /// A component.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(component: *mut Component $(, _: $type)*) -> c_int {
            // SAFETY: as the importer promises.
            unsafe { $crate::exported::with(component, |_| Err(concat!("it has no ", $what).to_owned())) }
        })*)*
    };
}
pub(crate) use without;

/// Applies an action to a component. An error becomes a message and a status.
///
/// # Safety
/// The component is not freed, and no other code uses it during the call.
pub unsafe fn with<C: Component>(component: *mut C, what: impl FnOnce(&mut C) -> Outcome) -> c_int {
    // SAFETY: as the caller promises.
    let Some(component) = (unsafe { component.as_mut() }) else { return ERROR };
    match guarded(|| what(component)) {
        Ok(()) => OK,
        Err(message) => {
            component.tell(&message);
            ERROR
        }
    }
}

/// Returns a component for the importer to keep.
pub fn made<C>(component: C) -> *mut C {
    Box::into_raw(Box::new(component))
}

/// Frees a component.
///
/// # Safety
/// The component is one of [`made`], or null.
pub unsafe fn freed<C>(component: *mut C) {
    if !component.is_null() {
        // SAFETY: it was made by `Box::into_raw`, and is freed once.
        drop(unsafe { Box::from_raw(component) });
    }
}

/// Returns the values of variables of these kinds.
///
/// # Safety
/// Arrays of so many, or null.
pub unsafe fn get<C: Component, T>(
    kinds: &'static [Kind],
    from: fn(f64) -> T,
    (references, count, values): (*const u32, usize, *mut T),
) -> impl FnOnce(&mut C) -> Outcome {
    move |component| {
        // SAFETY: as the caller promises.
        let (references, values) = unsafe { (slice(references, count), slice_mut(values, count)) };
        for (reference, value) in references.iter().zip(values) {
            *value = from(component.instance().get(*reference, kinds)?);
        }
        Ok(())
    }
}

/// Sets variables of these kinds.
///
/// # Safety
/// Arrays of so many, or null.
pub unsafe fn set<C: Component, T: Copy>(
    kinds: &'static [Kind],
    to: fn(T) -> f64,
    (references, count, values): (*const u32, usize, *const T),
) -> impl FnOnce(&mut C) -> Outcome {
    move |component| {
        // SAFETY: as the caller promises.
        let (references, values) = unsafe { (slice(references, count), slice(values, count)) };
        for (reference, value) in references.iter().zip(values) {
            component.instance().set(*reference, kinds, to(*value))?;
        }
        Ok(())
    }
}

#[allow(clippy::cast_possible_truncation, reason = "values of integers fit into them")]
pub fn whole(value: f64) -> c_int {
    value as c_int
}

/// Returns a copy of all that changes.
///
/// # Safety
/// A place with null or a state of the component, which is then used again.
pub unsafe fn get_state<C: Component>(state: *mut *mut State) -> impl FnOnce(&mut C) -> Outcome {
    move |component| {
        let copy = component.instance().state.clone();
        // SAFETY: as the caller promises.
        unsafe { kept(copy, state) }
    }
}

/// Restores the state of a component from a copy.
///
/// # Safety
/// `state` is a state of the component, or null.
pub unsafe fn set_state<C: Component>(state: *const State) -> impl FnOnce(&mut C) -> Outcome {
    move |component| {
        // SAFETY: as the caller promises.
        component.instance().state = unsafe { state.as_ref() }.ok_or("a state: there is none")?.clone();
        Ok(())
    }
}

/// Returns the end of a copy.
///
/// # Safety
/// A place with null or a state of the component; it is null afterwards.
pub unsafe fn free_state<C: Component>(state: *mut *mut State) -> impl FnOnce(&mut C) -> Outcome {
    move |_| {
        // SAFETY: as the caller promises; states are made by `Box::into_raw`.
        unsafe {
            if let Some(place) = state.as_mut() {
                freed(std::mem::replace(place, null_mut()));
            }
        }
        Ok(())
    }
}

/// How many bytes a state has.
///
/// # Safety
/// A state of the component, or null; a place, or null.
pub unsafe fn state_size<C: Component>(
    state: *const State,
    size: *mut usize,
) -> impl FnOnce(&mut C) -> Outcome {
    move |component| {
        // SAFETY: as the caller promises.
        let (state, size) = unsafe { (state.as_ref(), size.as_mut()) };
        let (Some(state), Some(size)) = (state, size) else {
            return Err("the size of a state: none is given".to_owned());
        };
        *size = component.instance().serialised(state)?.len();
        Ok(())
    }
}

/// A state as bytes.
///
/// # Safety
/// A state of the component, or null; so many bytes, or null.
pub unsafe fn serialise<C: Component>(
    state: *const State,
    (bytes, size): (*mut u8, usize),
) -> impl FnOnce(&mut C) -> Outcome {
    move |component| {
        // SAFETY: as the caller promises.
        let (state, place) = unsafe { (state.as_ref(), slice_mut(bytes, size)) };
        let all = component.instance().serialised(state.ok_or("a state as bytes: there is none")?)?;
        let Some(place) = place.get_mut(..all.len()) else {
            return Err(format!("a state as bytes: found room for {size} bytes, needed {}", all.len()));
        };
        place.copy_from_slice(&all);
        Ok(())
    }
}

/// A state from bytes.
///
/// # Safety
/// So many bytes, or null; a place with null or a state of the component, which is then used again.
pub unsafe fn deserialise<C: Component>(
    (bytes, size): (*const u8, usize),
    state: *mut *mut State,
) -> impl FnOnce(&mut C) -> Outcome {
    move |component| {
        // SAFETY: as the caller promises.
        let restored = component.instance().deserialised(unsafe { slice(bytes, size) })?;
        // SAFETY: as the caller promises.
        unsafe { kept(restored, state) }
    }
}

/// Puts a state where the importer keeps it.
///
/// # Safety
/// A place with null or a state of the component, which is then used again.
unsafe fn kept(state: State, place: *mut *mut State) -> Outcome {
    // SAFETY: as the caller promises.
    let place = unsafe { place.as_mut() }.ok_or("a state: no place for it")?;
    // SAFETY: as the caller promises.
    match unsafe { place.as_mut() } {
        Some(there) => *there = state,
        None => *place = Box::into_raw(Box::new(state)),
    }
    Ok(())
}
