//! The backend of plotters: coordinates in sixteenths of a logical pixel, so that strokes are smooth, and letters of the bundled
//! font, whatever font a style names.

use super::colour::Colour;
use super::reduce::{dash, thin};
use super::text;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind};
use plotters::element::{Drawable, PointCollection};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    FontTransform,
};
use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

pub(super) type Point = (f64, f64);

/// The result of drawing with plotters on a [`Backend`], which itself cannot fail.
pub type Drawn = Result<(), DrawingAreaErrorKind<Infallible>>;
type Done = Result<(), DrawingErrorKind<Infallible>>;

/// A drawing area without axes.
pub(super) type Sheet = DrawingArea<Backend, Shift>;

/// Backend coordinates per logical pixel.
pub(super) const UNIT: f64 = 16.0;
/// Columns in which a long line is thinned, in logical pixels: the pixels of a PNG.
pub(super) const COLUMN: f64 = 0.5;
/// Paths of more points are thinned.
const LONG: usize = 500;
/// Height of a line of text, per type size.
const LINE: f64 = 1.3;
/// Distance from the middle of a line of text down to its baseline, half the height of a digit, per type size.
const HALF: f64 = 0.36;

/// Returns a length in logical pixels as a coordinate, a radius or a type size of a [`Backend`].
#[expect(clippy::cast_possible_truncation, reason = "far beyond any figure")]
pub fn px(length: f64) -> i32 {
    (length * UNIT).round() as i32
}

/// Returns the width of a stroke of so many logical pixels, for a style of plotters.
pub fn stroke_px(width: f64) -> u32 {
    px(width).unsigned_abs()
}

fn logical((x, y): BackendCoord) -> Point {
    (f64::from(x) / UNIT, f64::from(y) / UNIT)
}

/// A rectangle in logical pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Rect {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Rect {
    pub fn width(&self) -> f64 {
        self.right - self.left
    }

    pub fn height(&self) -> f64 {
        self.bottom - self.top
    }

    pub fn centre(&self) -> Point {
        (f64::midpoint(self.left, self.right), f64::midpoint(self.top, self.bottom))
    }

    /// Returns the corners as plotters takes them.
    pub fn corners(&self) -> [BackendCoord; 2] {
        [(px(self.left), px(self.top)), (px(self.right), px(self.bottom))]
    }
}

/// Style of a line of text: type size in logical pixels, colour, alignment along the baseline, clockwise rotation in
/// degrees.
#[derive(Clone, Copy)]
pub(super) struct Type {
    pub size: f64,
    pub colour: Colour,
    pub align: HPos,
    pub turn: i16,
}

/// An SVG document or the pixels of a PNG; all lengths are logical pixels.
pub(super) trait Surface {
    /// Draws a line with round joints.
    fn stroke(&mut self, points: &[Point], colour: Colour, width: f64);

    fn polygon(&mut self, corners: &[Point], colour: Colour);

    /// Draws a disc, or a ring of the given width.
    fn disc(&mut self, centre: Point, radius: f64, ring: Option<f64>, colour: Colour);

    /// Draws a line of text with its baseline through `at`; indices as in `i_a` are set below the baseline.
    fn text(&mut self, text: &str, at: Point, set: Type);
}

/// A backend of plotters for figures.
///
/// All coordinates, radii, stroke widths and type sizes are sixteenths of a logical pixel: [`px`] and [`stroke_px`] make them.
pub struct Backend {
    surface: Rc<RefCell<dyn Surface>>,
    size: (u32, u32),
}

impl Backend {
    pub(super) fn new(surface: Rc<RefCell<dyn Surface>>, width: u32, height: u32) -> Self {
        let size = [width, height].map(|length| stroke_px(f64::from(length)));
        Self { surface, size: (size[0], size[1]) }
    }
}

fn colour(BackendColor { alpha, rgb: (r, g, b) }: BackendColor) -> Colour {
    Colour(r, g, b, alpha)
}

fn thinned(points: impl Iterator<Item = BackendCoord>) -> Vec<Point> {
    let points: Vec<Point> = points.map(logical).collect();
    if points.len() > LONG { thin(&points, COLUMN) } else { points }
}

impl DrawingBackend for Backend {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.size
    }

    fn ensure_prepared(&mut self) -> Done {
        Ok(())
    }

    fn present(&mut self) -> Done {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, color: BackendColor) -> Done {
        self.draw_rect((x, y), (x + 1, y + 1), &color, true)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Done {
        self.draw_path([from, to], style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        a: BackendCoord,
        b: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Done {
        let corners = [a, (b.0, a.1), b, (a.0, b.1)];
        if fill {
            return self.fill_polygon(corners, style);
        }
        // Over the first corner again, which closes it.
        self.draw_path(corners.into_iter().chain([a, (b.0, a.1)]), style)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Done {
        if style.color().alpha > 0.0 {
            let (points, width) = (thinned(path.into_iter()), f64::from(style.stroke_width()) / UNIT);
            self.surface.borrow_mut().stroke(&points, colour(style.color()), width);
        }
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        centre: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Done {
        let (at, radius) = (logical(centre), f64::from(radius) / UNIT);
        let ring = (!fill).then(|| f64::from(style.stroke_width()) / UNIT);
        self.surface.borrow_mut().disc(at, radius, ring, colour(style.color()));
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Done {
        let corners = thinned(path.into_iter());
        if corners.len() > 2 {
            self.surface.borrow_mut().polygon(&corners, colour(style.color()));
        }
        Ok(())
    }

    /// Draws a text, which may have several lines.
    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Done {
        let ((x, y), size, anchor) = (logical(at), style.size() / UNIT, style.anchor());
        let rows = text.lines().count() as f64;
        let first = match anchor.v_pos {
            VPos::Top => 0.5,
            VPos::Center => 0.5 - 0.5 * rows,
            VPos::Bottom => 0.5 - rows,
        };
        for (row, line) in text.lines().enumerate() {
            let down = (first + row as f64) * LINE * size + HALF * size;
            let (turn, at) = match style.transform() {
                FontTransform::None => (0, (x, y + down)),
                FontTransform::Rotate90 => (90, (x - down, y)),
                FontTransform::Rotate180 => (180, (x, y - down)),
                FontTransform::Rotate270 => (-90, (x + down, y)),
            };
            let set = Type { size, colour: colour(style.color()), align: anchor.h_pos, turn };
            self.surface.borrow_mut().text(line, at, set);
        }
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let size = style.size() / UNIT;
        Ok((stroke_px(text::widest(text, size)), stroke_px(text.lines().count() as f64 * LINE * size)))
    }
}

/// A line of dashes of several lengths, which [`plotters::element::DashedPathElement`] has not, and which noise does not hide.
pub(super) struct Dashed<C> {
    pub points: Vec<C>,
    pub colour: Colour,
    pub width: f64,
    /// Lengths of strokes and gaps in turn, in logical pixels.
    pub pattern: &'static [f64],
}

impl<'a, C> PointCollection<'a, C> for &'a Dashed<C> {
    type Point = &'a C;
    type IntoIter = std::slice::Iter<'a, C>;

    fn point_iter(self) -> Self::IntoIter {
        self.points.iter()
    }
}

impl<C> Drawable<Backend> for Dashed<C> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        points: I,
        backend: &mut Backend,
        _: (u32, u32),
    ) -> Done {
        let points = thin(&points.map(logical).collect::<Vec<_>>(), COLUMN);
        for stroke in dash(&points, self.pattern, COLUMN) {
            backend.surface.borrow_mut().stroke(&stroke, self.colour, self.width);
        }
        Ok(())
    }
}
