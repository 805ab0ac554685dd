//! What a part must do.

use standstill_analysis::bracket::Found;
use standstill_analysis::limit::Limits;
use standstill_campaign::Estimate;
use standstill_quantity::Scale;
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};
use standstill_scenario as file;

use super::WIDTH;
use crate::commands::require::Point;

/// A value that was judged: what each limit's measure is.
pub struct Judged {
    pub value: f64,
    pub trials: u64,
    pub measures: Vec<Estimate>,
    /// The share of starts without an answer, where the root mean square is limited.
    pub without_answer: Option<Estimate>,
}

/// A key's axis, and the one unit of it that suits all values.
fn axis(key: &str, values: impl Iterator<Item = f64>) -> (Axis, Scale) {
    let values: Vec<f64> = values.collect();
    let scale = if file::is_share(key) {
        Scale::percent()
    } else {
        let largest =
            values.iter().copied().filter(|value| value.is_finite()).fold(0.0, |a: f64, b| a.max(b.abs()));
        Scale::suiting(&file::unit(key).unwrap_or_default(), largest)
    };
    let label = if scale.unit.is_empty() { key.to_owned() } else { format!("{key} ({})", scale.unit) };
    let axis = Axis::new(label);
    let log = values.iter().all(|value| *value > 0.0);
    (if log { axis.log10() } else { axis }, scale)
}

/// Measures over their limits.
pub fn require(key: &str, limits: &Limits, judged: &[Judged], found: &Found, subtitle: String) -> Figure {
    let (x, scale) = axis(key, judged.iter().map(|judged| judged.value));
    let mut panel = Panel::new(x, Axis::new("measure / limit").log10());
    for (k, limit) in limits.0.iter().enumerate() {
        let label = Limits(vec![*limit]).to_string();
        let bars = judged.iter().map(|judged| {
            let Estimate { value, low, high } = judged.measures[k];
            let [value, low, high] = [value, low, high].map(|x| x / limit.most);
            (scale.number(judged.value), value, low, high)
        });
        // What is zero has no place on a logarithmic axis: what is known of it is that it lies below its interval's end.
        let (none, some): (Vec<_>, Vec<_>) = bars.partition(|(_, value, ..)| *value == 0.0);
        panel = panel.with(Layer::error_bars(&label, Style::nth(k), some));
        if !none.is_empty() {
            let ends = none.into_iter().map(|(x, .., high)| (x, high));
            panel = panel.with(Layer::upper_limits(&format!("{label}: none seen"), Style::nth(k), ends));
        }
    }
    panel = panel.with(Layer::level("limit", 1.0));
    if let Found::Edge(edge) = found {
        panel = panel.with(Layer::instant("", scale.number(edge.interval.0)));
        panel = panel.with(Layer::instant("", scale.number(edge.interval.1)));
    }
    Figure {
        title: format!("What {key} must be"),
        subtitle: Some(subtitle),
        width: WIDTH,
        height: 480,
        panels: vec![panel],
    }
}

/// One key over the other.
pub fn tradeoff(keys: [&str; 2], points: &[Point], limits: &str, subtitle: String) -> Figure {
    let (x, first) = axis(keys[0], points.iter().map(|point| point.first));
    let ends = points.iter().flat_map(|point| [point.second, point.low, point.high]).flatten();
    let (y, second) = axis(keys[1], ends);
    let curve =
        points.iter().filter_map(|point| Some((first.number(point.first), second.number(point.second?))));
    let bars = points.iter().filter_map(|point| {
        let [value, low, high] = [point.second?, point.low?, point.high?].map(|value| second.number(value));
        Some((first.number(point.first), value, low, high))
    });
    let panel = Panel::new(x, y).with(Layer::line(limits, Style::Blue, curve)).with(Layer::error_bars(
        limits,
        Style::Blue,
        bars,
    ));
    Figure {
        title: format!("{} against {}", keys[0], keys[1]),
        subtitle: Some(subtitle),
        width: WIDTH,
        height: 480,
        panels: vec![panel],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_a_share_of_zero_is_drawn_as_an_upper_limit() {
        let limits: Limits = "wrong_poles <= 1 %".parse().expect("limits");
        let judged = |value, share: f64| Judged {
            trials: 1000,
            without_answer: None,
            value,
            measures: vec![Estimate { value: share, low: 0.5 * share, high: share + 0.004 }],
        };
        let all = [judged(0.01, 0.0), judged(0.02, 0.02)];
        let figure = require("sensors.noise", &limits, &all, &Found::Nowhere, String::new());
        let layers = &figure.panels[0].layers;
        let Layer::ErrorBars { points: bars, .. } = &layers[0] else { panic!("bars") };
        let Layer::UpperLimits { points: ends, label, .. } = &layers[1] else { panic!("limits") };
        assert_eq!(bars.iter().map(|bar| bar.0).collect::<Vec<_>>(), [20.0]);
        assert_eq!((ends.len(), ends[0].0), (1, 10.0));
        // 0.4 % of a limit of 1 %.
        assert!((ends[0].1 - 0.4).abs() < 1e-12, "{ends:?}");
        assert_eq!(label.as_deref(), Some("wrong_poles <= 1 %: none seen"));
    }
}
