//! State of the C library that an image has to itself: a heap, random numbers, `strtok`, `errno`, the rounding of floating
//! point. It is set back with the image's variables; the functions of the C library that use it are replaced in the image by
//! those of this file.
#![allow(unsafe_code, reason = "functions of the C library are replaced, and registers of the processor set")]

use std::cell::{Cell, RefCell};
use std::ffi::{CStr, c_char, c_double, c_int, c_long, c_uint, c_void};
use std::path::PathBuf;
use std::ptr;

use crate::elf::Elf;
use crate::float::Float;
use crate::heap::Heap;
use crate::random::{Random, Random48};
use crate::strings;

/// All that an image has besides its variables.
#[derive(Debug)]
#[repr(C)]
pub struct State {
    pub heap: Heap,
    /// Whether memory comes from its heap; otherwise from the program's.
    pub serves: bool,
    /// Whether it is being loaded, when it may load further libraries.
    pub loads: bool,
    /// Whether it wanted to load one later.
    pub loaded_late: bool,
    errno: c_int,
    float: Float,
    random: Random,
    random_48: Random48,
    strtok: *mut c_char,
}

impl State {
    /// Makes the state at a program's start, with this heap.
    pub fn new(heap: Heap) -> Self {
        Self {
            heap,
            serves: true,
            loads: true,
            loaded_late: false,
            errno: 0,
            float: Float::default(),
            random: Random::default(),
            random_48: Random48::default(),
            strtok: ptr::null_mut(),
        }
    }
}

thread_local! {
    /// The image that this thread is in.
    static HERE: Cell<*mut State> = const { Cell::new(ptr::null_mut()) };
    /// Libraries that the image at hand has loaded itself.
    static LOADED: RefCell<Vec<PathBuf>> = const { RefCell::new(Vec::new()) };
}

/// Marks this thread as inside an image until [`leave`]. Returns the processor's previous rounding mode and flags.
///
/// # Safety
/// The state is that of an image in which no other thread is.
#[inline]
pub unsafe fn enter(state: *mut State) -> Float {
    HERE.set(state);
    // SAFETY: the caller's; the thread's own errno.
    unsafe {
        *libc::__errno_location() = (*state).errno;
        (*state).float.begin()
    }
}

/// Marks this thread as outside of the image, see [`enter`].
///
/// # Safety
/// The state is that of [`enter`], and `float` is its result.
#[inline]
pub unsafe fn leave(state: *mut State, float: Float) {
    // SAFETY: the caller's; the thread's own errno.
    unsafe {
        (*state).float.end(float);
        (*state).errno = *libc::__errno_location();
    }
    HERE.set(ptr::null_mut());
}

/// Libraries that were loaded by images of this thread since it was last asked.
pub fn loaded() -> Vec<PathBuf> {
    LOADED.take()
}

/// Returns the image's state, if this thread is in one.
fn here<'a>() -> Option<&'a mut State> {
    // SAFETY: null, or of the image that this thread is in, which nobody else is in; no reference outlives a function below.
    unsafe { HERE.get().as_mut() }
}

fn heap<'a>() -> Option<&'a mut Heap> {
    here().filter(|state| state.serves).map(|state| &mut state.heap)
}

/// Returns the heap whose block it is.
fn heap_of<'a>(block: *const c_void) -> Option<&'a mut Heap> {
    here().map(|state| &mut state.heap).filter(|heap| heap.has(block))
}

fn asked(block: *mut c_void) -> *mut c_void {
    if block.is_null() {
        // SAFETY: the thread's own.
        unsafe { *libc::__errno_location() = libc::ENOMEM };
    }
    block
}

pub extern "C" fn malloc(bytes: usize) -> *mut c_void {
    // SAFETY: the C library's own.
    heap().map_or_else(|| unsafe { libc::malloc(bytes) }, |heap| asked(heap.ask(bytes, 1)))
}

extern "C" fn calloc(count: usize, bytes: usize) -> *mut c_void {
    // SAFETY: the C library's own.
    let Some(heap) = heap() else { return unsafe { libc::calloc(count, bytes) } };
    let bytes = count.saturating_mul(bytes);
    let block = asked(heap.ask(bytes, 1));
    if !block.is_null() {
        // SAFETY: a new block of so many bytes.
        unsafe { block.cast::<u8>().write_bytes(0, bytes) };
    }
    block
}

unsafe extern "C" fn free(block: *mut c_void) {
    match heap_of(block) {
        Some(heap) => heap.give(block),
        // SAFETY: the caller's, as of `free`.
        None => unsafe { libc::free(block) },
    }
}

pub unsafe extern "C" fn realloc(block: *mut c_void, bytes: usize) -> *mut c_void {
    if block.is_null() {
        return malloc(bytes);
    }
    // SAFETY: the caller's, as of `realloc`.
    unsafe {
        let Some(own) = heap_of(block) else { return libc::realloc(block, bytes) };
        let room = Heap::room(block);
        if bytes == 0 {
            own.give(block);
            return ptr::null_mut();
        }
        if bytes <= room {
            return block;
        }
        let new = malloc(bytes);
        if !new.is_null() {
            ptr::copy_nonoverlapping(block.cast::<u8>(), new.cast(), room);
            free(block);
        }
        new
    }
}

unsafe extern "C" fn reallocarray(block: *mut c_void, count: usize, bytes: usize) -> *mut c_void {
    match count.checked_mul(bytes) {
        // SAFETY: the caller's, as of `reallocarray`.
        Some(bytes) => unsafe { realloc(block, bytes) },
        None => asked(ptr::null_mut()),
    }
}

extern "C" fn aligned_alloc(align: usize, bytes: usize) -> *mut c_void {
    // SAFETY: the C library's own.
    let libcs = || unsafe { libc::memalign(align, bytes) };
    heap().map_or_else(libcs, |heap| asked(heap.ask(bytes, align.next_power_of_two())))
}

unsafe extern "C" fn posix_memalign(into: *mut *mut c_void, align: usize, bytes: usize) -> c_int {
    if !align.is_power_of_two() || !align.is_multiple_of(size_of::<usize>()) {
        return libc::EINVAL;
    }
    let block = aligned_alloc(align, bytes);
    if block.is_null() {
        return libc::ENOMEM;
    }
    // SAFETY: the caller's, as of `posix_memalign`.
    unsafe { *into = block };
    0
}

unsafe extern "C" fn malloc_usable_size(block: *mut c_void) -> usize {
    // SAFETY: the caller's, as of `malloc_usable_size`.
    unsafe { if heap_of(block).is_some() { Heap::room(block) } else { libc::malloc_usable_size(block) } }
}

unsafe extern "C" fn strtok(text: *mut c_char, between: *const c_char) -> *mut c_char {
    // SAFETY: the caller's, as of `strtok`.
    here().map_or(ptr::null_mut(), |state| unsafe { libc::strtok_r(text, between, &raw mut state.strtok) })
}

extern "C" fn rand() -> c_int {
    here().map_or(0, |state| state.random.next())
}

extern "C" fn random() -> c_long {
    rand().into()
}

extern "C" fn srand(seed: c_uint) {
    if let Some(state) = here() {
        state.random = Random::of(seed);
    }
}

extern "C" fn drand48() -> c_double {
    here().map_or(0.0, |state| state.random_48.share())
}

extern "C" fn lrand48() -> c_long {
    here().map_or(0, |state| state.random_48.positive())
}

extern "C" fn mrand48() -> c_long {
    here().map_or(0, |state| state.random_48.signed())
}

extern "C" fn srand48(seed: c_long) {
    if let Some(state) = here() {
        state.random_48 = Random48::of(seed);
    }
}

/// Accepts the locale "C" only: another locale would affect the whole program.
unsafe extern "C" fn setlocale(_: c_int, name: *const c_char) -> *mut c_char {
    // SAFETY: null or a C string, as of `setlocale`.
    let name = (!name.is_null()).then(|| unsafe { CStr::from_ptr(name) }.to_bytes());
    match name {
        None | Some(b"" | b"C" | b"POSIX") => c"C".as_ptr().cast_mut(),
        Some(_) => ptr::null_mut(),
    }
}

/// Ignores the function: no function of an image runs at the end of the program, because its variables may be those of
/// an unfinished trial, and each trial registers its functions again.
extern "C" fn atexit(_: *const c_void) -> c_int {
    0
}

extern "C" fn cxa_atexit(_: *const c_void, _: *const c_void, _: *const c_void) -> c_int {
    0
}

/// Loads a further library while the image itself is loaded. Later calls fail, so that a run knows all its libraries.
unsafe extern "C" fn dlopen(name: *const c_char, how: c_int) -> *mut c_void {
    if let Some(state) = here()
        && !state.loads
        && !name.is_null()
    {
        state.loaded_late = true;
        return ptr::null_mut();
    }
    // SAFETY: the caller's, as of `dlopen`; the loader's own description of a library begins with its address and its name.
    unsafe {
        let library = libc::dlopen(name, how);
        let mut map: *const (usize, *const c_char) = ptr::null();
        if !library.is_null()
            && !name.is_null()
            && libc::dlinfo(library, libc::RTLD_DI_LINKMAP, (&raw mut map).cast()) == 0
            && !map.is_null()
            && !(*map).1.is_null()
        {
            let path = PathBuf::from(CStr::from_ptr((*map).1).to_string_lossy().into_owned());
            // It may free what the image gives it.
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if !crate::parts::is_of_program(&name)
                && let Some(elf) = std::fs::read(&path).ok().and_then(|bytes| Elf::parse(&bytes).ok())
            {
                crate::loading::replace((*map).0, &elf, &taking_back);
            }
            LOADED.with_borrow_mut(|all| all.push(path));
        }
        library
    }
}

/// Functions that share a state; where a library asks for the state itself, all of them are the C library's.
const RANDOM: [&str; 6] = ["rand", "srand", "random", "srandom", "initstate", "setstate"];
const RANDOM_48: [&str; 6] = ["drand48", "lrand48", "mrand48", "srand48", "seed48", "lcong48"];
const RANDOM_STATES: [&str; 4] = ["initstate", "setstate", "seed48", "lcong48"];

/// Returns the replacement of a function that frees or resizes blocks, for a library that an image has loaded. The
/// replacement handles the image's blocks and those of the C library.
fn taking_back(name: &str) -> Option<usize> {
    ["free", "realloc", "reallocarray", "malloc_usable_size"]
        .contains(&name)
        .then(|| memory_in_place_of(name))
        .flatten()
}

/// Returns an image's replacement of the C library's function of this name that allocates, releases or measures memory.
fn memory_in_place_of(name: &str) -> Option<usize> {
    Some(match name {
        "malloc" => malloc as *const () as usize,
        "calloc" => calloc as *const () as usize,
        "free" => free as *const () as usize,
        "realloc" => realloc as *const () as usize,
        "reallocarray" => reallocarray as *const () as usize,
        "aligned_alloc" | "memalign" => aligned_alloc as *const () as usize,
        "posix_memalign" => posix_memalign as *const () as usize,
        "malloc_usable_size" => malloc_usable_size as *const () as usize,
        _ => return strings::in_place_of(name),
    })
}

/// Returns an image's replacement of the C library's function with this name; none if the original is used. `memory`:
/// true if the image has a separate heap.
pub fn in_place_of(name: &str, memory: bool, elf: &Elf) -> Option<usize> {
    let beside = |set: &[&str]| {
        set.contains(&name) && set.iter().any(|name| RANDOM_STATES.contains(name) && elf.takes(name))
    };
    if beside(&RANDOM) || beside(&RANDOM_48) {
        return None;
    }
    Some(match name {
        "strtok" => strtok as *const () as usize,
        "rand" => rand as *const () as usize,
        "random" => random as *const () as usize,
        "srand" | "srandom" => srand as *const () as usize,
        "drand48" => drand48 as *const () as usize,
        "lrand48" => lrand48 as *const () as usize,
        "mrand48" => mrand48 as *const () as usize,
        "srand48" => srand48 as *const () as usize,
        "setlocale" => setlocale as *const () as usize,
        "atexit" => atexit as *const () as usize,
        "__cxa_atexit" => cxa_atexit as *const () as usize,
        "dlopen" => dlopen as *const () as usize,
        _ => return memory.then(|| memory_in_place_of(name)).flatten(),
    })
}
