//! Typical slips in data sheets, each with its factor.

use std::f64::consts::SQRT_2;

use standstill_interface::choice;
use standstill_quantity::listed;

use super::{Guess, Numbers};

/// A number that was meant differently.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slip {
    key: Key,
    /// Factor from the number found to the number meant.
    factor: f64,
    why: Why,
    /// Logarithm of how much rarer the slip is than the most usual one.
    pub(super) rare: f64,
}

choice! {
    /// Number of a data sheet that may be meant otherwise.
    pub enum Key {
        /// Number of pole pairs.
        PolePairs = "pole_pairs",
        /// Resistance of a phase.
        Resistance = "resistance",
        /// Inductance along the d-axis.
        D = "L_d",
        /// Inductance along the q-axis.
        Q = "L_q",
        /// Both inductances.
        Both = "L_d and L_q",
        /// All of the winding: a meter between two terminals reads both.
        Winding = "resistance, L_d and L_q",
        /// Flux linkage of the magnet.
        Flux = "magnet_flux",
        /// Rated current.
        Current = "rated_current",
        /// Voltage of the DC link.
        Link = "dc_link",
        /// Rated power.
        Power = "power",
        /// Rated speed.
        Speed = "rated_speed",
        /// Rated torque.
        Torque = "rated_torque",
    }
}

#[derive(Clone, Copy, Debug)]
enum Why {
    /// A prefix.
    Prefix,
    /// Quantity that the number looks like, and the factor in words.
    Looks(&'static str, &'static str),
}

impl Slip {
    /// Returns all slips that these numbers may contain.
    pub(super) fn all(of: &Numbers) -> Vec<Self> {
        let mut all = prefixes(of);
        let p = of.pole_pairs;
        let root3 = 3.0_f64.sqrt();
        let mut looks = |key, factor, looks, by, rare| {
            all.push(Self { key, factor, why: Why::Looks(looks, by), rare });
        };
        looks(Key::Current, SQRT_2, "the rms value", "√2 more", 0.0);
        looks(Key::Current, 1.0 / SQRT_2, "√2 times the peak", "√2 less", 1.5);
        looks(Key::Current, root3, "the current of a phase in delta", "√3 more", 1.0);
        if of.flux > 0.0 {
            let per_radian = "volts between two terminals per mechanical rad/s";
            looks(Key::Flux, 1.0 / root3, "that between two terminals", "√3 less", 0.0);
            looks(Key::Flux, SQRT_2, "the rms value of a phase", "√2 more", 0.3);
            looks(Key::Flux, SQRT_2 / root3, "the rms value between two terminals", "√(2/3) of it", 0.5);
            looks(Key::Flux, 1.0 / (root3 * p), per_radian, "√3·p less", 0.3);
            looks(Key::Flux, 1.0 / (1.5 * p), "the torque constant", "3/2·p less", 0.6);
            if p > 1.0 {
                looks(Key::Flux, 1.0 / p, "volts of a phase per mechanical rad/s", "p less", 0.3);
            }
        }
        if p % 2.0 == 0.0 {
            looks(Key::PolePairs, 0.5, "the number of poles", "2 less", 0.0);
        }
        for (key, rare) in [(Key::Winding, 0.0), (Key::Resistance, 0.5), (Key::Both, 0.5)] {
            looks(key, 0.5, "that between two terminals", "2 less", rare);
            looks(key, 1.0 / 3.0, "that of a phase in delta", "3 less", rare + 0.5);
        }
        if of.ratings.speed_rpm.is_some() {
            looks(Key::Speed, super::RPM, "radians a second", "9.55 more", 0.5);
            looks(Key::Speed, 60.0, "revolutions a second", "60 more", 0.5);
        }
        all
    }

    /// Returns the numbers with the slip undone.
    pub(super) fn mended(&self, numbers: &Numbers) -> Numbers {
        let mut numbers = *numbers;
        let f = self.factor;
        let ratings = &mut numbers.ratings;
        match self.key {
            Key::PolePairs => numbers.pole_pairs *= f,
            Key::Resistance => numbers.resistance *= f,
            Key::D => numbers.inductance[0] *= f,
            Key::Q => numbers.inductance[1] *= f,
            Key::Both => numbers.inductance = numbers.inductance.map(|l| l * f),
            Key::Winding => {
                numbers.resistance *= f;
                numbers.inductance = numbers.inductance.map(|l| l * f);
            }
            Key::Flux => numbers.flux *= f,
            Key::Current => numbers.current *= f,
            Key::Link => numbers.link = numbers.link.map(|link| link * f),
            Key::Power => ratings.power = ratings.power.map(|power| power * f),
            Key::Speed => ratings.speed_rpm = ratings.speed_rpm.map(|speed| speed * f),
            Key::Torque => ratings.torque = ratings.torque.map(|torque| torque * f),
        }
        numbers
    }

    /// Describes the slip in words, with the number that was meant.
    pub(super) fn guess(&self, of: &Numbers) -> Guess {
        let key = self.key.name();
        let mended = self.mended(of);
        let meant = value(self.key, &mended);
        let said = match self.why {
            Why::Prefix => format!("did you mean {key} {meant}?"),
            Why::Looks(looks, by) => {
                format!("{key} {} looks like {looks}: {meant}, {by}, would fit", value(self.key, of))
            }
        };
        let keys = match self.key {
            Key::Both => vec![Key::D, Key::Q],
            Key::Winding => vec![Key::Resistance, Key::D, Key::Q],
            key => vec![key],
        };
        let meant = keys.into_iter().map(|key| (key.name(), value(key, &mended))).collect();
        Guess { key, factor: self.factor, said, meant }
    }
}

/// Returns slips with forgotten, added and exchanged prefixes, and plain numbers in units other than SI.
fn prefixes(of: &Numbers) -> Vec<Slip> {
    let ratings = of.ratings;
    let keys = [
        (Key::Both, true, 0.0),
        (Key::Resistance, true, 0.0),
        (Key::Flux, of.flux > 0.0, 0.0),
        (Key::D, true, 0.5),
        (Key::Q, true, 0.5),
        (Key::Current, true, 1.0),
        (Key::Link, of.link.is_some(), 1.5),
        (Key::Power, ratings.power.is_some(), 1.0),
        (Key::Torque, ratings.torque.is_some(), 1.0),
    ];
    let given = keys.into_iter().filter(|(_, is_given, _)| *is_given);
    given
        .flat_map(|(key, _, rare)| {
            [(1e-3, 0.0), (1e3, 0.3), (1e-6, 2.0), (1e6, 3.0)].map(|(factor, more)| Slip {
                key,
                factor,
                why: Why::Prefix,
                rare: rare + more,
            })
        })
        .collect()
}

fn value(key: Key, of: &Numbers) -> String {
    let rating = |rating: Option<f64>, unit| listed(&[rating.unwrap_or_default()], unit);
    match key {
        Key::PolePairs => format!("{}", of.pole_pairs),
        Key::Resistance => listed(&[of.resistance], "Ω"),
        Key::D => listed(&of.inductance[..1], "H"),
        Key::Q => listed(&of.inductance[1..], "H"),
        Key::Both => listed(&of.inductance, "H"),
        Key::Winding => format!("{} and {}", listed(&[of.resistance], "Ω"), listed(&of.inductance, "H")),
        Key::Flux => listed(&[of.flux], "Wb"),
        Key::Current => listed(&[of.current], "A"),
        Key::Link => listed(&[of.link.unwrap_or_default()], "V"),
        Key::Power => rating(of.ratings.power, "W"),
        Key::Speed => rating(of.ratings.speed_rpm, "rpm"),
        Key::Torque => rating(of.ratings.torque, "N m"),
    }
}
