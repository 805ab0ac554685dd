//! Physical quantities as people write and read them: `"9.2 mH"`, `"80 us"`, `"0.8 Ω"`, or a bare number in SI.
//!
//! All crates use the same table of prefixes, parser and printer.
//!
//! * [`Quantity`]: a number of one dimension, in SI; [`unit`](mod@unit): the dimensions.
//! * [`any_quantity`], [`split`]: parsers of texts whose dimension is not known.
//! * [`Scale`], [`number`], [`rounded`]: choice of unit and digits for printing.
//! * [`Estimate`]: a value with its interval; it is printed in the digits that the interval supports.
//!
//! ```
//! use standstill_quantity::{Quantity, unit::Henry};
//!
//! let inductance: Quantity<Henry> = "9200 uH".parse()?;
//! assert_eq!(inductance.value(), 9.2e-3);
//! assert_eq!(inductance.to_string(), "9.2 mH");
//! # Ok::<(), standstill_quantity::QuantityError>(())
//! ```

mod estimate;
mod human;
mod prefix;
mod serial;
mod text;
pub mod unit;

use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

#[doc(hidden)]
pub use estimate::or_nan;
pub use estimate::{Estimate, at_most, fixed};
pub use human::{Scale, count, decimals, listed, magnitude, number, rounded, short, significant};
pub use serial::Number;
pub use text::{QuantityError, any_quantity, si_power, si_value, split};
pub use unit::{Dimension, Unit};

/// A value of one dimension, in SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity<U>(f64, PhantomData<U>);

impl<U: Unit> Quantity<U> {
    /// Makes a quantity from its value in the SI unit.
    pub const fn si(value: f64) -> Self {
        Self(value, PhantomData)
    }

    /// Returns the value in the SI unit.
    pub const fn value(self) -> f64 {
        self.0
    }
}

impl<U: Unit> FromStr for Quantity<U> {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        U::DIMENSION.parse(text).map(Self::si)
    }
}

impl<U: Unit> fmt::Display for Quantity<U> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&U::DIMENSION.text(self.0))
    }
}

/// The examples of the README run too.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

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
        assert_eq!(parse::<Henry>("1.1e+1 uH"), Some(1.1e-5));
    }

    #[test]
    fn regress_wrong_dimension_or_no_number_is_refused() {
        for text in
            ["9.2 mA", "mH", "", "9.2 xH", "1 H H", "nan H", "inf", "1e999 H", "9,2 mH", "1e H", "1e2e3 H"]
        {
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
