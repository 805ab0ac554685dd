//! Colours, dashes, markers and fills.
//!
//! The colours are those of Okabe and Ito, which the common forms of colour blindness keep apart. Each style
//! also has its own dash pattern and marker, and its own lightness as far as six allow, for print in grey.

use super::colour::{Colour, rgb};

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

    pub(super) fn colour(self) -> Colour {
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

pub(super) const WHITE: Colour = rgb(0xFF, 0xFF, 0xFF);
pub(super) const INK: Colour = rgb(0x1A, 0x1A, 0x1A);
pub(super) const QUIET: Colour = rgb(0x55, 0x55, 0x55);
pub(super) const FRAME: Colour = rgb(0x70, 0x70, 0x70);
pub(super) const GRID: Colour = rgb(0xE2, 0xE2, 0xE2);

pub(super) const LINE_WIDTH: f64 = 1.5;
pub(super) const MARKER_RADIUS: f64 = 3.4;
pub(super) const RULE_DASHES: &[f64] = &[4.0, 3.0];

/// What a category of a lane is filled with.
pub(super) struct Fill {
    pub ground: Colour,
    /// In which direction the lines of its hatching go: down to the right (1), up (−1), or there are none (0).
    pub slope: f64,
    pub line: Colour,
}

/// Number of fills before they start over.
pub(super) const FILLS: usize = 6;

/// Pairs of a full colour and its hatched tint, then blank and dark: lightness tells them apart in grey, and
/// the direction of the hatching tells the two tints apart.
pub(super) fn fill(category: usize) -> Fill {
    let (ground, slope, line) = match category % FILLS {
        0 => (rgb(0x00, 0x5A, 0x94), 0.0, WHITE),
        1 => (rgb(0xC4, 0xDE, 0xEE), -1.0, rgb(0x00, 0x5A, 0x94)),
        2 => (rgb(0xE6, 0x9F, 0x00), 0.0, WHITE),
        3 => (rgb(0xFB, 0xEB, 0xC8), 1.0, rgb(0xA8, 0x6C, 0x00)),
        4 => (rgb(0xF4, 0xF4, 0xF4), 0.0, WHITE),
        _ => (rgb(0x30, 0x30, 0x30), 0.0, WHITE),
    };
    Fill { ground, slope, line }
}
