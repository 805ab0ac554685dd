//! Readings: the samples that a drive hands to a detector.

use crate::{Abc, Nanos};

/// How a phase current came about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sensed {
    /// By its own sensor.
    #[default]
    Measured,
    /// From the other two phases: the three sum to zero.
    Derived,
    /// At the end of the ADC's range: the true current may be larger.
    Clipped,
    /// Not seen by any sensor at this instant (low-side shunts see a leg only while its lower device
    /// conducts); the value is meaningless.
    Hidden,
}

/// Raw codes of the converters: those behind the values, as a firmware reads them from their registers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counts {
    /// Of the phase currents. Zero for a phase that its own sensor did not measure.
    pub current: Abc<u32>,
    /// Of the DC link.
    pub dc_link: u32,
}

impl Counts {
    /// Of a drive without converters.
    pub const NONE: Self = Self { current: Abc([0; 3]), dc_link: 0 };
}

/// One sample of the drive's sensors. There is no field for the rotor's true angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading<T> {
    /// The trigger's nominal time, counted from the start of the command.
    pub at: Nanos,
    /// Phase currents in A, positive into the motor.
    pub current: Abc<T>,
    /// Where each current comes from.
    pub sensed: Abc<Sensed>,
    /// DC-link voltage in V.
    pub dc_link: T,
    /// Whether that was at the end of its converter's range.
    pub dc_link_clipped: bool,
    /// Codes of the converters; zeros where there are none.
    pub counts: Counts,
}
