//! Breaking of texts into lines of a width.

use console::measure_text_width;

/// Fills lines of at most `width` characters with pieces. Each piece stands behind its gap, but for the first of a line. A longer piece
/// gets its own line.
fn filled<'a>(pieces: impl Iterator<Item = (&'a str, &'a str)>, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for (gap, piece) in pieces {
        let line = lines.last_mut().expect("a line");
        if line.is_empty() {
            line.push_str(piece);
        } else if measure_text_width(line) + gap.len() + measure_text_width(piece) <= width {
            line.push_str(gap);
            line.push_str(piece);
        } else {
            lines.push(piece.to_owned());
        }
    }
    lines
}

/// Wraps words to lines of at most `width` characters; a longer word gets its own line.
pub fn wrapped(text: &str, width: usize) -> Vec<String> {
    filled(text.split_whitespace().map(|word| (" ", word)), width)
}

/// Splits a title at the places where it may be wrapped: at spaces, and after the dots of keys. Each piece has the gap before it.
pub fn pieces(title: &str) -> impl Iterator<Item = (&str, &str)> {
    let words = title.split(' ').flat_map(|word| word.split_inclusive('.').enumerate());
    words.map(|(k, piece)| (if k == 0 { " " } else { "" }, piece))
}

/// Wraps a title to lines of at most this width; longer pieces are not split.
pub fn wrapped_title(title: &str, width: usize) -> Vec<String> {
    filled(pieces(title), width)
}
