//! The keys of the detector: its method with settings, or a library or class that replaces the method.

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use standstill_detect::{Kind, Method, MethodName, SettingsError, Signature, keys, method_keys};
use standstill_quantity::unit::{Ampere, Degree, Hertz, One, Second, Share, Volt};
use standstill_quantity::{Quantity, Unit as _};

use super::checks::CheckList;
use super::{Range, TIME, Table, Values, Written, table};
use crate::PoleRule;
use crate::Scenario;
use crate::document::FileError;
use crate::named::Named;

/// Settings of a user's detector, which is a library or a class. These settings replace the settings of a built-in method and may have any
/// keys.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(transparent)]
pub struct Config(pub IndexMap<String, toml::Value>);

/// A setting of a library: a text, a number, or true or false.
#[derive(JsonSchema)]
#[serde(untagged)]
#[expect(dead_code, reason = "only its schema is used")]
enum Scalar {
    Text(String),
    Number(f64),
    Flag(bool),
}

impl JsonSchema for Config {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Config".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        IndexMap::<String, Scalar>::json_schema(generator)
    }
}

impl Written for Config {
    fn values() -> Values {
        Values::Text
    }
}

/// Expands to the type of the field for a method's key.
macro_rules! field {
    (Flag) => {
        bool
    };
    (Checks) => {
        CheckList
    };
    ($unit:ident) => {
        Quantity<$unit>
    };
}

macro_rules! detector {
    ($($(#[doc = $about:literal])+ $key:ident = $name:ident: $unit:tt $([$($range:tt)*] because $reason:literal)?, as $example:literal;)+) => {
        table! {
            /// The method and its settings. A setting without a value is computed for the motor; one that the method does not have is an error.
            pub struct DetectorTable = "detector" of scenario {
                /// The method.
                method: Named<MethodName> {};
                /// The pole that the detector assumes to draw more current.
                signature: Named<Signature> { example: "\"normal\"" };
                /// The rule by which poles are decided.
                polarity: Named<PoleRule> { example: "\"sequential\"" };
                $($(#[doc = $about])+ $name: field!($unit) { range: of_method(&keys::$key), example: $example };)+
                /// Dead time that the detector assumes.
                dead_time: Quantity<Second> { range: Some(TIME), example: "\"2 us\"" };
                /// Longest time of a detection, in simulated time: a longer one fails. Default: 20 s.
                time_limit: Quantity<Second> [scenario.time_limit] {
                    range: Some(Range::new(1e-3, 1e3, "from 1 ms to 1000 s of simulated time", "a pulse takes a millisecond, no start 1000 s")),
                    example: "\"20 s\"",
                };
                /// Path of a shared library that is the detector in place of a method: see docs/firmware.md.
                library: String { example: "\"./mine.so\"" };
                /// Python class that is the detector in place of a method, as `module.Class@digest`. `standstill.run(..., detector=Class)` writes it into the record
                /// of its run, and runs it: see docs/python.md.
                python: String {};
                /// With --isolate, the longest time that a call of the library may take on the clock. Without it, 1 s.
                call_timeout: Quantity<Second> {
                    range: Some(Range::new(1e-3, 1e3, "from 1 ms to 1000 s", "the scheduler alone delays a process by some 1 ms")),
                    example: "\"1 s\"",
                };
                /// Settings of the library, handed over as lines KEY=VALUE.
                config: Config { example: "{ voltage = 20 }" };
            }
        }
    };
}

method_keys!(detector);

/// Returns the range of a method's numeric key; none for other kinds of keys.
const fn of_method(key: &keys::Key) -> Option<Range> {
    match key.kind {
        Kind::Number { whole, range: [low, high], needed, reason, .. } => {
            let range = Range::new(low, high, needed, reason);
            Some(if whole { range.whole() } else { range })
        }
        Kind::Flag | Kind::Checks => None,
    }
}

impl DetectorTable {
    /// Returns the method; the default method if none is set.
    pub fn method(&self) -> MethodName {
        self.method.unwrap_or_default().0
    }

    /// Returns the detector's name for messages and reports: the class, the library's file, or the method.
    pub fn name(&self) -> &str {
        let stem = |library| std::path::Path::new(library).file_stem().and_then(|stem| stem.to_str());
        match (&self.python, &self.library) {
            (Some(class), _) => class.split('@').next().unwrap_or(class),
            (None, Some(library)) => stem(library).unwrap_or(library),
            (None, None) => self.method().name(),
        }
    }

    /// Iterates over the settings of the library.
    pub(crate) fn config(&self) -> impl Iterator<Item = (&String, &toml::Value)> {
        self.config.iter().flat_map(|Config(settings)| settings)
    }

    /// Iterates over the method's keys that are set, with their values.
    fn settings(&self) -> impl Iterator<Item = (&'static keys::Key, keys::Value)> {
        let values: IndexMap<&str, &dyn Written> =
            self.set_values().map(|(key, value)| (key.path.trim_start_matches("detector."), value)).collect();
        // `keys::ALL` has the order in which settings are applied.
        keys::ALL.into_iter().filter_map(move |key| {
            let value = values.get(key.name)?;
            let checks = value.checks().map(keys::Value::Checks);
            let other =
                || value.number().map_or_else(|| keys::Value::Flag(value.flag()), keys::Value::Number);
            Some((key, checks.unwrap_or_else(other)))
        })
    }

    /// Returns a key that is set although only built-in methods have such settings and the detector is a library. Returns none if no such
    /// key is set.
    pub(crate) fn foreign_to_library(&self) -> Option<&'static str> {
        let [method, polarity] = [self.method.map(|_| "method"), self.polarity.map(|_| "polarity")];
        method.or(polarity).or_else(|| self.settings().next().map(|(key, _)| key.name))
    }

    /// Writes the table's settings into the settings of `method`. `difference` is the relative difference between the currents of the
    /// motor's two poles.
    ///
    /// # Errors
    /// The method does not have a setting or a check.
    pub(crate) fn apply(&self, method: &mut Method<f64>, difference: f64) -> Result<(), FileError> {
        let foreign = |key: &str| FileError::foreign_setting(key, self.method());
        if let Some(Named(rule)) = self.polarity {
            let polarity = method.polarity_mut().ok_or_else(|| foreign("polarity"))?;
            polarity.rule = rule.settings(difference);
        }
        if let Some(checks) = self.checks {
            checks.check(self.method())?;
        }
        for (key, value) in self.settings() {
            if !method.set(key, value) {
                return Err(foreign(key.name));
            }
        }
        Ok(())
    }
}

/// Converts the error of unworkable settings to an error that names the key and its effective value.
pub(crate) fn unworkable(scenario: &Scenario<Method<f64>>, error: &SettingsError) -> FileError {
    let method = &scenario.detector;
    let Some(of) = keys::ALL.iter().find(|key| key.name == error.setting) else {
        // Most methods take the dead time from the drive.
        return if error.setting == "dead_time" {
            of_drive(scenario, error)
        } else {
            FileError::settings(error)
        };
    };
    let path = format!("detector.{}", of.name);
    match (method.get(of), super::key(&path)) {
        (Some(value), Some(key)) => {
            FileError::key(&path, &key.readable(value.number(), error.needed), error.needed)
        }
        _ => FileError::settings(error),
    }
}

/// Returns the error for a dead time of the drive with which the method cannot work.
fn of_drive(scenario: &Scenario<Method<f64>>, error: &SettingsError) -> FileError {
    let pulse = scenario.detector.get(&keys::PULSE).zip(super::key("detector.pulse"));
    let pulse = pulse.map(|(value, key)| format!(" of {}", key.readable(value.number(), error.needed)));
    let found = Second::DIMENSION.text(scenario.drive.dead_time.seconds());
    FileError::key("inverter.dead_time", &found, &format!("{}{}", error.needed, pulse.unwrap_or_default()))
}
