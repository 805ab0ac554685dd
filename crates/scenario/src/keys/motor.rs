//! Numbers of the motor that trials may draw: their keys, as in the data sheet, and functions that write them into a
//! data sheet from which a trial makes its motor.

use standstill_files::sheet::{Sheet, Sourced};
use standstill_plant::{NameplateNumber, Temperature};
use standstill_quantity::{Quantity, Unit};

/// Number of the motor that the drawn value of a key replaces.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Set {
    /// A number of the data sheet. The function writes the number, and returns none if the data sheet does not have it.
    Sheet(fn(&mut Sheet, f64) -> Option<()>),
    /// A number of the data sheet's nameplate. Other numbers of the data sheet depend on it and change with it.
    Nameplate(NameplateNumber),
    /// A temperature of the winding or the magnets.
    Temperature(fn(&mut Temperature, f64)),
}

use Set::{Nameplate, Sheet as Motor, Temperature as Heat};

pub(crate) const SETTERS: &[(&str, Set)] = &[
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
];

#[allow(clippy::unnecessary_wraps, reason = "setters that lack a value give none")]
fn put<U: Unit>(number: &mut Sourced<U>, value: f64) -> Option<()> {
    number.value = Quantity::si(value);
    Some(())
}
