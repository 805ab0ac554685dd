//! Finds the known word that is nearest to an unknown one.

use standstill_plant::DataSheet;

use super::FaultMode;
use super::units::{motor_places, places};

/// Least Jaro–Winkler similarity, from 0 to 1, at which an unknown word may be a misspelling of a known one.
const NEAR: f64 = 0.75;

/// Similarity above which an unknown word is probably a misspelt key of the same table. Below it, the word is more probably a key of
/// another table.
const NEARLY_EQUAL: f64 = 0.9;

/// Returns the known word that is most similar to `word`; none if no word is similar enough.
///
/// ```
/// use standstill_scenario::nearest;
///
/// assert_eq!(nearest("noize", ["offset", "noise"]), Some("noise"));
/// assert_eq!(nearest("luck", ["offset", "noise"]), None);
/// ```
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    nearer(word, known, NEAR)
}

/// Returns the known word that is most similar to `word`; none if no similarity is above `least`.
fn nearer<'a>(word: &str, known: impl IntoIterator<Item = &'a str>, least: f64) -> Option<&'a str> {
    let like = known.into_iter().map(|known| (strsim::jaro_winkler(known, word), known));
    like.max_by(|(a, _), (b, _)| a.total_cmp(b)).filter(|(like, _)| *like > least).map(|(_, known)| known)
}

/// Quotes an unknown word for a message, and adds the known word that was probably meant, if there is one.
pub fn quoted<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    match nearest(word, known) {
        Some(near) => format!("`{word}` (did you mean `{near}`?)"),
        None => format!("`{word}`"),
    }
}

/// Returns the unknown word in a message of serde, and the words that serde expected.
pub(super) fn unknown(message: &str) -> Option<(String, Vec<String>)> {
    if !(message.starts_with("unknown field") || message.starts_with("unknown variant")) {
        return None;
    }
    let mut quoted = message.split('`').skip(1).step_by(2).map(str::to_owned);
    Some((quoted.next()?, quoted.collect()))
}

/// Returns the message about an unknown word in `table`. The message suggests the word that was probably meant: the most similar one of the
/// `known` words, or the same word in another table. `message` is the message of serde.
pub(super) fn suggest(message: &str, table: &str, word: &str, known: &[String]) -> String {
    if known.is_empty() {
        return message.to_owned();
    }
    let of_faults = known.iter().any(|known| known == FaultMode::PhaseOpen.name());
    if let Some(why) = FaultMode::refused(word).filter(|_| of_faults) {
        return format!("not simulated: {why}. Known: {}", known.join(", "));
    }
    // `[axes.sensors.noise]` lacks the quotes. In `[axes."sensors.noise"]`, an unknown word is a key of the axis
    // itself.
    let written = ["axes.", "tolerances."].iter().find_map(|dotted| table.strip_prefix(dotted));
    if let Some(key) = written.filter(|key| !key.starts_with('"')) {
        return format!("a key with dots is written in quotes here: \"{key}.{word}\" = …");
    }
    let known_words = || known.iter().map(String::as_str);
    let elsewhere = nearer(word, known_words(), NEARLY_EQUAL).is_none();
    if elsewhere && table != "axes" && written.is_none() && message.starts_with("unknown field") {
        if let Some(place) = places(word).first() {
            return format!("unknown; did you mean `{place}`? Known here: {}", known.join(", "));
        }
        let of_motor = motor_places(word);
        if table.is_empty() && DataSheet::nameplate_keys().contains(&word) {
            let own = of_motor.iter().find(|place| !place.starts_with("motor.nameplate"));
            let own = own.map_or_else(String::new, |place| format!(", or `{place}` of a motor without"));
            return format!(
                "unknown here: it is a key of the table [nameplate] in a motor's data sheet{own}"
            );
        }
        if !of_motor.is_empty() {
            return format!(
                "unknown here: a motor has `{}`; known here: {}",
                of_motor.join("`, `"),
                known.join(", ")
            );
        }
    }
    match nearest(word, known_words()) {
        Some(nearest) => format!("unknown; did you mean `{nearest}`? Known: {}", known.join(", ")),
        None => format!("unknown; known: {}", known.join(", ")),
    }
}
