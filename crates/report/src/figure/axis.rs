//! Axes: their description, ranges, and the way from data to plotters' coordinates.

use super::backend::{UNIT, px};
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use std::ops::Range;

/// An axis of a panel.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Axis {
    /// Quantity, symbol and unit, as in `time t (ms)`.
    pub label: String,
    /// First and last value shown, or the range of the data.
    pub range: Option<(f64, f64)>,
    /// Choice of the axis's ticks.
    pub ticks: Ticks,
    /// Scale of the axis.
    pub scale: AxisScale,
}

/// Scale of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AxisScale {
    /// Equal differences are equally far apart.
    #[default]
    Linear,
    /// Logarithmic: equal ratios have equal distances. Zero and negative values cannot be shown: their points are left
    /// out, and bands, whiskers and cells with such ends end at the edge of the panel.
    Log10,
}

/// Choice of an axis's ticks.
#[derive(Clone, Debug, PartialEq)]
pub enum Ticks {
    /// Ticks at multiples of 1, 2 or 5 times a power of ten; on a logarithmic axis at these numbers.
    Auto,
    /// Ticks at multiples of this step, such as 60 on an axis in degrees; fewer if they do not fit. A logarithmic axis
    /// has no constant step and is marked as with [`Ticks::Auto`].
    Step(f64),
    /// Ticks at whole numbers only, for counts; otherwise as [`Ticks::Auto`].
    Whole,
    /// Ticks at these values, with these words. Words that do not fit are wrapped or set upright, then shortened, then
    /// left out.
    Named(Vec<(f64, String)>),
}

impl Axis {
    /// Makes an axis over the range of the data.
    pub fn new(label: impl Into<String>) -> Self {
        Self { label: label.into(), range: None, ticks: Ticks::Auto, scale: AxisScale::Linear }
    }

    /// Makes an axis of things that have names instead of numbers: the first is at 0, the next at 1, and so on.
    pub fn categories(label: impl Into<String>, names: impl IntoIterator<Item = String>) -> Self {
        let names: Vec<_> = names.into_iter().enumerate().map(|(at, name)| (at as f64, name)).collect();
        let last = names.len() as f64 - 0.5;
        Self { ticks: Ticks::Named(names), ..Self::new(label).range(-0.5, last.max(0.5)) }
    }

    /// Returns the axis with a logarithmic scale.
    pub fn log10(mut self) -> Self {
        self.scale = AxisScale::Log10;
        self
    }

    /// Returns the axis from `first` to `last`.
    pub fn range(mut self, first: f64, last: f64) -> Self {
        self.range = Some((first, last));
        self
    }

    /// Returns the axis marked at whole numbers.
    pub fn whole(mut self) -> Self {
        self.ticks = Ticks::Whole;
        self
    }

    /// Returns the axis marked at multiples of `step`.
    pub fn step(mut self, step: f64) -> Self {
        self.ticks = Ticks::Step(step);
        self
    }
}

impl AxisScale {
    /// Returns whether a value has a place.
    pub(super) fn has(self, value: f64) -> bool {
        value.is_finite() && (self == Self::Linear || value > 0.0)
    }

    /// Returns the number whose equal differences are equally far apart.
    pub(super) fn even(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Log10 if value > 0.0 => value.log10(),
            Self::Log10 => f64::NAN,
        }
    }

    /// Returns the inverse of [`AxisScale::even`].
    pub(super) fn value(self, even: f64) -> f64 {
        match self {
            Self::Linear => even,
            Self::Log10 => 10f64.powf(even),
        }
    }
}

/// Number of key points by which plotters' ticks without a text are asked for.
pub(super) const SHORT_MARKS: usize = 1;

/// An axis of a [`Chart`](super::Chart): a range of plotters whose values are spread evenly or by their logarithms, with the
/// ticks of the figure. [`plotters::prelude::LogCoord`] would have no place for zero and mark no numbers within a decade.
#[derive(Clone, Debug, Default)]
pub struct Scale {
    /// First and last value.
    pub(super) range: (f64, f64),
    pub(super) spread: AxisScale,
    pub(super) ticks: Vec<Tick>,
    /// True if the axis has marks without texts, because another axis shows them.
    pub(super) is_mute: bool,
}

impl Scale {
    pub(super) fn new(range: (f64, f64), spread: AxisScale) -> Self {
        Self { range, spread, ..Self::default() }
    }

    /// Returns the first and last value, spread evenly.
    pub(super) fn ends(&self) -> (f64, f64) {
        (self.spread.even(self.range.0), self.spread.even(self.range.1))
    }

    /// Returns a value spread evenly; a thousand ranges away if it is further, and if it is too small for a
    /// logarithm.
    pub(super) fn even(&self, value: f64) -> f64 {
        let (first, last) = self.ends();
        let far = 1e3 * (last - first);
        let is_below = self.spread == AxisScale::Log10 && value <= 0.0;
        if is_below { first - far } else { self.spread.even(value).clamp(first - far, last + far) }
    }

    /// Returns the place of a value between two places.
    pub(super) fn at(&self, value: f64, (from, to): (f64, f64)) -> f64 {
        if value.is_nan() { value } else { f64::from(self.map(&value, (px(from), px(to)))) / UNIT }
    }

    /// Returns whether a value is within the range.
    pub(super) fn shows(&self, value: f64) -> bool {
        (self.range.0..=self.range.1).contains(&value)
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let (first, last) = self.ends();
        RangedCoordf64::from(first..last).map(&self.even(*value), limit)
    }

    /// Returns the ticks with a text, or those without.
    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let is_short = hint.max_num_points() == SHORT_MARKS;
        self.ticks.iter().filter(|tick| tick.text.is_empty() == is_short).map(|tick| tick.at).collect()
    }

    fn range(&self) -> Range<f64> {
        self.range.0..self.range.1
    }
}

impl ValueFormatter<f64> for Scale {
    fn format_ext(&self, value: &f64) -> String {
        let tick = self.ticks.iter().find(|tick| tick.at == *value && !self.is_mute);
        tick.map_or(String::new(), |tick| tick.text.clone())
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub at: f64,
    /// Empty for a mark between those with a text.
    pub text: String,
}

/// Returns the range asked for, if it is one; lowest first.
pub(super) fn usable(axis: &Axis) -> Option<(f64, f64)> {
    let (a, b) = axis.range?;
    let (low, high) = (a.min(b), a.max(b));
    (axis.scale.has(a) && axis.scale.has(b) && spread(low, high)).then_some((low, high))
}

/// Returns whether two values are apart by more than the error of their subtraction.
fn spread(low: f64, high: f64) -> bool {
    high - low > 1e-12 * low.abs().max(high.abs()) && (high - low).is_finite()
}

/// Returns a range around data from `low` to `high`, wider by the share `margin` on both sides. Data without extent
/// get a range around them, no data the range from 0 to 1, on a logarithmic axis from 0.1 to 10.
pub(super) fn around(scale: AxisScale, extent: Option<(f64, f64)>, margin: f64) -> (f64, f64) {
    let is_linear = scale == AxisScale::Linear;
    let Some((low, high)) = extent else { return if is_linear { (0.0, 1.0) } else { (0.1, 10.0) } };
    // Beyond this, differences overflow.
    let least = if is_linear { -1e300 } else { 1e-300 };
    let (low, high) = (low.clamp(least, 1e300), high.clamp(least, 1e300));
    if spread(low, high) {
        let (low, high) = (scale.even(low), scale.even(high));
        let more = margin * (high - low);
        (scale.value(low - more), scale.value(high + more))
    } else if is_linear {
        let more = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
        (low - more, high + more)
    } else {
        (low / 2.0, high * 2.0)
    }
}
