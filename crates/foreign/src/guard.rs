//! What a detector from elsewhere may order: commands that there are, and not for ever.

use standstill_interface::{Command, Fault, Leg, Nanos, Own, Phase};

use crate::texts::kept;

/// Samples of a command at most.
const MOST_SAMPLES: u32 = 1 << 20;

/// Commands that may be as short as they like. Beyond them a detection's commands must last a microsecond on average: what
/// orders shorter ones for ever would never come to its limit of time.
const SHORT_COMMANDS: u64 = 100_000;

/// Numbers of reasons that are the bench's.
const NEVER_DONE: u32 = u32::MAX - 1;
const TOO_MANY: u32 = u32::MAX - 3;

/// The commands of one detection of any detector that is not of this program: of a library, or of a class of Python.
#[derive(Clone, Copy, Debug)]
pub struct Guard {
    time_limit: Nanos,
    /// Number and time of all commands up to now.
    commands: u64,
    elapsed: Nanos,
}

impl Guard {
    /// Of a detection that may take so long.
    pub const fn new(time_limit: Nanos) -> Self {
        Self { time_limit, commands: 0, elapsed: Nanos::ZERO }
    }

    /// How long a command lasts at least: a comparator may end the first stage of one with a threshold at once.
    pub fn certain(command: &Command<f64>) -> Nanos {
        match command.threshold {
            None => command.duration(),
            Some(_) => command.then.map_or(Nanos::ZERO, |stage| stage.duration),
        }
    }

    /// Whether a command is one that there is.
    ///
    /// # Errors
    /// The reason why the command is impossible.
    pub fn possible(command: &Command<f64>) -> Result<(), String> {
        let (duration, samples) = (command.duration(), command.sampling.count);
        if duration == Nanos::ZERO {
            return Err("a command without duration".to_owned());
        }
        if samples > MOST_SAMPLES {
            return Err(format!("a command with {samples} samples, more than {MOST_SAMPLES}"));
        }
        // Of a command with a threshold, samples are counted from the end of its first stage.
        let window = match command.threshold {
            None => duration,
            Some(threshold) => {
                Self::can_trip(threshold, command)?;
                duration - command.stage.duration
            }
        };
        match command.sampling.last().filter(|last| *last > window) {
            Some(last) if command.threshold.is_some() => {
                Err(format!("a sample at {} ns after a trip, of a second stage of {} ns", last.0, window.0))
            }
            Some(last) => Err(format!("a sample at {} ns of a command of {} ns", last.0, duration.0)),
            None => Ok(()),
        }
    }

    /// Whether a stage until a threshold in A is one that a comparator can end.
    fn can_trip(threshold: f64, command: &Command<f64>) -> Result<(), String> {
        if !(threshold > 0.0 && threshold.is_finite()) {
            return Err(format!("a command until {threshold} A, not until a finite current above 0"));
        }
        if command.stage.duration == Nanos::ZERO {
            return Err("a command until a threshold whose first stage has no duration".to_owned());
        }
        let keeps = |leg: &Leg<f64>| matches!(leg, Leg::Off | Leg::Low | Leg::High);
        match command.stage.legs.0.iter().position(|leg| !keeps(leg)) {
            Some(leg) => Err(format!(
                "a command until a threshold in whose first stage leg {} switches: it can be off, low or high",
                Phase::ALL[leg].letter()
            )),
            None => Ok(()),
        }
    }

    /// Lets a further command pass; `by_a_timer`: of a length that is not the detector's to choose.
    ///
    /// # Errors
    /// A detection that takes longer than it may, or would never come to its limit.
    pub fn pass(&mut self, duration: Nanos, by_a_timer: bool) -> Result<(), Fault<f64>> {
        let refused = |code, text: &str| Err(Fault::Own(Own { code, text: kept(text) }));
        self.elapsed = self.elapsed + duration;
        if self.elapsed > self.time_limit {
            return refused(NEVER_DONE, &format!("not done within {} s", self.time_limit.0 as f64 / 1e9));
        }
        self.commands += 1;
        if !by_a_timer && self.commands > SHORT_COMMANDS + self.elapsed.0 / 1000 {
            return refused(
                TOO_MANY,
                &format!("more than {SHORT_COMMANDS} commands of less than 1 us on average"),
            );
        }
        Ok(())
    }
}
