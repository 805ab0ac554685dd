//! The registry of a scenario's keys: a key is one entry of a table, and everything else follows from the entry.
//!
//! The entry of [`table!`] makes the field that files are read into. From the list of entries follow ranges and their errors, the schema,
//! effective values, values that trials draw, sources of a budget, warnings, variables of an FMU, the example that `init` writes, the table
//! in `docs/reference.md` and the panel of the lab. Rules between keys stand in code: `build.rs`, `link.rs`, `terminals.rs`.

mod detector;
mod inverter;
pub(crate) mod motor;
mod rotor;
mod sensors;
#[cfg(test)]
mod tests;

use std::ops::Range as Draws;

use standstill_detect::{Method, keys as methods};
use standstill_interface::{Choice, Nanos};
use standstill_quantity::unit::{Degree, Share};
use standstill_quantity::{Dimension, Quantity, Scale, Unit, rounded};
use standstill_sim::Purpose;
use toml::Value;

pub use self::detector::DetectorTable;
pub(crate) use self::detector::unworkable;
pub use self::inverter::InverterTable;
pub use self::rotor::RotorTable;
pub use self::sensors::SensorsTable;
use crate::document::FileError;
use crate::named::Named;
use crate::{ErrorSet, Scenario};

/// The numbers that a key may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The least, in the unit of the schema.
    pub low: f64,
    /// The largest.
    pub high: f64,
    /// Both in words, as messages have them.
    pub needed: &'static str,
    /// Why not beyond.
    pub reason: &'static str,
    /// Whether the numbers are whole.
    pub whole: bool,
    /// The least that is not zero, where zero is allowed below a gap.
    gap: f64,
}

impl Range {
    const fn new(low: f64, high: f64, needed: &'static str, reason: &'static str) -> Self {
        Self { low, high, needed, reason, whole: false, gap: low }
    }

    const fn whole(self) -> Self {
        Self { whole: true, ..self }
    }

    /// Zero, or from `least` to the largest.
    const fn or_from(self, least: f64) -> Self {
        Self { gap: least, ..self }
    }

    fn contains(&self, value: f64) -> bool {
        let within = (self.low..=self.high).contains(&value) && (value == 0.0 || value >= self.gap);
        within && !(self.whole && value.fract() != 0.0)
    }
}

const NOT_NEGATIVE: Range =
    Range::new(0.0, 1e12, "zero or more", "a magnitude or a standard deviation has no sign");
const POSITIVE: Range = Range::new(
    f64::MIN_POSITIVE,
    1e12,
    "more than zero",
    "a voltage or a range of zero measures and drives nothing",
);
const SHARE: Range =
    Range::new(0.0, 1.0, "a share from 0 to 1", "a deviation is smaller than the value itself");
const TIME: Range = Range::new(0.0, 1.0, "from 0 to 1 s", "ten periods of the slowest carrier");
const PRECISION: Range = Range::new(
    1e-6,
    1.0,
    "from 1e-6 to 1, or 0.0001 % to 100 %",
    "a millionth takes 1e12 trials; an interval as wide as its value says nothing",
);
const TEMPERATURE: Range = Range::new(
    -273.15,
    1000.0,
    "from -273.15 °C to 1000 °C",
    "absolute zero; magnets and insulation fail far below 1000 °C",
);

/// With what a value is compared that hardly anybody means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Usual {
    /// The whole, of a share.
    Whole,
    /// The motor's rated current.
    RatedCurrent,
    /// The DC link.
    Link,
    /// The DC link, of a resistance's drop at rated current.
    LinkByDrop,
    /// The DC link of the motor's nameplate.
    NominalLink,
    /// The carrier's period.
    Carrier,
}

/// The kind of a key's values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Values {
    /// Numbers: the symbol of their SI unit, and whether they are shares, which people write in per cent.
    Number {
        /// Symbol of the unit; empty for shares and pure numbers.
        unit: &'static str,
        /// Whether they are shares.
        share: bool,
    },
    /// One of these names; each with a sentence about it.
    Choice(Vec<(&'static str, &'static str)>),
    /// Yes or no.
    Flag,
    /// Whole numbers.
    Whole,
    /// A text or a table: a file, a class, settings of a library.
    Text,
}

/// Sets a number of a scenario.
pub(crate) type Setter = fn(&mut Scenario<Method<f64>>, f64);

/// A key of scenario files.
///
/// ```
/// let noise = standstill_scenario::key("sensors.noise").expect("a key");
/// assert_eq!(noise.allowed(), Some("zero or more"));
/// assert_eq!(noise.values(), standstill_scenario::Values::Number { unit: "A", share: false });
/// ```
#[derive(Debug)]
pub struct Key {
    /// Its path, such as `sensors.noise`.
    pub path: &'static str,
    /// Its meaning, in a sentence or two.
    pub about: &'static str,
    /// A value as TOML has it; empty where the example of `init` has text of its own.
    pub example: &'static str,
    /// The numbers that it may have; none of choices, flags and texts.
    pub range: Option<Range>,
    /// The draws of a trial whose spread it is: what a budget takes for a source of error.
    pub draws: Option<(Purpose, Draws<usize>)>,
    /// More than this share of something is hardly meant.
    pub usual: Option<(f64, Usual)>,
    values: fn() -> Values,
    /// Its value in a scenario, whether a file sets it or not.
    get: fn(&Scenario<Method<f64>>) -> Option<Value>,
    /// Whether this scenario has such a thing.
    applies: fn(&Scenario<Method<f64>>) -> bool,
    /// Whether trials draw with it in this scenario, beside a spread of more than zero.
    drawn: fn(&Scenario<Method<f64>>) -> bool,
    /// Sets the number that it is by itself.
    pub(crate) set: Option<Setter>,
}

impl Key {
    const fn of(path: &'static str, about: &'static str, values: fn() -> Values) -> Self {
        let (about, get, drawn) = (about.trim_ascii(), none as fn(&_) -> _, always as fn(&_) -> _);
        let example = "";
        Self {
            path,
            about,
            example,
            range: None,
            draws: None,
            usual: None,
            values,
            get,
            applies: drawn,
            drawn,
            set: None,
        }
    }

    /// The kind of its values.
    pub fn values(&self) -> Values {
        (self.values)()
    }

    /// Its numbers in words, as messages have them; none of choices, flags and texts.
    pub fn allowed(&self) -> Option<&'static str> {
        self.range.as_ref().map(|range| range.needed)
    }

    /// Whether this scenario has such a thing: a channel is a MOSFET's, a threshold an IGBT's.
    pub fn applies_to(&self, scenario: &Scenario<Method<f64>>) -> bool {
        (self.applies)(scenario)
    }

    /// Whether a trial of this scenario draws with a spread that this key sets.
    pub fn is_drawn(&self, scenario: &Scenario<Method<f64>>) -> bool {
        let zero = scenario.value(self.path).and_then(|value| value.as_float()) == Some(0.0);
        self.draws.is_some() && (self.drawn)(scenario) && !zero
    }

    /// A number of this key in the unit in which its range is written.
    fn readable(&self, value: f64, needed: &str) -> String {
        let dimension = match self.values() {
            Values::Number { unit, .. } => Dimension::of_symbol(unit),
            _ => None,
        };
        dimension.map_or_else(|| value.to_string(), |dimension| readable(dimension, value, needed))
    }

    /// # Errors
    /// A value beyond the range.
    pub(crate) fn check(&self, value: &dyn Written) -> Result<(), FileError> {
        match (&self.range, value.number()) {
            (Some(range), Some(number)) if !range.contains(number) => {
                Err(FileError::key(self.path, &value.readable(range.needed), range.needed))
            }
            _ => Ok(()),
        }
    }
}

fn none(_: &Scenario<Method<f64>>) -> Option<Value> {
    None
}

fn always(_: &Scenario<Method<f64>>) -> bool {
    true
}

fn number(value: f64) -> Value {
    Value::Float(rounded(value, 0))
}

/// A value of a file's table.
pub(crate) trait Written {
    /// In SI, of a number.
    fn number(&self) -> Option<f64> {
        None
    }

    /// Of yes and no.
    fn flag(&self) -> bool {
        false
    }

    /// In the unit in which the range is written: not 0.02 µF where nanofarads are allowed.
    fn readable(&self, _needed: &str) -> String {
        String::new()
    }

    fn values() -> Values
    where
        Self: Sized;
}

impl<U: Unit> Written for Quantity<U> {
    fn number(&self) -> Option<f64> {
        Some(self.value())
    }

    fn readable(&self, needed: &str) -> String {
        readable(&U::DIMENSION, self.value(), needed)
    }

    fn values() -> Values {
        Values::Number { unit: U::SYMBOL, share: U::DIMENSION.is_share() }
    }
}

fn readable(dimension: &Dimension, value: f64, needed: &str) -> String {
    let symbol = dimension.symbol;
    let scale = Scale::suiting(symbol, value.abs());
    let readable = scale.number(value);
    match symbol {
        "" if needed.contains('%') => format!("{} %", rounded(value, 2)),
        // What is too large or small for any prefix stays as it was.
        _ if symbol.is_empty() || !(1e-3..1e6).contains(&readable.abs()) => dimension.text(value),
        _ => format!("{readable} {}", scale.unit),
    }
}

impl<T: Choice> Written for Named<T> {
    fn values() -> Values {
        Values::Choice(T::ALL.iter().map(|choice| (choice.name(), choice.about().trim())).collect())
    }
}

impl Written for bool {
    fn flag(&self) -> bool {
        *self
    }

    fn values() -> Values {
        Values::Flag
    }
}

impl Written for String {
    fn values() -> Values {
        Values::Text
    }
}

/// A place that a number sets.
trait Place: Copy {
    fn of(number: f64) -> Self;
    fn number(self) -> f64;
}

impl Place for f64 {
    fn of(number: f64) -> Self {
        number
    }

    fn number(self) -> f64 {
        self
    }
}

impl Place for Nanos {
    fn of(number: f64) -> Self {
        Self::from_seconds(number)
    }

    fn number(self) -> f64 {
        self.seconds()
    }
}

/// A table of a scenario: its struct and the list of its keys.
///
/// An entry is a sentence, a name and a type, the place that a number sets if it is one by itself, and fields of [`Key`].
macro_rules! table {
    (
        $(#[$meta:meta])*
        pub struct $table:ident = $word:literal of $scenario:ident {
            $($(#[doc = $about:literal])+ $name:ident: $value:ty $([$($place:tt)+])? { $($field:ident: $is:expr),* $(,)? };)+
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, Debug, Default, PartialEq, serde::Deserialize, serde::Serialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields, default)]
        pub struct $table {
            $($(#[doc = $about])+
            #[serde(skip_serializing_if = "Option::is_none")]
            pub $name: Option<$value>,)+
        }

        impl $crate::keys::Table for $table {
            const KEYS: &[$crate::keys::Key] = &[$($crate::keys::Key {
                $($field: $is,)*
                $(get: |$scenario| Some($crate::keys::number($crate::keys::Place::number($($place)+))),
                set: Some(|$scenario, number| $($place)+ = $crate::keys::Place::of(number)),)?
                ..$crate::keys::Key::of(
                    concat!($word, ".", stringify!($name)),
                    concat!($($about),+),
                    <$value as $crate::keys::Written>::values,
                )
            }),+];

            fn values(&self) -> Vec<Option<&dyn $crate::keys::Written>> {
                vec![$(self.$name.as_ref().map(|value| value as &dyn $crate::keys::Written)),+]
            }
        }
    };
}
use table;

/// A table of a scenario.
pub(crate) trait Table {
    /// Its keys, in their order.
    const KEYS: &'static [Key];

    /// Its values, in the order of the keys.
    fn values(&self) -> Vec<Option<&dyn Written>>;

    /// What is set: each key with its value.
    fn set_values(&self) -> impl Iterator<Item = (&'static Key, &dyn Written)> {
        Self::KEYS.iter().zip(self.values()).filter_map(|(key, value)| Some((key, value?)))
    }

    /// # Errors
    /// A value beyond its key's range.
    fn check(&self) -> Result<(), FileError> {
        self.set_values().try_for_each(|(key, value)| key.check(value))
    }

    /// Sets in a scenario the numbers that are set by themselves.
    fn set(&self, scenario: &mut Scenario<Method<f64>>) {
        for (key, value) in self.set_values() {
            if let (Some(set), Some(number)) = (key.set, value.number()) {
                set(scenario, number);
            }
        }
    }
}

table! {
    /// How narrow the 95 % intervals must be for a point to end; all that are given count. They are looked at when 100
    /// trials are done, and again each time a quarter more are, so that a run ends with the same trial on any machine.
    #[derive(Copy)]
    pub struct StopTable = "stop_at" of scenario {
        /// Half the interval of the rms error, as a share of the rms error.
        rms: Quantity<Share> { range: Some(PRECISION) };
        /// Half the interval of the probability of a wrong pole.
        wrong_poles: Quantity<Share> { range: Some(PRECISION) };
    }
}

impl StopTable {
    /// Whether nothing is asked for.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// The keys that stand in no table. The fields are those of [`ScenarioFile`](crate::ScenarioFile).
const TOP: &[Key] = &[
    Key::of(
        "errors",
        "How good drive and sensors are, as far as the tables below do not say otherwise.",
        <Named<ErrorSet> as Written>::values,
    ),
    Key {
        range: Some(Range::new(1.0, 9e18, "at least 1", "statistics need a trial").whole()),
        ..Key::of("trials", "How many trials, or how many at each point of the axes.", || Values::Whole)
    },
    Key::of("seed", "Seed of all random numbers.", || Values::Whole),
    Key {
        range: Some(Range::new(
            0.0,
            180.0,
            "from 0 to 180 degrees",
            "two directions are at most half a turn apart",
        )),
        ..Key::of(
            "limit",
            "The angle error whose exceedance is counted, wrong poles included. Without it, 2°.",
            <Quantity<Degree> as Written>::values,
        )
    },
];

/// All keys but those of the motor, whose data sheet says which it has, and those that say which points and trials there are
/// (`axes`, `design`, `tolerances`), in the order of the schema.
pub fn keys() -> impl Iterator<Item = &'static Key> {
    let tables =
        [StopTable::KEYS, RotorTable::KEYS, InverterTable::KEYS, SensorsTable::KEYS, DetectorTable::KEYS];
    TOP.iter().chain(tables.into_iter().flatten())
}

/// The key of this path; none of the motor's.
pub fn key(path: &str) -> Option<&'static Key> {
    keys().find(|key| key.path == path)
}

/// # Errors
/// A value beyond the range of a key without a table.
pub(crate) fn check(path: &str, value: &dyn Written) -> Result<(), FileError> {
    key(path).map_or(Ok(()), |key| key.check(value))
}

impl Scenario<Method<f64>> {
    /// The value of a key of the tables `rotor`, `inverter`, `sensors` and `detector`: in the unit of the schema, which is
    /// that of SI, angles in degrees; a choice by its name. None of a key that this scenario has no such thing for, such as
    /// a setting of another method, and of what only the document knows.
    ///
    /// ```
    /// use standstill_scenario::{Document, Plan};
    ///
    /// let plan = Plan::new(Document::parse("s.toml".as_ref(), "detector.method = \"bipolar\"")?)?;
    /// let scenario = plan.scenario(0)?;
    /// assert_eq!(scenario.value("sensors.noise"), Some(0.01.into()));
    /// assert_eq!(scenario.value("inverter.devices"), Some("igbt".into()));
    /// assert_eq!(scenario.value("inverter.channel_resistance"), None);
    /// assert_eq!(scenario.value("detector.voltage"), None);
    /// # Ok::<(), standstill_scenario::FileError>(())
    /// ```
    pub fn value(&self, path: &str) -> Option<Value> {
        let method = path.strip_prefix("detector.");
        match method.and_then(|name| methods::ALL.into_iter().find(|key| key.name == name)) {
            Some(method) => self.detector.get(method).map(|value| match value {
                methods::Value::Flag(flag) => Value::Boolean(flag),
                methods::Value::Number(value) => number(value),
            }),
            None => key(path).filter(|key| (key.applies)(self)).and_then(|key| (key.get)(self)),
        }
    }
}
