//! The colours of figures on light and on dark ground.

use super::super::colour::{Colour, rgb};
use super::super::heat::HATCH;
use super::super::style::{FRAME, GRID, INK, QUIET, Style, WHITE, fill};

/// A colour of the figures: its name in style sheets, as it is, and what stands for it on dark ground.
pub(crate) struct Shade {
    pub name: String,
    pub light: Colour,
    pub dark: Colour,
}

/// Every colour that charts use, each once.
pub(crate) fn palette() -> Vec<Shade> {
    let mut shades: Vec<Shade> = Vec::new();
    let mut add = |name: String, light: Colour, dark: Colour| {
        // What has one colour on light ground has one on dark ground: scripts translate by colour alone.
        let dark = shades.iter().find(|s| s.light == light).map_or(dark, |same| same.dark);
        shades.push(Shade { name, light, dark });
    };
    add("surface".into(), WHITE, rgb(0x1B, 0x20, 0x27));
    add("ink".into(), INK, rgb(0xE8, 0xEB, 0xEE));
    add("quiet".into(), QUIET, rgb(0xA9, 0xB3, 0xBD));
    add("frame".into(), FRAME, rgb(0x7A, 0x86, 0x92));
    add("grid".into(), GRID, rgb(0x33, 0x3B, 0x45));
    add("no-value".into(), HATCH, rgb(0x8A, 0x93, 0x9D));
    for style in Style::ALL {
        let dark = match style {
            Style::Blue => rgb(0x56, 0xA8, 0xE0),
            Style::Vermilion => rgb(0xF0, 0x7E, 0x33),
            Style::Black => rgb(0xF2, 0xF2, 0xF2),
            Style::Orange => rgb(0xF5, 0xC0, 0x4A),
            Style::Green => rgb(0x2E, 0xC4, 0x97),
            Style::Purple => rgb(0xDF, 0x94, 0xBF),
        };
        add(name(style).into(), style.colour(), dark);
    }
    let dark_fills = [
        (rgb(0x4A, 0x9E, 0xD8), WHITE),
        (rgb(0x1F, 0x3A, 0x4F), rgb(0x6F, 0xB9, 0xE8)),
        (rgb(0xE0, 0xA4, 0x2B), WHITE),
        (rgb(0x4A, 0x3A, 0x17), rgb(0xE5, 0xB8, 0x5A)),
        (rgb(0x2A, 0x30, 0x38), WHITE),
        (rgb(0xC9, 0xCE, 0xD3), WHITE),
    ];
    for (category, (ground, line)) in dark_fills.into_iter().enumerate() {
        let look = fill(category);
        add(format!("fill-{category}"), look.ground, ground);
        add(format!("hatch-{category}"), look.line, line);
    }
    shades
}

/// The name of a style's colour.
pub(super) fn name(style: Style) -> &'static str {
    match style {
        Style::Blue => "blue",
        Style::Vermilion => "vermilion",
        Style::Black => "black",
        Style::Orange => "orange",
        Style::Green => "green",
        Style::Purple => "purple",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_everything_can_be_seen_on_dark_ground() {
        let all = palette();
        let of = |name: &str| all.iter().find(|s| s.name == name).expect("a shade").dark;
        for text in ["ink", "quiet"] {
            assert!(of(text).contrast(of("surface")) > 4.5, "{text}");
        }
        for style in Style::ALL {
            assert!(of(name(style)).contrast(of("surface")) > 4.5, "{style:?}");
        }
    }

    #[test]
    fn law_scripts_can_translate_by_colour_alone() {
        let all = palette();
        for a in &all {
            assert!(all.iter().all(|b| a.light != b.light || a.dark == b.dark), "{}", a.name);
        }
    }
}
