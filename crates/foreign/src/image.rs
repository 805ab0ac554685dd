//! One copy of a library in memory: how it is loaded, set back, and called. With `crash.rs` the only place of `unsafe` here.
//!
//! What makes it sound: the functions of the table are called as `standstill.h` declares them, with pointers to whole structs
//! of this process that live throughout the call; a library that breaks its side of the header can do anything, as any
//! foreign code can, which is what isolated workers are for. An image is used by one detection at a time.
#![allow(
    unsafe_code,
    reason = "a foreign library is loaded, its memory copied, and its functions called through pointers"
)]

use std::ffi::{CStr, CString, c_char, c_void};
use std::fs::File;
use std::io::Write as _;
use std::os::fd::{AsRawFd as _, FromRawFd as _};
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU32, Ordering};

use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};

/// What a library defines is its own, also where the C library has the same name: firmware knows none of it.
#[cfg(target_env = "gnu")]
const OWN_FIRST: libc::c_int = libc::RTLD_DEEPBIND;
#[cfg(not(target_env = "gnu"))]
const OWN_FIRST: libc::c_int = 0;

use crate::crash;
pub use crate::crash::{Moment, Site};
use crate::elf::Elf;
use crate::library::LoadError;
use standstill_interface::abi::{ABI, Answer, Command, Drive, Entry, Legs, REENTRANT, Sample, Table};

/// Writable memory of an image and what it held after loading.
struct Memory {
    start: NonNull<u8>,
    saved: Box<[u8]>,
}

/// A loaded copy of a library.
pub struct Image {
    table: Table,
    memory: Vec<Memory>,
    /// Last, so that it is unloaded after all that points into it.
    _library: Library,
}

// SAFETY: an image has no thread of its own and, as thread-local memory is refused, nothing that belongs to one.
unsafe impl Send for Image {}

/// The table's first fields, which all versions have.
#[repr(C)]
struct Head {
    abi: u32,
    size: u32,
}

impl Image {
    /// Loads a copy of these bytes. All symbols are resolved here, never in the middle of a run.
    pub fn load(bytes: &[u8], elf: &Elf, site: &Site) -> Result<Self, LoadError> {
        crash::watch();
        during(site, || Self::open(bytes, elf))
    }

    fn open(bytes: &[u8], elf: &Elf) -> Result<Self, LoadError> {
        // The loader knows files that it has loaded already: each image is a file of its own, which has no place in any folder,
        // so that none stays behind. A debugger finds it by the number of this process.
        let copy = file_in_memory(bytes)
            .map_err(|error| LoadError::because(format!("no copy of it could be made: {error}")))?;
        let path = path_of(&copy);
        // SAFETY: constructors of the library run; whoever names it as the detector wants its code to run.
        let library = unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL | OWN_FIRST) };
        let library = library.map_err(|error| load_error(&error, elf))?;
        // SAFETY: `sts_entry` is declared so in standstill.h.
        let entry = unsafe { library.get::<Entry>(b"sts_entry\0") };
        let entry = entry.map_err(|_| LoadError::no_entry())?;
        // SAFETY: as above; the table is at least its head, and of this version as large as it says.
        let table = unsafe {
            let asked = entry(ABI);
            if asked.is_null() {
                return Err(LoadError::new(
                    format!("a library whose sts_entry({ABI}) gives no table"),
                    format!("a table of ABI {ABI}"),
                ));
            }
            let head = &*asked.cast::<Head>();
            if head.abi != ABI {
                return Err(LoadError::new(
                    format!("a table of ABI {}", head.abi),
                    format!("one of ABI {ABI}, as its header standstill.h says"),
                ));
            }
            if (head.size as usize) < size_of::<Table>() {
                return Err(LoadError::new(
                    format!("a table of {} bytes", head.size),
                    format!("at least {} bytes, sizeof(sts_detector)", size_of::<Table>()),
                ));
            }
            *asked
        };
        let mut image = Self { table, memory: Vec::new(), _library: library };
        if table.flags & REENTRANT == 0 {
            image.memory = Self::writable(*entry as *const c_void, elf)?;
        }
        Ok(image)
    }

    /// Its writable memory as it is now.
    fn writable(entry: *const c_void, elf: &Elf) -> Result<Vec<Memory>, LoadError> {
        let offset = elf.entry.ok_or_else(LoadError::no_entry)?;
        let base = (entry as u64).wrapping_sub(offset);
        elf.writable
            .iter()
            .map(|[from, to]| {
                let start =
                    NonNull::new(base.wrapping_add(*from) as *mut u8).ok_or_else(LoadError::no_entry)?;
                let bytes = usize::try_from(to - from).map_err(|_| LoadError::no_entry())?;
                // SAFETY: the program header says that so many bytes from here are mapped and can be read.
                let saved = unsafe { std::slice::from_raw_parts(start.as_ptr(), bytes) }.into();
                Ok(Memory { start, saved })
            })
            .collect()
    }

    /// Sets its writable memory back to what it was after loading.
    pub fn set_back(&mut self) {
        for Memory { start, saved } in &self.memory {
            // SAFETY: writable memory of this image, of that length; nobody else uses the image.
            unsafe { std::ptr::copy_nonoverlapping(saved.as_ptr(), start.as_ptr(), saved.len()) };
        }
    }

    /// Its table.
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// Its name.
    pub fn name(&self) -> String {
        // SAFETY: a C string of the library.
        unsafe { text(self.table.name) }.unwrap_or_default()
    }

    /// A detector of it; why it refused.
    pub fn create(&mut self, drive: &Drive, config: &CString, seed: u64) -> Result<NonNull<c_void>, String> {
        let Some(create) = self.table.create else { return Err("it has no `create`".to_owned()) };
        let mut refused = std::ptr::null();
        // SAFETY: as standstill.h declares it.
        let detector = unsafe { create(drive, config.as_ptr(), seed, &raw mut refused) };
        NonNull::new(detector).ok_or_else(|| {
            // SAFETY: null, or a C string of the library.
            unsafe { text(refused) }.unwrap_or_else(|| "without saying why".to_owned())
        })
    }

    /// Ends a detector.
    pub fn destroy(&mut self, detector: NonNull<c_void>) {
        if let Some(destroy) = self.table.destroy {
            // SAFETY: what `create` returned, given back once.
            unsafe { destroy(detector.as_ptr()) };
        }
    }

    /// The text of a reason.
    pub fn reason(&mut self, code: u32) -> Option<String> {
        // SAFETY: as standstill.h declares it; null, or a C string of the library.
        unsafe { text((self.table.reason?)(code)) }
    }

    /// One call at command level.
    pub fn step(
        &mut self,
        detector: NonNull<c_void>,
        samples: &[Sample],
        command: &mut Command,
        answer: &mut Answer,
    ) -> Option<i32> {
        let count = u32::try_from(samples.len()).ok()?;
        // SAFETY: as standstill.h declares it; so many samples.
        Some(unsafe { (self.table.step?)(detector.as_ptr(), samples.as_ptr(), count, command, answer) })
    }

    /// One call at interrupt level.
    pub fn isr(
        &mut self,
        detector: NonNull<c_void>,
        sample: &Sample,
        legs: &mut Legs,
        answer: &mut Answer,
    ) -> Option<i32> {
        // SAFETY: as standstill.h declares it.
        Some(unsafe { (self.table.isr?)(detector.as_ptr(), sample, legs, answer) })
    }
}

/// A file with these bytes that is in no folder.
fn file_in_memory(bytes: &[u8]) -> std::io::Result<File> {
    // SAFETY: a zero-ended name; the number that is returned is a file of this process, or −1.
    let file = unsafe {
        match libc::memfd_create(c"standstill-detector".as_ptr(), libc::MFD_CLOEXEC) {
            -1 => return Err(std::io::Error::last_os_error()),
            number => File::from_raw_fd(number),
        }
    };
    (&file).write_all(bytes)?;
    Ok(file)
}

/// A path of an open file that no other one had before: the loader takes what it has under a path for the same library, and
/// numbers of files come again. Slashes more or less lead to the same place.
fn path_of(file: &File) -> String {
    static COUNT: AtomicU32 = AtomicU32::new(1);
    let mut count = COUNT.fetch_add(1, Ordering::Relaxed);
    let mut path = format!("/proc/{}/fd", std::process::id());
    while count > 0 {
        path += if count % 2 == 1 { "//." } else { "/." };
        count /= 2;
    }
    path + "/" + &file.as_raw_fd().to_string()
}

/// A C string.
///
/// # Safety
/// It is null or one.
unsafe fn text(from: *const c_char) -> Option<String> {
    // SAFETY: the caller's.
    (!from.is_null()).then(|| unsafe { CStr::from_ptr(from) }.to_string_lossy().into_owned())
}

/// What the loader says; all that is missing, where it names only the first.
fn load_error(error: &libloading::Error, elf: &Elf) -> LoadError {
    let said = std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string);
    let absent: Vec<&str> = elf.needed.iter().filter(|name| is_absent(name)).map(String::as_str).collect();
    if !absent.is_empty() {
        return LoadError::new(
            format!("a library that is linked to {}, which cannot be loaded here", absent.join(", ")),
            "all libraries that it needs (ldd names them): install them, set LD_LIBRARY_PATH, or link what is yours into one file"
                .to_owned(),
        );
    }
    let missing = missing(elf);
    if !missing.is_empty() {
        let names = missing.join(", ");
        return LoadError::new(
            format!("a library that needs {names}, which no library has"),
            "all its functions and variables: compile in what has them, or stub them".to_owned(),
        );
    }
    LoadError::because(said)
}

/// Whether a library that another one needs is not to be had.
fn is_absent(name: &str) -> bool {
    // SAFETY: a library of the system, loaded as the library itself would load it.
    unsafe { Library::new(name) }.is_err()
}

/// What neither this program nor any library that it needs has.
fn missing(elf: &Elf) -> Vec<String> {
    let mut others = vec![Library::this()];
    // SAFETY: libraries of the system, loaded as the library itself would load them.
    others.extend(elf.needed.iter().filter_map(|name| unsafe { Library::new(name) }.ok()));
    let has = |library: &Library, name: &str| {
        let name = CString::new(name).unwrap_or_default();
        // SAFETY: looked up, not used.
        unsafe { library.get::<*const c_void>(name.as_bytes_with_nul()) }.is_ok()
    };
    elf.undefined.iter().filter(|name| !others.iter().any(|library| has(library, name))).cloned().collect()
}

/// Calls into an image with the crash handler knowing of what trial it is.
pub fn during<T>(site: &Site, call: impl FnOnce() -> T) -> T {
    let before = crash::enter(site);
    let result = call();
    crash::leave(before);
    result
}
