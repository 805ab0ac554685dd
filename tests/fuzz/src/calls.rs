//! Calls of an FMU's importer, by the functions of FMI 3.0: in any order, with any arguments that the standard's types
//! allow, and with states from any bytes.
#![allow(unsafe_code, reason = "an importer calls through pointers")]

mod instance;

use std::path::Path;
use std::ptr::null_mut;
use std::sync::OnceLock;

use standstill_fmu::{Model, Part};
use standstill_scenario::Document;
use tempfile::TempDir;

use self::instance::{
    Handle, Instance, fmi3DeserializeFMUState, fmi3DoStep, fmi3EnterEventMode, fmi3EnterInitializationMode,
    fmi3EnterStepMode, fmi3ExitInitializationMode, fmi3FreeFMUState, fmi3GetFMUState, fmi3GetFloat64,
    fmi3GetInt32, fmi3GetInt64, fmi3Reset, fmi3SerializeFMUState, fmi3SerializedFMUStateSize, fmi3SetBoolean,
    fmi3SetFMUState, fmi3SetFloat64, fmi3SetInt32, fmi3SetInt64, fmi3Terminate,
};
use crate::{Fields, text};

/// Resources of an FMU in a folder, as an importer has unpacked them.
struct Unpacked {
    model: Model,
    folder: TempDir,
}

fn unpacked(part: Part) -> &'static Unpacked {
    static DRIVE: OnceLock<Unpacked> = OnceLock::new();
    static MOTOR: OnceLock<Unpacked> = OnceLock::new();
    let place = if part == Part::Drive { &DRIVE } else { &MOTOR };
    place.get_or_init(|| {
        let text = "motor = \"paper-5k5\"\nrotor.state = \"free\"";
        let document = Document::parse(Path::new("s.toml"), text).expect("TOML");
        let model = Model::new(&document, part).expect("a model");
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join(resource(part)), &model.packed.text).expect("a file");
        Unpacked { model, folder }
    })
}

fn resource(part: Part) -> &'static str {
    if part == Part::Drive { "standstill_drive.toml" } else { "standstill_motor.toml" }
}

/// Resources of an FMU: a scenario, of a drive or a motor by the first byte. They make an instance that begins, or are
/// refused with a reason.
pub fn fmu_resources(bytes: &[u8]) {
    let Some((first, rest)) = bytes.split_first() else { return };
    if text(rest).is_none() {
        return;
    }
    let part = if first % 2 == 0 { Part::Drive } else { Part::Motor };
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join(resource(part)), rest).expect("a file");
    // The refusal of another token has the FMU's own.
    let refusal = Instance::new(folder.path(), "no token", false).err().expect("another token");
    assert!(refusal.len() > 10 && !refusal.contains("a mistake of Standstill"), "{refusal}");
    let own = refusal.split("its binary and resources ").nth(1).and_then(|text| text.split(':').next());
    let Some(token) = own else { return };
    let mut it = Instance::new(folder.path(), token, false).unwrap_or_else(|error| panic!("{error}"));
    // SAFETY: a component, and nothing else.
    let begun = unsafe { fmi3EnterInitializationMode(it.handle, false, 0.0, 0.0, false, 0.0) };
    it.checked(begun);
    // SAFETY: as above.
    let begun = unsafe { fmi3ExitInitializationMode(it.handle) };
    it.checked(begun);
}

/// A number: one of those that matter, a share in sixteenths, or any.
fn number(orders: &mut Fields) -> f64 {
    match orders.byte() {
        0 => f64::from_le_bytes(orders.next()),
        1 => f64::NAN,
        2 => f64::INFINITY,
        3 => -1e308,
        byte => f64::from(byte - 4) / 16.0,
    }
}

/// Calls of one input; a step is a simulation of half a period.
const MOST_CALLS: usize = 48;

/// Calls in any order: each ends with a status, and an error with a message; all that is read is finite; a state comes
/// back from its bytes with the same bytes.
pub fn fmu_calls(bytes: &[u8]) {
    let mut orders = Fields(bytes);
    let first = orders.byte();
    let part = if first & 1 == 0 { Part::Drive } else { Part::Motor };
    let Unpacked { model, folder } = unpacked(part);
    let period = model_period(model);
    let mut it = Instance::new(folder.path(), &model.token(), first & 2 != 0).expect("an instance");
    let mut state: Handle = null_mut();
    let mut time = 0.0;
    for _ in 0..MOST_CALLS {
        if orders.0.is_empty() {
            break;
        }
        let order = orders.byte();
        // The FMU has no variable behind its last one.
        let reference = u32::try_from(usize::from(orders.byte()) % (model.variables.len() + 1)).expect("few");
        let at = &raw const reference;
        let handle = it.handle;
        // SAFETY: a component and a state that are not freed, one reference and one value.
        let status = unsafe {
            match order % 18 {
                0 => fmi3EnterInitializationMode(
                    handle,
                    order > 100,
                    number(&mut orders),
                    number(&mut orders),
                    false,
                    0.0,
                ),
                1 => fmi3ExitInitializationMode(handle),
                2 | 3 => {
                    let value = number(&mut orders);
                    fmi3SetFloat64(handle, at, 1, &raw const value, 1)
                }
                4 => {
                    let value = i32::from_le_bytes(orders.next());
                    fmi3SetInt32(handle, at, 1, &raw const value, 1)
                }
                5 => {
                    let value = i64::from(orders.byte() % 6) - 1;
                    fmi3SetInt64(handle, at, 1, &raw const value, 1)
                }
                6 => {
                    let value = orders.byte() % 2 == 1;
                    fmi3SetBoolean(handle, at, 1, &raw const value, 1)
                }
                7..=9 => {
                    let length = match orders.byte() {
                        0 => number(&mut orders) * 1e-3,
                        byte if byte % 2 == 0 => period,
                        _ => period / 2.0,
                    };
                    let mut flags = [false; 3];
                    let [event, end, early] = &mut flags;
                    let status = fmi3DoStep(handle, time, length, false, event, end, early, null_mut());
                    if status == 0 {
                        time += length;
                    }
                    status
                }
                10 => fmi3EnterEventMode(handle),
                11 => fmi3EnterStepMode(handle),
                12 => {
                    time = 0.0;
                    fmi3Reset(handle)
                }
                13 => fmi3GetFMUState(handle, &raw mut state),
                14 => fmi3SetFMUState(handle, state),
                15 if order > 200 => fmi3Terminate(handle),
                15 | 16 => {
                    let mut value = 0.0;
                    let status = fmi3GetFloat64(handle, at, 1, &raw mut value, 1);
                    assert!(value.is_finite(), "{}: {value}", model.variables[reference as usize].name);
                    status
                }
                _ => {
                    let (mut whole, mut long) = (0_i32, 0_i64);
                    let status = fmi3GetInt32(handle, at, 1, &raw mut whole, 1);
                    it.checked(status);
                    fmi3GetInt64(handle, at, 1, &raw mut long, 1)
                }
            }
        };
        it.checked(status);
        // A state that was set has a time of its own; the next refusal names it, and the calls go on from where it is.
        if order % 18 == 14 && status == 0 {
            time = time_of(&mut it, model).unwrap_or(time);
        }
    }
    if !state.is_null() {
        if let Some(bytes) = written(&mut it, state) {
            let mut restored: Handle = null_mut();
            // SAFETY: so many bytes, and a place.
            let status =
                unsafe { fmi3DeserializeFMUState(it.handle, bytes.as_ptr(), bytes.len(), &raw mut restored) };
            assert!(it.checked(status), "its own bytes are refused");
            assert_eq!(written(&mut it, restored), Some(bytes));
            // SAFETY: a state, which is freed once.
            unsafe { fmi3FreeFMUState(it.handle, &raw mut restored) };
        }
        // SAFETY: as above.
        unsafe { fmi3FreeFMUState(it.handle, &raw mut state) };
    }
}

fn model_period(model: &Model) -> f64 {
    model.period().seconds()
}

fn time_of(it: &mut Instance, model: &Model) -> Option<f64> {
    let place = model.variables.iter().position(|variable| variable.name == "time")?;
    let (reference, mut value) = (u32::try_from(place).ok()?, 0.0);
    // SAFETY: one reference and one value.
    let status = unsafe { fmi3GetFloat64(it.handle, &raw const reference, 1, &raw mut value, 1) };
    it.checked(status).then_some(value)
}

/// A state as bytes; none for one in which a step failed.
fn written(it: &mut Instance, state: Handle) -> Option<Vec<u8>> {
    let mut size = 0;
    // SAFETY: a state of the instance, and a place.
    let status = unsafe { fmi3SerializedFMUStateSize(it.handle, state, &raw mut size) };
    if !it.checked(status) {
        return None;
    }
    let mut bytes = vec![0; size];
    // SAFETY: so many bytes.
    let status = unsafe { fmi3SerializeFMUState(it.handle, state, bytes.as_mut_ptr(), size) };
    assert!(it.checked(status));
    Some(bytes)
}

/// Returns what every state of this FMU begins with: a mark, and its token behind the token's length.
fn beginning(it: &mut Instance, token: &str) -> Vec<u8> {
    let mut state: Handle = null_mut();
    // SAFETY: a place; the state is freed once.
    let status = unsafe { fmi3GetFMUState(it.handle, &raw mut state) };
    assert!(it.checked(status));
    let mut bytes = written(it, state).expect("a new state");
    // SAFETY: as above.
    unsafe { fmi3FreeFMUState(it.handle, &raw mut state) };
    let end =
        bytes.windows(token.len()).position(|part| part == token.as_bytes()).expect("a token") + token.len();
    bytes.truncate(end);
    bytes
}

/// Bytes as a state of the FMU, as they are and with the begin and the digest of one: what is taken can be set, has finite
/// values, and comes back from its own bytes.
pub fn fmu_state(bytes: &[u8]) {
    let Unpacked { model, folder } = unpacked(Part::Drive);
    let mut it = Instance::new(folder.path(), &model.token(), false).expect("an instance");
    let mut all = beginning(&mut it, &model.token());
    all.extend_from_slice(bytes);
    // Fowler–Noll–Vo.
    let digest = all.iter().fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3)
    });
    all.extend(digest.to_le_bytes());
    for bytes in [bytes, &all] {
        let mut state: Handle = null_mut();
        // SAFETY: so many bytes, and a place.
        let status =
            unsafe { fmi3DeserializeFMUState(it.handle, bytes.as_ptr(), bytes.len(), &raw mut state) };
        if !it.checked(status) {
            assert!(state.is_null());
            continue;
        }
        let mut again: Handle = null_mut();
        if let Some(back) = written(&mut it, state) {
            // SAFETY: so many bytes, and a place.
            let status =
                unsafe { fmi3DeserializeFMUState(it.handle, back.as_ptr(), back.len(), &raw mut again) };
            assert!(it.checked(status), "its own bytes are refused");
            assert_eq!(written(&mut it, again), Some(back));
        }
        // SAFETY: states of the instance, each freed once.
        unsafe {
            let status = fmi3SetFMUState(it.handle, state);
            assert!(it.checked(status));
            fmi3FreeFMUState(it.handle, &raw mut state);
            fmi3FreeFMUState(it.handle, &raw mut again);
        }
        for reference in 0..model.variables.len() {
            let (reference, mut value) = (u32::try_from(reference).expect("few"), 0.0);
            // SAFETY: one reference and one value.
            let status = unsafe { fmi3GetFloat64(it.handle, &raw const reference, 1, &raw mut value, 1) };
            it.checked(status);
            assert!(value.is_finite(), "{}: {value}", model.variables[reference as usize].name);
        }
    }
}
