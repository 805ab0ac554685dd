//! The units.

use std::fmt;

/// Names of a unit and the way its values are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dimension {
    /// Symbol of the SI unit, as printed; empty for pure numbers.
    pub symbol: &'static str,
    /// Other ways to write it.
    pub(crate) aliases: &'static [&'static str],
    /// Whether it is a share, which may be written in per cent.
    pub(crate) share: bool,
    /// The prefix in use for it.
    pub(crate) usual: &'static str,
    /// Whether people put prefixes before it, as they do not before degrees.
    pub(crate) prefixed: bool,
}

/// A physical dimension with its SI unit.
pub trait Unit: Copy + fmt::Debug + PartialEq {
    /// Names and notation of the unit.
    const DIMENSION: Dimension;
    /// Symbol of the SI unit, as printed.
    const SYMBOL: &'static str = Self::DIMENSION.symbol;
}

macro_rules! units {
    ($($(#[$doc:meta])* $name:ident = $symbol:literal $(or $alias:literal)* { $($property:ident: $value:literal),* };)*) => {
        $(
            $(#[$doc])*
            #[derive(Clone, Copy, Debug, PartialEq)]
            pub struct $name;
            impl Unit for $name {
                #[allow(clippy::needless_update, reason = "some have every property")]
                const DIMENSION: Dimension = Dimension {
                    symbol: $symbol,
                    aliases: &[$($alias),*],
                    $($property: $value,)*
                    ..PLAIN
                };
            }
        )*

        /// Every dimension. A text without a unit is a pure number, which therefore stands first.
        pub(crate) static DIMENSIONS: &[Dimension] = &[$($name::DIMENSION),*];
    };
}

const PLAIN: Dimension = Dimension { symbol: "", aliases: &[], share: false, usual: "", prefixed: true };

units! {
    /// A pure number.
    One = "" { prefixed: false };
    /// A pure number that is a share of something: `0.005` or `"0.5 %"`.
    Share = "" { share: true, prefixed: false };
    /// Inductance.
    Henry = "H" { usual: "m" };
    /// Resistance.
    // The second Ω is the Ohm sign U+2126, which looks the same.
    Ohm = "Ω" or "\u{2126}" or "ohm" or "Ohm" {};
    /// Capacitance.
    Farad = "F" { usual: "µ" };
    /// Flux linkage.
    Weber = "Wb" or "Vs" {};
    /// Current.
    Ampere = "A" {};
    /// Slew rate of a current.
    AmperePerSecond = "A/s" {};
    /// Voltage.
    Volt = "V" {};
    /// Power.
    Watt = "W" { usual: "k" };
    /// Torque.
    NewtonMetre = "N m" or "Nm" or "N·m" {};
    /// Torque per current.
    NewtonMetrePerAmpere = "N m/A" or "Nm/A" or "N·m/A" {};
    /// Viscous friction.
    NewtonMetreSecond = "N m s" or "Nms" or "N·m·s" or "N m s/rad" {};
    /// Moment of inertia.
    KilogramSquareMetre = "kg m²" or "kg m2" or "kg m^2" or "kgm2" or "kg·m²" {};
    /// Time.
    Second = "s" { usual: "µ" };
    /// Angle.
    Degree = "deg" or "°" { prefixed: false };
    /// Temperature.
    Celsius = "°C" or "degC" { prefixed: false };
    /// Change with temperature.
    PerKelvin = "1/K" or "/K" { prefixed: false };
    /// Frequency.
    Hertz = "Hz" { usual: "k" };
    /// Speed of a shaft.
    RevolutionsPerMinute = "rpm" or "1/min" or "min-1" or "min⁻¹" or "U/min" or "r/min" { prefixed: false };
    /// Acceleration of a shaft.
    RevolutionsPerMinuteSecond = "rpm/s" or "1/(min s)" { prefixed: false };
    /// Speed per volt.
    RevolutionsPerMinuteVolt = "rpm/V" or "KV" or "1/(min V)" { prefixed: false };
    /// Volts per 1,000 revolutions per minute.
    VoltPerThousandRevolutionsPerMinute = "V/krpm" or "mV/rpm" or "V/1000rpm" or "V/1000 rpm" or "V/(1000 rpm)" { prefixed: false };
}

impl Dimension {
    /// Returns true if numbers of this dimension have neither unit nor per cent.
    pub const fn is_bare(&self) -> bool {
        self.symbol.is_empty() && !self.share
    }

    /// Returns whether its numbers are shares, which people write in per cent.
    pub const fn is_share(&self) -> bool {
        self.share
    }

    /// Returns all ways to write the unit.
    pub(crate) fn spellings(&self) -> impl Iterator<Item = &'static str> {
        std::iter::once(self.symbol).chain(self.aliases.iter().copied()).filter(|symbol| !symbol.is_empty())
    }

    /// Returns the dimension whose unit has this symbol, of pure numbers if it is empty.
    pub fn of_symbol(symbol: &str) -> Option<&'static Self> {
        DIMENSIONS.iter().find(|dimension| dimension.symbol == symbol)
    }
}
