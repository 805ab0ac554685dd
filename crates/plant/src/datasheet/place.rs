//! Where a key stands in a text.

use std::ops::Range;

use toml::de::{DeTable, DeValue};

/// Where in a text of TOML the longest known part of a key's path stands, in bytes.
///
/// ```
/// use standstill_plant::key_span;
///
/// let text = "[winding]\nresistance = 1.2\n";
/// assert_eq!(key_span(text, "winding.resistance"), Some(10..20));
/// assert_eq!(key_span(text, "winding.leakage"), Some(1..8));
/// assert_eq!(key_span(text, "rotor"), None);
/// ```
pub fn key_span(text: &str, key: &str) -> Option<Range<usize>> {
    let root = DeTable::parse(text).ok()?;
    let mut table = root.get_ref();
    let mut found = None;
    let mut rest = key;
    while !rest.is_empty() {
        // Some keys have dots in them.
        let named = |wanted: &str| table.iter().find(|(name, _)| name.get_ref().as_ref() == wanted);
        let heads = std::iter::successors(Some(rest), |head| head.rsplit_once('.').map(|(head, _)| head));
        let Some((head, (name, value))) = heads.into_iter().find_map(|head| Some((head, named(head)?)))
        else {
            break;
        };
        rest = rest[head.len()..].trim_start_matches('.');
        found = Some(name.span());
        let DeValue::Table(below) = value.get_ref() else { break };
        table = below;
    }
    found
}

/// The number of the line, from 1, in which this byte of a text stands.
pub fn line_of(text: &str, position: usize) -> usize {
    text.bytes().take(position).filter(|byte| *byte == b'\n').count() + 1
}
