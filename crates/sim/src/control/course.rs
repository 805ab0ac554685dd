//! The command that is being carried out.

use standstill_interface::{Nanos, Sampling};

/// Progress of the command that is being carried out.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    /// Time at which the command began, since the start of the run.
    pub start: Nanos,
    /// Time at which the command ends, since the start of the run.
    pub end: Nanos,
    /// Instants at which the command asks for samples.
    pub sampling: Sampling,
    /// Number of the trigger after the pending one.
    pub number: u32,
    /// The pending trigger: its nominal time after the command's begin, and its real time with delay and jitter.
    pub pending: Option<(Nanos, Nanos)>,
    /// Number of phases of the pending sample that the converter has already taken, the phase currents in A, and the
    /// voltage of the DC link in V.
    pub taken: usize,
    /// Phase currents in A: see `taken`.
    pub current: [f64; 3],
    /// Voltage of the DC link in V: see `taken`.
    pub dc_link: f64,
    /// Voltages of the terminals in V, converted together with the DC link.
    pub terminal: [f64; 3],
}

impl Course {
    /// Progress before the first command.
    pub const NONE: Self = Self {
        start: Nanos::ZERO,
        end: Nanos::ZERO,
        sampling: Sampling::NONE,
        number: 0,
        pending: None,
        taken: 0,
        current: [0.0; 3],
        dc_link: 0.0,
        terminal: [0.0; 3],
    };

    /// Converts the present values: all phases at once without skew, else one phase per call, `skew` apart. Returns
    /// the currents in A and the DC link's voltage in V once the sample is complete.
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
