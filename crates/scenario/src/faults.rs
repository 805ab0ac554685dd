//! Faults of motor, inverter, sensors and software: their tables in a file, and what a trial makes of them.
//!
//! A fault that is there from the begin changes the trial's case, or what the drive knows; one that begins during the detection is
//! handed to the simulator with its times. Its place, size, sign and onset are draws of the trial, as errors of a drive are.

mod mode;
#[cfg(test)]
mod tests;

use standstill_detect::{Nameplate, Signature};
use standstill_interface::{Nanos, choice};
use standstill_inverter::{Gate, Storage};
use standstill_plant::Motor;
use standstill_quantity::Quantity;
use standstill_quantity::unit::Second;
use standstill_sim::{Arrangement, Broken, Case, Fault, MOST_FAULTS, Misreading, Purpose, Streams};
use toml::Value;

pub use self::mode::FaultMode;
use crate::Scenario;
use crate::document::FileError;
use crate::named::Named;
use standstill_detect::Method;

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
        /// One of the three, which each trial draws.
        Any = "any" default,
    }
}

/// A value, or two between which each trial draws one.
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
    /// What is broken.
    pub mode: Named<FaultMode>,
    /// The phase, leg or sensor; without it, each trial draws one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<Named<FaultPlace>>,
    /// The size, such as `"2 Ω"`, or a list of two between which each trial draws one. Its unit is that of the mode.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnitude: Option<Between>,
    /// Time after the start of the detection at which it breaks. Without it, before the detection.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub onset: Option<Between>,
    /// Time after which it is whole again, as an intermittent contact. Without it, it stays broken.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lasts: Option<Quantity<Second>>,
}

/// A checked fault: trials draw between the two values of `size` and `onset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultSettings {
    /// What is broken.
    pub mode: FaultMode,
    /// Where.
    pub at: FaultPlace,
    /// Smallest and largest size, in SI units; zero for a fault without a size.
    pub size: [f64; 2],
    /// Earliest and latest onset in s after the start of the detection.
    pub onset: [f64; 2],
    /// Time in s after which the part is whole again; infinite where it stays broken.
    pub lasts: f64,
}

/// Largest time in s at which a fault may begin, and for which it may last.
const LONGEST: f64 = 20.0;

impl FaultTable {
    /// Checks the fault with this number, from 0.
    ///
    /// # Errors
    /// An invalid value, with its key.
    fn settings(&self, number: usize) -> Result<FaultSettings, FileError> {
        let (mode, name) = (self.mode.0, self.mode.0.name());
        let error = |key: &str, found: &str, needed: &str| {
            FileError::key(&format!("faults[{number}].{key}"), found, needed)
        };
        let wrong = |key: &str, found: &str, needed: &str| Err(error(key, found, needed));
        let at = match self.at {
            Some(Named(at)) if !mode.has_place() => {
                return wrong(
                    "at",
                    &format!("\"{}\"", at.name()),
                    &format!("no such key: \"{name}\" is at no phase"),
                );
            }
            at => at.unwrap_or_default().0,
        };
        let size = match (mode.size(), &self.magnitude) {
            (None, None) => [0.0; 2],
            (None, Some(_)) => {
                return wrong("magnitude", "a value", &format!("no such key: \"{name}\" has no size"));
            }
            (Some(size), None) => {
                return wrong(
                    "magnitude",
                    "none",
                    &format!("{}, or two of them between which trials draw", size.allowed),
                );
            }
            (Some(size), Some(between)) => {
                let [low, high] = between.numbers(size.read, size.range).map_err(|found| {
                    error(
                        "magnitude",
                        &found,
                        &format!("{}, or two of them, the smaller one first", size.allowed),
                    )
                })?;
                if mode.is_fixed() && low != high {
                    let needed = "one value: what a drive knows, and its magnets, are the same in all trials (an axis or a tolerance of `faults.0.magnitude` varies them)";
                    return wrong("magnitude", "two values", needed);
                }
                [low, high]
            }
        };
        let time = |value: &Value| value.clone().try_into::<Quantity<Second>>().ok().map(Quantity::value);
        let onset = match &self.onset {
            None => [0.0; 2],
            Some(_) if !mode.may_begin() => {
                return wrong(
                    "onset",
                    "a time",
                    &format!("no such key: \"{name}\" is there before the detection"),
                );
            }
            Some(onset) => onset.numbers(time, [0.0, LONGEST]).map_err(|found| {
                error("onset", &found, "a time from 0 to 20 s, or two of them, the earlier one first")
            })?,
        };
        let lasts = match self.lasts.map(Quantity::value) {
            None => f64::INFINITY,
            Some(_) if !mode.may_begin() => {
                return wrong("lasts", "a time", &format!("no such key: \"{name}\" does not pass"));
            }
            Some(lasts) if (1e-9..=LONGEST).contains(&lasts) => lasts,
            Some(lasts) => return wrong("lasts", &format!("{lasts} s"), "a time from 1 ns to 20 s"),
        };
        Ok(FaultSettings { mode, at, size, onset, lasts })
    }
}

impl Between {
    /// Returns both ends as numbers.
    ///
    /// # Errors
    /// What was found, where it is no such value, out of its range or in the wrong order.
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
}

/// Checks the faults of a file on a scenario that is built but for its detector.
///
/// # Errors
/// An invalid value, a part that the drive does not have, or more faults than can be simulated together.
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
            return Err(FileError::key(&format!("faults[{number}].mode"), &found, needed));
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
            return Err(FileError::key(
                &format!("faults[{number}].at"),
                &format!("\"{}\"", fault.at.name()),
                needed,
            ));
        }
        if let (FaultMode::CurrentBit, Some(adc)) = (fault.mode, scenario.sensors.adc)
            && (fault.size[1] > f64::from(adc.bits - 1) || fault.size.iter().any(|bit| bit.fract() != 0.0))
        {
            let found = format!("{} to {}", fault.size[0], fault.size[1]);
            let needed = format!("whole numbers from 0 to {}, the bits of the converter", adc.bits - 1);
            return Err(FileError::key(&format!("faults[{number}].magnitude"), &found, &needed));
        }
        all.push(fault);
    }
    Ok(all)
}

/// Applies faults of the drive's knowledge.
pub(crate) fn misinform(faults: &[FaultSettings], nameplate: &mut Nameplate<f64>) {
    for fault in faults {
        let [factor, _] = fault.size;
        match fault.mode {
            FaultMode::SheetSignature => {
                for signature in [&mut nameplate.signature, &mut nameplate.pulse_signature] {
                    *signature = match *signature {
                        Signature::Normal => Signature::Inverted,
                        Signature::Inverted => Signature::Normal,
                        Signature::None => Signature::None,
                    };
                }
            }
            FaultMode::SheetInductance => {
                nameplate.d_axis_inductance *= factor;
                nameplate.q_axis_inductance *= factor;
                nameplate.rated_pulse = Nanos::from_seconds(nameplate.rated_pulse.seconds() * factor);
            }
            FaultMode::SheetResistance => nameplate.resistance *= factor,
            _ => {}
        }
    }
}

/// Applies faults of the magnets.
///
/// # Errors
/// Magnets that the motor's core does not describe.
pub(crate) fn demagnetise(faults: &[FaultSettings], motor: Motor) -> Result<Motor, FileError> {
    let weak = faults.iter().enumerate().filter(|(_, fault)| fault.mode == FaultMode::MagnetWeak);
    weak.clone().try_fold(motor, |motor, (number, fault)| {
        let left = 1.0 - fault.size[0];
        motor.with_magnet(left).map_err(|why| {
            let needed = why.unwrap_or_else(|| "magnets that the motor's core describes".to_owned());
            let found = format!("{} % lost", fault.size[0] * 100.0);
            FileError::key(&format!("faults[{number}].magnitude"), &found, &needed)
        })
    })
}

impl FaultSettings {
    /// Breaks the part in the case of a trial.
    fn apply(&self, case: &mut Case<'_>, [place, size, sign, onset]: [f64; 4]) {
        let between = |[low, high]: [f64; 2], share: f64| low + (high - low) * share;
        let size = between(self.size, size);
        let way = if sign < 0.5 { 1.0 } else { -1.0 };
        let places = self.mode.places(case.sensors.settings.arrangement);
        let k = match self.at {
            FaultPlace::A => 0,
            FaultPlace::B => 1,
            FaultPlace::C => 2,
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "one of three at most"
            )]
            FaultPlace::Any => ((place * places as f64) as usize).min(places - 1),
        };
        let (m, n) = ((k + 1) % 3, (k + 2) % 3);
        let from = between(self.onset, onset);
        let until =
            if self.lasts.is_finite() { Nanos::from_seconds(from + self.lasts) } else { Nanos(u64::MAX) };
        let sensor = |how| Broken::Sensor(k, how);
        let (inverter, sensors) = (&mut case.inverter, &mut case.sensors);
        let broken = match self.mode {
            FaultMode::PhaseOpen => Broken::Wire(k),
            FaultMode::ContactResistance => Broken::Contact(k, size),
            FaultMode::TerminalsSwapped => {
                let mut wires = [0, 1, 2];
                wires.swap(m, n);
                Broken::Wires(wires)
            }
            FaultMode::TerminalsTurned => Broken::Wires(if way > 0.0 { [1, 2, 0] } else { [2, 0, 1] }),
            FaultMode::UpperSwitchOpen => Broken::Switch(k, Gate::High),
            FaultMode::LowerSwitchOpen => Broken::Switch(k, Gate::Low),
            FaultMode::LegOff => Broken::Switch(k, Gate::Off),
            FaultMode::CurrentDead => sensor(Misreading::Dead),
            FaultMode::CurrentFrozen => sensor(Misreading::Frozen),
            FaultMode::CurrentStuck => sensor(Misreading::Stuck(way * size)),
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to 23")]
            FaultMode::CurrentBit => sensor(Misreading::Bit(size.round() as u8, way > 0.0)),
            FaultMode::CurrentGain => sensor(Misreading::Gain(size)),
            FaultMode::CurrentOffset => sensor(Misreading::Offset(way * size)),
            FaultMode::CurrentSign => sensor(Misreading::Gain(-1.0)),
            FaultMode::CurrentsSwapped => Broken::Exchanged(m, n),
            FaultMode::ReferenceDrift => Broken::Drift(way * size),
            FaultMode::LinkGain => Broken::Sensor(3, Misreading::Gain(size)),
            FaultMode::LinkStuck => Broken::Sensor(3, Misreading::Stuck(size)),
            FaultMode::ComparatorStuck => Broken::Deaf,
            FaultMode::CommandLate => Broken::Late(inverter.carrier_period),
            FaultMode::DutyLimited => Broken::Duty(size),
            FaultMode::SampleLost => Broken::Stale,
            // Of the scenario: what the drive knows, and its magnets.
            FaultMode::MagnetWeak
            | FaultMode::SheetSignature
            | FaultMode::SheetInductance
            | FaultMode::SheetResistance => return,
            FaultMode::DeadTimeLong => {
                for gates in &mut inverter.gates {
                    gates.dead_time = Nanos::from_seconds(gates.dead_time.seconds() * size);
                }
                return;
            }
            FaultMode::LinkCapacitorAged => {
                if let Some(storage) = &mut inverter.link.storage {
                    storage.capacitance *= size;
                }
                return;
            }
            FaultMode::SupplyWeak => {
                inverter.link.storage =
                    inverter.link.storage.map(|storage| Storage { source_resistance: size, ..storage });
                return;
            }
            FaultMode::CurrentSlow => {
                sensors.corner[k] *= size;
                return;
            }
            FaultMode::SampleLate => {
                sensors.settings.sample_delay = sensors.settings.sample_delay + Nanos::from_seconds(size);
                return;
            }
            FaultMode::TimerOff => {
                sensors.comparator.tick /= 1.0 - size;
                return;
            }
        };
        // A scenario has no more faults than a case.
        case.faults.push(Fault { broken, from: Nanos::from_seconds(from), until });
    }
}

/// Breaks what is broken in the case of a trial.
pub(crate) fn apply(faults: &[FaultSettings], case: &mut Case<'_>, streams: Streams) {
    if faults.is_empty() {
        return;
    }
    let mut draws = streams.open(Purpose::Fault);
    for fault in faults {
        fault.apply(case, [(); 4].map(|()| draws.uniform()));
    }
}

impl FaultMode {
    /// Returns how many places a drive has for such a fault: of its current sensors those that it has.
    fn places(self, arrangement: Arrangement) -> usize {
        let of_sensors = self.has_place() && self.name().starts_with("current");
        match arrangement {
            Arrangement::TwoInLine if of_sensors => 2,
            Arrangement::DcLinkShunt if of_sensors => 1,
            _ => 3,
        }
    }

    /// Returns what a drive would need to have such a fault; none where it can have it.
    pub fn lacks(self, scenario: &Scenario<Method<f64>>) -> Option<&'static str> {
        use standstill_sim::Arrangement::{DcLinkShunt, LowSideShunts, None as NoSensors, ThreeInLine};
        let (sensors, arrangement) = (&scenario.sensors, scenario.sensors.arrangement);
        match self {
            Self::MagnetWeak if !scenario.motor.has_magnet() => Some("a motor with magnets"),
            Self::DeadTimeLong if scenario.drive.dead_time == Nanos::ZERO => {
                Some("`inverter.dead_time` above 0")
            }
            Self::LinkCapacitorAged | Self::SupplyWeak if scenario.drive.link.storage.is_none() => Some(
                "`inverter.capacitance` beside it: the link of this drive has the source's voltage at any current",
            ),
            Self::CurrentDead
            | Self::CurrentFrozen
            | Self::CurrentStuck
            | Self::CurrentBit
            | Self::CurrentGain
            | Self::CurrentOffset
            | Self::CurrentSign
            | Self::CurrentSlow
                if arrangement == NoSensors =>
            {
                Some("a drive that reads currents")
            }
            Self::CurrentsSwapped if !matches!(arrangement, ThreeInLine | LowSideShunts) => {
                Some("a drive with three current sensors")
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
