//! A pulse of a train, and the phases without their own sensor.

use standstill_interface::{Phase, Reading, Sensed};

use super::LINES;

/// The position of a pulse in a train.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Slot {
    /// Index into [`LINES`].
    pub line: usize,
    /// True for current from the line's first phase to its second, false for the opposite direction.
    pub forward: bool,
}

impl Slot {
    /// Returns the pulse with this index; odd rounds run backwards.
    pub fn of(index: u16) -> Self {
        let (round, place) = (index / 6, usize::from(index % 6));
        let place = if round.is_multiple_of(2) { place } else { 5 - place };
        Self { line: place / 2, forward: place.is_multiple_of(2) }
    }

    /// Returns the line's phases in the direction of the current.
    pub fn phases(self) -> (Phase, Phase) {
        let (first, second) = LINES[self.line];
        if self.forward { (first, second) } else { (second, first) }
    }
}

/// The phases without their own sensor, whose currents are derived from the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Derived {
    /// All phases have a sensor.
    None,
    /// This phase has no sensor, the other two have one each in line.
    One(Phase),
    /// Different phases at different times, by shunts below the legs. The sensor changes with the direction of the
    /// current, so a difference of gains looks like saturation.
    Several,
}

impl Derived {
    /// Returns the phases without their own sensor, updated by a reading.
    pub fn with<T>(self, reading: &Reading<T>) -> Self {
        Phase::ALL.into_iter().filter(|phase| reading.sensed[*phase] == Sensed::Derived).fold(
            self,
            |derived, phase| match derived {
                Self::None => Self::One(phase),
                Self::One(other) if other == phase => derived,
                _ => Self::Several,
            },
        )
    }
}
