//! Wrong poles, undetermined poles and failures over one axis.

use super::place::{found, place, series};
use super::sweep::{probability_axis, with_bars};
use super::{Caption, Interval, Pooled, Study};
use crate::figure::{Figure, Layer, Panel, Style};

/// How a detection can go wrong, and where that is counted.
pub(super) type Kind = (&'static str, fn(&Pooled) -> u64, fn(&Pooled) -> Interval);

pub(super) const KINDS: [Kind; 3] = [
    ("wrong pole", |p| p.wrong_poles, |p| p.wrong_pole),
    ("undetermined", |p| p.undetermined, |p| p.undetermined_probability),
    ("failed", |p| p.failed, |p| p.failed_probability),
];

/// Probability of a wrong pole over an axis of the study, with exact intervals on a logarithmic scale; where none was
/// seen, an arrow at the upper limit. Undetermined poles and failures have panels of their own if there were any.
///
/// Other axes with few values become series, the rest is pooled. Several series stand a little beside their values,
/// since their intervals and arrows would hide each other.
pub(super) fn odds(caption: &Caption, study: &Study, axis: usize) -> Figure {
    let place = place(study, axis, false);
    let (series, mut remarks) = series(study, &[axis]);
    let found = found(study, axis, &place, &series);
    let never = never(found.iter().flatten());
    let mut panels: Vec<Panel> = Vec::new();
    for (index, kind) in KINDS.iter().enumerate() {
        let (name, count, _) = *kind;
        if index == 0 && found.iter().flatten().all(|pooled| pooled.named() == 0) {
            remarks.push("no pole was named".to_owned());
            continue;
        }
        if index > 0 && found.iter().flatten().all(|pooled| count(pooled) == 0) {
            remarks.push(format!("{name}: none"));
            continue;
        }
        let mut panel = Panel::new(place.axis.clone(), probability_axis(name));
        for (series, found) in series.iter().zip(&found) {
            let found = place.shifted(series.shift).into_iter().zip(found);
            panel = with_odds(panel, found, kind, series.style, (&series.label, &never), !place.named);
        }
        // The series of the first panel are those of all.
        panel.legend = true;
        panels.push(panel);
    }
    let height = [420, 640, 860][panels.len().clamp(1, 3) - 1];
    caption.figure(&remarks, height, panels)
}

/// The legend of an upper limit: with the number of trials if that is the same everywhere.
pub(super) fn never<'a>(all: impl Iterator<Item = &'a Pooled>) -> String {
    let mut trials: Vec<u64> = all.map(|pooled| pooled.trials).filter(|trials| *trials > 0).collect();
    trials.sort_unstable();
    trials.dedup();
    match trials[..] {
        [one] => format!("none in {one}: upper limit"),
        _ => "none: upper limit".to_owned(),
    }
}

/// Adds probabilities in per cent, those of zero counts as upper limits.
pub(super) fn with_odds<'a>(
    mut panel: Panel,
    found: impl Iterator<Item = (f64, &'a Pooled)>,
    &(name, count, probability): &Kind,
    style: Style,
    (label, never): (&str, &str),
    line: bool,
) -> Panel {
    let (mut bars, mut limits) = (Vec::new(), Vec::new());
    for (x, pooled) in found.filter(|(_, pooled)| pooled.trials > 0) {
        // Where no pole was named, none could be wrong.
        if name == KINDS[0].0 && pooled.named() == 0 {
            continue;
        }
        let Interval { value, low, high } = probability(pooled);
        if count(pooled) == 0 {
            limits.push((x, 100.0 * high));
            // The line has a gap there.
            bars.push((x, f64::NAN, f64::NAN, f64::NAN));
        } else {
            bars.push((x, 100.0 * value, 100.0 * low, 100.0 * high));
        }
    }
    // A series of arrows alone needs its entry too.
    if !label.is_empty() || bars.iter().any(|bar| bar.1.is_finite()) {
        let label = if label.is_empty() { "with 95 % interval" } else { label };
        panel = with_bars(panel, label, bars, style, line);
    }
    if !limits.is_empty() {
        // One entry explains the arrows of all series.
        let known =
            panel.layers.iter().any(|layer| matches!(layer, Layer::UpperLimits { label: Some(_), .. }));
        panel = panel.with(Layer::upper_limits(if known { "" } else { never }, style, limits));
    }
    panel
}
