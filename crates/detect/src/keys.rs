//! Keys: the settings of methods that an engineer may change by name, in a scenario or on a command line.
//!
//! A key's name, unit, range and meaning are defined once here, because several methods may have the same key. Each
//! method's own file lists the keys that the method has, and how each changes the settings, as a table of [`Setting`]s.
//! All code that reads, checks, lists or prints keys uses these tables.
//!
//! ```
//! use standstill_detect::{Decay, Method, MethodName, Value, keys};
//! # use standstill_detect::{Nameplate, Signature};
//! # use standstill_interface::Nanos;
//! # let drive = Nameplate {
//! #     rated_current: 7.0, resistance: 1.2, d_axis_inductance: 10e-3, q_axis_inductance: 18e-3, magnet_flux: 0.5,
//! #     signature: Signature::Normal, pulse_signature: Signature::Normal, polarity_difference: 0.1,
//! #     cross_saturation: 0.0,
//! #     rated_pulse: Nanos::from_micros(300), gain_tolerance: 0.005, dc_link: 540.0, dead_time: Nanos(2000),
//! #     delay_mismatch: 0.0, carrier_period: Nanos::from_micros(100), switch_drop: [1.0, 0.01], diode_drop: [1.0, 0.01],
//! #     reverse_drop: [1.0, 0.01], sensing: standstill_detect::Sensing::default(),
//! #     dividers: standstill_detect::Dividers::default(),
//! # };
//! let mut method = Method::<f64>::suited(MethodName::Bipolar, &drive);
//! assert!(method.set(&keys::ROUNDS, Value::Number(4.0)));
//! assert_eq!(method.get(&keys::ROUNDS), Some(Value::Number(4.0)));
//! // An injection has no rounds.
//! let mut injection = Method::<f64>::suited(MethodName::HfiRotating, &drive);
//! assert!(!injection.set(&keys::ROUNDS, Value::Number(4.0)));
//! ```

use core::fmt;

use standstill_interface::{Nanos, Real};

use crate::checks::{Check, Checks};
use crate::settings::Source;

/// A value of a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A number in the key's unit.
    Number(f64),
    /// Yes or no.
    Flag(bool),
    /// Checks that are on.
    Checks(Checks),
}

/// Kind of a key's values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Numbers.
    Number {
        /// Symbol of the unit; empty for shares and pure numbers.
        unit: &'static str,
        /// Whether the numbers are shares, which people write in per cent.
        share: bool,
        /// Whether the numbers are whole.
        whole: bool,
        /// Smallest and largest value.
        range: [f64; 2],
        /// The range in words.
        needed: &'static str,
        /// Reason for the range.
        reason: &'static str,
    },
    /// Yes or no.
    Flag,
    /// Checks that are on: all, none or a list of them.
    Checks,
}

/// A key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Name of the key, as files have it.
    pub name: &'static str,
    /// Description, in a sentence.
    pub about: &'static str,
    /// Kind of the key's values.
    pub kind: Kind,
}

/// A key of the settings `S`, with the functions that get and set its value.
#[derive(Debug)]
pub struct Setting<S: 'static> {
    /// The key.
    pub key: &'static Key,
    /// Function that returns the key's value; none if these settings do not have the key.
    pub get: fn(&S) -> Option<Value>,
    /// Function that sets the key. Returns false if these settings do not have the key, or if checks are given as a
    /// number.
    pub set: fn(&mut S, Value) -> bool,
}

/// Function that receives the name of a setting and its value as text for people.
pub type Lines<'a> = dyn FnMut(&'static str, fmt::Arguments<'_>) + 'a;

/// Settings of a method whose values can be set by key.
///
/// ```
/// # let nameplate = include!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/nameplate.rs"));
/// use standstill_detect::{BipolarSettings, Keyed};
///
/// // What files and command lines can set of a method.
/// let names: Vec<&str> = BipolarSettings::<f64>::SETTINGS.iter().map(|setting| setting.key.name).collect();
/// assert!(names.contains(&"pulse") && names.contains(&"rounds"));
/// ```
pub trait Keyed: Sized + 'static {
    /// Keys of these settings, with their access functions.
    const SETTINGS: &'static [Setting<Self>];

    /// Calls `line` with name and value of each setting that an engineer would copy into a drive, including settings
    /// that are derived from others. By default there are none.
    fn describe(&self, _line: &mut Lines<'_>) {}

    /// The kinds of readings of which any one is enough for the method: see [`crate::Settings::sources`].
    const SOURCES: &'static [Source] = &[Source::PhaseCurrents];

    /// Returns the kinds of readings of which one is enough with these settings; by default [`Self::SOURCES`].
    fn needed_sources(&self) -> &'static [Source] {
        Self::SOURCES
    }

    /// The checks that the method has, and that a list of the key [`CHECKS`] can name; by default [`Check::Turning`]
    /// alone. Other checks would have no effect, so readers of files refuse them.
    const CHECKS: Checks = Checks::NONE.with(Check::Turning);

    /// Whether the method turns the rotor, see [`crate::Settings::turns_rotor`].
    const TURNS_ROTOR: bool = false;

    /// Returns the period of the PWM carrier: see [`crate::Settings::carrier_period`].
    fn carrier(&self) -> Option<Nanos> {
        None
    }

    /// Returns the setting of a key; none if there is no such key.
    fn setting(key: &Key) -> Option<&'static Setting<Self>> {
        Self::SETTINGS.iter().find(|setting| setting.key.name == key.name)
    }
}

/// The units of keys, as files have them: symbol, whether the values are shares, whether they are whole.
#[allow(non_upper_case_globals, reason = "names of the units' types")]
mod unit {
    pub const Second: (&str, bool, bool) = ("s", false, false);
    pub const Ampere: (&str, bool, bool) = ("A", false, false);
    pub const Volt: (&str, bool, bool) = ("V", false, false);
    pub const Hertz: (&str, bool, bool) = ("Hz", false, false);
    pub const Degree: (&str, bool, bool) = ("deg", false, false);
    pub const Share: (&str, bool, bool) = ("", true, false);
    pub const One: (&str, bool, bool) = ("", false, true);
}

/// Makes a static [`Key`] of each entry, and the list of all keys.
macro_rules! entries {
    ($($(#[doc = $about:literal])+ $key:ident = $name:ident: $unit:tt $([$($range:tt)*] because $reason:literal)?, as $example:literal;)+) => {
        $($(#[doc = $about])+
        pub static $key: Key = Key {
            name: stringify!($name),
            about: concat!($($about),+).trim_ascii(),
            kind: entries!(@kind $unit $([$($range)*] $reason)?),
        };)+

        /// All keys, in the order in which they must be set: setting a pulse also chooses its samples, which a later
        /// key may change.
        pub static ALL: [&Key; [$(stringify!($name)),+].len()] = [$(&$key),+];
    };
    (@kind Flag) => {
        Kind::Flag
    };
    (@kind Checks) => {
        Kind::Checks
    };
    (@kind $unit:ident [$low:expr, $high:expr, $needed:literal] $reason:literal) => {
        Kind::Number {
            unit: unit::$unit.0,
            share: unit::$unit.1,
            whole: unit::$unit.2,
            range: [$low, $high],
            needed: $needed,
            reason: $reason,
        }
    };
}

/// Calls a macro with the entries of all keys. An entry consists of a sentence, the name of the static and of the key,
/// the unit (`Flag`: yes or no), the smallest and the largest value, the range in words, the reason for the range, and
/// an example in TOML. The reader of scenario files makes a field of each entry.
#[doc(hidden)]
#[macro_export]
macro_rules! method_keys {
    ($then:ident) => {
        $then! {
            /// Length of the line pulses.
            PULSE = pulse: Second [1e-6, 10e-3, "from 1 µs to 10 ms"]
                because "a bridge switches no faster than 1 µs, and 10 ms exceed the time constant of most windings", as "\"120 us\"";
            /// Time for which all switches are open after each line pulse of methods that pulse in both directions, as a share of the pulse; the current needs a little less than the pulse to decay.
            REST = rest: Share [1.001, 10.0, "from 100.1 % to 1000 % of the pulse"]
                because "one per mille of the shortest pulse is the nanosecond by which a rest must be longer", as "\"160 %\"";
            /// Number of rounds of pulses through all lines, or of pulses per line.
            ROUNDS = rounds: One [1.0, 255.0, "a whole number from 1 to 255"]
                because "the count is a byte in a drive's memory", as "4";
            /// Saliency |L_B|/L_A below which the detector gives no angle.
            LEAST_SALIENCY = least_saliency: Share [0.0, 1.0, "a share from 0 to 1"]
                because "the second harmonic of an inductance is at most its mean", as "\"2 %\"";
            /// Largest allowed probability of a wrong pole.
            POLE_ERROR = pole_error: Share [1e-30, 0.5, "a probability from 1e-30 to 0.5"]
                because "a guess is wrong in half of all starts", as "\"0.01 %\"";
            /// Current of a polarity test's vectors.
            VECTOR_CURRENT = vector_current: Ampere [f64::MIN_POSITIVE, 1e12, "more than zero"]
                because "without current nothing saturates", as "\"8 A\"";
            /// Standard deviation of the gains of the current sensors, or of the dividers at the terminals, that the detector assumes; 0: equal.
            GAIN_TOLERANCE = gain_tolerance: Share [0.0, 1e12, "zero or more"]
                because "a standard deviation has no sign", as "\"0.5 %\"";
            /// Corner frequency of the current sensors' filters as their data sheet states it; 0: no filter.
            BANDWIDTH = bandwidth: Hertz [0.0, 1e12, "zero or more"]
                because "a frequency has no sign", as "\"200 kHz\"";
            /// Standard deviation of the angle at which an adaptive method stops.
            DEVIATION = deviation: Degree [f64::MIN_POSITIVE, 1e12, "more than zero"]
                because "no number of pulses makes an angle exact", as "\"0.1 deg\"";
            /// Amplitude of an injected voltage.
            VOLTAGE = voltage: Volt [f64::MIN_POSITIVE, 1e12, "more than zero"]
                because "without voltage no current answers", as "\"30 V\"";
            /// Smallest time of each of the two vectors of a carrier period in which an injection samples a shunt in the DC link. Edges are
            /// shifted to give this time, and by the opposite in the next period.
            WINDOW = window: Second [1e-7, 1e-3, "from 0.1 us to 1 ms"]
                because "half a carrier period has room for both", as "\"15 us\"";
            /// Whether an injection compensates dead time and drops.
            COMPENSATION = compensation: Flag, as "true";
            /// Checks of the readings for faulty parts and for a rotor that turns: true for all, false for none, or a list.
            CHECKS = checks: Checks, as "[\"link\", \"sensors\"]";
            /// Whether the detector first compares the dividers at the terminals, with all legs high.
            COMPARISON = comparison: Flag, as "false";
            /// Current at which each of the six pulses ends. Without a timer, the pulse is as long as this current takes on the data sheet's motor.
            THRESHOLD = threshold: Ampere [f64::MIN_POSITIVE, 1e12, "more than zero"]
                because "without current nothing saturates", as "\"8 A\"";
            /// Time for which all switches are open after each of the six pulses, as a share of the longest pulse. After less than about two thirds, a current remains in the next pulse, which shifts axis and pole.
            PAUSE = pause: Share [0.01, 10.0, "from 1 % to 1000 % of the longest pulse"]
                because "without a pause one pulse goes over into the next", as "\"160 %\"";
            /// Order of the six pulses: true if each is followed by the opposite one, false if by the next one around the circle.
            PAIRS = pairs: Flag, as "false";
            /// True if the six pulses last until a comparator trips and their times are compared, false if they last a fixed time and their currents are compared.
            TIMED = timed: Flag, as "true";
            /// Width of the sectors in which six pulses give the angle: 30° or 60°; 0: an interpolated angle.
            SECTOR = sector: Degree [0.0, 60.0, "0, 30 or 60 degrees"]
                because "six directions divide a turn into sectors of 60° or halves of these", as "\"0 deg\"";
        }
    };
}

method_keys!(entries);

impl Value {
    /// Makes the value of a number.
    pub fn of<T: Real>(number: T) -> Self {
        Self::Number(number.to_double())
    }

    /// Makes the value of a time, in s.
    pub fn time(time: Nanos) -> Self {
        Self::Number(time.seconds())
    }

    /// Makes the value of a count.
    pub fn times(count: u8) -> Self {
        Self::Number(f64::from(count))
    }

    /// Returns the value as a number: 0 or 1 for a flag, [`Checks::number`] for checks.
    pub fn number(self) -> f64 {
        match self {
            Self::Number(number) => number,
            Self::Flag(flag) => f64::from(u8::from(flag)),
            Self::Checks(checks) => checks.number(),
        }
    }

    /// Returns the value as a number in a detector's precision.
    pub(crate) fn real<T: Real>(self) -> T {
        T::of(self.number())
    }

    /// Returns a value in seconds as a time.
    pub(crate) fn nanos(self) -> Nanos {
        Nanos::from_seconds(self.number())
    }

    /// Returns the value as a count.
    // Clamped to the range of the type.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub(crate) fn count(self) -> u8 {
        self.number().clamp(0.0, 255.0) as u8
    }

    /// Returns the value as checks: all or none for a flag; `None` for a number.
    pub(crate) fn checks(self) -> Option<Checks> {
        match self {
            Self::Checks(checks) => Some(checks),
            Self::Flag(all) => Some(Checks::all(all)),
            Self::Number(_) => None,
        }
    }

    /// Returns whether a flag is set.
    pub(crate) fn is_set(self) -> bool {
        self.number() != 0.0
    }
}

impl Checks {
    /// Returns the checks as a key's value.
    #[allow(clippy::unnecessary_wraps, reason = "the form of a setting that may be missing")]
    pub(crate) fn value(self) -> Option<Value> {
        Some(Value::Checks(self))
    }

    /// Sets the checks from a value; returns false if the value does not describe checks.
    pub(crate) fn set_value(&mut self, value: Value) -> bool {
        value.checks().map(|checks| *self = checks).is_some()
    }
}

impl<S> Setting<S> {
    /// Makes a setting that always exists.
    pub(crate) const fn new(
        key: &'static Key,
        get: fn(&S) -> Option<Value>,
        set: fn(&mut S, Value) -> bool,
    ) -> Self {
        Self { key, get, set }
    }
}

/// Makes a [`Setting`] from a key, the place of its value in the settings, and the conversions from and to a [`Value`].
macro_rules! place {
    // A setting that may be missing: the methods that get and set it.
    ($key:ident, $s:ident => $place:expr => $get:ident, $set:ident) => {
        crate::keys::Setting::new(&crate::keys::$key, |$s| $place.$get(), |$s, value| $place.$set(value))
    };
    // A setting whose value is computed: the expression that gets it, and the statement that sets it.
    ($key:ident, $s:ident => $get:expr; $value:ident => $set:expr) => {
        crate::keys::Setting::new(
            &crate::keys::$key,
            |$s| Some($get),
            |$s, $value| {
                $set;
                true
            },
        )
    };
    ($key:ident, $s:ident => $place:expr, $from:path, $to:ident) => {
        crate::keys::Setting::new(
            &crate::keys::$key,
            |$s| Some($from($place)),
            |$s, value| {
                $place = value.$to();
                true
            },
        )
    };
}
pub(crate) use place;

/// Formats a time in microseconds.
pub(crate) struct Microseconds(pub Nanos);

impl fmt::Display for Microseconds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} µs", self.0.0 as f64 / 1e3)
    }
}

#[cfg(test)]
mod tests;
