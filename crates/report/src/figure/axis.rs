//! Axes: ranges, the places and texts of ticks, and the way from data to pixels.

use super::decades::superscript;
use super::layout::TICK;

/// An axis of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Quantity, symbol and unit, as in `time t (ms)`.
    pub label: String,
    /// First and last value shown, or the range of the data.
    pub range: Option<(f64, f64)>,
    /// Where the axis is marked.
    pub ticks: Ticks,
    /// How values are spread along it.
    pub scale: AxisScale,
}

/// How values are spread along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AxisScale {
    /// Equal differences are equally far apart.
    #[default]
    Linear,
    /// Equal ratios are equally far apart. Zero and what is below have no place: points there are left out, and
    /// bands, whiskers and cells that reach there end at the edge of the panel.
    Log10,
}

/// Where an axis is marked.
#[derive(Clone, Debug, PartialEq)]
pub enum Ticks {
    /// At multiples of 1, 2 or 5 times a power of ten; on a logarithmic axis at these numbers themselves.
    Auto,
    /// At multiples of this step, such as 60 on an axis in degrees; fewer if they would not fit. A logarithmic
    /// axis has no constant step and is marked as with [`Ticks::Auto`].
    Step(f64),
    /// As with [`Ticks::Auto`], but at whole numbers only: of things that are counted.
    Whole,
    /// At these values, with these words. Words that do not fit are set on several lines or upright, shortened,
    /// and at last left out.
    Named(Vec<(f64, String)>),
}

impl Axis {
    /// An axis over the range of the data.
    pub fn new(label: impl Into<String>) -> Self {
        Self { label: label.into(), range: None, ticks: Ticks::Auto, scale: AxisScale::Linear }
    }

    /// An axis of things that have names instead of numbers: the first is at 0, the next at 1, and so on.
    pub fn categories(label: impl Into<String>, names: impl IntoIterator<Item = String>) -> Self {
        let names: Vec<_> = names.into_iter().enumerate().map(|(at, name)| (at as f64, name)).collect();
        let last = names.len() as f64 - 0.5;
        Self { ticks: Ticks::Named(names), ..Self::new(label).range(-0.5, last.max(0.5)) }
    }

    /// The axis with a logarithmic scale.
    #[must_use]
    pub fn log10(mut self) -> Self {
        self.scale = AxisScale::Log10;
        self
    }

    /// The axis from `first` to `last`.
    #[must_use]
    pub fn range(mut self, first: f64, last: f64) -> Self {
        self.range = Some((first, last));
        self
    }

    /// The axis marked at whole numbers.
    #[must_use]
    pub fn whole(mut self) -> Self {
        self.ticks = Ticks::Whole;
        self
    }

    /// The axis marked at multiples of `step`.
    #[must_use]
    pub fn step(mut self, step: f64) -> Self {
        self.ticks = Ticks::Step(step);
        self
    }
}

impl AxisScale {
    /// Whether a value has a place.
    pub(super) fn has(self, value: f64) -> bool {
        value.is_finite() && (self == Self::Linear || value > 0.0)
    }

    /// The number whose equal differences are equally far apart.
    pub(super) fn even(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Log10 if value > 0.0 => value.log10(),
            Self::Log10 => f64::NAN,
        }
    }

    /// The inverse of [`AxisScale::even`].
    pub(super) fn value(self, even: f64) -> f64 {
        match self {
            Self::Linear => even,
            Self::Log10 => 10f64.powf(even),
        }
    }
}

/// A mapping from values to pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// First and last value.
    pub range: (f64, f64),
    /// Their pixels.
    pub pixels: (f64, f64),
    pub spread: AxisScale,
}

impl Scale {
    /// The pixel of a value; not a number for one that has no place.
    pub fn at(&self, value: f64) -> f64 {
        let (from, to) = self.pixels;
        from + self.share(value) * (to - from)
    }

    /// As [`Scale::at`], but far before the first pixel for what is too small for a logarithm.
    pub fn end_at(&self, value: f64) -> f64 {
        if self.spread == AxisScale::Log10 && value <= 0.0 {
            let (from, to) = self.pixels;
            return from - 10.0 * (to - from);
        }
        self.at(value)
    }

    /// How far along the axis a value is: 0 at its beginning, 1 at its end.
    pub fn share(&self, value: f64) -> f64 {
        let [first, last, value] = [self.range.0, self.range.1, value].map(|v| self.spread.even(v));
        (value - first) / (last - first)
    }

    pub fn shows(&self, value: f64) -> bool {
        (self.range.0..=self.range.1).contains(&value)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub at: f64,
    /// Empty for a mark between those with a text.
    pub text: String,
}

impl Tick {
    /// The length of its mark, shorter between those with a text.
    pub fn mark(&self) -> f64 {
        if self.text.is_empty() { 0.6 * TICK } else { TICK }
    }
}

/// The range asked for, if it is one; lowest first.
pub(super) fn usable(axis: &Axis) -> Option<(f64, f64)> {
    let (a, b) = axis.range?;
    let (low, high) = (a.min(b), a.max(b));
    (axis.scale.has(a) && axis.scale.has(b) && spread(low, high)).then_some((low, high))
}

/// [`around`] on an axis of the given scale.
pub(super) fn around_on(scale: AxisScale, extent: Option<(f64, f64)>, margin: f64) -> (f64, f64) {
    match (scale, extent) {
        (AxisScale::Linear, _) => around(extent, margin),
        (AxisScale::Log10, None) => (0.1, 10.0),
        (AxisScale::Log10, Some((low, high))) if spread(low, high) => {
            let (low, high) = around(Some((scale.even(low), scale.even(high))), margin);
            // Beyond these powers of ten there are no numbers.
            (scale.value(low.max(-300.0)), scale.value(high.min(300.0)))
        }
        (AxisScale::Log10, Some((low, high))) => (low.max(1e-300) / 2.0, high.clamp(1e-300, 1e300) * 2.0),
    }
}

/// Whether two values are apart by more than the error of their subtraction.
fn spread(low: f64, high: f64) -> bool {
    high - low > 1e-12 * low.abs().max(high.abs()) && (high - low).is_finite()
}

/// A range around data from `low` to `high`, wider by the share `margin` on both sides. Data without extent
/// get a range around them, no data the range from 0 to 1.
fn around(extent: Option<(f64, f64)>, margin: f64) -> (f64, f64) {
    let Some((low, high)) = extent else { return (0.0, 1.0) };
    // Beyond this, differences overflow.
    let (low, high) = (low.clamp(-1e300, 1e300), high.clamp(-1e300, 1e300));
    if spread(low, high) {
        let more = margin * (high - low);
        (low - more, high + more)
    } else {
        let more = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
        (low - more, high + more)
    }
}

/// The ticks within a range: about `most` automatic ones, or as many of a given step as keep `densest`.
pub(super) fn ticks(ticks: &Ticks, range: (f64, f64), most: f64, densest: f64) -> Vec<Tick> {
    let span = range.1 - range.0;
    let step = match ticks {
        Ticks::Named(names) => {
            return names
                .iter()
                .filter(|(at, _)| (range.0..=range.1).contains(at))
                .map(|(at, text)| Tick { at: *at, text: text.clone() })
                .collect();
        }
        Ticks::Step(step) if step.is_finite() && *step > 0.0 => {
            step * (span / step / densest).ceil().max(1.0)
        }
        _ => {
            // Less than three marks make no scale: then a finer step, if its texts have room.
            let step = nice_step(span / most.max(1.0));
            let finer = nice_step(0.4 * step);
            let count = |step| multiples(range, step).1 - multiples(range, step).0 + 1.0;
            let step = if count(step) < 3.0 && count(finer) <= densest { finer } else { step };
            if *ticks == Ticks::Whole { step.max(1.0) } else { step }
        }
    };
    let (first, last) = multiples(range, step);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most a few dozen ticks")]
    let count = (last - first + 1.0).clamp(0.0, 100.0) as u32;
    let largest = range.0.abs().max(range.1.abs());
    (0..count)
        .map(|i| (first + f64::from(i)) * step)
        .map(|at| Tick { at, text: number(at, step, largest) })
        .collect()
}

/// The first and the last multiple of `step` within a range, as counts of steps.
fn multiples(range: (f64, f64), step: f64) -> (f64, f64) {
    let slack = 1e-9;
    ((range.0 / step - slack).ceil(), (range.1 / step + slack).floor())
}

/// The smallest of 1, 2 and 5 times a power of ten that is not below `least`.
fn nice_step(least: f64) -> f64 {
    let decade = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|m| m * decade)
        .find(|step| *step >= least * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade)
}

/// A tick's value with the decimals its step needs, and with a power of ten if it would be long.
fn number(value: f64, step: f64, largest: f64) -> String {
    let exponent = largest.log10().floor();
    if value == 0.0 {
        "0".to_owned()
    } else if (-3.0..6.0).contains(&exponent) {
        decimal(value, step)
    } else {
        let unit = 10f64.powf(exponent);
        format!("{}·10{}", decimal(value / unit, step / unit), superscript(exponent))
    }
}

fn decimal(value: f64, step: f64) -> String {
    let mut scaled = step;
    let mut decimals = 0;
    while decimals < 9 && (scaled - scaled.round()).abs() > 1e-6 * scaled {
        scaled *= 10.0;
        decimals += 1;
    }
    format!("{value:.decimals$}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(ticks_at: &Ticks, range: (f64, f64)) -> Vec<String> {
        ticks(ticks_at, range, 5.0, 12.0).into_iter().map(|tick| tick.text).collect()
    }

    #[test]
    fn law_ticks_are_round_numbers() {
        assert_eq!(texts(&Ticks::Auto, (-0.05, 0.55)), ["0.0", "0.2", "0.4"].map(|t| t.replace("0.0", "0")));
        assert_eq!(texts(&Ticks::Auto, (-3.0, 2.0)), ["−3", "−2", "−1", "0", "1", "2"]);
        assert_eq!(texts(&Ticks::Step(60.0), (0.0, 180.0)), ["0", "60", "120", "180"]);
        assert_eq!(texts(&Ticks::Auto, (0.0, 4e-5)), ["0", "1·10⁻⁵", "2·10⁻⁵", "3·10⁻⁵", "4·10⁻⁵"]);
    }

    #[test]
    fn law_what_is_counted_is_marked_at_whole_numbers() {
        assert_eq!(texts(&Ticks::Auto, (0.9, 3.1)), ["1.0", "1.5", "2.0", "2.5", "3.0"]);
        assert_eq!(texts(&Ticks::Whole, (0.9, 3.1)), ["1", "2", "3"]);
        assert_eq!(texts(&Ticks::Whole, (0.0, 40.0)), texts(&Ticks::Auto, (0.0, 40.0)));
    }

    #[test]
    fn law_too_fine_a_step_is_thinned() {
        assert!(texts(&Ticks::Step(0.001), (0.0, 360.0)).len() <= 13);
    }
}
