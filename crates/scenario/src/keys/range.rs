//! Ranges of numbers that a key allows, and ranges that several keys share.

use standstill_plant::Temperature;

/// Range of numbers that a key allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest number, in the unit of the schema.
    pub low: f64,
    /// Largest number, in the unit of the schema.
    pub high: f64,
    /// Description of both limits, as messages quote it.
    pub needed: &'static str,
    /// Reason for the limits.
    pub reason: &'static str,
    /// True if only whole numbers are allowed.
    pub whole: bool,
    /// Smallest allowed number above zero. If it is larger than `low`, zero is allowed, but no number between zero and `gap`. If there is
    /// no such gap, it is equal to `low`.
    gap: f64,
}

impl Range {
    pub(super) const fn new(low: f64, high: f64, needed: &'static str, reason: &'static str) -> Self {
        Self { low, high, needed, reason, whole: false, gap: low }
    }

    pub(super) const fn whole(self) -> Self {
        Self { whole: true, ..self }
    }

    /// Returns this range with a gap between zero and `least`: zero stays allowed, and all other numbers are at least `least`.
    pub(super) const fn or_from(self, least: f64) -> Self {
        Self { gap: least, ..self }
    }

    /// Returns the smallest allowed number above zero if the range contains zero and a gap above zero. Returns none if there is no gap.
    pub(crate) fn gap(&self) -> Option<f64> {
        (self.gap > self.low).then_some(self.gap)
    }

    pub(crate) fn contains(&self, value: f64) -> bool {
        let within = (self.low..=self.high).contains(&value) && (value == 0.0 || value >= self.gap);
        within && !(self.whole && value.fract() != 0.0)
    }
}

/// Largest number in SI units that any key allows. No drive or motor has a larger value. The square of this number is still finite.
pub(super) const LARGEST: f64 = 1e12;

pub(super) const NOT_NEGATIVE: Range =
    Range::new(0.0, LARGEST, "zero or more", "a magnitude or a standard deviation has no sign");
pub(super) const POSITIVE: Range = Range::new(
    f64::MIN_POSITIVE,
    LARGEST,
    "more than zero",
    "a voltage or a range of zero measures and drives nothing",
);
pub(super) const SHARE: Range =
    Range::new(0.0, 1.0, "a share from 0 to 1", "a deviation is smaller than the value itself");
pub(super) const TIME: Range = Range::new(0.0, 1.0, "from 0 to 1 s", "ten periods of the slowest carrier");
pub(super) const PRECISION: Range = Range::new(
    1e-6,
    1.0,
    "from 1e-6 to 1, or 0.0001 % to 100 %",
    "a millionth takes 1e12 trials; an interval as wide as its value says nothing",
);
pub(super) const TEMPERATURE: Range = Range::new(
    Temperature::RANGE[0],
    Temperature::RANGE[1],
    "from -60 °C to 300 °C",
    "the coefficients of copper and magnets hold there; insulation and magnets fail beyond",
);
