//! The question of `check` with its answer, and how its sentences format numbers and settings.

use standstill_analysis::{Demands, Effort, Setting, Suitability};
use standstill_plant::{DataSheet, Motor};
use standstill_quantity::significant;
use standstill_scenario::ErrorSet;

/// A question to `check`, with its answer.
pub struct Checked<'a> {
    pub motor: &'a Motor,
    /// The motor or file, as named on the command line.
    pub named: &'a str,
    pub errors: ErrorSet,
    pub sheet: &'a DataSheet,
    pub demands: &'a Demands,
    pub effort: Effort,
    pub found: &'a Suitability,
    /// Warning that the polarity signature set by the scenario is doubtful. None if it is not doubtful.
    pub signature: Option<&'a str>,
    /// Doubts about the numbers of the data sheet.
    pub doubts: &'a [String],
    /// Keys of the data sheet with the numbers that are probably meant. Empty without a guess.
    pub meant: &'a [(String, String)],
    /// Keys set on the command line in addition to the motor or file.
    pub keys: Vec<(String, String)>,
}

/// Formats a value that is already in per cent.
pub fn percent(share: f64) -> String {
    format!("{} %", standstill_quantity::rounded(share, 2))
}

/// Formats a share between 0 and 1. The text is in per cent if the share is at least 1e-4.
pub fn share(value: f64) -> String {
    match value {
        v if v < 1e-9 => "one in a billion".to_owned(),
        v if v < 1e-4 => format!("{v:.0e}"),
        v => format!("{:.2} %", 100.0 * v),
    }
}

/// Formats a method and the keys of its settings.
pub fn setting(setting: &Setting) -> String {
    match keys(setting) {
        keys if keys.is_empty() => setting.method.to_string(),
        keys => format!("{} with {keys}", setting.method),
    }
}

pub fn keys(setting: &Setting) -> String {
    let keys: Vec<String> =
        setting.keys.iter().map(|(key, value)| format!("{} {value}", key.replace('_', " "))).collect();
    keys.join(", ")
}

/// Formats a current in A, with enough digits for motors of a few milliamperes.
pub fn amperes(value: f64) -> String {
    if value > 0.0 { standstill_quantity::number(1, value) } else { "–".to_owned() }
}

pub fn milliseconds(seconds: f64) -> String {
    if seconds.is_finite() { standstill_quantity::number(1, seconds * 1e3) } else { "–".to_owned() }
}

/// Formats a factor with two digits. The factor comes from few angles and starts, so more digits would not be significant.
pub fn factor(value: f64) -> String {
    if value < 9.95 { format!("{value:.1}") } else { format!("{:.0}", significant(value, 2)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_a_factor_has_two_digits() {
        let found = [1.04, 9.94, 9.96, 17.4, 99.6, 164.3, 3149.0].map(factor);
        assert_eq!(found, ["1.0", "9.9", "10", "17", "100", "160", "3100"]);
    }
}
