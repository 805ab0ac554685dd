//! Figures as pixels, in which the bundled font stands as shapes.

use super::backend::{Point, Surface, Type};
use super::colour::Colour;
use super::text::{self, pieces};
use plotters_backend::text_anchor::HPos;
use standstill_numeric::whole;
use tiny_skia::{FillRule, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

/// Pixels per logical pixel: type stays sharp in print.
const DENSITY: u32 = 2;

pub(super) struct Png(Pixmap);

impl Png {
    /// Makes an image; none if it has no pixel.
    pub fn new(width: u32, height: u32) -> Option<Self> {
        Pixmap::new(width * DENSITY, height * DENSITY).map(Self)
    }

    /// Returns the picture as a file. Nothing of a figure is transparent; the fourth byte of each pixel stays all the
    /// same, for a file without it is smaller by 6 % only, and whoever takes it out goes through all pixels.
    pub fn finish(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.0.width(), self.0.height());
        encoder.set_color(png::ColorType::Rgba);
        // An eighth of the time of the usual compression, for a file of twice the size: a short run mostly waited for its pictures.
        encoder.set_compression(png::Compression::Fast);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.0.data())?;
        writer.finish()?;
        Ok(file)
    }

    fn fill(&mut self, path: Option<Path>, colour: Colour, to_logical: Transform) {
        if let Some(path) = path {
            let whole = to_logical.post_scale(DENSITY as f32, DENSITY as f32);
            self.0.fill_path(&path, &paint(colour), FillRule::Winding, whole, None);
        }
    }

    fn line(&mut self, path: Option<Path>, colour: Colour, width: f64) {
        if let Some(path) = path {
            let stroke = Stroke { width: single(width), line_join: LineJoin::Round, ..Stroke::default() };
            let scale = Transform::from_scale(DENSITY as f32, DENSITY as f32);
            self.0.stroke_path(&path, &paint(colour), &stroke, scale, None);
        }
    }
}

fn paint(Colour(r, g, b, opacity): Colour) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, whole((255.0 * opacity).round()));
    paint
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "single precision is a thousandth of a pixel in any figure"
)]
fn single(length: f64) -> f32 {
    length.clamp(-1e6, 1e6) as f32
}

fn trace(points: &[Point]) -> PathBuilder {
    let mut path = PathBuilder::new();
    for (index, (x, y)) in points.iter().enumerate() {
        match index {
            0 => path.move_to(single(*x), single(*y)),
            _ => path.line_to(single(*x), single(*y)),
        }
    }
    path
}

impl Surface for Png {
    fn stroke(&mut self, points: &[Point], colour: Colour, width: f64) {
        self.line(trace(points).finish(), colour, width);
    }

    fn polygon(&mut self, corners: &[Point], colour: Colour) {
        let mut path = trace(corners);
        path.close();
        self.fill(path.finish(), colour, Transform::identity());
    }

    fn disc(&mut self, (x, y): Point, radius: f64, ring: Option<f64>, colour: Colour) {
        let circle = PathBuilder::from_circle(single(x), single(y), single(radius));
        match ring {
            Some(width) => self.line(circle, colour, width),
            None => self.fill(circle, colour, Transform::identity()),
        }
    }

    fn text(&mut self, text: &str, (x, y): Point, set: Type) {
        let mut along = match set.align {
            HPos::Left => 0.0,
            HPos::Center => -text::width(text, set.size) / 2.0,
            HPos::Right => -text::width(text, set.size),
        };
        for piece in pieces(text) {
            let down = if piece.index { text::INDEX_DROP * set.size } else { 0.0 };
            let outline = text::outline(piece.text, piece.size(set.size));
            let place = Transform::from_translate(single(along), single(down))
                .post_rotate(f32::from(set.turn))
                .post_translate(single(x), single(y));
            self.fill(outline, set.colour, place);
            along += piece.width(set.size);
        }
    }
}
