//! An importer of FMI 2.0, as small as one can be: the shared library by its C functions.

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::ptr::null_mut;
use std::sync::Mutex;

use libloading::Library;
use standstill_fmu::{Binary, Model, Part};
use standstill_scenario::Document;
use tempfile::TempDir;

/// The shared library, which Cargo builds beside the tests.
pub fn binary() -> PathBuf {
    let test = std::env::current_exe().expect("a test");
    let [here, _] = Binary::beside(&test);
    let [above, deps] = Binary::beside(test.parent().expect("a folder"));
    let places = [here, deps, above];
    let found = places.iter().find(|path| path.is_file());
    found.unwrap_or_else(|| panic!("none of {places:?}")).clone()
}

/// A model and the folder of its resources, as an importer has unpacked them.
pub struct Unpacked {
    pub model: Model,
    pub folder: TempDir,
}

pub fn unpacked(text: &str, part: Part) -> Unpacked {
    let document = Document::parse(Path::new("s.toml"), text).expect("TOML");
    at(Model::new(&document, part).expect("a model"))
}

/// The resources of a model in a folder.
pub fn at(model: Model) -> Unpacked {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, content) in &model.packed.files {
        std::fs::write(folder.path().join(name), content).expect("written");
    }
    std::fs::write(folder.path().join(format!("{}.toml", model.part.name())), &model.packed.text)
        .expect("written");
    Unpacked { model, folder }
}

#[repr(C)]
struct Callbacks {
    logger: unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char),
    others: [*const c_void; 3],
    environment: *const Mutex<Vec<String>>,
}

unsafe extern "C" fn logger(
    environment: *mut c_void,
    _: *const c_char,
    status: c_int,
    _: *const c_char,
    message: *const c_char,
) {
    assert_eq!(status, 3);
    // SAFETY: the test's own list, and a text of the library's.
    let (log, message) = unsafe { (&*environment.cast::<Mutex<Vec<String>>>(), CStr::from_ptr(message)) };
    log.lock().expect("unharmed").push(message.to_string_lossy().into_owned());
}

/// An instance of FMI 2.0.
pub struct Slave<'u> {
    library: Library,
    unpacked: &'u Unpacked,
    component: *mut c_void,
    pub log: Box<Mutex<Vec<String>>>,
}

pub type State = *mut c_void;

impl<'u> Slave<'u> {
    /// Made, or the message why not.
    pub fn new(unpacked: &'u Unpacked, token: &str) -> Result<Self, String> {
        type Instantiate = unsafe extern "C" fn(
            *const c_char,
            c_int,
            *const c_char,
            *const c_char,
            *const Callbacks,
            c_int,
            c_int,
        ) -> *mut c_void;
        // SAFETY: our own library.
        let library = unsafe { Library::new(binary()) }.expect("a library");
        let log = Box::new(Mutex::new(Vec::new()));
        let callbacks = Callbacks { logger, others: [std::ptr::null(); 3], environment: &raw const *log };
        let text = |text: &str| CString::new(text).expect("a text");
        let resources = text(&format!("file://{}", unpacked.folder.path().display()));
        // SAFETY: the function of the standard's headers.
        let component = unsafe {
            let instantiate = library.get::<Instantiate>(b"fmi2Instantiate").expect("there");
            instantiate(
                text("it").as_ptr(),
                1,
                text(token).as_ptr(),
                resources.as_ptr(),
                &raw const callbacks,
                0,
                1,
            )
        };
        if component.is_null() {
            return Err(log.lock().expect("unharmed").join("; "));
        }
        Ok(Self { library, unpacked, component, log })
    }

    /// As it is made.
    pub fn made(unpacked: &'u Unpacked) -> Self {
        Self::new(unpacked, &unpacked.model.token()).expect("an instance")
    }

    /// In initialization mode, with parameters set.
    pub fn begun(unpacked: &'u Unpacked, parameters: &[(&str, f64)]) -> Self {
        let slave = Self::made(unpacked);
        for (name, value) in parameters {
            assert_eq!(slave.set(name, *value), 0, "{name}: {:?}", slave.log);
        }
        assert_eq!(slave.call("fmi2EnterInitializationMode"), 0);
        slave
    }

    /// Ready for steps.
    pub fn ready(unpacked: &'u Unpacked, parameters: &[(&str, f64)]) -> Self {
        let slave = Self::begun(unpacked, parameters);
        assert_eq!(slave.call("fmi2ExitInitializationMode"), 0, "{:?}", slave.log);
        slave
    }

    pub fn call(&self, name: &str) -> c_int {
        type Call = unsafe extern "C" fn(*mut c_void) -> c_int;
        // SAFETY: the functions of the standard that take an instance alone.
        unsafe { self.library.get::<Call>(name.as_bytes()).expect("there")(self.component) }
    }

    fn reference(&self, name: &str) -> (u32, standstill_fmu::Kind) {
        let all = &self.unpacked.model.variables;
        let place = all.iter().position(|variable| variable.name == name).unwrap_or_else(|| panic!("{name}"));
        (u32::try_from(place).expect("few"), all[place].kind)
    }

    pub fn set(&self, name: &str, value: f64) -> c_int {
        let (reference, kind) = self.reference(name);
        #[allow(clippy::cast_possible_truncation)]
        let whole = value as c_int;
        // SAFETY: the functions of the standard's headers, with one value.
        unsafe {
            if kind == standstill_fmu::Kind::Real {
                type Set = unsafe extern "C" fn(*mut c_void, *const u32, usize, *const f64) -> c_int;
                self.library.get::<Set>(b"fmi2SetReal").expect("there")(
                    self.component,
                    &raw const reference,
                    1,
                    &raw const value,
                )
            } else {
                type Set = unsafe extern "C" fn(*mut c_void, *const u32, usize, *const c_int) -> c_int;
                let name: &[u8] =
                    if kind == standstill_fmu::Kind::Boolean { b"fmi2SetBoolean" } else { b"fmi2SetInteger" };
                self.library.get::<Set>(name).expect("there")(
                    self.component,
                    &raw const reference,
                    1,
                    &raw const whole,
                )
            }
        }
    }

    pub fn get(&self, name: &str) -> f64 {
        let (reference, kind) = self.reference(name);
        // SAFETY: the functions of the standard's headers, with one value.
        let (status, value) = unsafe {
            if kind == standstill_fmu::Kind::Real {
                type Get = unsafe extern "C" fn(*mut c_void, *const u32, usize, *mut f64) -> c_int;
                let (get, mut value) = (self.library.get::<Get>(b"fmi2GetReal").expect("there"), f64::NAN);
                (get(self.component, &raw const reference, 1, &raw mut value), value)
            } else {
                type Get = unsafe extern "C" fn(*mut c_void, *const u32, usize, *mut c_int) -> c_int;
                let name: &[u8] =
                    if kind == standstill_fmu::Kind::Boolean { b"fmi2GetBoolean" } else { b"fmi2GetInteger" };
                let (get, mut value) = (self.library.get::<Get>(name).expect("there"), -1);
                (get(self.component, &raw const reference, 1, &raw mut value), f64::from(value))
            }
        };
        assert_eq!(status, 0, "{name}: {:?}", self.log);
        value
    }

    pub fn step(&self, time: f64, length: f64) -> c_int {
        type Step = unsafe extern "C" fn(*mut c_void, f64, f64, c_int) -> c_int;
        // SAFETY: the function of the standard's headers.
        unsafe { self.library.get::<Step>(b"fmi2DoStep").expect("there")(self.component, time, length, 1) }
    }

    /// Tells when the simulation begins.
    pub fn start_at(&self, time: f64) -> c_int {
        self.set_up(None, time)
    }

    /// Tells how exact a simulation has to be, and when it begins.
    pub fn set_up(&self, tolerance: Option<f64>, time: f64) -> c_int {
        type Setup = unsafe extern "C" fn(*mut c_void, c_int, f64, f64, c_int, f64) -> c_int;
        // SAFETY: the function of the standard's header.
        unsafe {
            let setup = self.library.get::<Setup>(b"fmi2SetupExperiment").expect("there");
            setup(self.component, c_int::from(tolerance.is_some()), tolerance.unwrap_or(0.0), time, 0, 0.0)
        }
    }

    pub fn state(&self, name: &str, state: &mut State) -> c_int {
        type Call = unsafe extern "C" fn(*mut c_void, *mut State) -> c_int;
        // SAFETY: the functions of the standard's headers that take the place of a state.
        unsafe { self.library.get::<Call>(name.as_bytes()).expect("there")(self.component, state) }
    }

    pub fn set_state(&self, state: State) -> c_int {
        type Call = unsafe extern "C" fn(*mut c_void, State) -> c_int;
        // SAFETY: the function of the standard's headers.
        unsafe { self.library.get::<Call>(b"fmi2SetFMUstate").expect("there")(self.component, state) }
    }

    /// A state as bytes.
    pub fn serialised(&self, state: State) -> Option<Vec<u8>> {
        type Size = unsafe extern "C" fn(*mut c_void, State, *mut usize) -> c_int;
        let mut size = 0;
        // SAFETY: the function of the standard's headers.
        let known = unsafe {
            let call = self.library.get::<Size>(b"fmi2SerializedFMUstateSize").expect("there");
            call(self.component, state, &raw mut size)
        };
        (known == 0).then_some(())?;
        let mut bytes = vec![0; size];
        (self.serialise(state, &mut bytes) == 0).then_some(bytes)
    }

    pub fn serialise(&self, state: State, bytes: &mut [u8]) -> c_int {
        type Call = unsafe extern "C" fn(*mut c_void, State, *mut u8, usize) -> c_int;
        // SAFETY: the function of the standard's headers, with so many bytes.
        unsafe {
            let call = self.library.get::<Call>(b"fmi2SerializeFMUstate").expect("there");
            call(self.component, state, bytes.as_mut_ptr(), bytes.len())
        }
    }

    pub fn deserialise(&self, bytes: &[u8], state: &mut State) -> c_int {
        type Call = unsafe extern "C" fn(*mut c_void, *const u8, usize, *mut State) -> c_int;
        // SAFETY: the function of the standard's headers, with so many bytes.
        unsafe {
            let call = self.library.get::<Call>(b"fmi2DeSerializeFMUstate").expect("there");
            call(self.component, bytes.as_ptr(), bytes.len(), state)
        }
    }

    /// The last message.
    pub fn said(&self) -> String {
        self.log.lock().expect("unharmed").last().cloned().unwrap_or_default()
    }
}

impl Drop for Slave<'_> {
    fn drop(&mut self) {
        type Free = unsafe extern "C" fn(*mut c_void);
        // SAFETY: made by the library, and freed once.
        unsafe { self.library.get::<Free>(b"fmi2FreeInstance").expect("there")(self.component) };
        self.component = null_mut();
    }
}
