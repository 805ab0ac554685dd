//! Errors over one axis.

use super::place::{Series, error_axis, place, series};
use super::{Caption, Interval, Pooled, Study, WIDTH, pool};
use crate::figure::{Axis, Figure, Layer, Panel, Style};

type Value = fn(&Pooled) -> Interval;
type Bars = Vec<(f64, f64, f64, f64)>;

/// Rms error and 95th percentile over an axis of the study, with their intervals.
///
/// Other axes with few values become series, as long as these are six at most; the rest is pooled, which leaves only
/// the rms error. The errors' axis is logarithmic where they span more than a factor of five.
///
/// # Panics
///
/// If the study has no axis with this index.
pub fn sweep(caption: &Caption, study: &Study, axis: usize) -> Figure {
    let place = place(study, axis, false);
    let (series, remarks) = series(study, &[axis]);
    let found: Vec<Vec<Pooled>> = series
        .iter()
        .map(|series| {
            let of = |value| {
                let mut wanted = vec![(axis, value)];
                wanted.extend(series.fixed.iter().map(|(axis, value)| (*axis, value)));
                pool(study, &super::pool::at(study, &wanted))
            };
            place.values.iter().map(of).collect()
        })
        .collect();
    let bars = |series: &Series, of: &[Pooled], value: Value| -> Bars {
        let shift = if place.named { series.shift } else { 0.0 };
        place
            .at
            .iter()
            .zip(of)
            .map(|(x, p)| (x + shift, value(p)))
            .map(|(x, i)| (x, i.value, i.low, i.high))
            .collect()
    };
    let rms = |p: &Pooled| p.rms_deg;
    let p95 = |p: &Pooled| p.p95_deg;
    let all = |value: Value| {
        found.iter().flatten().flat_map(move |p| [value(p).value, value(p).high]).collect::<Vec<_>>()
    };
    let has_p95 = all(p95).iter().any(|value| value.is_finite());
    let lines = !place.named;
    let x = || place.axis.clone();
    let mut panels = Vec::new();
    if let ([one], [only]) = (&series[..], &found[..]) {
        let values = all(rms).into_iter().chain(all(p95));
        let mut panel = Panel::new(x(), error_axis("error of the axis (°)", values));
        panel = layers(panel, "rms", bars(one, only, rms), Style::Blue, lines);
        if has_p95 {
            panel = layers(panel, "95th percentile of |e|", bars(one, only, p95), Style::Vermilion, lines);
        }
        panels.push(panel);
    } else {
        let kinds: [(&str, Value); 2] =
            [("rms error of the axis (°)", rms), ("95th percentile of |e| (°)", p95)];
        for (label, value) in kinds.into_iter().take(1 + usize::from(has_p95)) {
            let mut panel = Panel::new(x(), error_axis(label, all(value).into_iter()));
            for (series, found) in series.iter().zip(&found) {
                panel = layers(panel, &series.label, bars(series, found, value), series.style, lines);
            }
            panel.legend = panels.is_empty();
            panels.push(panel);
        }
    }
    Figure {
        title: caption.title.clone(),
        subtitle: Study::remarked(caption, &remarks),
        width: WIDTH,
        height: if panels.len() == 1 { 480 } else { 760 },
        panels,
    }
}

/// A line through numbers, none between names, and the intervals in front.
fn layers(panel: Panel, label: &str, bars: Bars, style: Style, line: bool) -> Panel {
    let label = Some(label.to_owned());
    let panel = if line {
        let points = bars.iter().map(|bar| (bar.0, bar.1)).collect();
        panel.with(Layer::Line { label: label.clone(), points, style })
    } else {
        panel
    };
    panel.with(Layer::ErrorBars { label, points: bars, style })
}

/// An axis for probabilities in per cent.
pub(super) fn probability_axis(label: &str) -> Axis {
    Axis::new(format!("{label} (%)")).log10()
}
