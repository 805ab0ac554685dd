//! The functions of FMI 3.0 by their names in C, and an instance with what it says.

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::Path;
use std::ptr::null;

use standstill_fmu as _;

pub(super) type Handle = *mut c_void;
type Logger = unsafe extern "C" fn(Handle, c_int, *const c_char, *const c_char);

// As `fmi3FunctionTypes.h` has them; the crate of FMUs exports them to C alone.
#[allow(improper_ctypes, reason = "handles")]
unsafe extern "C" {
    pub(super) fn fmi3InstantiateCoSimulation(
        name: *const c_char,
        token: *const c_char,
        resources: *const c_char,
        visible: bool,
        logging: bool,
        events: bool,
        early: bool,
        intermediate: *const u32,
        count: usize,
        environment: Handle,
        logger: Option<Logger>,
        update: *const c_void,
    ) -> Handle;
    pub(super) fn fmi3FreeInstance(it: Handle);
    pub(super) fn fmi3EnterInitializationMode(
        it: Handle,
        exact: bool,
        tolerance: f64,
        start: f64,
        ends: bool,
        end: f64,
    ) -> c_int;
    pub(super) fn fmi3ExitInitializationMode(it: Handle) -> c_int;
    pub(super) fn fmi3EnterEventMode(it: Handle) -> c_int;
    pub(super) fn fmi3EnterStepMode(it: Handle) -> c_int;
    pub(super) fn fmi3DoStep(
        it: Handle,
        time: f64,
        length: f64,
        kept: bool,
        event: *mut bool,
        end: *mut bool,
        early: *mut bool,
        last: *mut f64,
    ) -> c_int;
    pub(super) fn fmi3Terminate(it: Handle) -> c_int;
    pub(super) fn fmi3Reset(it: Handle) -> c_int;
    pub(super) fn fmi3GetFloat64(
        it: Handle,
        references: *const u32,
        count: usize,
        values: *mut f64,
        all: usize,
    ) -> c_int;
    pub(super) fn fmi3SetFloat64(
        it: Handle,
        references: *const u32,
        count: usize,
        values: *const f64,
        all: usize,
    ) -> c_int;
    pub(super) fn fmi3GetInt32(
        it: Handle,
        references: *const u32,
        count: usize,
        values: *mut i32,
        all: usize,
    ) -> c_int;
    pub(super) fn fmi3SetInt32(
        it: Handle,
        references: *const u32,
        count: usize,
        values: *const i32,
        all: usize,
    ) -> c_int;
    pub(super) fn fmi3GetInt64(
        it: Handle,
        references: *const u32,
        count: usize,
        values: *mut i64,
        all: usize,
    ) -> c_int;
    pub(super) fn fmi3SetInt64(
        it: Handle,
        references: *const u32,
        count: usize,
        values: *const i64,
        all: usize,
    ) -> c_int;
    pub(super) fn fmi3SetBoolean(
        it: Handle,
        references: *const u32,
        count: usize,
        values: *const bool,
        all: usize,
    ) -> c_int;
    pub(super) fn fmi3GetFMUState(it: Handle, state: *mut Handle) -> c_int;
    pub(super) fn fmi3SetFMUState(it: Handle, state: Handle) -> c_int;
    pub(super) fn fmi3FreeFMUState(it: Handle, state: *mut Handle) -> c_int;
    pub(super) fn fmi3SerializedFMUStateSize(it: Handle, state: Handle, size: *mut usize) -> c_int;
    pub(super) fn fmi3SerializeFMUState(it: Handle, state: Handle, bytes: *mut u8, size: usize) -> c_int;
    pub(super) fn fmi3DeserializeFMUState(
        it: Handle,
        bytes: *const u8,
        size: usize,
        state: *mut Handle,
    ) -> c_int;
}

/// What the FMU said, which is never that it made a mistake itself.
type Log = Vec<String>;

unsafe extern "C" fn logger(environment: Handle, status: c_int, _: *const c_char, message: *const c_char) {
    // SAFETY: the list of the instance that calls, and a text of the FMU's.
    let (log, message) = unsafe { (&mut *environment.cast::<Log>(), CStr::from_ptr(message)) };
    log.push(format!("{status}: {}", message.to_string_lossy()));
}

/// An instance with its log.
pub(super) struct Instance {
    pub(super) handle: Handle,
    log: Box<Log>,
}

impl Instance {
    /// Makes an instance, or returns why there is none.
    pub(super) fn new(resources: &Path, token: &str, events: bool) -> Result<Self, String> {
        let c = |text: &str| CString::new(text).expect("a text");
        let (token, path) = (c(token), c(&resources.display().to_string()));
        let mut log = Box::<Log>::default();
        let environment = (&raw mut *log).cast();
        // SAFETY: texts that live until the call returns; the log lives as long as the instance.
        let handle = unsafe {
            fmi3InstantiateCoSimulation(
                c"it".as_ptr(),
                token.as_ptr(),
                path.as_ptr(),
                false,
                false,
                events,
                false,
                null(),
                0,
                environment,
                Some(logger),
                null(),
            )
        };
        if handle.is_null() { Err(log.join("; ")) } else { Ok(Self { handle, log }) }
    }

    /// Checks a call's status: an error has a message that is no mistake of the FMU's.
    pub(super) fn checked(&mut self, status: c_int) -> bool {
        let said = std::mem::take(&mut *self.log);
        match status {
            0 => assert!(said.is_empty(), "{said:?}"),
            3 => {
                assert!(said.len() == 1 && said[0].len() > 10, "{said:?}");
                assert!(!said[0].contains("a mistake of Standstill"), "{said:?}");
            }
            other => panic!("status {other}"),
        }
        status == 0
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: it was made, and is freed once.
        unsafe { fmi3FreeInstance(self.handle) };
    }
}
