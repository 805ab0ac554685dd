//! FMI 2.0 for co-simulation, function by function as its headers have them (`fmi2Functions.h`, `fmi2FunctionTypes.h`).
#![allow(unsafe_code, reason = "an importer calls through pointers")]
#![allow(non_snake_case, reason = "names of the standard")]

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

/// `fmi2Component`: an instance, with its means of reporting errors.
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

impl exported::Component for Component {
    fn instance(&mut self) -> &mut Instance {
        &mut self.instance
    }

    fn tell(&self, message: &str) {
        tell(self.logger, self.environment, &self.name, message);
    }
}

/// Returns the types of this platform.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    c"default".as_ptr()
}

/// Returns the version of the standard.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    c"2.0".as_ptr()
}

/// Accepts any setting without effect: errors are always logged, and nothing else is.
#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetDebugLogging(
    _: *mut Component,
    _: c_int,
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
    let instance = guarded(|| match kind {
        1 => Instance::new(&folder(&resources), &guid),
        _ => Err("it is an FMU for co-simulation, not for model exchange".to_owned()),
    });
    match instance {
        Ok(instance) => made(Component { name, logger, environment, instance }),
        Err(message) => {
            tell(logger, environment, &name, &message);
            null_mut()
        }
    }
}

/// Frees an instance.
///
/// # Safety
/// The component is one of [`fmi2Instantiate`], or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn fmi2FreeInstance(component: *mut Component) {
    // SAFETY: as the importer promises.
    unsafe { freed(component) };
}

type References = *const u32;

/// The kinds that are whole numbers to this version.
const WHOLE: [Kind; 2] = [Kind::Integer, Kind::Mode];

exported! {
    /// When the simulation begins, and how exact it has to be.
    fmi2SetupExperiment(tolerance_defined: c_int, tolerance: f64, start: f64, _stop_defined: c_int, _stop: f64) =>
        |component| {
            component.instance.set_tolerance((tolerance_defined != 0).then_some(tolerance))?;
            component.instance.set_start(start)
        };
    /// To initialization mode.
    fmi2EnterInitializationMode() => |component| component.instance.enter_initialisation();
    /// To steps: here parameters that do not go together are refused.
    fmi2ExitInitializationMode() => |component| component.instance.exit_initialisation(Phase::Stepping);
    /// A communication step.
    fmi2DoStep(time: f64, length: f64, _no_set_state: c_int) => |component| component.instance.step(time, length);
    /// The end of the simulation.
    fmi2Terminate() => |component| component.instance.terminate();
    /// Resets the instance to its state after creation.
    fmi2Reset() => |component| { component.instance.reset(); Ok(()) };
    /// Values of numbers.
    fmi2GetReal(references: References, count: usize, values: *mut f64) =>
        get(&[Kind::Real], |value| value, (references, count, values));
    /// Sets numbers.
    fmi2SetReal(references: References, count: usize, values: *const f64) =>
        set(&[Kind::Real], |value| value, (references, count, values));
    /// Values of whole numbers.
    fmi2GetInteger(references: References, count: usize, values: *mut c_int) =>
        get(&WHOLE, whole, (references, count, values));
    /// Sets whole numbers.
    fmi2SetInteger(references: References, count: usize, values: *const c_int) =>
        set(&WHOLE, f64::from, (references, count, values));
    /// Values of flags.
    fmi2GetBoolean(references: References, count: usize, values: *mut c_int) =>
        get(&[Kind::Boolean], whole, (references, count, values));
    /// Sets flags.
    fmi2SetBoolean(references: References, count: usize, values: *const c_int) =>
        set(&[Kind::Boolean], |value| f64::from(u8::from(value != 0)), (references, count, values));
    /// A copy of all that changes.
    fmi2GetFMUstate(state: *mut *mut State) => get_state(state);
    /// Back to a copy.
    fmi2SetFMUstate(state: *const State) => set_state(state);
    /// The end of a copy.
    fmi2FreeFMUstate(state: *mut *mut State) => free_state(state);
    /// How many bytes a copy has.
    fmi2SerializedFMUstateSize(state: *const State, size: *mut usize) => state_size(state, size);
    /// A copy as bytes, which another instance of the FMU takes, on any machine and on any day.
    fmi2SerializeFMUstate(state: *const State, bytes: *mut u8, size: usize) => serialise(state, (bytes, size));
    /// A copy from bytes: what its machine was told is simulated again.
    fmi2DeSerializeFMUstate(bytes: *const u8, size: usize, state: *mut *mut State) => deserialise((bytes, size), state);
}
