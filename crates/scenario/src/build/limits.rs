//! Limits that depend on the motor: largest resistances of switches and diodes, from the winding's time constant, and
//! the largest load torque, from the rotor's acceleration.

use std::f64::consts::TAU;

use standstill_inverter::DeviceKind;

use crate::Scenario;
use crate::document::FileError;

/// Shortest allowed time constant in s. The smaller inductance of the winding and the resistance of a switch or diode form this time
/// constant. Data sheets have the same limit for the winding alone.
const LEAST_TIME_CONSTANT: f64 = 1e-6;

/// Largest acceleration of a rotor by its load, in revolutions per minute and second. The key `rotor.acceleration` has the same limit.
const MOST_ACCELERATION: f64 = 1e7;

/// Checks the load torque and the resistances of switches and diodes. The two flags of `given` are true if the file gives the resistance of
/// the switches and of the diodes. A resistance that the file does not give is not checked, because the error set scales it to the motor.
///
/// # Errors
/// A device makes the winding's time constant shorter than a microsecond, or the load accelerates the rotor by more than
/// 10 million revolutions per minute and second.
pub(crate) fn check<M>(scenario: &Scenario<M>, given: [bool; 2]) -> Result<(), FileError> {
    let winding = &scenario.motor.winding;
    let most = winding.d_axis_inductance().min(winding.q_axis_inductance()) / LEAST_TIME_CONSTANT;
    let devices = &scenario.drive.bridge.devices;
    let switch = match devices.kind {
        DeviceKind::Mosfet => "inverter.channel_resistance",
        DeviceKind::Igbt => "inverter.switch_resistance",
    };
    let of_devices =
        [(switch, devices.switch_resistance), ("inverter.diode_resistance", devices.diode_resistance)];
    let mut of_given = of_devices.into_iter().zip(given).filter(|(_, given)| *given).map(|(of, _)| of);
    if let Some((key, found)) = of_given.find(|(_, resistance)| *resistance > most) {
        let needed = format!(
            "at most {most:.4} Ω, with which the motor's smaller inductance has a time constant of 1 µs, as every motor with its drive has"
        );
        return Err(FileError::key(key, &format!("{found} Ω"), &needed));
    }
    let most = scenario.motor.rotor.inertia * MOST_ACCELERATION * (TAU / 60.0);
    if scenario.load_torque.abs() > most {
        let needed = format!(
            "at most {most:.4} N m either way, which accelerate this rotor by {MOST_ACCELERATION} rpm/s: a rotor of a gram's weight has as much at rated torque"
        );
        return Err(FileError::key("rotor.load", &format!("{} N m", scenario.load_torque), &needed));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::tests::{error, scenario};

    #[test]
    fn analytic_devices_leave_the_winding_a_microsecond() {
        // L_d = 3/2 (9.2 − 2.1) mH without leakage or more: 10 kΩ are a microsecond.
        let winding = scenario("").motor.winding;
        let most = 1e6 * winding.d_axis_inductance().min(winding.q_axis_inductance());
        for key in ["inverter.switch_resistance", "inverter.diode_resistance"] {
            scenario(&format!("{key} = {:e}", 0.999 * most));
            let message = error(&format!("{key} = {:e}", 1.001 * most));
            assert!(message.contains(key) && message.contains("time constant of 1 µs"), "{message}");
        }
    }

    #[test]
    fn analytic_a_load_turns_no_rotor_in_no_time() {
        let inertia = scenario("").motor.rotor.inertia;
        let most = inertia * 1e7 * std::f64::consts::TAU / 60.0;
        let text = |share: f64| format!("rotor.state = \"free\"\nrotor.load = {:e}", share * most);
        scenario(&text(-0.999));
        for share in [1.001, -1.001] {
            let message = error(&text(share));
            assert!(message.contains("rotor.load") && message.contains("rpm/s"), "{message}");
        }
    }
}
