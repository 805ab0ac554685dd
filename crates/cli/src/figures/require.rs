//! What a part must do.

use standstill_analysis::bracket::Found;
use standstill_analysis::limit::Limits;
use standstill_campaign::Estimate;
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};
use standstill_scenario as file;

use super::WIDTH;
use crate::commands::require::Point;

/// A value that was judged: what each limit's measure is.
pub struct Judged {
    pub value: f64,
    pub measures: Vec<Estimate>,
}

fn axis(key: &str, mut values: impl Iterator<Item = f64>) -> Axis {
    let unit = file::unit(key).unwrap_or_default();
    let label = if unit.is_empty() { key.to_owned() } else { format!("{key} ({unit})") };
    let axis = Axis::new(label);
    if values.all(|value| value > 0.0) { axis.log10() } else { axis }
}

/// Measures over their limits.
pub fn require(key: &str, limits: &Limits, judged: &[Judged], found: &Found, subtitle: String) -> Figure {
    let x = axis(key, judged.iter().map(|judged| judged.value));
    let mut panel = Panel::new(x, Axis::new("measure / limit").log10());
    for (k, limit) in limits.0.iter().enumerate() {
        let label = Limits(vec![*limit]).to_string();
        let bars = judged.iter().map(|judged| {
            let Estimate { value, low, high } = judged.measures[k];
            let [value, low, high] = [value, low, high].map(|x| x / limit.most);
            (judged.value, value, low, high)
        });
        panel = panel.with(Layer::error_bars(&label, Style::nth(k), bars));
    }
    panel = panel.with(Layer::level("limit", 1.0));
    if let Found::Edge(edge) = found {
        panel = panel.with(Layer::instant("", edge.interval.0));
        panel = panel.with(Layer::instant("", edge.interval.1));
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
    let x = axis(keys[0], points.iter().map(|point| point.first));
    let y = axis(keys[1], points.iter().filter_map(|point| point.second));
    let curve = points.iter().filter_map(|point| Some((point.first, point.second?)));
    let bars = points.iter().filter_map(|point| Some((point.first, point.second?, point.low?, point.high?)));
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
