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
    /// How many phases the converter has taken of it already, their currents in A, and the DC link's voltage in V.
    pub taken: usize,
    /// See `taken`.
    pub current: [f64; 3],
    /// See `taken`.
    pub dc_link: f64,
}

impl Course {
    /// Before the first command.
    pub const NONE: Self = Self {
        start: Nanos::ZERO,
        end: Nanos::ZERO,
        sampling: Sampling::NONE,
        number: 0,
        pending: None,
        taken: 0,
        current: [0.0; 3],
        dc_link: 0.0,
    };

    /// The converter takes what is there now, all phases at once, or the next one with the others to follow after the skew
    /// each. When it has all: the currents in A and the DC link in V.
    pub fn converted(&mut self, current: [f64; 3], dc_link: f64, skew: Nanos) -> Option<([f64; 3], f64)> {
        if skew == Nanos::ZERO {
            return Some((current, dc_link));
        }
        if self.taken == 0 {
            self.dc_link = dc_link;
        }
        self.current[self.taken] = current[self.taken];
        self.taken += 1;
        if self.taken < 3 {
            self.pending = self.pending.map(|(nominal, at)| (nominal, (at + skew).min(self.end)));
            return None;
        }
        self.taken = 0;
        Some((self.current, self.dc_link))
    }
}
