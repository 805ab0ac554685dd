//! The time of a train's commands, and the instants at which it sees the rotor.

use standstill_interface::{Command, Nanos, Real};

use super::Train;

impl<T: Real> Train<T> {
    /// Returns the next command; none at the end.
    pub fn next(&mut self) -> Option<Command<T>> {
        let command = self.following()?;
        self.clock = self.clock + command.duration();
        Some(command)
    }

    /// Returns the mean instants in s, by line, at which the pulses of a train end or, with a lead, are sampled before.
    pub fn instants(&self) -> [T; 3] {
        let pulses = 2 * u64::from(self.settings.rounds);
        self.ends.map(|ends| T::of((Nanos(ends / pulses) - self.lead).seconds()))
    }
}
