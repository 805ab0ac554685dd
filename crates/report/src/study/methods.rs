//! Methods compared.

use super::odds::{never, with_odds};
use super::place::{error_axis, place};
use super::slices::with;
use super::sweep::probability_axis;
use super::{Caption, Study, StudyPoint, bar};
use crate::figure::{Axis, Figure, Layer, Panel, Style};

/// Methods side by side, where nothing else is varied: above the rms error with its interval, and the 95th percentile where
/// it is known, below the probabilities of a wrong pole, an undetermined pole and a failure.
///
/// One column a method, so that both panels share the names.
pub(super) fn methods(caption: &Caption, study: &Study, axis: usize) -> Figure {
    let place = place(study, axis, true);
    let found: Vec<&StudyPoint> =
        place.values.iter().filter_map(|value| with(study, &vec![(axis, value.clone())]).next()).collect();
    let at = |shift: f64| place.at.iter().map(move |x| x + shift).zip(found.iter().copied());
    let values = found.iter().flat_map(|p| [p.rms_deg.value, p.p95_deg.value]);
    let errors = match error_axis("error of the axis (°)", values) {
        axis if axis.range.is_none() => axis,
        axis => Axis { range: None, ..axis }.log10(),
    };
    let rms = at(-0.08).map(|(x, p)| bar(p.rms_deg, x));
    let mut upper = Panel::new(place.axis.clone(), errors).with(Layer::error_bars(
        "rms with 95 % interval",
        Style::Blue,
        rms,
    ));
    if found.iter().any(|p| p.p95_deg.value.is_finite()) {
        let p95 = at(0.08).map(|(x, p)| bar(p.p95_deg, x));
        upper = upper.with(Layer::error_bars("95th percentile of |e|", Style::Vermilion, p95));
    }
    let never = never(found.iter().copied());
    let mut lower = Panel::new(place.axis.clone(), probability_axis("probability"));
    for (index, kind) in study.kinds().iter().enumerate() {
        let found = at(0.2 * (index as f64 - 1.0));
        lower = with_odds(lower, study, found, kind, Style::nth(index), (kind.0, &never), false);
    }
    caption.figure(&[], 720, vec![upper, lower])
}
