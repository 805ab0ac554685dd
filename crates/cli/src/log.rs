//! A detector that records its commands.

use standstill_interface::{Command, Detector, Leg, Nanos, Phase, Reading, Step};

/// One command and the time at which it began.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    pub start: Nanos,
    pub command: Command<f64>,
}

impl Entry {
    /// Returns the phase of the high leg if the command is a line pulse, with one leg high and another leg low. Returns none otherwise.
    pub fn line(&self) -> Option<Phase> {
        let legs = self.command.stage.legs;
        let low = legs.0.contains(&Leg::Low);
        Phase::ALL.into_iter().find(|phase| low && legs[*phase] == Leg::High)
    }

    /// Returns true if the command is a voltage vector, for which all legs are modulated.
    pub fn is_vector(&self) -> bool {
        matches!(self.command.stage.legs.0, [Leg::Duty(_), Leg::Duty(_), Leg::Duty(_)])
    }

    pub fn end(&self) -> Nanos {
        self.start + self.command.duration()
    }
}

/// A detector that records the commands of another detector.
pub struct Logged<D> {
    inner: D,
    now: Nanos,
    pub entries: Vec<Entry>,
}

impl<D> Logged<D> {
    pub fn new(inner: D) -> Self {
        Self { inner, now: Nanos::ZERO, entries: Vec::new() }
    }
}

impl<D: Detector<f64>> Detector<f64> for Logged<D> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        let step = self.inner.step(readings);
        if let Step::Drive(command) = step {
            self.entries.push(Entry { start: self.now, command });
            self.now = self.now + command.duration();
        }
        step
    }
}
