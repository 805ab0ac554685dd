//! In place of `image.rs` where libraries are not loaded yet: no image can be had, so nothing here is ever called.

use std::convert::Infallible;
use std::ffi::{CString, c_void};
use std::ptr::NonNull;
use std::sync::Arc;

use crate::elf::Elf;
use crate::library::LoadError;
use standstill_interface::abi::{Answer, Command, Drive, Legs, Sample, Table};

/// None.
pub struct Image(Infallible);

/// What a library is called for.
#[allow(dead_code, reason = "nothing is called here")]
#[derive(Debug)]
pub enum Moment {
    Load,
    Check,
    Trial(u64),
}

/// None.
#[derive(Debug)]
pub struct Site;

impl Site {
    pub fn new(_: &Arc<str>, _: Moment) -> Self {
        Self
    }
}

/// Calls.
pub fn during<T>(_: &Site, call: impl FnOnce() -> T) -> T {
    call()
}

impl Image {
    pub fn load(_: &[u8], _: &Elf, _: &Site) -> Result<Self, LoadError> {
        Err(LoadError::elsewhere())
    }

    pub fn set_back(&mut self) {
        match self.0 {}
    }

    pub fn table(&self) -> &Table {
        match self.0 {}
    }

    pub fn name(&self) -> String {
        match self.0 {}
    }

    pub fn create(&mut self, _: &Drive, _: &CString, _: u64) -> Result<NonNull<c_void>, String> {
        match self.0 {}
    }

    pub fn destroy(&mut self, _: NonNull<c_void>) {
        match self.0 {}
    }

    pub fn reason(&mut self, _: u32) -> Option<String> {
        match self.0 {}
    }

    pub fn step(&mut self, _: NonNull<c_void>, _: &[Sample], _: &mut Command, _: &mut Answer) -> Option<i32> {
        match self.0 {}
    }

    pub fn isr(&mut self, _: NonNull<c_void>, _: &Sample, _: &mut Legs, _: &mut Answer) -> Option<i32> {
        match self.0 {}
    }
}
