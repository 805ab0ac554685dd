//! Figures as SVG documents. Text stays text.

use super::canvas::{Align, Canvas, Point, Type};
use super::colour::Colour;
use super::text::{self, escaped, pieces};
use std::fmt::Write;

/// The bundled font by name, then fonts of similar widths.
const FAMILY: &str = "DejaVu Sans, Bitstream Vera Sans, Verdana, sans-serif";

pub(super) struct Svg(String);

impl Svg {
    pub fn new(width: u32, height: u32) -> Self {
        Self(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"{FAMILY}\" stroke-linejoin=\"round\">\n"
        ))
    }

    pub fn finish(self) -> String {
        self.0 + "</svg>\n"
    }

    /// Appends an element; memory takes everything.
    fn add(&mut self, element: std::fmt::Arguments) {
        let _ = self.0.write_fmt(element);
    }
}

/// A length to a hundredth of a pixel.
fn short(length: f64) -> String {
    let text = format!("{:.2}", length.clamp(-1e6, 1e6));
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn data(points: &[Point]) -> String {
    let corners: Vec<_> = points.iter().map(|(x, y)| format!("{} {}", short(*x), short(*y))).collect();
    format!("M{}", corners.join("L"))
}

/// An attribute for a colour, and one for its opacity where it is translucent.
fn paint(attribute: &str, colour: Colour) -> String {
    let opacity =
        if colour.3 < 1.0 { format!(" {attribute}-opacity=\"{}\"", short(colour.3)) } else { String::new() };
    format!("{attribute}=\"{}\"{opacity}", colour.hex())
}

impl Canvas for Svg {
    fn strokes(&mut self, lines: &[Vec<Point>], colour: Colour, width: f64) {
        let lines: String = lines.iter().map(|points| data(points)).collect();
        let (stroke, width) = (paint("stroke", colour), short(width));
        self.add(format_args!("<path d=\"{lines}\" fill=\"none\" {stroke} stroke-width=\"{width}\"/>\n"));
    }

    fn polygon(&mut self, corners: &[Point], colour: Colour) {
        self.add(format_args!("<path d=\"{}z\" {}/>\n", data(corners), paint("fill", colour)));
    }

    fn discs(&mut self, centres: &[Point], radius: f64, colour: Colour) {
        self.add(format_args!("<g {}>\n", paint("fill", colour)));
        for (x, y) in centres {
            let [x, y, r] = [*x, *y, radius].map(short);
            self.add(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"/>\n"));
        }
        self.add(format_args!("</g>\n"));
    }

    fn text(&mut self, text: &str, at: Point, set: Type) {
        let [x, y] = [at.0, at.1].map(short);
        let anchor = match set.align {
            Align::Start => "",
            Align::Middle => " text-anchor=\"middle\"",
            Align::End => " text-anchor=\"end\"",
        };
        let turn = if set.upwards { format!(" transform=\"rotate(-90 {x} {y})\"") } else { String::new() };
        let (size, fill) = (short(set.size), paint("fill", set.colour));
        self.add(format_args!("<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" {fill}{anchor}{turn}>"));
        let mut low = 0.0;
        for piece in pieces(text) {
            let plain = escaped(piece.text);
            let down = if piece.index { text::INDEX_DROP * set.size } else { 0.0 };
            if down == low && !piece.index {
                self.add(format_args!("{plain}"));
            } else {
                let (down, size) = (short(down - low), short(piece.size(set.size)));
                self.add(format_args!("<tspan dy=\"{down}\" font-size=\"{size}\">{plain}</tspan>"));
            }
            low = down;
        }
        self.add(format_args!("</text>\n"));
    }
}
