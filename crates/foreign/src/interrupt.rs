//! The timer of a drive: converts the legs set by interrupts to commands.
//!
//! ```text
//!   counter      /\        /\        /\       a period is high in its middle: a duty ends the first half high
//!               /  \      /  \      /  \      and begins the second
//!   update   ──●────────●────────●────────    once a period, or ●─────●─────● twice
//!   sample      ↑ sample_at after each
//!   isr()         runs with it; its legs take effect `update_delay` updates later
//! ```

use std::collections::VecDeque;

use standstill_interface::{Abc, Command, Fault, Leg, Nanos, Phase, Sampling, Stage};

use crate::command::{duty, no_leg};
use crate::detector::broken;
use crate::library::Timing;
use standstill_interface::abi::{self, Legs};

/// The timer between a library and the bench.
#[derive(Debug)]
pub struct Interrupts {
    /// The two halves of a period.
    halves: [Nanos; 2],
    timing: Timing,
    /// Commands given so far, and where the last one began.
    given: u64,
    start: Nanos,
    end: Nanos,
    /// The legs that the library commanded last.
    pub legs: Legs,
    /// The legs that take effect at the next updates.
    preloaded: VecDeque<Legs>,
}

/// Returns the legs before the first interrupt.
fn at_first(timing: &Timing) -> Legs {
    Legs { sample_at: timing.sample_at, sample_every: timing.sample_every, ..Legs::default() }
}

impl Interrupts {
    /// Makes the timer before the first interrupt, with all legs off.
    pub fn new(timing: Timing, period: Nanos) -> Self {
        let half = Nanos(period.0 / 2);
        Self {
            halves: [half, period - half],
            timing,
            given: 0,
            start: Nanos::ZERO,
            end: Nanos::ZERO,
            legs: at_first(&timing),
            preloaded: (0..timing.update_delay).map(|_| at_first(&timing)).collect(),
        }
    }

    /// Returns the half of the period whose sample there is now; none before the first command.
    pub fn half(&self) -> Option<u8> {
        let last = self.given.checked_sub(1)?;
        Some(u8::from(self.timing.twice && last % 2 == 1))
    }

    /// Returns the start of the last command.
    pub fn start(&self) -> Nanos {
        self.start
    }

    /// Returns the command up to the next update.
    ///
    /// # Errors
    /// The legs are invalid.
    pub fn command(&mut self) -> Result<Command<f64>, Fault<f64>> {
        if self.given > 0 {
            self.preloaded.push_back(self.legs);
        }
        let legs = self.preloaded.pop_front().unwrap_or_else(|| at_first(&self.timing));
        let half = usize::from(self.timing.twice && self.given % 2 == 1);
        let first = self.stage(&legs, half)?;
        let then = if self.timing.twice { None } else { Some(self.stage(&legs, 1)?) };
        let duration = first.duration + then.as_ref().map_or(Nanos::ZERO, |stage| stage.duration);
        let sampling = self.sampling(&legs, duration)?;
        (self.start, self.end) = (self.end, self.end + duration);
        self.given += 1;
        Ok(Command { stage: first, then, sampling, threshold: None })
    }

    /// Returns the samples of a command of this length.
    fn sampling(&self, legs: &Legs, duration: Nanos) -> Result<Sampling, Fault<f64>> {
        let count = self.timing.samples;
        self.timing.within(legs.sample_at, legs.sample_every).map_err(|found| broken(&found))?;
        let first = part(legs.sample_at.into(), duration);
        if count == 1 {
            return Ok(Sampling::once(first));
        }
        let room = (duration - first).0 / u64::from(count - 1);
        let interval = part(legs.sample_every.into(), duration).min(Nanos(room));
        Ok(Sampling { first, interval, count })
    }

    /// Returns the command of a leg in one half of a period whose pulse is later than centred by `shift`, a share of the period.
    fn shifted(&self, phase: usize, duty: f64, shift: f32, half: usize) -> Result<Leg<f64>, Fault<f64>> {
        let (letter, by) = (Phase::ALL[phase].letter(), f64::from(shift));
        if self.timing.twice {
            let text = format!(
                "shift {shift:.3} of leg {letter} with two updates a period, where each half has a duty of its own"
            );
            return Err(broken(&text));
        }
        let most = 0.5 * duty.min(1.0 - duty);
        // Shares in single precision do not add up exactly; what is no number is none either.
        if by.abs() <= most + 1e-7 {
            let [first, second] = self.halves;
            let begin = part((0.5 - 0.5 * duty + by).max(0.0), first + second).min(first);
            let end = part((0.5 + 0.5 * duty + by).min(1.0), first + second).max(first);
            return Ok(match half {
                0 if begin == Nanos::ZERO => Leg::High,
                0 if begin == first => Leg::Low,
                0 => Leg::Rise(begin),
                _ if end == first => Leg::Low,
                _ if end == first + second => Leg::High,
                _ => Leg::Fall(end - first),
            });
        }
        Err(broken(&format!(
            "shift {shift:.3} of leg {letter} with a duty of {duty:.3}: it would switch twice in one half of the period; needed \
             from -{most:.3} to {most:.3}"
        )))
    }

    fn stage(&self, legs: &Legs, half: usize) -> Result<Stage<f64>, Fault<f64>> {
        let duration = self.halves[half];
        let mut asked = [Leg::Off; 3];
        for (k, leg) in asked.iter_mut().enumerate() {
            *leg = match legs.leg[k] {
                abi::OFF => Leg::Off,
                abi::LOW => Leg::Low,
                abi::HIGH => Leg::High,
                abi::DUTY if legs.shift[k] == 0.0 => {
                    Leg::in_half(duty(k, legs.duty[k])?, duration, half == 1)
                }
                abi::DUTY => self.shifted(k, duty(k, legs.duty[k])?, legs.shift[k], half)?,
                other => return Err(no_leg(k, other)),
            };
        }
        Ok(Stage { legs: Abc(asked), duration })
    }
}

/// Returns a share of a time.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a tenth of a second")]
fn part(share: f64, of: Nanos) -> Nanos {
    Nanos((share * of.0 as f64).round() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONCE: Timing = Timing {
        pwm_hz: 12_500,
        twice: false,
        sample_at: 0.5,
        update_delay: 1,
        samples: 1,
        sample_every: 0.0,
        task_ns: None,
    };

    fn legs(duty: f32) -> Legs {
        Legs { leg: [abi::DUTY, abi::LOW, abi::HIGH], duty: [duty, f32::NAN, 7.0], ..Legs::default() }
    }

    #[test]
    fn analytic_a_centre_aligned_period_is_one_command() {
        let mut timer = Interrupts::new(ONCE, Nanos(80_000));
        let off = timer.command().expect("legs");
        assert_eq!((off.stage.legs.0, off.duration()), ([Leg::Off; 3], Nanos(80_000)));
        assert_eq!(off.sampling, Sampling::once(Nanos(40_000)));
        timer.legs = legs(0.25);
        let command = timer.command().expect("legs");
        // The middle is at 40 µs; a quarter of the period around it.
        assert_eq!(command.stage.legs.0, [Leg::Rise(Nanos(30_000)), Leg::Low, Leg::High]);
        let then = command.then.expect("two halves");
        assert_eq!(then.legs.0, [Leg::Fall(Nanos(10_000)), Leg::Low, Leg::High]);
        assert_eq!(timer.start(), Nanos(80_000));
    }

    #[test]
    fn analytic_two_updates_are_two_commands_with_duties_of_their_own() {
        let mut timer = Interrupts::new(Timing { twice: true, sample_at: 1.0, ..ONCE }, Nanos(33_333));
        let mut seen = Vec::new();
        for duty in [0.0, 0.5, 0.25, 1.0] {
            let command = timer.command().expect("legs");
            seen.push((command.stage.legs.0[0], command.duration().0, command.sampling.first.0));
            timer.legs = Legs { sample_at: 1.0, ..legs(duty) };
        }
        let rise: Leg<f64> = Leg::Rise(Nanos(12_499));
        assert_eq!(seen[0], (Leg::Off, 16_666, 16_666));
        assert_eq!(seen[1], (Leg::Low, 16_667, 16_667));
        assert_eq!(seen[2], (Leg::Rise(Nanos(8333)), 16_666, 16_666));
        assert_eq!(seen[3], (Leg::Fall(Nanos(4167)), 16_667, 16_667));
        assert_eq!(Leg::in_half(0.25, Nanos(16_666), false), rise);
        assert_eq!(timer.half(), Some(1));
    }

    #[test]
    fn law_legs_take_effect_as_many_updates_later_as_the_library_says() {
        for delay in 1..=4 {
            let mut timer = Interrupts::new(Timing { update_delay: delay, ..ONCE }, Nanos(100));
            let mut high = 0;
            for command in 0..8_u32 {
                let is_high = timer.command().expect("legs").stage.legs.0[0] == Leg::High;
                // What the first interrupt, in command 0, asks for is there from command `delay` on.
                assert_eq!(is_high, command >= delay, "{delay}: {command}");
                high += u32::from(is_high);
                timer.legs = Legs { leg: [abi::HIGH; 3], ..Legs::default() };
            }
            assert_eq!(high, 8 - delay);
        }
    }

    #[test]
    fn analytic_a_shifted_pulse_keeps_its_length_and_several_samples_their_distance() {
        let timing = Timing { sample_at: 0.1, samples: 3, sample_every: 0.2, ..ONCE };
        let mut timer = Interrupts::new(timing, Nanos(80_000));
        let first = timer.command().expect("off").sampling;
        assert_eq!((first.first.0, first.interval.0, first.count), (8000, 16_000, 3));
        // A quarter of 80 µs is high from 30 to 50 µs; a tenth of the period later, from 38 to 58 µs.
        let moved =
            |shift: f32| Legs { shift: [shift, 0.0, 0.0], sample_at: 0.5, sample_every: 0.25, ..legs(0.25) };
        timer.legs = moved(0.1);
        let command = timer.command().expect("legs");
        let then = command.then.expect("two halves");
        let edges = (command.stage.legs.0[0], then.legs.0[0]);
        assert_eq!(edges, (Leg::Rise(Nanos(38_000)), Leg::Fall(Nanos(18_000))));
        // The triggers went along with the legs, and the last one is at the next update.
        let sampling = command.sampling;
        assert_eq!((sampling.first.0, sampling.interval.0), (40_000, 20_000));
        assert_eq!(sampling.last(), Some(command.duration()));
        // As far as it goes, either way.
        for (shift, first, second) in
            [(0.125, Leg::Low, Leg::Fall(Nanos(20_000))), (-0.125, Leg::Rise(Nanos(20_000)), Leg::Low)]
        {
            timer.legs = moved(shift);
            let command = timer.command().expect("legs");
            assert_eq!((command.stage.legs.0[0], command.then.expect("two").legs.0[0]), (first, second));
        }
        let refused = |timing, legs| {
            let mut timer = Interrupts::new(timing, Nanos(80_000));
            timer.command().expect("off");
            timer.legs = legs;
            timer.command().expect_err("must be refused").to_string()
        };
        let said = refused(timing, moved(0.2));
        assert!(said.contains("shift 0.200 of leg a with a duty of 0.250"), "{said}");
        assert!(said.contains("needed from -0.125 to 0.125"), "{said}");
        assert!(refused(timing, moved(f32::NAN)).contains("shift NaN"));
        assert!(refused(Timing { twice: true, ..timing }, moved(0.1)).contains("two updates a period"));
        let late = Legs { sample_every: 0.3, ..moved(0.0) };
        assert!(refused(timing, late).contains("3 samples from 0.5 on, one each 0.3"));
    }

    #[test]
    fn law_legs_that_cannot_be_are_named() {
        let ask = |legs: Legs| {
            let mut timer = Interrupts::new(ONCE, Nanos(100));
            timer.command().expect("off");
            timer.legs = legs;
            timer.command().expect_err("must be refused").to_string()
        };
        assert!(ask(legs(1.5)).contains("duty 1.5 of phase a"));
        assert!(ask(legs(-0.1)).contains("duty -0.1"));
        assert!(ask(legs(f32::NAN)).contains("NaN"));
        assert!(ask(Legs { leg: [1, 9, 1], ..Legs::default() }).contains("leg b is asked for state 9"));
        // A switch within a stage is for commands.
        assert!(ask(Legs { leg: [1, 1, 4], ..Legs::default() }).contains("state 4"));
    }
}
