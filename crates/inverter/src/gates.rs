//! Gate states of a leg, and their delays.

use standstill_interface::Nanos;

/// Which switch of a leg is on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Gate {
    /// Neither.
    #[default]
    Off,
    /// The lower.
    Low,
    /// The upper.
    High,
}

/// Timing of one leg's gates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GateTiming {
    /// From the command to switch off to the switch being off.
    pub turn_off_delay: Nanos,
    /// From the end of the dead time to the switch being on.
    pub turn_on_delay: Nanos,
    /// Every switch-on waits this long, whatever the leg did before, as hardware dead-time generators do.
    pub dead_time: Nanos,
}
