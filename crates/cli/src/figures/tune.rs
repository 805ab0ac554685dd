//! Figure of a search for settings: one measure over another.

use standstill_analysis::limit::Measure;
use standstill_analysis::tune::{Judged, Question, Tuned, View};
use standstill_campaign::Estimate;
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style};

use super::parts::ends;
use crate::shell::values::scale;

/// Draws the minimised measure over another measure, with all settings that were tried, the Pareto front, and the initial and the best
/// settings.
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
        let y = y.map(|value| scales[1].number(value));
        (scales[0].number(x.value), y.value, y.low, y.high)
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
    // If too many starts have no answer, a measure is not finite: such a setting is not drawn.
    let drawable = |judged: &Judged| Some(place(judged)).filter(|p| p.0.is_finite() && p.1.is_finite());
    let front: Vec<_> = tuned.front.iter().filter_map(drawable).collect();
    let [start, best] = [&tuned.start, &tuned.best].map(drawable);
    let last = if tuned.is_found() { "best" } else { "nearest, breaks a limit" };
    let missing = [("start", &tuned.start, start), (last, &tuned.best, best)];
    let missing = missing.into_iter().filter(|(_, _, at)| at.is_none()).map(|(what, judged, _)| {
        let y = judged.measured.get(measures[1]);
        absent(what, y.map(|value| scales[1].number(value)), &scales[1].unit, measures)
    });
    let alike = alike(start, best, measures[0]);
    let subtitle = std::iter::once(subtitle).chain(missing).chain(alike).collect::<Vec<_>>().join("; ");
    // The close-up covers start, best and front; other settings that were looked at may lie far off.
    let answered = || front.iter().copied().chain(start).chain(best);
    let xs = ends(answered().map(|p| p.0));
    let ys = ends(answered().flat_map(|p| [p.1, p.2, p.3]));
    let drawn = |k: usize| {
        let of = |(_, (x, y)): &(bool, (f64, f64))| if k == 0 { *x } else { *y };
        let near = if k == 0 { [xs.0, xs.1] } else { [ys.0, ys.1] };
        ends(kept.iter().chain(&broken).map(of).chain(near))
    };
    // Logarithmic if the range is wider than a factor of three.
    let scaled = |k: usize, (low, high): (f64, f64)| {
        if low > 0.0 && high > 3.0 * low {
            axis(k).log10().range(low / 1.1, 1.1 * high)
        } else {
            let (low, high) = around((low, high));
            axis(k).range(low, high)
        }
    };
    let points = |all: Vec<(bool, (f64, f64))>| all.into_iter().map(|(_, point)| point);
    // Search and judgement draw different random numbers: on those of the search, a setting can look better than it is.
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
        let marks = match (start, best) {
            (Some(start), Some(best)) if start == best => {
                vec![(judged(&format!("start, and {last}")), Style::Blue, start)]
            }
            _ => [("start", Style::Vermilion, start), (last, Style::Blue, best)]
                .into_iter()
                .filter_map(|(what, style, at)| Some((judged(what), style, at?)))
                .collect(),
        };
        marks
            .into_iter()
            .fold(panel, |panel, (label, style, at)| panel.with(Layer::error_bars(&label, style, [at])))
    };
    // Two panels: all settings that were looked at, and a close-up of start, best and front.
    let mut looks = Panel::new(scaled(0, drawn(0)), scaled(1, drawn(1))).titled("all settings looked at");
    if !broken.is_empty() {
        let label = format!("{searched}, breaks a limit");
        looks = looks.with(Layer::points(&label, Style::Orange, points(broken.clone())));
    }
    looks = looks.with(Layer::points(&searched, Style::Purple, points(kept.clone())));
    let close = Panel::new(scaled(0, xs), scaled(1, ys)).titled("judged on fresh trials");
    Figure::new(
        format!("{} against {}", measures[1], measures[0]),
        subtitle,
        860,
        [marked(close), marked(looks)],
    )
}

/// Returns the note that the initial or the best settings cannot be drawn, with their measure.
fn absent(what: &str, has: Estimate, unit: &str, [against, measure]: [Measure; 2]) -> String {
    let said = if has.value.is_finite() { format!(", {measure} {has} {unit}") } else { String::new() };
    format!("{what}{said}: not drawn, too many starts without an answer to have a {against}")
}

/// Position in the figure: x, y, and the two ends of the interval of y.
type Place = (f64, f64, f64, f64);

/// Returns a note if the initial and the best settings have the same x. The figure then shows the improvement, but not its cost.
fn alike(start: Option<Place>, best: Option<Place>, against: Measure) -> Option<String> {
    let (start, best) = start.zip(best)?;
    let alike = start != best && (start.0 - best.0).abs() <= 1e-6 * best.0.abs();
    alike.then(|| format!("start and best have the same {against}: --against draws another measure"))
}

/// Widens a range on both sides, so that no point lies on the frame.
fn around((low, high): (f64, f64)) -> (f64, f64) {
    if low > high {
        return (0.0, 1.0);
    }
    let room = if high > low { 0.08 * (high - low) } else { 0.02 * high.abs().max(1e-12) };
    (low - room, high + room)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use standstill_analysis::bracket::Verdict;
    use standstill_analysis::tune::{Effort, Goal, Measured};
    use standstill_scenario::Document;

    use super::*;

    /// Rms error and duration of settings.
    fn judged(rms: [f64; 3], duration: f64) -> Judged {
        let [value, low, high] = rms;
        let of = |value| Estimate { value, low: value, high: value };
        let measured =
            Measured(vec![(Measure::Rms, Estimate { value, low, high }), (Measure::Duration, of(duration))]);
        Judged { values: vec![1.0], measured }
    }

    fn drawn(start: Judged, best: Judged) -> Figure {
        let document = Document::parse(Path::new("s.toml"), "").expect("TOML");
        let limits: standstill_analysis::limit::Limits = "unanswered <= 5 %".parse().expect("limits");
        let asked = Question {
            document: &document,
            ranges: Vec::new(),
            goal: Goal { minimise: Measure::Rms, limits },
            relative: Vec::new(),
            against: Measure::Duration,
            effort: Effort { starts: 1, coarse: 1, fine: 1, last: 1 },
            seed: 1,
        };
        let differences = Measured(Vec::new());
        let limits = Verdict { holds: true, surely: true, possibly: true };
        let front = vec![best.clone()];
        tune(&asked, &Tuned { start, best, differences, limits, front, looks: Vec::new() }, "test".to_owned())
    }

    /// The bars of a panel: their legend and their values.
    fn bars(panel: &Panel) -> Vec<(&str, f64)> {
        let of = |layer| match layer {
            &Layer::ErrorBars { label: Some(ref label), ref points, .. } => {
                Some((label.as_str(), points[0].1))
            }
            _ => None,
        };
        panel.layers.iter().filter_map(of).collect()
    }

    #[test]
    fn regress_settings_without_a_place_are_said_and_whiskers_are_whole() {
        // So many starts without an answer that there is no duration: it is not drawn, and does not stretch the scale.
        let figure = drawn(judged([25.9, 23.7, 28.1], f64::INFINITY), judged([0.11, 0.10, 4.5], 0.027));
        let said = figure.subtitle.as_deref().expect("a subtitle");
        assert!(said.contains("start, rms 25.9 [23.7, 28.1] °: not drawn"), "{said}");
        for panel in &figure.panels {
            assert!(bars(panel).iter().all(|(label, _)| !label.starts_with("start")), "{:?}", bars(panel));
            let (low, high) = panel.y.range.expect("a range");
            assert!(low < 0.10 && (4.5..25.0).contains(&high), "{low} to {high}");
            let (from, to) = panel.x.range.expect("a range");
            assert!(from < 27.0 && 27.0 < to && to.is_finite(), "{from} to {to}");
        }
        // Where nothing beats the start, one bar says so.
        let same = judged([0.11, 0.10, 0.12], 0.027);
        let figure = drawn(same.clone(), same);
        let bars = bars(&figure.panels[0]);
        assert_eq!(
            bars.iter().filter(|(label, _)| label.starts_with("start, and best")).count(),
            1,
            "{bars:?}"
        );
        // The start and the best settings have the same second measure: another measure would show the cost of the gain.
        let said = |duration: f64| {
            let figure = drawn(judged([0.3, 0.2, 0.4], duration), judged([0.11, 0.10, 0.12], 0.027));
            figure.subtitle.expect("a subtitle").contains("start and best have the same duration: --against")
        };
        assert_eq!([0.027, 0.03].map(said), [true, false]);
        // Nothing at all can be drawn: no panic.
        let none = judged([90.0, 90.0, 90.0], f64::INFINITY);
        assert!(drawn(none.clone(), none).svg().is_ok());
    }
}
