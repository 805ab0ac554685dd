//! In place of `image.rs` where libraries are not loaded yet: no image can be had, so nothing here is ever called.

use std::convert::Infallible;
use std::ffi::{CString, c_void};
use std::path::PathBuf;
use std::ptr::NonNull;

use crate::fenced::Beyond;
use crate::library::LoadError;
use crate::parts::Part;
use standstill_interface::abi::{Answer, Command, Drive, Legs, Sample, Table};

/// None.
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

/// None.
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

    pub fn set_back(&mut self) {
        match self.never {}
    }

    pub fn loaded_late(&self) -> bool {
        match self.never {}
    }

    pub fn table(&self) -> &Table {
        match self.never {}
    }

    pub fn has(&self) -> [bool; 2] {
        match self.never {}
    }

    pub fn name(&self) -> String {
        match self.never {}
    }

    pub fn create(&mut self, _: Site, _: &Drive, _: &CString, _: u64) -> Result<NonNull<c_void>, String> {
        match self.never {}
    }

    pub fn destroy(&mut self, _: Site, _: NonNull<c_void>) {
        match self.never {}
    }

    pub fn reason(&mut self, _: Site, _: u32) -> Option<String> {
        match self.never {}
    }

    pub fn task(&mut self, _: Site, _: NonNull<c_void>, _: u64) {
        match self.never {}
    }

    pub fn probe(&mut self, _: Site, _: NonNull<c_void>, _: u32) -> Option<(String, f32)> {
        match self.never {}
    }

    pub fn step(
        &mut self,
        _: Site,
        _: NonNull<c_void>,
        _: &[Sample],
    ) -> Result<Option<(i32, Command, Answer)>, Beyond> {
        match self.never {}
    }

    pub fn isr(
        &mut self,
        _: Site,
        _: NonNull<c_void>,
        _: &[Sample],
        _: &mut Legs,
    ) -> Result<Option<(i32, Answer)>, Beyond> {
        match self.never {}
    }
}
