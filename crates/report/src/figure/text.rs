//! Texts in the bundled font: how wide one is, its outline, its lines.

use tiny_skia::{Path, PathBuilder, Transform};

use super::letters::{letter, unit};

fn advance(c: char) -> f64 {
    f64::from(letter(c).advance) * unit()
}

/// Returns the width of a text without indices, in the unit of `em`, the type size.
pub(super) fn plain_width(text: &str, em: f64) -> f64 {
    em * text.chars().map(advance).sum::<f64>()
}

/// Returns the shapes of a text without indices, from the start of its baseline; none of blanks alone.
pub(super) fn outline(text: &str, em: f64) -> Option<Path> {
    let (mut path, mut x) = (PathBuilder::new(), 0.0);
    for letter in text.chars().map(letter) {
        letter.draw(&mut path, x);
        x += letter.advance;
    }
    #[expect(clippy::cast_possible_truncation, reason = "a type size needs no more than f32")]
    let scale = (em * unit()) as f32;
    path.finish()?.transform(Transform::from_scale(scale, -scale))
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
    crate::page::printable(text.to_owned()).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Breaks a text into lines no wider than `limit`, between its words. If one of them is wider, such as a path, sets the text as [`fit`] does.
pub(super) fn wrap(text: &str, em: f64, limit: f64) -> Vec<String> {
    if text.split_whitespace().any(|word| width(word, em) > limit) {
        return fit(text, em, limit);
    }
    lines(text, &[], em, limit, str::to_owned)
}

/// Sets a text in lines like [`wrap`], but cuts long words, first after their hyphens, points and underscores. The point of a
/// number is not such a place.
pub(super) fn fit(text: &str, em: f64, limit: f64) -> Vec<String> {
    lines(text, &['-', '.', '_', '/', '='], em, limit, |part| shorten(part, em, limit))
}

/// Returns the parts of a word, of which each but the last ends with a joint. After a joint before a digit the word goes on.
fn parts<'a>(word: &'a str, joints: &[char]) -> Vec<&'a str> {
    let (mut parts, mut start) = (Vec::new(), 0);
    for (at, joint) in word.match_indices(joints) {
        let end = at + joint.len();
        if !word[end..].starts_with(|next: char| next.is_ascii_digit()) && end < word.len() {
            parts.push(&word[start..end]);
            start = end;
        }
    }
    parts.push(&word[start..]);
    parts
}

fn lines(text: &str, joints: &[char], em: f64, limit: f64, alone: impl Fn(&str) -> String) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        for (index, part) in parts(word, joints).into_iter().enumerate() {
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

/// Returns the text if it is no wider than `limit`, otherwise its beginning and its end around an ellipsis.
pub(super) fn shorten_within(text: &str, em: f64, limit: f64) -> String {
    let letters: Vec<char> = text.chars().collect();
    let of = |kept: usize| -> String {
        let (first, last) = (kept.div_ceil(2), kept / 2);
        letters[..first].iter().chain(&['…']).chain(&letters[letters.len() - last..]).collect()
    };
    let shorter = (0..letters.len()).rev().map(of).find(|shorter| width(shorter, em) <= limit);
    if width(text, em) <= limit { text.to_owned() } else { shorter.unwrap_or_else(|| "…".to_owned()) }
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
    fn law_wrapping_keeps_lines_within_the_limit() {
        let lines = wrap("one two three four five", 10.0, 60.0);
        assert!(lines.len() > 1 && lines.iter().all(|line| width(line, 10.0) <= 60.0));
        assert_eq!(lines.join(" "), "one two three four five");
    }

    #[test]
    fn regress_a_path_is_broken_between_its_folders() {
        let lines = wrap("of /home/someone/traces/six_vectors.csv", 10.0, 100.0);
        assert!(lines.len() > 1 && lines.iter().all(|line| width(line, 10.0) <= 100.0), "{lines:?}");
        assert_eq!(lines.concat().replace(' ', ""), "of/home/someone/traces/six_vectors.csv");
    }

    #[test]
    fn law_long_names_are_cut_at_their_joints_before_they_are_shortened() {
        assert_eq!(fit("maximum-likelihood", 10.0, 70.0), ["maximum-", "likelihood"]);
        assert_eq!(fit("two 2.5", 10.0, 70.0), ["two 2.5"]);
        assert_eq!(fit("0.25", 10.0, 20.0).len(), 1);
        assert_eq!(fit("sensors.noise", 10.0, 50.0), ["sensors.", "noise"]);
        let cut = fit("Donaudampfschifffahrt", 10.0, 70.0);
        assert!(cut.len() == 1 && cut[0].ends_with('…') && width(&cut[0], 10.0) <= 70.0, "{cut:?}");
    }
}
