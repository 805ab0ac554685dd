//! Drawing the layers of a panel.

use super::axis::Scale;
use super::canvas::{Canvas, Point, Rect};
use super::colour::Colour;
use super::reduce::{clip_line, clip_polygon, dash, hatching, length, runs, thin};
use super::style::{
    FRAME, HATCH, LINE_WIDTH, MARKER_RADIUS, Marker, QUIET, RING_RADIUS, RULE_DASHES, Style, WHITE, fill,
};
use super::{Lane, Layer, heat};
use std::collections::HashMap;

/// Columns in which a long line is thinned: the pixels of a PNG.
pub(super) const COLUMN: f64 = 0.5;
/// A line this many times longer than its panel is wide goes up and down too densely for dashes to show.
const DENSE: f64 = 15.0;
/// This many translucent markers on one spot are opaque; further ones change nothing.
const PILE: u32 = 10;
pub(super) const BAND_OPACITY: f64 = 0.25;

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

pub(super) fn draw(canvas: &mut dyn Canvas, plot: &Plot, layer: &Layer) {
    let area = plot.area;
    match layer {
        Layer::Line { points, style, .. } => line(canvas, plot, points.iter().copied(), *style),
        Layer::Steps { points, style, .. } => line(canvas, plot, held(points), *style),
        Layer::Points { points, style, .. } => markers(canvas, plot, points, *style),
        Layer::Band { points, style, .. } => band(canvas, plot, points, *style),
        Layer::ErrorBars { points, style, .. } => {
            error_bars(canvas, plot, points, *style, |canvas, at| {
                draw_markers(canvas, *style, &[at], MARKER_RADIUS);
            });
        }
        Layer::Hollow { points, style, .. } => {
            error_bars(canvas, plot, points, *style, |canvas, at| draw_ring(canvas, *style, at));
        }
        Layer::Hatched { spans, .. } => {
            for &(from, to) in spans {
                let [from, to] = [from, to].map(|x| plot.x.end_at(x).clamp(area.left, area.right));
                // Written so that an end that is no number has no strip.
                if from < to {
                    canvas.strokes(&hatching(Rect { left: from, right: to, ..area }, -1.0, 7.0), HATCH, 0.6);
                }
            }
        }
        Layer::UpperLimits { points, style, .. } => {
            for &(x, y) in points.iter().filter(|(x, y)| plot.x.shows(*x) && plot.y.shows(*y)) {
                draw_upper_limit(canvas, *style, plot.point((x, y)), area.bottom);
            }
        }
        Layer::Heat { x_edges, y_edges, values, colour, texts, .. } => {
            heat::draw(canvas, plot, (x_edges, y_edges), values, colour, texts);
        }
        Layer::HorizontalRule { y, .. } if plot.y.shows(*y) => {
            let at = plot.y.at(*y);
            stroke(canvas, area, &[(area.left, at), (area.right, at)], QUIET, 1.0, RULE_DASHES);
        }
        Layer::VerticalRule { x, .. } if plot.x.shows(*x) => {
            let at = plot.x.at(*x);
            stroke(canvas, area, &[(at, area.bottom), (at, area.top)], QUIET, 1.0, RULE_DASHES);
        }
        Layer::HorizontalRule { .. } | Layer::VerticalRule { .. } => (),
        Layer::Lanes { lanes, categories } => draw_lanes(canvas, plot, lanes, categories.len()),
    }
}

/// The corners of a staircase through the points.
fn held(points: &[Point]) -> impl Iterator<Item = Point> {
    let corners = points.windows(2).flat_map(|pair| [pair[0], (pair[1].0, pair[0].1)]);
    corners.chain(points.last().copied())
}

fn line(canvas: &mut dyn Canvas, plot: &Plot, points: impl Iterator<Item = Point>, style: Style) {
    for run in runs(points.map(|p| plot.point(p))) {
        match run[..] {
            // Between two gaps there is no line to draw, but there is a value.
            [lone] if plot.area.contains(lone) => canvas.discs(&[lone], LINE_WIDTH, style.colour()),
            [_] => (),
            _ => {
                stroke(canvas, plot.area, &thin(&run, COLUMN), style.colour(), LINE_WIDTH, style.dashes());
            }
        }
    }
}

fn stroke(canvas: &mut dyn Canvas, area: Rect, points: &[Point], colour: Colour, width: f64, dashes: &[f64]) {
    for part in clip_line(points, area) {
        let dense = length(&part) > DENSE * area.width();
        let strokes = if dashes.is_empty() || dense { vec![part] } else { dash(&part, dashes, COLUMN) };
        canvas.strokes(&strokes, colour, width);
    }
}

fn markers(canvas: &mut dyn Canvas, plot: &Plot, points: &[Point], style: Style) {
    let inside = points.iter().map(|&p| plot.point(p)).filter(|at| plot.area.contains(*at));
    let (radius, opacity) = match points.len() {
        0..=200 => return draw_markers(canvas, style, &inside.collect::<Vec<_>>(), MARKER_RADIUS),
        201..=1000 => (2.0, 0.7),
        _ => (1.25, 0.4),
    };
    let mut piled: HashMap<(i64, i64), u32> = HashMap::new();
    let seen = inside.filter(|at| {
        #[expect(clippy::cast_possible_truncation, reason = "a place inside the figure")]
        let pile = piled.entry(((at.0 * 2.0) as i64, (at.1 * 2.0) as i64)).or_default();
        *pile += 1;
        *pile <= PILE
    });
    canvas.discs(&seen.collect::<Vec<_>>(), radius, style.colour().faded(opacity));
}

pub(super) fn draw_markers(canvas: &mut dyn Canvas, style: Style, centres: &[Point], radius: f64) {
    let at = |shape: &[Point]| -> Vec<Vec<Point>> {
        let corners =
            |x: f64, y: f64| shape.iter().map(|(dx, dy)| (x + dx * radius, y + dy * radius)).collect();
        centres.iter().map(|&(x, y)| corners(x, y)).collect()
    };
    let lines = match style.marker() {
        Marker::Disc => return canvas.discs(centres, radius, style.colour()),
        Marker::Triangle => {
            for corners in at(&[(0.0, -1.25), (1.15, 0.8), (-1.15, 0.8)]) {
                canvas.polygon(&corners, style.colour());
            }
            return;
        }
        // The second point again closes the last corner, too.
        Marker::Square => {
            at(&[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9), (-0.9, -0.9), (0.9, -0.9)])
        }
        Marker::Diamond => at(&[(0.0, -1.2), (1.2, 0.0), (0.0, 1.2), (-1.2, 0.0), (0.0, -1.2), (1.2, 0.0)]),
        Marker::Cross => [at(&[(-0.9, -0.9), (0.9, 0.9)]), at(&[(-0.9, 0.9), (0.9, -0.9)])].concat(),
        Marker::Plus => [at(&[(-1.2, 0.0), (1.2, 0.0)]), at(&[(0.0, -1.2), (0.0, 1.2)])].concat(),
    };
    canvas.strokes(&lines, style.colour(), 1.4);
}

fn band(canvas: &mut dyn Canvas, plot: &Plot, points: &[(f64, f64, f64)], style: Style) {
    let usable = |(x, a, b): &(f64, f64, f64)| x.is_finite() && a.is_finite() && b.is_finite();
    for run in points.chunk_by(|a, b| usable(a) == usable(b)).filter(|run| usable(&run[0])) {
        let edge = |y: fn(&(f64, f64, f64)) -> f64| -> Vec<Point> {
            let all = runs(run.iter().map(|p| (plot.x.at(p.0), plot.y.end_at(y(p)))));
            all.iter().flat_map(|part| thin(part, COLUMN)).collect()
        };
        let (mut corners, upper) = (edge(|p| p.1), edge(|p| p.2));
        // Thin edges keep the band visible between dense markers and in grey.
        for side in [&corners, &upper] {
            stroke(canvas, plot.area, side, style.colour().faded(0.8), 0.75, &[]);
        }
        corners.extend(upper.into_iter().rev());
        let visible = clip_polygon(&corners, plot.area);
        if visible.len() > 2 {
            canvas.polygon(&visible, style.colour().faded(BAND_OPACITY));
        }
    }
}

/// Whiskers, and a mark at each value.
fn error_bars(
    canvas: &mut dyn Canvas,
    plot: &Plot,
    points: &[(f64, f64, f64, f64)],
    style: Style,
    mark: impl Fn(&mut dyn Canvas, Point),
) {
    const CAP: f64 = 3.5;
    // False for a NaN, too.
    for &(x, y, lower, upper) in points.iter().filter(|p| plot.x.shows(p.0)) {
        let at = plot.x.at(x);
        if lower.is_finite() && upper.is_finite() {
            let (low, high) = (plot.y.end_at(lower), plot.y.end_at(upper));
            let cap = |y| [(at - CAP, y), (at + CAP, y)];
            for bar in [[(at, low), (at, high)], cap(low), cap(high)] {
                stroke(canvas, plot.area, &bar, style.colour(), 1.2, &[]);
            }
        }
        if plot.y.shows(y) {
            mark(canvas, (at, plot.y.at(y)));
        }
    }
}

/// Empty inside, so that it is told from every other marker, in grey too.
fn draw_ring(canvas: &mut dyn Canvas, style: Style, at: Point) {
    canvas.discs(&[at], RING_RADIUS, style.colour());
    canvas.discs(&[at], RING_RADIUS - 1.4, WHITE);
}

/// A bar, and an arrow from it downwards, shorter where there is less room: the value is somewhere below.
pub(super) fn draw_upper_limit(canvas: &mut dyn Canvas, style: Style, (x, y): Point, bottom: f64) {
    const LONG: f64 = 13.0;
    let colour = style.colour();
    let tip = (y + LONG).min(bottom);
    canvas.path(&[(x - 5.0, y), (x + 5.0, y)], colour, 1.6);
    if tip - y > 5.0 {
        canvas.path(&[(x, y), (x, tip - 4.0)], colour, 1.2);
        canvas.polygon(&[(x, tip), (x - 3.6, tip - 6.0), (x + 3.6, tip - 6.0)], colour);
    }
}

fn draw_lanes(canvas: &mut dyn Canvas, plot: &Plot, lanes: &[Lane], categories: usize) {
    let slot = plot.area.height() / lanes.len().max(1) as f64;
    for (index, lane) in lanes.iter().enumerate() {
        let top = plot.area.top + (index as f64 + 0.14) * slot;
        let strip = Rect { top, bottom: top + 0.72 * slot, ..plot.area };
        for (left, right, category) in visible_spans(plot, lane, categories) {
            draw_fill(canvas, category, Rect { left, right, ..strip });
        }
        canvas.outline(strip, FRAME, 0.75);
    }
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
pub(super) fn draw_fill(canvas: &mut dyn Canvas, category: usize, area: Rect) {
    let look = fill(category);
    canvas.rect(area, look.ground);
    if look.slope != 0.0 {
        canvas.strokes(&hatching(area, look.slope, 6.0), look.line, 1.0);
    }
}
