//! One copy of a library in memory, with all parts that it needs: loading, restoration and calls.
//!
//! The calls are sound for this reason: the functions of the table are called as `standstill.h` declares them, with
//! pointers to whole structs of this process that live throughout the call; A library that violates the header can do
//! anything, as any foreign code can; isolated workers protect against such libraries. An image is used by one
//! detection at a time.
#![allow(
    unsafe_code,
    reason = "a foreign library is loaded, its memory copied, and its functions called through pointers"
)]

use std::ffi::{CStr, CString, c_char, c_void};
use std::path::PathBuf;
use std::ptr::NonNull;

use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};

/// Flag of `dlopen` by which a library's own symbols come before those of the C library with equal names.
const OWN_FIRST: libc::c_int = libc::RTLD_DEEPBIND;

use crate::abi1::{Answer1, Command1, DRIVE_BYTES, Legs1, Sample1};
pub use crate::crash::{Moment, Site};
use crate::fenced::{Beyond, Fenced};
use crate::heap::Space;
use crate::library::LoadError;
use crate::loading::{base_of, construct, file_in_memory, load_error, path_of, replace};
use crate::parts::{self, Part};
use crate::shared::{is_checked, keeps_its_own};
use crate::table::{Calls, table_of};
use crate::{crash, output, runtime};
use standstill_interface::abi::{Answer, Command, Drive, Entry, Legs, REENTRANT, Readings, Sample, Table};

/// Writable memory of an image, with its content after loading.
struct Memory {
    start: NonNull<u8>,
    saved: Box<[u8]>,
}

/// A loaded copy of a library.
pub struct Image {
    table: Table,
    calls: Calls,
    /// The samples of a call as ABI 1 has them.
    first: Vec<Sample1>,
    memory: Vec<Memory>,
    /// True if the compiler's checks guard the gaps between variables; such memory must be copied byte by byte.
    is_checked: bool,
    /// Libraries that the image has loaded itself; they exist once in the program.
    pub loads: Vec<PathBuf>,
    /// Before its space, so that it is unloaded before that is gone.
    _libraries: Vec<Library>,
    space: Space,
}

// SAFETY: an image has no thread of its own and, as thread-local memory is refused, nothing that belongs to one.
unsafe impl Send for Image {}

/// Calls into an image, with the image's state of the C library. A crash during the call is attributed to this site.
fn during<T>(site: Site, space: &Space, call: impl FnOnce() -> T) -> T {
    let inside = crash::enter(site);
    // SAFETY: of an image that is used by one detection at a time, which is this one.
    let float = unsafe { runtime::enter(space.state()) };
    let result = call();
    // SAFETY: as above.
    unsafe { runtime::leave(space.state(), float) };
    inside.leave();
    result
}

impl Image {
    /// Loads copies of these parts. All symbols are resolved here, never in the middle of a run.
    pub fn load(parts: &[Part], site: Site) -> Result<Self, LoadError> {
        crash::watch();
        output::divert();
        let no_copy =
            |error: std::io::Error| LoadError::because(format!("no copy of it could be made: {error}"));
        let space = Space::new().map_err(|error| no_room(&error))?;
        let mut libraries = Vec::new();
        let mut memory = Vec::new();
        let memory_is_own = keeps_its_own(parts);
        // What checks memory wants to be asked first.
        let how = RTLD_NOW | RTLD_LOCAL | if memory_is_own { OWN_FIRST } else { 0 };
        for (part, bytes) in parts.iter().zip(parts::copies(parts)?) {
            // The loader knows files that it has loaded already: each is a file of its own, which has no place in any folder, so
            // that none stays behind. A debugger finds it by the number of this process.
            let copy = file_in_memory(&bytes).map_err(no_copy)?;
            let path = path_of(&copy);
            // SAFETY: no function of it runs: its constructors were taken out.
            let library = unsafe { Library::open(Some(path), how) };
            let library = library.map_err(|error| load_error(&error, parts))?;
            let base =
                base_of(&library).ok_or_else(|| LoadError::because("one without address".to_owned()))?;
            replace(base, &part.elf, &|name| runtime::in_place_of(name, memory_is_own, &part.elf));
            // SAFETY: constructors of the library run, as the loader would have them; whoever names it as the detector wants its
            // code to run.
            during(site, &space, || unsafe { construct(base, &part.elf) });
            memory.push((base, &part.elf.writable));
            libraries.push(library);
        }
        let last = libraries.last().ok_or_else(LoadError::no_entry)?;
        // SAFETY: `sts_entry` is declared so in standstill.h.
        let entry = unsafe { last.get::<Entry>(b"sts_entry\0") };
        let entry = *entry.map_err(|_| LoadError::no_entry())?;
        let (table, calls) = during(site, &space, || table_of(entry))?;
        let mut image = Self {
            table,
            calls,
            first: Vec::new(),
            memory: Vec::new(),
            is_checked: is_checked(parts),
            loads: runtime::loaded(),
            _libraries: libraries,
            space,
        };
        // SAFETY: nobody is in the image.
        let state = unsafe { &mut *image.space.state() };
        state.loads = false;
        state.serves = table.flags & REENTRANT == 0;
        if state.serves {
            image.memory = memory.iter().flat_map(|(base, writable)| kept(*base, writable)).collect();
        }
        image.space.keep();
        Ok(image)
    }

    /// Restores the image's writable memory to its content after loading. For a reentrant library, only its state in
    /// the C library is restored, such as random numbers; its variables stay.
    pub fn set_back(&mut self) {
        for Memory { start, saved } in &self.memory {
            if self.is_checked {
                for (at, byte) in saved.iter().enumerate() {
                    // SAFETY: writable memory of this image, of that length; nobody else uses the image.
                    unsafe { start.as_ptr().add(at).write_volatile(*byte) };
                }
            } else {
                // SAFETY: as above.
                unsafe { std::ptr::copy_nonoverlapping(saved.as_ptr(), start.as_ptr(), saved.len()) };
            }
        }
        self.space.set_back();
    }

    /// Returns whether it wanted to load a library in the middle of a detection.
    pub fn loaded_late(&self) -> bool {
        // SAFETY: nobody is in the image.
        unsafe { (*self.space.state()).loaded_late }
    }

    /// Returns the table of functions.
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// Returns whether it has `step`, and whether it has `isr`.
    pub fn has(&self) -> [bool; 2] {
        match self.calls {
            Calls::Present => [self.table.step.is_some(), self.table.isr.is_some()],
            Calls::First { step, isr } => [step.is_some(), isr.is_some()],
        }
    }

    /// Returns the name of the library.
    pub fn name(&self) -> String {
        // SAFETY: a C string of the library.
        unsafe { text(self.table.name) }.unwrap_or_default()
    }

    /// Returns a detector of it; why it refused.
    pub fn create(
        &mut self,
        site: Site,
        drive: &Drive,
        config: &CString,
        seed: u64,
    ) -> Result<NonNull<c_void>, String> {
        let Some(create) = self.table.create else { return Err("it has no `create`".to_owned()) };
        let mut refused = std::ptr::null();
        // A library may write to what it is given to read: this is its own.
        let mut own = *drive;
        if matches!(self.calls, Calls::First { .. }) {
            own.size = DRIVE_BYTES;
        }
        // SAFETY: as standstill.h declares it.
        let detector = during(site, &self.space, || unsafe {
            create(&raw const own, config.as_ptr(), seed, &raw mut refused)
        });
        NonNull::new(detector).ok_or_else(|| {
            // SAFETY: null, or a C string of the library.
            unsafe { text(refused) }.unwrap_or_else(|| "without saying why".to_owned())
        })
    }

    /// Ends a detector.
    pub fn destroy(&mut self, site: Site, detector: NonNull<c_void>) {
        if let Some(destroy) = self.table.destroy {
            // SAFETY: what `create` returned, given back once.
            during(site, &self.space, || unsafe { destroy(detector.as_ptr()) });
        }
    }

    /// Returns the text of a reason.
    pub fn reason(&mut self, site: Site, code: u32) -> Option<String> {
        let reason = self.table.reason?;
        // SAFETY: as standstill.h declares it; null, or a C string of the library.
        during(site, &self.space, || unsafe { text(reason(code)) })
    }

    /// Runs a detector's task once, at a time in ns.
    pub fn task(&mut self, site: Site, detector: NonNull<c_void>, time: u64) {
        if let Some(task) = self.table.task {
            // SAFETY: as standstill.h declares it.
            during(site, &self.space, || unsafe { task(detector.as_ptr(), time) });
        }
    }

    /// Returns the value of a channel of a detector, and its name; none beyond the last one.
    pub fn probe(&mut self, site: Site, detector: NonNull<c_void>, channel: u32) -> Option<(String, f32)> {
        let probe = self.table.probe?;
        let mut value = 0.0;
        // SAFETY: as standstill.h declares it; null, or a C string of the library.
        let name =
            during(site, &self.space, || unsafe { text(probe(detector.as_ptr(), channel, &raw mut value)) });
        name.map(|name| (name, value))
    }

    /// Calls `step` once and returns status, command and result; none for a library without `step`.
    ///
    /// # Errors
    /// The library wrote beyond a structure.
    pub fn step(
        &mut self,
        site: Site,
        detector: NonNull<c_void>,
        samples: &[Sample],
    ) -> Result<Option<(i32, Command, Answer)>, Beyond> {
        let Some(readings) = Readings::of(samples) else { return Ok(None) };
        match self.calls {
            Calls::Present => {
                let Some(step) = self.table.step else { return Ok(None) };
                let (mut command, mut answer) = (Fenced::new(Command::default()), Fenced::new(Answer::NONE));
                // SAFETY: as standstill.h declares it; so many samples.
                let status = during(site, &self.space, || unsafe {
                    step(
                        detector.as_ptr(),
                        &raw const readings,
                        &raw mut command.inside,
                        &raw mut answer.inside,
                    )
                });
                Ok(Some((status, command.whole("sts_command")?, answer.whole("sts_result")?)))
            }
            Calls::First { step, .. } => {
                let Some(step) = step else { return Ok(None) };
                let (mut command, mut answer) =
                    (Fenced::new(Command1::default()), Fenced::new(Answer1::NONE));
                self.first.clear();
                self.first.extend(samples.iter().map(Sample1::from));
                let first = self.first.as_ptr();
                // SAFETY: as the header of ABI 1 declares it; so many samples.
                let status = during(site, &self.space, || unsafe {
                    step(
                        detector.as_ptr(),
                        first,
                        readings.count,
                        &raw mut command.inside,
                        &raw mut answer.inside,
                    )
                });
                let (command, answer) = (command.whole("sts_command")?, answer.whole("sts_result")?);
                Ok(Some((status, Command::from(&command), Answer::from(&answer))))
            }
        }
    }

    /// Calls `isr` once and returns status and result; none for a library without `isr`. `legs` receives the legs.
    ///
    /// # Errors
    /// The library wrote beyond a structure.
    pub fn isr(
        &mut self,
        site: Site,
        detector: NonNull<c_void>,
        samples: &[Sample],
        legs: &mut Legs,
    ) -> Result<Option<(i32, Answer)>, Beyond> {
        let (Some(readings), Some(last)) = (Readings::of(samples), samples.last()) else { return Ok(None) };
        match self.calls {
            Calls::Present => {
                let Some(isr) = self.table.isr else { return Ok(None) };
                let (mut written, mut answer) = (Fenced::new(*legs), Fenced::new(Answer::NONE));
                // SAFETY: as standstill.h declares it.
                let status = during(site, &self.space, || unsafe {
                    isr(
                        detector.as_ptr(),
                        &raw const readings,
                        &raw mut written.inside,
                        &raw mut answer.inside,
                    )
                });
                // Its size is the program's to state, whatever the library left there.
                *legs = Legs { size: legs.size, ..written.whole("sts_legs")? };
                Ok(Some((status, answer.whole("sts_result")?)))
            }
            Calls::First { isr, .. } => {
                let Some(isr) = isr else { return Ok(None) };
                let (mut written, mut answer) = (Fenced::new(Legs1::of(legs)), Fenced::new(Answer1::NONE));
                let sample = Sample1::from(last);
                // SAFETY: as the header of ABI 1 declares it.
                let status = during(site, &self.space, || unsafe {
                    isr(detector.as_ptr(), &raw const sample, &raw mut written.inside, &raw mut answer.inside)
                });
                written.whole("sts_legs")?.write(legs);
                Ok(Some((status, Answer::from(&answer.whole("sts_result")?))))
            }
        }
    }
}

/// Addresses for an image's heap that the system does not give.
fn no_room(error: &std::io::Error) -> LoadError {
    LoadError::new(
        format!(
            "no room for a copy of the library, whose heap takes {} MiB of addresses: {error}",
            crate::heap::ROOM >> 20
        ),
        "more addresses (ulimit -v unlimited), or fewer copies (--threads 1, with which 1 GiB of addresses usually suffices)"
            .to_owned(),
    )
}

/// Returns the writable memory with its present content.
fn kept(base: usize, writable: &[[u64; 2]]) -> Vec<Memory> {
    let keep = |[from, to]: &[u64; 2]| {
        let start = NonNull::new(base.wrapping_add(usize::try_from(*from).ok()?) as *mut u8)?;
        let mut saved = vec![0_u8; usize::try_from(to - from).ok()?].into_boxed_slice();
        for (at, byte) in saved.iter_mut().enumerate() {
            // SAFETY: the program header says that so many bytes from here are mapped and can be read.
            *byte = unsafe { start.as_ptr().add(at).read_volatile() };
        }
        Some(Memory { start, saved })
    };
    writable.iter().filter_map(keep).collect()
}

/// Returns a C string.
///
/// # Safety
/// It is null or one.
unsafe fn text(from: *const c_char) -> Option<String> {
    // SAFETY: the caller's.
    (!from.is_null()).then(|| unsafe { CStr::from_ptr(from) }.to_string_lossy().into_owned())
}
