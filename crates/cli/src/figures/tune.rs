//! What one measure costs in another.

use standstill_analysis::limit::Measure;
use standstill_analysis::tune::{Judged, Question, Tuned, View};
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};

use super::WIDTH;
use crate::commands::tune::scale;

/// The measure that was made small over the other one: all settings looked at, the front, start and best.
pub fn tune(asked: &Question<'_>, tuned: &Tuned, subtitle: String) -> Figure {
    let measures = [asked.against, asked.goal.minimise];
    let largest = |measure: Measure| {
        let all = tuned.front.iter().chain([&tuned.start, &tuned.best]);
        all.map(|judged| judged.measured.get(measure).value)
            .filter(|value| value.is_finite())
            .fold(0.0, f64::max)
    };
    let scales = measures.map(|measure| scale(measure, largest(measure)));
    let place = |judged: &Judged| {
        let [x, y] = [0, 1].map(|k| judged.measured.get(measures[k]));
        let y = [y.value, y.low, y.high].map(|value| scales[1].number(value));
        (scales[0].number(x.value), y[0], y[1], y[2])
    };
    let axis = |k: usize| {
        let unit = &scales[k].unit;
        Axis::new(format!("{} ({unit})", measures[k]))
    };
    let looked = tuned.looks.iter().filter_map(|look| {
        let measured = look.measured.as_ref()?;
        let kept = asked.goal.score(Some(measured), View::Likely).broken == 0.0;
        let [x, y] = [0, 1].map(|k| scales[k].number(measured.get(measures[k]).value));
        (x.is_finite() && y.is_finite()).then_some((kept, (x, y)))
    });
    let (kept, broken): (Vec<_>, Vec<_>) = looked.partition(|(kept, _)| *kept);
    let shown: Vec<f64> =
        kept.iter().map(|(_, (_, y))| *y).chain([place(&tuned.start).1, place(&tuned.best).1]).collect();
    let (low, high) = shown
        .iter()
        .filter(|y| **y > 0.0)
        .fold((f64::INFINITY, 0.0_f64), |(low, high), y| (low.min(*y), high.max(*y)));
    let y = if high > 5.0 * low { axis(1).log10() } else { axis(1) };
    let front: Vec<_> = tuned.front.iter().map(place).collect();
    let points = |all: Vec<(bool, (f64, f64))>| all.into_iter().map(|(_, point)| point);
    // A setting can look better on the search's random numbers than on those of which start, best and front are.
    let searched = format!("looked at, by seed {}", asked.seed);
    let judged = |what: &str| format!("{what}, by seed {}", asked.seed.wrapping_add(2));
    let none_better = judged("none better in both");
    let mut panel = Panel::new(axis(0), y);
    if !broken.is_empty() {
        let label = format!("{searched}, breaks a limit");
        panel = panel.with(Layer::points(&label, Style::Orange, points(broken)));
    }
    panel = panel.with(Layer::points(&searched, Style::Purple, points(kept)));
    if !front.is_empty() {
        panel = panel
            .with(Layer::line(&none_better, Style::Black, front.iter().map(|p| (p.0, p.1))))
            .with(Layer::error_bars(&none_better, Style::Black, front));
    }
    let last = if tuned.is_found() { "best" } else { "nearest, breaks a limit" };
    panel = panel
        .with(Layer::error_bars(&judged("start"), Style::Vermilion, [place(&tuned.start)]))
        .with(Layer::error_bars(&judged(last), Style::Blue, [place(&tuned.best)]));
    Figure {
        title: format!("{} against {}", measures[1], measures[0]),
        subtitle: Some(subtitle),
        width: WIDTH,
        height: 520,
        panels: vec![panel],
    }
}
