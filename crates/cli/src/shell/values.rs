//! Formatting of values for people, in a suitable unit and with the digits that their intervals support; files have the
//! values in SI units.

use serde_json::Value;
use standstill_analysis::limit::Measure;
use standstill_campaign::Estimate;
use standstill_quantity::{Scale, fixed, listed, magnitude, short};
use standstill_scenario as file;

use crate::results::PointSummary;
use crate::summary::{decimals_of, share_of};

/// Formats a current in A in a suitable unit with three decimals.
pub fn ampere(value: f64) -> String {
    let scale = Scale::suiting("A", value);
    format!("{:.3} {}", scale.number(value), scale.unit)
}

/// Format for the values of one sweep axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Key of the sweep axis.
    pub key: String,
    /// Unit of the values.
    pub scale: Scale,
}

impl Shown {
    /// Returns the formats of all sweep axes.
    pub fn of(points: &[PointSummary]) -> Vec<Self> {
        let keys = points.first().into_iter().flat_map(|point| point.values.keys());
        keys.map(|key| {
            let values = points.iter().filter_map(|point| point.values.get(key)?.as_f64());
            let largest = values.fold(0.0_f64, |largest, value| largest.max(value.abs()));
            Self { key: key.clone(), scale: scale_of_key(key, largest) }
        })
        .collect()
    }

    /// Formats a value without its unit. Numbers have six significant digits, enough to distinguish the points of a sweep.
    pub fn text(&self, value: &Value) -> String {
        match value {
            Value::String(text) => text.clone(),
            Value::Number(number) => short(self.scale.number(number.as_f64().unwrap_or(f64::NAN))),
            other => other.to_string(),
        }
    }
}

/// Returns the items in their order, without repetitions.
pub fn each_once<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    items.into_iter().fold(Vec::new(), |mut seen, item| {
        if !seen.contains(&item) {
            seen.push(item);
        }
        seen
    })
}

/// Returns a sentence for each setting that some methods do not have. The sentence names these methods, which were omitted. `left_out`
/// contains pairs of method and setting.
pub fn without_setting<'a>(left_out: impl Iterator<Item = (&'a str, &'a str)>) -> Vec<String> {
    let mut all: Vec<(&str, Vec<&str>)> = Vec::new();
    for (method, setting) in left_out {
        match all.iter_mut().find(|(other, _)| *other == setting) {
            Some((_, methods)) => methods.push(method),
            None => all.push((setting, vec![method])),
        }
    }
    let said = |(setting, methods): (&str, Vec<&str>)| {
        format!(
            "Left out, as methods without {setting}: {}. Without it, those that lack no other setting are tried.",
            methods.join(", ")
        )
    };
    all.into_iter().map(said).collect()
}

/// Describes a sweep point by the values of the sweep axes.
pub fn describe(point: &PointSummary, shown: &[Shown]) -> String {
    let values = shown.iter().zip(point.values.values());
    let values: Vec<String> = values
        .map(|(axis, value)| format!("{} = {} {}", axis.key, axis.text(value), axis.scale.unit))
        .collect();
    let values: Vec<&str> = values.iter().map(|value| value.trim_end()).collect();
    values.join(", ")
}

/// Formats a key's value in its unit.
pub fn shown(key: &str, value: f64) -> String {
    if file::is_share(key) {
        return format!("{} %", listed(&[100.0 * value], "").trim_end());
    }
    listed(&[value], &file::unit(key).unwrap_or_default()).trim_end().to_owned()
}

/// Formats a key's value with its interval in a suitable unit. Half the interval's width has at most two significant digits. If one end is
/// open, the distance to the other end is used instead. If `whole` is true, the key has whole numbers, which keep all digits.
pub fn shown_interval((key, whole): (&str, bool), value: f64, interval: [Option<f64>; 2]) -> String {
    let scale = scale_of_key(key, value.abs());
    let number = |x: f64| scale.number(x);
    let [low, high] = interval.map(|end| end.map(number));
    let value = number(value);
    let decimals = match (whole, low, high) {
        (true, ..) => 0,
        (_, Some(low), Some(high)) => decimals_of([value, low, high]),
        (_, Some(end), None) | (_, None, Some(end)) if end != value => {
            let apart = (end - value).abs();
            decimals_of([value, value - apart, value + apart])
        }
        // Without an interval: three digits.
        _ => decimals_of([value, 0.95 * value, 1.05 * value]),
    };
    let gap = if scale.unit.is_empty() || scale.unit == "°" { "" } else { " " };
    let text = |x: f64| fixed(x, decimals) + gap + &scale.unit;
    let end = |end: Option<f64>| end.map_or_else(|| "open".to_owned(), text);
    format!("{} [{}, {}]", text(value), end(low), end(high))
}

/// Formats a share in per cent, with the sign %.
pub fn percent(share: f64) -> String {
    format!("{} %", standstill_quantity::listed(&[100.0 * share], "").trim_end())
}

/// Returns the unit in which values of a key are shown. `largest` is the largest of these values in SI units.
pub fn scale_of_key(key: &str, largest: f64) -> Scale {
    if file::is_share(key) {
        Scale::percent()
    } else {
        Scale::suiting(&file::unit(key).unwrap_or_default(), largest)
    }
}

/// Returns the unit in which a measure is shown. `largest` is the largest value of the measure.
pub fn scale(measure: Measure, largest: f64) -> Scale {
    measure.unit().map_or_else(Scale::percent, |unit| Scale::suiting(unit, largest))
}

/// Formats a probability with three digits: `4.27e-5`, `0.125`.
pub fn probability(value: f64) -> String {
    probability_to(value, i32::MIN)
}

/// Formats a probability without digits below 10 to the power of `last`.
fn probability_to(value: f64, last: i32) -> String {
    let digits =
        |most: i32, first: i32| usize::try_from(first.saturating_sub(last).clamp(0, most)).unwrap_or(0);
    match magnitude(value) {
        None => "0".to_owned(),
        Some(first) if first < -3 => format!("{value:.*e}", digits(2, first)),
        // A probability that is not zero is never shown as zero.
        Some(first) => {
            let least = usize::try_from(-first).unwrap_or(0);
            format!("{value:.*}", digits(4, 0).max(least))
        }
    }
}

/// Formats an estimate of a probability with its interval, in the digits that the interval supports.
pub fn probability_interval(estimate: &Estimate) -> String {
    let Estimate { value, low, high } = *estimate;
    let last = estimate.last_place().unwrap_or(i32::MIN);
    let [value, low, high] = [value, low, high].map(|p| probability_to(p, last));
    format!("{value} [{low}, {high}]")
}

/// Formats the range of several shares in per cent. `shares` contains pairs of a share and a number of starts. Shares that are not finite
/// are omitted. Returns none if no share is finite.
pub fn range(shares: impl Iterator<Item = (f64, u64)>) -> Option<String> {
    let known: Vec<(f64, u64)> = shares.filter(|(share, _)| share.is_finite()).collect();
    let low = known.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let high = known.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let [low, high] = [low, high].map(|(share, starts)| format!("{} %", share_of(*share, *starts)));
    Some(if low == high { low } else { format!("{low} to {high}") })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_values_stand_in_their_unit() {
        let shown = Shown { key: "sensors.noise".to_owned(), scale: Scale::suiting("A", 0.05) };
        assert_eq!(shown.text(&Value::from(0.05)), "50");
        assert_eq!(shown.text(&Value::from(1e-3 * 10.0_f64.sqrt())), "3.16228");
    }

    #[test]
    fn law_probabilities_have_no_digits_beyond_their_intervals() {
        let text = |value, low, high| probability_interval(&Estimate { value, low, high });
        assert_eq!(text(4.954e-5, 4.371e-5, 5.604e-5), "5.0e-5 [4.4e-5, 5.6e-5]");
        assert_eq!(text(3.04e-6, 5.02e-7, 1.203e-5), "3e-6 [5e-7, 1.2e-5]");
        assert_eq!(text(0.015_61, 0.014_72, 0.016_53), "0.0156 [0.0147, 0.0165]");
        assert_eq!(text(0.21, 0.042, 0.43), "0.21 [0.04, 0.43]");
        assert_eq!(text(0.21, 0.004, 0.43), "0.21 [0.004, 0.43]");
        assert_eq!(text(0.5, 0.5, 0.5), "0.500 [0.500, 0.500]");
        assert_eq!((probability(0.0), probability(1.152_8e-4)), ("0".to_owned(), "1.15e-4".to_owned()));
    }
}
