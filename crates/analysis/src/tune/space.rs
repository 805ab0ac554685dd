//! Ranges of the values among which settings are searched.

use standstill_numeric::ln;
use standstill_quantity::significant;

use crate::bracket::between;

/// Range of the values of a key.
#[derive(Clone, Debug, PartialEq)]
pub struct Range {
    /// Path of the key, such as `detector.pulse`.
    pub key: String,
    /// Smallest value, in SI.
    pub low: f64,
    /// Largest value, in SI.
    pub high: f64,
    /// True if only whole numbers are allowed.
    pub whole: bool,
}

impl Range {
    /// Returns the value at a position in the range. The position is 0 at the smallest value and 1 at the largest. The scale is geometric
    /// if all values are above zero, else linear. The value is rounded to four digits, so that a printed value is exactly the value that
    /// was tried.
    ///
    /// ```
    /// use standstill_analysis::tune::Range;
    ///
    /// let pulse = Range { key: "detector.pulse".into(), low: 50e-6, high: 200e-6, whole: false };
    /// assert_eq!((pulse.at(0.0), pulse.at(0.5), pulse.at(1.0)), (50e-6, 100e-6, 200e-6));
    /// assert!((pulse.place(100e-6) - 0.5).abs() < 1e-12);
    /// ```
    pub fn at(&self, place: f64) -> f64 {
        let value = between((self.low, self.high), place.clamp(0.0, 1.0));
        let value = if self.whole { value.round() } else { significant(value, 4) };
        value.clamp(self.low, self.high)
    }

    /// Returns the position of a value in the range, from 0 to 1. A value outside the range has the position of the nearer end.
    pub fn place(&self, value: f64) -> f64 {
        let place = if self.low > 0.0 {
            ln(value.max(self.low) / self.low) / ln(self.high / self.low)
        } else {
            (value - self.low) / (self.high - self.low)
        };
        place.clamp(0.0, 1.0)
    }
}
