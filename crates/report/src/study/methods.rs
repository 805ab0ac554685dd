//! Methods compared.

use super::odds::{KINDS, never, with_odds};
use super::place::{error_axis, place, remark};
use super::sweep::probability_axis;
use super::{Caption, Pooled, Study, WIDTH, pool};
use crate::figure::{Figure, Layer, Panel, Style};

/// Methods side by side, pooled over all other axes: above the rms error with its interval, and the 95th percentile where
/// it is known, below the probabilities of a wrong pole, an undetermined pole and a failure.
///
/// One column a method, so that both panels share the names.
///
/// # Panics
///
/// If the study has no axis with this index.
pub fn methods(caption: &Caption, study: &Study, axis: usize) -> Figure {
    let place = place(study, axis, true);
    let found: Vec<(f64, Pooled)> = place
        .at
        .iter()
        .zip(&place.values)
        .map(|(x, value)| (*x, pool(study, &super::pool::at(study, &[(axis, value)]))))
        .collect();
    let values = found.iter().flat_map(|(_, p)| [p.rms_deg.value, p.p95_deg.value]);
    let errors = match error_axis("error of the axis (°)", values) {
        axis if axis.range.is_none() => axis,
        axis => crate::figure::Axis { range: None, ..axis }.log10(),
    };
    let bar = |x: f64, of: &super::Interval| (x, of.value, of.low, of.high);
    let mut upper = Panel::new(place.axis.clone(), errors).with(Layer::ErrorBars {
        label: Some("rms with 95 % interval".to_owned()),
        points: found.iter().map(|(x, p)| bar(x - 0.08, &p.rms_deg)).collect(),
        style: Style::Blue,
    });
    if found.iter().any(|(_, p)| p.p95_deg.value.is_finite()) {
        upper = upper.with(Layer::ErrorBars {
            label: Some("95th percentile of |e|".to_owned()),
            points: found.iter().map(|(x, p)| bar(x + 0.08, &p.p95_deg)).collect(),
            style: Style::Vermilion,
        });
    }
    let never = never(found.iter().map(|(_, pooled)| pooled));
    let mut lower = Panel::new(place.axis, probability_axis("probability"));
    for (index, kind) in KINDS.iter().enumerate() {
        let shift = 0.2 * (index as f64 - 1.0);
        let found: Vec<(f64, Pooled)> = found.iter().map(|(x, pooled)| (x + shift, *pooled)).collect();
        lower = with_odds(lower, &found, kind, Style::nth(index), (kind.0, &never), false);
    }
    let others: Vec<String> = study
        .varied()
        .into_iter()
        .filter(|other| *other != axis)
        .map(|other| study.axes[other].name().to_owned())
        .collect();
    Figure {
        title: caption.title.clone(),
        subtitle: Study::remarked(caption, &remark(&others)),
        width: WIDTH,
        height: 720,
        panels: vec![upper, lower],
    }
}
