//! A motor's numbers as other data sheets and controllers give them: those of `standstill convert`.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::{Value, json};
use standstill_plant::DataSheet;

use crate::commands;
use crate::error::LabError;

/// Numbers by the keys of `[nameplate]`, as they are typed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Request {
    numbers: BTreeMap<String, String>,
}

/// All ways of giving these numbers, the command that prints them, and the lines of a data sheet with those that are given.
pub(crate) fn answer(Request { numbers }: &Request) -> Result<Value, LabError> {
    let given = numbers.iter().map(|(key, value)| (key.as_str(), value.as_str()));
    let all = DataSheet::equal_numbers(given).map_err(LabError::of)?;
    // As the file's format writes them: `.36` and `007` are numbers to a reader, not to it.
    let value = |text: &str| match (text.parse::<i64>(), text.parse::<f64>()) {
        (Ok(number), _) => toml::Value::from(number),
        (_, Ok(number)) if number.is_finite() => toml::Value::from(number),
        _ => toml::Value::from(text),
    };
    let line = |(key, text): (&String, &String)| format!("{key} = {}\n", value(text.trim()));
    let lines: String = numbers.iter().map(line).collect();
    Ok(json!({
        "numbers": all,
        "command": commands::convert(numbers),
        "nameplate": format!("[nameplate]\n{lines}"),
    }))
}
