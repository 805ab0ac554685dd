//! The engine behind an instance, with the scenario that it borrows.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use standstill_detect::Method;
use standstill_interface::{Abc, Command, Leg, Nanos, Reading, Sampling, Stage};
use standstill_numeric::whole;
use standstill_scenario::Scenario;
use standstill_sim::{Case, Driven, RunError, Snapshot};

use crate::model::Part;
use crate::past::{Move, Past};
use crate::units::readable;

/// A machine with its scenario. A copy continues independently.
#[derive(Clone, Debug)]
pub(crate) struct Rig {
    /// Borrows from the scenario, and so goes first.
    driven: Driven<'static>,
    /// Kept for as long as the machine borrows from it.
    _scenario: Arc<Scenario<Method<f64>>>,
    /// The two halves of a PWM period, and whether the next update is in its middle.
    halves: [Nanos; 2],
    second_half: bool,
    /// Time of all steps of a motor so far.
    elapsed: Nanos,
    /// Angle of the rotor at the start, in rad.
    start_angle: f64,
    samples: Samples,
    /// Readings of the last step, as many as there are samples; before the first one, that of the drive at rest, all switches off.
    readings: Vec<Reading<f64>>,
    /// All steps so far.
    past: Past,
}

/// When the converters sample in a step, in shares of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Samples {
    pub first: f64,
    /// From one to the next.
    pub every: f64,
    /// At least one.
    pub count: u32,
}

impl Samples {
    /// The triggers of a step: none after its end.
    fn within(self, duration: Nanos) -> Sampling {
        let of = |share: f64| Nanos(whole((share * duration.0 as f64).round()));
        let (first, gaps) = (of(self.first), u64::from(self.count - 1));
        let most = (duration - first).0.checked_div(gaps).unwrap_or(0);
        Sampling { first, interval: Nanos(of(self.every).0.min(most)), count: self.count }
    }
}

/// Legs of a drive: the mode of each (0 off, 1 low, 2 high, 3 duty) and its duty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Legs {
    pub mode: [u8; 3],
    pub duty: [f64; 3],
}

/// Largest difference in s between a communication step and a PWM period, which is a whole number of nanoseconds.
const OFF: f64 = 1.01e-9;

/// The longest that an instance simulates: nanoseconds in f64 have room for small parts of one until then.
const LONGEST: Nanos = Nanos(10_000_000_000_000);

impl Rig {
    /// Makes the machine at rest, as trial number `trial` of the scenario.
    ///
    /// # Errors
    /// The sensors cannot represent the quantities of the machine.
    pub fn new(
        part: Part,
        scenario: Scenario<Method<f64>>,
        trial: u64,
        samples: Samples,
    ) -> Result<Self, String> {
        let scenario = Arc::new(scenario);
        let period = scenario.drive.carrier_period;
        // SAFETY: the scenario lives on the heap and is neither moved nor changed while the `Arc` beside the machine is there;
        // fields are dropped in their order, so the machine goes first; and no borrow leaves this type.
        #[allow(unsafe_code)]
        let borrowed: &'static Scenario<Method<f64>> = unsafe { &*Arc::as_ptr(&scenario) };
        let case = Case { time_limit: LONGEST, ..borrowed.case(trial) };
        let driven = match part {
            Part::Drive => Driven::new(&case),
            Part::Motor => Driven::motor(&case),
        };
        let half = Nanos(period.0 / 2);
        // A copy reads, so that the drive's own samples draw what they draw in a run.
        let look = Command::hold(Stage::off(half), Sampling::once(Nanos::ZERO));
        let reading = driven.clone().carry_out(&look).map_err(|error| why(&error))?.first().copied();
        Ok(Self {
            driven,
            _scenario: scenario,
            halves: [half, period - half],
            second_half: false,
            elapsed: Nanos::ZERO,
            start_angle: case.start_angle,
            samples,
            readings: vec![reading.ok_or("the sensors read nothing at rest")?; samples.count as usize],
            past: Past::default(),
        })
    }

    /// Returns the angle of the rotor at the start, in rad.
    pub fn start_angle(&self) -> f64 {
        self.start_angle
    }

    /// Returns the state of the machine now.
    pub fn now(&self) -> Snapshot {
        self.driven.now()
    }

    /// Returns the times that a communication step may take now.
    fn steps(&self) -> (Nanos, Option<Nanos>) {
        let [first, second] = self.halves;
        if self.second_half { (second, None) } else { (first, Some(first + second)) }
    }

    /// A sample of the last step, by its number.
    pub fn reading(&self, number: usize) -> &Reading<f64> {
        &self.readings[number.min(self.readings.len() - 1)]
    }

    /// All steps so far.
    pub fn past(&self) -> &Past {
        &self.past
    }

    /// Returns one communication step of a drive: half a PWM period or, from its begin on, a whole one.
    ///
    /// # Errors
    /// The step has another length, or the simulation failed.
    pub fn step(&mut self, legs: &Legs, seconds: f64) -> Result<(), String> {
        let (half, whole) = self.steps();
        let is = |time: Nanos| (seconds - time.seconds()).abs() <= OFF;
        let is_whole = whole.is_some_and(is) && !is(half);
        if !is_whole && !is(half) {
            let [found, half] = [seconds, half.seconds()].map(|time| readable(time, "s"));
            let whole = whole.map(|whole| format!(", or {}, a PWM period", readable(whole.seconds(), "s")));
            return Err(format!(
                "communication step: found {found}, needed {half}, half a PWM period{}",
                whole.unwrap_or_default()
            ));
        }
        let mut legs = *legs;
        // What a leg does not look at is not kept.
        for (duty, _) in legs.duty.iter_mut().zip(legs.mode).filter(|(_, mode)| *mode != 3) {
            *duty = 0.0;
        }
        self.go(&Move::Legs { legs, whole: is_whole })
    }

    /// Simulates one communication step of a motor, up to a time in s since the start.
    ///
    /// # Errors
    /// The step is shorter than a nanosecond, or the simulation failed.
    pub fn feed(&mut self, potential: [f64; 3], until: f64) -> Result<(), String> {
        // The importer's own time: rounded steps would add up.
        let end = Nanos::from_seconds(until);
        if end <= self.elapsed {
            let found = readable(until - self.elapsed.seconds(), "s");
            return Err(format!("communication step: found {found}, needed at least 1 ns"));
        }
        self.go(&Move::Fed { potential, duration: (end - self.elapsed).0 })
    }

    /// A step, of this machine or of the one whose steps are done again.
    ///
    /// # Errors
    /// Why the machine could not go on, and a step that it does not have.
    pub fn go(&mut self, step: &Move) -> Result<(), String> {
        match step {
            Move::Legs { legs, whole } => self.switch(legs, *whole)?,
            Move::Fed { potential, duration } => {
                self.driven.feed(*potential, Nanos(*duration)).map_err(|error| why(&error))?;
                self.elapsed = self.elapsed + Nanos(*duration);
            }
        }
        self.past.push(step);
        Ok(())
    }

    fn switch(&mut self, legs: &Legs, whole: bool) -> Result<(), String> {
        let stage = |second: bool| {
            let duration = self.halves[usize::from(second)];
            let leg = |k: usize| match legs.mode[k] {
                0 => Leg::Off,
                1 => Leg::Low,
                2 => Leg::High,
                _ => Leg::in_half(legs.duty[k], duration, second),
            };
            Stage { legs: Abc([leg(0), leg(1), leg(2)]), duration }
        };
        let mut command = Command::hold(stage(self.second_half), Sampling::NONE);
        command.then = whole.then(|| stage(true));
        command.sampling = self.samples.within(command.duration());
        let readings = self.driven.carry_out(&command).map_err(|error| why(&error))?;
        for (kept, reading) in self.readings.iter_mut().zip(readings) {
            *kept = *reading;
        }
        self.second_half ^= !whole;
        Ok(())
    }
}

fn why(error: &RunError) -> String {
    match error {
        RunError::TimeLimit(longest) => {
            format!("the simulation cannot go on: an instance simulates at most {} s", longest.seconds())
        }
        error => format!("the simulation cannot go on: {error}"),
    }
}
