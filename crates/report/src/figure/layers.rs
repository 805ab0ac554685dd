//! Drawing the layers of a panel as series and elements of plotters.

use super::axis::Scale;
use super::backend::{Backend, Dashed, Drawn, Point, Rect, Sheet, px, stroke_px};
use super::chart::{Chart, area};
use super::colour::Colour;
use super::reduce::{clip, hatching};
use super::style::{
    FRAME, HATCH, LINE_WIDTH, MARKER_RADIUS, Marker, QUIET, RING_RADIUS, RULE_DASHES, Style, WHITE, fill,
};
use super::{Layer, heat};
use plotters::element::{
    Circle, Cross, DynElement, EmptyElement, IntoDynElement, PathElement, Polygon, Rectangle, TriangleMarker,
};
use plotters::series::LineSeries;
use std::collections::HashMap;

/// This many translucent markers on one spot are opaque; further ones change nothing.
const PILE: u32 = 10;
pub(super) const BAND_OPACITY: f64 = 0.25;

/// An element at a place in data or backend coordinates.
pub(super) type Element<C> = DynElement<'static, Backend, C>;

/// The axes' ranges, to which lines and areas are clipped: plotters would draw the rest along the frame.
struct View {
    x: Scale,
    y: Scale,
}

impl View {
    fn shows(&self, x: f64, y: f64) -> bool {
        self.x.shows(x) && self.y.shows(y)
    }

    fn clip(&self, points: &[Point], is_closed: bool) -> impl Iterator<Item = Vec<Point>> {
        let ((left, right), (top, bottom)) = (self.x.ends(), self.y.ends());
        let even: Vec<Point> = points.iter().map(|p| (self.x.even(p.0), self.y.even(p.1))).collect();
        let value = |p: Point| (self.x.spread.value(p.0), self.y.spread.value(p.1));
        let parts = clip(&even, is_closed, Rect { left, top, right, bottom });
        parts.into_iter().map(move |part| part.into_iter().map(value).collect())
    }
}

pub(super) fn draw(chart: &mut Chart, layer: &Layer) -> Drawn {
    let within = area(chart);
    let sheet = chart.plotting_area().use_screen_coord();
    let spec = chart.as_coord_spec();
    let view = View { x: spec.x_spec().clone(), y: spec.y_spec().clone() };
    let (x_axis, y_axis) = (&view.x, &view.y);
    match layer {
        Layer::Line { points, style, .. } => curve(chart, &view, points.iter().copied(), *style),
        Layer::Steps { points, style, .. } => curve(chart, &view, held(points), *style),
        Layer::Points { points, style, .. } => markers(chart, &view, points, *style),
        Layer::Band { points, style, .. } => band(chart, &view, points, *style),
        Layer::ErrorBars { points, style, .. } => error_bars(chart, &view, points, *style, marker),
        Layer::Hollow { points, style, .. } => error_bars(chart, &view, points, *style, ring),
        Layer::Hatched { spans, .. } => {
            for &(from, to) in spans {
                let ends = (within.left, within.right);
                let [left, right] = [from, to].map(|x| x_axis.at(x, ends).clamp(within.left, within.right));
                // Written so that an end that is no number has no strip.
                if from < to && left < right {
                    hatch(&sheet, Rect { left, right, ..within }, (-1.0, 7.0), HATCH, 0.6)?;
                }
            }
            Ok(())
        }
        Layer::UpperLimits { points, style, .. } => {
            let shown = points.iter().copied().filter(|p| view.shows(p.0, p.1));
            let room = |y: f64| within.bottom - y_axis.at(y, (within.bottom, within.top));
            chart.draw_series(shown.map(|at| upper_limit(*style, at, room(at.1)))).map(drop)
        }
        Layer::Heat { .. } => heat::draw(chart, layer),
        Layer::HorizontalRule { y, .. } if y_axis.shows(*y) => {
            rule(chart, [(x_axis.range.0, *y), (x_axis.range.1, *y)])
        }
        Layer::VerticalRule { x, .. } if x_axis.shows(*x) => {
            rule(chart, [(*x, y_axis.range.0), (*x, y_axis.range.1)])
        }
        Layer::HorizontalRule { .. } | Layer::VerticalRule { .. } => Ok(()),
        Layer::Lanes { lanes, categories } => {
            let slot = within.height() / lanes.len().max(1) as f64;
            for (index, lane) in lanes.iter().enumerate() {
                let top = within.top + (index as f64 + 0.14) * slot;
                let strip = Rect { top, bottom: top + 0.72 * slot, ..within };
                // Of spans shorter than an eighth of a pixel those are drawn in which a multiple of it lies.
                let place = |x: f64| (8.0 * x_axis.at(x, (strip.left, strip.right))).round() / 8.0;
                for &(from, to, category) in &lane.spans {
                    let [left, right] = [from, to].map(|x| place(x).clamp(strip.left, strip.right));
                    // Written so that a NaN is skipped.
                    if from < to && left < right && category < categories.len() {
                        draw_fill(&sheet, category, Rect { left, right, ..strip })?;
                    }
                }
                sheet.draw(&Rectangle::new(strip.corners(), FRAME.stroke(0.75)))?;
            }
            Ok(())
        }
    }
}

/// Returns the corners of a staircase through the points.
fn held(points: &[Point]) -> impl Iterator<Item = Point> {
    let corners = points.windows(2).flat_map(|pair| [pair[0], (pair[1].0, pair[0].1)]);
    corners.chain(points.last().copied())
}

/// Returns a line in data or backend coordinates, without a pattern a solid one.
pub(super) fn line<C: Clone + 'static>(
    points: Vec<C>,
    colour: Colour,
    width: f64,
    pattern: &'static [f64],
) -> Element<C> {
    if pattern.is_empty() {
        PathElement::new(points, colour.stroke(width)).into_dyn()
    } else {
        Dashed { points, colour, width, pattern }.into_dyn()
    }
}

fn rule(chart: &mut Chart, ends: [Point; 2]) -> Drawn {
    chart.draw_series([line(ends.to_vec(), QUIET, 1.0, RULE_DASHES)]).map(drop)
}

fn curve(chart: &mut Chart, view: &View, points: impl Iterator<Item = Point>, style: Style) -> Drawn {
    let has_place = |p: &Point| view.x.spread.has(p.0) && view.y.spread.has(p.1);
    let placed: Vec<Point> = points.map(|p| if has_place(&p) { p } else { (p.0, f64::NAN) }).collect();
    for part in view.clip(&placed, false) {
        if let [lone] = part[..] {
            // Between two gaps there is no line to draw, but there is a value.
            chart.draw_series([Circle::new(lone, stroke_px(LINE_WIDTH), style.colour().fill())])?;
        } else if style.dashes().is_empty() {
            chart.draw_series(LineSeries::new(part, style.colour().stroke(LINE_WIDTH)))?;
        } else {
            chart.draw_series([line(part, style.colour(), LINE_WIDTH, style.dashes())])?;
        }
    }
    Ok(())
}

fn markers(chart: &mut Chart, view: &View, points: &[Point], style: Style) -> Drawn {
    let shown = points.iter().copied().filter(|p| view.shows(p.0, p.1));
    let (radius, opacity) = match points.len() {
        0..=200 => return chart.draw_series(shown.map(|at| marker(style, at))).map(drop),
        201..=1000 => (2.0, 0.7),
        _ => (1.25, 0.4),
    };
    let mut piled: HashMap<(i32, i32), u32> = HashMap::new();
    let plotted = chart.plotting_area().clone();
    let seen = shown.filter(|at| {
        let (left, top) = plotted.map_coordinate(at);
        let pile = piled.entry((left / px(0.5), top / px(0.5))).or_default();
        *pile += 1;
        *pile <= PILE
    });
    let look = style.colour().faded(opacity).fill();
    chart.draw_series(seen.map(|at| Circle::new(at, stroke_px(radius), look))).map(drop)
}

/// Returns the marker of a style at a place in data or backend coordinates.
pub(super) fn marker<C: Clone + 'static>(style: Style, at: C) -> Element<C> {
    let r = MARKER_RADIUS;
    let look = style.colour().stroke(1.4);
    let path = |corners: &[Point]| {
        PathElement::new(corners.iter().map(|(x, y)| (px(x * r), px(y * r))).collect::<Vec<_>>(), look)
    };
    let centre = EmptyElement::at(at);
    match style.marker() {
        Marker::Disc => (centre + Circle::new((0, 0), stroke_px(r), look.filled())).into_dyn(),
        Marker::Triangle => (centre + TriangleMarker::new((0, 0), px(1.3 * r), look.filled())).into_dyn(),
        // The second point again closes the last corner, too.
        Marker::Square => {
            let corners = [(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9), (-0.9, -0.9), (0.9, -0.9)];
            (centre + path(&corners)).into_dyn()
        }
        Marker::Diamond => {
            let corners = [(0.0, -1.2), (1.2, 0.0), (0.0, 1.2), (-1.2, 0.0), (0.0, -1.2), (1.2, 0.0)];
            (centre + path(&corners)).into_dyn()
        }
        Marker::Cross => (centre + Cross::new((0, 0), px(0.9 * r), look)).into_dyn(),
        Marker::Plus => {
            (centre + path(&[(-1.2, 0.0), (1.2, 0.0)]) + path(&[(0.0, -1.2), (0.0, 1.2)])).into_dyn()
        }
    }
}

/// Returns a bar with an arrow downwards, which means that the value is below the bar. The arrow is shorter if there is
/// less room.
pub(super) fn upper_limit<C: Clone + 'static>(style: Style, at: C, room: f64) -> Element<C> {
    const LONG: f64 = 13.0;
    let (tip, colour) = (LONG.min(room), style.colour());
    let bar = EmptyElement::at(at) + PathElement::new([(px(-5.0), 0), (px(5.0), 0)], colour.stroke(1.6));
    if tip <= 5.0 {
        return bar.into_dyn();
    }
    let shaft = PathElement::new([(0, 0), (0, px(tip - 4.0))], colour.stroke(1.2));
    let head = [(0, px(tip)), (px(-3.6), px(tip - 6.0)), (px(3.6), px(tip - 6.0))];
    (bar + shaft + Polygon::new(head, colour.fill())).into_dyn()
}

fn band(chart: &mut Chart, view: &View, points: &[(f64, f64, f64)], style: Style) -> Drawn {
    let usable = |(x, a, b): &(f64, f64, f64)| view.x.spread.has(*x) && a.is_finite() && b.is_finite();
    for run in points.chunk_by(|a, b| usable(a) == usable(b)).filter(|run| usable(&run[0])) {
        let lower: Vec<Point> = run.iter().map(|p| (p.0, p.1)).collect();
        let upper: Vec<Point> = run.iter().map(|p| (p.0, p.2)).collect();
        // Thin edges keep the band visible between dense markers and in grey.
        let edge = style.colour().faded(0.8).stroke(0.75);
        for side in [&lower, &upper] {
            chart.draw_series(view.clip(side, false).map(|part| PathElement::new(part, edge)))?;
        }
        let around: Vec<Point> = lower.into_iter().chain(upper.into_iter().rev()).collect();
        let ground = style.colour().faded(BAND_OPACITY).fill();
        chart.draw_series(view.clip(&around, true).map(|part| Polygon::new(part, ground)))?;
    }
    Ok(())
}

/// Returns a ring. It is the only marker that is empty inside, so it is recognised in grey, too.
fn ring(style: Style, at: Point) -> Element<Point> {
    let disc = |radius, colour: Colour| Circle::new((0, 0), stroke_px(radius), colour.fill());
    (EmptyElement::at(at) + disc(RING_RADIUS, style.colour()) + disc(RING_RADIUS - 1.4, WHITE)).into_dyn()
}

/// Whiskers from lower to upper values, and a mark at each value. [`plotters::element::ErrorBar`] has discs alone.
fn error_bars(
    chart: &mut Chart,
    view: &View,
    points: &[(f64, f64, f64, f64)],
    style: Style,
    mark: fn(Style, Point) -> Element<Point>,
) -> Drawn {
    const CAP: f64 = 3.5;
    let look = style.colour().stroke(1.2);
    for &(x, y, lower, upper) in points {
        // An interval without an end leaves the panel.
        if view.x.shows(x) && !lower.is_nan() && !upper.is_nan() {
            let stem = [(x, lower), (x, upper)];
            chart.draw_series(view.clip(&stem, false).map(|part| PathElement::new(part, look)))?;
            let ends = [lower, upper].into_iter().filter(|y| view.y.shows(*y));
            let cap = |y| EmptyElement::at((x, y)) + PathElement::new([(px(-CAP), 0), (px(CAP), 0)], look);
            chart.draw_series(ends.map(cap))?;
        }
        chart.draw_series(view.shows(x, y).then(|| mark(style, (x, y))))?;
    }
    Ok(())
}

/// Fills a rectangle in the manner of a category.
pub(super) fn draw_fill(sheet: &Sheet, category: usize, area: Rect) -> Drawn {
    let look = fill(category);
    sheet.draw(&Rectangle::new(area.corners(), look.ground.fill()))?;
    if look.slope == 0.0 { Ok(()) } else { hatch(sheet, area, (look.slope, 6.0), look.line, 1.0) }
}

/// Returns the lines of a slope and spacing across a rectangle.
pub(super) fn hatch(
    sheet: &Sheet,
    area: Rect,
    (slope, spacing): (f64, f64),
    colour: Colour,
    width: f64,
) -> Drawn {
    for ends in hatching(area, slope, spacing) {
        sheet.draw(&PathElement::new(ends.map(|(x, y)| (px(x), px(y))), colour.stroke(width)))?;
    }
    Ok(())
}
