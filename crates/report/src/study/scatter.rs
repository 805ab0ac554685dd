//! Errors of a scattered design.

use super::place::error_axis;
use super::slices::{values, with};
use super::{Caption, Coordinate, Study};
use crate::figure::{Axis, AxisScale, Figure, Layer, Panel, Style};

/// Most panels of one figure.
const MOST_PANELS: usize = 6;

/// Returns the figure of the rms error of every point over each of the first six numeric axes of the study. The first
/// axis with at most five names gives the series. Points at which more than 1 % of starts have no right answer have
/// separate marks.
pub(super) fn scatter(caption: &Caption, study: &Study) -> Figure {
    let varied = study.varied();
    let is_numeric = |axis: &usize| {
        study.points.iter().all(|point| matches!(point.coordinates.get(*axis), Some(Coordinate::Number(_))))
    };
    let series: Vec<(Option<(usize, Coordinate)>, String)> = varied
        .iter()
        .copied()
        .filter(|axis| !is_numeric(axis))
        .map(|axis| (axis, values(study, axis)))
        .find(|(_, values)| values.len() < Style::ALL.len())
        .map_or_else(
            || vec![(None, "one point".to_owned())],
            |(axis, values)| {
                values
                    .into_iter()
                    .map(|value| (Some((axis, value.clone())), super::place::text(&value)))
                    .collect()
            },
        );
    let mut panels: Vec<Panel> = Vec::new();
    for axis in varied.iter().copied().filter(is_numeric).take(MOST_PANELS) {
        let described = &study.axes[axis];
        let numbers = |point: &super::StudyPoint| match point.coordinates.get(axis) {
            Some(Coordinate::Number(number)) => *number,
            _ => f64::NAN,
        };
        let logarithmic =
            described.logarithmic && study.points.iter().map(numbers).all(|number| number > 0.0);
        let scale = if logarithmic { AxisScale::Log10 } else { AxisScale::Linear };
        let mut x = Axis { scale, ..Axis::new(described.title()) };
        if study.points.iter().map(numbers).all(|number| number.fract() == 0.0) {
            x = x.whole();
        }
        let errors = study.points.iter().map(|point| point.rms_deg.value);
        let mut panel = Panel::new(x, error_axis("rms error (°)", errors));
        panel.legend = panels.is_empty();
        for (index, (fixed, label)) in series.iter().enumerate() {
            let wanted: Vec<_> = fixed.iter().cloned().collect();
            let of = |fails: bool| with(study, &wanted).filter(move |p| p.fails() == fails);
            let place = |p: &super::StudyPoint| (numbers(p), p.rms_deg.value);
            panel = panel.with(Layer::points(label, Style::nth(index), of(false).map(place)));
            // Their error is that of the starts that had an answer: no point to choose.
            let failing: Vec<_> = of(true).map(place).collect();
            if !failing.is_empty() {
                panel = panel.with(Layer::points(study.no_answer(), Style::nth(series.len()), failing));
            }
        }
        panels.push(panel);
    }
    let rows = u32::try_from(panels.len().max(1)).unwrap_or(1);
    caption.figure(&[], 120 + if rows == 1 { 340 } else { 215 * rows }, panels)
}
