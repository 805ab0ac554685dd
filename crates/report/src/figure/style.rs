//! Colours, dashes, markers and fills.
//!
//! The colours are those of Okabe and Ito, which the common forms of colour blindness keep apart. Each style
//! also has its own dash pattern and marker, and its own lightness as far as six allow, for print in grey.

use plotters::style::RGBAColor;

/// How a series looks.
///
/// Styles differ in colour and in dashes or lightness, so that they remain apart in grey.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Blue, solid, disc.
    Blue,
    /// Vermilion, dashed, open square.
    Vermilion,
    /// Black, dotted, cross.
    Black,
    /// Light orange, solid, triangle.
    Orange,
    /// Green, dash-dotted, open diamond.
    Green,
    /// Purple, dash-dot-dotted, plus.
    Purple,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Marker {
    Disc,
    Square,
    Cross,
    Triangle,
    Diamond,
    Plus,
}

impl Style {
    /// All styles, in the order in which the series of one panel should use them.
    pub const ALL: [Self; 6] =
        [Self::Blue, Self::Vermilion, Self::Black, Self::Orange, Self::Green, Self::Purple];

    /// The style of the series with this index, starting over after six.
    pub fn nth(index: usize) -> Self {
        Self::ALL[index % Self::ALL.len()]
    }

    pub(super) fn colour(self) -> RGBAColor {
        match self {
            Self::Blue => rgb(0x00, 0x72, 0xB2),
            Self::Vermilion => rgb(0xD5, 0x5E, 0x00),
            Self::Black => rgb(0x11, 0x11, 0x11),
            Self::Orange => rgb(0xE6, 0x9F, 0x00),
            Self::Green => rgb(0x00, 0x9E, 0x73),
            Self::Purple => rgb(0xCC, 0x79, 0xA7),
        }
    }

    /// Lengths of strokes and gaps in turn, in logical pixels; empty for a solid line.
    pub(super) fn dashes(self) -> &'static [f64] {
        match self {
            Self::Blue | Self::Orange => &[],
            Self::Vermilion => &[7.0, 3.0],
            Self::Black => &[2.0, 2.2],
            Self::Green => &[9.0, 3.0, 2.0, 3.0],
            Self::Purple => &[9.0, 2.5, 2.0, 2.5, 2.0, 2.5],
        }
    }

    pub(super) fn marker(self) -> Marker {
        match self {
            Self::Blue => Marker::Disc,
            Self::Vermilion => Marker::Square,
            Self::Black => Marker::Cross,
            Self::Orange => Marker::Triangle,
            Self::Green => Marker::Diamond,
            Self::Purple => Marker::Plus,
        }
    }
}

pub(super) const fn rgb(r: u8, g: u8, b: u8) -> RGBAColor {
    RGBAColor(r, g, b, 1.0)
}

pub(super) fn faded(RGBAColor(r, g, b, a): RGBAColor, by: f64) -> RGBAColor {
    RGBAColor(r, g, b, a * by)
}

pub(super) const WHITE: RGBAColor = rgb(0xFF, 0xFF, 0xFF);
pub(super) const INK: RGBAColor = rgb(0x1A, 0x1A, 0x1A);
pub(super) const QUIET: RGBAColor = rgb(0x55, 0x55, 0x55);
pub(super) const FRAME: RGBAColor = rgb(0x70, 0x70, 0x70);
pub(super) const GRID: RGBAColor = rgb(0xE2, 0xE2, 0xE2);

pub(super) const LINE_WIDTH: f64 = 1.5;
pub(super) const MARKER_RADIUS: f64 = 3.4;
pub(super) const RULE_DASHES: &[f64] = &[4.0, 3.0];

/// The direction in which the lines of a hatching go up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Hatch {
    None,
    Right,
    Left,
}

/// What a category of a lane is filled with.
pub(super) struct Fill {
    pub ground: RGBAColor,
    pub hatch: Hatch,
    pub line: RGBAColor,
}

/// Pairs of a full colour and its hatched tint, then blank and dark: lightness tells them apart in grey, and
/// the direction of the hatching tells the two tints apart.
pub(super) fn fill(category: usize) -> Fill {
    let (ground, hatch, line) = match category % 6 {
        0 => (rgb(0x00, 0x5A, 0x94), Hatch::None, WHITE),
        1 => (rgb(0xC4, 0xDE, 0xEE), Hatch::Right, rgb(0x00, 0x5A, 0x94)),
        2 => (rgb(0xE6, 0x9F, 0x00), Hatch::None, WHITE),
        3 => (rgb(0xFB, 0xEB, 0xC8), Hatch::Left, rgb(0xA8, 0x6C, 0x00)),
        4 => (rgb(0xF4, 0xF4, 0xF4), Hatch::None, WHITE),
        _ => (rgb(0x30, 0x30, 0x30), Hatch::None, WHITE),
    };
    Fill { ground, hatch, line }
}
