//! The detectors of the runs in the lanes: any type of detector with numbers of any type.

use standstill_interface::{Abc, Command, Detector, Leg, Outcome, Reading, Real, Stage, Step};
use standstill_numeric::MOST_LANES;

use super::Host;
use crate::case::{Case, Ended, Finished, Run, RunError};

/// Adapter between a detector and the engine. It converts readings and commands between the detector's and the engine's type of numbers,
/// and stores the detector's outcome.
pub struct Adapter<T: Real> {
    readings: Vec<Reading<T>>,
    outcome: Option<Outcome<T>>,
}

impl<T: Real> Adapter<T> {
    /// Makes an adapter for a new run.
    pub fn new() -> Self {
        Self { readings: Vec::new(), outcome: None }
    }

    /// Returns the detector's command after these readings, or `None` if the detector has finished.
    pub fn step<D: Detector<T> + ?Sized>(
        &mut self,
        detector: &mut D,
        readings: &[Reading<f64>],
    ) -> Option<Command<f64>> {
        let readings = T::of_doubles(readings).unwrap_or_else(|| {
            self.readings.clear();
            self.readings.extend(readings.iter().map(Reading::cast));
            &self.readings
        });
        match detector.step(readings) {
            Step::Drive(command) => Some(command_of(&command)),
            Step::Done(outcome) => {
                self.outcome = Some(outcome);
                None
            }
        }
    }

    /// Adds the detector's outcome to a finished run and returns the complete result. The adapter is then ready for the next run.
    pub fn run<D: Detector<T> + ?Sized>(&mut self, finished: &Finished, detector: Option<&mut D>) -> Run<T> {
        if let (Some(RunError::TimeLimit(limit)), Some(detector)) = (finished.run.ended, detector)
            && let Some(outcome) = detector.overdue(limit)
        {
            return finished.run(Ended::Outcome(outcome));
        }
        let ended = match (finished.run.ended, self.outcome.take()) {
            (None, Some(outcome)) => Ended::Outcome(outcome),
            (Some(error), _) => Ended::Error(error),
            (None, None) => unreachable!("a run ends by an error or because its detector is done"),
        };
        finished.run(ended)
    }
}

/// The remaining cases with their detectors, and the cases that run in the lanes at present.
pub struct Slots<T: Real, D, C, F> {
    cases: C,
    done: F,
    begun: usize,
    lanes: [Option<Slot<T, D>>; MOST_LANES],
}

/// A case that runs in a lane, with its number, its detector and its adapter.
struct Slot<T: Real, D> {
    number: usize,
    detector: Option<D>,
    adapter: Adapter<T>,
}

impl<T: Real, D, C, F> Slots<T, D, C, F> {
    /// Makes the slots for these cases. `done` receives each finished run together with the number of its case.
    pub fn new(cases: C, done: F) -> Self {
        Self { cases, done, begun: 0, lanes: [const { None }; MOST_LANES] }
    }
}

impl<'a, T, D, C, F> Host<'a> for Slots<T, D, C, F>
where
    T: Real,
    D: Detector<T>,
    C: Iterator<Item = (Case<'a>, D)>,
    F: FnMut(usize, Run<T>),
{
    fn next(&mut self, lane: usize) -> Option<Case<'a>> {
        let (case, detector) = self.cases.next()?;
        let slot = self.lanes[lane].get_or_insert_with(|| Slot {
            number: 0,
            detector: None,
            adapter: Adapter::new(),
        });
        slot.number = self.begun;
        slot.detector = Some(detector);
        self.begun += 1;
        Some(case)
    }

    fn step(&mut self, lane: usize, readings: &[Reading<f64>]) -> Option<Command<f64>> {
        let slot = self.lanes[lane].as_mut()?;
        slot.adapter.step(slot.detector.as_mut()?, readings)
    }

    fn over(&mut self, lane: usize, finished: &Finished) {
        if let Some(slot) = &mut self.lanes[lane] {
            let run = slot.adapter.run(finished, slot.detector.as_mut());
            (self.done)(slot.number, run);
        }
    }
}

/// Converts a detector's command to double precision.
fn command_of<T: Real>(command: &Command<T>) -> Command<f64> {
    Command {
        stage: stage_of(&command.stage),
        then: command.then.as_ref().map(stage_of),
        sampling: command.sampling,
        threshold: command.threshold.map(T::to_double),
    }
}

/// Converts a stage to double precision, leg by leg. The legs are written out, because `map` of an array is not inlined and would make a
/// short detection 2 % slower.
#[inline]
fn stage_of<T: Real>(stage: &Stage<T>) -> Stage<f64> {
    let Abc([a, b, c]) = &stage.legs;
    Stage { legs: Abc([leg_of(a), leg_of(b), leg_of(c)]), duration: stage.duration }
}

/// Converts the part of a stage for one leg to double precision.
#[inline]
fn leg_of<T: Real>(leg: &Leg<T>) -> Leg<f64> {
    match *leg {
        Leg::Off => Leg::Off,
        Leg::Low => Leg::Low,
        Leg::High => Leg::High,
        Leg::Duty(duty) => Leg::Duty(duty.to_double()),
        Leg::Rise(at) => Leg::Rise(at),
        Leg::Fall(at) => Leg::Fall(at),
    }
}
