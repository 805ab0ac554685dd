//! Faults of motor, inverter, sensors and software: their tables in a file, and their settings in a trial.
//!
//! A fault that exists before the detection changes the trial's case or the nameplate, the data that the drive knows. A
//! fault that begins during the detection is passed to the simulator with its times. Each trial draws place, size, sign
//! and onset of a fault, as it draws the errors of the drive.

mod apply;
mod mode;
mod short;
#[cfg(test)]
mod tests;

use standstill_detect::Method;
use standstill_interface::{Nanos, choice};
use standstill_numeric::whole;
use standstill_quantity::Quantity;
use standstill_quantity::unit::Second;
use standstill_sim::{Arrangement, MOST_FAULTS};
use toml::Value;

pub use self::apply::FaultDraw;
pub(crate) use self::apply::{apply, demagnetise, misinform};
pub use self::mode::FaultMode;
use self::mode::Further;
use crate::Scenario;
use crate::document::FileError;
use crate::named::Named;

choice! {
    /// The phase, leg or sensor at which a fault is.
    #[derive(Default)]
    pub enum FaultPlace {
        /// Phase a, its leg, its sensor.
        A = "a",
        /// Phase b.
        B = "b",
        /// Phase c.
        C = "c",
        /// One of the three phases, drawn in each trial.
        Any = "any" default,
    }
}

/// A value, or a pair of values between which each trial draws one.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(untagged)]
pub enum Between {
    /// The smallest and the largest value.
    Two([Value; 2]),
    /// The value.
    One(Value),
}

impl schemars::JsonSchema for Between {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Between".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let one = serde_json::json!({ "type": ["string", "number"] });
        schemars::json_schema!({
            "description": "A value, or the smallest and the largest of those that trials draw.",
            "anyOf": [one, { "type": "array", "items": one, "minItems": 2, "maxItems": 2 }],
        })
    }
}

/// A fault of motor, inverter, sensors or software.
#[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultTable {
    /// The failure mode.
    pub mode: Named<FaultMode>,
    /// The phase, leg or sensor; without it, each trial draws one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<Named<FaultPlace>>,
    /// The size in the unit of the mode, such as `"2 Ω"`, or a list of two sizes between which each trial draws one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnitude: Option<Between>,
    /// Resistance in the path of `turns-shorted`, or a list of two between which each trial draws one. Default: 0 Ω.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resistance: Option<Between>,
    /// Coupling of the turns of `turns-shorted` with their phase, or a list of two between which each trial draws one. Default: 0.9.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coupling: Option<Between>,
    /// Number of the detection's command, from 1, from whose start `onset` counts, or a list of two between which each trial draws one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub command: Option<Between>,
    /// Time after the start of the detection, or of `command`, at which the fault begins. Without both keys, it exists before the detection.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub onset: Option<Between>,
    /// Time after which the fault ends, as with an intermittent contact. Without this key, it does not end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lasts: Option<Quantity<Second>>,
}

/// A checked fault. Each trial draws size and onset between the two values of `size` and `onset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultSettings {
    /// The failure mode.
    pub mode: FaultMode,
    /// The phase, leg or sensor that is faulty.
    pub at: FaultPlace,
    /// Smallest and largest size, in SI units; zero for a fault without a size.
    pub size: [f64; 2],
    /// Smallest and largest value of the two further sizes of the mode `turns-shorted`: the resistance in Ω and the coupling. Zero for
    /// other modes.
    pub further: [[f64; 2]; 2],
    /// Range of the number of a command. Each trial draws a number from this range, and the onset counts from the start of this command.
    /// The first command has number 1. None if the onset counts from the start of the detection.
    pub command: Option<[u32; 2]>,
    /// Earliest and latest onset in s. The onset counts from the start of the drawn command, or of the detection if `command` is none.
    pub onset: [f64; 2],
    /// Time in s after the onset at which the fault ends. Infinite if the fault does not end.
    pub lasts: f64,
}

/// Latest time in s at which a fault may begin, and longest time for which it may last.
const LONGEST: f64 = 20.0;

impl FaultTable {
    /// Checks this fault and returns its settings in SI units. `number`: its place in the scenario's list, from 0, which errors name.
    ///
    /// # Errors
    /// A value is invalid; the error names its key.
    fn settings(&self, number: usize) -> Result<FaultSettings, FileError> {
        let (mode, name) = (self.mode.0, self.mode.0.name());
        let wrong = |key: &str, found: &str, needed: &str| Err(error(number, key, found, needed));
        let at = match self.at {
            Some(Named(at)) if !mode.has_place() => {
                let needed = format!("no such key: \"{name}\" is at no phase");
                return wrong("at", &format!("\"{}\"", at.name()), &needed);
            }
            at => at.unwrap_or_default().0,
        };
        let size = match (mode.size(), &self.magnitude) {
            (None, None) => [0.0; 2],
            (None, Some(_)) => {
                return wrong("magnitude", "a value", &format!("no such key: \"{name}\" has no size"));
            }
            (Some(size), None) => {
                let needed = format!("{}, or two of them between which trials draw", size.allowed);
                return wrong("magnitude", "none", &needed);
            }
            (Some(size), Some(between)) => {
                let [low, high] =
                    between.within(size.read, size.range, size.allowed, (number, "magnitude"))?;
                if mode.is_fixed() && low != high {
                    let needed = "one value: what a drive knows, and its magnets, are the same in all trials (an axis or a tolerance of `faults.0.magnitude` varies them)";
                    return wrong("magnitude", "two values", needed);
                }
                [low, high]
            }
        };
        let further = self.further(number)?;
        let time = |value: &Value| value.clone().try_into::<Quantity<Second>>().ok().map(Quantity::value);
        for (key, found, of) in [("onset", "a time", &self.onset), ("command", "a number", &self.command)] {
            if of.is_some() && !mode.may_begin() {
                let needed = format!("no such key: \"{name}\" is there before the detection");
                return wrong(key, found, &needed);
            }
        }
        let onset = self.onset.as_ref().map_or(Ok([0.0; 2]), |onset| onset.numbers(time, [0.0, LONGEST]));
        let needed = "a time from 0 to 20 s, or two of them, the earlier one first";
        let onset = onset.map_err(|found| error(number, "onset", &found, needed))?;
        let read = |value: &Value| value.as_integer().map(|number| number as f64);
        let allowed = "a whole number from 1 to 1000000";
        let of = |command: &Between| command.within(read, [1.0, 1e6], allowed, (number, "command"));
        let command = self.command.as_ref().map(of).transpose()?.map(|numbers| numbers.map(whole));
        let lasts = match self.lasts.map(Quantity::value) {
            None => f64::INFINITY,
            Some(_) if !mode.may_pass() => {
                return wrong("lasts", "a time", &format!("no such key: \"{name}\" does not pass"));
            }
            Some(lasts) if (1e-9..=LONGEST).contains(&lasts) => lasts,
            Some(lasts) => return wrong("lasts", &format!("{lasts} s"), "a time from 1 ns to 20 s"),
        };
        Ok(FaultSettings { mode, at, size, further, command, onset, lasts })
    }

    /// Checks the further sizes of this fault and returns their ranges in SI units. `number`: its place in the scenario's list, from 0.
    fn further(&self, number: usize) -> Result<[[f64; 2]; 2], FileError> {
        let mode = self.mode.0;
        let mut further = [[0.0; 2]; 2];
        for (n, (key, found)) in
            [("resistance", &self.resistance), ("coupling", &self.coupling)].iter().enumerate()
        {
            let of_mode = mode.further().iter().find(|(name, _)| name == key);
            further[n] = match (of_mode, found) {
                (None, None) => continue,
                (None, Some(_)) => {
                    let needed = format!("no such key: it belongs to \"{}\"", FaultMode::TurnsShorted.name());
                    return Err(error(number, key, "a value", &needed));
                }
                (Some((_, further)), None) => [further.without; 2],
                (Some((_, Further { size, .. })), Some(between)) => {
                    between.within(size.read, size.range, size.allowed, (number, key))?
                }
            };
        }
        Ok(further)
    }
}

impl Between {
    /// Returns both values as numbers.
    ///
    /// # Errors
    /// A value has the wrong quantity or is out of range, or the larger value comes first. The error is the text of the values.
    fn numbers(&self, read: fn(&Value) -> Option<f64>, [least, most]: [f64; 2]) -> Result<[f64; 2], String> {
        let both = match self {
            Self::One(value) => [value, value],
            Self::Two([low, high]) => [low, high],
        };
        let [low, high] = both.map(|value| read(value).filter(|number| (least..=most).contains(number)));
        match (low, high) {
            (Some(low), Some(high)) if low <= high => Ok([low, high]),
            _ if both[0] == both[1] => Err(both[0].to_string()),
            _ => Err(format!("{} and {}", both[0], both[1])),
        }
    }

    /// Returns both values as numbers.
    ///
    /// # Errors
    /// The same as for [`Self::numbers`]. The error names the key and the fault. `number` is the number of the fault, counted from 0.
    fn within(
        &self,
        read: fn(&Value) -> Option<f64>,
        range: [f64; 2],
        allowed: &str,
        (number, key): (usize, &str),
    ) -> Result<[f64; 2], FileError> {
        let needed = format!("{allowed}, or two of them, the smaller one first");
        self.numbers(read, range).map_err(|found| error(number, key, &found, &needed))
    }
}

/// Makes the error of a key of the fault with this number, counted from 0.
fn error(number: usize, key: &str, found: &str, needed: &str) -> FileError {
    FileError::key(&format!("faults[{number}].{key}"), found, needed)
}

/// Checks the faults of a file against a scenario that is complete except for its detector.
///
/// # Errors
/// A value is invalid, the drive lacks the faulty part, or there are more faults than can be simulated together.
pub(crate) fn settings(
    tables: &[FaultTable],
    scenario: &Scenario<Method<f64>>,
) -> Result<Vec<FaultSettings>, FileError> {
    if tables.len() > MOST_FAULTS {
        let needed = format!("at most {MOST_FAULTS}");
        return Err(FileError::key("faults", &format!("{} faults", tables.len()), &needed));
    }
    let mut all = Vec::new();
    for (number, table) in tables.iter().enumerate() {
        let fault = table.settings(number)?;
        if let Some(needed) = fault.mode.lacks(scenario) {
            let found = format!("\"{}\"", fault.mode.name());
            return Err(error(number, "mode", &found, needed));
        }
        if fault.mode == FaultMode::TurnsShorted && all.iter().any(|of: &FaultSettings| of.mode == fault.mode)
        {
            let found = format!("\"{}\" a second time", fault.mode.name());
            return Err(error(number, "mode", &found, "one short of turns at most"));
        }
        if fault.mode == FaultMode::TurnsShorted {
            short::check(&fault, &scenario.motor, number)?;
        }
        let places = fault.mode.places(scenario.sensors.arrangement);
        if fault.at != FaultPlace::Any
            && FaultPlace::ALL.iter().position(|at| *at == fault.at) >= Some(places)
        {
            let needed = if places == 1 {
                "\"a\", the only sensor of this drive"
            } else {
                "\"a\" or \"b\", where this drive has sensors"
            };
            return Err(error(number, "at", &format!("\"{}\"", fault.at.name()), needed));
        }
        if let (FaultMode::CurrentBit, Some(adc)) = (fault.mode, scenario.sensors.adc)
            && (fault.size[1] > f64::from(adc.bits - 1) || fault.size.iter().any(|bit| bit.fract() != 0.0))
        {
            let found = format!("{} to {}", fault.size[0], fault.size[1]);
            let needed = format!("whole numbers from 0 to {}, the bits of the converter", adc.bits - 1);
            return Err(error(number, "magnitude", &found, &needed));
        }
        all.push(fault);
    }
    Ok(all)
}

impl FaultMode {
    /// Returns the number of places in a drive at which this fault can occur. For faults of current sensors, this is the number of sensors.
    pub(super) fn places(self, arrangement: Arrangement) -> usize {
        match arrangement {
            Arrangement::TwoInLine if self.is_of_current_sensor() => 2,
            Arrangement::DcLinkShunt if self.is_of_current_sensor() => 1,
            _ => 3,
        }
    }

    /// Returns true if a current sensor is broken, which methods that read no current do not notice.
    ///
    /// ```
    /// use standstill_scenario::FaultMode;
    ///
    /// assert!(FaultMode::CurrentDead.is_of_current_sensor() && !FaultMode::SampleLost.is_of_current_sensor());
    /// ```
    pub fn is_of_current_sensor(self) -> bool {
        self.has_place() && self.name().starts_with("current")
    }

    /// Returns the part or property without which this fault, in its typical size, cannot be added to the scenario's own faults. Returns
    /// none if the fault can be added.
    pub fn lacks_usual(self, scenario: &Scenario<Method<f64>>) -> Option<&'static str> {
        let own = scenario.faults.iter().any(|fault| fault.mode == self);
        let short = self == Self::TurnsShorted;
        self.lacks(scenario)
            .or((short && own).then_some("a scenario without shorted turns of its own: one short of turns at most"))
            .or((short && !short::is_typical(&scenario.motor)).then_some(
                "a motor whose shorted turns settle slowly enough: half of a phase's turns with a coupling of 0.95 settle within 0.4 µs",
            ))
    }

    /// Returns the part or property without which a scenario cannot have this fault, in words for a message. Returns none if the scenario
    /// can have the fault.
    pub fn lacks(self, scenario: &Scenario<Method<f64>>) -> Option<&'static str> {
        use standstill_sim::Arrangement::{DcLinkShunt, LowSideShunts, None as NoSensors, ThreeInLine};
        let (sensors, arrangement) = (&scenario.sensors, scenario.sensors.arrangement);
        match self {
            Self::MagnetWeak if !scenario.motor.has_magnet() => Some("a motor with magnets"),
            Self::DeadTimeLong if scenario.drive.dead_time == Nanos::ZERO => {
                Some("`inverter.dead_time` above 0")
            }
            Self::LinkCapacitorAged | Self::SupplyWeak | Self::SupplyLimited
                if scenario.drive.link.storage.is_none() =>
            {
                Some(
                    "`inverter.capacitance` beside it: the link of this drive has the source's voltage at any current",
                )
            }
            Self::CurrentsSwapped if !matches!(arrangement, ThreeInLine | LowSideShunts) => {
                Some("a drive with three current sensors")
            }
            _ if self.is_of_current_sensor() && arrangement == NoSensors => {
                Some("a drive that reads currents")
            }
            Self::CurrentBit if sensors.adc.is_none_or(|adc| adc.bits == 0) => {
                Some("`sensors.bits` above 0: without a converter there are no bits")
            }
            Self::CurrentSlow if sensors.bandwidth.is_none() => Some("`sensors.bandwidth` beside it"),
            Self::CurrentSlow if arrangement == DcLinkShunt => {
                Some("a drive with more than one current sensor")
            }
            Self::CommandLate if arrangement.follows_legs() || sensors.comparator.any() => Some(
                "sensors in the phases and no comparators: what a drive takes for its legs' state, and a stage that a trip ends, are not delayed",
            ),
            Self::ComparatorStuck if !sensors.comparator.any() => Some("a drive with comparators"),
            Self::TimerOff if sensors.comparator.timer == 0.0 => Some("a drive with a timer"),
            _ => None,
        }
    }
}
