//! Waiting until the current is gone.

use standstill_interface::{Abc, Command, Fault, Leg, Nanos, Reading, Real, Sampling, Sensed, Stage};

use crate::settings::{SettingsError, require, require_positive};

/// How to wait for the current of the last pulse to be gone: wait, look, and wait again.
///
/// With slow decay the waits are zero vectors until the current is below the threshold, and then one with all
/// gates off, in which the rest goes back to the link within microseconds. With fast decay all gates are off from
/// the beginning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettleSettings<T> {
    /// Length of one wait. The current is sampled at four fifths of it and at its end.
    pub wait: Nanos,
    /// A phase current in A below which it counts as gone: above the sensors' offset and noise, below what
    /// would disturb the next pulse.
    pub threshold: T,
    /// Waits before giving up.
    pub attempts: u16,
}

impl<T: Real> SettleSettings<T> {
    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        require(self.wait.0 >= 5, "settle.wait", "at least 5 ns")?;
        require_positive(self.threshold, "settle.threshold")?;
        require(self.attempts > 0, "settle.attempts", "at least 1")
    }

    /// One wait, with the zero vector or with all gates off.
    pub(crate) fn command(&self, released: bool) -> Command<T> {
        let leg = if released { Leg::Off } else { Leg::Low };
        let early = Nanos(self.wait.0 / 5 * 4);
        let stage = Stage { legs: Abc::new(leg, leg, leg), duration: self.wait };
        Command::hold(stage, Sampling::twice(early, self.wait))
    }

    /// After a wait: the residual currents if they are gone, or else the largest.
    pub(crate) fn judge(&self, readings: &[Reading<T>]) -> Result<Result<Abc<T>, T>, Fault<T>> {
        let [_, last] = readings else { return Err(Fault::UnexpectedReadings) };
        let largest = readings
            .iter()
            .flat_map(|reading| reading.current.0.into_iter().zip(reading.sensed.0))
            .filter(|(_, sensed)| *sensed != Sensed::Hidden)
            .fold(T::zero(), |largest, (current, _)| largest.max(current.abs()));
        Ok(if largest <= self.threshold { Ok(last.current) } else { Err(largest) })
    }
}
