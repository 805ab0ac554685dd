//! Conversion of an axis of a study to an axis of a figure.

use super::slices::values;
use super::{Coordinate, Study};
use crate::figure::{Axis, AxisScale, Ticks, cell_edges, digits};

/// Above so many values, round numbers are better ticks than the values.
const MOST_TICKS: usize = 12;
/// Largest number of digits of values that were set, which have no error.
const DIGITS: i32 = 4;
/// Space beyond the first and the last value, as a share of the range.
const MARGIN: f64 = 0.05;

/// The values of an axis, and their positions.
pub(super) struct Place {
    pub axis: Axis,
    pub values: Vec<Coordinate>,
    pub at: Vec<f64>,
    /// Names in even distances, or numbers at their own places.
    pub named: bool,
    /// Edges of cells around the places.
    pub edges: Vec<f64>,
}

impl Place {
    /// Returns the places of a series: names have room for several side by side, numbers for a little between
    /// neighbours.
    pub fn shifted(&self, shift: f64) -> Vec<f64> {
        if self.named {
            return self.at.iter().map(|at| at + shift).collect();
        }
        let log = self.axis.scale == AxisScale::Log10;
        let even = |at: &f64| if log { at.ln() } else { *at };
        let gaps = self.at.windows(2).map(|pair| even(&pair[1]) - even(&pair[0]));
        // Of few values too, all stay within the panel.
        let whole = self.at.last().zip(self.at.first()).map_or(0.0, |(last, first)| even(last) - even(first));
        let gap = gaps.fold(whole / 6.0, f64::min);
        let by = 0.3 * shift * gap;
        self.at.iter().map(|at| if log { at * by.exp() } else { at + by }).collect()
    }
}

pub(super) fn text(value: &Coordinate) -> String {
    match value {
        Coordinate::Number(number) => digits(*number, DIGITS),
        Coordinate::Name(name) => name.clone(),
    }
}

/// Returns the positions of an axis's values. `cells`: each value needs space for a cell, so very unevenly spaced
/// values are set at equal distances, like names.
pub(super) fn place(study: &Study, axis: usize, cells: bool) -> Place {
    let values = values(study, axis);
    let described = &study.axes[axis];
    let numbers: Vec<f64> = values
        .iter()
        .filter_map(|value| match value {
            Coordinate::Number(number) => Some(*number),
            Coordinate::Name(_) => None,
        })
        .collect();
    let all_numbers = numbers.len() == values.len() && !numbers.is_empty();
    let logarithmic = described.logarithmic;
    let has_places = all_numbers && (!logarithmic || numbers[0] > 0.0);
    let even = |value: f64| if logarithmic { value.ln() } else { value };
    let gaps = numbers.windows(2).map(|pair| even(pair[1]) - even(pair[0]));
    let (least, most) = gaps.fold((f64::INFINITY, 0.0f64), |(a, b), gap| (a.min(gap), b.max(gap)));
    let uneven = cells && (most > 6.0 * least || numbers.len() == 1);
    if !has_places || uneven {
        let at: Vec<f64> = (0..values.len()).map(|index| index as f64).collect();
        let edges = cell_edges(&at, AxisScale::Linear);
        let axis = Axis::categories(described.title(), values.iter().map(text));
        return Place { axis, values, at, named: true, edges };
    }
    let scale = if logarithmic { AxisScale::Log10 } else { AxisScale::Linear };
    let edges = cell_edges(&numbers, scale);
    let mut axis = Axis { scale, ..Axis::new(described.title()) };
    if let (true, Some(first), Some(last)) = (cells, edges.first(), edges.last()) {
        axis = axis.range(*first, *last);
    } else if let [first, .., last] = numbers[..] {
        // So far, whether or not there is something to draw at the ends.
        let (low, high) = (even(first), even(last));
        let more = MARGIN * (high - low);
        let back = |place: f64| if logarithmic { place.exp() } else { place };
        axis = axis.range(back(low - more), back(high + more));
    }
    // What was measured is what is marked.
    if numbers.len() <= MOST_TICKS {
        axis.ticks = Ticks::Named(numbers.iter().map(|at| (*at, digits(*at, DIGITS))).collect());
    } else if numbers.iter().all(|at| at.fract() == 0.0) {
        axis.ticks = Ticks::Whole;
    }
    Place { axis, values, at: numbers, named: false, edges }
}

/// Returns an axis of errors over these values: logarithmic if they span more than a factor of five, otherwise from
/// zero.
pub(super) fn error_axis(label: &str, values: impl Iterator<Item = f64>) -> Axis {
    let (low, high) = values
        .filter(|value| *value > 0.0 && value.is_finite())
        .fold((f64::INFINITY, 0.0f64), |(low, high), value| (low.min(value), high.max(value)));
    let axis = Axis::new(label);
    if high > 5.0 * low {
        axis.log10()
    } else if high > 0.0 {
        axis.range(0.0, 1.1 * high)
    } else {
        axis
    }
}
