//! Figure of the probability of a rare event.

use standstill_analysis::{Event, Odds};
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};

use super::parts::ends;

/// Magnitude below which all values count as zero, so that the axis gets a fixed width. Its unit is that of the order parameter, the
/// event's quantity such as the axis error.
const LEAST: f64 = 1e-9;

/// Draws the probability that the event's order parameter exceeds a value, and the event's probability with its interval. Each run of
/// subset simulation has one curve. For a likely event, the curve is an estimate from ordinary trials and covers values on both sides of
/// the event. `in_sectors` is true if answers are sectors.
pub fn odds(odds: &Odds, event: Event, in_sectors: bool, subtitle: String) -> Figure {
    let values = odds.runs.iter().flat_map(|run| run.curve.iter().map(|(value, _)| event.bound() + value));
    let (low, high) = ends(values.chain([event.bound()]));
    let mut axis = Axis::new(event.order_parameter(in_sectors));
    // If all values are alike, the axis is as wide as the values are large.
    let size = high.abs().max(low.abs());
    if high - low < 1e-3 * size || size < LEAST {
        let half = if size > LEAST { 0.5 * size } else { 1.0 };
        axis = axis.range(low - half, high + half);
    }
    let mut panel = Panel::new(axis, Axis::new("probability of this or more").log10());
    for run in &odds.runs {
        let curve = run.curve.iter().map(|(value, probability)| (event.bound() + value, *probability));
        panel = panel.with(Layer::line("a run", Style::Blue, curve.clone()));
        panel = panel.with(Layer::points("a run", Style::Blue, curve));
    }
    let found = odds.probability;
    if found.value > 0.0 {
        let bar = [(event.bound(), found.value, found.low, found.high)];
        let label = if odds.widened { "all runs, interval widened" } else { "all runs, 95 % interval" };
        panel = panel.with(Layer::error_bars(label, Style::Vermilion, bar));
    } else {
        let limit = [(event.bound(), found.high)];
        panel = panel.with(Layer::upper_limits("upper limit, 97.5 %", Style::Vermilion, limit));
    }
    panel = panel.with(Layer::instant("event", event.bound()));
    Figure::new(format!("Odds of {event}"), subtitle, 480, [panel])
}
