//! Placeholder for a detector that is defined outside this crate, such as a library written in C: its kinds of
//! readings, checks and keys, which the bench must know beforehand.

use core::convert::Infallible;
use core::marker::PhantomData;

use standstill_interface::{Fault, Findings, Reading, Real, Step};

use super::Sequence;
use crate::checks::Checks;
use crate::keys::{Keyed, Setting};
use crate::parts::margin::Margin;
use crate::settings::{SettingsError, Source};

/// The entry among the methods for a detector that is defined outside this crate. The detector itself is made by its
/// scenario, which knows the library, and not from these settings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForeignSettings<T> {
    numbers: PhantomData<T>,
}

impl<T> ForeignSettings<T> {
    /// Makes the settings, which are empty and the same for every such detector.
    pub const fn new() -> Self {
        Self { numbers: PhantomData }
    }
}

/// A placeholder that is never run: see [`ForeignSettings`].
#[derive(Clone, Debug)]
pub struct Foreign<T> {
    none: Infallible,
    numbers: PhantomData<T>,
}

impl<T> Foreign<T> {
    pub(super) fn new(_: ForeignSettings<T>) -> Result<Self, SettingsError> {
        Err(SettingsError::own("a detector from a library is made by its scenario, for a case"))
    }
}

impl<T: Real> Sequence<T> for Foreign<T> {
    fn next(&mut self, _: &[Reading<T>]) -> Result<Step<T>, Fault<T>> {
        match self.none {}
    }

    fn so_far(&self) -> (&Findings<T>, Margin<T>) {
        match self.none {}
    }
}

impl<T: Real> Keyed for ForeignSettings<T> {
    const SOURCES: &'static [Source] = Source::ALL;

    const CHECKS: Checks = Checks::NONE;

    const SETTINGS: &'static [Setting<Self>] = &[];
}
