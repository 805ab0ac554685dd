//! Figures as SVG documents. Text stays text.

use super::backend::{Point, Surface, Type};
use super::colour::Colour;
use super::text::{self, escaped, pieces};
use plotters_backend::text_anchor::HPos;
use std::fmt::Write;

/// The bundled font by name, then fonts of similar widths.
const FAMILY: &str = "DejaVu Sans, Bitstream Vera Sans, Verdana, sans-serif";

#[derive(Default)]
pub(super) struct Svg {
    out: String,
    /// Beginning of the current element, and the text that ends it: consecutive strokes of one look share an element,
    /// and so do discs.
    open: (String, &'static str),
}

impl Svg {
    pub fn new(width: u32, height: u32) -> Self {
        let out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"{FAMILY}\" stroke-linejoin=\"round\">\n"
        );
        Self { out, open: (String::new(), "") }
    }

    pub fn finish(mut self) -> String {
        self.open(String::new(), "");
        self.out + "</svg>\n"
    }

    /// Begins an element, unless the last one began alike.
    fn open(&mut self, begin: String, end: &'static str) {
        if self.open.0 != begin || begin.is_empty() {
            self.out += self.open.1;
            self.out += &begin;
            self.open = (begin, end);
        }
    }

    /// Appends to the current element; writing to memory cannot fail.
    fn add(&mut self, part: std::fmt::Arguments) {
        let _ = self.out.write_fmt(part);
    }

    fn path(&mut self, points: &[Point]) {
        for (index, (x, y)) in points.iter().enumerate() {
            let to = if index == 0 { 'M' } else { 'L' };
            self.add(format_args!("{to}{} {}", short(*x), short(*y)));
        }
    }
}

/// Returns a length to a hundredth of a pixel.
fn short(length: f64) -> String {
    let text = format!("{:.2}", length.clamp(-1e6, 1e6));
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Returns the attribute of a colour, and one of its opacity if it is translucent.
fn paint(attribute: &str, colour: Colour) -> String {
    let opacity =
        if colour.3 < 1.0 { format!(" {attribute}-opacity=\"{}\"", short(colour.3)) } else { String::new() };
    format!("{attribute}=\"{}\"{opacity}", colour.hex())
}

impl Surface for Svg {
    fn stroke(&mut self, points: &[Point], colour: Colour, width: f64) {
        let (stroke, width) = (paint("stroke", colour), short(width));
        self.open(format!("<path fill=\"none\" {stroke} stroke-width=\"{width}\" d=\""), "\"/>\n");
        self.path(points);
    }

    fn polygon(&mut self, corners: &[Point], colour: Colour) {
        self.open(String::new(), "");
        self.add(format_args!("<path {} d=\"", paint("fill", colour)));
        self.path(corners);
        self.add(format_args!("z\"/>\n"));
    }

    fn disc(&mut self, (x, y): Point, radius: f64, ring: Option<f64>, colour: Colour) {
        let look = match ring {
            Some(width) => {
                format!("fill=\"none\" {} stroke-width=\"{}\"", paint("stroke", colour), short(width))
            }
            None => paint("fill", colour),
        };
        self.open(format!("<g {look}>\n"), "</g>\n");
        let [x, y, r] = [x, y, radius].map(short);
        self.add(format_args!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"/>\n"));
    }

    fn text(&mut self, text: &str, at: Point, set: Type) {
        self.open(String::new(), "");
        let [x, y] = [at.0, at.1].map(short);
        let anchor = match set.align {
            HPos::Left => "",
            HPos::Center => " text-anchor=\"middle\"",
            HPos::Right => " text-anchor=\"end\"",
        };
        let turn = match set.turn {
            0 => String::new(),
            degrees => format!(" transform=\"rotate({degrees} {x} {y})\""),
        };
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
