//! The variables of an FMU. The number of each in the list is its value reference.

mod draws;
mod samples;

use standstill_detect::{Method, Source, longest_dead_time};
use standstill_interface::Nanos;
use standstill_plant::Motor;
use standstill_quantity::rounded;
use standstill_scenario::{Document, Key, Packed, Scenario, Values, keys};
use standstill_sim::RotorState;
use toml::Value;

pub(crate) use self::samples::add_samples;
use crate::model::{Part, RESOLVER};
use crate::units;

/// Kind of the values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Numbers.
    Real,
    /// Whole numbers of 32 bits.
    Integer,
    /// A mode of a leg, by its number.
    Mode,
    /// Yes or no.
    Boolean,
    /// The PWM period, of FMI 3.0 only.
    Clock,
}

/// Role of a variable.
#[derive(Clone, Debug, PartialEq)]
pub enum Role {
    /// A key of the scenario.
    Key(String),
    /// Seed of the random draws of drive, sensors, angle and noise.
    Seed,
    /// Number of the trial, which selects the draws together with the seed.
    Trial,
    /// Whether the rotor stands where the trial draws it.
    DrawAngle,
    /// Angle of the rotor in rad if it is not drawn.
    Angle,
    /// Where in a step the converters sample, for the first time.
    SampleAt,
    /// From one sample of a step to the next.
    SampleEvery,
    /// Mode of a leg, by its number.
    Mode(usize),
    /// Duty of a leg.
    Duty(usize),
    /// Potential of a motor's terminal.
    Voltage(usize),
    /// Reading of the last step, of several the last one.
    Sampled(Sampled),
    /// One of several readings of the last step, by its number from 0.
    Sample(usize, Sampled),
    /// Content found at that place.
    True(Truth),
    /// Time, which FMI 3.0 wants among the variables.
    Time,
    /// The PWM period.
    Clock,
}

/// Sampled quantity, see [`Role::Sampled`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampled {
    /// Current of a phase.
    Current(usize),
    /// Kind of the reading of a phase current: measured, derived from the others, at the end of the range, or missing.
    Sensed(usize),
    /// The converter's code of it.
    Count(usize),
    /// The DC link.
    Link,
    /// The converter's code of it.
    LinkCount,
    /// Whether that is at an end of its range.
    LinkClipped,
    /// Current of the shunt in the DC link.
    LinkCurrent,
    /// Kind of the reading of the link current, as for phase currents.
    LinkCurrentSensed,
    /// The converter's code of it.
    LinkCurrentCount,
    /// Voltage of a terminal behind its divider.
    Terminal(usize),
    /// Kind of the reading of a terminal voltage, as for phase currents.
    TerminalSensed(usize),
    /// The converter's code of it.
    TerminalCount(usize),
}

/// True quantity, see [`Role::True`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Truth {
    /// Current of a phase.
    Current(usize),
    /// Potential of a terminal.
    Potential(usize),
    /// The DC link.
    Link,
    /// Electrical angle.
    Angle,
    /// Electrical speed.
    Speed,
    /// Electromagnetic torque.
    Torque,
    /// Current from the DC link into the bridge.
    LinkCurrent,
}

/// A variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Name, with points between its parts.
    pub name: String,
    /// Description, in a sentence.
    pub about: String,
    /// Kind of its values.
    pub kind: Kind,
    /// Role of the variable.
    pub role: Role,
    /// Unit as the scenarios' schema writes it; empty for pure numbers and shares.
    pub unit: String,
    /// Start value; for parameters and inputs.
    pub start: Option<f64>,
    /// Smallest and largest value, if there are limits.
    pub limits: Option<[f64; 2]>,
    /// The limits in words, as messages have them.
    pub allowed: String,
}

impl Variable {
    fn new(name: &str, about: &str, kind: Kind, role: Role) -> Self {
        let (name, about) = (name.to_owned(), about.to_owned());
        Self {
            name,
            about,
            kind,
            role,
            unit: String::new(),
            start: None,
            limits: None,
            allowed: "a finite number".to_owned(),
        }
    }

    fn unit(mut self, unit: &str) -> Self {
        unit.clone_into(&mut self.unit);
        self
    }

    fn start(mut self, start: f64) -> Self {
        self.start = Some(start);
        self
    }

    fn limits(mut self, limits: [f64; 2], allowed: &str) -> Self {
        self.limits = Some(limits);
        allowed.clone_into(&mut self.allowed);
        self
    }

    /// Returns whether it is set before the simulation begins, and then stays.
    pub fn is_parameter(&self) -> bool {
        !self.is_input() && !self.is_output() && self.role != Role::Time
    }

    /// Returns whether it is set from step to step.
    pub fn is_input(&self) -> bool {
        matches!(self.role, Role::Mode(_) | Role::Duty(_) | Role::Voltage(_) | Role::Clock)
    }

    /// Returns whether it comes out.
    pub fn is_output(&self) -> bool {
        matches!(self.role, Role::Sampled(_) | Role::Sample(..) | Role::True(_))
    }

    /// Returns whether it changes at updates of the legs only, which in FMI 3.0 are ticks of the clock.
    pub fn is_clocked(&self) -> bool {
        matches!(self.role, Role::Mode(_) | Role::Duty(_) | Role::Sampled(_) | Role::Sample(..))
    }
}

/// Modes of a leg: the items of the enumeration, each with its description. The position of an item is its number, as
/// in `standstill.h`. No name is a keyword of Modelica or C.
pub(crate) const MODES: [(&str, &str); 4] = [
    ("off", "Both switches off"),
    ("low", "Lower switch on"),
    ("high", "Upper switch on"),
    ("duty", "Upper switch on for the share that the duty says, next to the middle of the period"),
];

const SHARE: &str = "a share from 0 to 1";

const PHASES: [char; 3] = ['a', 'b', 'c'];

/// Returns all of a scenario's drive, or of its motor alone.
pub(crate) fn variables(
    part: Part,
    document: &Document,
    packed: &Packed,
    scenario: &Scenario<Method<f64>>,
    motor: &Motor,
) -> Vec<Variable> {
    let mut all = match part {
        Part::Drive => drive_inputs(),
        Part::Motor => motor_inputs(),
    };
    if part == Part::Drive {
        all.extend(sampled());
    }
    all.extend(truth(part));
    all.extend(draws::draws(part, document, scenario));
    all.extend(draws::of_rotor(document, scenario));
    if part == Part::Drive {
        all.extend(of_drive(scenario));
    }
    all.extend(of_motor(packed, motor, scenario.rotor));
    all.push(Variable::new("time", "Time", Kind::Real, Role::Time).unit("s"));
    if part == Part::Drive {
        let about = "Ticks once a period of the PWM: legs take effect, and what was sampled is there";
        all.push(Variable::new("pwm", about, Kind::Clock, Role::Clock));
        // Value references of what was there before stay as they are: further variables come last.
        all.extend(further(scenario));
    }
    all
}

/// Returns a variable of each phase, whose letter takes the place of `{}`.
fn phases(name: &str, about: &str, kind: Kind, role: impl Fn(usize) -> Role) -> [Variable; 3] {
    [0, 1, 2].map(|k| {
        let phase = PHASES[k].to_string();
        Variable::new(&format!("{name}_{phase}"), &about.replace("{}", &phase), kind, role(k))
    })
}

fn drive_inputs() -> Vec<Variable> {
    let about = "Leg {} in the next step: 0 both switches off, 1 lower on, 2 upper on, 3 duty";
    let modes = phases("mode", about, Kind::Mode, Role::Mode);
    let about = "Share of the next step for which the upper switch of leg {} is on, if its mode is 3";
    let duties = phases("duty", about, Kind::Real, Role::Duty);
    let modes = modes.map(|mode| mode.start(0.0).limits([0.0, 3.0], "0, 1, 2 or 3"));
    let duties = duties.map(|duty| duty.start(0.0).limits([0.0, 1.0], SHARE));
    modes.into_iter().chain(duties).collect()
}

fn motor_inputs() -> Vec<Variable> {
    let about = "Potential of terminal {} over the next step; what the three have in common does not matter";
    let voltages = phases("u", about, Kind::Real, Role::Voltage);
    voltages.map(|voltage| voltage.unit("V").start(0.0)).into()
}

fn sampled() -> Vec<Variable> {
    let output = |name: &str, about: &str, kind, of| Variable::new(name, about, kind, Role::Sampled(of));
    let about = "Current of phase {} into the motor, as the drive's sensors and converters see it";
    let currents = phases("sampled.i", about, Kind::Real, |k| Role::Sampled(Sampled::Current(k)));
    let mut all: Vec<Variable> = currents.map(|current| current.unit("A")).into();
    let about = "Voltage of the DC link, as the drive sees it";
    all.push(output("sampled.u_dc", about, Kind::Real, Sampled::Link).unit("V"));
    let about = "Code of the converter of phase {}; 0 where there is none";
    all.extend(phases("count.i", about, Kind::Integer, |k| Role::Sampled(Sampled::Count(k))));
    let about = "Code of the converter of the DC link; 0 where there is none";
    all.push(output("count.u_dc", about, Kind::Integer, Sampled::LinkCount));
    let about = "Current of phase {}: 0 measured, 1 derived from the others, 2 at the end of its converter's range, 3 not seen";
    all.extend(phases("sensed.i", about, Kind::Integer, |k| Role::Sampled(Sampled::Sensed(k))));
    let about = "Whether the converter of the DC link is at an end of its range";
    all.push(output("clipped.u_dc", about, Kind::Boolean, Sampled::LinkClipped));
    all
}

fn truth(part: Part) -> Vec<Variable> {
    // A motor has nothing but what is true.
    let prefix = if part == Part::Drive { "actual." } else { "" };
    let output = |name: &str, about: &str, of, unit: &str| {
        Variable::new(&format!("{prefix}{name}"), about, Kind::Real, Role::True(of)).unit(unit)
    };
    let each = |name: &str, about: &str, unit: &'static str, of: fn(usize) -> Truth| {
        let all = phases(&format!("{prefix}{name}"), about, Kind::Real, |k| Role::True(of(k)));
        all.map(|variable| variable.unit(unit))
    };
    let mut all: Vec<Variable> = each("i", "Current of phase {} into the motor", "A", Truth::Current).into();
    if part == Part::Drive {
        let about = "Potential of terminal {} against the negative rail";
        all.extend(each("u", about, "V", Truth::Potential));
        all.push(output("u_dc", "Voltage of the DC link", Truth::Link, "V"));
    }
    all.push(output("angle", "Electrical angle of the rotor, not wrapped", Truth::Angle, "rad"));
    all.push(output("speed", "Electrical speed of the rotor", Truth::Speed, "rad/s"));
    all.push(output("torque", "Electromagnetic torque, cogging included", Truth::Torque, "N m"));
    all
}

/// Returns the readings of sensors that not every drive has, and the current that a shunt in the link would see.
fn further(scenario: &Scenario<Method<f64>>) -> Vec<Variable> {
    let output = |name: &str, about: &str, kind, of| Variable::new(name, about, kind, Role::Sampled(of));
    let kinds = "0 measured, 2 at the end of its converter's range, 3 not seen";
    let about = "Current from the DC link into the bridge";
    let current = Variable::new("actual.i_link", about, Kind::Real, Role::True(Truth::LinkCurrent));
    let mut all = vec![current.unit("A")];
    let sources = scenario.sources();
    if sources.contains(&Source::LinkCurrent) {
        let about = "Current of the shunt in the DC link, as the drive sees it";
        all.push(output("sampled.i_link", about, Kind::Real, Sampled::LinkCurrent).unit("A"));
        let about = "Code of the converter of the shunt in the DC link; 0 where there is none";
        all.push(output("count.i_link", about, Kind::Integer, Sampled::LinkCurrentCount));
        let about = format!("Current of the shunt in the DC link: {kinds}");
        all.push(output("sensed.i_link", &about, Kind::Integer, Sampled::LinkCurrentSensed));
    }
    if sources.contains(&Source::Terminals) {
        let about = "Voltage of terminal {} against the negative rail, as the drive sees it";
        let voltages = phases("sampled.u", about, Kind::Real, |k| Role::Sampled(Sampled::Terminal(k)));
        all.extend(voltages.map(|voltage| voltage.unit("V")));
        let about = "Code of the converter of terminal {}; 0 where there is none";
        all.extend(phases("count.u", about, Kind::Integer, |k| Role::Sampled(Sampled::TerminalCount(k))));
        let about = format!("Voltage of terminal {{}}: {kinds}");
        all.extend(phases("sensed.u", &about, Kind::Integer, |k| Role::Sampled(Sampled::TerminalSensed(k))));
    }
    all
}

/// Keys of inverter and sensors that are not parameters of an FMU: the PWM period is given by the communication step
/// and the interval of the clock, and there is no resolver.
const NOT_INSIDE: [&str; 2] = ["inverter.carrier", RESOLVER];

fn of_drive(scenario: &Scenario<Method<f64>>) -> Vec<Variable> {
    let is = |key: &str| {
        (key.starts_with("inverter.") || key.starts_with("sensors.")) && !NOT_INSIDE.contains(&key)
    };
    let variable = |key: &Key| {
        let variable = of_key(key, number(scenario.value(key.path))?)?;
        if key.path != "inverter.dead_time" {
            return Some(variable);
        }
        let (most, allowed) = dead_time(scenario.drive.carrier_period);
        Some(variable.limits([0.0, rounded(most.seconds(), 0)], &allowed))
    };
    keys().filter(|key| is(key.path)).filter_map(variable).collect()
}

/// Returns the longest dead time for a PWM, as every run has it too, and that in words.
pub(crate) fn dead_time(carrier_period: Nanos) -> (Nanos, String) {
    let most = longest_dead_time(carrier_period);
    let [longest, period] = [most, carrier_period].map(|time| units::readable(time.seconds(), "s"));
    (most, format!("from 0 to {longest}: less than a quarter of the PWM period of {period}"))
}

fn number(value: Option<Value>) -> Option<f64> {
    value.and_then(|value| value.as_float())
}

/// Returns the description of a key adapted to an FMU's variable: each variable has a value, and the start is that of a
/// simulation.
fn about(of: &str) -> String {
    let about = of.replace('\n', " ").replace("the start of the detection", "the start");
    let end = [" Without it", " Default: "].iter().filter_map(|word| about.find(word)).min();
    about[..end.unwrap_or(about.len())].to_owned()
}

/// Returns a key that is a number, in a unit that FMI has.
fn of_key(key: &Key, start: f64) -> Option<Variable> {
    let Values::Number { unit, .. } = key.values() else { return None };
    units::unit(unit)?;
    let range = key.range?;
    let kind = if range.whole { Kind::Integer } else { Kind::Real };
    let variable = Variable::new(key.path, &about(key.about), kind, Role::Key(key.path.to_owned()));
    Some(variable.unit(unit).start(start).limits([range.low, range.high], range.needed))
}

/// Parameters of the motor that differ from one of its kind to the next, and with the load on its shaft.
fn of_motor(packed: &Packed, motor: &Motor, state: RotorState) -> Vec<Variable> {
    let friction = motor.rotor.friction;
    let numbers = [
        ("motor.winding.resistance", motor.resistance, "Resistance of a phase"),
        (
            "motor.rotor.inertia",
            motor.rotor.inertia,
            "Moment of inertia with all that is coupled to the shaft",
        ),
        ("motor.rotor.stiction", friction.stiction, "Torque that a resting rotor needs to move"),
        ("motor.rotor.coulomb", friction.coulomb, "Torque against any motion, at most the stiction"),
        ("motor.rotor.viscous", friction.viscous, "Torque against motion per mechanical speed"),
    ];
    let whole = Value::Table(packed.text.parse().unwrap_or_default());
    let has =
        |key: &str| key.split('.').try_fold(&whole, |value, part| value.as_table()?.get(part)).is_some();
    let variable = |(key, start, about): (&str, f64, &str)| {
        let unit = standstill_scenario::unit(key).unwrap_or_default();
        let variable = Variable::new(key, about, Kind::Real, Role::Key(key.to_owned()));
        variable.unit(&unit).start(start).limits([0.0, 1e12], "zero or more, at most 1e12")
    };
    // What turns does nothing on a rotor that is locked.
    let counts = |key: &str| state != RotorState::Locked || !key.starts_with("motor.rotor.");
    numbers.into_iter().filter(|(key, ..)| has(key) && counts(key)).map(variable).collect()
}
