//! A scenario alone: what a document says without axes, and one trial of one that has some.

use standstill_detect::Method;
use standstill_plant::{DataSheet, Motor};
use standstill_sim::{Case, Streams};
use toml::Value;

use super::axes::DesignTable;
use super::document::{Document, FileError};
use super::plan::Plan;
use super::tables::ScenarioFile;
use crate::Scenario;

impl Document {
    /// True without keys.
    pub fn is_empty(&self) -> bool {
        self.table.is_empty()
    }

    /// The tables of a document that is one scenario, with the same motor in all trials.
    ///
    /// # Errors
    /// Axes, tolerances or an early end, which only `run` and `sweep` have a use for.
    pub fn load_single(&self) -> Result<ScenarioFile, FileError> {
        let file = self.load()?;
        let others = [
            ("axes", !file.axes.is_empty()),
            ("design", file.design != DesignTable::default()),
            ("tolerances", !file.tolerances.is_empty()),
            ("stop_at", !file.stop_at.is_empty()),
        ];
        match others.iter().find(|(_, given)| *given) {
            Some((key, _)) => {
                let needed = "a scenario without; `standstill run` and `standstill sweep` have a use for it";
                Err(self.refuse(key, key, needed))
            }
            None => Ok(file),
        }
    }

    /// The motor.
    pub fn motor(&self) -> Result<Motor, FileError> {
        self.load()?.motor(self.files()).map_err(|error| self.locate(error))
    }

    /// The data sheet of its motor, with what was assumed.
    pub fn data_sheet(&self) -> Result<DataSheet, FileError> {
        self.load()?.motor.sheet(self.files()).map_err(|error| self.locate(error))
    }

    /// The scenario on the document's motor, which is there already.
    pub fn scenario_of(&self, motor: &Motor) -> Result<Scenario<Method<f64>>, FileError> {
        self.load()?.scenario_of(motor, self.files()).map_err(|error| self.locate(error))
    }

    /// This trial's scenario, without a check that the method's settings can work.
    pub fn unchecked_scenario_of(&self, motor: &Motor) -> Result<Scenario<Method<f64>>, FileError> {
        self.load()?.assemble(motor, self.files()).map_err(|error| self.locate(error))
    }
}

/// One trial of a plan, by itself.
#[derive(Clone, Debug)]
pub struct Single {
    /// Its point of the axes.
    pub point: usize,
    /// Its number.
    pub trial: u64,
    /// The scenario with what the trial draws.
    pub scenario: Scenario<Method<f64>>,
    /// Keys with tolerances, and the values that it draws.
    pub drawn: Vec<(String, Value)>,
}

impl Single {
    /// The case that is run: its specimen of drive, sensors and rotor angle.
    pub fn case(&self) -> Case<'_> {
        self.scenario.case(self.trial)
    }
}

impl Plan {
    /// A trial at a point, as [`Plan::trial`] runs it.
    ///
    /// # Errors
    /// A value drawn that cannot be.
    ///
    /// # Panics
    /// If there is no such point.
    pub fn single(&self, point: usize, trial: u64) -> Result<Single, FileError> {
        let nominal = self.scenario(point)?;
        let drawn = self.draws(Streams::new(self.file().seed, trial));
        let scenario =
            if drawn.is_empty() { nominal } else { self.with_drawn(point, Some(&nominal), &drawn)? };
        Ok(Single { point, trial, scenario, drawn })
    }
}
