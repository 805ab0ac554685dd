//! The capacitance of the terminals, from the table `[inverter]`.

use standstill_inverter::{Bridge, OpenLeg};
use standstill_plant::Motor;

use super::document::FileError;
use super::keys::{InverterTable, Written};
use super::named::Named;

/// Assumed quality factor of the terminals' ringing: the amplitude about halves in each period. It is used if
/// `inverter.terminal_resistance` does not give the winding's resistance at the ringing frequency.
const QUALITY: f64 = 5.0;

/// Smallest allowed quality factor of the terminals' ringing. At a smaller quality factor, the winding's resistance exceeds half of the
/// characteristic impedance.
const LEAST_QUALITY: f64 = 2.0;

/// Returns the characteristic impedance of the ringing in Ω. It is √(1.5 L/C) with the mean L of L_d and L_q.
fn impedance(bridge: &Bridge, motor: &Motor) -> f64 {
    let winding = &motor.winding;
    let inductance = (winding.d_axis_inductance() + winding.q_axis_inductance()) / 2.0;
    (1.5 * inductance / bridge.terminal_capacitance).sqrt()
}

/// Returns the characteristic impedance in Ω of the slowest ringing, in which two terminals oscillate along the axis of the third phase. It
/// is √(3 L/C) with the larger one of L_d and L_q. Zero without a capacitance.
pub(super) fn slowest_impedance(bridge: &Bridge, motor: &Motor) -> f64 {
    if bridge.terminal_capacitance == 0.0 {
        return 0.0;
    }
    let winding = &motor.winding;
    let inductance = winding.d_axis_inductance().max(winding.q_axis_inductance());
    (3.0 * inductance / bridge.terminal_capacitance).sqrt()
}

/// Sets the assumed resistance that damps the terminals' ringing. Without a capacitance, this resistance is zero.
pub(crate) fn damp(bridge: &mut Bridge, motor: &Motor) {
    bridge.terminal_resistance =
        if bridge.terminal_capacitance > 0.0 { impedance(bridge, motor) / QUALITY } else { 0.0 };
}

impl InverterTable {
    pub(super) fn apply_terminals(&self, bridge: &mut Bridge, motor: &Motor) -> Result<(), FileError> {
        if let Some(value) = self.terminal_capacitance {
            bridge.terminal_capacitance = value.value();
        }
        let resistance = "inverter.terminal_resistance";
        if bridge.terminal_capacitance == 0.0 {
            bridge.terminal_resistance = 0.0;
            return match self.terminal_resistance {
                Some(value) if self.terminal_capacitance.is_none() => {
                    let needed = "`inverter.terminal_capacitance` beside it: without it nothing rings";
                    Err(FileError::key(resistance, &value.to_string(), needed))
                }
                // A sweep over capacitances may contain 0: nothing rings there, and the resistance has no effect.
                _ => Ok(()),
            };
        }
        // Only diodes limit the swing of a terminal. Without diodes, the winding's energy would raise it to 25 kV.
        match self.open_leg {
            Some(Named(open @ OpenLeg::Open)) => {
                let needed = "\"diodes\" where terminals have a capacitance, as those of \"field\" do unless `inverter.terminal_capacitance` is 0: without diodes nothing ends their swing";
                return Err(FileError::key("inverter.open_leg", &format!("\"{}\"", open.name()), needed));
            }
            _ => bridge.open_leg = OpenLeg::Diodes,
        }
        damp(bridge, motor);
        if let Some(value) = self.terminal_resistance {
            let most = impedance(bridge, motor) / LEAST_QUALITY;
            if value.value() > most {
                let needed = format!("from 0 to {most:.3} Ω, half of √(1.5 L/C): with more nothing rings");
                return Err(FileError::key(resistance, &value.readable(&needed), &needed));
            }
            bridge.terminal_resistance = value.value();
        }
        Ok(())
    }
}
