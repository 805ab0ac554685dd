//! Numbers for people: which unit suits them, and how many digits.

use crate::prefix::PREFIXES;
use crate::unit::{Degree, Dimension, Unit};

/// Returns the power of ten of a number's first digit; none for zero and numbers that are not normal.
///
/// ```
/// use standstill_quantity::magnitude;
///
/// assert_eq!((magnitude(1000.0), magnitude(0.02), magnitude(0.0)), (Some(3), Some(-2), None));
/// ```
pub fn magnitude(value: f64) -> Option<i32> {
    if value.is_normal() { exponent(&format!("{value:e}")) } else { None }
}

fn exponent(text: &str) -> Option<i32> {
    text.split_once('e')?.1.parse().ok()
}

/// Returns a number times a power of ten, rounded to twelve digits, which hide rounding errors.
///
/// ```
/// use standstill_quantity::rounded;
///
/// assert_eq!((rounded(0.1 + 0.2, 0), rounded(9.2e-3, 3)), (0.3, 9.2));
/// ```
pub fn rounded(value: f64, power: i32) -> f64 {
    let text = format!("{value:.11e}");
    let Some((mantissa, exponent)) = text.split_once('e') else { return value };
    exponent.parse().ok().and_then(|e: i32| format!("{mantissa}e{}", e + power).parse().ok()).unwrap_or(value)
}

/// Returns a number rounded to so many significant digits, at least one.
///
/// ```
/// use standstill_quantity::significant;
///
/// assert_eq!((significant(0.123_456, 3), significant(-1750.0, 2)), (0.123, -1800.0));
/// ```
pub fn significant(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value)
}

/// Decimals for numbers of which the largest has this size: so many, but at least three and at most seven significant
/// digits of that one. There are motors of milliamperes and of kiloamperes.
pub fn decimals(usual: usize, largest: f64) -> usize {
    let Some(magnitude) = magnitude(largest) else { return usual };
    usual.max(usize::try_from(2 - magnitude).unwrap_or(0)).min(usize::try_from(6 - magnitude).unwrap_or(0))
}

/// Returns one number, see [`decimals`].
pub fn number(usual: usize, value: f64) -> String {
    // Adding zero turns −0 into 0.
    format!("{:.*}", decimals(usual, value), value + 0.0)
}

/// Returns a number that was computed, for people: six digits at most, and no zeros at their end.
///
/// ```
/// use standstill_quantity::short;
///
/// assert_eq!((short(66.111_736_497_630_03), short(-20.0), short(0.1 + 0.2)), ("66.1117".into(), "-20".into(), "0.3".into()));
/// ```
pub fn short(value: f64) -> String {
    (significant(value, 6) + 0.0).to_string()
}

/// Returns a whole number for people, with a comma before each three digits if it has five or more.
///
/// ```
/// use standstill_quantity::count;
///
/// assert_eq!((count(1000), count(37_000), count(1_234_567)), ("1000".into(), "37,000".into(), "1,234,567".into()));
/// ```
pub fn count(number: impl ToString + Copy) -> String {
    let digits = number.to_string();
    if digits.len() < 5 || !digits.bytes().all(|digit| digit.is_ascii_digit()) {
        return digits;
    }
    let group = |(k, digit): (usize, char)| {
        let comma = (k > 0 && (digits.len() - k).is_multiple_of(3)).then_some(',');
        comma.into_iter().chain([digit])
    };
    digits.chars().enumerate().flat_map(group).collect()
}

/// A unit for printing some values, and its ratio to the SI unit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Scale {
    /// The unit; empty without.
    pub unit: String,
    /// Power of ten of the unit in SI units.
    power: i32,
}

impl Scale {
    /// Makes the scale of shares: per cent.
    pub fn percent() -> Self {
        Self { unit: "%".to_owned(), power: -2 }
    }

    /// Makes the unit in which the largest value has one to three digits before the point. Angles and temperatures
    /// have no prefixes.
    ///
    /// ```
    /// use standstill_quantity::Scale;
    ///
    /// let scale = Scale::suiting("A", 0.05);
    /// assert_eq!((scale.unit.as_str(), scale.number(0.0125)), ("mA", 12.5));
    /// ```
    pub fn suiting(symbol: &str, largest: f64) -> Self {
        // Nine digits, so that what arithmetic rounds cannot change the prefix.
        let digits = exponent(&format!("{largest:.8e}")).filter(|_| largest.is_normal());
        let prefixed = Dimension::of_symbol(symbol).is_none_or(|dimension| dimension.prefixed);
        let Some(digits) = digits.filter(|_| prefixed) else {
            let unit = if symbol == Degree::SYMBOL { "°" } else { symbol };
            return Self { unit: unit.to_owned(), power: 0 };
        };
        let prefix = PREFIXES.iter().rev().find(|prefix| prefix.power <= digits).unwrap_or(&PREFIXES[0]);
        Self { unit: format!("{}{symbol}", prefix.symbol), power: prefix.power }
    }

    /// Returns a value in SI, in this unit.
    pub fn number(&self, value: f64) -> f64 {
        rounded(value, -self.power)
    }
}

/// Returns the values in the unit that suits the largest of them, in four digits.
///
/// ```
/// assert_eq!(standstill_quantity::listed(&[0.012_345_6, -0.003, 0.0], "A"), "12.35, -3, 0 mA");
/// ```
pub fn listed(values: &[f64], symbol: &str) -> String {
    let scale =
        Scale::suiting(symbol, values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs())));
    let text = |value: &f64| significant(scale.number(*value), 4).to_string();
    format!("{} {}", values.iter().map(text).collect::<Vec<_>>().join(", "), scale.unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_units_suit_the_values() {
        for (symbol, largest, expected) in [
            ("A", 0.05, ("mA", 50.0)),
            ("s", 4e-6, ("µs", 4.0)),
            ("Hz", 1e4, ("kHz", 10.0)),
            ("V", 550.0, ("V", 550.0)),
            ("V", 1000.0 - 1e-10, ("kV", 1.0)),
            ("deg", 0.1, ("°", 0.1)),
            ("°C", 2e3, ("°C", 2e3)),
            ("", 7.0, ("", 7.0)),
            ("A", 0.0, ("A", 0.0)),
            ("A", 1e-30, ("pA", 1e-18)),
            ("W", 5e12, ("MW", 5e6)),
        ] {
            let scale = Scale::suiting(symbol, largest);
            assert_eq!((scale.unit.as_str(), scale.number(largest)), expected);
        }
        assert_eq!(Scale::percent().number(0.005), 0.5);
    }

    #[test]
    fn regress_numbers_of_any_size_have_digits() {
        for (usual, value, text) in [
            (2, 8.0, "8.00"),
            (2, 88.0, "88.00"),
            (2, 0.0, "0.00"),
            (2, 0.008, "0.00800"),
            (3, 1.23456e-5, "0.0000123"),
            (2, 123_456.78, "123456.8"),
            (3, -4.2e7, "-42000000"),
            (6, 0.45, "0.450000"),
        ] {
            assert_eq!(number(usual, value), text);
        }
    }

    #[test]
    fn law_rounding_keeps_what_is_no_number() {
        assert!(rounded(f64::NAN, 3).is_nan());
        assert_eq!(rounded(f64::INFINITY, -3), f64::INFINITY);
        assert_eq!((rounded(0.0, 6), rounded(-0.3 * 3.0, 0)), (0.0, -0.9));
    }
}
