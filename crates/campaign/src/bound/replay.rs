//! Recording a detector's commands and playing them to other plants.

use standstill_interface::{
    Command, Detector, Fault, Findings, Leg, Nanos, Outcome, Reading, Sampling, Sensed, Step,
};
use standstill_sim::{Case, Ended, NoProbe, RunError, run};

/// Keeps each command of a detector.
struct Recorder<D> {
    detector: D,
    commands: Vec<Command<f64>>,
}

impl<D: Detector<f64>> Detector<f64> for Recorder<D> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        let step = self.detector.step(readings);
        if let Step::Drive(command) = &step {
            self.commands.push(*command);
        }
        step
    }
}

/// Plays commands and keeps their readings.
struct Player<'a> {
    commands: std::slice::Iter<'a, Command<f64>>,
    readings: Readings,
}

/// Phase currents of all samples, in the order of their triggers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Readings {
    /// In A.
    pub current: Vec<[f64; 3]>,
    /// Whether a sensor of that phase saw it.
    pub measured: Vec<[bool; 3]>,
}

impl Detector<f64> for Player<'_> {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        for reading in readings {
            self.readings.current.push(reading.current.0);
            self.readings.measured.push(reading.sensed.0.map(|sensed| sensed == Sensed::Measured));
        }
        match self.commands.next() {
            Some(command) => Step::Drive(*command),
            None => Step::Done(Outcome::Failed {
                fault: Fault::UnexpectedReadings,
                findings: Findings::default(),
            }),
        }
    }
}

/// The commands that a detector gives, whatever it concludes from the readings.
pub fn record(case: &Case, detector: impl Detector<f64>) -> Result<Vec<Command<f64>>, RunError> {
    let mut recorder = Recorder { detector, commands: Vec::new() };
    match run(case, &mut recorder, false, &mut NoProbe).ended {
        Ended::Outcome(_) => Ok(recorder.commands),
        Ended::Error(error) => Err(error),
    }
}

/// The readings that these commands give.
pub fn replay(case: &Case, commands: &[Command<f64>]) -> Result<Readings, RunError> {
    let mut player = Player { commands: commands.iter(), readings: Readings::default() };
    match run(case, &mut player, false, &mut NoProbe).ended {
        Ended::Outcome(_) => Ok(player.readings),
        Ended::Error(error) => Err(error),
    }
}

/// Whether a leg is told a duty.
pub fn has_pwm(command: &Command<f64>) -> bool {
    [Some(command.stage), command.then]
        .iter()
        .flatten()
        .any(|stage| stage.legs.0.iter().any(|leg| matches!(leg, Leg::Duty(_))))
}

/// The same commands, sampled at each whole multiple of `interval` since the start of the first.
pub fn every(commands: &[Command<f64>], interval: Nanos) -> Vec<Command<f64>> {
    let interval = Nanos(interval.0.max(1));
    let mut start = Nanos::ZERO;
    let resample = |command: &Command<f64>| {
        let first = start.0.next_multiple_of(interval.0) - start.0;
        let duration = command.duration();
        start = start + duration;
        // A sample at the end is the first of the next command.
        let count = (duration.0.saturating_sub(first)).div_ceil(interval.0);
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        let sampling =
            if count == 0 { Sampling::NONE } else { Sampling { first: Nanos(first), interval, count } };
        Command { sampling, ..*command }
    };
    commands.iter().map(resample).collect()
}

/// Slope in A/s of the currents about each sample: the difference over `reach` either way, as far as that lies within
/// the command.
pub fn slope(case: &Case, commands: &[Command<f64>], reach: Nanos) -> Result<Vec<[f64; 3]>, RunError> {
    let mut spans = Vec::new();
    let (mut early, mut late) = (commands.to_vec(), commands.to_vec());
    for (early, late) in early.iter_mut().zip(&mut late) {
        let Some(last) = early.sampling.last() else { continue };
        let before = reach.min(early.sampling.first);
        let after = reach.min(early.duration() - last);
        early.sampling.first = early.sampling.first - before;
        late.sampling.first = late.sampling.first + after;
        let count = usize::try_from(early.sampling.count).unwrap_or(usize::MAX);
        spans.extend(std::iter::repeat_n((before + after).seconds(), count));
    }
    let (early, late) = (replay(case, &early)?.current, replay(case, &late)?.current);
    let slope = |((from, to), span): ((&[f64; 3], &[f64; 3]), &f64)| {
        std::array::from_fn(|k| if *span > 0.0 { (to[k] - from[k]) / span } else { 0.0 })
    };
    Ok(early.iter().zip(&late).zip(&spans).map(slope).collect())
}
