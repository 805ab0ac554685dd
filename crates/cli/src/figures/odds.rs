//! Odds of an event.

use standstill_analysis::{Event, Odds};
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};

use super::WIDTH;

/// The probability that the order parameter exceeds a value, as each run came by it, and the event's with its interval.
pub fn odds(odds: &Odds, event: Event, subtitle: String) -> Figure {
    let axis = event.order_parameter();
    let mut panel = Panel::new(Axis::new(axis), Axis::new("probability of more").log10());
    for run in &odds.runs {
        let curve = run.curve.iter().map(|(value, probability)| (event.bound() + value, *probability));
        panel = panel.with(Layer::line("a run", Style::Blue, curve.clone()));
        panel = panel.with(Layer::points("a run", Style::Blue, curve));
    }
    let found = odds.probability;
    if found.value > 0.0 {
        let bar = [(event.bound(), found.value, found.low, found.high)];
        panel = panel.with(Layer::error_bars("all runs, 95 % interval", Style::Vermilion, bar));
    } else {
        let limit = [(event.bound(), found.high)];
        panel = panel.with(Layer::upper_limits("upper limit, 97.5 %", Style::Vermilion, limit));
    }
    panel = panel.with(Layer::instant("event", event.bound()));
    Figure {
        title: format!("Odds of {event}"),
        subtitle: Some(subtitle),
        width: WIDTH,
        height: 480,
        panels: vec![panel],
    }
}
