//! Wrong poles, undetermined poles and failures over one axis.

use super::place::place;
use super::slices::{Part, Slices, along, slices};
use super::sweep::{probability_axis, with_bars};
use super::{Caption, Estimate, Study, StudyPoint};
use crate::figure::{Axis, Figure, Layer, Panel, Style};

/// Name of a kind of failure, and the function that counts it.
pub(super) type Kind = (&'static str, fn(&StudyPoint) -> u64);

pub(super) const KINDS: [Kind; 3] =
    [("wrong pole", |p| p.wrong_poles), ("undetermined", |p| p.undetermined), ("failed", |p| p.failed)];

/// Returns the figure of the probabilities of failure over an axis of the study, with exact intervals on a logarithmic
/// scale. Points without failures have an arrow at the upper limit. Each kind of failure that occurred at least once
/// has separate panels. For other kinds the upper limits follow from the number of trials alone, and the subtitle
/// states them. If poles are not judged, wrong poles are not drawn.
///
/// Other axes are shown as [`slices`] describes. Several curves are shifted slightly, because their intervals and
/// arrows would hide each other.
pub(super) fn odds(caption: &Caption, study: &Study, axis: usize) -> Figure {
    let place = place(study, axis, false);
    let Slices { parts, mut remarks } = slices(study, &[axis], true);
    let found: Vec<_> = parts.iter().map(|part| along(study, axis, &place.values, &part.series)).collect();
    let all = || found.iter().flatten().flatten().flatten().copied();
    let never = never(all());
    let mut panels: Vec<Panel> = Vec::new();
    for (index, kind) in study.kinds().iter().enumerate() {
        let (name, count) = *kind;
        if index == 0 && study.poles_are_judged && all().all(|point| point.named() == 0) {
            remarks.push("no pole was named".to_owned());
            continue;
        }
        let seen = |curves: &Vec<Vec<Option<&StudyPoint>>>| {
            curves.iter().flatten().flatten().any(|point| count(point) > 0)
        };
        if !found.iter().any(seen) {
            remarks.push(format!("{name}: {}", none(study, all())));
            continue;
        }
        let y = one_scale(study, kind, all(), parts.len());
        for (Part { title, series }, found) in parts.iter().zip(&found) {
            if parts.len() > 1 && !seen(found) {
                let points = found.iter().flatten().flatten().copied();
                remarks.push(format!("{name}: {} with {title}", none(study, points)));
                continue;
            }
            let title = if title.is_empty() { String::new() } else { format!("{name}: {title}") };
            let mut panel = Panel::new(place.axis.clone(), y.clone()).titled(title);
            for (series, found) in series.iter().zip(found) {
                let found = place.shifted(series.shift).into_iter().zip(found.iter().copied());
                let found = found.filter_map(|(x, point)| Some((x, point?)));
                panel =
                    with_odds(panel, study, found, kind, series.style, (&series.label, &never), !place.named);
            }
            // What the first panel explains need not be explained again.
            let known = panels.first().map(labels).unwrap_or_default();
            panel.legend = labels(&panel).iter().any(|label| !known.contains(label));
            panels.push(panel);
        }
    }
    let height = 200 + 220 * u32::try_from(panels.len().max(1)).unwrap_or(1);
    caption.figure(&remarks, height, panels)
}

/// Returns the remark on a kind of failure that no start at any point had, and of which nothing is drawn.
pub(super) fn unseen(study: &Study) -> Option<String> {
    let mut kinds = study.kinds().iter();
    let nothing = kinds.all(|(_, count)| study.points.iter().all(|point| count(point) == 0));
    let names: Vec<&str> = study.kinds().iter().map(|(name, _)| *name).collect();
    let each = if names.len() > 1 { "each " } else { "" };
    (nothing && !study.points.is_empty())
        .then(|| format!("{}: {each}{}", names.join(", "), none(study, study.points.iter())))
}

/// Returns the vertical axis for the panels of a kind of failure, with one range for all of them.
fn one_scale<'a>(
    study: &Study,
    &(name, count): &Kind,
    all: impl Iterator<Item = &'a StudyPoint>,
    panels: usize,
) -> Axis {
    let axis = probability_axis(name);
    let ends = all.filter(|point| point.trials > 0).map(|point| {
        let Estimate { value, low, high } = (study.binomial)(count(point), point.trials);
        (
            if count(point) == 0 {
                high
            } else if low > 0.0 {
                low
            } else {
                value
            },
            high,
        )
    });
    let ends = ends.fold((f64::INFINITY, 0.0f64), |(low, high), (a, b)| (low.min(a), high.max(b)));
    if panels < 2 || ends.1 <= 0.0 { axis } else { axis.range(100.0 * ends.0 / 1.5, 150.0 * ends.1) }
}

/// Returns the entries of a panel's legend.
fn labels(panel: &Panel) -> Vec<String> {
    let of = |layer: &Layer| match layer {
        Layer::Line { label, .. } | Layer::ErrorBars { label, .. } | Layer::UpperLimits { label, .. } => {
            label.clone()
        }
        _ => None,
    };
    panel.layers.iter().filter_map(of).collect()
}

/// Returns the legend of an upper limit: with the number of trials of a point if that is the same everywhere.
pub(super) fn never<'a>(all: impl Iterator<Item = &'a StudyPoint>) -> String {
    let mut trials: Vec<u64> = all.map(|point| point.trials).filter(|trials| *trials > 0).collect();
    trials.sort_unstable();
    trials.dedup();
    match trials[..] {
        [one] => format!("none in {one}: upper limit"),
        _ => "none: upper limit".to_owned(),
    }
}

/// Returns the remark on a kind of failure that was not seen and has no panel: how likely it can be at most at the
/// point with the fewest trials.
fn none<'a>(study: &Study, points: impl Iterator<Item = &'a StudyPoint>) -> String {
    let fewest = points.map(|point| point.trials).filter(|trials| *trials > 0).min();
    fewest.map_or_else(
        || "none".to_owned(),
        |trials| format!("none, at most {:.2} % a point", 100.0 * (study.binomial)(0, trials).high),
    )
}

/// Adds probabilities in per cent, those of zero counts as upper limits.
pub(super) fn with_odds<'a>(
    mut panel: Panel,
    study: &Study,
    found: impl Iterator<Item = (f64, &'a StudyPoint)>,
    &(name, count): &Kind,
    style: Style,
    (label, never): (&str, &str),
    line: bool,
) -> Panel {
    let (mut bars, mut limits) = (Vec::new(), Vec::new());
    for (x, point) in found.filter(|(_, point)| point.trials > 0) {
        // Where no pole was named, none could be wrong.
        if name == KINDS[0].0 && point.named() == 0 {
            continue;
        }
        let Estimate { value, low, high } = (study.binomial)(count(point), point.trials);
        if count(point) == 0 {
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
