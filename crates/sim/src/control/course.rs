//! Progress of the command that is being carried out: its triggers and the conversions of its pending sample.

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
    /// Number of the trigger that follows the pending trigger.
    pub number: u32,
    /// The pending trigger: its nominal time since the begin of the command, and its actual time since the start of the
    /// run, with delay and jitter.
    pub pending: Option<(Nanos, Nanos)>,
    /// Number of phases of the pending sample that the converter has already taken.
    pub taken: usize,
    /// Phase currents in A of the pending sample; valid for the phases that are already converted.
    pub current: [f64; 3],
    /// Voltage in V of the DC link in the pending sample.
    pub dc_link: f64,
    /// Voltages of the terminals in V, which are converted together with the DC link's.
    pub terminal: [f64; 3],
    /// Number of conversions of the pending sample so far.
    pub conversions: u8,
    /// Time of the pending sample's last conversion of phase a, since the start of the run.
    pub converted_at: Nanos,
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
        conversions: 0,
        converted_at: Nanos::ZERO,
    };

    /// Stores the present values in the pending sample. Stores all phases at once if `skew` is zero, else one phase per call.
    /// Returns the phase currents in A and the DC link's voltage in V once all phases have been taken.
    pub fn converted(&mut self, current: [f64; 3], dc_link: f64, skew: Nanos) -> Option<([f64; 3], f64)> {
        if let (0, Some((_, at))) = (self.taken, self.pending) {
            self.converted_at = at;
        }
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

    /// Counts one complete conversion of a sample that averages `count` conversions. If another conversion is due, schedules it
    /// `apart` after the begin of this conversion, or at once if that time has passed, and returns true.
    pub fn repeats(&mut self, count: u8, apart: Nanos) -> bool {
        self.conversions += 1;
        if self.conversions < count {
            let next = self.converted_at + apart;
            self.pending = self.pending.map(|(nominal, at)| (nominal, next.max(at).min(self.end)));
            return true;
        }
        self.conversions = 0;
        false
    }
}
