//! Time from the onset of a fault to the end of a start without an answer.

use serde::{Deserialize, Serialize};
use standstill_detect::Method;
use standstill_scenario::Scenario;

/// Reaction times of starts: the time from the onset of the fault to the end of a start without an answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reactions {
    /// Number of starts without an answer that ended at the onset of the fault or later.
    pub starts: u64,
    /// Sum of their reaction times in s.
    pub sum: f64,
    /// Longest reaction time in s. Zero if no such start was counted.
    pub longest: f64,
}

impl Reactions {
    /// Returns the mean reaction time in s. None without a start.
    ///
    /// ```
    /// use standstill_analysis::faults::Reactions;
    ///
    /// assert_eq!(Reactions { starts: 4, sum: 6e-3, longest: 2e-3 }.mean(), Some(1.5e-3));
    /// assert_eq!(Reactions::default().mean(), None);
    /// ```
    pub fn mean(&self) -> Option<f64> {
        (self.starts > 0).then(|| self.sum / self.starts as f64)
    }

    /// Returns the longest reaction time in s. None without a start.
    pub fn worst(&self) -> Option<f64> {
        (self.starts > 0).then_some(self.longest)
    }

    /// Adds a start without an answer that ended at `end` and whose fault began at `onset`, in s. Ignores a start that ended before its
    /// fault began, because something else ended it.
    pub(super) fn add(&mut self, onset: f64, end: f64) {
        if end >= onset {
            self.starts += 1;
            self.sum += end - onset;
            self.longest = self.longest.max(end - onset);
        }
    }

    pub(super) fn join(self, other: Self) -> Self {
        Self {
            starts: self.starts + other.starts,
            sum: self.sum + other.sum,
            longest: self.longest.max(other.longest),
        }
    }
}

/// Returns the time in s from the begin of a trial's detection at which its last fault begins. Zero for a fault that exists before and for
/// a drive without a fault. None if the onset counts from a command, whose time only the run knows.
pub(super) fn onset(scenario: &Scenario<Method<f64>>, trial: u64) -> Option<f64> {
    let Some(last) = scenario.faults.last() else { return Some(0.0) };
    if last.command.is_some() {
        return None;
    }
    if last.onset == [0.0; 2] {
        return Some(0.0);
    }
    scenario.case(trial).faults.iter().last().map(|fault| fault.from.seconds())
}
