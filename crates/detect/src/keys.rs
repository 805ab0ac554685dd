//! Keys: what an engineer may set of a method, by name, in a scenario or on a command line.
//!
//! What a key is, its unit, its range and what it means, stands here once, because several methods may have the same. Which
//! keys a method has and what each does to its settings stands in the method's own file, as a table of [`Setting`]s:
//! everything that reads, checks, lists or prints them goes through these tables.
//!
//! ```
//! use standstill_detect::{Decay, Method, MethodName, Value, keys};
//! # use standstill_detect::{Nameplate, Signature};
//! # use standstill_interface::Nanos;
//! # let drive = Nameplate {
//! #     rated_current: 7.0, resistance: 1.2, d_axis_inductance: 10e-3, q_axis_inductance: 18e-3, magnet_flux: 0.5,
//! #     signature: Signature::Normal, pulse_signature: Signature::Normal, polarity_difference: 0.1,
//! #     rated_pulse: Nanos::from_micros(300), gain_tolerance: 0.005, dc_link: 540.0, dead_time: Nanos(2000),
//! #     carrier_period: Nanos::from_micros(100), switch_drop: [1.0, 0.01], diode_drop: [1.0, 0.01],
//! #     reverse_drop: [1.0, 0.01], sensing: standstill_detect::Sensing::default(),
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

/// A value of a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// In the key's unit.
    Number(f64),
    /// Yes or no.
    Flag(bool),
}

/// What the values of a key are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Numbers.
    Number {
        /// Symbol of the unit; empty for shares and pure numbers.
        unit: &'static str,
        /// Whether they are shares, which people write in per cent.
        share: bool,
        /// Whether they are whole.
        whole: bool,
        /// From this to this.
        range: [f64; 2],
        /// The same in words.
        needed: &'static str,
    },
    /// Yes or no.
    Flag,
}

/// A key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Its name, as in files.
    pub name: &'static str,
    /// What it sets.
    pub about: &'static str,
    /// What its values are.
    pub kind: Kind,
}

/// What a key does to settings `S`.
#[derive(Debug)]
pub struct Setting<S: 'static> {
    /// The key.
    pub key: &'static Key,
    /// Its value as the settings are; none where they have no such thing as they are.
    pub get: fn(&S) -> Option<Value>,
    /// Sets it; false where the settings have no such thing as they are.
    pub set: fn(&mut S, Value) -> bool,
}

/// Takes the name of a setting, and its value as people read it.
pub type Lines<'a> = dyn FnMut(&'static str, fmt::Arguments<'_>) + 'a;

/// Settings that are set by key.
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
    /// Their keys and what each does.
    const SETTINGS: &'static [Setting<Self>];

    /// The settings that an engineer would copy into a drive, those that follow from others as well: calls `line` with
    /// the name and the value of each. Without lines of its own a method has none worth it.
    fn describe(&self, _line: &mut Lines<'_>) {}

    /// What a key does, if there is such a key.
    fn setting(key: &Key) -> Option<&'static Setting<Self>> {
        Self::SETTINGS.iter().find(|setting| setting.key.name == key.name)
    }
}

const fn number(unit: &'static str, range: [f64; 2], needed: &'static str) -> Kind {
    Kind::Number { unit, share: false, whole: false, range, needed }
}

const fn share(range: [f64; 2], needed: &'static str) -> Kind {
    Kind::Number { unit: "", share: true, whole: false, range, needed }
}

const MORE_THAN_ZERO: ([f64; 2], &str) = ([f64::MIN_POSITIVE, 1e12], "more than zero");

/// Length of the line pulses.
pub static PULSE: Key = Key {
    name: "pulse",
    about: "Length of the line pulses.",
    kind: number("s", [1e-6, 10e-3], "from 1 µs to 10 ms"),
};

/// Rest after each line pulse.
pub static REST: Key = Key {
    name: "rest",
    about: "How long all switches are open after each line pulse both ways, as a share of the pulse; the current needs a little less than the pulse to decay.",
    // One per mille of the shortest pulse is one nanosecond, by which a rest must be longer.
    kind: share([1.001, 10.0], "from 100.1 % to 1000 % of the pulse"),
};

/// Times that all lines are pulsed.
pub static ROUNDS: Key = Key {
    name: "rounds",
    about: "Times that all lines are pulsed, or pulses per line.",
    kind: Kind::Number {
        unit: "",
        share: false,
        whole: true,
        range: [0.0, 255.0],
        needed: "a whole number from 0 to 255",
    },
};

/// |L_B| / L_A below which no angle is named.
pub static LEAST_SALIENCY: Key = Key {
    name: "least_saliency",
    about: "|L_B| / L_A below which no angle is named.",
    kind: share([0.0, 1.0], "a share from 0 to 1"),
};

/// Current of a polarity test's vectors.
pub static VECTOR_CURRENT: Key = Key {
    name: "vector_current",
    about: "Current of a polarity test's vectors.",
    kind: number("A", MORE_THAN_ZERO.0, MORE_THAN_ZERO.1),
};

/// Probability of a wrong pole that is allowed.
pub static POLE_ERROR: Key = Key {
    name: "pole_error",
    about: "Probability of a wrong pole that is allowed.",
    kind: share([1e-30, 0.5], "a probability from 1e-30 to 0.5"),
};

/// Spread of the current sensors' gains.
pub static GAIN_TOLERANCE: Key = Key {
    name: "gain_tolerance",
    about: "Standard deviation of the current sensors' gains that the detector is told; 0: equal.",
    kind: share([0.0, 1e12], "zero or more"),
};

/// Nominal bandwidth of the current sensors.
pub static BANDWIDTH: Key = Key {
    name: "bandwidth",
    about: "Corner frequency of the current sensors' filters as their data sheet states it; 0: no filter.",
    kind: number("Hz", [0.0, 1e12], "zero or more"),
};

/// When an adaptive method is content.
pub static DEVIATION: Key = Key {
    name: "deviation",
    about: "Standard deviation of the angle at which an adaptive method is content.",
    kind: number("deg", MORE_THAN_ZERO.0, MORE_THAN_ZERO.1),
};

/// Amplitude of an injected voltage.
pub static VOLTAGE: Key = Key {
    name: "voltage",
    about: "Amplitude of an injected voltage.",
    kind: number("V", MORE_THAN_ZERO.0, MORE_THAN_ZERO.1),
};

/// Whether PWM is compensated.
pub static COMPENSATION: Key = Key {
    name: "compensation",
    about: "Whether an injection compensates dead time and drops.",
    kind: Kind::Flag,
};

/// All keys, in the order in which they are set: a pulse chooses its samples, which a later key may want otherwise.
pub static ALL: [&Key; 11] = [
    &PULSE,
    &REST,
    &ROUNDS,
    &LEAST_SALIENCY,
    &POLE_ERROR,
    &VECTOR_CURRENT,
    &GAIN_TOLERANCE,
    &BANDWIDTH,
    &DEVIATION,
    &VOLTAGE,
    &COMPENSATION,
];

impl Value {
    /// A number.
    pub fn of<T: Real>(number: T) -> Self {
        Self::Number(number.to_double())
    }

    /// A time in s.
    pub fn time(time: Nanos) -> Self {
        Self::Number(time.seconds())
    }

    /// A count.
    pub fn times(count: u8) -> Self {
        Self::Number(f64::from(count))
    }

    /// A number as such; of a flag 0 or 1.
    pub fn number(self) -> f64 {
        match self {
            Self::Number(number) => number,
            Self::Flag(flag) => f64::from(u8::from(flag)),
        }
    }

    /// A number in a detector's precision.
    pub(crate) fn real<T: Real>(self) -> T {
        T::of(self.number())
    }

    /// A number of seconds.
    pub(crate) fn nanos(self) -> Nanos {
        Nanos::from_seconds(self.number())
    }

    /// A number that is counted.
    // Kept within its type.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub(crate) fn count(self) -> u8 {
        self.number().clamp(0.0, 255.0) as u8
    }

    /// Whether a flag is set.
    pub(crate) fn is_set(self) -> bool {
        self.number() != 0.0
    }
}

impl<S> Setting<S> {
    /// A setting that is always there.
    pub(crate) const fn new(
        key: &'static Key,
        get: fn(&S) -> Option<Value>,
        set: fn(&mut S, Value) -> bool,
    ) -> Self {
        Self { key, get, set }
    }
}

/// A [`Setting`] that is always there: the place of its value, and how a [`Value`] is made from it and to it.
macro_rules! place {
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

/// A time in microseconds, for people.
pub(crate) struct Microseconds(pub Nanos);

impl fmt::Display for Microseconds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} µs", self.0.0 as f64 / 1e3)
    }
}

#[cfg(test)]
mod tests;
