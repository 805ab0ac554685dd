//! Gate states of a leg, and their delays.

use standstill_interface::Nanos;

/// The switch of a leg that is on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Gate {
    /// Neither switch is on.
    #[default]
    Off,
    /// The lower switch is on.
    Low,
    /// The upper switch is on.
    High,
}

/// Timing of one leg's gates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GateTiming {
    /// Delay from the command to switch off until the switch is off.
    pub turn_off_delay: Nanos,
    /// Delay from the end of the dead time until the switch is on.
    pub turn_on_delay: Nanos,
    /// Every switch-on waits this long, whatever the leg did before, as hardware dead-time generators do.
    pub dead_time: Nanos,
}
