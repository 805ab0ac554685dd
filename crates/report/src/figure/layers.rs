//! Drawing the layers of a panel.

use super::axis::Scale;
use super::canvas::{Canvas, Point, Rect};
use super::reduce::{clip_line, clip_polygon, dash, length, runs, thin};
use super::style::{FRAME, Hatch, LINE_WIDTH, MARKER_RADIUS, Marker, QUIET, RULE_DASHES, Style, faded, fill};
use super::{FigureError, Lane, Layer, heat};
use plotters::backend::DrawingBackend;
use plotters::style::RGBAColor;
use std::collections::HashMap;

/// Columns in which a long line is thinned: the pixels of a PNG.
pub(super) const COLUMN: f64 = 0.5;
/// A line this many times longer than its panel is wide goes up and down too densely for dashes to show.
const DENSE: f64 = 15.0;
/// This many translucent markers on one spot are opaque; further ones change nothing.
const PILE: u32 = 10;
pub(super) const BAND_OPACITY: f64 = 0.25;

type Drawn = Result<(), FigureError>;

/// The plotting area and its axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plot {
    pub area: Rect,
    pub x: Scale,
    pub y: Scale,
}

impl Plot {
    fn point(&self, (x, y): Point) -> Point {
        (self.x.at(x), self.y.at(y))
    }
}

pub(super) fn draw<B: DrawingBackend>(canvas: &mut Canvas<B>, plot: &Plot, layer: &Layer) -> Drawn {
    match layer {
        Layer::Line { points, style, .. } => line(canvas, plot, points.iter().copied(), *style),
        Layer::Steps { points, style, .. } => line(canvas, plot, held(points), *style),
        Layer::Points { points, style, .. } => markers(canvas, plot, points, *style),
        Layer::Band { points, style, .. } => band(canvas, plot, points, *style),
        Layer::ErrorBars { points, style, .. } => error_bars(canvas, plot, points, *style),
        Layer::UpperLimits { points, style, .. } => upper_limits(canvas, plot, points, *style),
        Layer::Heat { x_edges, y_edges, values, colour, numbers } => {
            heat::draw(canvas, plot, (x_edges, y_edges), values, colour, *numbers)
        }
        Layer::HorizontalRule { y, .. } if !plot.y.shows(*y) => Ok(()),
        Layer::VerticalRule { x, .. } if !plot.x.shows(*x) => Ok(()),
        Layer::HorizontalRule { y, .. } => {
            let at = plot.y.at(*y);
            stroke(canvas, plot, &[(plot.area.left, at), (plot.area.right, at)], QUIET, 1.0, RULE_DASHES)
        }
        Layer::VerticalRule { x, .. } => {
            let at = plot.x.at(*x);
            stroke(canvas, plot, &[(at, plot.area.bottom), (at, plot.area.top)], QUIET, 1.0, RULE_DASHES)
        }
        Layer::Lanes { lanes, categories } => draw_lanes(canvas, plot, lanes, categories.len()),
    }
}

/// The corners of a staircase through the points.
fn held(points: &[Point]) -> impl Iterator<Item = Point> {
    let corners = points.windows(2).flat_map(|pair| [pair[0], (pair[1].0, pair[0].1)]);
    corners.chain(points.last().copied())
}

fn line<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    plot: &Plot,
    points: impl Iterator<Item = Point>,
    style: Style,
) -> Drawn {
    for run in runs(points.map(|p| plot.point(p))) {
        if let [lone] = run[..] {
            // Between two gaps there is no line to draw, but there is a value.
            if plot.area.contains(lone) {
                canvas.disc(lone, LINE_WIDTH, style.colour())?;
            }
        } else {
            stroke(canvas, plot, &thin(&run, COLUMN), style.colour(), LINE_WIDTH, style.dashes())?;
        }
    }
    Ok(())
}

fn stroke<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    plot: &Plot,
    points: &[Point],
    colour: RGBAColor,
    width: f64,
    dashes: &[f64],
) -> Drawn {
    for part in clip_line(points, plot.area) {
        let dense = length(&part) > DENSE * plot.area.width();
        let strokes = if dashes.is_empty() || dense { vec![part] } else { dash(&part, dashes, COLUMN) };
        for points in strokes {
            canvas.path(&points, colour, width)?;
        }
    }
    Ok(())
}

fn markers<B: DrawingBackend>(canvas: &mut Canvas<B>, plot: &Plot, points: &[Point], style: Style) -> Drawn {
    let (radius, opacity) = match points.len() {
        0..=200 => (MARKER_RADIUS, 1.0),
        201..=1000 => (2.0, 0.7),
        _ => (1.25, 0.4),
    };
    let mut piled: HashMap<(i64, i64), u32> = HashMap::new();
    for &point in points {
        let at = plot.point(point);
        if !plot.area.contains(at) {
            continue;
        }
        if radius == MARKER_RADIUS {
            draw_marker(canvas, style, at, radius)?;
            continue;
        }
        #[expect(clippy::cast_possible_truncation, reason = "a place inside the figure")]
        let spot = ((at.0 * 2.0) as i64, (at.1 * 2.0) as i64);
        let pile = piled.entry(spot).or_default();
        *pile += 1;
        if *pile <= PILE {
            canvas.disc(at, radius, faded(style.colour(), opacity))?;
        }
    }
    Ok(())
}

pub(super) fn draw_marker<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    style: Style,
    (x, y): Point,
    radius: f64,
) -> Drawn {
    let colour = style.colour();
    let corners = |offsets: &[Point]| -> Vec<Point> {
        offsets.iter().map(|(dx, dy)| (x + dx * radius, y + dy * radius)).collect()
    };
    // The second point again closes the last corner, too.
    let mut open = |offsets: &[Point]| canvas.path(&corners(offsets), colour, 1.4);
    match style.marker() {
        Marker::Disc => canvas.disc((x, y), radius, colour),
        Marker::Square => {
            open(&[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9), (-0.9, -0.9), (0.9, -0.9)])
        }
        Marker::Diamond => open(&[(0.0, -1.2), (1.2, 0.0), (0.0, 1.2), (-1.2, 0.0), (0.0, -1.2), (1.2, 0.0)]),
        Marker::Cross => {
            open(&[(-0.9, -0.9), (0.9, 0.9)])?;
            open(&[(-0.9, 0.9), (0.9, -0.9)])
        }
        Marker::Plus => {
            open(&[(-1.2, 0.0), (1.2, 0.0)])?;
            open(&[(0.0, -1.2), (0.0, 1.2)])
        }
        Marker::Triangle => canvas.polygon(&corners(&[(0.0, -1.25), (1.15, 0.8), (-1.15, 0.8)]), colour),
    }
}

fn band<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    plot: &Plot,
    points: &[(f64, f64, f64)],
    style: Style,
) -> Drawn {
    let usable = |(x, a, b): &(f64, f64, f64)| x.is_finite() && a.is_finite() && b.is_finite();
    for run in points.chunk_by(|a, b| usable(a) == usable(b)).filter(|run| usable(&run[0])) {
        let edge = |y: fn(&(f64, f64, f64)) -> f64| -> Vec<Point> {
            let all = runs(run.iter().map(|p| (plot.x.at(p.0), plot.y.end_at(y(p)))));
            all.iter().flat_map(|part| thin(part, COLUMN)).collect()
        };
        let (mut corners, upper) = (edge(|p| p.1), edge(|p| p.2));
        // Thin edges keep the band visible between dense markers and in grey.
        for side in [&corners, &upper] {
            stroke(canvas, plot, side, faded(style.colour(), 0.8), 0.75, &[])?;
        }
        corners.extend(upper.into_iter().rev());
        let visible = clip_polygon(&corners, plot.area);
        if visible.len() > 2 {
            canvas.polygon(&visible, faded(style.colour(), BAND_OPACITY))?;
        }
    }
    Ok(())
}

fn error_bars<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    plot: &Plot,
    points: &[(f64, f64, f64, f64)],
    style: Style,
) -> Drawn {
    const CAP: f64 = 3.5;
    for &(x, y, lower, upper) in points {
        let at = plot.x.at(x);
        // False for a NaN, too.
        if !plot.x.shows(x) {
            continue;
        }
        if lower.is_finite() && upper.is_finite() {
            let (low, high) = (plot.y.end_at(lower), plot.y.end_at(upper));
            for bar in [
                [(at, low), (at, high)],
                [(at - CAP, low), (at + CAP, low)],
                [(at - CAP, high), (at + CAP, high)],
            ] {
                stroke(canvas, plot, &bar, style.colour(), 1.2, &[])?;
            }
        }
        if plot.y.shows(y) {
            draw_marker(canvas, style, (at, plot.y.at(y)), MARKER_RADIUS)?;
        }
    }
    Ok(())
}

fn upper_limits<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    plot: &Plot,
    points: &[Point],
    style: Style,
) -> Drawn {
    for &(x, y) in points {
        if plot.x.shows(x) && plot.y.shows(y) {
            draw_upper_limit(canvas, style, plot.point((x, y)), Some(plot.area))?;
        }
    }
    Ok(())
}

/// A bar, and an arrow from it downwards: the value is somewhere below.
pub(super) fn draw_upper_limit<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    style: Style,
    (x, y): Point,
    within: Option<Rect>,
) -> Drawn {
    const LONG: f64 = 13.0;
    let colour = style.colour();
    // At the lower edge there is less room.
    let tip = within.map_or(y + LONG, |area| (y + LONG).min(area.bottom));
    canvas.path(&[(x - 5.0, y), (x + 5.0, y)], colour, 1.6)?;
    if tip - y > 5.0 {
        canvas.path(&[(x, y), (x, tip - 4.0)], colour, 1.2)?;
        canvas.polygon(&[(x, tip), (x - 3.6, tip - 6.0), (x + 3.6, tip - 6.0)], colour)?;
    }
    Ok(())
}

fn draw_lanes<B: DrawingBackend>(
    canvas: &mut Canvas<B>,
    plot: &Plot,
    lanes: &[Lane],
    categories: usize,
) -> Drawn {
    let slot = plot.area.height() / lanes.len().max(1) as f64;
    for (index, lane) in lanes.iter().enumerate() {
        let top = plot.area.top + (index as f64 + 0.14) * slot;
        let strip = Rect { top, bottom: top + 0.72 * slot, ..plot.area };
        for (left, right, category) in visible_spans(plot, lane, categories) {
            draw_fill(canvas, category, Rect { left, right, ..strip })?;
        }
        canvas.outline(strip, FRAME, 0.75)?;
    }
    Ok(())
}

/// The spans of a lane in pixels, where the longest in a column stands for the shorter ones in it.
fn visible_spans(plot: &Plot, lane: &Lane, categories: usize) -> Vec<(f64, f64, usize)> {
    const PER_PIXEL: f64 = 8.0;
    let area = plot.area;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "inside the figure")]
    let index = |x: f64| ((x - area.left) * PER_PIXEL).max(0.0) as usize;
    let mut columns = vec![(0.0, None); index(area.right) + 1];
    for &(from, to, category) in &lane.spans {
        let (from, to) = (plot.x.end_at(from).max(area.left), plot.x.end_at(to).min(area.right));
        // Written so that a NaN is skipped.
        if !(from < to && category < categories) {
            continue;
        }
        for (offset, column) in columns[index(from)..=index(to)].iter_mut().enumerate() {
            let start = area.left + (index(from) + offset) as f64 / PER_PIXEL;
            let covered = to.min(start + 1.0 / PER_PIXEL) - from.max(start);
            if covered > column.0 {
                *column = (covered, Some(category));
            }
        }
    }
    let mut spans = Vec::new();
    let mut start = 0;
    for run in columns.chunk_by(|a, b| a.1 == b.1) {
        let end = start + run.len();
        if let Some(category) = run[0].1 {
            let x = |column: usize| (area.left + column as f64 / PER_PIXEL).min(area.right);
            spans.push((x(start), x(end), category));
        }
        start = end;
    }
    spans
}

/// Fills a rectangle in the manner of a category.
pub(super) fn draw_fill<B: DrawingBackend>(canvas: &mut Canvas<B>, category: usize, area: Rect) -> Drawn {
    const SPACING: f64 = 6.0;
    let look = fill(category);
    canvas.rect(area, look.ground)?;
    let slope = match look.hatch {
        Hatch::None => return Ok(()),
        Hatch::Right => -1.0,
        Hatch::Left => 1.0,
    };
    // On multiples of the spacing from the figure's corner, so that neighbours continue each other's lines.
    let tall = area.height();
    let start = ((area.left - slope * area.top).min(area.left - slope * area.bottom) / SPACING).floor();
    let mut offset = start * SPACING;
    while offset < area.right + area.bottom + tall {
        let at = |y: f64| (offset + slope * y, y);
        for part in clip_line(&[at(area.top), at(area.bottom)], area) {
            canvas.path(&part, look.line, 1.0)?;
        }
        offset += SPACING;
    }
    Ok(())
}
