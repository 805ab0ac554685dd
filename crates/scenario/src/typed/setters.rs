//! What each key sets.

use standstill_detect::Method;
use standstill_files::sheet::{Sheet, Sourced};
use standstill_interface::Nanos;
use standstill_plant::{NameplateNumber, Temperature};
use standstill_quantity::{Quantity, Unit};

use crate::Scenario;

/// What becomes of a number in SI.
#[derive(Clone, Copy, Debug)]
pub(super) enum Set {
    /// A number of drive, sensors or load by itself.
    Number(fn(&mut Scenario<Method<f64>>, f64)),
    /// One of the motor's sheet, of which the motor is made anew; none where the sheet does not have it.
    Sheet(fn(&mut Sheet, f64) -> Option<()>),
    /// One of the sheet's nameplate, likewise, and what follows from it in the sheet.
    Nameplate(NameplateNumber),
    /// A temperature, which changes the motor.
    Temperature(fn(&mut Temperature, f64)),
    /// The DC link's voltage, to which the range of its sensor is in proportion.
    Link,
}

use Set::{Link, Nameplate, Number, Sheet as Motor, Temperature as Heat};

/// The setter of a key.
pub(super) fn setter(key: &str) -> Option<Set> {
    SETTERS.iter().find(|(of, _)| *of == key).map(|(_, set)| *set)
}

pub(super) const SETTERS: &[(&str, Set)] = &[
    ("motor.winding.resistance", Motor(|sheet, x| put(&mut sheet.winding.resistance, x))),
    ("motor.winding.mean_inductance", Motor(|sheet, x| put(sheet.winding.mean_inductance.as_mut()?, x))),
    ("motor.winding.saliency", Motor(|sheet, x| put(sheet.winding.saliency.as_mut()?, x))),
    ("motor.winding.leakage", Motor(|sheet, x| put(sheet.winding.leakage.as_mut()?, x))),
    ("motor.winding.magnet_flux", Motor(|sheet, x| put(sheet.winding.magnet_flux.as_mut()?, x))),
    ("motor.nameplate.resistance", Nameplate(NameplateNumber::Resistance)),
    ("motor.nameplate.L_d", Nameplate(NameplateNumber::DAxisInductance)),
    ("motor.nameplate.L_q", Nameplate(NameplateNumber::QAxisInductance)),
    ("motor.nameplate.magnet_flux", Nameplate(NameplateNumber::MagnetFlux)),
    ("motor.nameplate.leakage", Nameplate(NameplateNumber::Leakage)),
    ("motor.rotor.inertia", Motor(|sheet, x| put(&mut sheet.rotor.inertia, x))),
    ("motor.rotor.stiction", Motor(|sheet, x| put(&mut sheet.rotor.stiction, x))),
    ("motor.rotor.coulomb", Motor(|sheet, x| put(&mut sheet.rotor.coulomb, x))),
    ("motor.rotor.viscous", Motor(|sheet, x| put(&mut sheet.rotor.viscous, x))),
    ("motor.rotor.brake_backlash", Motor(|sheet, x| put(sheet.rotor.brake_backlash.as_mut()?, x))),
    ("motor.rotor.cogging_torque", Motor(|sheet, x| put(sheet.rotor.cogging_torque.as_mut()?, x))),
    ("rotor.winding_temperature", Heat(|at, x| at.winding = Some(x))),
    ("rotor.magnet_temperature", Heat(|at, x| at.magnet = Some(x))),
    ("rotor.load", Number(|s, x| s.load_torque = x)),
    ("inverter.dc_link", Link),
    ("inverter.ripple", Number(|s, x| s.drive.link.ripple = x)),
    ("inverter.dead_time", Number(|s, x| s.drive.dead_time = Nanos::from_seconds(x))),
    ("inverter.delay_mismatch", Number(|s, x| s.drive.delay_mismatch = x)),
    ("inverter.switch_drop", Number(|s, x| s.drive.bridge.devices.switch_drop = x)),
    ("inverter.switch_resistance", Number(|s, x| s.drive.bridge.devices.switch_resistance = x)),
    ("inverter.channel_resistance", Number(|s, x| s.drive.bridge.devices.switch_resistance = x)),
    ("inverter.diode_drop", Number(|s, x| s.drive.bridge.devices.diode_drop = x)),
    ("inverter.diode_resistance", Number(|s, x| s.drive.bridge.devices.diode_resistance = x)),
    ("sensors.noise", Number(|s, x| s.sensors.noise = x)),
    ("sensors.gain_error", Number(|s, x| s.sensors.gain_error = x)),
    ("sensors.offset", Number(|s, x| s.sensors.offset = x)),
    ("sensors.bandwidth", Number(|s, x| s.sensors.bandwidth = Some(x))),
    ("sensors.bandwidth_mismatch", Number(|s, x| s.sensors.bandwidth_mismatch = x)),
    ("sensors.skew", Number(|s, x| s.sensors.skew = Nanos::from_seconds(x))),
    ("sensors.jitter", Number(|s, x| s.sensors.jitter = Nanos::from_seconds(x))),
    ("sensors.sample_delay", Number(|s, x| s.sensors.sample_delay = Nanos::from_seconds(x))),
    ("sensors.dc_link_gain_error", Number(|s, x| s.sensors.dc_link.gain_error = x)),
    ("sensors.dc_link_offset", Number(|s, x| s.sensors.dc_link.offset = x)),
    ("sensors.dc_link_noise", Number(|s, x| s.sensors.dc_link.noise = x)),
];

#[allow(clippy::unnecessary_wraps, reason = "setters that lack a value give none")]
fn put<U: Unit>(number: &mut Sourced<U>, value: f64) -> Option<()> {
    number.value = Quantity::si(value);
    Some(())
}
