//! The ranges that automatic axes get from the data.

use super::axis::{around_on, usable};
use super::{AxisScale, Layer, Panel};

/// Calls `each` with `(x, y)` of all data of a layer that have a place in the panel; rules and strips are not data.
fn each_datum(panel: &Panel, layer: &Layer, mut each: impl FnMut(f64, f64)) {
    let mut datum = |x: f64, y: f64| {
        if panel.x.scale.has(x) && panel.y.scale.has(y) {
            each(x, y);
        }
    };
    match layer {
        Layer::Line { points, .. }
        | Layer::Steps { points, .. }
        | Layer::Points { points, .. }
        | Layer::UpperLimits { points, .. } => {
            for &(x, y) in points {
                datum(x, y);
            }
        }
        Layer::Band { points, .. } => {
            for &(x, a, b) in points.iter().filter(|(_, a, b)| a.is_finite() && b.is_finite()) {
                datum(x, a);
                datum(x, b);
            }
        }
        Layer::ErrorBars { points, .. } | Layer::Hollow { points, .. } => {
            // A marker without whiskers counts, whiskers without a marker too.
            for &(x, y, a, b) in points {
                for end in [y, a, b] {
                    datum(x, end);
                }
            }
        }
        Layer::Lanes { lanes, .. } => {
            let count = lanes.len() as f64;
            for &(from, to, _) in lanes.iter().flat_map(|lane| &lane.spans) {
                for x in [from, to] {
                    datum(x, 0.0);
                    datum(x, count);
                }
            }
        }
        // Cells without a value show where there could be one.
        Layer::Heat { x_edges, y_edges, .. } => {
            for &x in x_edges {
                for &y in y_edges {
                    datum(x, y);
                }
            }
        }
        Layer::Hatched { .. } | Layer::HorizontalRule { .. } | Layer::VerticalRule { .. } => (),
    }
}

fn widen(extent: &mut Option<(f64, f64)>, scale: AxisScale, value: f64) {
    if scale.has(value) {
        *extent = Some(extent.map_or((value, value), |(a, b)| (a.min(value), b.max(value))));
    }
}

/// Whether a panel has anything to show besides rules.
pub(super) fn has_data(panel: &Panel) -> bool {
    let mut any = false;
    for layer in &panel.layers {
        match layer {
            // Cells without a value are hatched: that is an answer.
            Layer::Heat { values, .. } => any |= !values.is_empty(),
            _ => each_datum(panel, layer, |_, _| any = true),
        }
    }
    any
}

/// The horizontal range that panels with the same axis share.
pub(super) fn horizontal(panels: &[&Panel]) -> (f64, f64) {
    if let Some(range) = panels.first().and_then(|panel| usable(&panel.x)) {
        return range;
    }
    let mut extent = None;
    let mut margin = 0.0;
    let scale = panels.first().map_or_else(AxisScale::default, |panel| panel.x.scale);
    for (panel, layer) in panels.iter().flat_map(|panel| panel.layers.iter().map(move |layer| (panel, layer)))
    {
        each_datum(panel, layer, |x, _| widen(&mut extent, scale, x));
        match layer {
            Layer::VerticalRule { x, .. } => widen(&mut extent, scale, *x),
            // Half a marker would be outside the frame.
            Layer::Points { .. }
            | Layer::ErrorBars { .. }
            | Layer::Hollow { .. }
            | Layer::UpperLimits { .. } => margin = 0.03,
            _ => (),
        }
    }
    around_on(scale, extent, margin)
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
    if let Some(range) = usable(&panel.y) {
        return range;
    }
    let scale = panel.y.scale;
    let mut extent = None;
    let mut cells_alone = !panel.layers.is_empty();
    for layer in &panel.layers {
        each_datum(panel, layer, |x, y| {
            if (shown.0..=shown.1).contains(&x) {
                widen(&mut extent, scale, y);
            }
        });
        if let Layer::HorizontalRule { y, .. } = layer {
            widen(&mut extent, scale, *y);
        }
        cells_alone &=
            matches!(layer, Layer::Heat { .. } | Layer::HorizontalRule { .. } | Layer::VerticalRule { .. });
    }
    around_on(scale, extent, if cells_alone { 0.0 } else { 0.06 })
}
