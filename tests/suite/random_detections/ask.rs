//! Detectors that ask for nonsense: commands at their bounds and beyond.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use standstill_interface::{
    Abc, Angle, Command, Detector, Fault, Findings, Leg, Nanos, Outcome, Reading, Sampling, Stage, Step,
};

/// Plays commands, one after the other, and keeps what it reads.
pub struct Script {
    commands: std::vec::IntoIter<Command<f64>>,
    pub readings: Vec<Reading<f64>>,
}

impl Script {
    pub fn new(commands: Vec<Command<f64>>) -> Self {
        Self { commands: commands.into_iter(), readings: Vec::new() }
    }
}

impl Detector<f64> for Script {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        self.readings.extend_from_slice(readings);
        self.commands.next().map_or_else(done, Step::Drive)
    }
}

fn done() -> Step<f64> {
    let (fault, findings) = (Fault::UnexpectedReadings, Findings::default());
    Step::Done(Outcome::Failed { fault, findings })
}

/// Orders up to twenty random commands, each part of which may be any number that its type has.
pub struct Nonsense {
    rng: ChaCha8Rng,
    left: u32,
}

impl Nonsense {
    pub fn new(rng: &mut ChaCha8Rng) -> Self {
        Self { left: rng.random_range(1..=20), rng: ChaCha8Rng::seed_from_u64(rng.random()) }
    }

    /// A time: mostly one that a drive may order, else one of the ends of its type, or any.
    fn time(&mut self) -> Nanos {
        let usual = self.rng.random_range(0..200_000);
        Nanos(match self.rng.random_range(0..40) {
            0 => 0,
            1 => 1,
            2 => u64::MAX,
            3 => u64::MAX - usual,
            4 => self.rng.random(),
            5 => 20_000_000_000,
            _ => usual,
        })
    }

    fn number(&mut self) -> f64 {
        match self.rng.random_range(0..30) {
            0 => f64::NAN,
            1 => f64::INFINITY,
            2 => f64::NEG_INFINITY,
            3 => f64::MAX,
            4 => -f64::MIN_POSITIVE,
            5 => 0.0,
            6 => 1.0,
            7 => f64::from_bits(self.rng.random()),
            8 => self.rng.random_range(-2.0..3.0),
            _ => self.rng.random_range(0.0..1.0),
        }
    }

    fn stage(&mut self) -> Stage<f64> {
        let mut leg = || match self.rng.random_range(0..12) {
            0..2 => Leg::Off,
            2..5 => Leg::Low,
            5..8 => Leg::High,
            8 => Leg::Rise(self.time()),
            9 => Leg::Fall(self.time()),
            _ => Leg::Duty(self.number()),
        };
        let legs = Abc::new(leg(), leg(), leg());
        Stage { legs, duration: self.time() }
    }

    fn command(&mut self) -> Command<f64> {
        let stage = self.stage();
        let then = if self.rng.random_bool(0.4) { Some(self.stage()) } else { None };
        let whole = stage.duration + then.map_or(Nanos::ZERO, |then| then.duration);
        let sampling = match self.rng.random_range(0..20) {
            0 => Sampling { first: self.time(), interval: self.time(), count: self.rng.random() },
            1 => {
                Sampling { first: Nanos::ZERO, interval: Nanos::ZERO, count: self.rng.random_range(0..3000) }
            }
            2 => Sampling { first: Nanos::ZERO, interval: Nanos(1), count: self.rng.random_range(0..3000) },
            3 => Sampling { first: self.time(), interval: Nanos(u64::MAX), count: 2 },
            4..10 => Sampling::NONE,
            _ => Sampling::once(Nanos(self.rng.random_range(0..=whole.0))),
        };
        let threshold = if self.rng.random_bool(0.15) { Some(self.number() * 10.0) } else { None };
        Command { stage, then, sampling, threshold }
    }
}

impl Detector<f64> for Nonsense {
    fn step(&mut self, _: &[Reading<f64>]) -> Step<f64> {
        if self.left == 0 {
            let angle = Angle::from_degrees(self.rng.random_range(-1e3..1e3));
            return Step::Done(Outcome::Found { angle, findings: Findings::default() });
        }
        self.left -= 1;
        Step::Drive(self.command())
    }
}
