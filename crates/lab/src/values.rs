//! Effective values of all keys in a setting, as the controls show them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::json;
use standstill_detect::keys as methods;
use standstill_plant::Motor;
use standstill_quantity::{Scale, any_quantity, rounded};
use standstill_scenario::{Key, ScenarioFile, Values, keys, written};
use toml::Value;

use crate::bench::{Bench, Ready};
use crate::commands;
use crate::error::LabError;
use crate::setting::Setting;

/// A request for the values of a setting's trial.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Request {
    setting: Setting,
    trial: u64,
    angle: Option<f64>,
    trials: u64,
}

/// State of a control.
#[derive(Debug, PartialEq, Serialize)]
struct Shown {
    /// Value in SI, for angles in degrees; the name for a choice.
    value: Option<Value>,
    /// Value as a text with its unit.
    text: String,
    /// Value without a change by the page.
    default: String,
    /// Range of the slider; none for keys without slider.
    slider: Option<[f64; 2]>,
    /// True if the key has an effect in this scenario.
    there: bool,
}

pub(crate) fn answer(bench: &Bench, request: &Request) -> Result<serde_json::Value, LabError> {
    let Request { setting, trial, angle, trials } = request;
    let ready = bench.ready(setting)?;
    let motor = &ready.scenario.motor;
    let file = ready.plan.file_at(ready.point)?;
    let mut defaults = BTreeMap::new();
    for key in setting.set.keys() {
        // What others rest on cannot be left out: then there is no default.
        let Ok(without) = bench.ready(&setting.without(key)) else { continue };
        let file = without.plan.file_at(without.point)?;
        defaults.insert(key.as_str(), (without, file));
    }
    let mut values = BTreeMap::new();
    for key in keys() {
        let value = value(key.path, &ready, &file);
        let text = value.as_ref().map_or_else(String::new, |value| text(value, key));
        let own = setting.set.contains_key(key.path);
        let default = match defaults.get(key.path) {
            Some((ready, file)) => self::value(key.path, ready, file),
            None if own => None,
            None => value.clone(),
        };
        let slider = slider(key, default.as_ref().or(value.as_ref()), value.as_ref(), motor);
        let default = default.as_ref().map_or_else(String::new, |value| self::text(value, key));
        let there = is_there(key, value.is_some(), &ready);
        values.insert(key.path, Shown { value, text, default, slider, there });
    }
    let sheet = ready.document.data_sheet()?;
    let entries: Vec<_> = sheet
        .entries()
        .into_iter()
        .map(|entry| {
            json!({ "key": format!("motor.{}", entry.key), "text": entry.value,
            "source": entry.source.to_string(), "reason": entry.reason })
        })
        .collect();
    let points: Vec<String> = ready
        .plan
        .points()
        .iter()
        .map(|point| {
            let values = point.values.iter().map(|(key, value)| format!("{key} = {}", written(value)));
            values.collect::<Vec<_>>().join(", ")
        })
        .collect();
    let place = bench.written(setting);
    let method = file.detector.method().name();
    Ok(json!({
        "values": values,
        "sheet": entries,
        "motor": { "name": file.motor.name(), "title": sheet.title(), "pole_pairs": motor.pole_pairs,
            "magnet": motor.magnet_flux != 0.0, "rated_current": motor.rated_current },
        "method": method,
        "points": points,
        "axes": file.axes.keys().collect::<Vec<_>>(),
        "tolerances": ready.document.get("tolerances"),
        "toml": toml(&ready, *trials)?,
        "trace": commands::trace(&place, setting, method, *trial, *angle),
        "run": commands::run(&place, setting, *trials),
    }))
}

/// Returns the scenario as a file, with so many trials.
fn toml(ready: &Ready, trials: u64) -> Result<String, LabError> {
    let mut file = ready.plan.file().clone();
    file.trials = trials;
    Ok(file.text()?)
}

/// Returns the effective value of a key.
fn value(key: &str, ready: &Ready, file: &ScenarioFile) -> Option<Value> {
    ready.scenario.value(key).or_else(|| match key {
        "errors" => Some(file.errors.0.name().into()),
        "detector.method" => Some(file.detector.method().name().into()),
        "trials" => i64::try_from(file.trials).ok().map(Value::Integer),
        "seed" => Some(standstill_scenario::seed_value(file.seed)),
        _ => {
            // What only the document knows; a text there has a unit.
            let value = ready.document.get(key)?;
            let number = value.as_str().and_then(any_quantity).map(|(number, _)| Value::Float(number));
            Some(number.unwrap_or_else(|| value.clone()))
        }
    })
}

/// Returns true if the key has an effect in this scenario.
fn is_there(key: &Key, has_value: bool, ready: &Ready) -> bool {
    let detector = &ready.scenario.detector;
    match key.path.strip_prefix("detector.") {
        Some("call_timeout") => has_value,
        Some("polarity") => detector.clone().polarity_mut().is_some(),
        Some(name) => methods::ALL
            .into_iter()
            .find(|key| key.name == name)
            .is_none_or(|key| detector.get(key).is_some()),
        None => key.applies_to(&ready.scenario),
    }
}

/// Returns a value with the unit that suits it.
fn text(value: &Value, key: &Key) -> String {
    let (Values::Number { unit, share }, Some(number)) = (key.values(), number(value)) else {
        return written(value);
    };
    let scale = if share { Scale::percent() } else { Scale::suiting(unit, number.abs()) };
    format!("{} {}", rounded(scale.number(number), 0), scale.unit).trim_end().to_owned()
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Float(number) => Some(*number),
        Value::Integer(number) => Some(*number as f64),
        _ => None,
    }
}

/// Returns the range of a slider, usually from zero to four times the default; the page accepts other values as text.
fn slider(key: &Key, default: Option<&Value>, now: Option<&Value>, motor: &Motor) -> Option<[f64; 2]> {
    let Values::Number { unit, .. } = key.values() else { return None };
    let known = default.and_then(number).map(f64::abs).filter(|value| *value > 0.0);
    let [mut low, mut high] = match (key.path, unit) {
        ("rotor.angle", _) => [0.0, 360.0],
        ("rotor.load", _) => [-2.0, 2.0],
        (_, "°C") => [-40.0, 180.0],
        (_, unit) => {
            let usual = match unit {
                "A" => 0.01 * motor.rated_current,
                "V" => 1.0,
                "Ω" => 0.1 * motor.resistance,
                "s" => 1e-6,
                "Hz" => 100e3,
                "deg" => 0.5,
                "F" => 500e-6,
                _ => 0.01,
            };
            [0.0, nice(4.0 * known.unwrap_or(usual))]
        }
    };
    if let Some(range) = key.range {
        high = high.min(range.high);
    }
    if let Some(now) = now.and_then(number) {
        low = low.min(now);
        high = high.max(now);
    }
    Some([low, high])
}

/// Returns the next of 1, 2, 5, 10, … above.
fn nice(value: f64) -> f64 {
    let power = standstill_quantity::magnitude(value).unwrap_or(0);
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|step| rounded(step, power))
        .find(|step| *step >= value * (1.0 - 1e-9))
        .unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_sliders_end_at_round_numbers() {
        for (value, end) in
            [(0.04, 0.05), (3.2, 5.0), (1e-6, 1e-6), (0.0012, 0.002), (99.0, 100.0), (7.0, 10.0)]
        {
            assert_eq!(nice(value), end);
        }
    }
}
