//! Layers as traces, shapes and annotations.

use super::super::layers::BAND_OPACITY;
use super::super::reduce::thin;
use super::super::style::{LINE_WIDTH, MARKER_RADIUS, Marker, QUIET, RING_RADIUS, RULE_DASHES, Style, WHITE};
use super::super::{Axis, AxisScale, Layer, Panel, Ticks};
use super::markup::{markup, quantity, template};
use super::{Chart, heat, lanes, number, numbers};
use serde_json::{Value, json};

/// Format of values in read-outs, with more digits than any usual sensor has.
const DIGITS: &str = ":.5~g";
/// Format of instants in read-outs.
pub(super) const X_DIGITS: &str = ":.6~g";

/// Beginnings of the read-outs of named traces: in a common read-out, and in a separate one.
const NAMED: [&str; 2] = ["%{fullData.name}: ", "%{fullData.name}<br>"];

/// Axes and ranges to which the layers of a panel are added.
pub(super) struct Place<'a> {
    pub panel: &'a Panel,
    /// Number of the panel in its figure; legend entries of different panels are switched apart.
    pub index: usize,
    /// Names of the axes, such as `x` and `y2`.
    pub x: &'a str,
    pub y: &'a str,
    /// First and last value shown.
    pub x_range: (f64, f64),
    pub y_range: (f64, f64),
    /// Bottom and top of the panel as shares of the chart, and its height in pixels.
    pub tall: (f64, f64, f64),
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
            place.push(chart, label.as_deref(), trace);
        }
        Layer::Band { label, points, style } => band(chart, place, label.as_deref(), points, *style),
        Layer::ErrorBars { label, points, style } => {
            place.push(chart, label.as_deref(), error_bars(place, points, *style, &markers(*style, 1)));
        }
        Layer::Hollow { label, points, style } => {
            let line = json!({"width": 1.4, "color": style.colour().css()});
            let ring = json!({
                "symbol": "circle", "size": 2.0 * RING_RADIUS, "color": WHITE.css(), "line": line,
            });
            place.push(chart, label.as_deref(), error_bars(place, points, *style, &ring));
        }
        Layer::UpperLimits { label, points, style } => {
            upper_limits(chart, place, label.as_deref(), points, *style);
        }
        Layer::Heat { x_edges, y_edges, values, colour, texts, blank } => {
            heat::add(chart, place, (x_edges, y_edges), (values, texts, blank), colour);
        }
        Layer::Hatched { label, spans } => {
            let ends = |(from, to): &(f64, f64)| {
                let (first, last) = place.x_range;
                [from, to].map(|x| place.x_end(*x).clamp(first, last))
            };
            let (low, high) = place.y_range;
            let strips = spans.iter().map(ends).filter(|[from, to]| from < to);
            let strips: Vec<_> = strips.map(|[from, to]| [from, to, low, high]).collect();
            heat::hatched(chart, place, &strips, label.as_deref(), "rgba(0,0,0,0)");
        }
        Layer::HorizontalRule { label, y } => horizontal_rule(chart, place, label.as_deref(), *y),
        Layer::VerticalRule { label, x } => vertical_rule(chart, place, label.as_deref(), *x),
        Layer::Lanes { lanes, categories } => lanes::add(chart, place, lanes, categories),
    }
}

impl Place<'_> {
    /// Adds a trace to its axes and, if it has a label, to the group that a legend entry switches.
    pub(super) fn push(&self, chart: &mut Chart, label: Option<&str>, mut trace: Value) {
        trace["xaxis"] = json!(self.x);
        trace["yaxis"] = json!(self.y);
        if let Some(label) = label {
            trace["name"] = json!(markup(label));
            trace["legendgroup"] = json!(group(self.index, label));
        } else if let Some(read) = trace["hovertemplate"].as_str() {
            // Plotly would call it "trace 3".
            let unnamed = NAMED.iter().find_map(|start| read.strip_prefix(start)).unwrap_or(read);
            trace["hovertemplate"] = json!(unnamed);
        }
        chart.data.push(trace);
    }

    /// Returns the read-out of a point; `y` writes the vertical value with its unit.
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

    /// Returns the text of each x on an axis of names: the nearest of them.
    fn names(&self, xs: impl Iterator<Item = f64>) -> Value {
        if !matches!(self.panel.x.ticks, Ticks::Named(_)) {
            return Value::Null;
        }
        xs.map(|x| nearest(&self.panel.x, x)).collect()
    }

    /// Returns the points that have a place on both axes; the others become gaps.
    fn placed(&self, points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
        let on = |axis: &Axis, value: f64| if axis.scale.has(value) { value } else { f64::NAN };
        points.map(|(x, y)| (on(&self.panel.x, x), on(&self.panel.y, y))).collect()
    }

    /// Returns a position on the horizontal axis for the end of a bar, band or whisker.
    pub(super) fn x_end(&self, value: f64) -> f64 {
        end(self.panel.x.scale, self.x_range, value)
    }

    /// Returns the upper end of an interval: far above the panel if it has none.
    fn beyond(&self, value: f64) -> f64 {
        let (first, last) = self.y_range;
        match self.panel.y.scale {
            _ if value != f64::INFINITY => value,
            AxisScale::Linear => last + 10.0 * (last - first),
            AxisScale::Log10 => last * (last / first).powi(10),
        }
    }

    /// Returns a position on the vertical axis for the end of a bar, band or whisker.
    pub(super) fn y_end(&self, value: f64) -> f64 {
        end(self.panel.y.scale, self.y_range, value)
    }
}

/// Returns the value. On a logarithmic axis, returns a value far below the range for zero and negative ones, as in the
/// drawn figure.
fn end(scale: AxisScale, (first, last): (f64, f64), value: f64) -> f64 {
    if scale == AxisScale::Log10 && value <= 0.0 {
        return (first * (first / last).powi(10)).max(1e-300);
    }
    value
}

/// Returns the name on an axis of names that is nearest to a place.
pub(super) fn nearest(axis: &Axis, place: f64) -> String {
    let Ticks::Named(names) = &axis.ticks else { return String::new() };
    let distance = |at: f64| if place.is_finite() { (place - at).abs() } else { f64::INFINITY };
    let nearest = names.iter().min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)));
    nearest.map_or_else(String::new, |(_, name)| markup(name))
}

/// Returns the legend group of a label in a panel.
pub(crate) fn group(panel: usize, label: &str) -> String {
    format!("{panel}:{label}")
}

/// Returns a scatter trace with the values of `more`.
fn scatter(place: &Place, points: &[(f64, f64)], mode: &str, more: Value) -> Value {
    let points = place.placed(points.iter().copied());
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
    let points = &short(place.placed(points.iter().copied()), place.x_range)[..];
    let look = json!({"line": {
        "color": style.colour().css(), "width": LINE_WIDTH, "dash": dash(style.dashes()), "shape": shape,
    }, "connectgaps": false});
    place.push(chart, label, scatter(place, points, "lines", look));
    // Between two gaps there is no line to draw, but there is a value.
    let known = |i: usize| points.get(i).is_some_and(|p| p.0.is_finite() && p.1.is_finite());
    let alone = |i: &usize| known(*i) && !known(i.wrapping_sub(1)) && !known(i + 1);
    let lone: Vec<_> = (0..points.len()).filter(alone).map(|i| points[i]).collect();
    if !lone.is_empty() {
        let look =
            json!({"marker": {"symbol": "circle", "size": 2.0 * LINE_WIDTH, "color": style.colour().css()}});
        place.push(chart, label, scatter(place, &lone, "markers", look));
    }
}

/// Longest line that is kept point by point. A longer one, as of a trace of seconds, would make a page of a hundred megabytes.
const LONGEST: usize = 20_000;

/// Shortens a long line to first, last, least and largest value of each of so many columns that no more points are left.
fn short(points: Vec<(f64, f64)>, (first, last): (f64, f64)) -> Vec<(f64, f64)> {
    if points.len() <= LONGEST { points } else { thin(&points, (last - first) / (LONGEST / 4 - 1) as f64) }
}

/// Returns the lengths of dashes and gaps in the notation of CSS, which Plotly uses.
fn dash(lengths: &[f64]) -> String {
    if lengths.is_empty() {
        return "solid".to_owned();
    }
    lengths.iter().map(|length| format!("{length}px")).collect::<Vec<_>>().join(",")
}

/// Markers that become small and translucent when there are many, as in the drawn figure.
fn markers(style: Style, count: usize) -> Value {
    let colour = style.colour().css();
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
    let usable = |p: &(f64, f64, f64)| place.panel.x.scale.has(p.0) && p.1.is_finite() && p.2.is_finite();
    // A fill would cross gaps: each stretch without one has its own pair of edges.
    for run in points.chunk_by(|a, b| usable(a) == usable(b)).filter(|run| usable(&run[0])) {
        let edge = json!({"color": style.colour().faded(0.8).css(), "width": 0.75});
        let lower: Vec<_> = run.iter().map(|p| (p.0, place.y_end(p.1))).collect();
        let upper: Vec<_> = run.iter().map(|p| (p.0, place.y_end(p.2))).collect();
        // The edges may be cut off.
        let ends: Value = run.iter().map(|p| json!([number(p.1), number(p.2)])).collect();
        let mut below = scatter(place, &lower, "lines", json!({"line": edge, "hoverinfo": "skip"}));
        below.as_object_mut().and_then(|trace| trace.remove("hovertemplate"));
        place.push(chart, label, below);
        let above = json!({
            "line": edge,
            "fill": "tonexty",
            "fillcolor": style.colour().faded(BAND_OPACITY).css(),
            "customdata": ends,
            "hovertemplate": place.read_out(|unit| {
                format!("%{{customdata[0]{DIGITS}}} to %{{customdata[1]{DIGITS}}}{unit}")
            }),
        });
        place.push(chart, label, scatter(place, &upper, "lines", above));
    }
}

/// Returns error bars. Points without a value are left out, because Plotly draws whiskers at a value only.
fn error_bars(place: &Place, points: &[(f64, f64, f64, f64)], style: Style, marker: &Value) -> Value {
    let centres: Vec<_> = points.iter().map(|p| (p.0, p.1)).collect();
    let ends: Value = points.iter().map(|p| json!([number(p.2), number(p.3)])).collect();
    let y = |unit: &str| {
        format!("%{{y{DIGITS}}}{unit} (%{{customdata[0]{DIGITS}}} to %{{customdata[1]{DIGITS}}}{unit})")
    };
    let more = json!({
        "marker": marker,
        "customdata": ends,
        "hovertemplate": place.read_out(y),
        "error_y": {
            "type": "data",
            "symmetric": false,
            "array": numbers(points.iter().map(|p| place.beyond(p.3) - p.1)),
            "arrayminus": numbers(points.iter().map(|p| p.1 - p.2)),
            "color": style.colour().css(),
            "thickness": 1.2,
            "width": 3.5,
        },
    });
    scatter(place, &centres, "markers", more)
}

/// Adds a bar and an arrow downwards, in two parts; the bar has the read-out.
fn upper_limits(chart: &mut Chart, place: &Place, label: Option<&str>, points: &[(f64, f64)], style: Style) {
    for (symbol, size, below) in
        [("line-ew-open", 7.2, 0.0), ("line-ns-open", 4.4, 3.2), ("arrow-down", 7.2, 13.0)]
    {
        let colour = style.colour().css();
        let width = if below == 0.0 { 1.6 } else { 1.2 };
        let line = json!({"width": if symbol == "arrow-down" { 0.0 } else { width }, "color": colour});
        let marker =
            json!({"symbol": symbol, "size": size, "standoff": below, "color": colour, "line": line});
        let mut trace = scatter(place, points, "markers", json!({"marker": marker}));
        if below == 0.0 {
            trace["hovertemplate"] = json!(place.read_out(|unit| format!("at most %{{y{DIGITS}}}{unit}")));
        } else {
            trace["hoverinfo"] = json!("skip");
            trace.as_object_mut().and_then(|trace| trace.remove("hovertemplate"));
        }
        place.push(chart, label, trace);
    }
}

/// Adds a rule with its label. On logarithmic axes, Plotly takes the values of shapes but the logarithms of
/// annotations.
fn rule(chart: &mut Chart, place: &Place, mut line: Value, label: Option<&str>, mut note: Value) {
    line["type"] = json!("line");
    // On hatching, marks and the colours of cells nothing could be read without a ground.
    let ground = WHITE.faded(0.75).css();
    note["bgcolor"] = json!(ground);
    if place.panel.has_cells() {
        let mut casing = line.clone();
        casing["line"] = json!({"color": ground, "width": 3.0});
        chart.shapes.push(casing);
    }
    line["line"] = json!({"color": QUIET.css(), "width": 1.0, "dash": dash(RULE_DASHES)});
    chart.shapes.push(line);
    if let Some(label) = label {
        chart.note(label, note);
    }
}

fn horizontal_rule(chart: &mut Chart, place: &Place, label: Option<&str>, y: f64) {
    let scale = place.panel.y.scale;
    if !scale.has(y) {
        return;
    }
    let across = format!("{} domain", place.x);
    let line = json!({"xref": across, "yref": place.y, "x0": 0, "x1": 1, "y0": y, "y1": y});
    let note = json!({
        "xref": across, "yref": place.y, "x": 1, "y": number(scale.even(y)), "xanchor": "right",
        "yanchor": "bottom",
    });
    rule(chart, place, line, label, note);
}

fn vertical_rule(chart: &mut Chart, place: &Place, label: Option<&str>, x: f64) {
    let scale = place.panel.x.scale;
    if !scale.has(x) {
        return;
    }
    let along = format!("{} domain", place.y);
    let line = json!({"xref": place.x, "yref": along, "x0": x, "x1": x, "y0": 0, "y1": 1});
    // Upright beside its rule: labels of close rules do not meet.
    let note = json!({
        "xref": place.x, "yref": along, "x": number(scale.even(x)), "y": 1, "xanchor": "right",
        "yanchor": "top", "textangle": -90,
    });
    rule(chart, place, line, label, note);
}
