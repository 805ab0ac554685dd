//! Simulates Tables 1 and 2 of the paper at its five resolver angles.

use standstill_detect::{Settings, SettingsError};
use standstill_interface::{Abc, Angle};
use standstill_sim::{NoProbe, run};

use super::TABLE_2;
use standstill_scenario::{Record, Scenario, Specimen};

/// Simulation of one row of the paper's two tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulatedRow {
    /// Initial electrical rotor angle in degrees. It is the angle of the paper's resolver.
    pub angle_deg: f64,
    /// Line inductances L_AB, L_BC and L_CA in H at this angle, from the paper's equation (4).
    pub ideal_lines: Abc<f64>,
    /// Record of the trial.
    pub record: Record,
    /// Reading of the simulated resolver in degrees.
    pub resolver_deg: f64,
}

impl SimulatedRow {
    /// Returns the found angle minus the simulated resolver's angle, in degrees in the range (−180, 180]°. The paper states its errors in
    /// this way. None if no angle was found.
    pub fn error_to_resolver_deg(&self) -> Option<f64> {
        let resolver = Angle::from_degrees(self.resolver_deg);
        self.record.run.found().map(|found| Angle::from_radians(found).difference(resolver).to_degrees())
    }
}

/// Simulates the tables' five rows. As on the authors' bench, all rows have the same specimen of inverter and sensors. Each row has noise
/// of its own.
///
/// # Errors
/// The detector cannot work with its settings.
pub fn simulate<S: Settings<f64>>(scenario: &Scenario<S>) -> Result<[SimulatedRow; 5], SettingsError> {
    let row = |number: u8| {
        let angle_deg = TABLE_2[usize::from(number)].measured_deg;
        let case = scenario.case_at(angle_deg.to_radians(), Specimen { drive: 0, noise: u64::from(number) });
        let run = run(&case, &mut scenario.detector.detector()?, false, &mut NoProbe);
        Ok::<_, SettingsError>(SimulatedRow {
            angle_deg,
            ideal_lines: scenario.motor.winding.line_inductances(angle_deg.to_radians()),
            record: Record { trial: 0, run },
            resolver_deg: run.resolver_angle.to_degrees().rem_euclid(360.0),
        })
    };
    Ok([row(0)?, row(1)?, row(2)?, row(3)?, row(4)?])
}
