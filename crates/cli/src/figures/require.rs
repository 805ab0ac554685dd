//! Figures of requirements.

use standstill_analysis::bracket::{Edge, Found, Side};
use standstill_analysis::limit::{Limits, Measure};
use standstill_analysis::require::{EVERYWHERE, Judged, Point};
use standstill_campaign::Estimate;
use standstill_quantity::Scale;
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style, cell_edges};

use crate::shell::values::{scale as scale_of, scale_of_key};

/// Makes the axis of a key. The axis is logarithmic if all values are positive. Its unit suits `typical` or, if that is none, the largest
/// value.
fn axis(key: &str, values: impl Iterator<Item = f64>, typical: Option<f64>) -> (Axis, Scale) {
    let values: Vec<f64> = values.collect();
    let largest =
        values.iter().copied().filter(|value| value.is_finite()).fold(0.0, |a: f64, b| a.max(b.abs()));
    let scale = scale_of_key(key, typical.unwrap_or(largest));
    let label = if scale.unit.is_empty() { key.to_owned() } else { format!("{key} ({})", scale.unit) };
    let axis = Axis::new(label);
    let log = values.iter().all(|value| *value > 0.0);
    let axis =
        if values.iter().all(|value| scale.number(*value).fract() == 0.0) { axis.whole() } else { axis };
    (if log { axis.log10() } else { axis }, scale)
}

/// Returns for each value of the key the result with the most trials, sorted by value.
fn latest(judged: &[Judged]) -> Vec<&Judged> {
    let superseded =
        |of: &&Judged| judged.iter().any(|other| other.value == of.value && other.trials > of.trials);
    let mut latest: Vec<&Judged> = judged.iter().filter(|of| !superseded(of)).collect();
    latest.sort_by(|a, b| a.value.total_cmp(&b.value));
    latest
}

/// Smallest ratio of a measure to its limit that is shown at its value. Smaller ratios would stretch the axis over many decades, so they
/// are shown as upper limits.
const LEAST: f64 = 0.01;

/// Returns the axis range of the measures relative to their limits. The range contains the values, the upper ends of intervals, and the
/// upper limits of shares without an observed event. The range need not contain lower ends of intervals, because a share with a single
/// event has one near zero.
fn shown(limits: &Limits, judged: &[&Judged]) -> (f64, f64) {
    let each = judged.iter().flat_map(|judged| {
        judged.measures.iter().zip(&limits.0).map(|(estimate, limit)| (judged.clear, estimate, limit))
    });
    let shares = each.flat_map(|(clear, estimate, limit)| {
        let [value, high] = [estimate.value, estimate.high].map(|x| (x / limit.most).max(LEAST));
        let value = if estimate.value == 0.0 { high } else { value };
        [value, if clear { value } else { high }]
    });
    let finite = shares.filter(|share| share.is_finite());
    let (low, high) = finite.fold((1.0_f64, 1.0_f64), |(low, high), share| (low.min(share), high.max(share)));
    (low / 1.5, high * 1.5)
}

/// Draws the measures of a requirement, and their limits, over the values of the key.
pub fn require(key: &str, limits: &Limits, judged: &[Judged], found: &Found, subtitle: String) -> Figure {
    let judged = latest(judged);
    let edges = match found {
        Found::Stretch(stretch) => &stretch.edges[..],
        _ => &[],
    };
    let (x, scale) = axis(key, judged.iter().map(|judged| judged.value), edges.last().map(|edge| edge.value));
    // A single measure is drawn in its own unit, several as ratios to their limits.
    let (label, unit, limit_named) = match limits.0[..] {
        [one] => {
            let scale = scale_of(one.measure, one.most);
            let most = scale.number(one.most);
            let unit = if scale.unit.is_empty() { String::new() } else { format!(" ({})", scale.unit) };
            let gap = if scale.unit == "°" { "" } else { " " };
            (
                format!(
                    "{}{}{unit}",
                    one.measure,
                    if one.measure == Measure::Unanswered { "" } else { ", unanswered starts included" }
                ),
                most,
                format!("limit {most}{gap}{}", scale.unit),
            )
        }
        _ => ("measure / limit, unanswered starts included".to_owned(), 1.0, "limit".to_owned()),
    };
    let (low, high) = shown(limits, &judged);
    let mut panel = Panel::new(x, Axis::new(label).log10().range(unit * low, unit * high));
    // Beyond an edge the limits do not hold.
    let beyond = |edge: &Edge| match edge.side {
        Side::Largest => (scale.number(edge.value), f64::INFINITY),
        Side::Smallest => (f64::NEG_INFINITY, scale.number(edge.value)),
    };
    if !edges.is_empty() {
        let label = Some(format!("{limits} does not hold"));
        panel = panel.with(Layer::Hatched { label, spans: edges.iter().map(beyond).collect() });
    }
    for (k, limit) in limits.0.iter().enumerate() {
        let label = Limits(vec![*limit]).to_string();
        let bars = judged.iter().map(|judged| {
            let Estimate { value, low, high } = judged.measures[k];
            let [value, low, high] = [value, low, high].map(|x| unit * x / limit.most);
            (judged.clear, (scale.number(judged.value), value, low, high))
        });
        // Zero has no place on a logarithmic axis: only the upper end of its interval is drawn.
        let (none, some): (Vec<_>, Vec<_>) = bars.partition(|(_, (_, value, ..))| *value == 0.0);
        let (little, some): (Vec<_>, Vec<_>) =
            some.into_iter().partition(|(_, (_, value, ..))| *value < unit * LEAST);
        panel = panel.with(Layer::line(&label, Style::nth(k), some.iter().map(|(_, (x, y, ..))| (*x, *y))));
        // Results that are clear after few trials have long bars, which would hide the others: they get points alone.
        let (clear, close): (Vec<_>, Vec<_>) = some.into_iter().partition(|(clear, _)| *clear);
        panel = panel
            .with(Layer::points(&label, Style::nth(k), clear.into_iter().map(|(_, (x, y, ..))| (x, y))))
            .with(Layer::error_bars(&label, Style::nth(k), close.into_iter().map(|(_, bar)| bar)));
        for (bars, said) in [(none, "none seen"), (little, "below a hundredth")] {
            if !bars.is_empty() {
                let ends = bars.into_iter().map(|(_, (x, .., high))| (x, high.max(unit * LEAST)));
                panel = panel.with(Layer::upper_limits(&format!("{label}: {said}"), Style::nth(k), ends));
            }
        }
    }
    panel = panel.with(Layer::level(limit_named.trim_end(), unit));
    Figure::new(format!("What {key} must be"), subtitle, 480, [panel])
}

/// Draws the trade-off curve of two keys. For each value of the first key, the curve shows the value of the second key up to which the
/// limits hold.
pub fn tradeoff(keys: [&str; 2], points: &[Point], limits: &str, subtitle: String) -> Figure {
    let (mut x, first) = axis(keys[0], points.iter().map(|point| point.first), None);
    let places: Vec<f64> = points.iter().map(|point| first.number(point.first)).collect();
    let edges = cell_edges(&places, x.scale);
    if let [low, .., high] = edges[..] {
        x = x.range(low, high);
    }
    let ends = points
        .iter()
        .flat_map(|point| [point.second, point.low, point.high, point.from, point.from_low, point.from_high])
        .flatten();
    let (y, second) = axis(keys[1], ends, None);
    let curve = |of: fn(&Point) -> Option<f64>| {
        let at =
            points.iter().filter_map(|point| Some((first.number(point.first), second.number(of(point)?))));
        at.collect::<Vec<_>>()
    };
    // If an interval has an open end, its whisker ends at the value.
    let bars = points.iter().flat_map(|point| {
        let ends = [(point.second, [point.low, point.high]), (point.from, [point.from_low, point.from_high])];
        ends.into_iter().filter_map(|(value, [low, high])| {
            let [value, low, high] =
                [value?, low.or(value)?, high.or(value)?].map(|value| second.number(value));
            Some((first.number(point.first), value, low, high))
        })
    });
    let bars: Vec<_> = bars.collect();
    // A point without an edge is an answer too: every value of the second key meets the limits, or none does.
    let met = |point: &Point| point.second.is_none() && point.answer == EVERYWHERE;
    let never =
        points.iter().zip(edges.windows(2)).filter(|(point, _)| point.second.is_none() && !met(point));
    let spans: Vec<(f64, f64)> = never.map(|(_, edges)| (edges[0], edges[1])).collect();
    let mut panel = Panel::new(x, y);
    if !spans.is_empty() {
        panel = panel.with(Layer::Hatched { label: Some(format!("no {} meets it", keys[1])), spans });
    }
    for at in points.iter().zip(&places).filter(|(point, _)| met(point)).map(|(_, at)| *at) {
        panel = panel.with(Layer::instant(&format!("every {} meets it", keys[1]), at));
    }
    let panel = panel
        .with(Layer::line(limits, Style::Blue, curve(|point| point.second)))
        .with(Layer::line(limits, Style::Blue, curve(|point| point.from)))
        .with(Layer::error_bars(limits, Style::Blue, bars));
    Figure::new(format!("{} against {}", keys[0], keys[1]), subtitle, 480, [panel])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_a_share_of_zero_is_drawn_as_an_upper_limit() {
        let limits: Limits = "wrong_poles <= 1 %".parse().expect("limits");
        let judged = |value, share: f64| Judged {
            trials: 1000,
            clear: false,
            without_answer: None,
            value,
            measures: vec![Estimate { value: share, low: 0.5 * share, high: share + 0.004 }],
        };
        let all = [judged(0.01, 0.0), judged(0.02, 0.02)];
        let figure = require("sensors.noise", &limits, &all, &Found::Nowhere, String::new());
        let layers = &figure.panels[0].layers;
        let found = |is: fn(&Layer) -> bool| layers.iter().find(|layer| is(layer)).expect("a layer");
        let bars = found(|layer| matches!(layer, Layer::ErrorBars { .. }));
        let Layer::ErrorBars { points: bars, .. } = bars else { panic!("bars") };
        let ends = found(|layer| matches!(layer, Layer::UpperLimits { .. }));
        let Layer::UpperLimits { points: ends, label, .. } = ends else { panic!("limits") };
        assert_eq!(bars.iter().map(|bar| bar.0).collect::<Vec<_>>(), [20.0]);
        assert_eq!((ends.len(), ends[0].0), (1, 10.0));
        // 0.4 %, in its own unit.
        assert!((ends[0].1 - 0.4).abs() < 1e-12, "{ends:?}");
        assert_eq!(figure.panels[0].y.label, "wrong_poles, unanswered starts included (%)");
        let level = layers.iter().find_map(|layer| match layer {
            Layer::HorizontalRule { label, y } => Some((label.as_deref(), *y)),
            _ => None,
        });
        assert_eq!(level, Some((Some("limit 1 %"), 1.0)));
        assert_eq!(label.as_deref(), Some("wrong_poles <= 1 %: none seen"));
    }

    #[test]
    fn regress_rare_cases_do_not_stretch_the_axis() {
        let limits: Limits = "rms <= 1 deg, wrong_poles <= 1 %".parse().expect("limits");
        let judged = |value, share: f64| Judged {
            trials: 100_000,
            clear: false,
            without_answer: None,
            value,
            measures: vec![
                Estimate { value: 0.5, low: 0.4, high: 0.6 },
                Estimate { value: share, low: 0.01 * share, high: 5.0 * share },
            ],
        };
        // A thousandth and a twentieth of the limit.
        let all = [judged(0.01, 1e-5), judged(0.02, 5e-4)];
        let figure = require("sensors.noise", &limits, &all, &Found::Nowhere, String::new());
        let panel = &figure.panels[0];
        let (low, high) = panel.y.range.expect("a range");
        assert!((LEAST / 2.0..LEAST).contains(&low) && (1.0..2.0).contains(&high), "{low} {high}");
        let ends = panel.layers.iter().find_map(|layer| match layer {
            Layer::UpperLimits { points, label, .. } => Some((points, label)),
            _ => None,
        });
        let (points, label) = ends.expect("an arrow");
        assert_eq!(
            (&points[..], label.as_deref()),
            (&[(10.0, LEAST)][..], Some("wrong_poles <= 1 %: below a hundredth"))
        );
    }

    #[test]
    fn regress_a_look_with_few_trials_is_superseded_by_one_with_more() {
        let judged = |value, trials| Judged {
            trials,
            clear: false,
            without_answer: None,
            value,
            measures: Vec::new(),
        };
        let all = [judged(0.01, 100), judged(0.02, 100), judged(0.01, 3000), judged(0.01, 800)];
        let kept: Vec<(f64, u64)> = latest(&all).into_iter().map(|kept| (kept.value, kept.trials)).collect();
        assert_eq!(kept, [(0.01, 3000), (0.02, 100)]);
    }

    #[test]
    fn regress_a_trade_off_says_where_no_value_meets_the_limits() {
        let point = |first, second: Option<f64>, answer| Point {
            first,
            second,
            low: second,
            high: second,
            from: None,
            from_low: None,
            from_high: None,
            answer,
        };
        let all = [
            point(0.01, None, EVERYWHERE),
            point(0.02, Some(0.005), "edge"),
            point(0.04, Some(0.002), "edge"),
            point(0.08, None, "no value meets it"),
        ];
        let keys = ["sensors.noise", "sensors.gain_error"];
        let figure = tradeoff(keys, &all, "rms <= 1 deg", String::new());
        let panel = &figure.panels[0];
        let Layer::Hatched { label, spans } = &panel.layers[0] else { panic!("strips") };
        assert_eq!(label.as_deref(), Some("no sensors.gain_error meets it"));
        // Around 80 mA, to which the axis reaches.
        assert!(spans.len() == 1 && spans[0].0 < 80.0 && 80.0 < spans[0].1, "{spans:?}");
        assert!(panel.x.range.is_some_and(|(low, high)| low < 10.0 && high > 80.0));
        let met =
            panel.layers.iter().filter(|layer| matches!(layer, Layer::VerticalRule { x, .. } if *x == 10.0));
        assert_eq!(met.count(), 1);
    }
}
