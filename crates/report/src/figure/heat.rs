//! Heat maps: their cells and their colour bar.

use super::axis::{Axis, AxisScale, Scale, around, usable};
use super::backend::{Drawn, Rect, Sheet, px};
use super::chart::{CENTRE, Chart, LABEL, LABEL_LINE, TICK, TICK_GAP, area, axes, type_of};
use super::colour::{colour, ink_on};
use super::extent::span;
use super::layers::hatch;
use super::style::{FRAME, GRID, HATCH, WHITE};
use super::{Layer, Panel, text, ticks};
use plotters::chart::ChartBuilder;
use plotters::element::{Rectangle, Text};

/// Distance between panel and bar.
const GAP: f64 = 14.0;
/// Width of the bar.
const BAR: f64 = 16.0;
/// Above this many numbers nobody reads them.
pub(super) const MOST_NUMBERS: usize = 100;
const NUMBER: f64 = 12.0;

/// Colour bar of a panel, drawn as a separate chart.
pub(super) struct Bar {
    scale: Scale,
    label: String,
    /// Width of its ticks and their texts, and of its label.
    widths: (f64, f64),
}

/// Returns the range of values between the first and the last colour.
pub(super) fn range(values: &[f64], axis: &Axis) -> (f64, f64) {
    usable(axis).unwrap_or_else(|| around(axis.scale, span(axis.scale, values.iter().copied()), 0.0))
}

/// Returns the bar of a panel whose height is about `height`, if it needs one.
pub(super) fn bar(panel: &Panel, height: f64) -> Option<Bar> {
    let (values, axis) = panel.layers.iter().find_map(|layer| match layer {
        Layer::Heat { values, colour, .. } => Some((values, colour)),
        _ => None,
    })?;
    if !values.iter().any(|value| axis.scale.has(*value)) {
        return None;
    }
    let range = range(values, axis);
    let ticks = ticks::vertical(axis, range, height, 120.0);
    let label = text::wrap(&axis.label, LABEL, height);
    let numbers = TICK + TICK_GAP + ticks.iter().map(ticks::text_width).fold(0.0, f64::max);
    let lines = if label.is_empty() { 0.0 } else { 6.0 + label.len() as f64 * LABEL_LINE };
    let scale = Scale { ticks, ..Scale::new(range, axis.scale) };
    Some(Bar { scale, label: label.join("\n"), widths: (numbers, lines) })
}

impl Bar {
    /// Returns the room it takes to the right of its panel.
    pub fn width(&self) -> f64 {
        GAP + BAR + self.widths.0 + self.widths.1
    }

    /// Draws the colour bar beside a panel, in the space right of `left`.
    pub fn draw(self, figure: &Sheet, left: f64, panel: Rect) -> Drawn {
        /// Steps too fine to be seen.
        const STEPS: u32 = 128;
        let room = (px(self.width() - GAP), px(panel.height()));
        let sheet = figure.clone().shrink((px(left + GAP), px(panel.top)), room);
        let beside = px(self.widths.0 + self.widths.1);
        let Self { scale, label, .. } = self;
        let across = Scale::new((0.0, 1.0), AxisScale::Linear);
        let mut chart =
            ChartBuilder::on(&sheet).right_y_label_area_size(beside).build_cartesian_2d(across, scale)?;
        let within = area(&chart);
        for step in 0..STEPS {
            // Each reaches below the next, so that no seam shows between them.
            let share = f64::from(step) / f64::from(STEPS);
            let strip = Rect { top: within.top + share * within.height(), ..within };
            let ground = colour(1.0 - share - 0.5 / f64::from(STEPS));
            figure.draw(&Rectangle::new(strip.corners(), ground.fill()))?;
        }
        figure.draw(&Rectangle::new(within.corners(), FRAME.stroke(1.0)))?;
        axes(&mut chart, "", &label)
    }
}

/// Returns the legend of cells without a value, if a layer has such cells.
pub(super) fn blanks(layer: &Layer) -> Option<&str> {
    let Layer::Heat { x_edges, y_edges, values, blank, .. } = layer else { return None };
    let cells = x_edges.len().saturating_sub(1) * y_edges.len().saturating_sub(1);
    let any = values.len() < cells || values.iter().take(cells).any(|value| !value.is_finite());
    any.then_some(blank)
}

pub(super) fn draw(chart: &Chart, layer: &Layer) -> Drawn {
    let Layer::Heat { x_edges, y_edges, values: all, colour: axis, texts, .. } = layer else { return Ok(()) };
    let (within, spec) = (area(chart), chart.as_coord_spec());
    let sheet = chart.plotting_area().use_screen_coord();
    // Cells on whole pixels have sharp edges and leave no seams.
    let places = |edges: &[f64], axis: &Scale, ends| -> Vec<f64> {
        edges.iter().map(|edge| axis.at(edge.clamp(axis.range.0, axis.range.1), ends).round()).collect()
    };
    let columns = places(x_edges, spec.x_spec(), (within.left, within.right));
    let rows = places(y_edges, spec.y_spec(), (within.bottom, within.top));
    let areas = rows
        .windows(2)
        .flat_map(|y| columns.windows(2).map(|x| Rect { left: x[0], right: x[1], top: y[1], bottom: y[0] }));
    let values = all.iter().copied().chain(std::iter::repeat(f64::NAN));
    let texts = texts.iter().map(String::as_str).chain(std::iter::repeat(""));
    let mut cells: Vec<(Rect, f64, &str)> =
        areas.zip(values).zip(texts).map(|((a, v), t)| (a, v, t)).collect();
    // Edges that are no numbers have no cell.
    cells.retain(|(area, ..)| area.width() > 0.0 && area.height() > 0.0);

    let scale = Scale::new(range(all, axis), axis.scale);
    let ground = |value| colour(if axis.scale.has(value) { scale.at(value, (0.0, 1e4)) / 1e4 } else { 0.0 });
    for &(area, value, _) in &cells {
        if value.is_finite() {
            sheet.draw(&Rectangle::new(area.corners(), ground(value).fill()))?;
        } else {
            blank(&sheet, area)?;
        }
    }
    let count = cells.len();
    cells.retain(|(_, value, text)| value.is_finite() && !text.is_empty());
    let fits = |(area, _, text): &(Rect, f64, &str)| {
        area.height() >= NUMBER + 3.0 && area.width() >= text::width(text, NUMBER) + 4.0
    };
    if count <= MOST_NUMBERS && cells.iter().all(fits) {
        for (area, value, text) in cells {
            let (x, y) = area.centre();
            let set = type_of(NUMBER, ink_on(ground(value))).pos(CENTRE);
            sheet.draw(&Text::new(text, (px(x), px(y)), set))?;
        }
    }
    Ok(())
}

/// Returns a cell without a value: white and hatched, as no value is.
pub(super) fn blank(sheet: &Sheet, area: Rect) -> Drawn {
    sheet.draw(&Rectangle::new(area.corners(), WHITE.fill()))?;
    hatch(sheet, area, (-1.0, 5.0), HATCH, 0.75)?;
    sheet.draw(&Rectangle::new(area.corners(), GRID.stroke(0.5)))
}

/// Returns the edges of cells around these increasing centres: half way between neighbours, on a logarithmic axis at
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
