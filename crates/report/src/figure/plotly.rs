//! Conversion of a figure's description to a chart of Plotly, which can be zoomed, panned and read out in a browser.
//!
//! Data, ranges, colours, dashes and markers are those of the drawn figure. There are three differences: the page shows
//! titles and legends, the labels of rules are inside the panel, and series are not thinned. Scripts place the ticks of
//! logarithmic axes, because those of Plotly have no numbers between powers of ten.

mod heat;
mod lanes;
mod markup;
mod traces;

#[cfg(test)]
mod tests;

use super::axis::Ticks;
use super::style::{FRAME, GRID, INK, QUIET, WHITE};
use super::text::wrap;
use super::{Axis, AxisScale, Figure, Layer, Panel, extent, legend};
use serde_json::{Map, Number, Value, json};

pub(crate) use super::legend::{Entry, swatch};
pub(crate) use super::style::{Shade, palette};
pub(crate) use markup::markup;
pub(crate) use traces::group;

/// Pixels above all panels.
const ABOVE: f64 = 34.0;
/// Pixels below all panels.
const BELOW: f64 = 52.0;
/// Pixels between panels that share their horizontal axis.
const CLOSE: f64 = 20.0;
/// Pixels between panels with separate horizontal axes.
const APART: f64 = 62.0;
/// Over so many whole numbers automatic marks are whole too.
const FEW: f64 = 10.0;
/// Height of a panel's own title, out of the distance to the panel above.
const TITLED: f64 = 14.0;
/// A title that the page sets above the chart.
const TITLES: f64 = 40.0;

/// A figure in Plotly's terms.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chart {
    data: Vec<Value>,
    shapes: Vec<Value>,
    annotations: Vec<Value>,
    /// Legends of the panels with labelled layers: vertical label and entries of each.
    pub legend: Vec<Legend>,
}

/// The entries of a panel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Legend {
    /// Index of the panel.
    pub panel: usize,
    /// Title of the panel, or the name of its vertical quantity.
    pub title: String,
    pub entries: Vec<Entry>,
}

/// Returns the entries of all panels that have some.
pub(crate) fn legends(figure: &Figure) -> Vec<Legend> {
    let of = |(panel, own): (usize, &Panel)| {
        let shown = markup::quantity(&own.y.label).0.to_owned();
        let title = if own.title.is_empty() { shown } else { own.title.clone() };
        Legend { panel, title, entries: legend::entries(own) }
    };
    figure.panels.iter().enumerate().map(of).filter(|legend| !legend.entries.is_empty()).collect()
}

/// Returns the chart of a figure, and the JSON from which scripts draw it: `data`, `layout`, `steps`, the distances
/// of ticks by axis, which must become automatic when the view is smaller, and `logs`, the axes to mark in decades.
pub(crate) fn chart(figure: &Figure) -> (Chart, Value) {
    let mut chart = Chart { legend: legends(figure), ..Chart::default() };
    let height = (f64::from(figure.height) - TITLES).max(200.0);
    let unified = figure.panels.iter().flat_map(|panel| &panel.layers).all(read_together);
    let (mut layout, mut steps, mut logs) = (Map::new(), Map::new(), Vec::new());
    let domains = domains(&figure.panels, height - ABOVE - BELOW);
    let mut index = 0;
    for (number, panels) in figure.panels.chunk_by(|a, b| a.x == b.x).enumerate() {
        let shown = extent::horizontal(panels);
        let x = format!("x{}", suffix(number));
        for panel in panels {
            let y = format!("y{}", suffix(index));
            let y_range = extent::vertical(panel, shown);
            let (bottom, top) = domains[index];
            let tall = (top - bottom) * (height - ABOVE - BELOW);
            let place = traces::Place {
                panel,
                index,
                x: &x,
                y: &y,
                x_range: shown,
                y_range,
                tall: (bottom, top, tall),
                unified,
            };
            for layer in &panel.layers {
                traces::add(&mut chart, &place, layer);
            }
            chart.frame(&x, &y);
            if !panel.title.is_empty() {
                let over = json!({
                    "xref": format!("{x} domain"), "yref": format!("{y} domain"), "x": 0, "y": 1, "xanchor": "left",
                    "yanchor": "bottom",
                });
                chart.note(&panel.title, over);
            }
            if !extent::has_data(panel) {
                let middle =
                    json!({"xref": format!("{x} domain"), "yref": format!("{y} domain"), "x": 0.5, "y": 0.5});
                chart.note("no data", middle);
            }
            let upright = panel.lane_axis();
            let mut axis = axis(&upright, y_range, tall);
            axis["anchor"] = json!(x);
            axis["domain"] = json!([bottom, top]);
            axis["fixedrange"] = json!(panel.has_lanes());
            axis["showgrid"] = json!(!panel.has_lanes() && !panel.has_cells());
            let name = format!("yaxis{}", suffix(index));
            mark(&mut steps, &mut logs, &name, &upright);
            layout.insert(name, axis);
            index += 1;
        }
        let mut axis = axis(&panels[0].x, shown, 300.0);
        // The last of the panels has the texts of the ticks.
        axis["anchor"] = json!(format!("y{}", suffix(index - 1)));
        axis["showgrid"] = json!(!panels.iter().all(Panel::has_cells));
        if unified {
            axis["unifiedhovertitle"] = json!({"text": unified_title(&panels[0].x)});
            axis["spikecolor"] = json!(QUIET.css());
            axis["spikethickness"] = json!(1);
            axis["spikedash"] = json!("solid");
        }
        let name = format!("xaxis{}", suffix(number));
        mark(&mut steps, &mut logs, &name, &panels[0].x);
        layout.insert(name, axis);
    }
    chart.tell_apart(figure);
    layout.extend(common(height, unified));
    layout.insert("shapes".into(), json!(chart.shapes));
    layout.insert("annotations".into(), json!(chart.annotations));
    let value = json!({"data": chart.data, "layout": layout, "steps": steps, "logs": logs});
    (chart, value)
}

/// Returns whether a layer is read by comparing values at the same x rather than point by point.
fn read_together(layer: &Layer) -> bool {
    !matches!(
        layer,
        Layer::Points { .. }
            | Layer::ErrorBars { .. }
            | Layer::Hollow { .. }
            | Layer::UpperLimits { .. }
            | Layer::Hatched { .. }
            | Layer::Heat { .. }
    )
}

fn unified_title(x: &Axis) -> String {
    let (name, unit) = markup::quantity(&x.label);
    format!("{}: %{{x{}}}{}", markup::template(name), traces::X_DIGITS, markup::template(&unit))
}

/// Returns the suffix of an axis's name: Plotly counts `x`, `x2`, `x3`.
fn suffix(index: usize) -> String {
    if index == 0 { String::new() } else { (index + 1).to_string() }
}

/// Returns bottom and top of each panel as shares of the height, which is given in pixels.
fn domains(panels: &[Panel], height: f64) -> Vec<(f64, f64)> {
    let weight = |panel: &Panel| {
        if panel.weight.is_finite() && panel.weight > 0.0 { panel.weight } else { 1.0 }
    };
    let gap = |pair: &[Panel]| {
        let titled = if pair[1].title.is_empty() { 0.0 } else { TITLED };
        titled + if pair[0].x == pair[1].x { CLOSE } else { APART }
    };
    let gaps: Vec<f64> = panels.windows(2).map(gap).collect();
    // Many panels in a low figure: the gaps take at most half of it.
    let squeeze = (0.5 * height / gaps.iter().sum::<f64>().max(1.0)).min(1.0);
    let total: f64 = panels.iter().map(weight).sum();
    let room = height - squeeze * gaps.iter().sum::<f64>();
    let mut top = height;
    let mut places = Vec::new();
    for (index, panel) in panels.iter().enumerate() {
        let bottom = (top - room * weight(panel) / total).max(0.0);
        places.push((rounded(bottom / height), rounded(top / height)));
        top = bottom - squeeze * gaps.get(index).copied().unwrap_or(0.0);
    }
    places
}

/// Returns an axis over a range, its label in lines of at most `room` pixels.
fn axis(axis: &Axis, (first, last): (f64, f64), room: f64) -> Value {
    let label: Vec<_> = wrap(&axis.label, 14.0, room).iter().map(|line| markup(line)).collect();
    let mut value = json!({
        "title": {"text": label.join("<br>"), "standoff": 8, "font": {"size": 13}},
        "range": [number(axis.scale.even(first)), number(axis.scale.even(last))],
        "automargin": true,
        "zeroline": false,
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": FRAME.css(),
        "gridcolor": GRID.css(),
        "exponentformat": "power",
        "tickfont": {"size": 12},
    });
    if axis.scale == AxisScale::Log10 {
        value["type"] = json!("log");
    }
    match &axis.ticks {
        Ticks::Step(step) if step.is_finite() && *step > 0.0 && axis.scale == AxisScale::Linear => {
            value["tick0"] = json!(0);
            value["dtick"] = json!(step);
        }
        Ticks::Whole if axis.scale == AxisScale::Linear && last - first < FEW => {
            value["tick0"] = json!(0);
            value["dtick"] = json!(1);
        }
        Ticks::Named(names) => {
            value["tickmode"] = json!("array");
            value["tickvals"] = numbers(names.iter().map(|(at, _)| *at));
            let text = |name: &str| {
                wrap(name, 13.0, 110.0).iter().map(|line| markup(line)).collect::<Vec<_>>().join("<br>")
            };
            value["ticktext"] = names.iter().map(|(_, name)| text(name)).collect();
        }
        _ => (),
    }
    value
}

/// Notes how scripts are to mark an axis, if Plotly alone cannot.
fn mark(steps: &mut Map<String, Value>, logs: &mut Vec<String>, name: &str, axis: &Axis) {
    match axis.ticks {
        Ticks::Named(_) => (),
        _ if axis.scale == AxisScale::Log10 => logs.push(name.to_owned()),
        Ticks::Step(step) if step.is_finite() && step > 0.0 => {
            steps.insert(name.to_owned(), json!(step));
        }
        _ => (),
    }
}

/// Returns the part of the layout that all charts have in common.
fn common(height: f64, unified: bool) -> Map<String, Value> {
    let value = json!({
        "height": height,
        "margin": {"l": 12, "r": 14, "t": ABOVE, "b": 12, "pad": 0},
        "paper_bgcolor": WHITE.css(),
        "plot_bgcolor": WHITE.css(),
        "font": {"color": INK.css(), "size": 12},
        "showlegend": false,
        "barmode": "overlay",
        // A sweep has few points, which a pointer between two of them should find too.
        "hoverdistance": 100,
        "hovermode": if unified { "x unified" } else { "closest" },
        "hoversubplots": "axis",
        "hoverlabel": {
            "bgcolor": WHITE.css(), "bordercolor": FRAME.css(), "font": {"color": INK.css(), "size": 12}, "align": "left",
        },
        // What was zoomed stays so when colours change.
        "uirevision": "kept",
    });
    value.as_object().cloned().unwrap_or_default()
}

impl Chart {
    /// Panels that show the same over different axes are named by both.
    fn tell_apart(&mut self, figure: &Figure) {
        let titles: Vec<_> = self.legend.iter().map(|legend| legend.title.clone()).collect();
        for legend in &mut self.legend {
            if titles.iter().filter(|title| **title == legend.title).count() > 1 {
                let x = markup::quantity(&figure.panels[legend.panel].x.label).0;
                legend.title = format!("{} over {x}", legend.title);
            }
        }
    }

    /// Draws the frame of a panel. The lines of an axis that panels share would be around the last of them only.
    fn frame(&mut self, x: &str, y: &str) {
        self.shapes.push(json!({
            "type": "rect", "xref": format!("{x} domain"), "yref": format!("{y} domain"),
            "x0": 0, "x1": 1, "y0": 0, "y1": 1, "line": {"color": FRAME.css(), "width": 1.0},
        }));
    }

    /// Adds a quiet text at a place.
    fn note(&mut self, text: &str, mut place: Value) {
        place["text"] = json!(markup(text));
        place["showarrow"] = json!(false);
        place["font"] = json!({"color": QUIET.css(), "size": 12});
        self.annotations.push(place);
    }
}

/// Returns a number with nine digits, or `null` for a gap. Longer ones would only make the page larger.
fn number(value: f64) -> Value {
    let value = rounded(value);
    if value.fract() == 0.0 && value.abs() < 1e9 {
        #[expect(clippy::cast_possible_truncation, reason = "a whole number of nine digits")]
        return Value::from(value as i64);
    }
    Number::from_f64(value).map_or(Value::Null, Value::Number)
}

fn numbers(values: impl Iterator<Item = f64>) -> Value {
    values.map(number).collect()
}

fn rounded(value: f64) -> f64 {
    if value.is_finite() { standstill_quantity::significant(value, 9) } else { value }
}
