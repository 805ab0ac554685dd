//! Found value and requirement in the words of the file's format instead of names of Rust types.

use std::borrow::Cow;

use serde::de::{Expected, Unexpected};

/// Longer texts are not repeated whole.
const MOST_CHARACTERS: usize = 60;

/// Returns the found value, as TOML writes it.
pub(super) fn found(found: Unexpected<'_>) -> Cow<'static, str> {
    match found {
        Unexpected::Bool(flag) => flag.to_string().into(),
        Unexpected::Unsigned(number) => number.to_string().into(),
        Unexpected::Signed(number) => number.to_string().into(),
        // With its point: 5.0 is no 5 to TOML.
        Unexpected::Float(number) => format!("{number:?}").into(),
        Unexpected::Str(text) if text.chars().count() > MOST_CHARACTERS => {
            let begin: String = text.chars().take(MOST_CHARACTERS).collect();
            format!("the text {begin:?} …").into()
        }
        Unexpected::Str(text) => format!("the text {text:?}").into(),
        Unexpected::Seq => "a list".into(),
        Unexpected::Map => "a table".into(),
        other => other.to_string().into(),
    }
}

/// Returns the requirement in words: serde's names of types are translated, other words are unchanged.
pub(super) fn needed(expected: &dyn Expected) -> Cow<'static, str> {
    let words = expected.to_string();
    let whole = |most: u64| format!("a whole number from 0 to {most}").into();
    match words.as_str() {
        "u8" => whole(u8::MAX.into()),
        "u16" => whole(u16::MAX.into()),
        "u32" => whole(u32::MAX.into()),
        "u64" | "usize" => "a whole number, zero or more".into(),
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number".into(),
        "f32" | "f64" => "a number".into(),
        "a boolean" => "true or false".into(),
        "a string" | "a borrowed string" => "a text in quotes".into(),
        "a sequence" => "a list".into(),
        "a map" => "a table".into(),
        other => {
            let list =
                other.strip_prefix("a tuple of size ").or_else(|| other.strip_prefix("an array of length "));
            match list {
                Some(length) => format!("a list of {length}").into(),
                None if other.starts_with("struct ") => "a table".into(),
                None if other.starts_with("enum ") => "a text in quotes".into(),
                None => words.into(),
            }
        }
    }
}
