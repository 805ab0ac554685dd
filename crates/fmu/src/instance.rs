//! A running FMU, for both versions of the standard.

use std::path::Path;

use standstill_interface::choice;
use standstill_scenario::{Document, FileError, Origin};
use toml::Value;

use crate::model::{Model, Part};
use crate::outputs::{sampled, truth};
use crate::rig::{Legs, Rig, Samples};
use crate::units::readable;
use crate::variables::{Kind, Role};

/// Largest distance in s between a communication point and the end of the last step: some importers count whole
/// nanoseconds.
const OFF: f64 = 2e-9;

/// And relative to the time: the last digits of sums and products.
const ROUNDED: f64 = 4.0 * f64::EPSILON;

/// Smallest tolerance; below it, rounding errors dominate.
const FINEST: f64 = 1e-12;

choice! {
    /// Where an instance is between its creation and its end.
    pub enum Phase {
        /// Parameters may be set.
        Instantiated = "instantiated",
        /// Parameters may be set and outputs read.
        Initialising = "in initialization mode",
        /// Steps may be taken.
        Stepping = "in step mode",
        /// At an event (FMI 3.0).
        AtEvent = "in event mode",
        /// Only the last values can be read.
        Terminated = "terminated",
        /// A step failed.
        Failed = "in error",
    }
}

/// All that changes, as `fmi2GetFMUstate` keeps it.
#[derive(Clone, Debug)]
pub(crate) struct State {
    pub(super) phase: Phase,
    /// Values of the variables, by value reference.
    pub(super) values: Vec<f64>,
    pub(super) rig: Option<Rig>,
    /// Relative to the flux at rated current, where the importer wants one.
    pub(super) tolerance: Option<f64>,
    pub(super) start_time: f64,
    /// Time of the importer.
    pub(super) time: f64,
    /// Whether the clock ticks now.
    pub tick: bool,
}

/// A running FMU.
#[derive(Debug)]
pub(crate) struct Instance {
    pub(super) model: Model,
    pub state: State,
}

/// A result, or a message about a wrong call or a failed step.
pub(crate) type Outcome<T = ()> = Result<T, String>;

impl Instance {
    /// Makes an instance from the resources of an FMU.
    pub fn new(resources: &Path, token: &str) -> Outcome<Self> {
        let model = Model::unpacked(resources)?;
        let own = model.token();
        if token != own {
            return Err(format!(
                "the FMU's description has the token {token}, its binary and resources {own}: they are of different versions"
            ));
        }
        let state = State::new(&model);
        Ok(Self { model, state })
    }

    /// Resets the instance to its state after creation.
    pub fn reset(&mut self) {
        self.state = State::new(&self.model);
    }

    fn must_be(&self, phases: &[Phase], call: &str) -> Outcome {
        if phases.contains(&self.state.phase) {
            return Ok(());
        }
        let needed: Vec<&str> = phases.iter().map(|phase| phase.name()).collect();
        Err(format!("{call}: the instance is {}, needed {}", self.state.phase.name(), needed.join(" or ")))
    }

    /// Returns the time at which the simulation begins.
    pub fn set_start(&mut self, time: f64) -> Outcome {
        self.must_be(&[Phase::Instantiated], "the start time")?;
        // Beyond it, parts of a nanosecond are lost.
        if !(-1e6..=1e6).contains(&time) {
            return Err(format!("start time: found {time} s, needed from -1000000 to 1000000 s"));
        }
        (self.state.start_time, self.state.time) = (time, time);
        Ok(())
    }

    /// Returns the numerical tolerance that the importer asks for: a step is never less exact than without one.
    pub fn set_tolerance(&mut self, tolerance: Option<f64>) -> Outcome {
        self.must_be(&[Phase::Instantiated], "the tolerance")?;
        // Some importers say that there is one, and give 0.
        if let Some(found) = tolerance.filter(|found| !(0.0..1.0).contains(found)) {
            return Err(format!(
                "tolerance: found {found}, needed a share from 0 to 1 of the flux at rated current"
            ));
        }
        self.state.tolerance = tolerance.filter(|found| *found > 0.0);
        Ok(())
    }

    /// Enters initialization mode.
    pub fn enter_initialisation(&mut self) -> Outcome {
        self.must_be(&[Phase::Instantiated], "entering initialization mode")?;
        self.state.phase = Phase::Initialising;
        Ok(())
    }

    /// Leaves initialization mode: to steps, or to the event at the beginning.
    pub fn exit_initialisation(&mut self, to: Phase) -> Outcome {
        self.must_be(&[Phase::Initialising], "leaving initialization mode")?;
        self.build()?;
        self.state.phase = to;
        Ok(())
    }

    /// Changes between steps and events.
    pub fn enter(&mut self, phase: Phase) -> Outcome {
        self.must_be(&[Phase::Stepping, Phase::AtEvent], phase.name())?;
        self.state.tick = false;
        self.state.phase = phase;
        Ok(())
    }

    /// Returns the end.
    pub fn terminate(&mut self) -> Outcome {
        self.must_be(&[Phase::Stepping, Phase::AtEvent], "the end")?;
        self.state.phase = Phase::Terminated;
        Ok(())
    }

    fn variable(&self, reference: u32, kinds: &[Kind]) -> Outcome<(usize, &crate::Variable)> {
        let found = self.model.variables.get(reference as usize);
        let variable = found.ok_or_else(|| {
            format!(
                "value reference: found {reference}, needed one from 0 to {}",
                self.model.variables.len() - 1
            )
        })?;
        if !kinds.contains(&variable.kind) {
            return Err(format!(
                "`{}`: read or written as {:?}, but it is {:?}",
                variable.name, kinds[0], variable.kind
            ));
        }
        Ok((reference as usize, variable))
    }

    /// Sets a parameter or an input.
    pub fn set(&mut self, reference: u32, kinds: &[Kind], value: f64) -> Outcome {
        let (place, variable) = self.variable(reference, kinds)?;
        let name = &variable.name;
        if !variable.is_parameter() && !variable.is_input() {
            return Err(format!("`{name}`: it is no parameter and no input, and cannot be set"));
        }
        if variable.is_parameter() && !matches!(self.state.phase, Phase::Instantiated | Phase::Initialising) {
            return Err(format!("`{name}`: a parameter cannot be set once the simulation has begun"));
        }
        if matches!(self.state.phase, Phase::Terminated | Phase::Failed) {
            return Err(format!("`{name}`: the simulation is over"));
        }
        let [low, high] = variable.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        if !value.is_finite() || value < low || value > high {
            let found = readable(value, &variable.unit);
            return Err(format!("`{name}`: found {found}, needed {}", variable.allowed));
        }
        if variable.is_parameter() && self.state.values[place] != value {
            self.state.rig = None;
        }
        self.state.values[place] = value;
        Ok(())
    }

    /// Returns the value of any variable.
    pub fn get(&mut self, reference: u32, kinds: &[Kind]) -> Outcome<f64> {
        let (place, variable) = self.variable(reference, kinds)?;
        let role = variable.role.clone();
        let output = variable.is_output();
        if output && self.state.rig.is_none() {
            self.must_be(&[Phase::Initialising], "outputs")?;
        }
        // Which angle a trial draws, only its machine knows.
        if output || role == Role::Angle && self.state.phase == Phase::Initialising {
            self.build()?;
        }
        let Some(rig) = &self.state.rig else {
            return Ok(match role {
                Role::Time => self.state.time,
                Role::DrawAngle => f64::from(u8::from(self.draws_angle())),
                _ => self.state.values[place],
            });
        };
        Ok(match role {
            Role::Time => self.state.time,
            Role::Clock => f64::from(u8::from(self.state.tick)),
            Role::Sampled(of) => sampled(rig.reading(usize::MAX), of),
            Role::Sample(number, of) => sampled(rig.reading(number), of),
            Role::True(of) => truth(rig, of),
            Role::DrawAngle => f64::from(u8::from(self.draws_angle())),
            Role::Angle if self.draws_angle() => rig.start_angle(),
            _ => self.state.values[place],
        })
    }

    /// Returns true if the trial draws the rotor's angle. Only the values decide, not the order in which they were set,
    /// because some importers set all parameters, even to their present values.
    fn draws_angle(&self) -> bool {
        let all = || self.model.variables.iter().zip(&self.state.values);
        let asked = all().any(|(variable, value)| variable.role == Role::DrawAngle && *value != 0.0);
        asked && all().any(|(variable, value)| variable.role == Role::Angle && variable.start == Some(*value))
    }

    /// Builds the machine with the present parameters.
    pub(super) fn build(&mut self) -> Outcome {
        if self.state.rig.is_none() {
            let mut trial = 0;
            let document = self.changed(&mut trial).map_err(|error| error.to_string())?;
            let mut scenario = Model::scenario_of(&document).map_err(|error| error.to_string())?;
            if let Some(tolerance) = self.state.tolerance {
                let flux = tolerance.max(FINEST) * self.model.flux;
                scenario.tolerance.flux = scenario.tolerance.flux.min(flux);
            }
            self.state.rig = Some(Rig::new(self.model.part, scenario, trial, self.samples()?)?);
        }
        Ok(())
    }

    /// When the converters sample in each step.
    fn samples(&self) -> Outcome<Samples> {
        let count = self.model.samples;
        let mut samples = Samples { first: 1.0, every: 0.0, count };
        for (variable, value) in self.model.variables.iter().zip(&self.state.values) {
            match variable.role {
                Role::SampleAt => samples.first = *value,
                Role::SampleEvery => samples.every = *value,
                _ => {}
            }
        }
        let Samples { first, every, .. } = samples;
        let most = (1.0 - first) / f64::from(count.max(2) - 1);
        if count > 1 && every > most * (1.0 + 1e-9) {
            return Err(format!(
                "`sample_every`: found {every}, needed at most {most}: the first of {count} samples is at {first} of a step (`sample_at`), and the last one must not be behind its end"
            ));
        }
        Ok(samples)
    }

    /// Returns the scenario with the parameters that were changed.
    fn changed(&self, trial: &mut u64) -> Result<Document, FileError> {
        const IMPORTER: Origin = Origin::Option("the importer");
        let mut document = self.model.document.clone();
        let drawn = self.draws_angle();
        for (variable, value) in self.model.variables.iter().zip(&self.state.values) {
            // Whole and from 0 to 2^31.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let whole = *value as i64;
            match &variable.role {
                Role::Seed => document.set_value("seed", Value::Integer(whole), IMPORTER)?,
                Role::Trial => *trial = whole.unsigned_abs(),
                // A value that is there in other words, such as one with a unit, stays.
                Role::Key(key) if variable.start != Some(*value) => {
                    document.set_value(key, Value::Float(*value), IMPORTER)?;
                }
                Role::Angle if drawn => document.remove("rotor.angle"),
                Role::Angle if variable.start != Some(*value) || document.get("rotor.angle").is_none() => {
                    document.set_value("rotor.angle", Value::Float(value.to_degrees()), IMPORTER)?;
                }
                _ => {}
            }
        }
        Ok(document)
    }

    /// Returns a communication step.
    pub fn step(&mut self, time: f64, length: f64) -> Outcome {
        self.must_be(&[Phase::Stepping], "a step")?;
        let outcome = self.advance(time, length);
        match &outcome {
            Ok(()) => self.state.time = time + length,
            Err(_) => self.state.phase = Phase::Failed,
        }
        outcome
    }

    fn advance(&mut self, time: f64, length: f64) -> Outcome {
        let inputs = self.inputs();
        let State { rig, start_time, time: ended, .. } = &mut self.state;
        let Some(rig) = rig else { return Err("a step: there is no machine".to_owned()) };
        // The importer's own time: the machine's, in whole nanoseconds, is off it by a part of one a step. What an importer rounds, it
        // may be off by, and no more: it would add up.
        let off = OFF + ROUNDED * ended.abs();
        if !(*ended - off..=*ended + off).contains(&time) {
            let [found, needed] = [time, *ended].map(|time| readable(time, "s"));
            return Err(format!(
                "communication point: found {found}, needed {needed}, where the last step ended"
            ));
        }
        match inputs {
            Inputs::Legs(legs) => rig.step(&legs, length),
            Inputs::Potential(potential) => rig.feed(potential, time + length - *start_time),
        }
    }

    fn inputs(&self) -> Inputs {
        let (mut legs, mut potential) = (Legs::default(), [0.0; 3]);
        for (variable, value) in self.model.variables.iter().zip(&self.state.values) {
            match variable.role {
                // Whole and from 0 to 3.
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
                Role::Mode(k) => legs.mode[k] = *value as u8,
                Role::Duty(k) => legs.duty[k] = *value,
                Role::Voltage(k) => potential[k] = *value,
                _ => {}
            }
        }
        match self.model.part {
            Part::Drive => Inputs::Legs(legs),
            Part::Motor => Inputs::Potential(potential),
        }
    }

    /// Returns the time of the last communication point.
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// Returns the PWM period in s.
    pub fn period(&self) -> f64 {
        self.model.period().seconds()
    }

    /// Returns whether this is the clock.
    pub fn is_clock(&self, reference: u32) -> bool {
        self.variable(reference, &[Kind::Clock]).is_ok()
    }
}

enum Inputs {
    Legs(Legs),
    Potential([f64; 3]),
}

impl State {
    pub(super) fn new(model: &Model) -> Self {
        Self {
            phase: Phase::Instantiated,
            values: model.variables.iter().map(|variable| variable.start.unwrap_or(0.0)).collect(),
            rig: None,
            tolerance: None,
            start_time: 0.0,
            time: 0.0,
            tick: false,
        }
    }
}
