//! Layers as traces, shapes and annotations.

use super::super::layers::BAND_OPACITY;
use super::super::style::{LINE_WIDTH, MARKER_RADIUS, Marker, QUIET, RULE_DASHES, Style, faded};
use super::super::{Layer, Panel, Ticks};
use super::colour::css;
use super::markup::{markup, quantity, template};
use super::{Chart, Key, lanes, number, numbers};
use serde_json::{Value, json};

/// Digits of values read out, more than any sensor of the trade has; instants have one more.
const DIGITS: &str = ":.5~g";
pub(super) const X_DIGITS: &str = ":.6~g";

/// How the read-outs of traces with a name begin: together with others, and alone.
const NAMED: [&str; 2] = ["%{fullData.name}: ", "%{fullData.name}<br>"];

/// Where a panel's layers go.
pub(super) struct Place<'a> {
    pub panel: &'a Panel,
    /// Number of the panel in its figure; legend entries of different panels are switched apart.
    pub index: usize,
    /// Names of the axes, such as `x` and `y2`.
    pub x: &'a str,
    pub y: &'a str,
    /// Whether one read-out shows all values at the same x.
    pub unified: bool,
}

/// Adds one layer to a chart. A new kind of layer is one more arm here.
pub(super) fn add(chart: &mut Chart, place: &Place, layer: &Layer) {
    match layer {
        Layer::Line { label, points, style } => {
            line(chart, place, label.as_deref(), points, *style, "linear");
        }
        Layer::Steps { label, points, style } => line(chart, place, label.as_deref(), points, *style, "hv"),
        Layer::Points { label, points, style } => {
            let trace = scatter(place, points, "markers", json!({"marker": markers(*style, points.len())}));
            place.push(chart, label.as_deref(), Key::Marker(*style), trace);
        }
        Layer::Band { label, points, style } => band(chart, place, label.as_deref(), points, *style),
        Layer::ErrorBars { label, points, style } => {
            place.push(chart, label.as_deref(), Key::Bar(*style), error_bars(place, points, *style));
        }
        Layer::HorizontalRule { label, y } => horizontal_rule(chart, place, label.as_deref(), *y),
        Layer::VerticalRule { label, x } => vertical_rule(chart, place, label.as_deref(), *x),
        Layer::Lanes { lanes, categories } => lanes::add(chart, place, lanes, categories),
        Layer::Heat { .. } | Layer::UpperLimits { .. } => {}
    }
}

impl Place<'_> {
    /// Adds a trace to its axes and, if it has a label, to the group that a legend entry switches.
    pub(super) fn push(&self, chart: &mut Chart, label: Option<&str>, key: Key, mut trace: Value) {
        trace["xaxis"] = json!(self.x);
        trace["yaxis"] = json!(self.y);
        if let Some(label) = label {
            trace["name"] = json!(markup(label));
            trace["legendgroup"] = json!(group(self.index, label));
            self.entry(chart, label, key);
        } else if let Some(read) = trace["hovertemplate"].as_str() {
            // Plotly would call it "trace 3".
            let unnamed = NAMED.iter().find_map(|start| read.strip_prefix(start)).unwrap_or(read);
            trace["hovertemplate"] = json!(unnamed);
        }
        chart.data.push(trace);
    }

    /// Adds a key to the legend, if the panel has one.
    pub(super) fn entry(&self, chart: &mut Chart, label: &str, key: Key) {
        if self.panel.legend {
            chart.entry(self.index, quantity(&self.panel.y.label).0, label, key);
        }
    }

    /// The read-out of a point; `y` writes the vertical value with its unit.
    fn read_out(&self, y: impl Fn(&str) -> String) -> String {
        let (name, unit) = quantity(&self.panel.x.label);
        let x = if matches!(self.panel.x.ticks, Ticks::Named(_)) {
            "%{text}".to_owned()
        } else {
            format!("{}: %{{x{X_DIGITS}}}{}", template(name), template(&unit))
        };
        let (of_y, unit) = quantity(&self.panel.y.label);
        let y = y(&template(&unit));
        if self.unified {
            // The value at x stands above all of them.
            format!("{}{y}<extra></extra>", NAMED[0])
        } else {
            format!("{}{x}<br>{}: {y}<extra></extra>", NAMED[1], template(of_y))
        }
    }

    /// What is written for each x on an axis of names: the nearest of them.
    fn names(&self, xs: impl Iterator<Item = f64>) -> Value {
        let Ticks::Named(names) = &self.panel.x.ticks else { return Value::Null };
        let distance = |x: f64, at: f64| if x.is_finite() { (x - at).abs() } else { f64::INFINITY };
        xs.map(|x| {
            let nearest = names.iter().min_by(|a, b| distance(x, a.0).total_cmp(&distance(x, b.0)));
            nearest.map_or_else(String::new, |(_, name)| markup(name))
        })
        .collect()
    }
}

/// The legend group of a label in a panel.
pub(super) fn group(panel: usize, label: &str) -> String {
    format!("{panel}:{label}")
}

/// A scatter trace with the values of `more`.
fn scatter(place: &Place, points: &[(f64, f64)], mode: &str, more: Value) -> Value {
    let mut trace = json!({
        "type": "scatter",
        "mode": mode,
        "x": numbers(points.iter().map(|p| p.0)),
        "y": numbers(points.iter().map(|p| p.1)),
        "hovertemplate": place.read_out(|unit| format!("%{{y{DIGITS}}}{unit}")),
        "showlegend": false,
    });
    let names = place.names(points.iter().map(|p| p.0));
    if names != Value::Null {
        trace["text"] = names;
    }
    merge(&mut trace, more);
    trace
}

fn merge(trace: &mut Value, more: Value) {
    if let (Some(trace), Value::Object(more)) = (trace.as_object_mut(), more) {
        trace.extend(more);
    }
}

fn line(
    chart: &mut Chart,
    place: &Place,
    label: Option<&str>,
    points: &[(f64, f64)],
    style: Style,
    shape: &str,
) {
    let look = json!({"line": {
        "color": css(style.colour()), "width": LINE_WIDTH, "dash": dash(style.dashes()), "shape": shape,
    }, "connectgaps": false});
    place.push(chart, label, Key::Line(style), scatter(place, points, "lines", look));
    // Between two gaps there is no line to draw, but there is a value.
    let known = |i: usize| points.get(i).is_some_and(|p| p.0.is_finite() && p.1.is_finite());
    let alone = |i: &usize| known(*i) && !known(i.wrapping_sub(1)) && !known(i + 1);
    let lone: Vec<_> = (0..points.len()).filter(alone).map(|i| points[i]).collect();
    if !lone.is_empty() {
        let look =
            json!({"marker": {"symbol": "circle", "size": 2.0 * LINE_WIDTH, "color": css(style.colour())}});
        place.push(chart, label, Key::Line(style), scatter(place, &lone, "markers", look));
    }
}

/// Plotly takes lengths of strokes and gaps as CSS does.
fn dash(lengths: &[f64]) -> String {
    if lengths.is_empty() {
        return "solid".to_owned();
    }
    lengths.iter().map(|length| format!("{length}px")).collect::<Vec<_>>().join(",")
}

/// Markers that become small and translucent when there are many, as in the drawn figure.
fn markers(style: Style, count: usize) -> Value {
    let colour = css(style.colour());
    match count {
        0..=200 => {
            let line = json!({"width": 1.4, "color": colour});
            json!({"symbol": symbol(style), "size": 2.0 * MARKER_RADIUS, "color": colour, "line": line})
        }
        201..=1000 => json!({"symbol": "circle", "size": 4.5, "color": colour, "opacity": 0.7}),
        _ => json!({"symbol": "circle", "size": 3.5, "color": colour, "opacity": 0.45}),
    }
}

fn symbol(style: Style) -> &'static str {
    match style.marker() {
        Marker::Disc => "circle",
        Marker::Square => "square-open",
        Marker::Cross => "x-thin-open",
        Marker::Triangle => "triangle-up",
        Marker::Diamond => "diamond-open",
        Marker::Plus => "cross-thin-open",
    }
}

fn band(chart: &mut Chart, place: &Place, label: Option<&str>, points: &[(f64, f64, f64)], style: Style) {
    let usable = |p: &(f64, f64, f64)| p.0.is_finite() && p.1.is_finite() && p.2.is_finite();
    // A fill would cross gaps: each stretch without one has its own pair of edges.
    for run in points.chunk_by(|a, b| usable(a) == usable(b)).filter(|run| usable(&run[0])) {
        let edge = json!({"color": css(faded(style.colour(), 0.8)), "width": 0.75});
        let lower: Vec<_> = run.iter().map(|p| (p.0, p.1)).collect();
        let upper: Vec<_> = run.iter().map(|p| (p.0, p.2)).collect();
        let mut below = scatter(place, &lower, "lines", json!({"line": edge, "hoverinfo": "skip"}));
        below.as_object_mut().and_then(|trace| trace.remove("hovertemplate"));
        place.push(chart, label, Key::Band(style), below);
        let above = json!({
            "line": edge,
            "fill": "tonexty",
            "fillcolor": css(faded(style.colour(), BAND_OPACITY)),
            "customdata": numbers(run.iter().map(|p| p.1)),
            "hovertemplate": place.read_out(|unit| format!("%{{customdata{DIGITS}}} to %{{y{DIGITS}}}{unit}")),
        });
        place.push(chart, label, Key::Band(style), scatter(place, &upper, "lines", above));
    }
}

/// Without a value there is no place for whiskers, as Plotly draws them: such a point is left out.
fn error_bars(place: &Place, points: &[(f64, f64, f64, f64)], style: Style) -> Value {
    let centres: Vec<_> = points.iter().map(|p| (p.0, p.1)).collect();
    let ends: Value = points.iter().map(|p| json!([number(p.2), number(p.3)])).collect();
    let y = |unit: &str| {
        format!("%{{y{DIGITS}}}{unit} (%{{customdata[0]{DIGITS}}} to %{{customdata[1]{DIGITS}}}{unit})")
    };
    let more = json!({
        "marker": markers(style, 1),
        "customdata": ends,
        "hovertemplate": place.read_out(y),
        "error_y": {
            "type": "data",
            "symmetric": false,
            "array": numbers(points.iter().map(|p| p.3 - p.1)),
            "arrayminus": numbers(points.iter().map(|p| p.1 - p.2)),
            "color": css(style.colour()),
            "thickness": 1.2,
            "width": 3.5,
        },
    });
    scatter(place, &centres, "markers", more)
}

fn rule_line() -> Value {
    json!({"color": css(QUIET), "width": 1.0, "dash": dash(RULE_DASHES)})
}

fn horizontal_rule(chart: &mut Chart, place: &Place, label: Option<&str>, y: f64) {
    if !y.is_finite() {
        return;
    }
    let across = format!("{} domain", place.x);
    chart.shapes.push(json!({
        "type": "line", "xref": across, "yref": place.y, "x0": 0, "x1": 1, "y0": y, "y1": y, "line": rule_line(),
    }));
    if let Some(label) = label {
        chart.note(
            label,
            json!({
                "xref": across, "yref": place.y, "x": 1, "y": y, "xanchor": "right", "yanchor": "bottom",
            }),
        );
    }
}

fn vertical_rule(chart: &mut Chart, place: &Place, label: Option<&str>, x: f64) {
    if !x.is_finite() {
        return;
    }
    let along = format!("{} domain", place.y);
    chart.shapes.push(json!({
        "type": "line", "xref": place.x, "yref": along, "x0": x, "x1": x, "y0": 0, "y1": 1, "line": rule_line(),
    }));
    if let Some(label) = label {
        // Upright beside its rule: labels of close rules do not meet.
        chart.note(
            label,
            json!({
                "xref": place.x, "yref": along, "x": x, "y": 1, "xanchor": "right", "yanchor": "top",
                "textangle": -90,
            }),
        );
    }
}
