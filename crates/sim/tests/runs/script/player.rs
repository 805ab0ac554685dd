//! A detector that plays a script: for the simulator's tests, and those of the whole (`tests/suite/bench.rs`).

use standstill_interface::{Command, Detector, Fault, Findings, Outcome, Reading, Step};

/// Plays commands one after the other and keeps all readings.
#[derive(Clone)]
pub struct Script {
    commands: Vec<Command<f64>>,
    next: usize,
    pub readings: Vec<Reading<f64>>,
}

impl Script {
    pub fn new(commands: impl AsRef<[Command<f64>]>) -> Self {
        Self { commands: commands.as_ref().to_vec(), next: 0, readings: Vec::new() }
    }
}

impl Detector<f64> for Script {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        self.readings.extend_from_slice(readings);
        self.next += 1;
        match self.commands.get(self.next - 1) {
            Some(command) => Step::Drive(*command),
            // A script finds nothing; any end will do.
            None => Step::Done(Outcome::Failed {
                fault: Fault::UnexpectedReadings,
                findings: Findings::default(),
            }),
        }
    }
}
