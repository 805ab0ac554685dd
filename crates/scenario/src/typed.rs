//! Setters for tolerances: they write drawn numbers into a scenario, so that the document need not be read for each
//! trial.
//!
//! The setters are used only if, for a few draws at each point, they make the same scenarios as the document, and only
//! for values within the range for which the document was tried. In all other cases, such as a motor whose winding does
//! not agree with its core, the document makes the scenario or reports the error.

#[cfg(test)]
mod tests;

use standstill_detect::Method;
use standstill_plant::{DataSheet, Motor, Temperature};
use standstill_sim::Streams;

use crate::build::{check_channel, check_memory, limits};
use crate::keys::{self, motor};
use crate::scenario::tolerance;
use crate::tables::ScenarioFile;
use crate::tolerances::Drawn;
use crate::{FileError, Scenario};

/// Target that the drawn number of a key sets.
#[derive(Clone, Copy, Debug)]
enum Set {
    /// A number of drive, sensors or load that sets one field of the scenario.
    Number(fn(&mut Scenario<Method<f64>>, f64)),
    /// The DC-link voltage. The range of the DC-link sensor scales with this voltage.
    Link,
    /// A number of the motor's data sheet. The motor is made again from the changed data sheet.
    Motor(motor::Set),
}

/// Returns the setter of a key. Returns none if the key has no setter.
fn setter(key: &str) -> Option<Set> {
    if key == "inverter.dc_link" {
        return Some(Set::Link);
    }
    let motor = motor::SETTERS.iter().find(|(of, _)| *of == key).map(|(_, set)| Set::Motor(*set));
    motor.or_else(|| Some(Set::Number(keys::key(key)?.set?)))
}

/// Setters of all tolerances of a plan.
#[derive(Clone, Debug)]
pub(super) struct Typed {
    setters: Vec<Set>,
    /// Smallest and largest number of each key for which the document was checked.
    tried: Vec<[f64; 2]>,
    /// Tables, data sheet and motor of each point. From these, the motors of trials are made.
    bases: Vec<Base>,
}

/// Tables, data sheet and motor at a point. Drawn numbers replace numbers in copies of these.
#[derive(Clone, Debug)]
pub(super) struct Base {
    /// Tables of the scenario file.
    pub(super) file: ScenarioFile,
    /// The motor's data sheet.
    pub(super) sheet: DataSheet,
    /// The motor before its temperatures are applied.
    pub(super) motor: Motor,
}

/// Makes the scenarios of trials at one point.
#[derive(Debug)]
pub(super) struct Drawer<'a> {
    typed: &'a Typed,
    base: &'a Base,
    /// Copy of the data sheet, into which each trial writes its numbers.
    sheet: DataSheet,
}

impl Typed {
    /// Makes setters for these tolerances. `tried` contains the smallest and largest number of each key for which the document was checked.
    /// `bases` gives the base of each point. Returns none if a key has no setter.
    pub(super) fn new(
        tolerances: &[Drawn],
        tried: Vec<[f64; 2]>,
        bases: impl Iterator<Item = Result<Base, FileError>>,
    ) -> Result<Option<Self>, FileError> {
        let setters = tolerances.iter().map(|drawn| setter(drawn.key())).collect::<Option<Vec<_>>>();
        let Some(setters) = setters else { return Ok(None) };
        Ok(Some(Self { setters, tried, bases: bases.collect::<Result<_, _>>()? }))
    }

    /// Returns a [`Drawer`] for the trials at a point.
    pub(super) fn at(&self, point: usize) -> Drawer<'_> {
        let base = &self.bases[point];
        Drawer { typed: self, base, sheet: base.sheet.clone() }
    }

    /// Returns true if the setters make the same scenarios as the document. `point` is the index of the point. `nominal` is the scenario at
    /// this point without draws.
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
    /// Makes a scenario with values drawn from these streams. Returns none if the setters cannot decide whether the scenario is valid; then
    /// the document must be read.
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
        limits::check(&scenario, [true; 2]).ok()?;
        Some(scenario)
    }
}

impl Base {
    /// Replaces the scenario's motor by a motor with changed numbers, and updates all values that depend on the motor. The nameplate, which
    /// contains the data that the drive knows, is still that of the nominal motor. Returns none if the data sheet or the scenario becomes
    /// invalid.
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

/// Number of draws for which setters are compared with the document at each point.
const TRIED: u64 = 4;
