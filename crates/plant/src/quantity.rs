//! Numbers with a unit: `"9.2 mH"`, `"80 us"`, `"0.8 Ω"`, or a bare number in SI.

use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

use serde::{Deserialize, Deserializer};

/// A physical dimension with its SI unit.
pub trait Unit: Copy + fmt::Debug + PartialEq {
    /// Symbol of the SI unit, as printed.
    const SYMBOL: &'static str;
    /// Other ways to write it.
    const ALIASES: &'static [&'static str] = &[];
    /// Whether it is a share, which may be written in per cent.
    const SHARE: bool = false;
    /// A prefix in use for it, and its power of ten: how the field writes such values.
    const USUAL: (&'static str, i32) = ("", 0);
}

macro_rules! units {
    ($($(#[$doc:meta])* $name:ident = $symbol:literal $(or $alias:literal)* $(in $prefix:literal $power:literal)? $(share $share:literal)?;)*) => {
        $(
            $(#[$doc])*
            #[derive(Clone, Copy, Debug, PartialEq)]
            pub struct $name;
            impl Unit for $name {
                const SYMBOL: &'static str = $symbol;
                const ALIASES: &'static [&'static str] = &[$($alias),*];
                $(const USUAL: (&'static str, i32) = ($prefix, $power);)?
                $(const SHARE: bool = $share;)?
            }
        )*
    };
}

/// The units.
pub mod unit {
    use super::Unit;

    units! {
        /// Inductance.
        Henry = "H" in "m" -3;
        /// Resistance.
        // The second Ω is the Ohm sign U+2126, which looks the same.
        Ohm = "Ω" or "\u{2126}" or "ohm" or "Ohm";
        /// Flux linkage.
        Weber = "Wb" or "Vs";
        /// Current.
        Ampere = "A";
        /// Voltage.
        Volt = "V";
        /// Power.
        Watt = "W" in "k" 3;
        /// Torque.
        NewtonMetre = "N m" or "Nm" or "N·m";
        /// Viscous friction.
        NewtonMetreSecond = "N m s" or "Nms" or "N·m·s" or "N m s/rad";
        /// Moment of inertia.
        KilogramSquareMetre = "kg m²" or "kg m2" or "kg m^2" or "kgm2" or "kg·m²";
        /// Time.
        Second = "s" in "µ" -6;
        /// Angle.
        Degree = "deg" or "°";
        /// Temperature.
        Celsius = "°C" or "degC";
        /// Change with temperature.
        PerKelvin = "1/K" or "/K";
        /// Frequency.
        Hertz = "Hz" in "k" 3;
        /// A pure number.
        One = "";
        /// A pure number that is a share of something: `0.005` or `"0.5 %"`.
        Share = "" share true;
    }
}

/// A value of one dimension, in SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity<U>(f64, PhantomData<U>);

impl<U: Unit> Quantity<U> {
    /// From a value in the SI unit.
    pub const fn si(value: f64) -> Self {
        Self(value, PhantomData)
    }

    /// The value in the SI unit.
    pub const fn value(self) -> f64 {
        self.0
    }
}

/// A text that is not a quantity of the dimension asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct QuantityError {
    found: String,
    symbol: &'static str,
    share: bool,
}

impl fmt::Display for QuantityError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { found, symbol, share } = self;
        if *share {
            write!(f, "`{found}` is not a share, such as 0.005 or \"0.5 %\"")
        } else if symbol.is_empty() {
            write!(f, "`{found}` is not a finite number without unit")
        } else {
            write!(
                f,
                "`{found}` is not a finite number in {symbol}, such as \"1.5 {symbol}\", with or without a prefix p n u m k M"
            )
        }
    }
}

impl std::error::Error for QuantityError {}

const PREFIXES: [(&str, i32); 9] =
    [("", 0), ("p", -12), ("n", -9), ("u", -6), ("µ", -6), ("μ", -6), ("m", -3), ("k", 3), ("M", 6)];

impl<U: Unit> FromStr for Quantity<U> {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        let error = || QuantityError { found: text.to_owned(), symbol: U::SYMBOL, share: U::SHARE };
        let text = text.trim();
        // The number is what is left when the longest unit that fits is taken off the end; "1e-3 m" cannot be
        // mistaken for an exponent because units have letters.
        let digits = text.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(text.len());
        let (number, unit) = text.split_at(digits);
        let unit = unit.trim();
        let power = if unit.is_empty() {
            0
        } else if U::SHARE && unit == "%" {
            -2
        } else {
            std::iter::once(&U::SYMBOL)
                .chain(U::ALIASES)
                .filter(|symbol| !symbol.is_empty())
                .find_map(|symbol| {
                    let prefix = unit.strip_suffix(symbol)?;
                    PREFIXES.iter().find(|(p, _)| *p == prefix).map(|(_, power)| *power)
                })
                .ok_or_else(error)?
        };
        // As text, so that "80 us" is exactly 80e-6 and not 80.0 * 1e-6.
        let number = number.trim();
        let value = if number.contains(['e', 'E']) {
            number.parse::<f64>().map(|value| value * 10_f64.powi(power))
        } else {
            format!("{number}e{power}").parse()
        };
        value.ok().filter(|value: &f64| value.is_finite()).map(Self::si).ok_or_else(error)
    }
}

impl<'de, U: Unit> Deserialize<'de> for Quantity<U> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor<U>(PhantomData<U>);
        impl<U: Unit> serde::de::Visitor<'_> for Visitor<U> {
            type Value = Quantity<U>;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                match U::SYMBOL {
                    "" if U::SHARE => write!(f, "a share such as 0.005 or \"0.5 %\""),
                    "" => write!(f, "a number without unit"),
                    symbol => write!(f, "a number in {symbol}, or a text such as \"1.5 {symbol}\""),
                }
            }

            fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Quantity<U>, E> {
                if value.is_finite() {
                    Ok(Quantity::si(value))
                } else {
                    Err(E::custom("not a finite number"))
                }
            }

            fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<Quantity<U>, E> {
                self.visit_f64(value as f64)
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Quantity<U>, E> {
                text.parse().map_err(E::custom)
            }
        }
        deserializer.deserialize_any(Visitor(PhantomData))
    }
}

impl<U: Unit> serde::Serialize for Quantity<U> {
    /// As a number in SI, which is exact.
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_f64(self.0)
    }
}

impl<U: Unit> schemars::JsonSchema for Quantity<U> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("Quantity in {}", U::SYMBOL).into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let number = r"^\s*[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*";
        let units = std::iter::once(&U::SYMBOL).chain(U::ALIASES).filter(|unit| !unit.is_empty());
        let units: Vec<String> = units.map(|unit| unit.replace('^', r"\^")).collect();
        let unit = match &units[..] {
            [] if U::SHARE => "%?".to_owned(),
            [] => String::new(),
            units => format!("([pnuµμmkM]?({}))?", units.join("|")),
        };
        let what = match U::SYMBOL {
            "" if U::SHARE => "a share: a number, or a text in per cent".to_owned(),
            "" => "a number".to_owned(),
            symbol => format!("a number in {symbol}, or a text with a unit"),
        };
        schemars::json_schema!({
            "description": what,
            "x-unit": U::SYMBOL,
            "x-share": U::SHARE,
            "anyOf": [{ "type": "number" }, { "type": "string", "pattern": format!("{number}{unit}\\s*$") }]
        })
    }
}

impl<U: Unit> fmt::Display for Quantity<U> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (prefix, power) = U::USUAL;
        // Twelve digits hide what the scaling by a power of ten rounds.
        let scaled: f64 = format!("{:.11e}", self.0 / 10_f64.powi(power)).parse().unwrap_or(self.0);
        let number = if scaled != 0.0 && !(1e-3..1e6).contains(&scaled.abs()) {
            format!("{scaled:e}")
        } else {
            format!("{scaled}")
        };
        write!(f, "{}", format!("{number} {prefix}{}", U::SYMBOL).trim_end())
    }
}

/// The value of a number with whatever unit: in SI, temperatures in °C, angles in degrees, shares as such. `None` of a text
/// that is no quantity of any dimension known here.
pub fn si_value(text: &str) -> Option<f64> {
    any_quantity(text).map(|(value, _)| value)
}

/// The same with the symbol of its unit, which is empty for shares and plain numbers.
pub fn any_quantity(text: &str) -> Option<(f64, &'static str)> {
    use unit::{
        Ampere, Celsius, Degree, Henry, Hertz, KilogramSquareMetre, NewtonMetre, NewtonMetreSecond, Ohm,
        PerKelvin, Second, Share, Volt, Watt, Weber,
    };
    fn of<U: Unit>(text: &str) -> Option<(f64, &'static str)> {
        text.parse::<Quantity<U>>().ok().map(|quantity| (quantity.value(), U::SYMBOL))
    }
    // A text without unit is the same number in all of them.
    let all = [
        of::<Share>,
        of::<Henry>,
        of::<Ohm>,
        of::<Weber>,
        of::<Ampere>,
        of::<Volt>,
        of::<Watt>,
        of::<NewtonMetre>,
        of::<NewtonMetreSecond>,
        of::<KilogramSquareMetre>,
        of::<Second>,
        of::<Degree>,
        of::<Celsius>,
        of::<PerKelvin>,
        of::<Hertz>,
    ];
    all.into_iter().find_map(|of| of(text))
}

#[cfg(test)]
mod tests {
    use super::unit::{Henry, Hertz, KilogramSquareMetre, NewtonMetre, Ohm, One, Share};
    use super::*;

    fn parse<U: Unit>(text: &str) -> Option<f64> {
        text.parse::<Quantity<U>>().ok().map(Quantity::value)
    }

    #[test]
    fn analytic_quantities_are_exact() {
        assert_eq!(parse::<Henry>("9.2 mH"), Some(9.2e-3));
        assert_eq!(parse::<Henry>("-2.1mH"), Some(-2.1e-3));
        assert_eq!(parse::<Henry>("80 uH"), Some(80e-6));
        assert_eq!(parse::<Henry>("80 µH"), Some(80e-6));
        assert_eq!(parse::<Ohm>("0.8 Ω"), Some(0.8));
        assert_eq!(parse::<Ohm>("800 mohm"), Some(0.8));
        assert_eq!(parse::<NewtonMetre>("3.5 N m"), Some(3.5));
        assert_eq!(parse::<KilogramSquareMetre>("0.02 kg m²"), Some(0.02));
        assert_eq!(parse::<One>("4"), Some(4.0));
        assert_eq!(parse::<Share>("0.5 %"), Some(0.005));
        assert_eq!(parse::<Share>("0.005"), Some(0.005));
        assert_eq!(parse::<Hertz>("20 kHz"), Some(20e3));
        assert_eq!(parse::<Henry>("1.5e-3 H"), Some(1.5e-3));
    }

    #[test]
    fn regress_wrong_dimension_or_no_number_is_refused() {
        for text in ["9.2 mA", "mH", "", "9.2 xH", "1 H H", "nan H", "inf", "1e999 H", "9,2 mH"] {
            assert_eq!(parse::<Henry>(text), None, "{text}");
        }
        assert_eq!(parse::<One>("4 H"), None);
        assert_eq!(parse::<One>("4 %"), None);
        assert_eq!(parse::<Share>("4 m"), None);
    }

    #[test]
    fn analytic_a_number_with_any_unit_has_one_value() {
        assert_eq!(si_value("12.5 mA"), Some(0.0125));
        assert_eq!(si_value("0.5 %"), Some(0.005));
        assert_eq!(si_value("43.2 deg"), Some(43.2));
        assert_eq!(si_value("2 Nm"), Some(2.0));
        assert_eq!(si_value("7"), Some(7.0));
        assert_eq!(si_value("bipolar"), None);
        assert_eq!(si_value("3 apples"), None);
        assert_eq!(any_quantity("3 Nm"), Some((3.0, "N m")));
    }

    #[test]
    fn analytic_quantities_print_as_the_field_writes_them() {
        assert_eq!(Quantity::<Henry>::si(9.2e-3).to_string(), "9.2 mH");
        assert_eq!(Quantity::<One>::si(4.0).to_string(), "4");
        assert_eq!(Quantity::<One>::si(5.305e-5).to_string(), "5.305e-5");
    }
}
