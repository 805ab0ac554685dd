//! Readings: the samples that a drive hands to a detector.

use crate::{Abc, Arithmetic, Nanos, Phase, Real};

/// Origin of a phase current's value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sensed {
    /// Measured by the phase's own sensor.
    #[default]
    Measured,
    /// Derived from the other two phases: the three currents sum to zero.
    Derived,
    /// At the end of the ADC's range; the true current may be larger.
    Clipped,
    /// Not seen by any sensor at this instant (low-side shunts see a leg only while its lower device
    /// conducts); the value is meaningless.
    Hidden,
}

/// Raw codes of the converters: those behind the values, as a firmware reads them from their registers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counts {
    /// Codes of the phase currents. Zero for a phase that its own sensor did not measure.
    pub current: Abc<u32>,
    /// Code of the DC link's voltage.
    pub dc_link: u32,
    /// Code of the current through the shunt in the DC link.
    pub link_current: u32,
    /// Codes of the terminals' voltages.
    pub terminal: Abc<u32>,
}

impl Counts {
    /// Codes of a drive without converters: all zero.
    pub const NONE: Self = Self { current: Abc([0; 3]), dc_link: 0, link_current: 0, terminal: Abc([0; 3]) };
}

/// Time from the begin of a command to the output of the comparator that tripped, as the drive's timer captured it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capture {
    /// Whole ticks of the timer that had passed.
    pub ticks: u32,
    /// The comparator that tripped, named by its phase; phase a if one comparator serves all phases.
    pub comparator: Phase,
}

/// One sample of the drive's sensors. There is no field for the rotor's true angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading<T> {
    /// The trigger's nominal time, counted from the start of the command; for a command with a threshold, from the end
    /// of its first stage.
    pub at: Nanos,
    /// Phase currents in A, positive into the motor.
    pub current: Abc<T>,
    /// Origin of each current's value.
    pub sensed: Abc<Sensed>,
    /// DC-link voltage in V.
    pub dc_link: T,
    /// Whether that was at the end of its converter's range.
    pub dc_link_clipped: bool,
    /// Codes of the converters; zero for values without a converter.
    pub counts: Counts,
    /// Current in A through the shunt between link capacitor and bridge, positive into the bridge.
    pub link_current: T,
    /// Origin of the link current's value; hidden without such a shunt.
    pub link_sensed: Sensed,
    /// Voltages of the terminals in V against the negative rail, behind their dividers.
    pub terminal: Abc<T>,
    /// Origin of each terminal voltage's value; hidden without dividers.
    pub terminal_sensed: Abc<Sensed>,
    /// The comparator's trip in this command, if there was one up to this sample.
    pub capture: Option<Capture>,
}

impl<T: Arithmetic> Reading<T> {
    /// Makes a reading of phase currents in A, each from its own sensor, and of the DC link's voltage in V.
    ///
    /// ```
    /// use standstill_interface::{Nanos, Phase, Reading, Sensed};
    ///
    /// let reading = Reading::measured(Nanos(80_000), [1.0, -0.5, -0.5], 540.0);
    /// assert_eq!(reading.sensed[Phase::B], Sensed::Measured);
    /// assert_eq!(reading.terminal_sensed[Phase::B], Sensed::Hidden);
    /// ```
    pub fn measured(at: Nanos, current: [T; 3], dc_link: T) -> Self {
        Self {
            at,
            current: Abc(current),
            sensed: Abc([Sensed::Measured; 3]),
            dc_link,
            dc_link_clipped: false,
            counts: Counts::NONE,
            link_current: T::of(0.0),
            link_sensed: Sensed::Hidden,
            terminal: Abc([T::of(0.0); 3]),
            terminal_sensed: Abc([Sensed::Hidden; 3]),
            capture: None,
        }
    }
}

impl<T: Real> Reading<T> {
    /// Converts the reading to another numeric type.
    #[inline]
    pub fn cast<U: Real>(&self) -> Reading<U> {
        let cast = |value: T| U::of(value.to_double());
        let (Abc([a, b, c]), Abc([x, y, z])) = (self.current, self.terminal);
        Reading {
            at: self.at,
            current: Abc([cast(a), cast(b), cast(c)]),
            sensed: self.sensed,
            dc_link: cast(self.dc_link),
            dc_link_clipped: self.dc_link_clipped,
            counts: self.counts,
            link_current: cast(self.link_current),
            link_sensed: self.link_sensed,
            terminal: Abc([cast(x), cast(y), cast(z)]),
            terminal_sensed: self.terminal_sensed,
            capture: self.capture,
        }
    }
}
