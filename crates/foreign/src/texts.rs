//! Texts that a detector has at run time, kept for the rest of the program so that a record can be copied with them.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

/// Largest number of texts that are kept. A detector usually has a fixed list of reasons; beyond this number, one
/// common text replaces further ones.
const MOST: usize = 4096;

/// Letters of a text that are kept.
const LONGEST: usize = 300;

/// Returns a text for the rest of the program: each is kept once.
///
/// ```
/// let text = standstill_foreign::kept(&format!("no {}", "zero crossing"));
/// assert!(std::ptr::eq(text, standstill_foreign::kept("no zero crossing")));
/// ```
pub fn kept(text: &str) -> &'static str {
    static TEXTS: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    // A record is a line.
    let text: String = text.chars().take(LONGEST).map(|c| if c.is_control() { ' ' } else { c }).collect();
    let mut texts = TEXTS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = texts.get(text.as_str()) {
        return known;
    }
    if texts.len() >= MOST {
        return "a reason beside more than 4096 others";
    }
    let text: &'static str = text.leak();
    texts.insert(text);
    text
}
