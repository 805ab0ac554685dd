//! What one measure costs in another.

use standstill_analysis::limit::Measure;
use standstill_analysis::tune::{Judged, Question, Tuned, View};
use standstill_quantity::{decimals, fixed};
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
    let front: Vec<_> = tuned.front.iter().map(place).collect();
    // What the answer is about: start, best and what may be chosen between them. What was looked at beside them may be far off.
    let told = || front.iter().copied().chain([place(&tuned.start), place(&tuned.best)]);
    let ends = |numbers: Vec<f64>| {
        let usable = numbers.into_iter().filter(|number| number.is_finite());
        usable.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let xs = ends(told().map(|p| p.0).collect());
    // Starts without an answer that nobody saw may widen the interval of an rms upwards by far more than all settings differ: such a
    // whisker is cut off at the frame.
    let cut = |(_, value, low, high): (f64, f64, f64, f64)| {
        if asked.goal.minimise == Measure::Rms { high.min(value + 3.0 * (value - low)) } else { high }
    };
    let highest = told().map(|p| p.3).filter(|high| high.is_finite()).fold(f64::NEG_INFINITY, f64::max);
    let ys = ends(told().flat_map(|p| [p.1, p.2, cut(p)]).collect());
    let subtitle = if highest > ys.1 {
        let most = fixed(highest, decimals(1, highest));
        let gap = if scales[1].unit == "°" { "" } else { " " };
        format!("{subtitle}; whiskers that the frame cuts off go up to {most}{gap}{}", scales[1].unit)
    } else {
        subtitle
    };
    let drawn = |k: usize| {
        let of = |(_, (x, y)): &(bool, (f64, f64))| if k == 0 { *x } else { *y };
        ends(
            kept.iter()
                .chain(&broken)
                .map(of)
                .chain(if k == 0 { [xs.0, xs.1] } else { [ys.0, ys.1] })
                .collect(),
        )
    };
    let around = |(low, high): (f64, f64)| {
        let room = if high > low { 0.08 * (high - low) } else { 0.02 * high.abs().max(1e-12) };
        (low - room, high + room)
    };
    // Logarithmic where that is more than a factor of three.
    let scaled = |k: usize| {
        let (low, high) = drawn(k);
        if low > 0.0 && high > 3.0 * low {
            axis(k).log10().range(low / 1.1, 1.1 * high)
        } else {
            let (low, high) = around((low, high));
            axis(k).range(low, high)
        }
    };
    let points = |all: Vec<(bool, (f64, f64))>| all.into_iter().map(|(_, point)| point);
    // A setting can look better on the search's random numbers than on those of which start, best and front are.
    let searched = format!("looked at, by seed {}", asked.seed);
    let judged = |what: &str| format!("{what}, by seed {}", asked.seed.wrapping_add(2));
    let none_better = judged("none better in both");
    let marked = |panel: Panel| {
        let mut panel = panel;
        if !front.is_empty() {
            panel = panel
                .with(Layer::line(&none_better, Style::Black, front.iter().map(|p| (p.0, p.1))))
                .with(Layer::error_bars(&none_better, Style::Black, front.iter().copied()));
        }
        let last = if tuned.is_found() { "best" } else { "nearest, breaks a limit" };
        panel
            .with(Layer::error_bars(&judged("start"), Style::Vermilion, [place(&tuned.start)]))
            .with(Layer::error_bars(&judged(last), Style::Blue, [place(&tuned.best)]))
    };
    // Once all that was looked at, once start, best and what lies between them alone.
    let mut looks = Panel::new(scaled(0), scaled(1)).titled("all settings looked at");
    if !broken.is_empty() {
        let label = format!("{searched}, breaks a limit");
        looks = looks.with(Layer::points(&label, Style::Orange, points(broken.clone())));
    }
    looks = looks.with(Layer::points(&searched, Style::Purple, points(kept.clone())));
    let [x, y] = [around(xs), around(ys)];
    let close = Panel::new(axis(0).range(x.0, x.1), axis(1).range(y.0, y.1)).titled("judged on fresh trials");
    Figure {
        title: format!("{} against {}", measures[1], measures[0]),
        subtitle: Some(subtitle),
        width: WIDTH,
        height: 860,
        panels: vec![marked(close), marked(looks)],
    }
}
