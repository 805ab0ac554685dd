//! Errors over one axis.

use super::place::{Place, Series, error_axis, found, place, series};
use super::{Caption, Coordinate, Interval, NO_ANSWER, Pooled, Study};
use crate::figure::{Axis, Figure, Layer, Panel, Style};

type Value = fn(&Pooled) -> Interval;
type Bars = Vec<(f64, f64, f64, f64)>;
/// A value with its interval, and whether more than 1 % of the starts there have no right answer.
type Point = ((f64, f64, f64, f64), bool);

/// Rms error and 95th percentile over an axis of the study, with their intervals.
///
/// Other axes with few values become series, as long as these are six at most; the rest is pooled, which leaves only
/// the rms error. The errors' axis is logarithmic where they span more than a factor of five. Where more than 1 % of starts
/// have no right answer, the error is of the others alone, or there is none: such values of the axis are shaded, such points
/// hollow, and no line joins them.
pub(super) fn sweep(caption: &Caption, study: &Study, axis: usize) -> Figure {
    let place = place(study, axis, false);
    let (series, remarks) = series(study, &[axis]);
    let found = found(study, axis, &place, &series);
    let bars = |series: &Series, of: &[Pooled], value: Value| -> Vec<Point> {
        let shift = if place.named { series.shift } else { 0.0 };
        let fails = |at: &Coordinate| {
            let fixed = series.fixed.iter().map(|(axis, value)| (*axis, value));
            !study.answers(&[(axis, at)].into_iter().chain(fixed).collect::<Vec<_>>())
        };
        let bars = place.at.iter().zip(of).map(|(x, p)| value(p).bar(x + shift));
        bars.zip(&place.values).map(|(bar, at)| (bar, fails(at))).collect()
    };
    let (rms, p95): (Value, Value) = (|p| p.rms_deg, |p| p.p95_deg);
    let all = |value: Value| {
        found.iter().flatten().flat_map(move |p| [value(p).value, value(p).high]).collect::<Vec<_>>()
    };
    let has_p95 = all(p95).iter().any(|value| value.is_finite());
    let lines = !place.named;
    let failing = failing(study, axis, &place);
    let which = if series.len() > 1 { "; shaded: in one series at least" } else { "" };
    let x = || place.axis.clone();
    let mut panels = Vec::new();
    if let ([one], [only]) = (&series[..], &found[..]) {
        let values = [all(rms), all(p95)].concat();
        let mut panel = shaded(x(), "error of the axis (°)", &values, &place, (&failing, which));
        panel = with_hollow(panel, "rms", &bars(one, only, rms), Style::Blue, lines);
        if has_p95 {
            let bars = bars(one, only, p95);
            panel = with_hollow(panel, "95th percentile of |e|", &bars, Style::Vermilion, lines);
        }
        panels.push(panel);
    } else {
        let kinds = [("rms error of the axis (°)", rms), ("95th percentile of |e| (°)", p95)];
        for (label, value) in kinds.into_iter().take(1 + usize::from(has_p95)) {
            let mut panel = shaded(x(), label, &all(value), &place, (&failing, which));
            for (series, found) in series.iter().zip(&found) {
                panel = with_hollow(panel, &series.label, &bars(series, found, value), series.style, lines);
            }
            panel.legend = panels.is_empty();
            panels.push(panel);
        }
    }
    caption.figure(&remarks, if panels.len() == 1 { 480 } else { 760 }, panels)
}

/// At which values of an axis more than 1 % of the starts of a point have no right answer.
fn failing(study: &Study, axis: usize, place: &Place) -> Vec<bool> {
    place.values.iter().map(|value| !study.answers(&[(axis, value)])).collect()
}

/// A panel for these errors, shaded over its whole height where starts fail: so far the axis reaches, error or none.
fn shaded(x: Axis, label: &str, errors: &[f64], place: &Place, (failing, which): (&[bool], &str)) -> Panel {
    let mut y = error_axis(label, errors.iter().copied());
    let known = errors.iter().copied().filter(|error| *error > 0.0 && error.is_finite());
    let (low, high) = known.fold((f64::INFINITY, 0.0f64), |(low, high), e| (low.min(e), high.max(e)));
    if high <= 0.0 || !failing.contains(&true) {
        return Panel::new(x, y);
    }
    let (bottom, top) = y.range.unwrap_or((low / 1.5, 1.5 * high));
    y = y.range(bottom, top);
    let cells = place.edges.windows(2).zip(failing).flat_map(|(edges, fails)| {
        let edge = |x: f64| if *fails { (x, bottom, top) } else { (x, f64::NAN, f64::NAN) };
        [edge(edges[0]), edge(edges[1])]
    });
    Panel::new(x, y).with(Layer::band(&format!("hollow: {NO_ANSWER}{which}"), Style::Black, cells))
}

/// The same of points of which some fail: those are hollow, and gaps of the line.
fn with_hollow(panel: Panel, label: &str, points: &[Point], style: Style, line: bool) -> Panel {
    let kept = |(bar, fails): &Point| if *fails { (bar.0, f64::NAN, f64::NAN, f64::NAN) } else { *bar };
    let panel = with_bars(panel, label, points.iter().map(kept).collect(), style, line);
    let hollow = points.iter().filter(|(bar, fails)| *fails && bar.1.is_finite()).map(|(bar, _)| *bar);
    let hollow: Bars = hollow.collect();
    if hollow.is_empty() { panel } else { panel.with(Layer::hollow(label, style, hollow)) }
}

/// A line through numbers, none between names, and the intervals in front.
pub(super) fn with_bars(panel: Panel, label: &str, bars: Bars, style: Style, line: bool) -> Panel {
    let points = bars.iter().map(|bar| (bar.0, bar.1));
    let panel = if line { panel.with(Layer::line(label, style, points)) } else { panel };
    panel.with(Layer::error_bars(label, style, bars))
}

/// An axis for probabilities in per cent.
pub(super) fn probability_axis(label: &str) -> Axis {
    Axis::new(format!("{label} (%)")).log10()
}
