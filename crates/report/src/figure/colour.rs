//! The colours of heat maps.

use super::style::{INK, WHITE, rgb};
use plotters::style::RGBAColor;

/// Viridis of matplotlib (CC0) at equal distances, turned round: its steps look equally large, its lightness falls all
/// the way, also to the colour-blind and in grey, and on paper more is darker.
const VIRIDIS: [(u8, u8, u8); 10] = [
    (0xFD, 0xE7, 0x25),
    (0xB4, 0xDE, 0x2C),
    (0x6D, 0xCD, 0x59),
    (0x35, 0xB7, 0x79),
    (0x1F, 0x9E, 0x89),
    (0x26, 0x82, 0x8E),
    (0x31, 0x68, 0x8E),
    (0x3E, 0x4A, 0x89),
    (0x48, 0x28, 0x78),
    (0x44, 0x01, 0x54),
];

/// The colour of a share from 0, light, to 1, dark; shares beyond have those of the ends.
pub(super) fn colour(share: f64) -> RGBAColor {
    let last = VIRIDIS.len() - 1;
    let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    let place = share * last as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
    let index = (place as usize).min(last - 1);
    let (from, to) = (VIRIDIS[index], VIRIDIS[index + 1]);
    let part = place - index as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between two bytes")]
    let mix = |a: u8, b: u8| (f64::from(a) + part * (f64::from(b) - f64::from(a))).round() as u8;
    rgb(mix(from.0, to.0), mix(from.1, to.1), mix(from.2, to.2))
}

/// The colours between which the others are mixed, each with its share.
pub(super) fn stops() -> impl Iterator<Item = (f64, RGBAColor)> {
    let last = VIRIDIS.len() - 1;
    (0..=last).map(move |i| i as f64 / last as f64).map(|share| (share, colour(share)))
}

/// Of black and white what is easier to read on a colour.
pub(super) fn ink_on(ground: RGBAColor) -> RGBAColor {
    let light = luminance(ground) + 0.05;
    // The ratios of contrast of WCAG.
    if 1.05 / light > light / (luminance(INK) + 0.05) { WHITE } else { INK }
}

/// Luminance of an sRGB colour relative to white.
fn luminance(RGBAColor(r, g, b, _): RGBAColor) -> f64 {
    let linear = |byte: u8| {
        let c = f64::from(byte) / 255.0;
        if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE lightness from 0 to 100.
    fn lightness(share: f64) -> f64 {
        116.0 * luminance(colour(share)).cbrt() - 16.0
    }

    #[test]
    fn law_lightness_falls_evenly() {
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
            let (a, b) = (luminance(ground) + 0.05, luminance(ink_on(ground)) + 0.05);
            assert!(a.max(b) / a.min(b) > 4.0, "{i}");
        }
    }

    #[test]
    fn law_what_is_beyond_the_ends_has_their_colours() {
        assert_eq!(colour(-1.0), colour(0.0));
        assert_eq!(colour(f64::INFINITY), colour(1.0));
        assert_eq!(colour(f64::NAN), colour(0.0));
    }
}
