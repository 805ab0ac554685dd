//! The detector as the drive sees it.

use crate::{Command, Nanos, Outcome, Reading, Real};

/// A detector's next step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use = "a step that is not carried out is lost"]
// A command is small and made once per millisecond; boxing it would need an allocator.
#[allow(clippy::large_enum_variant)]
pub enum Step<T> {
    /// Carry this out and call again with its readings.
    Drive(Command<T>),
    /// The detection is over.
    Done(Outcome<T>),
}

/// A method that finds the rotor's position at standstill.
///
/// The first call gets no readings. Each further call gets exactly the readings of the last command, in the
/// order of their triggers. After [`Step::Done`] it is not called again.
///
/// ```
/// use standstill_interface::{
///     Angle, Command, Detector, Fault, Findings, Nanos, Outcome, Phase, Reading, Sampling, Stage, Step,
/// };
///
/// /// One pulse from phase a to phase b. From the current alone it cannot tell an angle, and says so.
/// struct OnePulse;
///
/// impl Detector<f32> for OnePulse {
///     fn step(&mut self, readings: &[Reading<f32>]) -> Step<f32> {
///         let Some(reading) = readings.first() else {
///             let pulse = Stage::line(Phase::A, Phase::B, Nanos::from_micros(100));
///             return Step::Drive(Command::hold(pulse, Sampling::once(pulse.duration)));
///         };
///         let fault = Fault::NoCurrent { peak: reading.current[Phase::A], needed: 1.0 };
///         Step::Done(Outcome::Failed { fault, findings: Findings::default() })
///     }
/// }
///
/// assert!(matches!(OnePulse.step(&[]), Step::Drive(_)));
/// ```
pub trait Detector<T: Real> {
    /// Returns the next step, given the readings of the last command.
    fn step(&mut self, readings: &[Reading<T>]) -> Step<T>;

    /// Returns the outcome of a detection whose last command would end after `limit`, the longest time of a
    /// detection: it is not carried out. None, as of a detector that cannot order so much: then it is an error of the
    /// run.
    fn overdue(&mut self, limit: Nanos) -> Option<Outcome<T>> {
        let _ = limit;
        None
    }
}
