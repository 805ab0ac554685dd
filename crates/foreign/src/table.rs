//! The table that `sts_entry` returns, and the check of its version.
#![allow(unsafe_code, reason = "a function of a foreign library is called, and what it returns is read")]

use std::mem::MaybeUninit;
use std::ptr::copy_nonoverlapping;

use crate::abi1::{Isr1, Step1, Table1};
use crate::library::LoadError;
use standstill_interface::abi::{self, Entry, Table};

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
            Some((abi::ABI, size)) => {
                large_enough(size, Table::LEAST)?;
                let mut table = MaybeUninit::<Table>::zeroed();
                // SAFETY: of this version, as large as it says, and no more than there is room for; of a table zeros are zeros and
                // functions that there are not.
                let table = unsafe {
                    let bytes = (size as usize).min(size_of::<Table>());
                    copy_nonoverlapping(asked.cast::<u8>(), table.as_mut_ptr().cast(), bytes);
                    table.assume_init()
                };
                return Ok((table, Calls::Present));
            }
            Some((1, size)) => {
                large_enough(size, size_of::<Table1>())?;
                // SAFETY: of that version, as large as it says.
                let table = unsafe { *asked.cast::<Table1>() };
                return Ok((table.common(), Calls::First { step: table.step, isr: table.isr }));
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
