//! FMI 3.0 for co-simulation, function by function as its headers have them (`fmi3Functions.h`, `fmi3FunctionTypes.h`).
#![allow(unsafe_code, reason = "an importer calls through pointers")]
#![allow(non_snake_case, reason = "names of the standard")]

mod clock;
mod without;

use std::ffi::{c_char, c_int, c_void};
use std::ptr::null_mut;

use crate::exported::{
    self, ERROR, OK, deserialise, exported, free_state, freed, get, get_state, made, serialise, set,
    set_state, state_size, whole,
};
use crate::instance::{Instance, Phase, State};
use crate::log::{c_text, folder, guarded, text};
use crate::variables::Kind;

type Logger = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);

/// `fmi3Instance`: an instance, with its means of reporting errors.
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

impl exported::Component for Component {
    fn instance(&mut self) -> &mut Instance {
        &mut self.instance
    }

    fn tell(&self, message: &str) {
        tell(self.logger, self.environment, message);
    }
}

/// Returns the version of the standard.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> *const c_char {
    c"3.0".as_ptr()
}

/// Accepts any setting without effect: errors are always logged, and nothing else is.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetDebugLogging(
    _: *mut Component,
    _: bool,
    _: usize,
    _: *const *const c_char,
) -> c_int {
    OK
}

/// Returns a new instance; null, with a message, if there can be none.
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
        Ok(instance) => made(Component { logger, environment, events, instance }),
        Err(message) => {
            tell(logger, environment, &message);
            null_mut()
        }
    }
}

/// Frees an instance.
///
/// # Safety
/// The component is one of [`fmi3InstantiateCoSimulation`], or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi3FreeInstance(component: *mut Component) {
    // SAFETY: as the importer promises.
    unsafe { freed(component) };
}

/// Does nothing: there are no discrete states to evaluate.
#[unsafe(no_mangle)]
pub extern "C" fn fmi3EvaluateDiscreteStates(_: *mut Component) -> c_int {
    OK
}

type References = *const u32;

exported! {
    /// To initialization mode.
    fmi3EnterInitializationMode(tolerance_defined: bool, tolerance: f64, start: f64, _stop_defined: bool, _stop: f64) =>
        |component| {
            component.instance.set_tolerance(tolerance_defined.then_some(tolerance))?;
            component.instance.set_start(start)?;
            component.instance.enter_initialisation()
        };
    /// To the event at the begin, or to steps where the importer handles no events.
    fmi3ExitInitializationMode() => |component| {
        let to = if component.events { Phase::AtEvent } else { Phase::Stepping };
        component.instance.exit_initialisation(to)
    };
    /// To an event.
    fmi3EnterEventMode() => |component| component.instance.enter(Phase::AtEvent);
    /// An event is over at once: nothing follows from it before the next step.
    fmi3UpdateDiscreteStates(needs_update: *mut bool, terminate: *mut bool, nominals_changed: *mut bool,
        values_changed: *mut bool, next_event_defined: *mut bool, next_event: *mut f64) => |component| {
        for place in [needs_update, terminate, nominals_changed, values_changed, next_event_defined] {
            put(place, false);
        }
        put(next_event, 0.0);
        // The tick is over with the event.
        component.instance.state.tick = false;
        Ok(())
    };
    /// To steps.
    fmi3EnterStepMode() => |component| component.instance.enter(Phase::Stepping);
    /// A communication step.
    fmi3DoStep(time: f64, length: f64, _no_set_state: bool, event_needed: *mut bool, terminate: *mut bool,
        early_return: *mut bool, last_time: *mut f64) => |component| {
        let outcome = component.instance.step(time, length);
        for place in [event_needed, terminate, early_return] {
            put(place, false);
        }
        put(last_time, component.instance.time());
        outcome
    };
    /// The end of the simulation.
    fmi3Terminate() => |component| component.instance.terminate();
    /// Resets the instance to its state after creation.
    fmi3Reset() => |component| { component.instance.reset(); Ok(()) };
    /// Values of numbers.
    fmi3GetFloat64(references: References, count: usize, values: *mut f64, _all: usize) =>
        get(&[Kind::Real], |value| value, (references, count, values));
    /// Sets numbers.
    fmi3SetFloat64(references: References, count: usize, values: *const f64, _all: usize) =>
        set(&[Kind::Real], |value| value, (references, count, values));
    /// Values of whole numbers.
    fmi3GetInt32(references: References, count: usize, values: *mut i32, _all: usize) =>
        get(&[Kind::Integer], whole, (references, count, values));
    /// Sets whole numbers.
    fmi3SetInt32(references: References, count: usize, values: *const i32, _all: usize) =>
        set(&[Kind::Integer], f64::from, (references, count, values));
    /// Values of enumerations.
    fmi3GetInt64(references: References, count: usize, values: *mut i64, _all: usize) =>
        get(&[Kind::Mode], |value| whole(value).into(), (references, count, values));
    /// Sets enumerations.
    fmi3SetInt64(references: References, count: usize, values: *const i64, _all: usize) =>
        set(&[Kind::Mode], number, (references, count, values));
    /// Values of flags.
    fmi3GetBoolean(references: References, count: usize, values: *mut bool, _all: usize) =>
        get(&[Kind::Boolean], |value| value != 0.0, (references, count, values));
    /// Sets flags.
    fmi3SetBoolean(references: References, count: usize, values: *const bool, _all: usize) =>
        set(&[Kind::Boolean], |value| f64::from(u8::from(value)), (references, count, values));
    /// A copy of all that changes.
    fmi3GetFMUState(state: *mut *mut State) => get_state(state);
    /// Back to a copy.
    fmi3SetFMUState(state: *const State) => set_state(state);
    /// The end of a copy.
    fmi3FreeFMUState(state: *mut *mut State) => free_state(state);
    /// How many bytes a copy has.
    fmi3SerializedFMUStateSize(state: *const State, size: *mut usize) => state_size(state, size);
    /// A copy as bytes, which another instance of the FMU takes, on any machine and on any day.
    fmi3SerializeFMUState(state: *const State, bytes: *mut u8, size: usize) => serialise(state, (bytes, size));
    /// A copy from bytes: what its machine was told is simulated again.
    fmi3DeserializeFMUState(bytes: *const u8, size: usize, state: *mut *mut State) => deserialise((bytes, size), state);
}

#[allow(clippy::cast_precision_loss, reason = "what is no mode is refused, near one or not")]
fn number(value: i64) -> f64 {
    value as f64
}

/// Puts a value where the importer wants it, if it does.
///
/// # Safety
/// A place, or null.
unsafe fn put<T>(place: *mut T, value: T) {
    // SAFETY: as the caller promises.
    if let Some(place) = unsafe { place.as_mut() } {
        *place = value;
    }
}
