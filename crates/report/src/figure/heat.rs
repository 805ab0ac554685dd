//! Heat maps: their cells and their colour bar.

use super::axis::{Axis, AxisScale, Scale, Tick, around_on, usable};
use super::canvas::{Align, Canvas, Rect, Type};
use super::colour::{colour, ink_on};
use super::frame::draw_upwards;
use super::layers::Plot;
use super::layout::{LABEL, LABEL_LINE, SMALL, TICK, TICK_GAP};
use super::reduce::hatching;
use super::style::{FRAME, GRID, HATCH, INK, WHITE};
use super::{Layer, Panel, text, ticks};

/// Between panel and bar, and the width of the bar.
const GAP: f64 = 14.0;
const BAR: f64 = 16.0;
/// Above this many numbers nobody reads them.
pub(super) const MOST_NUMBERS: usize = 100;
const NUMBER: f64 = 12.0;

/// The colour bar of a panel.
pub(super) struct Bar {
    /// Where its room begins; top and bottom are those of the panel.
    left: f64,
    scale: Scale,
    ticks: Vec<Tick>,
    label: Vec<String>,
}

/// The range of values between the first and the last colour.
pub(super) fn range(values: &[f64], axis: &Axis) -> (f64, f64) {
    usable(axis).unwrap_or_else(|| {
        let shown = values.iter().copied().filter(|value| axis.scale.has(*value));
        let extent = shown.fold(None, |extent: Option<(f64, f64)>, v| {
            Some(extent.map_or((v, v), |(a, b)| (a.min(v), b.max(v))))
        });
        around_on(axis.scale, extent, 0.0)
    })
}

/// The bar of a panel whose height is about `height`, if it needs one.
pub(super) fn bar(panel: &Panel, height: f64) -> Option<Bar> {
    let (values, axis) = panel.layers.iter().find_map(|layer| match layer {
        Layer::Heat { values, colour, .. } => Some((values, colour)),
        _ => None,
    })?;
    if !values.iter().any(|value| axis.scale.has(*value)) {
        return None;
    }
    let range = range(values, axis);
    let scale = Scale { range, pixels: (0.0, 0.0), spread: axis.scale };
    Some(Bar {
        left: 0.0,
        scale,
        ticks: ticks::along(axis, range, height, 120.0),
        label: text::wrap(&axis.label, LABEL, height),
    })
}

impl Bar {
    /// The same with the room to the right of `left`.
    pub fn placed(self, left: f64) -> Self {
        Self { left, ..self }
    }

    /// The room it takes to the right of its panel.
    pub fn width(&self) -> f64 {
        let label = if self.label.is_empty() { 0.0 } else { 6.0 + self.label.len() as f64 * LABEL_LINE };
        GAP + BAR + self.ticks_width() + label
    }

    fn ticks_width(&self) -> f64 {
        TICK + TICK_GAP + self.ticks.iter().map(ticks::text_width).fold(0.0, f64::max)
    }

    /// Draws it beside a panel.
    pub fn draw(&self, canvas: &mut dyn Canvas, panel: Rect) {
        /// Steps that no eye tells apart.
        const STEPS: u32 = 128;
        let left = self.left + GAP;
        let area = Rect { left, right: left + BAR, ..panel };
        let step = area.height() / f64::from(STEPS);
        for i in 0..STEPS {
            // Each reaches below the next, so that no seam shows between them.
            let bottom = area.bottom;
            let top = area.top + f64::from(i) * step;
            let share = 1.0 - (f64::from(i) + 0.5) / f64::from(STEPS);
            canvas.rect(Rect { top, bottom, ..area }, colour(share));
        }
        canvas.outline(area, FRAME, 1.0);
        let scale = Scale { pixels: (area.bottom, area.top), ..self.scale };
        let set = Type { size: SMALL, colour: INK, align: Align::Start, upwards: false };
        for tick in &self.ticks {
            let y = scale.at(tick.at);
            canvas.path(&[(area.right, y), (area.right + tick.mark(), y)], FRAME, 1.0);
            canvas.lines(&tick.text, (area.right + TICK + TICK_GAP, y), set);
        }
        draw_upwards(canvas, &self.label, (area.right + self.ticks_width() + 6.0, area.centre().1));
    }
}

/// What cells without a value mean, if a layer has such cells.
pub(super) fn blanks(layer: &Layer) -> Option<&str> {
    let Layer::Heat { x_edges, y_edges, values, blank, .. } = layer else { return None };
    let cells = x_edges.len().saturating_sub(1) * y_edges.len().saturating_sub(1);
    let any = values.len() < cells || values.iter().take(cells).any(|value| !value.is_finite());
    any.then_some(blank)
}

pub(super) fn draw(
    canvas: &mut dyn Canvas,
    plot: &Plot,
    (x_edges, y_edges): (&[f64], &[f64]),
    values: &[f64],
    axis: &Axis,
    texts: &[String],
) {
    let scale = Scale { range: range(values, axis), pixels: (0.0, 1.0), spread: axis.scale };
    // Cells on whole pixels have sharp edges and leave no seams.
    let places = |edges: &[f64], along: &Scale, low: f64, high: f64| -> Vec<f64> {
        edges.iter().map(|edge| along.end_at(*edge).clamp(low, high).round()).collect()
    };
    let (xs, ys) = (
        places(x_edges, &plot.x, plot.area.left, plot.area.right),
        places(y_edges, &plot.y, plot.area.top, plot.area.bottom),
    );
    let columns = xs.len().saturating_sub(1);
    let mut cells = Vec::new();
    for (row, y) in ys.windows(2).enumerate() {
        for (column, x) in xs.windows(2).enumerate() {
            let area = Rect {
                left: x[0].min(x[1]),
                right: x[0].max(x[1]),
                top: y[0].min(y[1]),
                bottom: y[0].max(y[1]),
            };
            // Written so that edges that are no numbers have no cell.
            if area.width() > 0.0 && area.height() > 0.0 {
                let place = row * columns + column;
                let text = texts.get(place).map_or("", String::as_str);
                cells.push((area, values.get(place).copied().unwrap_or(f64::NAN), text));
            }
        }
    }
    let ground = |value: f64| colour(if axis.scale.has(value) { scale.share(value) } else { 0.0 });
    for &(area, value, _) in &cells {
        if value.is_finite() {
            canvas.rect(area, ground(value));
        } else {
            blank(canvas, area);
        }
    }
    let written: Vec<_> =
        cells.iter().copied().filter(|(_, value, text)| value.is_finite() && !text.is_empty()).collect();
    let fits = |(area, _, text): &(Rect, f64, &str)| {
        area.height() >= NUMBER + 3.0 && area.width() >= text::width(text, NUMBER) + 4.0
    };
    if cells.len() <= MOST_NUMBERS && written.iter().all(fits) {
        for (area, value, text) in written {
            let colour = ink_on(ground(value));
            let set = Type { size: NUMBER, colour, align: Align::Middle, upwards: false };
            canvas.lines(text, area.centre(), set);
        }
    }
}

/// A cell without a value: white and hatched, as no value is.
pub(super) fn blank(canvas: &mut dyn Canvas, area: Rect) {
    canvas.rect(area, WHITE);
    canvas.strokes(&hatching(area, -1.0, 5.0), HATCH, 0.75);
    canvas.outline(area, GRID, 0.5);
}

/// The edges of cells around these increasing centres: half way between neighbours, on a logarithmic axis at
/// their geometric mean, and as far beyond the first and the last. A single centre gets a cell of width 1, on a
/// logarithmic axis of a factor 2.
pub fn cell_edges(centres: &[f64], scale: AxisScale) -> Vec<f64> {
    let even = |value: f64| if scale == AxisScale::Log10 { value.log2() } else { value };
    let back = |value: f64| if scale == AxisScale::Log10 { value.exp2() } else { value };
    let places: Vec<f64> = centres.iter().map(|centre| even(*centre)).collect();
    let (Some(first), Some(last)) = (places.first(), places.last()) else { return Vec::new() };
    let gap = |pair: Option<&[f64]>| pair.map_or(1.0, |pair| pair[1] - pair[0]);
    let mut edges = vec![first - 0.5 * gap(places.windows(2).next())];
    edges.extend(places.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])));
    edges.push(last + 0.5 * gap(places.windows(2).next_back()));
    edges.into_iter().map(back).collect()
}
