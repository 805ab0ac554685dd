//! The table that `sts_entry` returns, and the check of its version.
#![allow(unsafe_code, reason = "a function of a foreign library is called, and what it returns is read")]

use std::mem::{MaybeUninit, transmute};
use std::ptr::copy_nonoverlapping;

use crate::abi1::{Isr1, Step1};
use crate::library::LoadError;
use standstill_interface::abi::{self, Entry, Isr, Step, Table};

/// The functions of a library's two levels, by the version of its header.
#[derive(Clone, Copy)]
pub enum Calls {
    /// ABI 1.
    First { step: Option<Step1>, isr: Option<Isr1> },
    /// The present one.
    Present,
}

/// The table's first fields, which all versions have.
#[repr(C)]
struct Head {
    abi: u32,
    size: u32,
}

/// The newest version for which a library is asked, to name its version in a message.
const FAR_VERSION: u32 = 16;

/// Returns the table of a library of a known version. The present version is tried first, then version 1.
pub fn table_of(entry: Entry) -> Result<(Table, Calls), LoadError> {
    // SAFETY: as standstill.h declares it; the table is at least its head.
    let asked = |abi| unsafe { entry(abi) };
    // SAFETY: null or a table, which is at least its head.
    let version =
        |table: *const Table| unsafe { table.cast::<Head>().as_ref() }.map(|head| (head.abi, head.size));
    for asked in [abi::ABI, 1].map(asked) {
        match version(asked) {
            None => {}
            Some((version @ (1 | abi::ABI), size)) => {
                large_enough(size, Table::LEAST)?;
                let known = if version == 1 { Table::LEAST } else { size_of::<Table>() };
                let mut table = MaybeUninit::<Table>::zeroed();
                // SAFETY: as large as it says, and no more than its version and this one have in common; of a table zeros are zeros
                // and functions that there are not.
                let mut table = unsafe {
                    let bytes = (size as usize).min(known);
                    copy_nonoverlapping(asked.cast::<u8>(), table.as_mut_ptr().cast(), bytes);
                    table.assume_init()
                };
                if version == abi::ABI {
                    return Ok((table, Calls::Present));
                }
                // SAFETY: of that version these functions have these types.
                let calls = unsafe {
                    let step = transmute::<Option<Step>, Option<Step1>>(table.step.take());
                    Calls::First { step, isr: transmute::<Option<Isr>, Option<Isr1>>(table.isr.take()) }
                };
                return Ok((table, calls));
            }
            Some((other, _)) => return Err(unknown(Some(other))),
        }
    }
    Err(unknown((abi::ABI + 1..=FAR_VERSION).find(|abi| version(asked(*abi)).is_some())))
}

/// Returns a table of a version that is not known here, or none.
fn unknown(version: Option<u32>) -> LoadError {
    let present = abi::ABI;
    match version {
        Some(version) if version > present => LoadError::new(
            format!("a table of ABI {version}, which is newer than this program"),
            format!(
                "one of ABI 1 or {present}: compile it with the standstill.h of this program, or use a program that knows ABI \
                 {version} (`standstill --version` says which one does)"
            ),
        ),
        Some(version) => LoadError::new(
            format!("a table of ABI {version}"),
            format!("one of ABI 1 or {present}, as the header standstill.h says"),
        ),
        None => LoadError::new(
            format!("a library whose sts_entry({present}) and sts_entry(1) give no table"),
            format!("a table of ABI {present}"),
        ),
    }
}

/// Returns whether a table of so many bytes has all fields that its version has had from the beginning.
fn large_enough(size: u32, needed: usize) -> Result<(), LoadError> {
    if size as usize >= needed {
        return Ok(());
    }
    Err(LoadError::new(
        format!("a table of {size} bytes"),
        format!("at least {needed} bytes, sizeof(sts_detector)"),
    ))
}
