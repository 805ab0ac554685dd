//! Conversion of texts to numbers and back.

use std::fmt;

use crate::human::rounded;
use crate::prefix::{self, Prefix};
use crate::unit::{DIMENSIONS, Dimension};

/// A text that is not a quantity of the dimension asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct QuantityError {
    found: String,
    dimension: Dimension,
}

impl fmt::Display for QuantityError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { found, dimension: Dimension { symbol, share, .. } } = self;
        if *share {
            write!(f, "`{found}` is not a share, such as 0.005 or \"0.5 %\"")
        } else if symbol.is_empty() {
            write!(f, "`{found}` is not a finite number without unit")
        } else {
            let prefixes = prefix::typed();
            write!(
                f,
                "`{found}` is not a finite number in {symbol}, such as \"1.5 {symbol}\", with or without a prefix {prefixes}"
            )
        }
    }
}

impl std::error::Error for QuantityError {}

/// Returns the number that a text begins with, and the rest, without blanks around them.
///
/// "1e-3 m" cannot be mistaken for an exponent because units have letters.
///
/// ```
/// assert_eq!(standstill_quantity::split("12.5 mA"), ("12.5", "mA"));
/// ```
pub fn split(text: &str) -> (&str, &str) {
    let text = text.trim();
    let digits = text.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    (number.trim(), unit.trim())
}

impl Dimension {
    /// Returns the value of a text in the SI unit.
    pub(crate) fn parse(&self, text: &str) -> Result<f64, QuantityError> {
        let error = || QuantityError { found: text.to_owned(), dimension: *self };
        let (number, unit) = split(text);
        let power = self.power(unit).ok_or_else(error)?;
        // As text, so that "80 us" is exactly 80e-6 and not 80.0 * 1e-6.
        let value = if let Some((mantissa, exponent)) = number.split_once(['e', 'E']) {
            let exponent = exponent.parse::<i32>().map_err(|_| error())?;
            format!("{mantissa}e{}", exponent.saturating_add(power)).parse()
        } else {
            format!("{number}e{power}").parse()
        };
        value.ok().filter(|value: &f64| value.is_finite()).ok_or_else(error)
    }

    /// Returns the power of ten of the SI unit that one of this unit is; none of another dimension's.
    fn power(&self, unit: &str) -> Option<i32> {
        if unit.is_empty() {
            return Some(0);
        }
        if self.share && unit == "%" {
            return Some(-2);
        }
        self.spellings().find_map(|symbol| Prefix::power_of(unit.strip_suffix(symbol)?))
    }

    /// Returns a value in SI as the field writes it.
    pub(crate) fn write(&self, value: f64, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let power = Prefix::power_of(self.usual).unwrap_or(0);
        let scaled = rounded(value, -power);
        let number = if scaled != 0.0 && !(1e-3..1e6).contains(&scaled.abs()) {
            format!("{scaled:e}")
        } else {
            format!("{scaled}")
        };
        write!(f, "{}", format!("{number} {}{}", self.usual, self.symbol).trim_end())
    }
}

/// Returns the value of a number with any unit: in SI, temperatures in °C, angles in degrees, shares as plain numbers.
/// `None` for a text that is not a quantity of a known dimension.
pub fn si_value(text: &str) -> Option<f64> {
    any_quantity(text).map(|(value, _)| value)
}

/// Returns the power of ten of a unit in SI units, for any dimension; none for unknown units.
///
/// ```
/// use standstill_quantity::{rounded, si_power, si_value};
///
/// assert_eq!(si_power("us"), Some(-6));
/// // A number and its text have one value in SI.
/// assert_eq!(si_value("1.7 us"), Some(rounded(1.7, -6)));
/// assert_eq!(si_power("parsec"), None);
/// ```
pub fn si_power(unit: &str) -> Option<i32> {
    DIMENSIONS.iter().find_map(|dimension| dimension.power(unit))
}

/// Returns the value in SI and the symbol of its unit, which is empty for shares and plain numbers.
pub fn any_quantity(text: &str) -> Option<(f64, &'static str)> {
    DIMENSIONS.iter().find_map(|dimension| Some((dimension.parse(text).ok()?, dimension.symbol)))
}
