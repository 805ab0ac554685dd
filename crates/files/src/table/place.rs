//! Position of a key in a text.

use std::borrow::Cow;
use std::ops::Range;

use toml::de::{DeTable, DeValue};

/// Returns the position in bytes, in a text of TOML, of the longest part of a key's path that occurs there.
///
/// ```
/// use standstill_files::key_span;
///
/// let text = "[winding]\nresistance = 1.2\n";
/// assert_eq!(key_span(text, "winding.resistance"), Some(10..20));
/// assert_eq!(key_span(text, "winding.leakage"), Some(1..8));
/// assert_eq!(key_span(text, "rotor"), None);
/// // A part with dots may be written in quotes, and a place in a list is that of the list.
/// let text = "[axes]\n\"sensors.noise\" = [1, 2]\n";
/// assert_eq!(key_span(text, "axes.sensors.noise"), Some(7..22));
/// assert_eq!(key_span(text, "axes.\"sensors.noise\"[1]"), Some(7..22));
/// ```
pub fn key_span(text: &str, key: &str) -> Option<Range<usize>> {
    let root = DeTable::parse(text).ok()?;
    let mut table = root.get_ref();
    let mut found = None;
    let mut rest = key;
    while !rest.is_empty() {
        let named = |wanted: &str| table.iter().find(|(name, _)| name.get_ref().as_ref() == wanted);
        if rest.starts_with('"') {
            let written = |name: &str| rest.strip_prefix(quoted(name).as_ref()).map(str::len);
            let Some((left, name, value)) =
                table.iter().find_map(|(name, value)| Some((written(name.get_ref())?, name, value)))
            else {
                break;
            };
            rest = rest[rest.len() - left..].trim_start_matches('.');
            found = Some(name.span());
            let DeValue::Table(below) = value.get_ref() else { break };
            table = below;
            continue;
        }
        // Some keys have dots in them; of a list, its place in it does not count.
        let heads = std::iter::successors(Some(rest), |head| head.rfind(['.', '[']).map(|end| &head[..end]));
        let Some((head, (name, value))) = heads.into_iter().find_map(|head| Some((head, named(head)?)))
        else {
            break;
        };
        rest = rest[head.len()..].trim_start_matches('.');
        found = Some(name.span());
        let mut value = value;
        // The table in a list of them that a number in brackets names.
        if let DeValue::Array(list) = value.get_ref()
            && let Some((number, left)) = rest.strip_prefix('[').and_then(|rest| rest.split_once(']'))
            && let Some(below) = number.parse::<usize>().ok().and_then(|number| list.get(number))
        {
            (value, rest) = (below, left.trim_start_matches('.'));
            found = Some(below.span());
        }
        let DeValue::Table(below) = value.get_ref() else { break };
        table = below;
    }
    found
}

/// Returns a part of a key's path as TOML writes it: in quotes unless it has only letters, digits, dashes and
/// underscores.
///
/// ```
/// use standstill_files::quoted;
///
/// assert_eq!((quoted("L_d").as_ref(), quoted("sensors.noise").as_ref()), ("L_d", "\"sensors.noise\""));
/// ```
pub fn quoted(part: &str) -> Cow<'_, str> {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !part.is_empty() && part.chars().all(bare) { part.into() } else { format!("{part:?}").into() }
}

/// Returns the message of a parser's error in one line; of a key that is there twice, with the key.
pub fn syntax(text: &str, error: &toml::de::Error) -> String {
    let message = error.message().replace('\n', " ");
    let word = error
        .span()
        .and_then(|span| text.get(span))
        .filter(|word| message == "duplicate key" && !word.is_empty());
    word.map_or(message.clone(), |word| format!("{message} `{}`", word.trim()))
}

/// Returns the number of the line, from 1, in which this byte of a text stands.
pub fn line_of(text: &str, position: usize) -> usize {
    text.bytes().take(position).filter(|byte| *byte == b'\n').count() + 1
}
