//! Primitives in logical pixels on either backend of plotters.

use super::FigureError;
use super::text;
use plotters::backend::DrawingBackend;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontTransform, IntoFont, RGBAColor, ShapeStyle};

/// A place in logical pixels, from the upper left corner.
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
    pub colour: RGBAColor,
    pub align: Align,
    /// Reading from bottom to top.
    pub upwards: bool,
}

/// What the backend makes of strokes and texts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// It knows paths and fonts.
    Vector,
    /// It has pixels only.
    Raster,
}

pub(super) struct Canvas<B: DrawingBackend> {
    pub backend: B,
    pub kind: Kind,
    /// Device pixels per logical pixel. Plotters takes whole pixels, so it must be well above one for smooth
    /// lines.
    pub scale: f64,
}

type Drawn = Result<(), FigureError>;

fn failed(error: impl std::fmt::Display) -> FigureError {
    FigureError::Draw(error.to_string())
}

/// The corners of a straight stroke between two different pixels.
#[expect(clippy::cast_possible_truncation, reason = "near the pixels given")]
fn bar(from: (i32, i32), to: (i32, i32), half_width: f64) -> [(i32, i32); 4] {
    let (dx, dy) = (f64::from(to.0 - from.0), f64::from(to.1 - from.1));
    let reach = half_width / dx.hypot(dy);
    let (across, down) = (-dy * reach, dx * reach);
    let corner = |(x, y): (i32, i32), side: f64| {
        ((f64::from(x) + side * across).round() as i32, (f64::from(y) + side * down).round() as i32)
    };
    [corner(from, 1.0), corner(to, 1.0), corner(to, -1.0), corner(from, -1.0)]
}

impl<B: DrawingBackend> Canvas<B> {
    #[expect(clippy::cast_possible_truncation, reason = "the clamp keeps it in range")]
    fn device(&self, (x, y): Point) -> (i32, i32) {
        let whole = |v: f64| (v * self.scale).round().clamp(-1e6, 1e6) as i32;
        (whole(x), whole(y))
    }

    fn pen(&self, colour: RGBAColor, width: f64) -> ShapeStyle {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few pixels")]
        let stroke_width = (width * self.scale).round().max(1.0) as u32;
        // The rasteriser fills the pixels on both edges of a stroke, which makes it one wider.
        let stroke_width = if self.kind == Kind::Raster { (stroke_width - 1).max(1) } else { stroke_width };
        ShapeStyle { color: colour, filled: true, stroke_width }
    }

    /// A line through the points, `width` wide.
    pub fn path(&mut self, points: &[Point], colour: RGBAColor, width: f64) -> Drawn {
        let pen = self.pen(colour, width);
        let mut device: Vec<_> = points.iter().map(|&p| self.device(p)).collect();
        device.dedup();
        if self.kind == Kind::Vector {
            return self.backend.draw_path(device, &pen).map_err(failed);
        }
        // Plotters would fill the outline of the whole path as one polygon, with holes where it overlaps, and
        // would cut the corners of each stroke down to whole pixels, which makes slanted ones thin.
        for pair in device.windows(2) {
            let outline = bar(pair[0], pair[1], f64::from(pen.stroke_width) / 2.0);
            self.backend.fill_polygon(outline, &pen).map_err(failed)?;
        }
        if pen.stroke_width > 2 && device.len() > 2 {
            for &joint in &device[1..device.len() - 1] {
                self.backend.draw_circle(joint, pen.stroke_width / 2, &pen, true).map_err(failed)?;
            }
        }
        Ok(())
    }

    /// A filled polygon.
    pub fn polygon(&mut self, corners: &[Point], colour: RGBAColor) -> Drawn {
        let device: Vec<_> = corners.iter().map(|&p| self.device(p)).collect();
        self.backend.fill_polygon(device, &self.pen(colour, 0.0)).map_err(failed)
    }

    /// A filled rectangle.
    pub fn rect(&mut self, area: Rect, colour: RGBAColor) -> Drawn {
        let (from, to) = (self.device((area.left, area.top)), self.device((area.right, area.bottom)));
        self.backend.draw_rect(from, to, &self.pen(colour, 0.0), true).map_err(failed)
    }

    /// The outline of a rectangle.
    pub fn outline(&mut self, area: Rect, colour: RGBAColor, width: f64) -> Drawn {
        let half = width / 2.0;
        let Rect { left, top, right, bottom } = area;
        // Four bars rather than a path: their corners are square in both backends.
        for bar in [
            Rect { left: left - half, top: top - half, right: right + half, bottom: top + half },
            Rect { left: left - half, top: bottom - half, right: right + half, bottom: bottom + half },
            Rect { left: left - half, top: top + half, right: left + half, bottom: bottom - half },
            Rect { left: right - half, top: top + half, right: right + half, bottom: bottom - half },
        ] {
            self.rect(bar, colour)?;
        }
        Ok(())
    }

    /// A filled circle.
    pub fn disc(&mut self, centre: Point, radius: f64, colour: RGBAColor) -> Drawn {
        let pen = self.pen(colour, radius);
        self.backend.draw_circle(self.device(centre), pen.stroke_width, &pen, true).map_err(failed)
    }

    /// A text whose baseline goes through `at`; indices as in `i_a` are set below it.
    pub fn text(&mut self, text: &str, at: Point, set: Type) -> Drawn {
        let pieces = text::pieces(text);
        if pieces.iter().all(|piece| !piece.index) {
            return self.plain_text(text, at, set);
        }
        let mut along = match set.align {
            Align::Start => 0.0,
            Align::Middle => -text::width(text, set.size) / 2.0,
            Align::End => -text::width(text, set.size),
        };
        for piece in pieces {
            // SVG drops blanks at either end of a text.
            let blank = piece.text.len() - piece.text.trim_start().len();
            let start = along + text::width(&piece.text[..blank], piece.size(set.size));
            let down = if piece.index { text::INDEX_DROP * set.size } else { 0.0 };
            let place = if set.upwards { (at.0 + down, at.1 - start) } else { (at.0 + start, at.1 + down) };
            let part = Type { size: piece.size(set.size), align: Align::Start, ..set };
            self.plain_text(piece.text.trim(), place, part)?;
            along += piece.width(set.size);
        }
        Ok(())
    }

    /// Lines of text one below the other, their middle level with `at`.
    pub fn lines(&mut self, text: &str, at: Point, set: Type) -> Drawn {
        let line_height = 1.3 * set.size;
        let first = at.1 - 0.5 * line_height * (text.lines().count().max(1) - 1) as f64;
        for (row, line) in text.lines().enumerate() {
            // Half the height of a digit from its middle down to the baseline.
            self.text(line, (at.0, first + row as f64 * line_height + 0.36 * set.size), set)?;
        }
        Ok(())
    }

    fn plain_text(&mut self, text: &str, at: Point, set: Type) -> Drawn {
        let em = set.size * self.scale;
        match self.kind {
            Kind::Vector => self.vector_text(text, at, set, em),
            Kind::Raster => self.raster_text(text, at, set, em),
        }
    }

    fn vector_text(&mut self, text: &str, (x, y): Point, set: Type, em: f64) -> Drawn {
        // The SVG backend divides the size by 1.24 and moves a text anchored at its top down by 0.76 em.
        let drop = 0.76 * set.size;
        let (at, turn) = if set.upwards {
            ((x - drop, y), FontTransform::Rotate270)
        } else {
            ((x, y - drop), FontTransform::None)
        };
        let h_pos = match set.align {
            Align::Start => HPos::Left,
            Align::Middle => HPos::Center,
            Align::End => HPos::Right,
        };
        let style = (text::FAMILY, em * 1.24)
            .into_font()
            .transform(turn)
            .color(&set.colour)
            .pos(Pos::new(h_pos, VPos::Top));
        self.backend.draw_text(text, &style, self.device(at)).map_err(failed)
    }

    fn raster_text(&mut self, text: &str, at: Point, set: Type, em: f64) -> Drawn {
        let wide = text::plain_width(text, em);
        let shift = match set.align {
            Align::Start => 0.0,
            Align::Middle => -wide / 2.0,
            Align::End => -wide,
        };
        #[expect(clippy::cast_possible_truncation, reason = "a text is a few thousand pixels at most")]
        let shift = shift.round() as i32;
        let (x, y) = self.device(at);
        let mut result = Ok(());
        text::pixels(text, em, |along, down, coverage| {
            let place =
                if set.upwards { (x + down, y - shift - along) } else { (x + shift + along, y + down) };
            if result.is_ok() {
                result = self.backend.draw_pixel(place, set.colour.mix(coverage).to_backend_color());
            }
        });
        result.map_err(failed)
    }
}
