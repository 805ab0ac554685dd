//! Values of axes for people: in the unit that suits them, while files have them in SI.

use serde_json::Value;
use standstill_campaign::file;

use crate::commands::run::results::PointSummary;

/// Prefixes of units, and the powers of ten that they stand for.
const PREFIXES: [(&str, f64); 6] = [("n", 1e-9), ("µ", 1e-6), ("m", 1e-3), ("", 1.0), ("k", 1e3), ("M", 1e6)];

/// How the values of an axis are shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Key of the axis.
    pub key: String,
    /// Unit; empty without.
    pub unit: String,
    /// How many SI units it has.
    pub scale: f64,
}

impl Shown {
    /// Those of all axes.
    pub fn of(points: &[PointSummary]) -> Vec<Self> {
        let keys = points.first().into_iter().flat_map(|point| point.values.keys());
        keys.map(|key| {
            let values = points.iter().filter_map(|point| point.values.get(key)?.as_f64());
            let largest = values.fold(0.0_f64, |largest, value| largest.max(value.abs()));
            let (unit, scale) = if file::is_share(key) {
                ("%".to_owned(), 0.01)
            } else {
                scaled(&file::unit(key).unwrap_or_default(), largest)
            };
            Self { key: key.clone(), unit, scale }
        })
        .collect()
    }

    /// The key with the unit.
    pub fn title(&self) -> String {
        if self.unit.is_empty() { self.key.clone() } else { format!("{} {}", self.key, self.unit) }
    }

    /// A number in the unit.
    pub fn number(&self, value: f64) -> f64 {
        // Twelve digits hide what scaling rounds.
        let scaled = value / self.scale;
        format!("{scaled:.11e}").parse().unwrap_or(scaled)
    }

    /// A value without its unit: six digits are enough to tell points apart.
    pub fn text(&self, value: &Value) -> String {
        match value {
            Value::String(text) => text.clone(),
            Value::Number(number) => {
                let number = self.number(number.as_f64().unwrap_or(f64::NAN));
                format!("{number:.5e}").parse::<f64>().unwrap_or(number).to_string()
            }
            other => other.to_string(),
        }
    }
}

/// The unit in which the largest value has one to three digits before the point. Angles and temperatures have no prefixes.
fn scaled(symbol: &str, largest: f64) -> (String, f64) {
    if ["", "deg", "°C", "1/K"].contains(&symbol) || largest == 0.0 {
        return (if symbol == "deg" { "°" } else { symbol }.to_owned(), 1.0);
    }
    let fits = |(_, scale): &&(&str, f64)| largest / scale >= 1.0 - 1e-9;
    let (prefix, scale) = PREFIXES.iter().rev().find(fits).unwrap_or(&PREFIXES[0]);
    (format!("{prefix}{symbol}"), *scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_units_suit_the_values() {
        for (symbol, largest, expected) in [
            ("A", 0.05, ("mA", 1e-3)),
            ("s", 4e-6, ("µs", 1e-6)),
            ("Hz", 1e4, ("kHz", 1e3)),
            ("V", 550.0, ("V", 1.0)),
            ("deg", 0.1, ("°", 1.0)),
            ("", 7.0, ("", 1.0)),
            ("A", 0.0, ("A", 1.0)),
        ] {
            let (unit, scale) = scaled(symbol, largest);
            assert_eq!((unit.as_str(), scale), expected);
        }
        let shown = Shown { key: "sensors.noise".to_owned(), unit: "mA".to_owned(), scale: 1e-3 };
        assert_eq!(
            (shown.text(&Value::from(0.05)), shown.title().as_str()),
            ("50".to_owned(), "sensors.noise mA")
        );
        assert_eq!(shown.text(&Value::from(1e-3 * 10.0_f64.sqrt())), "3.16228");
    }
}
