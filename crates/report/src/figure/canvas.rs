//! What a figure is drawn on: marks in logical pixels, from the upper left corner.

use super::colour::Colour;

pub(super) type Point = (f64, f64);

/// A rectangle in logical pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
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
        ((self.left + self.right) / 2.0, (self.top + self.bottom) / 2.0)
    }

    pub fn contains(&self, (x, y): Point) -> bool {
        (self.left..=self.right).contains(&x) && (self.top..=self.bottom).contains(&y)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Align {
    Start,
    Middle,
    End,
}

/// How a text is set: type size in logical pixels, colour, alignment along its baseline, direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Type {
    pub size: f64,
    pub colour: Colour,
    pub align: Align,
    /// Reading from bottom to top.
    pub upwards: bool,
}

/// From the middle of a line of type down to its baseline, per type size: half the height of a digit.
pub(super) const HALF: f64 = 0.36;

/// An SVG document or the pixels of a PNG.
pub(super) trait Canvas {
    /// Lines with round joints, each through its points.
    fn strokes(&mut self, lines: &[Vec<Point>], colour: Colour, width: f64);

    /// A filled polygon.
    fn polygon(&mut self, corners: &[Point], colour: Colour);

    /// Filled circles of one radius; translucent ones add up where they overlap.
    fn discs(&mut self, centres: &[Point], radius: f64, colour: Colour);

    /// A text whose baseline goes through `at`; indices as in `i_a` are set below it.
    fn text(&mut self, text: &str, at: Point, set: Type);

    /// A line through points.
    fn path(&mut self, points: &[Point], colour: Colour, width: f64) {
        self.strokes(&[points.to_vec()], colour, width);
    }

    /// A filled rectangle.
    fn rect(&mut self, Rect { left, top, right, bottom }: Rect, colour: Colour) {
        self.polygon(&[(left, top), (right, top), (right, bottom), (left, bottom)], colour);
    }

    /// The outline of a rectangle.
    fn outline(&mut self, Rect { left, top, right, bottom }: Rect, colour: Colour, width: f64) {
        // Over the first corner again, which closes it.
        self.path(
            &[(left, top), (right, top), (right, bottom), (left, bottom), (left, top), (right, top)],
            colour,
            width,
        );
    }

    /// Lines of text one below the other, their middle level with `at`.
    fn lines(&mut self, text: &str, at: Point, set: Type) {
        let line_height = 1.3 * set.size;
        let first = at.1 - 0.5 * line_height * (text.lines().count().max(1) - 1) as f64 + HALF * set.size;
        for (row, line) in text.lines().enumerate() {
            self.text(line, (at.0, first + row as f64 * line_height), set);
        }
    }
}
