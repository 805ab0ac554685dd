//! The bundled font: how wide a text is, and its pixels.

use ab_glyph::{Font, FontRef, PxScale, PxScaleFont, ScaleFont, point};
use std::sync::LazyLock;

/// A subset of DejaVu Sans; `assets/README.md` says how it was made.
static FONT: LazyLock<FontRef<'static>> = LazyLock::new(|| {
    FontRef::try_from_slice(include_bytes!("../../assets/DejaVuSans-subset.ttf"))
        .expect("the bundled font is valid")
});

/// For SVG: the bundled font by name, then fonts of similar widths.
pub(super) const FAMILY: &str = "DejaVu Sans, Bitstream Vera Sans, Verdana, sans-serif";

fn scaled(em: f64) -> PxScaleFont<&'static FontRef<'static>> {
    // `ab_glyph` scales by the height from descent to ascent, CSS and typography by the em square.
    let em_height = FONT.units_per_em().map_or(1.0, |units| FONT.height_unscaled() / units);
    #[expect(clippy::cast_possible_truncation, reason = "a type size needs no more than f32")]
    let size = em as f32 * em_height;
    FONT.as_scaled(PxScale::from(size))
}

/// Calls `each` with every glyph and the distance of its origin from the start of the text; the total width.
fn advance(text: &str, em: f64, mut each: impl FnMut(ab_glyph::GlyphId, f32)) -> f32 {
    let font = scaled(em);
    let mut x = 0.0;
    let mut previous = None;
    for c in text.chars() {
        let id = font.glyph_id(c);
        if let Some(previous) = previous {
            x += font.kern(previous, id);
        }
        each(id, x);
        x += font.h_advance(id);
        previous = Some(id);
    }
    x
}

/// Width of a text without indices, in the unit of `em`, the type size.
pub(super) fn plain_width(text: &str, em: f64) -> f64 {
    f64::from(advance(text, em, |_, _| ()))
}

/// Width of a text, in the unit of `em`, the type size.
pub(super) fn width(text: &str, em: f64) -> f64 {
    pieces(text).iter().map(|piece| piece.width(em)).sum()
}

/// How far an index is below the baseline, per type size.
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

/// Calls `pixel` with the place of each inked pixel relative to the start of the baseline, and its coverage.
pub(super) fn pixels(text: &str, em: f64, mut pixel: impl FnMut(i32, i32, f64)) {
    let font = scaled(em);
    advance(text, em, |id, x| {
        let glyph = id.with_scale_and_position(font.scale, point(x, 0.0));
        if let Some(outline) = FONT.outline_glyph(glyph) {
            let corner = outline.px_bounds().min;
            #[expect(clippy::cast_possible_truncation, reason = "whole pixels inside the picture")]
            let (left, top) = (corner.x as i32, corner.y as i32);
            outline.draw(|dx, dy, coverage| {
                pixel(left + dx.cast_signed(), top + dy.cast_signed(), f64::from(coverage).clamp(0.0, 1.0));
            });
        }
    });
}

/// The text in lines no wider than `limit` as far as its words allow.
pub(super) fn wrap(text: &str, em: f64, limit: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width(&format!("{line} {word}"), em) <= limit => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// As [`wrap`], but long words are cut, first after their hyphens, points and underscores.
pub(super) fn fit(text: &str, em: f64, limit: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let mut first = true;
        for part in word.split_inclusive(['-', '.', '_', '/', '=']) {
            let blank = if first { " " } else { "" };
            match lines.last_mut() {
                Some(line) if width(&format!("{line}{blank}{part}"), em) <= limit => {
                    line.push_str(blank);
                    line.push_str(part);
                }
                _ => lines.push(shorten(part, em, limit)),
            }
            first = false;
        }
    }
    lines
}

/// The text, or as much of its beginning as is no wider than `limit`, and an ellipsis.
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
    fn only_symbols_have_indices() {
        let of = |text| pieces(text).iter().map(|p| (p.text.to_owned(), p.index)).collect::<Vec<_>>();
        let plain = |text: &str| (text.to_owned(), false);
        let index = |text: &str| (text.to_owned(), true);
        assert_eq!(of("θ_est (°)"), [plain("θ"), index("est"), plain(" (°)")]);
        assert_eq!(of("L_d, L_q"), [plain("L"), index("d"), plain(", L"), index("q")]);
        assert_eq!(of("pulse_test_2"), [plain("pulse_test_2")]);
        assert_eq!(of("_ a_"), [plain("_ a_")]);
    }

    #[test]
    fn the_font_has_the_letters_of_the_trade() {
        for c in "Az09µΩΔαβγδθψωφλ°±−×·≤≥√²³⁻⁷₀₉→–—≈∞äöüß".chars()
        {
            assert_ne!(FONT.glyph_id(c).0, 0, "{c}");
        }
    }

    #[test]
    fn wrapping_keeps_lines_within_the_limit() {
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
