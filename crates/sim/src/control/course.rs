//! A command on its way.

use standstill_interface::{Nanos, Sampling};

/// A command on its way.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    /// When it began.
    pub start: Nanos,
    /// When it ends.
    pub end: Nanos,
    /// Its samples.
    pub sampling: Sampling,
    /// Of the trigger after the one that is pending.
    pub number: u32,
    /// The next trigger: its nominal time after the start, and when it really samples.
    pub pending: Option<(Nanos, Nanos)>,
}

impl Course {
    /// Before the first command.
    pub const NONE: Self =
        Self { start: Nanos::ZERO, end: Nanos::ZERO, sampling: Sampling::NONE, number: 0, pending: None };
}
