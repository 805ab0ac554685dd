//! From an interrupt's legs to commands: the timer of a drive.
//!
//! ```text
//!   counter      /\        /\        /\       a period is high in its middle: a duty ends the first half high
//!               /  \      /  \      /  \      and begins the second
//!   update   ──●────────●────────●────────    once a period, or ●─────●─────● twice
//!   sample      ↑ sample_at after each
//!   isr()         runs with it; its legs take effect `update_delay` updates later
//! ```

use std::collections::VecDeque;

use standstill_interface::{Abc, Command, Fault, Leg, Nanos, Sampling, Stage};

use crate::command::{duty, no_leg};
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

impl Interrupts {
    /// Before the first interrupt, with all legs off.
    pub fn new(timing: Timing, period: Nanos) -> Self {
        let half = Nanos(period.0 / 2);
        Self {
            halves: [half, period - half],
            timing,
            given: 0,
            start: Nanos::ZERO,
            end: Nanos::ZERO,
            legs: Legs::default(),
            preloaded: (0..timing.update_delay).map(|_| Legs::default()).collect(),
        }
    }

    /// The half of the period whose sample there is now; none before the first command.
    pub fn half(&self) -> Option<u8> {
        let last = self.given.checked_sub(1)?;
        Some(u8::from(self.timing.twice && last % 2 == 1))
    }

    /// When the last command began.
    pub fn start(&self) -> Nanos {
        self.start
    }

    /// Up to the next update.
    ///
    /// # Errors
    /// Legs that cannot be.
    pub fn command(&mut self) -> Result<Command<f64>, Fault<f64>> {
        if self.given > 0 {
            self.preloaded.push_back(self.legs);
        }
        let legs = self.preloaded.pop_front().unwrap_or_default();
        let half = usize::from(self.timing.twice && self.given % 2 == 1);
        let first = self.stage(&legs, half)?;
        let then = if self.timing.twice { None } else { Some(self.stage(&legs, 1)?) };
        let duration = first.duration + then.as_ref().map_or(Nanos::ZERO, |stage| stage.duration);
        // A share of at most a tenth of a second.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let at = Nanos((f64::from(self.timing.sample_at) * duration.0 as f64).round() as u64);
        (self.start, self.end) = (self.end, self.end + duration);
        self.given += 1;
        Ok(Command { stage: first, then, sampling: Sampling::once(at), threshold: None })
    }

    fn stage(&self, legs: &Legs, half: usize) -> Result<Stage<f64>, Fault<f64>> {
        let duration = self.halves[half];
        let mut asked = [Leg::Off; 3];
        for (k, leg) in asked.iter_mut().enumerate() {
            *leg = match legs.leg[k] {
                abi::OFF => Leg::Off,
                abi::LOW => Leg::Low,
                abi::HIGH => Leg::High,
                abi::DUTY => Leg::in_half(duty(k, legs.duty[k])?, duration, half == 1),
                other => return Err(no_leg(k, other)),
            };
        }
        Ok(Stage { legs: Abc(asked), duration })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONCE: Timing = Timing { pwm_hz: 12_500, twice: false, sample_at: 0.5, update_delay: 1 };

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
            timer.legs = legs(duty);
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
