//! A pulse of a train, and which phases have a sensor of their own.

use standstill_interface::{Phase, Reading, Sensed};

use super::LINES;

/// Which pulse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Slot {
    /// Index into [`LINES`].
    pub line: usize,
    /// From the line's first phase to its second, or back.
    pub forward: bool,
}

impl Slot {
    /// The pulse with this number, odd rounds backwards.
    pub fn of(index: u16) -> Self {
        let (round, place) = (index / 6, usize::from(index % 6));
        let place = if round.is_multiple_of(2) { place } else { 5 - place };
        Self { line: place / 2, forward: place.is_multiple_of(2) }
    }

    /// The line's phases in the direction of the current.
    pub fn phases(self) -> (Phase, Phase) {
        let (first, second) = LINES[self.line];
        if self.forward { (first, second) } else { (second, first) }
    }
}

/// Which phases have no sensor of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Derived {
    /// None.
    None,
    /// This one: two sensors in line.
    One(Phase),
    /// Now one, now another: shunts below the legs. The sensor changes with the direction of the current, and a
    /// difference of gains looks like saturation.
    Several,
}

impl Derived {
    /// After a reading.
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
