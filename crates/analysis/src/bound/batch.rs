//! The samples of a bound: those that the commands request, and those of a grid besides.

use std::collections::HashSet;

use standstill_interface::{Command, Nanos};
use standstill_sim::{Case, RunError};

use super::information::Sensitivity;
use super::plant::Parameter;
use super::replay::{Readings, Sample, every, replay, slope};

/// Samples during the same commands. The samples of a command are evenly spaced, so its own and those of a grid are replayed one after the
/// other.
pub struct Batches(Vec<Batch>);

/// Commands with one choice of samples.
struct Batch {
    commands: Vec<Command<f64>>,
    /// For each sample, whether it counts. None if all samples count.
    counts: Option<Vec<bool>>,
}

impl Batch {
    /// Returns the samples that count.
    fn of<T>(&self, samples: Vec<T>) -> Vec<T> {
        let Some(counts) = &self.counts else { return samples };
        samples.into_iter().zip(counts).filter_map(|(sample, counts)| counts.then_some(sample)).collect()
    }
}

/// Returns the instants of the samples, since the beginning of the first command.
fn instants(commands: &[Command<f64>]) -> Vec<Nanos> {
    let mut start = Nanos::ZERO;
    let mut instants = Vec::new();
    for command in commands {
        instants.extend((0..command.sampling.count).map(|number| start + command.sampling.trigger(number)));
        start = start + command.duration();
    }
    instants
}

impl Batches {
    /// Takes the samples that the commands request. With an interval, samples at its whole multiples are added, each instant once.
    pub fn new(commands: &[Command<f64>], interval: Option<Nanos>) -> Self {
        let mut batches = vec![Batch { commands: commands.to_vec(), counts: None }];
        if let Some(interval) = interval {
            let own: HashSet<Nanos> = instants(commands).into_iter().collect();
            let grid = every(commands, interval);
            let counts = instants(&grid).iter().map(|instant| !own.contains(instant)).collect();
            batches.push(Batch { commands: grid, counts: Some(counts) });
        }
        Self(batches)
    }

    /// Returns the sensitivities of all samples to a parameter. The default step of the difference quotients is multiplied by `scale`.
    pub fn column(&self, parameter: Parameter, case: &Case, scale: f64) -> Result<Sensitivity, RunError> {
        let mut all: Option<Sensitivity> = None;
        for batch in &self.0 {
            let column = parameter.column(case, &batch.commands, scale)?;
            let slope = batch.of(column.slope);
            match &mut all {
                Some(all) => all.slope.extend(slope),
                None => all = Some(Sensitivity { slope, error: column.error }),
            }
        }
        Ok(all.unwrap_or(Sensitivity { slope: Vec::new(), error: Sample::default() }))
    }

    /// Returns the readings of all samples and their time derivatives. Without jitter there are no derivatives.
    pub fn readings(&self, case: &Case, jitter: Nanos) -> Result<(Readings, Vec<Sample>), RunError> {
        let (mut all, mut slopes) = (Readings::default(), Vec::new());
        for batch in &self.0 {
            let readings = replay(case, &batch.commands)?;
            if jitter > Nanos::ZERO {
                slopes.extend(batch.of(slope(case, &batch.commands, &readings, jitter)?));
            }
            all.value.extend(batch.of(readings.value));
            all.measured.extend(batch.of(readings.measured));
        }
        Ok((all, slopes))
    }
}
