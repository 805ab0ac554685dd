//! Figure of a comparison of methods.

use standstill_analysis::Entry;
use standstill_report::figure::{Axis, Figure, Layer, Panel, Style, Ticks};

use super::parts::ends;
use crate::shell::setup::in_words;
use crate::shell::values::{each_once, range};
use crate::summary::{FAILING, GOOD, good};

/// Place of one row of the chart: a method under one set of conditions. The rows of one method lie below each other.
struct Place {
    /// Vertical position: the index of the method, counted from the bottom, plus an offset for the conditions.
    y: f64,
    label: String,
    style: Style,
}

/// The points of one set of conditions for all methods. `points` are markers at the rms error, and `ways` are lines from the rms error to
/// the 95th percentile, with a gap after each. Each point contains the error in degrees and the vertical position.
struct Series {
    label: String,
    style: Style,
    points: Vec<(f64, f64)>,
    /// Points with more than 1 % of starts without a right answer, drawn as rings.
    failing: Vec<(f64, f64, f64, f64)>,
    ways: Vec<(f64, f64)>,
}

/// Styles that distinguish the conditions in one panel. Black crosses are not among them, because they mark the limits.
const STYLES: [Style; 5] = [Style::Blue, Style::Vermilion, Style::Orange, Style::Green, Style::Purple];

/// Smallest height of the figure in pixels. On a narrow page, the title, the subtitle and the legend can each need several lines.
const LEAST_HEIGHT: f64 = 340.0;

fn condition(entry: &Entry) -> String {
    format!("{} rotor, {}", entry.rotor.name(), in_words(entry.errors))
}

fn conditions(entries: &[&Entry]) -> Vec<String> {
    each_once(entries.iter().map(|entry| condition(entry)))
}

fn limit(entry: &Entry) -> f64 {
    entry.limit().unwrap_or(f64::NAN)
}

/// Draws the error of each method under each set of conditions on a logarithmic axis. A marker shows the rms error, a line ends at the 95th
/// percentile, and a cross shows the Cramér–Rao limit of the method's samples. The figure has one panel, or one panel for each state of the
/// rotor if there are more conditions than styles. If `open` is true, poles are not judged, and a start with an axis is correct.
pub fn comparison(entries: &[Entry], subtitle: String, open: bool) -> Figure {
    // A method without an axis in any start has nothing to draw.
    let has_axis = |method: &str| {
        entries.iter().any(|entry| entry.method == method && entry.summary.rms_deg.value.is_finite())
    };
    let mut without: Vec<&str> =
        entries.iter().map(|entry| entry.method.as_str()).filter(|method| !has_axis(method)).collect();
    without.dedup();
    let subtitle = if without.is_empty() {
        subtitle
    } else {
        format!("{subtitle}; not drawn, because no start found an axis: {}", without.join(", "))
    };
    let rings =
        entries.iter().any(|entry| has_axis(&entry.method) && 1.0 - good(&entry.summary, open) > FAILING);
    let subtitle = if rings {
        let without = if open { "an axis" } else { "a right answer" };
        format!("{subtitle}; ring: more than 1 % of starts without {without}")
    } else {
        subtitle
    };
    let drawn: Vec<&Entry> = entries.iter().filter(|entry| has_axis(&entry.method)).collect();
    let values = drawn
        .iter()
        .flat_map(|entry| [entry.summary.rms_deg.value, entry.summary.p95_deg.value, limit(entry)])
        // Zero has no place on a logarithmic axis.
        .filter(|degrees| *degrees > 0.0);
    let (low, high) = ends(values);
    let ends = if low <= high { (low, high) } else { (0.01, 10.0) };
    let mut groups: Vec<Vec<&Entry>> = vec![drawn.clone()];
    if conditions(&groups[0]).len() > STYLES.len() {
        groups.clear();
        for entry in drawn {
            match groups.iter_mut().find(|group| group[0].rotor == entry.rotor) {
                Some(group) => group.push(entry),
                None => groups.push(vec![entry]),
            }
        }
    }
    let panels: Vec<Panel> = groups.iter().map(|group| panel(group, ends, open)).collect();
    let heights: f64 = panels.iter().map(|panel| panel.weight).sum();
    // At most 4000 pixels: the cast drops the fraction alone.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let height = (120.0 + 50.0 * panels.len() as f64 + heights).clamp(LEAST_HEIGHT, 4000.0) as u32;
    Figure::new(
        "Methods compared: marker at the rms error, line to the 95th percentile",
        subtitle,
        height,
        panels,
    )
}

/// Draws a panel. The panel's weight is its height in pixels.
fn panel(entries: &[&Entry], (low, high): (f64, f64), open: bool) -> Panel {
    let conditions = conditions(entries);
    let methods = each_once(entries.iter().map(|entry| entry.method.as_str()));
    let row = |entry: &Entry| {
        let label = condition(entry);
        let method = methods.iter().position(|known| *known == entry.method.as_str()).unwrap_or(0);
        let place = conditions.iter().position(|known| *known == label).unwrap_or(0);
        let within = (place as f64 + 0.5) / conditions.len() as f64 - 0.5;
        let y = (methods.len() - 1 - method) as f64 - 0.7 * within;
        Place { y, label, style: STYLES[place % STYLES.len()] }
    };
    // Only starts with an axis have an error, so a method that answers few starts would look good: its name shows the
    // share.
    let named = |name: &str| {
        let shares = || {
            entries.iter().filter(|e| e.method == name).map(|e| (good(&e.summary, open), e.summary.trials))
        };
        let range = range(shares()).filter(|_| shares().any(|(share, _)| share < GOOD));
        let did = if open { "with an axis" } else { "right" };
        range.map_or_else(|| name.to_owned(), |range| format!("{name}, {range} {did}"))
    };
    let names = methods.iter().rev().enumerate().map(|(k, name)| (k as f64, named(name))).collect();
    let x = Axis::new("error of the axis (° electrical)").log10().range(low / 1.25, high * 1.25);
    let y = Axis { ticks: Ticks::Named(names), ..Axis::new("") };
    let mut panel = Panel::new(x, y.range(-0.6, methods.len() as f64 - 0.4));
    panel.weight = (methods.len() * (24 + 13 * conditions.len())) as f64;
    let mut limits = Vec::new();
    let mut series: Vec<Series> = Vec::new();
    for entry in entries {
        let Place { y, label, style } = row(entry);
        let [rms, p95] = [entry.summary.rms_deg.value, entry.summary.p95_deg.value];
        let known = series.iter().position(|known| known.label == label).unwrap_or_else(|| {
            series.push(Series { label, style, points: Vec::new(), failing: Vec::new(), ways: Vec::new() });
            series.len() - 1
        });
        if 1.0 - good(&entry.summary, open) > FAILING {
            series[known].failing.push((rms, y, f64::NAN, f64::NAN));
        } else {
            series[known].points.push((rms, y));
        }
        series[known].ways.extend([(rms, y), (p95, y), (f64::NAN, y)]);
        limits.push((limit(entry), y));
    }
    for Series { label, style, points, failing, ways } in series {
        panel = panel.with(Layer::Line { label: None, points: ways, style }).with(Layer::Points {
            label: Some(label.clone()),
            points,
            style,
        });
        if !failing.is_empty() {
            panel = panel.with(Layer::hollow(&label, style, failing));
        }
    }
    if limits.iter().any(|(limit, _)| limit.is_finite()) {
        let label = Some("Cramér–Rao limit of its samples".to_owned());
        panel = panel.with(Layer::Points { label, points: limits, style: Style::Black });
    }
    panel
}
