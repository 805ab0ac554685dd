//! What has happened to the gates and is not yet carried into the flow.
//!
//! Most gate edges change nothing: a leg whose current flows through the same device before and after has the same
//! potential. The flow runs on across such an edge, as if it were not there; but should a mode end before it, what
//! follows must see the gates of that time. So edges wait here until the flow has passed them.

use standstill_interface::Nanos;
use standstill_inverter::Gate;

/// What waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Due {
    /// The detector gave a command; only who watches needs to know.
    Command,
    /// A leg's gates changed.
    Gate(usize, Gate),
}

/// More than a PWM period has.
const ROOM: usize = 24;

/// Waiting changes in order of time.
#[derive(Clone, Debug)]
pub struct Deferred {
    waiting: [(Nanos, Due); ROOM],
    first: usize,
    end: usize,
}

impl Deferred {
    pub const fn new() -> Self {
        Self { waiting: [(Nanos::ZERO, Due::Command); ROOM], first: 0, end: 0 }
    }

    /// Whether an instant with a command and three edges still has room.
    pub fn is_nearly_full(&self) -> bool {
        self.end + 4 > ROOM
    }

    /// Adds a change, at a time not before the others'.
    pub fn push(&mut self, at: Nanos, due: Due) {
        self.waiting[self.end] = (at, due);
        self.end += 1;
    }

    /// All that wait.
    pub fn waiting(&self) -> &[(Nanos, Due)] {
        &self.waiting[self.first..self.end]
    }

    /// Takes the first.
    pub fn take(&mut self) -> Option<(Nanos, Due)> {
        let first = *self.waiting().first()?;
        self.first += 1;
        if self.first == self.end {
            (self.first, self.end) = (0, 0);
        }
        Some(first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_what_waits_comes_out_in_order() {
        let mut deferred = Deferred::new();
        for round in 0..100_u64 {
            while !deferred.is_nearly_full() {
                let at = Nanos(round * 100 + deferred.waiting().len() as u64);
                deferred.push(at, Due::Gate(0, Gate::High));
            }
            let waiting = deferred.waiting().len();
            assert!(waiting >= 20);
            for n in 0..waiting as u64 {
                assert_eq!(deferred.take(), Some((Nanos(round * 100 + n), Due::Gate(0, Gate::High))));
            }
            assert_eq!(deferred.take(), None);
        }
    }
}
