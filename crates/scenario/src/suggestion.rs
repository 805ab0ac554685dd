//! What was meant by a word that is not known.

/// Below this likeness (Jaro and Winkler's, from 0 to 1) a word is no misspelling of another.
const NEAR: f64 = 0.75;

/// The known word that is most like this one, if any is much like it.
///
/// ```
/// use standstill_scenario::nearest;
///
/// assert_eq!(nearest("noize", ["offset", "noise"]), Some("noise"));
/// assert_eq!(nearest("luck", ["offset", "noise"]), None);
/// ```
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let like = known.into_iter().map(|known| (strsim::jaro_winkler(known, word), known));
    like.max_by(|(a, _), (b, _)| a.total_cmp(b)).filter(|(like, _)| *like > NEAR).map(|(_, known)| known)
}

/// A word that is not known as a message quotes it, with the known one that may have been meant.
pub fn quoted<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    match nearest(word, known) {
        Some(near) => format!("`{word}` (did you mean `{near}`?)"),
        None => format!("`{word}`"),
    }
}
