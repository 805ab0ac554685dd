//! Tolerances that set a number of a scenario, without reading its document anew for each trial.
//!
//! A setter is used where it makes, on a few draws at each point, the very scenario that the document makes, and for values
//! between the least and the largest that the document was tried with. What it makes otherwise, such as a motor whose winding
//! does not agree with its core, is left to the document too, which says what is wrong.

#[cfg(test)]
mod tests;

use standstill_detect::Method;
use standstill_plant::{DataSheet, Motor, Temperature};
use standstill_sim::Streams;

use crate::build::{check_channel, check_memory};
use crate::keys::{self, motor};
use crate::scenario::tolerance;
use crate::tables::ScenarioFile;
use crate::tolerances::Drawn;
use crate::{FileError, Scenario};

/// The number that a drawn key sets.
#[derive(Clone, Copy, Debug)]
enum Set {
    /// Of drive, sensors or load, by itself.
    Number(fn(&mut Scenario<Method<f64>>, f64)),
    /// The DC link's voltage, to which the range of its sensor is in proportion.
    Link,
    /// A number of the motor's data sheet; the motor is made anew from it.
    Motor(motor::Set),
}

/// The setter of a key, if it has one.
fn setter(key: &str) -> Option<Set> {
    if key == "inverter.dc_link" {
        return Some(Set::Link);
    }
    let motor = motor::SETTERS.iter().find(|(of, _)| *of == key).map(|(_, set)| Set::Motor(*set));
    motor.or_else(|| Some(Set::Number(keys::key(key)?.set?)))
}

/// A setter for each tolerance.
#[derive(Clone, Debug)]
pub(super) struct Typed {
    setters: Vec<Set>,
    /// The least and the largest number that the document was tried with.
    tried: Vec<[f64; 2]>,
    /// Tables and data sheet of each point, of which motors are made.
    bases: Vec<Base>,
}

/// Tables, data sheet and motor at a point, into which drawn numbers are put.
#[derive(Clone, Debug)]
pub(super) struct Base {
    /// The tables.
    pub(super) file: ScenarioFile,
    /// The motor's data sheet.
    pub(super) sheet: DataSheet,
    /// The motor before its temperatures.
    pub(super) motor: Motor,
}

/// One trial's scenario after the other, at a point.
#[derive(Debug)]
pub(super) struct Drawer<'a> {
    typed: &'a Typed,
    base: &'a Base,
    /// In which each trial's numbers take the place of those of the trial before.
    sheet: DataSheet,
}

impl Typed {
    /// For these tolerances, if each has a setter; `base` makes what is at each point.
    pub(super) fn new(
        tolerances: &[Drawn],
        tried: Vec<[f64; 2]>,
        bases: impl Iterator<Item = Result<Base, FileError>>,
    ) -> Result<Option<Self>, FileError> {
        let setters = tolerances.iter().map(|drawn| setter(drawn.key())).collect::<Option<Vec<_>>>();
        let Some(setters) = setters else { return Ok(None) };
        Ok(Some(Self { setters, tried, bases: bases.collect::<Result<_, _>>()? }))
    }

    /// At a point.
    pub(super) fn at(&self, point: usize) -> Drawer<'_> {
        let base = &self.bases[point];
        Drawer { typed: self, base, sheet: base.sheet.clone() }
    }

    /// True if the setters make the document's scenarios, `nominal` being the scenario at a point without draws.
    pub(super) fn agrees(
        &self,
        tolerances: &[Drawn],
        (point, nominal): (usize, &Scenario<Method<f64>>),
        document: impl Fn(Streams) -> Result<Scenario<Method<f64>>, FileError>,
    ) -> bool {
        let mut drawer = self.at(point);
        (0..TRIED).all(|trial| {
            let streams = Streams::new(nominal.seed, trial);
            let drawn = drawer.drawn(tolerances, nominal, streams);
            drawn.is_none_or(|drawn| document(streams).is_ok_and(|expected| expected == drawn))
        })
    }
}

impl Drawer<'_> {
    /// A scenario with what these streams draw; none where the document must say whether it can be.
    pub(super) fn drawn(
        &mut self,
        tolerances: &[Drawn],
        nominal: &Scenario<Method<f64>>,
        streams: Streams,
    ) -> Option<Scenario<Method<f64>>> {
        let Self { typed, base, sheet } = self;
        let mut scenario = nominal.clone();
        let (mut temperature, mut other_motor) = (base.file.temperature(), false);
        for ((drawn, set), [low, high]) in tolerances.iter().zip(&typed.setters).zip(&typed.tried) {
            let number = drawn.number(streams);
            if !(*low..=*high).contains(&number) {
                return None;
            }
            let value = drawn.si(number)?;
            match set {
                Set::Number(set) => set(&mut scenario, value),
                Set::Link => {
                    scenario.drive.link.voltage = value;
                    scenario.sensors.dc_link.adc = base.file.link_converter(&base.motor, value).ok()?;
                }
                Set::Motor(set) => {
                    match set {
                        motor::Set::Sheet(set) => set(sheet.tables_mut(), value)?,
                        motor::Set::Nameplate(number) => sheet.set_nameplate(*number, value)?,
                        motor::Set::Temperature(set) => set(&mut temperature, value),
                    }
                    other_motor = true;
                }
            }
        }
        check_channel(&scenario.drive.bridge.devices, base.motor.rated_current).ok()?;
        if other_motor {
            base.put_motor(&mut scenario, sheet, temperature)?;
        }
        Some(scenario)
    }
}

impl Base {
    /// Puts a motor with other numbers in, and what depends on it beside the drive's knowledge, which is that of the data sheet.
    fn put_motor(
        &self,
        scenario: &mut Scenario<Method<f64>>,
        sheet: &DataSheet,
        temperature: Temperature,
    ) -> Option<()> {
        let motor = sheet.motor_beside(&self.motor).ok()?;
        scenario.tolerance = tolerance(&motor);
        scenario.rotor = self.file.rotor.state().state(&motor)?;
        self.file.inverter.apply_terminals(&mut scenario.drive.bridge, &motor).ok()?;
        let hot = if temperature == Temperature::default() {
            motor
        } else {
            motor.at_temperature(temperature).ok()?
        };
        if scenario.memory && hot.magnetics != scenario.motor.magnetics {
            check_memory(&hot).ok()?;
        }
        scenario.motor = hot;
        Some(())
    }
}

/// Draws on which a setter is compared with the document, at each point.
const TRIED: u64 = 4;
