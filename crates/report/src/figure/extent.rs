//! The ranges that automatic axes get from the data.

use super::axis::{around, usable};
use super::{Layer, Panel};

/// Calls `each` with `(x, lowest y, highest y)` of all data of a layer that are numbers; rules are not data.
fn each_datum(layer: &Layer, mut each: impl FnMut(f64, f64, f64)) {
    let mut datum = |x: f64, low: f64, high: f64| {
        if x.is_finite() && low.is_finite() && high.is_finite() {
            each(x, low, high);
        }
    };
    match layer {
        Layer::Line { points, .. } | Layer::Steps { points, .. } | Layer::Points { points, .. } => {
            for &(x, y) in points {
                datum(x, y, y);
            }
        }
        Layer::Band { points, .. } => {
            for &(x, a, b) in points {
                datum(x, a.min(b), a.max(b));
            }
        }
        Layer::ErrorBars { points, .. } => {
            // `min` and `max` ignore a NaN: a marker without whiskers counts, whiskers without a marker too.
            for &(x, y, a, b) in points {
                datum(x, y.min(a).min(b), y.max(a).max(b));
            }
        }
        Layer::Lanes { lanes, .. } => {
            let count = lanes.len() as f64;
            for &(from, to, _) in lanes.iter().flat_map(|lane| &lane.spans) {
                datum(from, 0.0, count);
                datum(to, 0.0, count);
            }
        }
        Layer::HorizontalRule { .. } | Layer::VerticalRule { .. } => (),
    }
}

fn widen(extent: &mut Option<(f64, f64)>, low: f64, high: f64) {
    if low.is_finite() && high.is_finite() {
        *extent = Some(extent.map_or((low, high), |(a, b)| (a.min(low), b.max(high))));
    }
}

/// Whether a panel has anything to show besides rules.
pub(super) fn has_data(panel: &Panel) -> bool {
    let mut any = false;
    panel.layers.iter().for_each(|layer| each_datum(layer, |_, _, _| any = true));
    any
}

/// The horizontal range that panels with the same axis share.
pub(super) fn horizontal(panels: &[&Panel]) -> (f64, f64) {
    if let Some(range) = panels.first().and_then(|panel| usable(panel.x.range)) {
        return range;
    }
    let mut extent = None;
    let mut margin = 0.0;
    for layer in panels.iter().flat_map(|panel| &panel.layers) {
        each_datum(layer, |x, _, _| widen(&mut extent, x, x));
        match layer {
            Layer::VerticalRule { x, .. } => widen(&mut extent, *x, *x),
            // Half a marker would be outside the frame.
            Layer::Points { .. } | Layer::ErrorBars { .. } => margin = 0.03,
            _ => (),
        }
    }
    around(extent, margin)
}

/// The vertical range of a panel of which `shown` is the horizontal one.
pub(super) fn vertical(panel: &Panel, shown: (f64, f64)) -> (f64, f64) {
    let lanes = panel.layers.iter().filter_map(|layer| match layer {
        Layer::Lanes { lanes, .. } => Some(lanes.len()),
        _ => None,
    });
    if let Some(count) = lanes.max() {
        return (0.0, count.max(1) as f64);
    }
    if let Some(range) = usable(panel.y.range) {
        return range;
    }
    let mut extent = None;
    for layer in &panel.layers {
        each_datum(layer, |x, low, high| {
            if (shown.0..=shown.1).contains(&x) {
                widen(&mut extent, low, high);
            }
        });
        if let Layer::HorizontalRule { y, .. } = layer {
            widen(&mut extent, *y, *y);
        }
    }
    around(extent, 0.06)
}
