//! Functions of the C library that return newly allocated memory. In an image they use the image's `malloc`, so that
//! the memory is restored together with the variables that point to it and `free` accepts it.
#![allow(unsafe_code, reason = "functions of the C library are replaced")]

#[cfg(target_arch = "x86_64")]
use std::ffi::c_void;
use std::ffi::{c_char, c_int};
use std::ptr;

use crate::runtime::{malloc, realloc};

/// A C program's wide character.
type Wide = libc::wchar_t;

unsafe extern "C" {
    #[cfg(target_arch = "x86_64")]
    fn vasprintf(into: *mut *mut c_char, format: *const c_char, list: *mut c_void) -> c_int;
    #[link_name = "getdelim"]
    fn read_until(
        into: *mut *mut c_char,
        room: *mut usize,
        end: c_int,
        from: *mut libc::FILE,
    ) -> libc::ssize_t;
}

/// Copies this number of bytes to the image's memory and returns the copy; null if there is no room.
unsafe fn copied(from: *const c_char, bytes: usize) -> *mut c_char {
    let copy = malloc(bytes).cast::<c_char>();
    if !copy.is_null() {
        // SAFETY: the caller has so many bytes there; a new block of as many.
        unsafe { ptr::copy_nonoverlapping(from, copy, bytes) };
    }
    copy
}

/// Returns a text that the C library allocated as one of the image; null stays null.
unsafe fn adopted(text: *mut c_char) -> *mut c_char {
    if text.is_null() {
        return text;
    }
    // SAFETY: a C string of the C library's own memory, which is given back once.
    unsafe {
        let copy = strdup(text);
        libc::free(text.cast());
        copy
    }
}

unsafe extern "C" fn strdup(text: *const c_char) -> *mut c_char {
    // SAFETY: the caller's, as of `strdup`.
    unsafe { strndup(text, libc::strlen(text)) }
}

unsafe extern "C" fn strndup(text: *const c_char, most: usize) -> *mut c_char {
    // SAFETY: the caller's, as of `strndup`; a new block of one byte more.
    unsafe {
        let length = libc::strnlen(text, most);
        let copy = malloc(length + 1).cast::<c_char>();
        if !copy.is_null() {
            ptr::copy_nonoverlapping(text, copy, length);
            *copy.add(length) = 0;
        }
        copy
    }
}

unsafe extern "C" fn wcsdup(text: *const Wide) -> *mut Wide {
    // SAFETY: the caller's, as of `wcsdup`.
    unsafe { copied(text.cast(), (libc::wcslen(text) + 1) * size_of::<Wide>()).cast() }
}

unsafe extern "C" fn getdelim(
    into: *mut *mut c_char,
    room: *mut usize,
    end: c_int,
    from: *mut libc::FILE,
) -> libc::ssize_t {
    let (mut text, mut size) = (ptr::null_mut(), 0);
    // SAFETY: the caller's, as of `getdelim`: `into` is null or a block of the image of `room` bytes.
    unsafe {
        let count = read_until(&raw mut text, &raw mut size, end, from);
        let needed = usize::try_from(count).map_or(0, |count| count + 1);
        if (*into).is_null() || *room < needed {
            *into = realloc(*into.cast(), needed.max(1)).cast();
            *room = needed;
        }
        let fits = !(*into).is_null();
        if fits && needed > 0 {
            ptr::copy_nonoverlapping(text, *into, needed);
        }
        libc::free(text.cast());
        if fits { count } else { -1 }
    }
}

unsafe extern "C" fn getline(
    into: *mut *mut c_char,
    room: *mut usize,
    from: *mut libc::FILE,
) -> libc::ssize_t {
    // SAFETY: the caller's, as of `getline`.
    unsafe { getdelim(into, room, c_int::from(b'\n'), from) }
}

unsafe extern "C" fn realpath(path: *const c_char, into: *mut c_char) -> *mut c_char {
    // SAFETY: the caller's, as of `realpath`.
    unsafe { if into.is_null() { adopted(libc::realpath(path, into)) } else { libc::realpath(path, into) } }
}

unsafe extern "C" fn canonicalize_file_name(path: *const c_char) -> *mut c_char {
    // SAFETY: the caller's, as of `canonicalize_file_name`.
    unsafe { realpath(path, ptr::null_mut()) }
}

unsafe extern "C" fn getcwd(into: *mut c_char, size: usize) -> *mut c_char {
    // SAFETY: the caller's, as of `getcwd`.
    unsafe { if into.is_null() { adopted(libc::getcwd(into, size)) } else { libc::getcwd(into, size) } }
}

extern "C" fn get_current_dir_name() -> *mut c_char {
    // SAFETY: asks for a block of the size that it takes.
    unsafe { getcwd(ptr::null_mut(), 0) }
}

#[cfg(target_arch = "x86_64")]
unsafe extern "C" fn own_vasprintf(
    into: *mut *mut c_char,
    format: *const c_char,
    list: *mut c_void,
) -> c_int {
    // SAFETY: the caller's, as of `vasprintf`; on this machine a list of arguments is passed as a pointer.
    unsafe {
        let mut text = ptr::null_mut();
        let count = vasprintf(&raw mut text, format, list);
        let Ok(length) = usize::try_from(count) else { return count };
        *into = copied(text, length + 1);
        libc::free(text.cast());
        if (*into).is_null() { -1 } else { count }
    }
}

/// Implements `vasprintf` with the compiler's buffer check, whose flag precedes the format.
#[cfg(target_arch = "x86_64")]
unsafe extern "C" fn checked_vasprintf(
    into: *mut *mut c_char,
    _: c_int,
    format: *const c_char,
    list: *mut c_void,
) -> c_int {
    // SAFETY: the caller's.
    unsafe { own_vasprintf(into, format, list) }
}

/// A function with any number of arguments that calls [`own_vasprintf`]. It makes the list of System V's ABI for AMD64: registers first,
/// `$named` bytes of which hold the named arguments, then the stack.
#[cfg(target_arch = "x86_64")]
macro_rules! printing {
    ($name:ident, $named:literal, $format:literal) => {
        #[unsafe(naked)]
        unsafe extern "C" fn $name() {
            core::arch::naked_asm!(
                "sub rsp, 216",
                "mov [rsp + 16], rdx",
                "mov [rsp + 24], rcx",
                "mov [rsp + 32], r8",
                "mov [rsp + 40], r9",
                "movaps [rsp + 48], xmm0",
                "movaps [rsp + 64], xmm1",
                "movaps [rsp + 80], xmm2",
                "movaps [rsp + 96], xmm3",
                "movaps [rsp + 112], xmm4",
                "movaps [rsp + 128], xmm5",
                "movaps [rsp + 144], xmm6",
                "movaps [rsp + 160], xmm7",
                // Bytes of registers for whole numbers and for floating point that are taken; then the stack's and the registers' begin.
                concat!("mov dword ptr [rsp + 176], ", $named),
                "mov dword ptr [rsp + 180], 48",
                "lea rax, [rsp + 224]",
                "mov [rsp + 184], rax",
                "mov [rsp + 192], rsp",
                concat!("mov rsi, ", $format),
                "lea rdx, [rsp + 176]",
                "call {print}",
                "add rsp, 216",
                "ret",
                print = sym own_vasprintf,
            )
        }
    };
}
#[cfg(target_arch = "x86_64")]
printing!(asprintf, "16", "rsi");
#[cfg(target_arch = "x86_64")]
printing!(checked_asprintf, "24", "rdx");

/// Returns an image's replacement of the C library's function with this name; none if it has none.
pub fn in_place_of(name: &str) -> Option<usize> {
    Some(match name {
        "strdup" | "__strdup" => strdup as *const () as usize,
        "strndup" | "__strndup" => strndup as *const () as usize,
        "wcsdup" => wcsdup as *const () as usize,
        "getdelim" | "__getdelim" => getdelim as *const () as usize,
        "getline" => getline as *const () as usize,
        "realpath" | "__realpath_chk" => realpath as *const () as usize,
        "canonicalize_file_name" => canonicalize_file_name as *const () as usize,
        "getcwd" | "__getcwd_chk" => getcwd as *const () as usize,
        "get_current_dir_name" => get_current_dir_name as *const () as usize,
        #[cfg(target_arch = "x86_64")]
        "asprintf" => asprintf as *const () as usize,
        #[cfg(target_arch = "x86_64")]
        "__asprintf_chk" => checked_asprintf as *const () as usize,
        #[cfg(target_arch = "x86_64")]
        "vasprintf" => own_vasprintf as *const () as usize,
        #[cfg(target_arch = "x86_64")]
        "__vasprintf_chk" => checked_vasprintf as *const () as usize,
        _ => return None,
    })
}
