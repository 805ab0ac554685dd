//! The bundled font: how wide a text is, and its outline.

use std::sync::LazyLock;
use tiny_skia::{Path, PathBuilder, Transform};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// A subset of DejaVu Sans; `assets/README.md` describes how it is made.
static FONT: LazyLock<Face<'static>> = LazyLock::new(|| {
    Face::parse(include_bytes!("../../assets/DejaVuSans-subset.ttf"), 0).expect("the bundled font is valid")
});

/// Returns the type sizes per unit of the font.
fn unit() -> f64 {
    1.0 / f64::from(FONT.units_per_em())
}

fn glyph(c: char) -> GlyphId {
    // The first glyph is that of characters which the font has not.
    FONT.glyph_index(c).unwrap_or(GlyphId(0))
}

fn advance(c: char) -> f64 {
    f64::from(FONT.glyph_hor_advance(glyph(c)).unwrap_or(0)) * unit()
}

/// Returns the width of a text without indices, in the unit of `em`, the type size.
pub(super) fn plain_width(text: &str, em: f64) -> f64 {
    em * text.chars().map(advance).sum::<f64>()
}

/// Returns the shapes of a text without indices, from the start of its baseline; none of blanks alone.
pub(super) fn outline(text: &str, em: f64) -> Option<Path> {
    let mut shapes = Shapes { path: PathBuilder::new(), x: 0.0 };
    for c in text.chars() {
        FONT.outline_glyph(glyph(c), &mut shapes);
        shapes.x += FONT.glyph_hor_advance(glyph(c)).map_or(0.0, f32::from);
    }
    #[expect(clippy::cast_possible_truncation, reason = "a type size needs no more than f32")]
    let scale = (em * unit()) as f32;
    shapes.path.finish()?.transform(Transform::from_scale(scale, -scale))
}

/// Collects glyphs side by side.
struct Shapes {
    path: PathBuilder,
    x: f32,
}

impl OutlineBuilder for Shapes {
    fn move_to(&mut self, x: f32, y: f32) {
        self.path.move_to(self.x + x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.path.line_to(self.x + x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.path.quad_to(self.x + x1, y1, self.x + x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.path.cubic_to(self.x + x1, y1, self.x + x2, y2, self.x + x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}

/// Returns the width of a text, in the unit of `em`, the type size.
pub(super) fn width(text: &str, em: f64) -> f64 {
    pieces(text).iter().map(|piece| piece.width(em)).sum()
}

/// Returns the width of the widest line of a text.
pub(super) fn widest(text: &str, em: f64) -> f64 {
    text.lines().map(|line| width(line, em)).fold(0.0, f64::max)
}

/// Distance of an index below the baseline, relative to the type size.
pub(super) const INDEX_DROP: f64 = 0.2;

/// A part of a text that is set at one size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Piece<'a> {
    pub text: &'a str,
    pub index: bool,
}

impl Piece<'_> {
    pub fn size(&self, em: f64) -> f64 {
        if self.index { 0.75 * em } else { em }
    }

    pub fn width(&self, em: f64) -> f64 {
        plain_width(self.text, self.size(em))
    }
}

/// Splits a text at the indices of one-letter symbols, such as `i_a` or `θ_est`. An underscore inside a longer
/// word is that of a name and stays.
pub(super) fn pieces(text: &str) -> Vec<Piece<'_>> {
    let mut pieces = Vec::new();
    let mut start = 0;
    for (at, _) in text.match_indices('_') {
        let mut before = text[start..at].chars().rev();
        let symbol = before.next().is_some_and(char::is_alphabetic)
            && !before.next().is_some_and(char::is_alphanumeric);
        let rest = &text[at + 1..];
        let end = rest.find(|c: char| !c.is_alphanumeric()).unwrap_or(rest.len());
        if symbol && end > 0 {
            pieces.push(Piece { text: &text[start..at], index: false });
            pieces.push(Piece { text: &rest[..end], index: true });
            start = at + 1 + end;
        }
    }
    if start < text.len() {
        pieces.push(Piece { text: &text[start..], index: false });
    }
    pieces
}

/// Returns the text as content of an element.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Breaks a text into lines no wider than `limit`, if its words allow it.
pub(super) fn wrap(text: &str, em: f64, limit: f64) -> Vec<String> {
    lines(text, &[], em, limit, str::to_owned)
}

/// Sets a text in lines like [`wrap`], but cuts long words, first after their hyphens, points and underscores.
pub(super) fn fit(text: &str, em: f64, limit: f64) -> Vec<String> {
    lines(text, &['-', '.', '_', '/', '='], em, limit, |part| shorten(part, em, limit))
}

fn lines(text: &str, joints: &[char], em: f64, limit: f64, alone: impl Fn(&str) -> String) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        for (index, part) in word.split_inclusive(joints).enumerate() {
            let blank = if index == 0 { " " } else { "" };
            match lines.last_mut() {
                Some(line) if width(&format!("{line}{blank}{part}"), em) <= limit => {
                    *line += blank;
                    *line += part;
                }
                _ => lines.push(alone(part)),
            }
        }
    }
    lines
}

/// Returns the text if it is no wider than `limit`, otherwise its beginning with an ellipsis.
pub(super) fn shorten(text: &str, em: f64, limit: f64) -> String {
    if width(text, em) <= limit {
        return text.to_owned();
    }
    let mut kept: String = text.to_owned();
    while kept.pop().is_some() {
        let shorter = format!("{}…", kept.trim_end());
        if width(&shorter, em) <= limit {
            return shorter;
        }
    }
    "…".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_only_symbols_have_indices() {
        let of = |text| pieces(text).iter().map(|p| (p.text.to_owned(), p.index)).collect::<Vec<_>>();
        let plain = |text: &str| (text.to_owned(), false);
        let index = |text: &str| (text.to_owned(), true);
        assert_eq!(of("θ_est (°)"), [plain("θ"), index("est"), plain(" (°)")]);
        assert_eq!(of("L_d, L_q"), [plain("L"), index("d"), plain(", L"), index("q")]);
        assert_eq!(of("pulse_test_2"), [plain("pulse_test_2")]);
        assert_eq!(of("_ a_"), [plain("_ a_")]);
    }

    #[test]
    fn law_the_font_has_the_letters_of_the_trade() {
        for c in "Az09µΩΔαβγδθψωφλ°±−×·≤≥√²³⁻⁷₀₉→–—≈∞äöüß".chars()
        {
            assert_ne!(glyph(c).0, 0, "{c}");
        }
    }

    #[test]
    fn law_wrapping_keeps_lines_within_the_limit() {
        let lines = wrap("one two three four five", 10.0, 60.0);
        assert!(lines.len() > 1 && lines.iter().all(|line| width(line, 10.0) <= 60.0));
        assert_eq!(lines.join(" "), "one two three four five");
    }

    #[test]
    fn law_long_names_are_cut_at_their_joints_before_they_are_shortened() {
        assert_eq!(fit("maximum-likelihood", 10.0, 70.0), ["maximum-", "likelihood"]);
        assert_eq!(fit("two 2.5", 10.0, 70.0), ["two 2.5"]);
        let cut = fit("Donaudampfschifffahrt", 10.0, 70.0);
        assert!(cut.len() == 1 && cut[0].ends_with('…') && width(&cut[0], 10.0) <= 70.0, "{cut:?}");
    }
}
