//! Colours, and those of heat maps.

use super::backend::stroke_px;
use super::style::{INK, WHITE};
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};
use plotters::style::{RGBAColor, RGBColor, ShapeStyle};

/// Red, green, blue, and opacity from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Colour(pub u8, pub u8, pub u8, pub f64);

pub(super) const fn rgb(r: u8, g: u8, b: u8) -> Colour {
    Colour(r, g, b, 1.0)
}

impl Colour {
    pub fn faded(self, by: f64) -> Self {
        Self(self.0, self.1, self.2, self.3 * by)
    }

    /// Returns a filled shape, for plotters.
    pub(super) fn fill(self) -> ShapeStyle {
        ShapeStyle { color: RGBAColor(self.0, self.1, self.2, self.3), filled: true, stroke_width: 0 }
    }

    /// Returns a line so many logical pixels wide, for plotters.
    pub(super) fn stroke(self, width: f64) -> ShapeStyle {
        ShapeStyle { filled: false, stroke_width: stroke_px(width), ..self.fill() }
    }

    /// Returns the colour in hexadecimal notation, without opacity. Scripts of pages do not translate this notation to
    /// dark background.
    pub fn hex(self) -> String {
        format!("#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }

    /// Returns the colour as CSS and Plotly write it.
    pub fn css(self) -> String {
        let Self(r, g, b, a) = self;
        if a < 1.0 { format!("rgba({r},{g},{b},{a})") } else { format!("rgb({r},{g},{b})") }
    }

    /// Returns the luminance relative to white, by WCAG 2.
    fn luminance(self) -> f64 {
        let linear = |byte: u8| {
            let c = f64::from(byte) / 255.0;
            if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(self.0) + 0.7152 * linear(self.1) + 0.0722 * linear(self.2)
    }

    /// Returns the ratio of contrast after WCAG 2, from 1 to 21.
    pub(super) fn contrast(self, other: Self) -> f64 {
        let (a, b) = (self.luminance() + 0.05, other.luminance() + 0.05);
        a.max(b) / a.min(b)
    }
}

/// Returns the colour of a share from 0, light, to 1, dark; shares beyond have those of the ends.
///
/// Viridis of matplotlib (CC0), turned round: its steps look equally large, its lightness falls all the way, also to
/// the colour-blind and in grey, and on paper more is darker.
pub(super) fn colour(share: f64) -> Colour {
    let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    let RGBColor(r, g, b) = ViridisRGB.get_color(1.0 - share);
    rgb(r, g, b)
}

/// Returns the colours between which the others are mixed, each with its share.
pub(super) fn stops() -> impl Iterator<Item = (f64, Colour)> {
    (0..=9).map(|i| f64::from(i) / 9.0).map(|share| (share, colour(share)))
}

/// Returns black or white, whichever has more contrast to this colour.
pub(super) fn ink_on(ground: Colour) -> Colour {
    if WHITE.contrast(ground) > INK.contrast(ground) { WHITE } else { INK }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_lightness_falls_evenly() {
        // CIE lightness from 0 to 100.
        let lightness = |share| 116.0 * colour(share).luminance().cbrt() - 16.0;
        let steps: Vec<f64> = (0..=18).map(|i| lightness(f64::from(i) / 18.0)).collect();
        assert!(steps[0] > 89.0 && steps[18] < 16.0, "{steps:?}");
        for pair in steps.windows(2) {
            // 75 in 18 equal steps would be 4.2 each.
            assert!((2.0..6.0).contains(&(pair[0] - pair[1])), "{steps:?}");
        }
    }

    #[test]
    fn law_numbers_can_be_read_on_every_colour() {
        for i in 0..=100 {
            let ground = colour(f64::from(i) / 100.0);
            assert!(ink_on(ground).contrast(ground) > 4.0, "{i}");
        }
    }

    #[test]
    fn law_what_is_beyond_the_ends_has_their_colours() {
        assert_eq!(colour(-1.0), colour(0.0));
        assert_eq!(colour(f64::INFINITY), colour(1.0));
        assert_eq!(colour(f64::NAN), colour(0.0));
    }
}
