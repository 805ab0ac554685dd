//! A value with its 95 % interval, and how many of its digits that supports.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize};

use crate::magnitude;

/// More decimals than these nobody reads.
const MOST: i32 = 9;

/// A value with its 95 % interval. An end that the sample is too small to give is not a number.
///
/// It prints itself with the digits that its interval supports, and no more: who reads a number takes its last digit for known.
/// Those are two digits of half the interval's width where these begin with less than 3.55, else one (Particle Data Group, Review
/// of Particle Physics, introduction, 5.3).
///
/// ```
/// use standstill_quantity::Estimate;
///
/// let rms = Estimate { value: 0.7517, low: 0.661, high: 0.889 };
/// assert_eq!((rms.to_string(), rms.alone()), ("0.75 [0.66, 0.89]".into(), "0.75".into()));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The estimate.
    #[serde(deserialize_with = "or_nan")]
    pub value: f64,
    /// Lower end.
    #[serde(deserialize_with = "or_nan")]
    pub low: f64,
    /// Upper end.
    #[serde(deserialize_with = "or_nan")]
    pub high: f64,
}

/// Reads a number, or NaN from `null`: JSON has no other way to write NaN.
///
/// # Errors
/// The value is neither a number nor `null`.
#[doc(hidden)]
pub fn or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

impl Estimate {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self { value: f64::NAN, low: f64::NAN, high: f64::NAN };

    /// Converts to another unit; `factor`: value in the other unit per value in this one.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        self.map(|x| factor * x)
    }

    /// Applies a function to the value and both ends of its interval.
    #[must_use]
    pub fn map(self, of: impl Fn(f64) -> f64) -> Self {
        Self { value: of(self.value), low: of(self.low), high: of(self.high) }
    }

    /// Returns half the width of the interval, or the distance of the value from its end if only one end is known.
    fn half(self) -> f64 {
        let half = (self.high - self.low).abs() / 2.0;
        let ways = [half, (self.value - self.low).abs(), (self.value - self.high).abs()];
        ways.into_iter().find(|way| !way.is_nan()).unwrap_or(f64::NAN)
    }

    /// Returns the power of ten of the last digit that the interval supports. Without an interval, it is that of the
    /// value's second digit; for an interval of no width, that of the third. None for a zero whose interval is missing
    /// or has no width.
    pub fn last_place(self) -> Option<i32> {
        let half = self.half();
        if half > 0.0 && half.is_finite() {
            // It begins with less than 3.55 where dividing by that loses a place.
            magnitude(half).map(|first| first - i32::from(magnitude(half / 3.55) < Some(first)))
        } else {
            magnitude(self.value).map(|first| first - if half == 0.0 { 2 } else { 1 })
        }
    }

    /// Decimals that the interval supports.
    pub fn decimals(self) -> usize {
        usize::try_from((-self.last_place().unwrap_or(0)).clamp(0, MOST)).unwrap_or(0)
    }

    /// Returns the value, lower and upper end in the digits that the interval supports; empty for NaN.
    pub fn texts(self) -> [String; 3] {
        let decimals = self.decimals();
        [self.value, self.low, self.high].map(|x| if x.is_nan() { String::new() } else { fixed(x, decimals) })
    }

    /// Returns the value without interval, in the digits that the interval supports; a dash for NaN. If the interval has no upper end, as that of
    /// a percentile of few values, returns two digits.
    pub fn alone(self) -> String {
        if self.value.is_finite() && self.high == f64::INFINITY {
            let place = crate::magnitude(self.value).unwrap_or(0) - 1;
            return fixed(self.value, usize::try_from(-place).unwrap_or(0));
        }
        let [value, ..] = self.texts();
        if value.is_empty() { "–".to_owned() } else { value }
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [value, low, high] = self.texts().map(|x| if x.is_empty() { "–".to_owned() } else { x });
        if self.low.is_nan() && self.high.is_nan() {
            f.write_str(&value)
        } else {
            write!(f, "{value} [{low}, {high}]")
        }
    }
}

/// Returns a number with so many decimals, without a sign where only zeros are left.
///
/// ```
/// use standstill_quantity::fixed;
///
/// assert_eq!((fixed(-0.04, 1), fixed(-0.06, 1)), ("0.0".into(), "-0.1".into()));
/// ```
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| "0.".contains(c)) => rest.to_owned(),
        _ => text,
    }
}

/// Returns the upper end of a share's interval in per cent, with two digits, as the interval prints it.
///
/// ```
/// assert_eq!(standstill_quantity::at_most(3.6889e-6), "0.00037");
/// ```
pub fn at_most(share: f64) -> String {
    let percent = 100.0 * share;
    fixed(percent, magnitude(percent).map_or(0, |first| usize::try_from(1 - first).unwrap_or(0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_a_value_without_an_upper_end_has_two_digits() {
        assert_eq!(of(1.270_113_42, 0.9, f64::INFINITY).alone(), "1.3");
        assert_eq!(of(0.042_42, 0.01, f64::INFINITY).alone(), "0.042");
        assert_eq!(of(127.3, 90.0, f64::INFINITY).alone(), "127");
        assert_eq!(
            of(f64::INFINITY, 0.0, f64::INFINITY).alone(),
            of(f64::INFINITY, 0.0, f64::INFINITY).texts()[0]
        );
    }

    fn of(value: f64, low: f64, high: f64) -> Estimate {
        Estimate { value, low, high }
    }

    #[test]
    fn law_no_digit_stands_beyond_the_interval_and_no_minus_before_zero() {
        for (estimate, text) in [
            (of(3.621_74, 3.514, 3.733), "3.62 [3.51, 3.73]"),
            (of(0.838_12, 0.837_1, 0.839_2), "0.8381 [0.8371, 0.8392]"),
            // Half the width begins with 3.55 or more: one digit of it.
            (of(0.752, 0.71, 0.79), "0.75 [0.71, 0.79]"),
            (of(0.752, 0.36, 1.14), "0.8 [0.4, 1.1]"),
            // ± 0.097 is ± 0.10.
            (of(0.752, 0.655, 0.849), "0.75 [0.66, 0.85]"),
            (of(-0.004, -0.4, 0.4), "0.0 [-0.4, 0.4]"),
            (of(0.0, 0.0, 0.0369), "0.000 [0.000, 0.037]"),
            (of(123.4, 80.0, 170.0), "123 [80, 170]"),
            (of(0.5, 0.5, 0.5), "0.500 [0.500, 0.500]"),
            (of(0.0, 0.0, 0.0), "0 [0, 0]"),
            // Too few trials for an upper end, or for both: too few for a third digit.
            (of(1.254, 1.11, f64::NAN), "1.25 [1.11, –]"),
            (of(1.25, f64::NAN, f64::NAN), "1.2"),
            (Estimate::UNKNOWN, "–"),
        ] {
            assert_eq!(estimate.to_string(), text);
        }
        assert_eq!(of(0.01, 0.008, 0.012).times(100.0).alone(), "1.00");
        assert_eq!(Estimate::UNKNOWN.texts(), ["", "", ""]);
    }

    #[test]
    fn law_a_limit_is_the_upper_end_of_the_interval_beside_it() {
        for (high, limit, interval) in [
            (3.688_9e-4, "0.037", "0.000 [0.000, 0.037]"),
            (1.843e-3, "0.18", "0.00 [0.00, 0.18]"),
            (0.168, "17", "0 [0, 17]"),
            (1.0, "100", "0 [0, 100]"),
        ] {
            assert_eq!(
                (at_most(high).as_str(), of(0.0, 0.0, high).times(100.0).to_string()),
                (limit, interval.into())
            );
        }
        assert_eq!(at_most(0.0), "0");
    }
}
