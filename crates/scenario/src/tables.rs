//! The tables of a scenario file. Keys that are left out take their values from the error set, or defaults that suit
//! method and motor.

use std::fmt::Write as _;
use std::sync::Arc;

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use standstill_quantity::Quantity;
use standstill_quantity::unit::Degree;
use toml::Value;

use super::axes::{AxisSpec, DesignTable, Point, count, points};
use super::document::FileError;
use super::hosted::Provider;
use super::keys::{DetectorTable, InverterTable, RotorTable, SensorsTable, StopTable};
use super::motor::MotorSpec;
use super::named::Named;
use super::tolerances::Tolerance;
use crate::{ErrorSet, FaultTable};

/// A scenario: motor, drive, sensors, rotor, detector, number of trials.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    /// A built-in motor's name, the path of a data sheet (.toml), or a table: a data sheet in place, or only
    /// the values that differ from those of the motor that its key `base` names.
    #[serde(default)]
    pub motor: MotorSpec,
    /// Set of errors of drive and sensors, for all keys that the tables below do not set.
    #[serde(default)]
    pub errors: Named<ErrorSet>,
    /// Number of trials, at each point if there are axes.
    #[serde(default = "trials")]
    pub trials: u64,
    /// Seed of all random numbers.
    #[serde(default = "seed", with = "super::seed")]
    #[schemars(with = "super::seed::SeedSchema")]
    pub seed: u64,
    /// Widths of the 95 % intervals at which a point ends before all its trials are done.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stop_at: StopTable,
    /// Angle error in degrees: trials with a larger error, wrong poles included, are counted. Default: 2°.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<Quantity<Degree>>,
    /// The rotor: its motion, load and temperatures.
    #[serde(default, skip_serializing_if = "is_default")]
    pub rotor: RotorTable,
    /// The inverter and its DC link.
    #[serde(default, skip_serializing_if = "is_default")]
    pub inverter: InverterTable,
    /// The sensors.
    #[serde(default, skip_serializing_if = "is_default")]
    pub sensors: SensorsTable,
    /// The method and its settings.
    #[serde(default)]
    pub detector: DetectorTable,
    /// Faults of motor, inverter, sensors and software, with which the trials run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<FaultTable>,
    /// The Python class that `detector.python` names, if the program that runs the trials has it.
    #[serde(skip)]
    pub(super) hosted: Option<Arc<dyn Provider>>,
    /// Keys that are varied, such as `"sensors.noise"`.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub axes: IndexMap<String, AxisSpec>,
    /// The points of the axes that are run.
    #[serde(default, skip_serializing_if = "is_default")]
    pub design: DesignTable,
    /// Keys whose value each trial draws from a distribution.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub tolerances: IndexMap<String, Tolerance>,
}

fn is_default<T: Default + PartialEq>(table: &T) -> bool {
    *table == T::default()
}

const fn trials() -> u64 {
    1000
}

const fn seed() -> u64 {
    1
}

impl ScenarioFile {
    /// Returns the TOML text of the scenario file. Axes are written inline, because their order is the order of the
    /// points: TOML would write axes that are tables after those that are lists.
    ///
    /// # Errors
    /// TOML cannot write a value.
    pub fn text(&self) -> Result<String, FileError> {
        let wrong =
            |error: toml::ser::Error| FileError::key("scenario", &error.to_string(), "values that TOML has");
        let mut table = Self { axes: IndexMap::new(), ..self.clone() };
        // `[rotor]` always contains `state`; the table is left out if the rotor is held and no other key is set.
        table.rotor.state = Some(Named(self.rotor.state()));
        if table.rotor == (RotorTable { state: Some(Named::default()), ..RotorTable::default() }) {
            table.rotor = RotorTable::default();
        }
        let other = table.detector.library.is_some() || table.detector.python.is_some();
        if !other && !self.axes.contains_key("detector.library") {
            table.detector.method = Some(Named(table.detector.method()));
        }
        // By way of `Value`, so that the derived `Serialize` code is compiled for one serializer instead of several.
        let mut text = toml::to_string(&Value::try_from(table).map_err(wrong)?).map_err(wrong)?;
        if !self.axes.is_empty() {
            text += "\n[axes]\n";
        }
        for (key, axis) in &self.axes {
            let [key, axis] = [Value::try_from(key).map_err(wrong)?, Value::try_from(axis).map_err(wrong)?];
            let _ = writeln!(text, "{key} = {axis}");
        }
        Ok(text)
    }

    /// Returns the points of the sweep axes.
    ///
    /// # Errors
    /// The axes or the design have no points, or too many.
    pub fn points(&self) -> Result<Vec<Point>, FileError> {
        points(&self.walked(), self.design, self.seed)
    }

    /// Returns the number of points on the axes without making them.
    ///
    /// # Errors
    /// The axes have no points, or too many.
    pub fn point_count(&self) -> Result<usize, FileError> {
        count(&self.walked(), self.design)
    }

    fn walked(&self) -> Vec<(String, AxisSpec)> {
        self.axes.iter().map(|(key, spec)| (key.clone(), spec.clone())).collect()
    }
}
