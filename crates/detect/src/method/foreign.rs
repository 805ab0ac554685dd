//! A detector from elsewhere, such as a library written in C: what the bench must know of it beforehand.

use core::convert::Infallible;
use core::marker::PhantomData;

use standstill_interface::{Fault, Findings, Nanos, Reading, Real, Step};

use super::Sequence;
use crate::keys::{Keyed, Setting};
use crate::parts::margin::Margin;
use crate::settings::{Settings, SettingsError};

/// The place of a detector from elsewhere among the methods. No method of this crate: such detectors are made by their
/// scenario, which knows the library, and not from these settings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForeignSettings<T> {
    numbers: PhantomData<T>,
}

impl<T> ForeignSettings<T> {
    /// Of any such detector.
    pub const fn new() -> Self {
        Self { numbers: PhantomData }
    }
}

/// No detector: see [`ForeignSettings`].
#[derive(Clone, Debug)]
pub struct Foreign<T> {
    none: Infallible,
    numbers: PhantomData<T>,
}

impl<T: Real> Sequence<T> for Foreign<T> {
    fn next(&mut self, _: &[Reading<T>]) -> Result<Step<T>, Fault<T>> {
        match self.none {}
    }

    fn findings(&self) -> &Findings<T> {
        match self.none {}
    }

    fn margin(&self) -> Margin<T> {
        match self.none {}
    }
}

impl<T: Real> Keyed for ForeignSettings<T> {
    const SETTINGS: &'static [Setting<Self>] = &[];
}

impl<T: Real> Settings<T> for ForeignSettings<T> {
    type Detector = Foreign<T>;

    fn detector(&self) -> Result<Foreign<T>, SettingsError> {
        Err(SettingsError::own("a detector from a library is made by its scenario, for a case"))
    }

    /// None: its PWM is made of single edges.
    fn carrier_period(&self) -> Option<Nanos> {
        None
    }
}
