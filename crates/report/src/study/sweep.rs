//! Errors over one axis.

use super::place::{Place, error_axis, place};
use super::slices::{Part, Series, Slices, along, slices};
use super::{Caption, Estimate, Study, StudyPoint, bar, odds};
use crate::figure::{Axis, Figure, Layer, Panel, Style};

type Value = fn(&StudyPoint) -> Estimate;
type Bars = Vec<(f64, f64, f64, f64)>;
/// The points of a curve at the values of an axis.
type Curve<'a> = Vec<Option<&'a StudyPoint>>;

/// Returns the figure of the rms error and the 95th percentile over an axis of the study, with intervals.
///
/// Other axes are shown as [`slices`] describes; several panels have the rms error alone, on one scale. The axis of
/// errors is logarithmic if they span more than a factor of five. If more than 1 % of a point's starts have no right
/// answer, its error is that of the other starts, or it has none: such points are hollow, and no line joins them.
/// Values of the axis are hatched at which all curves have such points.
pub(super) fn sweep(caption: &Caption, study: &Study, axis: usize) -> Figure {
    let place = place(study, axis, false);
    let Slices { parts, mut remarks } = slices(study, &[axis], true);
    remarks.extend(odds::unseen(study));
    let found: Vec<Vec<Curve<'_>>> =
        parts.iter().map(|part| along(study, axis, &place.values, &part.series)).collect();
    let all = |value: Value| {
        let points = found.iter().flatten().flatten().flatten();
        points.flat_map(|point| [value(point).value, value(point).high]).collect::<Vec<f64>>()
    };
    let (rms, p95): (Value, Value) = (|p| p.rms_deg, |p| p.p95_deg);
    let has_p95 = all(p95).iter().any(|value| value.is_finite());
    let lines = !place.named;
    let mut panels = Vec::new();
    if let ([Part { series, .. }], [curves]) = (&parts[..], &found[..]) {
        if let [curve] = &curves[..] {
            let y = error_axis("error of the axis (°)", [all(rms), all(p95)].concat().into_iter());
            let mut panel =
                hatched(Panel::new(place.axis.clone(), y), &place, (curves, &found), study.no_answer());
            panel = with_hollow(panel, "rms", &place.at, (curve, rms), Style::Blue, lines);
            if has_p95 {
                let named = "95th percentile of |e|";
                panel = with_hollow(panel, named, &place.at, (curve, p95), Style::Vermilion, lines);
            }
            panels.push(panel);
        } else {
            let kinds = [("rms error of the axis (°)", rms), ("95th percentile of |e| (°)", p95)];
            for (label, value) in kinds.into_iter().take(1 + usize::from(has_p95)) {
                let y = error_axis(label, all(value).into_iter());
                let panel = Panel::new(place.axis.clone(), y);
                panels.push(with_curves(panel, study, &place, series, (curves, &found), value));
                panels.last_mut().expect("it was pushed").legend = panels.len() == 1;
            }
        }
    } else {
        let first = &parts[0].series;
        let y = one_scale(error_axis("rms error (°)", all(rms).into_iter()), &all(rms));
        for (part, curves) in parts.iter().zip(&found) {
            let y = y.clone();
            let panel = Panel::new(place.axis.clone(), y).titled(&part.title);
            let mut panel = with_curves(panel, study, &place, &part.series, (curves, &found), rms);
            // Curves of the same names are explained once.
            let same =
                part.series.iter().map(|series| &series.label).eq(first.iter().map(|series| &series.label));
            panel.legend = !same || panels.is_empty();
            panels.push(panel);
        }
    }
    let height = match panels.len() {
        1 => 480,
        2 => 760,
        many => 140 + 260 * u32::try_from(many).unwrap_or(1),
    };
    caption.figure(&remarks, height, panels)
}

/// Adds several curves to a panel, and hatches the places at which all of them fail.
fn with_curves(
    panel: Panel,
    study: &Study,
    place: &Place,
    series: &[Series],
    (curves, figure): (&[Curve<'_>], &[Vec<Curve<'_>>]),
    value: Value,
) -> Panel {
    let mut panel = hatched(panel, place, (curves, figure), study.no_answer());
    for (series, curve) in series.iter().zip(curves) {
        let at = place.shifted(series.shift);
        panel = with_hollow(panel, &series.label, &at, (curve, value), series.style, !place.named);
    }
    panel
}

/// Returns an axis with a fixed range over these values, so that all panels have the same.
fn one_scale(axis: Axis, values: &[f64]) -> Axis {
    let known = values.iter().copied().filter(|value| *value > 0.0 && value.is_finite());
    let (low, high) =
        known.fold((f64::INFINITY, 0.0f64), |(low, high), value| (low.min(value), high.max(value)));
    if axis.range.is_some() || high <= 0.0 { axis } else { axis.range(low / 1.3, 1.3 * high) }
}

/// Adds strips to a panel where all of its curves have more than 1 % of starts without a right answer. If any point of
/// the figure fails, the legend explains strips and rings.
fn hatched(
    panel: Panel,
    place: &Place,
    (curves, figure): (&[Curve<'_>], &[Vec<Curve<'_>>]),
    no_answer: &str,
) -> Panel {
    if !figure.iter().flatten().flatten().flatten().any(|point| point.fails()) {
        return panel;
    }
    let all = |k: &usize| {
        let mut there = curves.iter().filter_map(|curve| curve[*k]).peekable();
        there.peek().is_some() && there.all(StudyPoint::fails)
    };
    let last = place.values.len() - 1;
    let span = |k: usize| {
        let from = if k == 0 { f64::NEG_INFINITY } else { place.edges[k] };
        (from, if k == last { f64::INFINITY } else { place.edges[k + 1] })
    };
    let spans: Vec<(f64, f64)> = (0..=last).filter(all).map(span).collect();
    let label = if curves.len() > 1 {
        format!("hollow: {no_answer}; hatched: at all curves")
    } else {
        format!("hatched: {no_answer}")
    };
    panel.with(Layer::Hatched { label: Some(label), spans })
}

/// Returns a curve of which points that fail are hollow, and gaps of the line.
fn with_hollow(
    panel: Panel,
    label: &str,
    at: &[f64],
    (curve, value): (&Curve<'_>, Value),
    style: Style,
    line: bool,
) -> Panel {
    let bars = |hollow: bool| -> Bars {
        let bar = |(x, point): (&f64, Option<&StudyPoint>)| match point {
            Some(point) if point.fails() == hollow => bar(value(point), *x),
            _ => (*x, f64::NAN, f64::NAN, f64::NAN),
        };
        at.iter().zip(curve.iter().copied()).map(bar).collect()
    };
    let panel = with_bars(panel, label, bars(false), style, line);
    let hollow: Bars = bars(true).into_iter().filter(|bar| bar.1.is_finite()).collect();
    if hollow.is_empty() { panel } else { panel.with(Layer::hollow(label, style, hollow)) }
}

/// Returns a line through numbers, none between names, and the intervals in front.
pub(super) fn with_bars(panel: Panel, label: &str, bars: Bars, style: Style, line: bool) -> Panel {
    let points = bars.iter().map(|bar| (bar.0, bar.1));
    let panel = if line { panel.with(Layer::line(label, style, points)) } else { panel };
    panel.with(Layer::error_bars(label, style, bars))
}

/// Returns an axis for probabilities in per cent.
pub(super) fn probability_axis(label: &str) -> Axis {
    Axis::new(format!("{label} (%)")).log10()
}
