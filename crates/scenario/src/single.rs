//! Documents that are a single scenario without axes, and single trials of a plan.

use standstill_detect::Method;
use standstill_plant::{DataSheet, Motor};
use standstill_quantity::short;
use standstill_sim::{Case, Streams};
use toml::Value;

use super::axes::DesignTable;
use super::document::{Document, FileError};
use super::plan::Plan;
use super::tables::ScenarioFile;
use crate::{Scenario, specimen};

impl Document {
    /// Returns true if the document has no keys.
    pub fn is_empty(&self) -> bool {
        self.table.is_empty()
    }

    /// Loads the tables of a document and checks that it is a single scenario, with the same motor in all trials.
    ///
    /// # Errors
    /// The document has axes, tolerances or stop conditions, which only `run` and `sweep` use.
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

    /// Builds the document's motor.
    pub fn motor(&self) -> Result<Motor, FileError> {
        self.load()?.motor(self.files()).map_err(|error| self.locate(error))
    }

    /// Reads the motor's data sheet. It includes the values that were assumed.
    pub fn data_sheet(&self) -> Result<DataSheet, FileError> {
        self.load()?.motor.sheet(self.files()).map_err(|error| self.locate(error))
    }

    /// Builds the scenario. `motor` is the document's motor, which the caller has already built.
    pub fn scenario_of(&self, motor: &Motor) -> Result<Scenario<Method<f64>>, FileError> {
        self.load()?.scenario_of(motor, self.files()).map_err(|error| self.locate(error))
    }

    /// Builds the scenario with this motor. Does not check that the method can work with its settings.
    pub fn unchecked_scenario_of(&self, motor: &Motor) -> Result<Scenario<Method<f64>>, FileError> {
        self.load()?.assemble(motor, self.files()).map_err(|error| self.locate(error))
    }
}

/// One trial of a plan.
#[derive(Clone, Debug)]
pub struct Single {
    /// Index of the point on the sweep axes.
    pub point: usize,
    /// Number of the trial.
    pub trial: u64,
    /// The scenario with the values that the trial draws.
    pub scenario: Scenario<Method<f64>>,
    /// Keys with tolerances, each with the value that the trial draws.
    pub drawn: Vec<(String, Value)>,
}

impl Single {
    /// Returns the case that is simulated. It contains the rotor angle and a specimen of drive and sensors.
    pub fn case(&self) -> Case<'_> {
        self.scenario.case(self.trial)
    }

    /// Returns the draws of the trial by name, as [`specimen`] does, and its failure modes. A failure mode that changes the drive's
    /// knowledge of the motor is not part of the [`Case`].
    pub fn in_words(&self) -> Vec<(String, String)> {
        let modes = self.scenario.faults.iter().map(|fault| {
            let [least, most] = fault.size;
            let size = (least == most && most != 0.0).then(|| format!(", magnitude {}", short(most)));
            ("failure mode".to_owned(), fault.mode.name().to_owned() + &size.unwrap_or_default())
        });
        specimen(&self.case(), &self.drawn).into_iter().chain(modes).collect()
    }
}

impl Plan {
    /// Returns the trial with this number at a point. Its draws are those with which [`Plan::trial`] runs the trial.
    ///
    /// # Errors
    /// A drawn value is invalid.
    ///
    /// # Panics
    /// The plan has no point with this index.
    pub fn single(&self, point: usize, trial: u64) -> Result<Single, FileError> {
        let nominal = self.scenario(point)?;
        let drawn = self.draws(Streams::new(self.file().seed, trial));
        let scenario =
            if drawn.is_empty() { nominal } else { self.with_drawn(point, Some(&nominal), &drawn)? };
        Ok(Single { point, trial, scenario, drawn })
    }
}
