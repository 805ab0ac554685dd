//! Keys of the drive that a fit uses.

/// Keys of the drive that a fit uses. Other keys are refused.
pub(super) const DRIVE_KEYS: [&str; 8] = [
    "inverter.devices",
    "inverter.dead_time",
    "inverter.switch_drop",
    "inverter.switch_resistance",
    "inverter.channel_resistance",
    "inverter.diode_drop",
    "inverter.diode_resistance",
    SETTLE_KEY,
];

/// Key of the settling time of the amplifier at the DC-link shunt.
pub(super) const SETTLE_KEY: &str = "sensors.settle";

/// Keys that state the resistance of the switches.
pub(super) const SWITCH_KEYS: [&str; 2] = ["inverter.switch_resistance", "inverter.channel_resistance"];

/// Converts a key of the drive to the name of the fit's estimate for this key.
pub(super) fn estimate_of(key: &str) -> &str {
    if SWITCH_KEYS.contains(&key) { "switch_resistance" } else { key.trim_start_matches("inverter.") }
}
