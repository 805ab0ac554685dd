//! The DC-link capacitor and the sag of its source, from the table `[inverter]`.

#[cfg(test)]
mod tests;

use standstill_inverter::{Sag, Storage};
use standstill_quantity::Quantity;

use super::document::FileError;
use super::keys::InverterTable;

/// Shortest allowed time constant in s of a DC link with a capacitor. A DC link with a shorter time constant has a practically constant
/// voltage, but would make the simulation slow.
const LEAST_TIME_CONSTANT: f64 = 1e-6;

impl InverterTable {
    /// Returns the capacitor of the DC link and the resistance of the source. Returns none for a DC link whose voltage does not depend on
    /// the current.
    pub(super) fn storage(&self) -> Result<Option<Storage>, FileError> {
        match (self.capacitance.map(Quantity::value), self.source_resistance.map(Quantity::value)) {
            (Some(0.0), _) | (None, None) => Ok(None),
            (Some(capacitance), Some(source_resistance)) => {
                let time_constant = capacitance * source_resistance;
                if time_constant < LEAST_TIME_CONSTANT {
                    let found =
                        format!("a time constant of {time_constant:.3e} s with its source_resistance");
                    return Err(FileError::key(
                        "inverter.capacitance",
                        &found,
                        "at least 1 µs, or 0: a stiff link",
                    ));
                }
                Ok(Some(Storage { capacitance, source_resistance }))
            }
            (Some(_), None) => {
                let needed = "`inverter.source_resistance`, through which it is fed";
                Err(FileError::key("inverter.capacitance", "a capacitor alone", needed))
            }
            (None, Some(_)) => {
                let needed = "`inverter.capacitance`, which it feeds";
                Err(FileError::key("inverter.source_resistance", "a resistance alone", needed))
            }
        }
    }

    /// Returns the sag of the source's voltage; none if there is no sag.
    pub(super) fn sag(&self) -> Result<Option<Sag>, FileError> {
        let [depth, start, duration] = [
            self.sag_depth.map(Quantity::value),
            self.sag_start.map(Quantity::value),
            self.sag_duration.map(Quantity::value),
        ];
        match (depth, duration) {
            (Some(0.0), _) => Ok(None),
            (Some(depth), Some(duration)) => Ok(Some(Sag { depth, start: start.unwrap_or(0.0), duration })),
            (Some(_), None) => {
                let needed = "`inverter.sag_duration`, how long it lasts";
                Err(FileError::key("inverter.sag_depth", "a sag without duration", needed))
            }
            (None, None) if start.is_none() => Ok(None),
            (None, _) => {
                let key = if duration.is_some() { "inverter.sag_duration" } else { "inverter.sag_start" };
                Err(FileError::key(key, "a sag without depth", "`inverter.sag_depth`, how deep it is"))
            }
        }
    }
}
