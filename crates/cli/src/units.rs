//! Values of axes for people: in the unit that suits them, while files have them in SI.

use serde_json::Value;
use standstill_quantity::{Scale, short};
use standstill_scenario as file;

use crate::commands::run::results::PointSummary;

/// How the values of an axis are shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Key of the axis.
    pub key: String,
    /// Their unit.
    pub scale: Scale,
}

impl Shown {
    /// Those of all axes.
    pub fn of(points: &[PointSummary]) -> Vec<Self> {
        let keys = points.first().into_iter().flat_map(|point| point.values.keys());
        keys.map(|key| {
            let values = points.iter().filter_map(|point| point.values.get(key)?.as_f64());
            let largest = values.fold(0.0_f64, |largest, value| largest.max(value.abs()));
            let scale = if file::is_share(key) {
                Scale::percent()
            } else {
                Scale::suiting(&file::unit(key).unwrap_or_default(), largest)
            };
            Self { key: key.clone(), scale }
        })
        .collect()
    }

    /// The key with the unit.
    pub fn title(&self) -> String {
        format!("{} {}", self.key, self.scale.unit).trim_end().to_owned()
    }

    /// A value without its unit: six digits are enough to tell points apart.
    pub fn text(&self, value: &Value) -> String {
        match value {
            Value::String(text) => text.clone(),
            Value::Number(number) => short(self.scale.number(number.as_f64().unwrap_or(f64::NAN))),
            other => other.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_values_stand_in_their_unit() {
        let shown = Shown { key: "sensors.noise".to_owned(), scale: Scale::suiting("A", 0.05) };
        assert_eq!(
            (shown.text(&Value::from(0.05)), shown.title().as_str()),
            ("50".to_owned(), "sensors.noise mA")
        );
        assert_eq!(shown.text(&Value::from(1e-3 * 10.0_f64.sqrt())), "3.16228");
    }
}
