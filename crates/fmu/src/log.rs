//! Conversion from and to C: texts, slices and messages, and the catching of panics, which must not leave Rust.

use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

use crate::instance::Outcome;

/// Returns a C text; empty for a null pointer.
///
/// # Safety
/// Null, or a text that ends with a zero byte.
#[allow(unsafe_code)]
pub(crate) unsafe fn text(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: as the caller promises.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
}

/// Returns a C array; empty for a null pointer.
///
/// # Safety
/// Null, or so many values that nobody else writes meanwhile.
#[allow(unsafe_code)]
pub(crate) unsafe fn slice<'a, T>(pointer: *const T, count: usize) -> &'a [T] {
    if pointer.is_null() || count == 0 {
        return &[];
    }
    // SAFETY: as the caller promises.
    unsafe { std::slice::from_raw_parts(pointer, count) }
}

/// Returns a C array to be written; empty for a null pointer.
///
/// # Safety
/// Null, or so many values that nobody else reads or writes meanwhile.
#[allow(unsafe_code)]
pub(crate) unsafe fn slice_mut<'a, T>(pointer: *mut T, count: usize) -> &'a mut [T] {
    if pointer.is_null() || count == 0 {
        return &mut [];
    }
    // SAFETY: as the caller promises.
    unsafe { std::slice::from_raw_parts_mut(pointer, count) }
}

/// Returns a text as C has it, up to its first zero byte.
pub(crate) fn c_text(text: &str) -> CString {
    CString::new(text.split('\0').next().unwrap_or_default()).unwrap_or_default()
}

/// Does it; a panic, which must not reach C, is an error too.
pub(crate) fn guarded<T>(what: impl FnOnce() -> Outcome<T>) -> Outcome<T> {
    catch_unwind(AssertUnwindSafe(what)).unwrap_or_else(|panic| {
        let said = panic.downcast_ref::<String>().map(String::as_str);
        let said = said.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
        Err(format!("a mistake of Standstill, please report it: {said}"))
    })
}

/// Returns the folder of a `file:` address; a path is returned unchanged.
pub(crate) fn folder(address: &str) -> PathBuf {
    let Some(rest) = address.strip_prefix("file:") else { return PathBuf::from(address) };
    // With an authority, which is empty or this machine, or without one.
    let path = match rest.strip_prefix("//") {
        Some(rest) => rest.find('/').map_or(rest, |place| &rest[place..]),
        None => rest,
    };
    let mut parts = path.split('%');
    let mut bytes = parts.next().unwrap_or_default().as_bytes().to_vec();
    for part in parts {
        let escaped = part.get(..2).and_then(|digits| u8::from_str_radix(digits, 16).ok());
        let (byte, rest) = escaped.map_or((b'%', part), |byte| (byte, &part[2..]));
        bytes.push(byte);
        bytes.extend_from_slice(rest.as_bytes());
    }
    let path = String::from_utf8_lossy(&bytes).into_owned();
    // `/C:/…` on Windows.
    let path = if cfg!(windows) { path.trim_start_matches('/').to_owned() } else { path };
    PathBuf::from(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_addresses_of_folders_are_paths() {
        for (address, path) in [
            ("file:///tmp/a%20b/resources", "/tmp/a b/resources"),
            ("file:/tmp/resources/", "/tmp/resources/"),
            ("file://localhost/tmp/r", "/tmp/r"),
            ("/tmp/50%/r", "/tmp/50%/r"),
            ("file:///tmp/50%/%zz/%C3%BC", "/tmp/50%/%zz/ü"),
        ] {
            if !cfg!(windows) {
                assert_eq!(folder(address), PathBuf::from(path), "{address}");
            }
        }
    }

    #[test]
    fn law_a_panic_is_an_error() {
        let outcome = guarded(|| -> Outcome { panic!("of {}", 3) });
        assert!(outcome.expect_err("caught").ends_with("of 3"));
    }
}
