//! The ranges that automatic axes get from the data.

use super::axis::{around, usable};
use super::backend::Point;
use super::{AxisScale, Layer, Panel};

/// Returns the points `(x, y)` of a layer's data that can be shown in the panel; rules and strips are not data.
fn data(panel: &Panel, layer: &Layer) -> impl Iterator<Item = Point> {
    let all: Vec<Point> = match layer {
        Layer::Line { points, .. }
        | Layer::Steps { points, .. }
        | Layer::Points { points, .. }
        | Layer::UpperLimits { points, .. } => points.clone(),
        Layer::Band { points, .. } => {
            let whole = points.iter().filter(|p| p.1.is_finite() && p.2.is_finite());
            whole.flat_map(|&(x, a, b)| [(x, a), (x, b)]).collect()
        }
        // A marker without whiskers counts, whiskers without a marker too.
        Layer::ErrorBars { points, .. } | Layer::Hollow { points, .. } => {
            points.iter().flat_map(|&(x, y, a, b)| [(x, y), (x, a), (x, b)]).collect()
        }
        Layer::Lanes { lanes, .. } => {
            let spans = lanes.iter().flat_map(|lane| &lane.spans);
            spans.flat_map(|&(from, to, _)| [(from, 1.0), (to, 1.0)]).collect()
        }
        // Cells without a value show where there could be one.
        Layer::Heat { x_edges, y_edges, .. } => {
            x_edges.iter().flat_map(|&x| y_edges.iter().map(move |&y| (x, y))).collect()
        }
        Layer::Hatched { .. } | Layer::HorizontalRule { .. } | Layer::VerticalRule { .. } => Vec::new(),
    };
    let (x, y) = (panel.x.scale, panel.y.scale);
    all.into_iter().filter(move |p| x.has(p.0) && y.has(p.1))
}

/// Returns the least and the greatest of the values that have a place.
pub(super) fn span(scale: AxisScale, values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.filter(|value| scale.has(*value)).fold(None, |found, value| {
        Some(found.map_or((value, value), |(a, b): (f64, f64)| (a.min(value), b.max(value))))
    })
}

/// Returns whether a panel has anything to show besides rules.
pub(super) fn has_data(panel: &Panel) -> bool {
    panel.layers.iter().any(|layer| match layer {
        // Cells without a value are hatched: that is an answer.
        Layer::Heat { values, .. } => !values.is_empty(),
        _ => data(panel, layer).next().is_some(),
    })
}

/// Returns the horizontal range that panels with the same axis share.
pub(super) fn horizontal(panels: &[Panel]) -> (f64, f64) {
    let Some(first) = panels.first() else { return (0.0, 1.0) };
    let layers = || panels.iter().flat_map(|panel| panel.layers.iter().map(move |layer| (panel, layer)));
    let places = layers().flat_map(|(panel, layer)| {
        let rule = if let Layer::VerticalRule { x, .. } = layer { Some(*x) } else { None };
        data(panel, layer).map(|p| p.0).chain(rule)
    });
    // Half a marker would be outside the frame.
    let has_markers = layers().any(|(_, layer)| {
        use Layer::{ErrorBars, Hollow, Points, UpperLimits};
        matches!(layer, Points { .. } | ErrorBars { .. } | Hollow { .. } | UpperLimits { .. })
    });
    let margin = if has_markers { 0.03 } else { 0.0 };
    usable(&first.x).unwrap_or_else(|| around(first.x.scale, span(first.x.scale, places), margin))
}

/// Returns the vertical range of a panel of which `shown` is the horizontal one.
pub(super) fn vertical(panel: &Panel, shown: (f64, f64)) -> (f64, f64) {
    let lanes = panel.layers.iter().filter_map(|layer| match layer {
        Layer::Lanes { lanes, .. } => Some(lanes.len()),
        _ => None,
    });
    if let Some(count) = lanes.max() {
        return (0.0, count.max(1) as f64);
    }
    let places = panel.layers.iter().flat_map(|layer| {
        let rule = if let Layer::HorizontalRule { y, .. } = layer { Some(*y) } else { None };
        let seen = data(panel, layer).filter(|p| (shown.0..=shown.1).contains(&p.0));
        seen.map(|p| p.1).chain(rule)
    });
    let is_rule = |layer: &Layer| matches!(layer, Layer::HorizontalRule { .. } | Layer::VerticalRule { .. });
    let is_cells = |layer: &Layer| matches!(layer, Layer::Heat { .. });
    let cells_alone = panel.has_cells() && panel.layers.iter().all(|layer| is_rule(layer) || is_cells(layer));
    let margin = if cells_alone { 0.0 } else { 0.06 };
    usable(&panel.y).unwrap_or_else(|| around(panel.y.scale, span(panel.y.scale, places), margin))
}
