//! FMI 2.0 for co-simulation, function by function as its headers have them (`fmi2Functions.h`, `fmi2FunctionTypes.h`).
#![allow(unsafe_code, reason = "an importer calls through pointers")]
#![allow(non_snake_case, reason = "names of the standard")]

mod without;

use std::ffi::{c_char, c_int, c_void};
use std::ptr::null_mut;

use crate::instance::{Instance, Outcome, Phase, State};
use crate::log::{c_text, folder, guarded, slice, slice_mut, text};
use crate::variables::Kind;

const OK: c_int = 0;
const ERROR: c_int = 3;

type Logger = unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...);

/// `fmi2CallbackFunctions`.
#[repr(C)]
pub struct Callbacks {
    logger: Option<Logger>,
    allocate: *const c_void,
    free: *const c_void,
    finished: *const c_void,
    environment: *mut c_void,
}

/// `fmi2Component`: an instance and whom it tells of errors.
pub struct Component {
    name: String,
    logger: Option<Logger>,
    environment: *mut c_void,
    instance: Instance,
}

fn tell(logger: Option<Logger>, environment: *mut c_void, name: &str, message: &str) {
    let Some(logger) = logger else { return };
    // The message is a format of C.
    let (name, category, message) = (c_text(name), c"error", c_text(&message.replace('%', "%%")));
    // SAFETY: the importer gave this function; all texts live until it returns, and the format asks for no arguments.
    unsafe { logger(environment, name.as_ptr(), ERROR, category.as_ptr(), message.as_ptr()) };
}

/// Does something with a component and turns what went wrong into a message and a status.
///
/// # Safety
/// A component of [`fmi2Instantiate`] that is not freed, and that nobody else uses meanwhile.
unsafe fn with(component: *mut Component, what: impl FnOnce(&mut Component) -> Outcome) -> c_int {
    // SAFETY: as the caller promises.
    let Some(component) = (unsafe { component.as_mut() }) else { return ERROR };
    let outcome = guarded(|| what(component));
    match outcome {
        Ok(()) => OK,
        Err(message) => {
            tell(component.logger, component.environment, &component.name, &message);
            ERROR
        }
    }
}

/// The types of this platform.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

/// The version of the standard.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

/// What is logged are errors only, always.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetDebugLogging(
    _: *mut Component,
    _: c_int,
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
pub unsafe extern "C" fn fmi2Instantiate(
    name: *const c_char,
    kind: c_int,
    guid: *const c_char,
    resources: *const c_char,
    callbacks: *const Callbacks,
    _visible: c_int,
    _logging: c_int,
) -> *mut Component {
    // SAFETY: as the importer promises.
    let (name, guid, resources) = unsafe { (text(name), text(guid), text(resources)) };
    // SAFETY: as the importer promises.
    let (logger, environment) = unsafe { callbacks.as_ref() }
        .map_or((None, null_mut()), |callbacks| (callbacks.logger, callbacks.environment));
    let made = guarded(|| match kind {
        1 => Instance::new(&folder(&resources), &guid),
        _ => Err("it is an FMU for co-simulation, not for model exchange".to_owned()),
    });
    match made {
        Ok(instance) => Box::into_raw(Box::new(Component { name, logger, environment, instance })),
        Err(message) => {
            tell(logger, environment, &name, &message);
            null_mut()
        }
    }
}

/// The end of an instance.
///
/// # Safety
/// A component of [`fmi2Instantiate`], or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(component: *mut Component) {
    if !component.is_null() {
        // SAFETY: it was made by `Box::into_raw`, and is freed once.
        drop(unsafe { Box::from_raw(component) });
    }
}

/// When the simulation begins.
///
/// # Safety
/// A component.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2SetupExperiment(
    component: *mut Component,
    _tolerance_defined: c_int,
    _tolerance: f64,
    start: f64,
    _stop_defined: c_int,
    _stop: f64,
) -> c_int {
    // SAFETY: as the importer promises.
    unsafe { with(component, |component| component.instance.set_start(start)) }
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
            let what: fn(&mut Instance) -> Outcome = $what;
            // SAFETY: as the importer promises.
            unsafe { with(component, |component| what(&mut component.instance)) }
        })*
    };
}

calls! {
    /// To initialization mode.
    fmi2EnterInitializationMode => Instance::enter_initialisation;
    /// To steps: here parameters that do not go together are refused.
    fmi2ExitInitializationMode => |instance| instance.exit_initialisation(Phase::Stepping);
    /// The end of the simulation.
    fmi2Terminate => Instance::terminate;
    /// As after its creation.
    fmi2Reset => |instance| { instance.reset(); Ok(()) };
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
fn whole(value: f64) -> c_int {
    value as c_int
}

values! {
    fmi2GetReal, fmi2SetReal, Kind::Real, f64, |value| value, |value| value;
    fmi2GetInteger, fmi2SetInteger, Kind::Integer, c_int, whole, f64::from;
    fmi2GetBoolean, fmi2SetBoolean, Kind::Boolean, c_int, whole, |value| f64::from(u8::from(value != 0));
}

/// A copy of all that changes.
///
/// # Safety
/// A component, and null or a state of it, which is then used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2GetFMUstate(component: *mut Component, state: *mut *mut State) -> c_int {
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
pub unsafe extern "C" fn fmi2SetFMUstate(component: *mut Component, state: *const State) -> c_int {
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
pub unsafe extern "C" fn fmi2FreeFMUstate(component: *mut Component, state: *mut *mut State) -> c_int {
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

/// A communication step.
///
/// # Safety
/// A component.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2DoStep(
    component: *mut Component,
    time: f64,
    length: f64,
    _no_set_state: c_int,
) -> c_int {
    // SAFETY: as the importer promises.
    unsafe { with(component, |component| component.instance.step(time, length)) }
}
