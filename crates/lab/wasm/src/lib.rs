//! The lab's bench as a WebAssembly module: bytes in, bytes out.
//!
//! A caller writes a text into memory that `reserve` gives, calls, and reads `[code: u32, length: u32, bytes …]` at the
//! address that it gets. Code 0: an answer; 1: an error in JSON; 2: there is no more. What is there is overwritten by the
//! next call. One thread, as a worker has it.

use std::cell::RefCell;

use standstill_lab::{Bench, Filling, Given, LabError};

#[derive(Default)]
struct Module {
    bench: Option<Bench>,
    filling: Option<Filling>,
    input: Vec<u8>,
    output: Vec<u8>,
}

thread_local! {
    static MODULE: RefCell<Module> = RefCell::default();
}

/// An answer, an error, or the end.
type Answer = Result<Option<Vec<u8>>, LabError>;

impl Module {
    fn bench(&mut self) -> Result<&Bench, LabError> {
        if self.bench.is_none() {
            self.bench = Some(Bench::new(Given::nothing()?, None)?);
        }
        self.bench.as_ref().ok_or_else(|| LabError::of("no scenario"))
    }

    /// The last `length` bytes are the body, those before the name of the request.
    fn texts(&self, length: usize) -> Result<(String, String), LabError> {
        let split = self.input.len().saturating_sub(length);
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).map_err(LabError::of);
        Ok((text(&self.input[..split])?, text(&self.input[split..])?))
    }

    fn answer(&mut self, body: usize) -> Answer {
        let (name, body) = self.texts(body)?;
        self.bench()?.answer(&name, &body).map(Some)
    }

    fn begin(&mut self) -> Answer {
        self.filling = None;
        let request = serde_json::from_slice(&self.input).map_err(LabError::request)?;
        self.filling = Some(Filling::new(self.bench()?, &request)?);
        Ok(Some(Vec::new()))
    }

    fn step(&mut self) -> Answer {
        match (&mut self.filling, &self.bench) {
            (Some(filling), Some(bench)) => filling.step(bench),
            _ => Ok(None),
        }
    }

    /// Where the answer is.
    fn place_of(&mut self, answer: Answer) -> *const u8 {
        let (code, bytes) = match answer {
            Ok(Some(bytes)) => (0_u32, bytes),
            Ok(None) => (2, Vec::new()),
            Err(error) => (1, serde_json::to_vec(&error).unwrap_or_default()),
        };
        let length = u32::try_from(bytes.len()).unwrap_or(0);
        self.output = [&code.to_le_bytes(), &length.to_le_bytes(), &bytes[..]].concat();
        self.output.as_ptr()
    }
}

fn with(act: impl FnOnce(&mut Module) -> Answer) -> *const u8 {
    MODULE.with_borrow_mut(|module| {
        let answer = act(module);
        module.place_of(answer)
    })
}

/// Room for so many bytes of input.
// SAFETY of the attribute: no other symbol of the module has this name.
#[unsafe(no_mangle)]
pub extern "C" fn reserve(length: usize) -> *mut u8 {
    MODULE.with_borrow_mut(|module| {
        module.input = vec![0; length];
        module.input.as_mut_ptr()
    })
}

/// The answer to the request in the input, of which the last `body` bytes are its body.
// SAFETY of the attribute: no other symbol of the module has this name.
#[unsafe(no_mangle)]
pub extern "C" fn answer(body: usize) -> *const u8 {
    with(|module| module.answer(body))
}

/// Begins the cloud that the input asks for.
// SAFETY of the attribute: no other symbol of the module has this name.
#[unsafe(no_mangle)]
pub extern "C" fn begin() -> *const u8 {
    with(Module::begin)
}

/// The next frames of the cloud.
// SAFETY of the attribute: no other symbol of the module has this name.
#[unsafe(no_mangle)]
pub extern "C" fn step() -> *const u8 {
    with(Module::step)
}
