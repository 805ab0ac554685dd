//! FMI 3.0 for co-simulation, function by function as its headers have them (`fmi3Functions.h`, `fmi3FunctionTypes.h`).
#![allow(unsafe_code, reason = "an importer calls through pointers")]
#![allow(non_snake_case, reason = "names of the standard")]

mod clock;
mod without;

use std::ffi::{c_char, c_int, c_void};
use std::ptr::null_mut;

use crate::instance::{Instance, Outcome, Phase, State};
use crate::log::{c_text, folder, guarded, slice, slice_mut, text};
use crate::variables::Kind;

const OK: c_int = 0;
const ERROR: c_int = 3;

type Logger = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);

/// `fmi3Instance`: an instance and whom it tells of errors.
pub struct Component {
    logger: Option<Logger>,
    environment: *mut c_void,
    /// Whether the importer handles events, and with them the clock.
    events: bool,
    instance: Instance,
}

fn tell(logger: Option<Logger>, environment: *mut c_void, message: &str) {
    let Some(logger) = logger else { return };
    let message = c_text(message);
    // SAFETY: the importer gave this function; all texts live until it returns.
    unsafe { logger(environment, ERROR, c"error".as_ptr(), message.as_ptr()) };
}

/// Does something with a component and turns what went wrong into a message and a status.
///
/// # Safety
/// A component of [`fmi3InstantiateCoSimulation`] that is not freed, and that nobody else uses meanwhile.
unsafe fn with(component: *mut Component, what: impl FnOnce(&mut Component) -> Outcome) -> c_int {
    // SAFETY: as the caller promises.
    let Some(component) = (unsafe { component.as_mut() }) else { return ERROR };
    match guarded(|| what(component)) {
        Ok(()) => OK,
        Err(message) => {
            tell(component.logger, component.environment, &message);
            ERROR
        }
    }
}

/// The version of the standard.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

/// What is logged are errors only, always.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetDebugLogging(
    _: *mut Component,
    _: bool,
    _: usize,
    _: *const *const c_char,
) -> c_int {
    OK
}

/// A new instance; null, with a message, if there can be none.
///
/// # Safety
/// Pointers as the standard has them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
    _name: *const c_char,
    token: *const c_char,
    resources: *const c_char,
    _visible: bool,
    _logging: bool,
    events: bool,
    _early_return: bool,
    _intermediate: *const u32,
    _intermediate_count: usize,
    environment: *mut c_void,
    logger: Option<Logger>,
    _update: *const c_void,
) -> *mut Component {
    // SAFETY: as the importer promises.
    let (token, resources) = unsafe { (text(token), text(resources)) };
    match guarded(|| Instance::new(&folder(&resources), &token)) {
        Ok(instance) => Box::into_raw(Box::new(Component { logger, environment, events, instance })),
        Err(message) => {
            tell(logger, environment, &message);
            null_mut()
        }
    }
}

/// The end of an instance.
///
/// # Safety
/// A component of [`fmi3InstantiateCoSimulation`], or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(component: *mut Component) {
    if !component.is_null() {
        // SAFETY: it was made by `Box::into_raw`, and is freed once.
        drop(unsafe { Box::from_raw(component) });
    }
}

/// To initialization mode.
///
/// # Safety
/// A component.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3EnterInitializationMode(
    component: *mut Component,
    _tolerance_defined: bool,
    _tolerance: f64,
    start: f64,
    _stop_defined: bool,
    _stop: f64,
) -> c_int {
    // SAFETY: as the importer promises.
    unsafe {
        with(component, |component| {
            component.instance.set_start(start)?;
            component.instance.enter_initialisation()
        })
    }
}

/// Calls of one argument.
macro_rules! calls {
    ($($(#[$doc:meta])* $name:ident => $what:expr;)*) => {
        $($(#[$doc])*
        ///
        /// # Safety
        /// A component.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(component: *mut Component) -> c_int {
            let what: fn(&mut Component) -> Outcome = $what;
            // SAFETY: as the importer promises.
            unsafe { with(component, what) }
        })*
    };
}

calls! {
    /// To the event at the begin, or to steps where the importer handles no events.
    fmi3ExitInitializationMode => |component| {
        let to = if component.events { Phase::AtEvent } else { Phase::Stepping };
        component.instance.exit_initialisation(to)
    };
    /// To an event.
    fmi3EnterEventMode => |component| component.instance.enter(Phase::AtEvent);
    /// To steps.
    fmi3EnterStepMode => |component| component.instance.enter(Phase::Stepping);
    /// The end of the simulation.
    fmi3Terminate => |component| component.instance.terminate();
    /// As after its creation.
    fmi3Reset => |component| { component.instance.reset(); Ok(()) };
}

/// Getters and setters of one kind of values.
macro_rules! values {
    ($($get:ident, $set:ident, $kind:expr, $type:ty, $from:expr, $to:expr;)*) => {
        $(/// Values of variables.
        ///
        /// # Safety
        /// A component, and arrays of so many.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $get(
            component: *mut Component,
            references: *const u32,
            count: usize,
            values: *mut $type,
            _: usize,
        ) -> c_int {
            let from: fn(f64) -> $type = $from;
            // SAFETY: as the importer promises.
            unsafe {
                with(component, |component| {
                    let values = slice_mut(values, count);
                    for (reference, value) in slice(references, count).iter().zip(values) {
                        *value = from(component.instance.get(*reference, $kind)?);
                    }
                    Ok(())
                })
            }
        }

        /// Sets variables.
        ///
        /// # Safety
        /// A component, and arrays of so many.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $set(
            component: *mut Component,
            references: *const u32,
            count: usize,
            values: *const $type,
            _: usize,
        ) -> c_int {
            let to: fn($type) -> f64 = $to;
            // SAFETY: as the importer promises.
            unsafe {
                with(component, |component| {
                    for (reference, value) in slice(references, count).iter().zip(slice(values, count)) {
                        component.instance.set(*reference, $kind, to(*value))?;
                    }
                    Ok(())
                })
            }
        })*
    };
}

#[allow(clippy::cast_possible_truncation, reason = "values of integers fit into them")]
fn whole(value: f64) -> i32 {
    value as i32
}

values! {
    fmi3GetFloat64, fmi3SetFloat64, Kind::Real, f64, |value| value, |value| value;
    fmi3GetInt32, fmi3SetInt32, Kind::Integer, i32, whole, f64::from;
    fmi3GetBoolean, fmi3SetBoolean, Kind::Boolean, bool, |value| value != 0.0, |value| f64::from(u8::from(value));
}

/// An event is over at once: nothing follows from it before the next step.
///
/// # Safety
/// A component and places.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3UpdateDiscreteStates(
    component: *mut Component,
    needs_update: *mut bool,
    terminate: *mut bool,
    nominals_changed: *mut bool,
    values_changed: *mut bool,
    next_event_defined: *mut bool,
    next_event: *mut f64,
) -> c_int {
    // SAFETY: as the importer promises.
    unsafe {
        with(component, |component| {
            for place in [needs_update, terminate, nominals_changed, values_changed, next_event_defined] {
                if let Some(place) = place.as_mut() {
                    *place = false;
                }
            }
            if let Some(place) = next_event.as_mut() {
                *place = 0.0;
            }
            // The tick is over with the event.
            component.instance.state.tick = false;
            Ok(())
        })
    }
}

/// Nothing to do.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3EvaluateDiscreteStates(_: *mut Component) -> c_int {
    OK
}

/// A communication step.
///
/// # Safety
/// A component and places.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3DoStep(
    component: *mut Component,
    time: f64,
    length: f64,
    _no_set_state: bool,
    event_needed: *mut bool,
    terminate: *mut bool,
    early_return: *mut bool,
    last_time: *mut f64,
) -> c_int {
    // SAFETY: as the importer promises.
    unsafe {
        with(component, |component| {
            let outcome = component.instance.step(time, length);
            for place in [event_needed, terminate, early_return] {
                if let Some(place) = place.as_mut() {
                    *place = false;
                }
            }
            if let Some(place) = last_time.as_mut() {
                *place = component.instance.time();
            }
            outcome
        })
    }
}

/// A copy of all that changes.
///
/// # Safety
/// A component, and null or a state of it, which is then used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3GetFMUState(component: *mut Component, state: *mut *mut State) -> c_int {
    // SAFETY: as the importer promises.
    unsafe {
        with(component, |component| {
            let place = state.as_mut().ok_or("a state: no place for it")?;
            let copy = component.instance.state.clone();
            match place.as_mut() {
                Some(there) => *there = copy,
                None => *place = Box::into_raw(Box::new(copy)),
            }
            Ok(())
        })
    }
}

/// Back to a copy.
///
/// # Safety
/// A component and a state of it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3SetFMUState(component: *mut Component, state: *const State) -> c_int {
    // SAFETY: as the importer promises.
    unsafe {
        with(component, |component| {
            component.instance.state = state.as_ref().ok_or("a state: there is none")?.clone();
            Ok(())
        })
    }
}

/// The end of a copy.
///
/// # Safety
/// A component and a state of it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeFMUState(component: *mut Component, state: *mut *mut State) -> c_int {
    // SAFETY: as the importer promises; states are made by `Box::into_raw`, and the pointer is null afterwards.
    unsafe {
        with(component, |_| {
            if let Some(place) = state.as_mut()
                && !place.is_null()
            {
                drop(Box::from_raw(std::mem::replace(place, null_mut())));
            }
            Ok(())
        })
    }
}
