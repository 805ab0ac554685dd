//! Tolerances: keys whose values each trial draws.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use standstill_quantity::{rounded, si_power};
use standstill_sim::{Purpose, Streams};
use toml::Value;

use super::document::FileError;
use super::number::Number;

/// Distribution from which each trial draws a key's value. A width in per cent is a share of the mean, or percentage points if the mean is in
/// per cent. Any other width has a unit of the key's quantity.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tolerance {
    /// Standard deviation of a normal distribution, such as `"5 %"` or `"2 mA"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal: Option<String>,
    /// Half the width of a uniform distribution, such as `"5 %"` or `"2 mA"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uniform: Option<String>,
    /// Number of standard deviations at which a normal distribution is truncated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truncated: Option<f64>,
    /// Mean of the distribution. Default: the value in the scenario.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean: Option<String>,
}

/// A parsed tolerance, from which values are drawn.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Drawn {
    key: String,
    mean: Number,
    /// Standard deviation of a normal distribution, or half the width of a uniform distribution. Its unit is the unit of the mean.
    width: f64,
    /// Number of standard deviations at which the normal distribution is truncated. None if the distribution is uniform.
    cut: Option<f64>,
    /// Power of ten that converts a number from the unit of the mean to the SI unit. None if the unit is unknown.
    power: Option<i32>,
}

impl Drawn {
    /// Makes the tolerance of a key whose value in the scenario is `nominal`.
    pub(super) fn new(key: &str, tolerance: &Tolerance, nominal: Option<&Value>) -> Result<Self, FileError> {
        let path = format!("tolerances.{key}");
        let mean = match (&tolerance.mean, nominal) {
            (Some(mean), _) => Number::of(&Value::String(mean.clone())),
            (None, Some(value)) => Number::of(value),
            (None, None) => {
                let needed = "`mean`, or the key itself in the scenario";
                return Err(FileError::key(&path, "no value to spread about", needed));
            }
        };
        let mut mean = mean.ok_or_else(|| FileError::key(&path, "a value that is no number", "a number"))?;
        let (text, cut) = match (&tolerance.normal, &tolerance.uniform) {
            (Some(text), None) => (text, Some(tolerance.truncated.unwrap_or(f64::INFINITY))),
            (None, Some(text)) if tolerance.truncated.is_none() => (text, None),
            _ => {
                let needed = "one of `normal` and `uniform`; `truncated` only with `normal`";
                return Err(FileError::key(&path, "another combination", needed));
            }
        };
        let width = Number::of(&Value::String(text.clone())).filter(|width| width.value >= 0.0);
        let width =
            width.ok_or_else(|| FileError::key(&path, &format!("`{text}`"), "a width of zero or more"))?;
        let width = match width.unit.as_str() {
            "%" if mean.unit != "%" => mean.value.abs() * width.value / 100.0,
            _ => {
                let found = format!("`{text}` about {}", mean.to_value());
                let alike = Number::alike(mean, width);
                let needed = "a width in per cent or in a unit of the same dimension";
                let (middle, width) = alike.ok_or_else(|| FileError::key(&path, &found, needed))?;
                mean = middle;
                width.value
            }
        };
        // Truncated below 0.1 standard deviations, a normal distribution is practically uniform.
        if cut.is_some_and(|cut| cut.is_nan() || cut < 0.1) {
            return Err(FileError::key(&path, "`truncated` below 0.1", "at least 0.1 standard deviations"));
        }
        let power = si_power(&mean.unit);
        Ok(Self { key: key.to_owned(), mean, width, cut, power })
    }

    pub(super) fn key(&self) -> &str {
        &self.key
    }

    /// Draws the key's value for a trial.
    pub(super) fn draw(&self, streams: Streams) -> Value {
        self.value(self.number(streams))
    }

    /// Converts a number in the unit of the mean to a TOML value of the key.
    pub(super) fn value(&self, number: f64) -> Value {
        Number { value: number, ..self.mean.clone() }.to_value()
    }

    /// Converts a number in the unit of the mean to the SI unit. The result has the same bits as a number read from the document. Returns
    /// none if the unit is unknown.
    pub(super) fn si(&self, number: f64) -> Option<f64> {
        Some(rounded(number, self.power?))
    }

    /// Draws the key's number for a trial. Each key has its own stream of random numbers, so that adding a tolerance does not change the
    /// draws of other keys.
    pub(super) fn number(&self, streams: Streams) -> f64 {
        let mut draws = streams.open_named(Purpose::Tolerance, &self.key);
        let off = match self.cut {
            None => draws.uniform_in(-1.0..1.0),
            Some(cut) => draws.normal_within(cut),
        };
        self.mean.value + self.width * off
    }
}
