//! A command on its way.

use standstill_interface::{Command, Leg, Nanos, Sampling};

use crate::case::RunError;

/// Samples that a command may ask for: more than any method needs, fewer than exhaust the memory.
const MOST_SAMPLES: u32 = 1 << 20;

/// A command on its way.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    /// When it began.
    pub start: Nanos,
    /// When it ends.
    pub end: Nanos,
    /// Its samples.
    pub sampling: Sampling,
    /// Of the trigger after the one that is pending.
    pub number: u32,
    /// The next trigger: its nominal time after the start, and when it really samples.
    pub pending: Option<(Nanos, Nanos)>,
}

impl Course {
    /// Before the first command.
    pub const NONE: Self =
        Self { start: Nanos::ZERO, end: Nanos::ZERO, sampling: Sampling::NONE, number: 0, pending: None };
}

/// Whether a command can be carried out.
pub fn validate(command: &Command<f64>, carrier: Nanos) -> Result<(), RunError> {
    let duration = command.duration();
    let sampling = command.sampling;
    let too_many = sampling.count > MOST_SAMPLES;
    if duration == Nanos::ZERO || too_many || sampling.last().is_some_and(|last| last > duration) {
        return Err(RunError::BadCommand);
    }
    let stages = [Some(command.stage), command.then];
    let nonsense =
        |leg: &Leg<f64>| matches!(leg, Leg::Duty(duty) if !duty.is_finite() || carrier == Nanos::ZERO);
    if stages.iter().flatten().any(|stage| stage.legs.0.iter().any(nonsense)) {
        return Err(RunError::BadDuty);
    }
    Ok(())
}
