//! Replacement of `image.rs` for systems on which libraries cannot be loaded yet. No image can be made, so no function
//! of this module is ever called.

use std::convert::Infallible;
use std::ffi::{CString, c_void};
use std::path::PathBuf;
use std::ptr::NonNull;

use crate::fenced::Beyond;
use crate::library::LoadError;
use crate::parts::Part;
use standstill_interface::abi::{Answer, Command, Drive, Legs, Sample, Table};

/// Defines methods of an image that cannot exist.
macro_rules! never {
    ($($name:ident($this:ident: $own:ty $(, _: $type:ty)*) $(-> $answer:ty)?;)*) => {$(
        pub fn $name($this: $own $(, _: $type)*) $(-> $answer)? {
            match $this.never {}
        }
    )*};
}

/// An image, which cannot exist here.
pub struct Image {
    never: Infallible,
    pub loads: Vec<PathBuf>,
}

/// Purpose of a call into a library.
#[allow(dead_code, reason = "nothing is called here")]
#[derive(Debug)]
pub enum Moment {
    Load,
    Check,
    Trial(u64),
}

/// A site, which has no content here.
#[derive(Clone, Copy, Debug)]
pub struct Site;

impl Site {
    pub fn new(_: &'static String, _: Moment) -> Self {
        Self
    }
}

impl std::fmt::Display for Site {
    fn fmt(&self, _: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        Ok(())
    }
}

impl Image {
    pub fn load(_: &[Part], _: Site) -> Result<Self, LoadError> {
        Err(LoadError::elsewhere())
    }

    never! {
        set_back(self: &mut Self);
        loaded_late(self: &Self) -> bool;
        table(self: &Self) -> &Table;
        has(self: &Self) -> [bool; 2];
        name(self: &Self) -> String;
        create(self: &mut Self, _: Site, _: &Drive, _: &CString, _: u64) -> Result<NonNull<c_void>, String>;
        destroy(self: &mut Self, _: Site, _: NonNull<c_void>);
        reason(self: &mut Self, _: Site, _: u32) -> Option<String>;
        task(self: &mut Self, _: Site, _: NonNull<c_void>, _: u64);
        probe(self: &mut Self, _: Site, _: NonNull<c_void>, _: u32) -> Option<(String, f32)>;
        step(self: &mut Self, _: Site, _: NonNull<c_void>, _: &[Sample]) -> Result<Option<(i32, Command, Answer)>, Beyond>;
        isr(self: &mut Self, _: Site, _: NonNull<c_void>, _: &[Sample], _: &mut Legs) -> Result<Option<(i32, Answer)>, Beyond>;
    }
}
