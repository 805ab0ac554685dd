//! The registry of a scenario's keys: each key is one entry of a table, and all other descriptions of the key are
//! derived from this entry.
//!
//! The entry in [`table!`] declares the field into which files are read. The following are derived from the list of
//! entries: ranges and their errors, the schema, effective values, values that trials draw, sources of an error budget,
//! warnings, variables of an FMU, the example that `init` writes, the table in `docs/reference.md` and the panel of the
//! lab. Rules between keys are code: `build.rs`, `link.rs`, `terminals.rs`.

mod checks;
mod detector;
mod entry;
mod inverter;
pub(crate) mod motor;
mod range;
mod rotor;
mod sensors;
#[cfg(test)]
mod tests;
mod written;

use standstill_detect::{Method, keys as methods};
use standstill_quantity::Quantity;
use standstill_quantity::unit::{Degree, Share};
use toml::Value;

pub use self::checks::CheckList;
pub use self::detector::DetectorTable;
pub(crate) use self::detector::unworkable;
use self::entry::number;
pub use self::entry::{Key, Usual, Values};
pub use self::inverter::InverterTable;
pub use self::range::Range;
use self::range::{LARGEST, NOT_NEGATIVE, POSITIVE, PRECISION, SHARE, TEMPERATURE, TIME};
pub use self::rotor::RotorTable;
pub use self::sensors::SensorsTable;
use self::written::Place;
pub(crate) use self::written::Written;
use crate::document::FileError;
use crate::named::Named;
use crate::{ErrorSet, Scenario};

/// Defines a table of a scenario: its struct and the list of its keys.
///
/// An entry has a describing sentence, a name and a type, the field of [`Scenario`] that the number sets directly (if
/// there is one), and further fields of [`Key`].
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

/// A table of a scenario file, such as `[sensors]`.
pub(crate) trait Table {
    /// Keys of the table in their order.
    const KEYS: &'static [Key];

    /// Returns the values of the table in the order of its keys; none for a key that is not set.
    fn values(&self) -> Vec<Option<&dyn Written>>;

    /// Iterates over the keys that are set, with their values.
    fn set_values(&self) -> impl Iterator<Item = (&'static Key, &dyn Written)> {
        Self::KEYS.iter().zip(self.values()).filter_map(|(key, value)| Some((key, value?)))
    }

    /// Checks all values of the table.
    ///
    /// # Errors
    /// A value is outside its key's range.
    fn check(&self) -> Result<(), FileError> {
        self.set_values().try_for_each(|(key, value)| key.check(value))
    }

    /// Checks that keys are set only if the drive has the part that they need. `paths` are the paths of the keys. `there` is true if the
    /// drive has the part. `needed` describes the part.
    ///
    /// # Errors
    /// One of these keys is set, but the drive lacks the part. The error contains `needed`.
    fn needs(&self, paths: &[&str], there: bool, needed: &str) -> Result<(), FileError> {
        let set = |path: &&str| self.set_values().find(|(key, _)| key.path == *path);
        match paths.iter().find_map(set) {
            Some((key, value)) if !there => Err(FileError::key(key.path, &value.text(), needed)),
            _ => Ok(()),
        }
    }

    /// Writes the numbers of the table into the scenario. Only keys that directly set a field of [`Scenario`] are written.
    fn set(&self, scenario: &mut Scenario<Method<f64>>) {
        for (key, value) in self.set_values() {
            if let (Some(set), Some(number)) = (key.set, value.number()) {
                set(scenario, number);
            }
        }
    }
}

table! {
    /// Widths of the 95 % intervals at which a point ends; every key that is set must be met. They are checked after 100
    /// trials and after each further quarter of the trials, so that a run ends with the same trial on any machine.
    #[derive(Copy)]
    pub struct StopTable = "stop_at" of scenario {
        /// Half the interval of the rms error, as a share of the rms error.
        rms: Quantity<Share> { range: Some(PRECISION) };
        /// Half the interval of the probability of a wrong pole.
        wrong_poles: Quantity<Share> { range: Some(PRECISION) };
    }
}

impl StopTable {
    /// Returns true if no stop condition is set.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// Keys outside any table. Their fields are in [`ScenarioFile`](crate::ScenarioFile).
const TOP: &[Key] = &[
    Key::of(
        "errors",
        "Set of errors of drive and sensors, for all keys that the tables below do not set.",
        <Named<ErrorSet> as Written>::values,
    ),
    Key {
        range: Some(Range::new(1.0, i64::MAX as f64, "at least 1", "statistics need a trial").whole()),
        ..Key::of("trials", "Number of trials, at each point if there are axes.", || Values::Whole)
    },
    Key {
        range: Some(
            Range::new(
                0.0,
                u64::MAX as f64,
                "a whole number from 0 to 18446744073709551615",
                "a seed has 64 bits",
            )
            .whole(),
        ),
        ..Key::of("seed", "Seed of all random numbers.", || Values::Whole)
    },
    Key {
        range: Some(Range::new(
            0.0,
            180.0,
            "from 0 to 180 degrees",
            "two directions are at most half a turn apart",
        )),
        ..Key::of(
            "limit",
            "Angle error in degrees: trials with a larger error, wrong poles included, are counted. Default: 2°.",
            <Quantity<Degree> as Written>::values,
        )
    },
];

/// Iterates over all keys, table by table. The keys of the motor, which its data sheet defines, and the tables `axes`, `design` and
/// `tolerances` of the sweep are left out.
pub fn keys() -> impl Iterator<Item = &'static Key> {
    let tables =
        [StopTable::KEYS, RotorTable::KEYS, InverterTable::KEYS, SensorsTable::KEYS, DetectorTable::KEYS];
    TOP.iter().chain(tables.into_iter().flatten())
}

/// Returns the key with this path; none for keys of the motor.
pub fn key(path: &str) -> Option<&'static Key> {
    keys().find(|key| key.path == path)
}

/// Checks the value of a key outside any table.
///
/// # Errors
/// The value is outside the key's range.
pub(crate) fn check(path: &str, value: &dyn Written) -> Result<(), FileError> {
    key(path).map_or(Ok(()), |key| key.check(value))
}

impl Scenario<Method<f64>> {
    /// Returns the value of a key of the tables `rotor`, `inverter`, `sensors` and `detector`. A number has the unit of the schema: degrees
    /// for angles, the SI unit for other quantities. A choice is returned as its name. Returns none in two cases. The key does not apply to
    /// this scenario, such as a setting of another method. Or only the document contains the value of the key, as for `detector.library`.
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
                methods::Value::Checks(checks) => CheckList::of(checks).value(),
                methods::Value::Number(value) => number(value),
            }),
            None => key(path).filter(|key| (key.applies)(self)).and_then(|key| (key.get)(self)),
        }
    }
}
