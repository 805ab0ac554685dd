//! How an axis of a study becomes one of a figure, and which other axes become series.

use super::{Coordinate, Pooled, Study, pool};
use crate::figure::{Axis, AxisScale, Style, Ticks, cell_edges, significant};

/// Most series that one panel can tell apart.
pub(super) const MOST_SERIES: usize = 6;
/// Above so many values, round numbers are better ticks than the values.
const MOST_TICKS: usize = 12;

/// The values of an axis, and where they are.
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
    /// The places of a series: names have room for several side by side, numbers for a little between neighbours.
    pub fn shifted(&self, shift: f64) -> Vec<f64> {
        if self.named {
            return self.at.iter().map(|at| at + shift).collect();
        }
        let log = self.axis.scale == AxisScale::Log10;
        let even = |at: &f64| if log { at.ln() } else { *at };
        let gaps = self.at.windows(2).map(|pair| even(&pair[1]) - even(&pair[0]));
        let gap = gaps.fold(f64::INFINITY, f64::min);
        let by = if gap.is_finite() { 0.3 * shift * gap } else { 0.0 };
        self.at.iter().map(|at| if log { at * by.exp() } else { at + by }).collect()
    }
}

pub(super) fn text(value: &Coordinate) -> String {
    match value {
        Coordinate::Number(number) => significant(*number),
        Coordinate::Name(name) => name.clone(),
    }
}

/// The places of an axis' values. `cells` need room of their own: values in very uneven distances become names.
pub(super) fn place(study: &Study, axis: usize, cells: bool) -> Place {
    let values = pool::values(study, axis);
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
    }
    // What was measured is what is marked.
    if numbers.len() <= MOST_TICKS {
        axis.ticks = Ticks::Named(numbers.iter().map(|at| (*at, significant(*at))).collect());
    }
    Place { axis, values, at: numbers, named: false, edges }
}

/// Values of other axes that share a panel with their own style.
#[derive(Clone, Debug)]
pub(super) struct Series {
    /// Empty for the only one.
    pub label: String,
    pub fixed: Vec<(usize, Coordinate)>,
    pub style: Style,
    /// Where in the room of a name, from −0.5 to 0.5.
    pub shift: f64,
}

/// The series that go over an axis, and a remark on the axes that are pooled.
pub(super) fn series(study: &Study, over: &[usize]) -> (Vec<Series>, Vec<String>) {
    let mut combinations: Vec<Vec<(usize, Coordinate)>> = vec![Vec::new()];
    let mut pooled = Vec::new();
    // Names come first: they are what readers compare.
    let mut others: Vec<usize> = study.varied().into_iter().filter(|axis| !over.contains(axis)).collect();
    others.sort_by_key(|axis| matches!(pool::values(study, *axis).first(), Some(Coordinate::Number(_))));
    for axis in others {
        let values = pool::values(study, axis);
        let names = values.iter().all(|value| matches!(value, Coordinate::Name(_)));
        let few = if names { MOST_SERIES } else { 3 };
        if values.len() <= few && combinations.len() * values.len() <= MOST_SERIES {
            let longer = |known: &Vec<_>, value: &Coordinate| [&known[..], &[(axis, value.clone())]].concat();
            combinations = combinations
                .iter()
                .flat_map(|known| values.iter().map(|value| longer(known, value)))
                .collect();
        } else {
            pooled.push(study.axes[axis].name().to_owned());
        }
    }
    let count = combinations.len() as f64;
    let series = combinations.into_iter().enumerate().map(|(index, fixed)| Series {
        label: fixed
            .iter()
            .map(|(axis, value)| described(study, *axis, value))
            .collect::<Vec<_>>()
            .join(", "),
        fixed,
        style: Style::nth(index),
        shift: 0.7 * ((index as f64 + 0.5) / count - 0.5),
    });
    (series.collect(), remark(&pooled))
}

/// What each series has at each value of an axis.
pub(super) fn found(study: &Study, axis: usize, place: &Place, series: &[Series]) -> Vec<Vec<Pooled>> {
    let at = |series: &Series, value| {
        let fixed = series.fixed.iter().map(|(axis, value)| (*axis, value));
        study.at(&[(axis, value)].into_iter().chain(fixed).collect::<Vec<_>>())
    };
    series.iter().map(|series| place.values.iter().map(|value| at(series, value)).collect()).collect()
}

/// A name speaks for itself, a number does not.
fn described(study: &Study, axis: usize, value: &Coordinate) -> String {
    match value {
        Coordinate::Name(name) => name.clone(),
        Coordinate::Number(number) => {
            let axis = &study.axes[axis];
            format!("{} {} {}", axis.name(), significant(*number), axis.unit).trim_end().to_owned()
        }
    }
}

pub(super) fn remark(pooled: &[String]) -> Vec<String> {
    if pooled.is_empty() { Vec::new() } else { vec![format!("pooled over {}", pooled.join(", "))] }
}

/// An axis of errors over these values: logarithmic where they span more than a factor of five, otherwise from zero.
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
