//! Loading of a file as a library of this process: a copy in memory, replacements of functions of the C library, and
//! initialisation.
#![allow(
    unsafe_code,
    reason = "a foreign library is loaded, its memory written to, and its functions called"
)]

use std::ffi::{CString, c_char, c_int, c_void};
use std::fs::File;
use std::io::Write as _;
use std::os::fd::{AsRawFd as _, FromRawFd as _};
use std::sync::atomic::{AtomicU32, Ordering};

use libloading::os::unix::Library;

use crate::elf::Elf;
use crate::library::LoadError;
use crate::parts::{self, Part};

/// A function that runs when a library is loaded.
type Constructor = unsafe extern "C-unwind" fn(c_int, *const *const c_char, *const *const c_char);

unsafe extern "C" {
    /// Environment variables of the program.
    static environ: *const *const c_char;
}

/// Returns a file with these bytes that is in no folder.
pub fn file_in_memory(bytes: &[u8]) -> std::io::Result<File> {
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

/// Returns a path of an open file that was not used for any other file. The loader treats equal paths as the same
/// library, and file descriptors are reused. Additional slashes and dots make the path unique without changing its
/// target.
pub fn path_of(file: &File) -> String {
    static COUNT: AtomicU32 = AtomicU32::new(1);
    let mut count = COUNT.fetch_add(1, Ordering::Relaxed);
    let mut path = format!("/proc/{}/fd", std::process::id());
    while count > 0 {
        path += if count % 2 == 1 { "//." } else { "/." };
        count /= 2;
    }
    path + "/" + &file.as_raw_fd().to_string()
}

/// Returns the load address of a library.
pub fn base_of(library: &Library) -> Option<usize> {
    let mut map: *const usize = std::ptr::null();
    // SAFETY: the handle is taken out and put back; the loader's own description of a library begins with its address.
    unsafe {
        let handle = std::ptr::read(library).into_raw();
        let known = libc::dlinfo(handle, libc::RTLD_DI_LINKMAP, (&raw mut map).cast()) == 0;
        (known && !map.is_null()).then(|| *map)
    }
}

/// Puts functions of this program in place of those of the C library, by name, in a library that is loaded at `base`.
pub fn replace(base: usize, elf: &Elf, in_place_of: &dyn Fn(&str) -> Option<usize>) {
    for (at, name) in &elf.taken {
        let Some(function) = in_place_of(name) else { continue };
        let place = base.wrapping_add(usize::try_from(*at).unwrap_or(0));
        let stays = elf.writable.iter().any(|[from, to]| (from..to).contains(&at));
        // SAFETY: where the loader has put an address of the same kind; what it has made read-only is so again after that.
        unsafe {
            let page = usize::try_from(libc::sysconf(libc::_SC_PAGESIZE)).unwrap_or(4096);
            let begin = (place & !(page - 1)) as *mut c_void;
            if !stays {
                libc::mprotect(begin, page, libc::PROT_READ | libc::PROT_WRITE);
            }
            (place as *mut usize).write_unaligned(function);
            if !stays {
                libc::mprotect(begin, page, libc::PROT_READ);
            }
        }
    }
}

/// Runs the initialisation functions of a library.
///
/// # Safety
/// The library is loaded at `base`, and none of its functions has run.
pub unsafe fn construct(base: usize, elf: &Elf) {
    let address = |at: u64| base.wrapping_add(usize::try_from(at).unwrap_or(0));
    let arguments: [*const c_char; 1] = [std::ptr::null()];
    let run = |function: usize| {
        // SAFETY: a function of the library, called as the loader calls it.
        unsafe {
            std::mem::transmute::<usize, Constructor>(function)(0, arguments.as_ptr(), environ);
        }
    };
    if let Some(init) = elf.init {
        run(address(init));
    }
    let [from, bytes] = elf.init_array;
    for at in (from..from + bytes).step_by(size_of::<usize>()) {
        // SAFETY: the list of its functions, as the loader has filled it in.
        let function = unsafe { *(address(at) as *const usize) };
        if function != 0 && function != usize::MAX {
            run(function);
        }
    }
}

/// Returns the loader's error, with all missing symbols where the loader names only the first.
pub fn load_error(error: &libloading::Error, parts: &[Part]) -> LoadError {
    let said = std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string);
    let missing = missing(parts);
    if !missing.is_empty() {
        let names = missing.join(", ");
        return LoadError::new(
            format!("a library that needs {names}, which no library has"),
            "all its functions and variables: compile in what has them, or stub them".to_owned(),
        );
    }
    LoadError::because(said)
}

/// Returns the symbols that are undefined in this program, in all parts of the image and in the libraries that these
/// need.
fn missing(parts: &[Part]) -> Vec<String> {
    let mut others = vec![Library::this()];
    let all = || parts.iter().map(|part| &part.elf);
    let needed = all().flat_map(|elf| &elf.needed).filter(|name| parts::is_of_program(name));
    // SAFETY: libraries of the system, loaded as the library itself would load them.
    others.extend(needed.filter_map(|name| unsafe { Library::new(name) }.ok()));
    let has = |name: &str| {
        let zero_ended = CString::new(name).unwrap_or_default();
        // SAFETY: looked up, not used.
        let found = |library: &Library| unsafe {
            library.get::<*const c_void>(zero_ended.as_bytes_with_nul()).is_ok()
        };
        all().any(|elf| elf.exported.iter().any(|known| known == name)) || others.iter().any(found)
    };
    let mut names: Vec<String> =
        all().flat_map(|elf| &elf.undefined).filter(|name| !has(name)).cloned().collect();
    names.dedup();
    names
}
