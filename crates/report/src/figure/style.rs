//! Colours, dashes, markers and fills.
//!
//! The colours are those of Okabe and Ito, which remain distinct in the common forms of colour blindness. Each style
//! also has its own dash pattern and marker and, as far as possible with six styles, its own lightness, for print in
//! grey.

use super::colour::{Colour, rgb};

/// Look of a series.
///
/// Styles differ in colour and in dashes or lightness, so that they remain distinct in grey.
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
    /// Style of phase a: dark, solid, disc.
    PhaseA,
    /// Style of phase b: of middle lightness, dashed, open square.
    PhaseB,
    /// Style of phase c: light, dotted, cross.
    PhaseC,
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

    /// Makes the style of the series with this index, starting over after six.
    pub fn nth(index: usize) -> Self {
        Self::ALL[index % Self::ALL.len()]
    }

    /// The styles of the phases a, b and c, which have the same colours in every figure and in the lab. No series of another kind
    /// has one of them.
    pub const PHASES: [Self; 3] = [Self::PhaseA, Self::PhaseB, Self::PhaseC];

    /// Returns the name in style sheets, the colours on light and dark background, the dashes and the marker.
    #[rustfmt::skip]
    fn look(self) -> (&'static str, Colour, Colour, &'static [f64], Marker) {
        match self {
            Self::Blue => ("blue", rgb(0x00, 0x72, 0xB2), rgb(0x56, 0xA8, 0xE0), &[], Marker::Disc),
            Self::Vermilion => ("vermilion", rgb(0xD5, 0x5E, 0x00), rgb(0xF0, 0x7E, 0x33), &[7.0, 3.0], Marker::Square),
            Self::Black => ("black", rgb(0x11, 0x11, 0x11), rgb(0xF2, 0xF2, 0xF2), &[2.0, 2.2], Marker::Cross),
            Self::Orange => ("orange", rgb(0xE6, 0x9F, 0x00), rgb(0xF5, 0xC0, 0x4A), &[], Marker::Triangle),
            Self::Green =>
                ("green", rgb(0x00, 0x9E, 0x73), rgb(0x2E, 0xC4, 0x97), &[9.0, 3.0, 2.0, 3.0], Marker::Diamond),
            Self::Purple =>
                ("purple", rgb(0xCC, 0x79, 0xA7), rgb(0xDF, 0x94, 0xBF), &[9.0, 2.5, 2.0, 2.5, 2.0, 2.5], Marker::Plus),
            // Those of lab.css, --a, --b and --c.
            Self::PhaseA => ("phase-a", rgb(0x00, 0x3F, 0x73), rgb(0x3D, 0x8B, 0xD4), &[], Marker::Disc),
            Self::PhaseB => ("phase-b", rgb(0xC2, 0x4E, 0x00), rgb(0xFF, 0xC5, 0x8F), &[7.0, 3.0], Marker::Square),
            Self::PhaseC => ("phase-c", rgb(0x1F, 0xA0, 0x78), rgb(0x46, 0xC2, 0x98), &[2.0, 2.2], Marker::Cross),
        }
    }

    pub(super) fn colour(self) -> Colour {
        self.look().1
    }

    /// Lengths of strokes and gaps in turn, in logical pixels; empty for a solid line.
    pub(super) fn dashes(self) -> &'static [f64] {
        self.look().3
    }

    pub(super) fn marker(self) -> Marker {
        self.look().4
    }
}

pub(super) const WHITE: Colour = rgb(0xFF, 0xFF, 0xFF);
pub(super) const INK: Colour = rgb(0x1A, 0x1A, 0x1A);
pub(super) const QUIET: Colour = rgb(0x55, 0x55, 0x55);
pub(super) const FRAME: Colour = rgb(0x70, 0x70, 0x70);
pub(super) const GRID: Colour = rgb(0xE2, 0xE2, 0xE2);

/// Hatching of cells without value: no colour of heat maps is grey.
pub(super) const HATCH: Colour = rgb(0x8C, 0x8C, 0x8C);

pub(super) const LINE_WIDTH: f64 = 1.5;
pub(super) const MARKER_RADIUS: f64 = 3.4;
pub(super) const RING_RADIUS: f64 = 4.6;
pub(super) const RULE_DASHES: &[f64] = &[4.0, 3.0];

/// The fill of a category of a lane, on light and on dark ground.
pub(super) struct Fill {
    pub ground: Colour,
    /// Slope of the hatching's lines: down to the right (1), up (−1), or no lines (0).
    pub slope: f64,
    pub line: Colour,
    dark: (Colour, Colour),
}

/// Number of fills before they start over.
pub(super) const FILLS: usize = 6;

const fn filled(ground: Colour, slope: f64, line: Colour, dark: (Colour, Colour)) -> Fill {
    Fill { ground, slope, line, dark }
}

const FILL: [Fill; FILLS] = [
    filled(rgb(0x00, 0x5A, 0x94), 0.0, WHITE, (rgb(0x4A, 0x9E, 0xD8), WHITE)),
    filled(
        rgb(0xC4, 0xDE, 0xEE),
        -1.0,
        rgb(0x00, 0x5A, 0x94),
        (rgb(0x1F, 0x3A, 0x4F), rgb(0x6F, 0xB9, 0xE8)),
    ),
    filled(rgb(0xE6, 0x9F, 0x00), 0.0, WHITE, (rgb(0xE0, 0xA4, 0x2B), WHITE)),
    filled(rgb(0xFB, 0xEB, 0xC8), 1.0, rgb(0xA8, 0x6C, 0x00), (rgb(0x4A, 0x3A, 0x17), rgb(0xE5, 0xB8, 0x5A))),
    filled(rgb(0xF4, 0xF4, 0xF4), 0.0, WHITE, (rgb(0x2A, 0x30, 0x38), WHITE)),
    filled(rgb(0x30, 0x30, 0x30), 0.0, WHITE, (rgb(0xC9, 0xCE, 0xD3), WHITE)),
];

/// Pairs of a full colour and its hatched tint, then blank and dark: they differ in lightness, for print in
/// grey, and the two tints in the direction of their hatching.
pub(super) fn fill(category: usize) -> &'static Fill {
    &FILL[category % FILLS]
}

/// A colour of the figures: its name in style sheets, and the colours on light and dark background.
pub(crate) struct Shade {
    pub name: String,
    pub light: Colour,
    pub dark: Colour,
}

/// Returns every colour that charts use.
pub(crate) fn palette() -> Vec<Shade> {
    let mut shades: Vec<Shade> = Vec::new();
    let mut add = |name: &str, light: Colour, dark: Colour| {
        // What has one colour on light ground has one on dark ground: scripts translate by colour alone.
        let dark = shades.iter().find(|s| s.light == light).map_or(dark, |same| same.dark);
        shades.push(Shade { name: name.to_owned(), light, dark });
    };
    add("surface", WHITE, rgb(0x1B, 0x20, 0x27));
    add("ink", INK, rgb(0xE8, 0xEB, 0xEE));
    add("quiet", QUIET, rgb(0xA9, 0xB3, 0xBD));
    add("frame", FRAME, rgb(0x7A, 0x86, 0x92));
    add("grid", GRID, rgb(0x33, 0x3B, 0x45));
    add("no-value", HATCH, rgb(0x8A, 0x93, 0x9D));
    for (name, light, dark, ..) in Style::ALL.into_iter().chain(Style::PHASES).map(Style::look) {
        add(name, light, dark);
    }
    for (index, look) in FILL.iter().enumerate() {
        add(&format!("fill-{index}"), look.ground, look.dark.0);
        add(&format!("hatch-{index}"), look.line, look.dark.1);
    }
    shades
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_everything_can_be_seen_on_dark_ground() {
        let all = palette();
        let of = |name: &str| all.iter().find(|s| s.name == name).expect("a shade").dark;
        let styles = Style::ALL.into_iter().chain(Style::PHASES).map(|style| style.look().0);
        for name in styles.chain(["ink", "quiet"]) {
            assert!(of(name).contrast(of("surface")) > 4.5, "{name}");
        }
    }

    #[test]
    fn law_a_phase_has_one_colour_in_figures_and_in_the_lab_and_grey_keeps_phases_apart() {
        let css = include_str!("../../../lab/page/lab.css");
        let shades = palette();
        let of = |name: &str| shades.iter().find(|shade| shade.name == name).expect("a shade");
        for (is_dark, times) in [(false, 1), (true, 2)] {
            let theme = |shade: &Shade| if is_dark { shade.dark } else { shade.light };
            let phases = ["a", "b", "c"].map(|letter| {
                let colour = theme(of(&format!("phase-{letter}")));
                let written = format!("--{letter}:{};", colour.hex());
                assert_eq!(css.matches(&written).count(), times, "{written} in lab.css");
                assert!(colour.contrast(theme(of("surface"))) > 3.0, "{written} on its ground");
                colour
            });
            for (one, other) in [(0, 1), (1, 2), (0, 2)] {
                assert!(phases[one].contrast(phases[other]) > 1.25, "{one} and {other} in grey");
            }
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
