//! Limits of a detector from elsewhere: its commands must exist, and their number and time are bounded.

use standstill_interface::{Command, Fault, Findings, Leg, Nanos, Outcome, Own, Phase, Reading};

use crate::texts::kept;

/// Samples of a command at most.
const MOST_SAMPLES: u32 = 1 << 20;

/// Number of commands of a detection that may have any length. Further commands must last a microsecond on average;
/// otherwise a detection with endless short commands would never reach its time limit.
const SHORT_COMMANDS: u64 = 100_000;

/// Number of the reason of a detection that does not end, which is the bench's.
const NEVER_DONE: u32 = u32::MAX - 1;

/// Returns a detection that did not end within a bound.
fn not_done(within: &str) -> Fault<f64> {
    Fault::Own(Own { code: NEVER_DONE, text: kept(&format!("not done within {within}")) })
}

/// Limits on the commands of a detection whose detector is not part of this program: one of a library or of a Python
/// class.
#[derive(Clone, Copy, Debug)]
pub struct Guard {
    /// Tick in s of the timer that captures the trips of comparators; 0: no timer.
    tick: f64,
    /// Number and known duration of all commands so far.
    commands: u64,
    elapsed: Nanos,
    /// Longest duration of the last command's first stage, if a comparator may have ended the stage.
    pending: Option<Nanos>,
}

impl Guard {
    /// Makes the guard of a detection; `tick`: tick in s of the drive's timer; 0: the drive has no timer.
    pub const fn new(tick: f64) -> Self {
        Self { tick, commands: 0, elapsed: Nanos::ZERO, pending: None }
    }

    /// Returns the outcome of a detection that the drive ends because it takes longer than `limit`.
    pub fn overdue(limit: Nanos) -> Outcome<f64> {
        let fault = not_done(&format!("{} s", limit.0 as f64 / 1e9));
        Outcome::Failed { fault, findings: Findings::default() }
    }

    /// Returns whether a command is one that there is.
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

    /// Returns whether a stage until a threshold in A is one that a comparator can end.
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

    /// Adds the duration of the last command's first stage, from these readings, if a comparator may have ended the
    /// stage.
    pub fn lasted(&mut self, readings: &[Reading<f64>]) {
        let (Some(longest), Some(first)) = (self.pending.take(), readings.first()) else { return };
        let tripped = first.capture.map(|capture| Nanos::from_seconds(f64::from(capture.ticks) * self.tick));
        self.elapsed = self.elapsed + tripped.map_or(longest, |tripped| tripped.min(longest));
    }

    /// Returns whether the commands so far have lasted for this time in s. Rounding to single precision, or of captured times to ticks,
    /// does not count.
    pub fn has_lasted(&self, seconds: f64) -> bool {
        seconds <= self.elapsed.seconds() * (1.0 + 1e-6) + self.tick * self.commands as f64
    }

    /// Admits a further command. `by_a_timer`: the detector does not choose the command's duration. The first stage of
    /// a command with a threshold is counted after it has ended.
    ///
    /// # Errors
    /// The detection would never reach its time limit.
    pub fn pass(&mut self, command: &Command<f64>, by_a_timer: bool) -> Result<(), Fault<f64>> {
        self.pending = command.threshold.map(|_| command.stage.duration);
        self.elapsed = self.elapsed + command.duration() - self.pending.unwrap_or(Nanos::ZERO);
        self.commands += 1;
        if !by_a_timer && self.commands > SHORT_COMMANDS + self.elapsed.0 / 1000 {
            return Err(not_done(&format!("{SHORT_COMMANDS} commands of less than 1 us on average")));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use standstill_interface::{Capture, Sampling, Stage};

    /// Commands until a threshold that pass, of those that trip after so many ticks of 0.32 µs; none: no comparator trips.
    fn passed(ticks: Option<u32>) -> u64 {
        let mut guard = Guard::new(0.32e-6);
        let pulse = Stage::line(Phase::A, Phase::B, Nanos(300_000));
        let command = Command::until(2.0, pulse, Stage::off(Nanos(100)), Sampling::once(Nanos::ZERO));
        let capture = ticks.map(|ticks| Capture { ticks, comparator: Phase::A });
        let reading = Reading { capture, ..Reading::measured(Nanos::ZERO, [0.0; 3], 540.0) };
        (0..300_000)
            .find(|_| {
                let passed = guard.pass(&command, false);
                guard.lasted(&[reading]);
                passed.is_err()
            })
            .unwrap_or(300_000)
    }

    #[test]
    fn law_a_detection_has_lasted_as_long_as_its_commands() {
        let mut guard = Guard::new(0.0);
        assert!(guard.has_lasted(0.0) && !guard.has_lasted(1e-9));
        for _ in 0..3 {
            guard
                .pass(&Command::hold(Stage::off(Nanos::from_micros(100)), Sampling::NONE), false)
                .expect("passes");
        }
        assert!(guard.has_lasted(f64::from(300e-6_f32)) && !guard.has_lasted(300.1e-6));
    }

    #[test]
    fn law_pulses_to_a_threshold_count_by_the_time_that_they_took() {
        // 0.1 and 0.42 µs a command: 100,000 and their share of what comes after.
        assert_eq!(passed(Some(0)), 111_111);
        assert!((172_410..172_420).contains(&passed(Some(1))), "{}", passed(Some(1)));
        // From 1 µs on there may be as many as there is time for.
        assert_eq!((passed(Some(3)), passed(None)), (300_000, 300_000));
    }
}
